// `mbverify figures --paper`.

#include <fmt/format.h>
#include <memory>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/paper/figures.h"
#include "features/paper/paper_figures.h"
#include "features/paper/signals.h"
#include "plot/style.h"

namespace mbv {

struct PaperArguments {
  std::string model;                 ///< "list": what there is; "all": every paper
  std::vector<std::string> entries;  ///< empty: all of the paper
  std::string out, page;             ///< page: "" or a file for all of it as Markdown
  FigureOptions options;
};

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kListPapers = "list";
constexpr const char* kAllPapers = "all";

Json StatementJson(const StatedResult& said) {
  return {{"says", said.says},
          {"where", said.where},
          {"printed", Number(said.printed)},
          {"smallest", Number(said.low)},
          {"computed", Number(said.measured)},
          {"deviation", Number(said.deviation())},
          {"unit", said.unit}};
}

Json PaperJson(const PaperOutcome& outcome, const std::string& folder) {
  auto figures = Json::array(), left_out = Json::array();
  for (const PaperResult& result : outcome.results) {
    auto statements = Json::array();
    for (const StatedResult& said : result.said) statements.push_back(StatementJson(said));
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
    for (const StatedResult& said : result.said) Say(to, "         {}\n", ResultText(said));
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

// The exit code, after saying what was made.
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

namespace {

struct FiguresArguments {
  std::vector<std::string> scenarios, set, formats = {"pdf", "svg"}, only, also;
  std::string style = "ieee", language = "en", out = "figures", paper, page;
  double width_mm = 0, font_pt = 0;
  bool trust = false;
  JsonOption json;
};

// A style by its name, or from a file; false after saying what is wrong with it.
bool ReadStyle(const std::string& name, FigureStyle* style) {
  if (const FigureStyle* known = FindFigureStyle(name)) {
    *style = *known;
    return true;
  }
  Diagnostics diagnostics;
  const auto loaded = LoadFigureStyle(name, &diagnostics);
  SayText(stderr, diagnostics.Text());
  if (loaded) *style = *loaded;
  return loaded.has_value();
}

bool MakeFigureOptions(const FiguresArguments& arguments, FigureOptions* options) {
  if (!ReadStyle(arguments.style, &options->style)) return false;
  if (arguments.width_mm > 0) options->style.width_mm = arguments.width_mm;
  if (arguments.font_pt > 0) options->style.font_pt = arguments.font_pt;
  options->language = LanguageOf(arguments.language);
  options->formats = arguments.formats;
  options->only = arguments.only;
  options->also = arguments.also;
  return ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options->scenario.set);
}

// What was drawn, one figure a line; "" or what went wrong.
std::string Deliver(const FiguresArguments& arguments, const FigureOutcome& outcome,
                    std::string* written) {
  for (const MadeFigure& made : outcome.figures) {
    Say(arguments.json.text(), "{:<24} {}\n", made.figure.name, Joined(made.files));
  }
  for (const std::string& text : outcome.left_out) {
    Say(arguments.json.text(), "left out: {}\n", text);
  }
  if (outcome.files.empty()) return "";
  OutputFolder folder(arguments.out, outcome.mechanism + "/" + outcome.scenario);
  if (std::string trouble = folder.WriteAll(outcome.files); !trouble.empty()) return trouble;
  *written = folder.target().string();
  Say(stderr, "figures in {}\n", *written);
  return "";
}

nlohmann::ordered_json OutcomeJson(const std::string& file, const FigureOutcome& outcome,
                                   const std::string& folder) {
  auto figures = nlohmann::ordered_json::array();
  for (const MadeFigure& made : outcome.figures) {
    figures.push_back(
        {{"name", made.figure.name}, {"caption", made.figure.caption}, {"files", made.files}});
  }
  return {{"scenario_file", file},
          {"exit_code", outcome.exit_code},
          {"verdict", outcome.verdict},
          {"folder", folder},
          {"figures", std::move(figures)},
          {"left_out", outcome.left_out},
          {"findings", FindingObjects(outcome.diagnostics)}};
}

int MakeOneFile(const FiguresArguments& arguments) {
  FigureOptions options;
  if (!MakeFigureOptions(arguments, &options)) return 2;
  if (!arguments.paper.empty()) {
    if (!arguments.set.empty()) return Refuse("--paper and --set do not go together", "");
    options.programs.all = arguments.trust;
    return PaperFigures(
        {arguments.paper, arguments.scenarios, arguments.out, arguments.page, options},
        arguments.json);
  }
  if (arguments.scenarios.empty()) {
    return Refuse("which scenario?", "name scenarios, or a paper with --paper");
  }
  int exit_code = 0;
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code == 0) {
    exit_code = AskForPrograms(files, options.scenario, arguments.trust, false, &options.programs);
  }
  if (exit_code != 0) return exit_code;
  ProgressLine progress(true);
  FindingPrinter findings(stderr);
  auto results = nlohmann::ordered_json::array();
  for (const std::string& file : files) {
    if (progress.active()) {
      options.progress = [&](const std::string& stage, double fraction) {
        progress.Show(file + ": " + stage, fraction);
      };
    }
    const FigureOutcome outcome = MakeFigures(file, options);
    progress.Clear();
    findings.Print(outcome.diagnostics);
    std::string folder;
    if (const std::string lost = Deliver(arguments, outcome, &folder); !lost.empty()) {
      return NotWritten(lost, "choose another folder with --out");
    }
    exit_code = WorseExit(exit_code, outcome.exit_code);
    results.push_back(OutcomeJson(file, outcome, folder));
  }
  return WorseExit(exit_code,
                   arguments.json.Write({{"exit_code", exit_code}, {"results", std::move(results)}},
                                        {{arguments.style, ""}}));
}

// What a style file may say, an option may.
CLI::Validator InRangeOf(const std::string& key) {
  for (const StyleRange& range : StyleRanges()) {
    if (key == range.key) return CLI::Range(range.least, range.most);
  }
  return {};
}

std::vector<std::string> StyleNames() {
  std::vector<std::string> names;
  for (const FigureStyle& style : FigureStyles()) names.push_back(style.name);
  return names;
}

// One of the names, or a file of the user's.
CLI::Validator StyleOrFile() {
  const CLI::Validator names = OneOf(StyleNames());
  return CLI::Validator(
      [names](std::string& text) { return text.ends_with(".yaml") ? "" : names(text); },
      "one of " + Joined(StyleNames()));
}

}  // namespace

void AddFiguresCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<FiguresArguments>();
  CLI::App* figures = app->add_subcommand(
      "figures", "Figures for a paper: forces, motion, reactions, power, maps of stiffness");
  figures->add_option(
      "scenario", arguments->scenarios,
      "scenario or study files, or folders of scenarios; with --paper names of its figures");
  auto* paper = figures->add_option(
      "--paper", arguments->paper,
      "the figures of this model's paper instead, all if none is named; list: which there are");
  figures
      ->add_option("--page", arguments->page, "a Markdown FILE that shows them, beside pictures/")
      ->needs(paper);
  figures
      ->add_option("--style", arguments->style,
                   "column width, fonts and lines of a journal; or a style FILE.yaml")
      ->check(StyleOrFile())
      ->capture_default_str();
  figures->add_option("--lang", arguments->language, "language of axes and legends")
      ->check(OneOf(LanguageCodes()))
      ->capture_default_str();
  figures->add_option("--formats", arguments->formats, "files of each figure")
      ->delimiter(',')
      ->check(OneOf(FigureFormats()))
      ->capture_default_str();
  figures->add_option("--only", arguments->only, "names of the figures that are wanted")
      ->delimiter(',');
  figures
      ->add_option("--also", arguments->also,
                   "errors against the step (runs the motion again and again), sections of the "
                   "workspace")
      ->delimiter(',')
      ->check(OneOf(MoreFigures()));
  figures->add_option("--width-mm", arguments->width_mm, "instead of the style's width")
      ->check(InRangeOf("width_mm"));
  figures->add_option("--font-pt", arguments->font_pt, "instead of the style's size of texts")
      ->check(InRangeOf("font_pt"));
  figures->add_option("--out", arguments->out, "folder for the figures")->capture_default_str();
  AddTrustOption(figures, &arguments->trust);
  arguments->json.AddTo(figures);
  figures
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  SetFooter(figures,
            {"figures scenarios/stabilizing_platform/sea_state.yaml",
             "figures stewart/wave --style springer --lang de --only drive_forces",
             "figures scara_robot/stiffness --formats pdf,pgf --width-mm 120",
             "figures scenarios/slider_crank/turn.yaml --also convergence",
             "figures --paper stabilizing_platform fig10 fig11 fig13"},
            "0 agree, 1 disagree (drawn all the same), 2 bad input, 3 could not run, 4 internal "
            "error");
  figures->callback([arguments, exit_code] { *exit_code = MakeOneFile(*arguments); });
}

}  // namespace mbv
