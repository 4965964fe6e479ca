// mbverify crosscheck
#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "pipeline/run_scenario.h"
#include "report/crosscheck.h"

namespace mbv {
namespace {

struct CrosscheckArguments {
  std::vector<std::string> scenarios, set;
  std::vector<std::string> engines = {"simbody=mbverify-witness-simbody",
                                      "mujoco_newest=mbverify-witness-mujoco",
                                      "mujoco_newest_default=mbverify-witness-mujoco --defaults"};
  std::string markdown, csv, html;
  JsonOption json;
};

// A word that names a file here names it anywhere: the program runs in another folder.
std::string Placed(const std::string& word) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(word, error)) return word;
  return std::filesystem::absolute(word).string();
}

// `witnesses:` of all engines that are asked for, in place of the scenarios' own.
std::optional<SetValue> WitnessesOf(const std::vector<std::string>& engines) {
  std::string text;
  for (const std::string& engine : engines) {
    const auto named = SplitSet(engine);
    if (!named) return {};
    std::string words;
    for (size_t at = 0; at < named->second.size();) {
      const size_t end = std::min(named->second.find(' ', at), named->second.size());
      if (end > at)
        words += fmt::format("{}\"{}\"", words.empty() ? "" : ", ",
                             Placed(named->second.substr(at, end - at)));
      at = end + 1;
    }
    text += fmt::format("{}{}: {{command: [{}]}}", text.empty() ? "" : ", ", named->first, words);
  }
  return SetValue{"witnesses", "{" + text + "}"};
}

int WriteAll(const CrosscheckArguments& arguments, const std::vector<CrosscheckRow>& rows) {
  SayText(arguments.json.text(), ToText(rows));
  int exit_code = arguments.json.Write(ToJson(rows), {});
  const std::pair<const std::string&, std::string (*)(const std::vector<CrosscheckRow>&)> files[] =
      {{arguments.markdown, &ToMarkdown}, {arguments.csv, &ToCsv}, {arguments.html, &ToHtml}};
  for (const auto& [path, write] : files) {
    if (!path.empty()) exit_code = WorseExit(exit_code, WriteWholeFile(path, write(rows), {}));
  }
  return exit_code;
}

// What one scenario's engines give; its exit code. A disagreement is a result here.
int AddRows(const std::string& file, const RunOptions& options, std::vector<CrosscheckRow>* rows) {
  const RunOutcome outcome = RunScenario(file, options);
  if (!outcome.report) {
    SayText(stderr, outcome.diagnostics.Text());
    if (outcome.exit_code == 2) return 2;
    return Refuse(file + " is no motion", "crosscheck takes scenarios with a motion");
  }
  const std::vector<CrosscheckRow> more = CrosscheckRows(*outcome.report);
  rows->insert(rows->end(), more.begin(), more.end());
  return outcome.exit_code == 3 ? 3 : 0;
}

int RunCrosscheck(const CrosscheckArguments& arguments) {
  RunOptions options;
  options.out_dir.clear();
  options.pictures = options.page = false;
  const auto witnesses = WitnessesOf(arguments.engines);
  if (!witnesses) return Refuse("--engine: write NAME=COMMAND", "");
  options.scenario.set.push_back(*witnesses);
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files = FilesToRun(
      arguments.scenarios,
      {arguments.json.path(), arguments.markdown, arguments.csv, arguments.html}, &exit_code);
  std::vector<CrosscheckRow> rows;
  for (size_t i = 0; i < files.size(); ++i) {
    Say(stderr, "{} of {}: {}\n", i + 1, files.size(), files[i]);
    exit_code = WorseExit(exit_code, AddRows(files[i], options, &rows));
  }
  return rows.empty() ? exit_code : WorseExit(exit_code, WriteAll(arguments, rows));
}

}  // namespace

void AddCrosscheckCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CrosscheckArguments>();
  CLI::App* crosscheck = app->add_subcommand(
      "crosscheck", "Engines side by side on scenarios: force error, loop gap, cost");
  crosscheck->add_option("scenarios", arguments->scenarios, "scenario files or folders")
      ->required();
  crosscheck
      ->add_option("--engine", arguments->engines,
                   "NAME=COMMAND: a foreign witness (repeatable), see "
                   "docs/how-to/external_solvers.md; Simbody and "
                   "the newest MuJoCo in two ways if left out")
      ->allow_extra_args(false);
  crosscheck->add_option("--markdown", arguments->markdown,
                         "writes forces, poses, loop gaps and cost as tables, a column per engine");
  crosscheck->add_option("--csv", arguments->csv, "writes all rows as CSV");
  crosscheck->add_option("--html", arguments->html, "writes all rows as a page");
  arguments->json.AddTo(crosscheck);
  crosscheck
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenarios (repeatable)")
      ->allow_extra_args(false);
  SetFooter(crosscheck,
            {"crosscheck scenarios/four_bar/turn_inverse.yaml",
             "crosscheck mine.yaml --engine 'mine=python3 my_engine.py' --markdown table.md"},
            "0 a table was made, whatever it says; 2 bad input, 3 a scenario could not run, 4 "
            "internal error");
  crosscheck->callback([arguments, exit_code] { *exit_code = RunCrosscheck(*arguments); });
}

}  // namespace mbv
