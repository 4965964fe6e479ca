#include "cli/paper_figures.h"

#include <fmt/format.h>

#include <cmath>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "core/output_folder.h"
#include "core/text.h"
#include "pipeline/paper_figures.h"
#include "pipeline/paper_page.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kListPapers = "list";
constexpr const char* kAllPapers = "all";

Json NumberOrNull(double value) { return std::isfinite(value) ? Json(value) : Json(); }

Json StatementJson(const SaidResult& said) {
  return {{"says", said.says},
          {"where", said.where},
          {"printed", NumberOrNull(said.printed)},
          {"smallest", NumberOrNull(said.low)},
          {"computed", NumberOrNull(said.measured)},
          {"deviation", NumberOrNull(said.deviation())},
          {"unit", said.unit}};
}

Json PaperJson(const PaperOutcome& outcome, const std::string& folder) {
  auto figures = Json::array(), left_out = Json::array();
  for (const PaperResult& result : outcome.results) {
    auto statements = Json::array();
    for (const SaidResult& said : result.said) statements.push_back(StatementJson(said));
    figures.push_back({{"name", result.name},
                       {"title", result.title},
                       {"computed_from", result.from},
                       {"caption", result.caption},
                       {"statements", std::move(statements)},
                       {"differs", result.differs},
                       {"equation_audit", result.audit},
                       {"files", result.files}});
  }
  for (const auto& [name, why] : outcome.left_out) {
    left_out.push_back({{"name", name}, {"because", why}});
  }
  return {{"model", outcome.model},
          {"source", outcome.source},
          {"exit_code", outcome.exit_code},
          {"folder", folder},
          {"figures", std::move(figures)},
          {"left_out", std::move(left_out)},
          {"findings", FindingObjects(outcome.diagnostics)}};
}

// What was drawn, with what the paper says of it.
void SayPaper(const PaperOutcome& outcome, std::FILE* to) {
  Say(to, "{}\n", outcome.source);
  for (const PaperResult& result : outcome.results) {
    Say(to, "{:<8} {} → {}\n", result.name, result.title, Joined(result.files));
    for (const SaidResult& said : result.said) Say(to, "         {}\n", SayResult(said));
    if (!result.differs.empty()) Say(to, "         differs: {}\n", result.differs);
    for (const std::string& row : result.audit) Say(to, "         equation audit: {}\n", row);
  }
  for (const auto& [name, why] : outcome.left_out) Say(to, "{:<8} not computed: {}\n", name, why);
}

// "" or what went wrong.
std::string WritePaper(const PaperOutcome& outcome, const std::string& out, std::string* folder) {
  if (outcome.files.empty()) return "";
  OutputFolder to(out, outcome.model + "/paper");
  if (std::string trouble = to.WriteAll(outcome.files); !trouble.empty()) return trouble;
  *folder = to.target().string();
  Say(stderr, "figures in {}\n", *folder);
  return "";
}

int ListPapers(const JsonOption& json) {
  auto papers = Json::array();
  int exit_code = 0;
  for (const std::string& model : PaperModels()) {
    Diagnostics diagnostics;
    const auto paper = FindPaper(model, &diagnostics);
    SayText(stderr, diagnostics.Text());
    if (!paper) exit_code = 2;
    if (!paper) continue;
    auto figures = Json::array();
    Say(json.text(), "{}: {}\n", model, paper->source);
    for (const PaperEntry& entry : paper->entries) {
      Say(json.text(), "  {:<8} {}\n", entry.name.text, entry.title);
      figures.push_back({{"name", entry.name.text}, {"title", entry.title}});
    }
    papers.push_back(
        {{"model", model}, {"source", paper->source}, {"figures", std::move(figures)}});
  }
  return WorseExit(exit_code, json.Write({{"exit_code", exit_code}, {"papers", papers}}, {}));
}

}  // namespace

int PaperFigures(const PaperArguments& arguments, const JsonOption& json) {
  if (arguments.model == kListPapers) return ListPapers(json);
  const bool all = arguments.model == kAllPapers;
  FigureOptions options = arguments.options;
  options.only.insert(options.only.end(), arguments.entries.begin(), arguments.entries.end());
  if (all && !options.only.empty()) {
    return Refuse("--paper all takes no names of figures", "name one paper");
  }
  ProgressLine progress(true);
  FindingPrinter findings(stderr);
  std::vector<PaperOutcome> papers;
  auto results = Json::array();
  int exit_code = 0;
  for (const std::string& model : all ? PaperModels() : std::vector{arguments.model}) {
    if (progress.active()) {
      options.progress = [&](const std::string& stage, double fraction) {
        progress.Show(model + ": " + stage, fraction);
      };
    }
    papers.push_back(MakePaperFigures(model, options));
    progress.Clear();
    findings.Print(papers.back().diagnostics);
    SayPaper(papers.back(), json.text());
    std::string folder;
    if (const std::string lost = WritePaper(papers.back(), arguments.out, &folder); !lost.empty()) {
      return NotWritten(lost, "choose another folder with --out");
    }
    exit_code = WorseExit(exit_code, papers.back().exit_code);
    results.push_back(PaperJson(papers.back(), folder));
  }
  if (!arguments.page.empty() && exit_code < 2) {
    exit_code = WorseExit(exit_code, WriteWholeFile(arguments.page, PaperPage(papers), {}));
  }
  return WorseExit(exit_code, json.Write({{"exit_code", exit_code}, {"papers", results}}, {}));
}

}  // namespace mbv
