// mbverify converge
#include <fmt/format.h>

#include <cstdio>
#include <memory>

#include "base/output_folder.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/convergence/converge.h"
#include "features/convergence/convergence_report.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct ConvergeArguments {
  std::string scenario, out = "out";
  std::vector<double> steps_s = ConvergeOptions{}.steps_s;
  std::vector<std::string> set;
  int jobs = 1;
  JsonOption json;
};

// "" or what went wrong.
std::string WriteFolder(const std::string& out, const ConvergenceReport& report) {
  OutputFolder folder(out, report.mechanism + "/convergence/" + report.scenario);
  std::vector<std::pair<std::string, std::string>> files = {{"converge.json", ToJson(report)},
                                                            {"converge.csv", ToCsv(report)}};
  for (auto& plot : ConvergencePlots(report)) files.push_back(std::move(plot));
  std::string trouble = folder.WriteAll(files);
  if (trouble.empty()) Say(stderr, "results in {}\n", folder.target().string());
  return trouble;
}

int RunConverge(const ConvergeArguments& arguments) {
  ConvergeOptions options;
  options.steps_s = arguments.steps_s;
  options.jobs = arguments.jobs;
  if (!ReadAssignments(arguments.set, "--set", "parameters.link_mass=0.5", &options.scenario.set))
    return 2;
  ProgressLine progress(true);
  if (progress.active()) {
    options.progress = [&](const std::string& what, double fraction) {
      progress.Show(what, fraction);
    };
  }
  if (const int code = RefuseInput(arguments.json.path(), arguments.scenario); code != 0)
    return code;
  const ConvergeOutcome outcome = Converge(FindScenario(arguments.scenario), options);
  progress.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.exit_code == 3) Say(stderr, "error: could not run: {}\n", outcome.failure);
  if (outcome.exit_code > 1) return outcome.exit_code;
  SayText(arguments.json.text(), ToText(outcome.report));
  std::fflush(stdout);
  if (const std::string trouble = WriteFolder(arguments.out, outcome.report); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  return WorseExit(outcome.exit_code, arguments.json.Write(ToJson(outcome.report), {}));
}

}  // namespace

void AddConvergeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ConvergeArguments>();
  arguments->jobs = AllCores();
  CLI::App* converge = app->add_subcommand(
      "converge", "Refine step and constraint time constant: is the order that of the scheme?");
  converge->add_option("scenario", arguments->scenario, "scenario file with a motion")->required();
  converge
      ->add_option("--steps", arguments->steps_s,
                   "steps in s, each the same whole fraction of the one before")
      ->delimiter(',')
      ->capture_default_str();
  converge->add_option("--set", arguments->set, "replace a value of the scenario: KEY=VALUE");
  converge->add_option("--jobs", arguments->jobs, "processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  converge->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  arguments->json.AddTo(converge);
  SetFooter(converge,
            {"converge scenarios/slider_crank/turn.yaml --steps 0.004,0.002,0.001,0.0005"},
            "0 orders as expected, 1 a finding, 2 bad input, 3 could not run");
  converge->callback([arguments, exit_code] { *exit_code = RunConverge(*arguments); });
}

}  // namespace mbv
