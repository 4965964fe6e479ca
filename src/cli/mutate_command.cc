// mbverify mutate
#include <fmt/format.h>

#include <charconv>
#include <memory>
#include <optional>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "pipeline/mutate.h"

namespace mbv {
namespace {

struct MutateArguments {
  std::string scenario;
  std::string size = "0.1 %";
  double resolution_percent = 10.0;
  std::vector<std::string> parameters;
  bool markdown = false, no_search = false, no_faults = false;
  std::string json;
};

// "0.1", "0.1%", "0.1 %": percent; empty when it is none or not above 0.
std::optional<double> ReadPercent(std::string text) {
  while (!text.empty() && (text.back() == '%' || text.back() == ' ')) text.pop_back();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0.0)) return {};
  return value / 100.0;
}

int Mutate(const MutateArguments& arguments) {
  const auto size = ReadPercent(arguments.size);
  if (!size) {
    fmt::print(stderr, "--size {}: error: violates: a percentage above 0, e.g. 1%\n",
               arguments.size);
    return 2;
  }
  MutationOptions options;
  options.size = *size;
  options.parameters = arguments.parameters;
  options.resolution = arguments.resolution_percent / 100.0;
  options.smallest = !arguments.no_search;
  options.structural = !arguments.no_faults;
  ProgressLine progress(true);
  if (progress.active()) {
    options.progress = [&](const std::string& parameter, double fraction) {
      progress.Show(parameter, fraction);
    };
  }
  const InputWatch inputs;
  const MutationReport report = MutateScenario(arguments.scenario, options);
  progress.Clear();
  fmt::print(stderr, "{}", report.diagnostics.Text());
  if (report.mutations.empty() && report.faults.empty()) return report.exit_code;
  if (!arguments.json.empty()) {
    const int code = WriteWholeFile(arguments.json, ToJson(report), inputs.files());
    if (code != 0) return code;
  }
  fmt::print("{}", ToText(report, arguments.markdown));
  return report.exit_code;
}

}  // namespace

void AddMutateCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<MutateArguments>();
  CLI::App* mutate = app->add_subcommand(
      "mutate",
      "Bend each parameter of the simulated side and put structural faults into it: which errors "
      "would be noticed, and down to which size?");
  mutate->add_option("scenario", arguments->scenario, "scenario file that agrees")->required();
  mutate->add_option("--size", arguments->size, "relative error in percent (1%)")
      ->capture_default_str();
  mutate->add_option("--parameter", arguments->parameters, "only these parameters (repeatable)")
      ->allow_extra_args(false);
  mutate
      ->add_option("--resolution", arguments->resolution_percent,
                   "of the smallest detectable error, in percent")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  mutate->add_flag("--no-search", arguments->no_search,
                   "smallest errors by proportion, without searching");
  mutate->add_flag("--no-faults", arguments->no_faults, "parameters only");
  mutate->add_flag("--markdown", arguments->markdown, "print Markdown tables");
  mutate->add_option("--json", arguments->json, "write the results to this file, too");
  mutate->footer(
      "Example:\n"
      "  mbverify mutate scenarios/stabilizing_platform/sea_state.yaml --size 1%\n"
      "Exit codes: 0 everything that matters is detected, 1 some is missed");
  mutate->callback([arguments, exit_code] { *exit_code = Mutate(*arguments); });
}

}  // namespace mbv
