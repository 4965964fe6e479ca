// Texts that come from files, options and other programs, in everything that is written: nothing in
// them is obeyed by a terminal, a browser, a spreadsheet, LaTeX or a reader's eye.
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cctype>
#include <functional>
#include <nlohmann/json.hpp>
#include <sstream>

#include "base/diagnostics.h"
#include "base/json_text.h"
#include "base/markup.h"
#include "base/text.h"
#include "external/motion_text.h"
#include "features/convergence/converge.h"
#include "features/engines/crosscheck.h"
#include "features/mutation/mutation_report.h"
#include "features/paper/package_manifest.h"
#include "features/regress/history.h"
#include "features/regress/regress.h"
#include "features/regress/summaries.h"
#include "features/robots/survey.h"
#include "features/stiffness/stiffness_report.h"
#include "features/study/summary.h"
#include "plot/layout.h"
#include "plot/svg.h"
#include "report/document.h"
#include "report/result.h"
#include "tests/features/regress/regress_fixture.h"
#include "tests/support/reports.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

const std::vector<std::string> kHostile = {
    "\x1b[2J\x1b]0;title\x07",  // escapes of a terminal
    "a\xc2\x9b"
    "31mb\x7f\b",                                 // C1, DEL, backspace
    "one\rtwo\ntool: error: three\n\n# four",     // line ends
    "user\u202egnp.exe\u2066\u2069\u200e\u200f",  // the order of characters
    "in\u200bvi\u200dsi\u2060ble\ufeff\u00ad\u061c\u2028\U000e0041",
    "=cmd|' /C calc'!A0",
    "+1+1",
    "-2+3",
    "@SUM(A1)",
    "\t=1",
    " =2",
    "＝3",
    "a|b`c`*d*_e_[f](javascript:g)~h~$i$",
    "]]><script>alert(1)</script>\"'&<!--",
    "\\input{/etc/passwd}%#&~^{}$x_1$",
    "[optional]",
    "*starred",
    "a,b;\"c\"",
    "\xff\xfe\xed\xa0\x80\xc0\xaf",
    "../../etc",
    ""};

// Of what a reader does not see, or sees elsewhere.
const std::vector<std::string> kMarks = {"\u202a", "\u202b", "\u202d", "\u202e",    "\u2066",
                                         "\u2067", "\u2068", "\u2069", "\u200e",    "\u200f",
                                         "\u200b", "\u200c", "\u200d", "\u2060",    "\ufeff",
                                         "\u00ad", "\u061c", "\u2028", "\U000e0041"};

enum class Format { kTerminal, kMarkdown, kCsv, kXml, kHtml, kTex, kJson };

struct Writer {
  const char* name;
  Format format;
  std::function<std::string(const std::string&)> write;
};

// Reports in which every text is `text`.

CaseResult CaseOf(const std::string& text, bool failed) {
  CaseResult result = AgreeingCase("model/" + text, 2e-9);
  result.description = result.reason = result.log_tail = result.file = text;
  result.caveats = {text};
  result.not_compared = {{text, text}};
  result.compared = false;
  result.drifts.push_back({text, text, 5e-8, 2e-9, 7, text});
  result.metrics["simulated_vs_analytic.force_nrmse"] = {1e-3, 1e-6, false, text, 7.16};
  result.past = {7, 6, text, {}};
  if (failed) result.status = CaseStatus::kUnexpected;
  return result;
}

RegressReport RegressionOf(const std::string& text) {
  RegressReport report = OneRun({CaseOf(text, true), CaseOf(text + "2", false)}, text);
  report.run.host = report.run.program = report.run.shard = text;
  report.notes = {text};
  report.missing = {{text, 6, text}};
  return report;
}

Report MotionOf(const std::string& text) {
  Report report = test::FullReport();
  report.description = report.simulation = report.comparison.reason = text;
  report.comparison.attribution = {text, text};
  report.comparison.caveats = {{.kind = CaveatKind::kWitnessMissing,
                                .of = {text},
                                .text = text,
                                .gap = WitnessGap::kTimedOut}};
  report.findings.Add(test::Warning(text));
  for (WitnessRecord& record : report.witnesses) {
    for (Channel& channel : record.trace.channels) channel.name += text;
  }
  return report;
}

std::vector<CrosscheckRow> EnginesOf(const std::string& text) {
  return {{.mechanism = text, .scenario = text, .engine = text, .program = text, .why = text}};
}

MutationReport MutationOf(const std::string& text) {
  MutationReport report;
  report.scenario = text;
  report.mode = "forward";
  Mutation number;
  number.name = number.unit = number.reason = text;
  number.value = number.relative_to = 1.0;
  number.own.ran = true;
  number.own.reason = number.own.best_check = text;
  Mutation idle = number;
  idle.kind = NumberKind::kInstance;
  idle.proved_to = 1.0;
  report.mutations = {number, idle};
  report.faults.resize(1);
  report.faults[0].kind = report.faults[0].where = report.faults[0].reason = text;
  return report;
}

PackageDescription PackageOf(const std::string& text) {
  PackageDescription package;
  package.date = package.license = text;
  package.versions = {{"mbverify", text}, {text, text}};
  package.scenarios = {{.file = text,
                        .kind = "motion",
                        .results = "results/" + text,
                        .figures = text,
                        .exit_code = 0,
                        .verdict = text,
                        .description = text,
                        .reason = text}};
  package.meshes = {{text, text}};
  return package;
}

StiffnessReport StiffnessOf(const std::string& text) {
  StiffnessReport report = test::StiffArm();
  for (StiffnessWitness& witness : report.witnesses) witness.name = text;
  report.description = text;
  return report;
}

SurveyRow RobotOf(const std::string& text) {
  SurveyRow row;
  row.file = row.message = text;
  row.caveats = {text};
  return row;
}

Study StudyOf(const std::string& text) {
  Study study;
  study.factors = {{.name = text, .key = text, .axis = {}}};
  study.quantities = {{.name = text, .channel = text}};
  return study;
}

Mechanism MechanismOf(const std::string& text) {
  Mechanism mechanism;
  mechanism.bodies.resize(1);
  mechanism.bodies[0].name = text;
  mechanism.drives.resize(1);
  mechanism.drives[0].name = text;
  return mechanism;
}

HandedMotion HandedOf() {
  HandedMotion motion;
  motion.time_s = {0.0};
  DrivenSample sample;
  sample.position = sample.velocity = sample.acceleration = VecX::Zero(1);
  motion.driven = {sample};
  LoadSample load;
  load.body = 0;
  motion.loads = {{load}};
  motion.forced = {0};
  motion.forces = {{Jet{}}};
  return motion;
}

// A history whose texts are hostile, as one that others wrote may be.
std::string HistoryWith(const std::string& text, const std::string& path) {
  RegressReport report = RegressionOf(text);
  report.run.uid = "1";
  return AppendRun(path, {}, &report);
}

Table TableOf(const std::string& text) {
  return {.name = text, .caption = text, .columns = {{text}, {text, true}}, .rows = {{text, text}}};
}

const std::vector<Writer>& Writers() {
  static const std::vector<Writer> writers = {
      {"finding", Format::kTerminal,
       [](const std::string& t) {
         return ToText(Finding{Severity::kError, t, 1, 1, t, t});
       }},
      {"regress", Format::kTerminal,
       [](const std::string& t) { return ToSummaryText(RegressionOf(t)); }},
      {"history", Format::kTerminal,
       [](const std::string& t) {
         const test::TestFolder folder("hostile_history");
         const std::string path = folder.PathOf("h.sqlite");
         EXPECT_EQ(HistoryWith(t, path), "");
         return ListRuns(path).text + CompareRuns(path, "1", "1").text;
       }},
      {"crosscheck", Format::kTerminal, [](const std::string& t) { return ToText(EnginesOf(t)); }},
      {"mutate", Format::kTerminal,
       [](const std::string& t) { return ToText(MutationOf(t), false); }},
      {"verdict", Format::kTerminal,
       [](const std::string& t) { return VerdictLine(ViewOf(MotionOf(t)), {}); }},
      {"regress", Format::kMarkdown,
       [](const std::string& t) { return ToMarkdown(RegressionOf(t)); }},
      {"table", Format::kMarkdown, [](const std::string& t) { return ToMarkdown(TableOf(t)); }},
      {"crosscheck", Format::kMarkdown,
       [](const std::string& t) { return ToMarkdown(EnginesOf(t)); }},
      {"mutate", Format::kMarkdown,
       [](const std::string& t) { return ToText(MutationOf(t), true); }},
      {"package", Format::kMarkdown,
       [](const std::string& t) { return PackageReadme(PackageOf(t)); }},
      {"crosscheck", Format::kCsv, [](const std::string& t) { return ToCsv(EnginesOf(t)); }},
      {"converge", Format::kCsv,
       [](const std::string& t) {
         ConvergenceReport report;
         report.series.resize(1);
         report.series[0].name = t;
         report.series[0].points.resize(1);
         report.series[0].fit.pairwise = {1.0};
         report.series[0].fit.fitted = {true};
         report.series[0].fit.floor = {false};
         return ToCsv(report);
       }},
      {"stiffness", Format::kCsv,
       [](const std::string& t) { return StiffnessCsv(StiffnessOf(t)); }},
      {"loads", Format::kCsv, [](const std::string& t) { return LoadsCsv(StiffnessOf(t)); }},
      {"contributions", Format::kCsv,
       [](const std::string& t) { return ContributionsCsv(StiffnessOf(t)); }},
      {"survey", Format::kCsv, [](const std::string& t) { return SurveyCsv({RobotOf(t)}); }},
      {"study", Format::kCsv,
       [](const std::string& t) {
         PointRow row{.reason = t, .varied = {1.0}, .values = {2.0}};
         return PointHeader(StudyOf(t)) + PointLine(row, StudyOf(t));
       }},
      {"history", Format::kCsv,
       [](const std::string& t) {
         const test::TestFolder folder("hostile_export");
         const std::string path = folder.PathOf("h.sqlite");
         EXPECT_EQ(HistoryWith(t, path), "");
         return HistoryCsv(path).text;
       }},
      {"traces", Format::kCsv, [](const std::string& t) { return ToCsv(MotionOf(t)); }},
      {"motion", Format::kCsv,
       [](const std::string& t) { return MotionCsv(MechanismOf(t), HandedOf()); }},
      {"forces", Format::kCsv,
       [](const std::string& t) { return ForcesCsv(MechanismOf(t), HandedOf()); }},
      {"start", Format::kCsv,
       [](const std::string& t) {
         BodyStates start;
         start.X_WB = {Pose::Identity()};
         start.V_WB = {Vec6::Zero()};
         return StartCsv(MechanismOf(t), start);
       }},
      {"loads of a motion", Format::kCsv,
       [](const std::string& t) { return LoadsCsv(MechanismOf(t), HandedOf()); }},
      {"junit", Format::kXml, [](const std::string& t) { return ToJUnit(RegressionOf(t)); }},
      {"figure", Format::kXml,
       [](const std::string& t) {
         return SvgFigure(1, 1, t, SvgText({{"x", 1.0}, {"class", t}}, t));
       }},
      {"regress", Format::kHtml,
       [](const std::string& t) { return ToIndexPages(RegressionOf(t), {}).front(); }},
      {"crosscheck", Format::kHtml, [](const std::string& t) { return ToHtml(EnginesOf(t)); }},
      {"stiffness", Format::kHtml,
       [](const std::string& t) {
         StiffnessReport report = test::StiffArm();  // a page finds its witnesses by name
         report.description = report.pose_note = report.loads_text = report.scenario_file = t;
         return ToHtml(report);
       }},
      {"survey", Format::kHtml, [](const std::string& t) { return SurveyHtml({RobotOf(t)}, t); }},
      {"data of a page", Format::kHtml,
       [](const std::string& t) {
         return EscapeScript(DumpLine(nlohmann::ordered_json({{"a", t}})));
       }},
      {"table", Format::kTex, [](const std::string& t) { return ToLatex(TableOf(t)); }},
      {"figure", Format::kTex, [](const std::string& t) { return ToTex(AsPlainText(t)); }},
      {"regress", Format::kJson, [](const std::string& t) { return ToJson(RegressionOf(t)); }},
      {"crosscheck", Format::kJson, [](const std::string& t) { return ToJson(EnginesOf(t)); }},
      {"mutate", Format::kJson, [](const std::string& t) { return ToJson(MutationOf(t)); }},
      {"survey", Format::kJson, [](const std::string& t) { return SurveyJson({RobotOf(t)}); }},
      {"manifest", Format::kJson, [](const std::string& t) { return ManifestJson(PackageOf(t)); }},
      {"crate", Format::kJson, [](const std::string& t) { return CrateJson(PackageOf(t)); }},
      {"line", Format::kJson, [](const std::string& t) {
         return DumpLine(nlohmann::json({{"a", t}}));
       }}};
  return writers;
}

// Cells of a CSV text [RFC 4180].
std::vector<std::vector<std::string>> CsvRows(const std::string& text) {
  std::vector<std::vector<std::string>> rows(1, {""});
  bool quoted = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (quoted && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
      rows.back().back() += text[++i];
    } else if (c == '"') {
      quoted = !quoted;
    } else if (!quoted && c == ',') {
      rows.back().emplace_back();
    } else if (!quoted && c == '\n') {
      if (i + 1 < text.size()) rows.push_back({""});
    } else {
      rows.back().back() += c;
    }
  }
  return rows;
}

std::string CsvTrouble(const std::string& text) {
  const auto rows = CsvRows(text);
  for (const auto& row : rows) {
    if (row.size() != rows[0].size())
      return fmt::format("{} cells of {}", row.size(), rows[0].size());
    for (const std::string& cell : row) {
      char* end = nullptr;
      (void)std::strtod(cell.c_str(), &end);
      const bool number = !cell.empty() && *end == '\0';
      const size_t at = cell.find_first_not_of(' ');
      const std::string begin = at == std::string::npos ? "" : cell.substr(at);
      for (const char* sign : {"=", "+", "-", "@", "＝"}) {
        if (!number && begin.starts_with(sign)) return "the cell " + cell;
      }
    }
  }
  return "";
}

// Signs that are markup, outside of code.
std::string MarkdownTrouble(const std::string& text) {
  std::istringstream stream(text);
  size_t cells = 0;
  for (std::string line; std::getline(stream, line);) {
    bool code = false;
    size_t bars = 0;
    for (size_t i = 0; i < line.size(); ++i) {
      if (!code && line[i] == '\\') {
        ++i;
      } else if (line[i] == '`') {
        code = !code;
      } else if (line[i] == '|') {
        ++bars;
      }
    }
    if (code) return "code without an end: " + line;
    if (bars == 0) cells = 0;
    if (bars > 0 && cells > 0 && bars != cells) return "a row of other cells: " + line;
    if (bars > 0) cells = bars;
    for (const char* sign : {"](javascript", "<script", "*d*", "_e_", "~h~", "$i$", "`c`"}) {
      const size_t at = line.find(sign);
      if (at != std::string::npos && (at == 0 || line[at - 1] != '\\')) return line;
    }
    if (line.starts_with("tool: error") || line.starts_with("# four")) return "a line: " + line;
  }
  return "";
}

// Braces that close, and no command but those of the writer.
std::string TexTrouble(const std::string& text) {
  int depth = 0;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\\') {
      ++i;
    } else if (text[i] == '{') {
      ++depth;
    } else if (text[i] == '}' && --depth < 0) {
      return "a brace too many";
    }
  }
  if (depth != 0) return "a brace is open";
  if (text.find("\\input") != std::string::npos) return "a command";
  std::string bare = text;
  for (const char* ours : {"% needs \\usepackage{booktabs}\n", "\\\\\n"}) {
    for (size_t at; (at = bare.find(ours)) != std::string::npos;) {
      // What follows the end of a row would be its argument.
      const size_t next = bare.find_first_not_of(" \n", at + std::string(ours).size());
      if (next != std::string::npos && (bare[next] == '[' || bare[next] == '*'))
        return "an argument";
      bare.erase(at, std::string(ours).size());
    }
  }
  for (size_t i = 1; i < bare.size(); ++i) {
    if (std::string_view("%#~$").find(bare[i]) != std::string_view::npos && bare[i - 1] != '\\') {
      return "a sign: " + bare.substr(i, 20);
    }
  }
  return "";
}

std::string TroubleOf(Format format, const std::string& out, const std::string& text) {
  if (FindNonText(out) != std::string::npos) return "what is not text";
  for (const std::string& mark : kMarks) {
    if (out.find(mark) != std::string::npos) return "the mark " + OneLine(mark);
  }
  switch (format) {
    case Format::kTerminal:
      if (out.find('\r') != std::string::npos) return "a carriage return";
      return ("\n" + out).find("\ntool: error") != std::string::npos ? "a line of its own" : "";
    case Format::kMarkdown:
      return MarkdownTrouble(out);
    case Format::kCsv:
      return CsvTrouble(out);
    case Format::kXml: {
      tinyxml2::XMLDocument document;
      if (document.Parse(out.c_str()) != tinyxml2::XML_SUCCESS) return "no XML";
      return out.find("]]>") != std::string::npos ? "the end of a CDATA section" : "";
    }
    case Format::kHtml: {
      const bool opens =
          out.find("<script>alert") != std::string::npos || out.find("\"'&<") != std::string::npos;
      return opens ? "markup" : "";
    }
    case Format::kTex:
      return TexTrouble(out);
    case Format::kJson: {
      const auto json = nlohmann::json::parse(out, nullptr, false);
      if (json.is_discarded()) return "no JSON";
      // The value is the same, where it is text; a mark is one of it.
      const bool same = !text.empty() && FindNonText("a" + text) == std::string::npos;
      const auto has = [&](const auto& self, const nlohmann::json& node) -> bool {
        if (node.is_string())
          return node.get_ref<const std::string&>().find(text) != std::string::npos;
        return node.is_structured() &&
               std::any_of(node.begin(), node.end(),
                           [&](const nlohmann::json& inner) { return self(self, inner); });
      };
      return same && !has(has, json) ? "another value" : "";
    }
  }
  return "?";
}

TEST(HostileTexts, AreHarmlessInEveryWriter) {
  for (const Writer& writer : Writers()) {
    for (const std::string& text : kHostile) {
      std::string out = writer.write(text);
      if (writer.format == Format::kTerminal) out = ForTerminal(out);
      EXPECT_EQ(TroubleOf(writer.format, out, text), "")
          << writer.name << " of " << Printable(text) << ":\n"
          << Printable(out.substr(0, 3000));
    }
  }
}

// The checks see what they are for.
TEST(HostileTexts, AreSeenByTheChecks) {
  const std::vector<std::pair<Format, std::string>> bad = {
      {Format::kTerminal, "a\x1b[2J"},
      {Format::kTerminal, "a\u202e"},
      {Format::kTerminal, "a\ntool: error"},
      {Format::kMarkdown, "| a | b |\n|---|---|\n| c | d | e |\n"},
      {Format::kMarkdown, "a `c` b"},
      {Format::kMarkdown, "a ` b"},
      {Format::kMarkdown, "[f](javascript:g)"},
      {Format::kCsv, "a,b\n1,=2+3\n"},
      {Format::kCsv, "a,b\n1,2,3\n"},
      {Format::kXml, "<a><b></a>"},
      {Format::kXml, "<a>\x01</a>"},
      {Format::kHtml, "<p><script>alert(1)</script></p>"},
      {Format::kTex, "a {"},
      {Format::kTex, "a & b \\\\\n[c]"},
      {Format::kTex, "5 %"},
      {Format::kJson, "{\"a\": \"\u200b\"}"},
      {Format::kJson, "{\"a\": \"b\"}"}};
  for (const auto& [format, out] : bad) {
    EXPECT_NE(TroubleOf(format, out, "another"), "") << Printable(out);
  }
}

}  // namespace
}  // namespace mbv
