// mbverify audit
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "base/diagnostics.h"
#include "base/inputs.h"
#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/equation_audit/audit.h"
#include "features/equation_audit/file_audit.h"
#include "report/document.h"
#include "report/page.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct AuditArguments {
  std::string model;
  std::string page;  // an HTML file
  std::string of;    // the model of a file of equations
  bool markdown = false, no_search = false, quiet = false;
  JsonOption json;
};

std::string Word(AuditVerdict verdict, bool color) {
  const char* code = verdict == AuditVerdict::kOk                ? "32"
                     : verdict == AuditVerdict::kApproximation   ? "36"
                     : verdict == AuditVerdict::kWrong           ? "33"
                     : verdict == AuditVerdict::kNearly          ? "33"
                     : verdict == AuditVerdict::kWrongAsGiven    ? "1;31"
                     : verdict == AuditVerdict::kWrongAndUnfixed ? "1;31"
                                                                 : "2";
  const std::string text = ToText(verdict);
  return color ? fmt::format("\x1b[{}m{}\x1b[0m", code, text) : text;
}

std::string RowText(const AuditRow& row, bool color) {
  std::string text =
      fmt::format("  {:<28} {:<5} {}\n", row.equation, row.erratum, Word(row.verdict, color));
  if (!row.printed.empty()) text += fmt::format("      printed:   {}\n", row.printed);
  if (!row.corrected.empty()) text += fmt::format("      corrected: {}\n", row.corrected);
  if (row.verdict != AuditVerdict::kNotTestable) {
    text += "      residual: ";
    if (!row.corrected.empty()) {
      text +=
          fmt::format("printed {}, corrected ", std::isnan(row.residual_printed)
                                                    ? "not evaluated"
                                                    : fmt::format("{:.2e}", row.residual_printed));
    }
    text += fmt::format("{:.2e} (limit {:.1e}) {} of {:.3g}\n", row.residual_corrected, row.limit,
                        row.unit, row.scale);
  }
  if (row.verdict == AuditVerdict::kNearly || row.verdict == AuditVerdict::kApproximation) {
    text += fmt::format("      {:.1f} digits\n", row.digits);
  }
  for (const std::string& slip : row.slips) text += fmt::format("      right with {}\n", slip);
  if (!row.note.empty()) text += fmt::format("      {}\n", row.note);
  return text;
}

bool IsWrong(AuditVerdict verdict) {
  return verdict == AuditVerdict::kWrongAndUnfixed || verdict == AuditVerdict::kNearly ||
         verdict == AuditVerdict::kWrongAsGiven;
}

void PrintTable(const AuditTable& table, std::FILE* to, bool color) {
  Say(to, "{}: {}\n", table.mechanism, table.source);
  size_t ok = 0, near = 0, wrong = 0, unfixed = 0;
  for (const AuditRow& row : table.rows) {
    SayText(to, RowText(row, color));
    ok += row.verdict == AuditVerdict::kOk ? 1 : 0;
    near += row.verdict == AuditVerdict::kApproximation ? 1 : 0;
    wrong += row.verdict == AuditVerdict::kWrong ? 1 : 0;
    unfixed += IsWrong(row.verdict) ? 1 : 0;
  }
  Say(to,
      "  {} rows: {} right as printed, {} approximations, {} wrong as printed and corrected, {} "
      "{}, {} without a residual\n\n",
      table.rows.size(), ok, near, wrong, unfixed, table.of_file ? "wrong" : "unexplained",
      table.rows.size() - ok - near - wrong - unfixed);
}

nlohmann::ordered_json TableJson(const AuditTable& table) {
  auto rows = nlohmann::ordered_json::array();
  for (const AuditRow& row : table.rows) {
    rows.push_back({{"equation", row.equation},
                    {"erratum", row.erratum},
                    {"verdict", ToText(row.verdict)},
                    {"printed", row.printed},
                    {"corrected", row.corrected},
                    {"residual_printed", Number(row.residual_printed)},
                    {"residual_corrected", Number(row.residual_corrected)},
                    {"limit", Number(row.limit)},
                    {"scale", Number(row.scale)},
                    {"unit", row.unit},
                    {"digits", Number(row.digits)},
                    {"slips", row.slips},
                    {"note", row.note}});
  }
  return {{"mechanism", table.mechanism}, {"source", table.source}, {"rows", std::move(rows)}};
}

// What a page shows of it: the one to send to an author.
std::string AuditPage(const AuditTable& table) {
  ReportSection section{.title = "Equations", .link = "Equations"};
  Table rows{.name = "equations",
             .columns = {Text("equation"), Text("verdict"), Wide("as printed"), Wide("corrected"),
                         Wide("right with"), Digits("off by"), Digits("size"), Wide("note")}};
  size_t wrong = 0;
  for (const AuditRow& row : table.rows) {
    const bool bad = IsWrong(row.verdict) || row.verdict == AuditVerdict::kWrong;
    wrong += bad ? 1 : 0;
    const Mark mark = bad                                         ? Mark::kFail
                      : row.verdict == AuditVerdict::kOk          ? Mark::kOk
                      : row.verdict == AuditVerdict::kNotTestable ? Mark::kOff
                                                                  : Mark::kWarn;
    std::string right;
    for (const std::string& slip : row.slips) right += (right.empty() ? "" : "; ") + slip;
    const std::string unit = row.unit == "1" ? "" : " " + row.unit;
    rows.rows.push_back(
        {row.equation, Cell(ToText(row.verdict), mark), row.printed, row.corrected, right,
         std::isnan(row.residual_printed) ? std::string("not evaluated")
                                          : fmt::format("{:.2e}", row.residual_printed),
         fmt::format("{:.3g}{}", row.scale, unit), row.note});
  }
  section.Add(std::move(rows));
  section.Note(
      "Each equation is evaluated at random states and held against an independent solver of the "
      "same model, which closes the loops numerically and knows no equation of the file. \"Right "
      "with\" lists changes of the printed form that were tried and make it right at all states.");
  Page page;
  page.Add(section);
  return page.Write({.kicker = "mbverify audit",
                     .title = table.mechanism,
                     .lead = fmt::format("{} of {} equations are wrong as printed. {}", wrong,
                                         table.rows.size(), table.source),
                     .judges = false});
}

bool IsFile(const std::string& text) {
  return text.ends_with(".py") || text.ends_with(".m") || text.ends_with(".yaml") ||
         text.ends_with(".yml");
}

int AuditOfFile(const AuditArguments& arguments) {
  InputWatch inputs;
  Diagnostics diagnostics;
  std::optional<AuditTable> table;
  {
    ProgressLine line(!arguments.quiet);
    FileAuditOptions options{.search = !arguments.no_search, .model = arguments.of};
    options.progress = [&](const std::string& equation, double fraction) {
      line.Show("equation " + equation, fraction);
    };
    table = AuditFile(arguments.model, options, &diagnostics);
  }
  SayText(stderr, diagnostics.Text());
  if (!table) return 2;
  table->of_file = true;
  std::FILE* to = arguments.json.text();
  if (arguments.markdown) {
    fmt::print(to, "{}", ToMarkdown(*table, AuditNumbers::kMeasured));
  } else {
    PrintTable(*table, to, WantsColor(to));
  }
  int exit_code = std::ranges::any_of(table->rows, IsWrong, &AuditRow::verdict) ? 1 : 0;
  if (!arguments.page.empty()) {
    exit_code =
        WorseExit(exit_code, WriteWholeFile(arguments.page, AuditPage(*table), inputs.files()));
  }
  return WorseExit(exit_code,
                   arguments.json.Write({{"audits", {TableJson(*table)}}}, inputs.files()));
}

// Exit 1 if a corrected form misses its limit: then the corrections are wrong, too.
int Audit(const AuditArguments& arguments) {
  if (IsFile(arguments.model)) return AuditOfFile(arguments);
  if (!arguments.page.empty()) return Refuse("--page is of a file of equations", "");
  if (!arguments.of.empty()) return Refuse("--model is of a file of equations", "");
  std::vector<std::string> names;
  int exit_code = 0;
  bool found = false;
  auto audits = nlohmann::ordered_json::array();
  for (const AuditEntry& entry : Audits()) {
    names.push_back(entry.mechanism);
    if (!arguments.model.empty() && entry.mechanism != arguments.model) continue;
    found = true;
    // A model of the same name in the current folder may be another one.
    const auto models_dir = ShippedModels();
    if (!models_dir) {
      Say(stderr, "error: the models that come with the program are not found\n");
      return 2;
    }
    const AuditTable table = entry.run(models_dir->string());
    audits.push_back(TableJson(table));
    if (arguments.markdown) {
      fmt::print(arguments.json.text(), "{}", ToMarkdown(table));
    } else {
      PrintTable(table, arguments.json.text(), WantsColor(arguments.json.text()));
    }
    for (const AuditRow& row : table.rows) {
      if (row.verdict == AuditVerdict::kWrongAndUnfixed) exit_code = 1;
    }
  }
  if (found) {
    return WorseExit(exit_code, arguments.json.Write({{"audits", std::move(audits)}}, {}));
  }
  return Refuse(fmt::format("there is no equation audit of '{}'", arguments.model),
                DidYouMean(arguments.model, names, "audited: " + Joined(names)));
}

}  // namespace

void AddAuditCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<AuditArguments>();
  CLI::App* audit =
      app->add_subcommand("audit", "Each equation of a paper, as printed and as corrected");
  audit->add_option("model", arguments->model,
                    "model name, or a file of equations (.py, .m, .yaml), which runs as you; all "
                    "shipped papers without it");
  audit->add_flag("--markdown", arguments->markdown, "print a Markdown table");
  audit->add_option("--model", arguments->of,
                    "of a file: the model it is audited with, instead of the one it names");
  audit->add_option("--page", arguments->page, "of a file: write what was found as an HTML page");
  audit->add_flag("--no-search", arguments->no_search,
                  "of a file: do not search what would make wrong equations right");
  audit->add_flag("--quiet,-q", arguments->quiet, "no progress");
  arguments->json.AddTo(audit);
  SetFooter(audit, {"audit scara_robot", "audit my_delta/equations.py --page audit.html"},
            "0 every equation, or its corrected form, holds, 1 one does not, 2 bad input");
  audit->callback([arguments, exit_code] { *exit_code = Audit(*arguments); });
}

}  // namespace mbv
