// mbverify upgrade
#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "pipeline/upgrade.h"

namespace mbv {
namespace {

struct UpgradeArguments {
  std::vector<std::string> scenarios, set;
  std::string program;
  JsonOption json;
};

// One scenario; its exit code.
int TellUpgrade(const std::string& file, const UpgradeArguments& arguments, UpgradeOptions* options,
                std::vector<UpgradeReport>* reports) {
  ProgressLine progress(true);
  if (progress.active()) {
    options->progress = [&](const std::string& stage, double fraction) {
      progress.Show(file + ": " + stage, fraction);
    };
  }
  const UpgradeOutcome outcome = Upgrade(file, *options);
  progress.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (!outcome.failure.empty()) Say(stderr, "error: {}: {}\n", file, outcome.failure);
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report));
    reports->push_back(*outcome.report);
  }
  return outcome.exit_code;
}

int RunUpgrade(const UpgradeArguments& arguments) {
  UpgradeOptions options;
  if (!arguments.program.empty()) options.command = {arguments.program};
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code != 0) return exit_code;
  std::vector<UpgradeReport> reports;
  for (const std::string& file : files) {
    exit_code = WorseExit(exit_code, TellUpgrade(file, arguments, &options, &reports));
  }
  return WorseExit(exit_code, arguments.json.Write(ToJson(reports), {}));
}

}  // namespace

void AddUpgradeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<UpgradeArguments>();
  CLI::App* upgrade = app->add_subcommand(
      "upgrade", "What the newest MuJoCo changes for the scenarios' models, and why");
  upgrade->add_option("scenarios", arguments->scenarios, "scenario files or folders")->required();
  upgrade->add_option("--program", arguments->program,
                      "runs the other version, in place of mbverify-witness-mujoco");
  arguments->json.AddTo(upgrade);
  upgrade
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenarios (repeatable)")
      ->allow_extra_args(false);
  SetFooter(upgrade, {"upgrade scenarios/spr_tripod/default.yaml", "upgrade mine.yaml --json -"},
            "0 compared, whatever differs; 2 bad input, 3 the scenario or the other version could "
            "not run, 4 internal error");
  upgrade->callback([arguments, exit_code] { *exit_code = RunUpgrade(*arguments); });
}

}  // namespace mbv
