// mbverify mutate
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/terminal.h"
#include "pipeline/mutate.h"

namespace mbv {
namespace {

struct MutateArguments {
  std::string scenario;
  double percent = 0.1;
  std::vector<std::string> parameters;
  bool markdown = false;
};

int Mutate(const MutateArguments& arguments) {
  MutationOptions options;
  options.size = arguments.percent / 100;
  options.parameters = arguments.parameters;
  ProgressLine progress(true);
  if (progress.active()) {
    options.progress = [&](const std::string& parameter, double fraction) {
      progress.Show(parameter, fraction);
    };
  }
  const MutationReport report = MutateScenario(arguments.scenario, options);
  progress.Clear();
  fmt::print(stderr, "{}", report.diagnostics.Text());
  if (report.mutations.empty()) {
    if (report.exit_code != 2) {
      fmt::print(stderr, "error: {} does not agree before anything is bent\n", arguments.scenario);
    }
    return report.exit_code;
  }
  fmt::print("{}", ToText(report, arguments.markdown));
  return report.exit_code;
}

}  // namespace

void AddMutateCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<MutateArguments>();
  CLI::App* mutate = app->add_subcommand(
      "mutate", "Bend each parameter of the simulated side: which errors would be noticed?");
  mutate->add_option("scenario", arguments->scenario, "scenario file that agrees")->required();
  mutate->add_option("--size", arguments->percent, "relative error in percent")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  mutate->add_option("--parameter", arguments->parameters, "only these parameters (repeatable)");
  mutate->add_flag("--markdown", arguments->markdown, "print a Markdown table");
  mutate->footer(
      "Example:\n"
      "  mbverify mutate scenarios/stabilizing_platform/sea_state.yaml --size 0.1\n"
      "Exit codes: 0 every parameter that matters is detected, 1 some are missed");
  mutate->callback([arguments, exit_code] { *exit_code = Mutate(*arguments); });
}

}  // namespace mbv
