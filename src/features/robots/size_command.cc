// mbverify size
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <memory>

#include "base/json_text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/run/run_scenario.h"
#include "report/sizing.h"

namespace mbv {
namespace {

struct SizeArguments {
  std::vector<std::string> scenarios, set;
  JsonOption json;
  double margin = 1.0;
  bool trust = false;
};

// The envelopes of one mechanism over its scenarios.
struct Sized {
  std::string mechanism;
  std::vector<std::string> scenarios;
  std::vector<MotorEnvelope> envelopes;
  nlohmann::ordered_json refused = nlohmann::ordered_json::array();
};

// A scenario that says nothing about motors: the reason is kept for --json.
int RefuseScenario(const std::string& file, const std::string& reason, const std::string& hint,
                   Sized* sized) {
  sized->refused.push_back({{"scenario_file", file}, {"exit_code", 2}, {"reason", reason}});
  return hint.empty() ? 2 : Refuse(reason, hint);
}

std::string FirstError(const RunOutcome& outcome) {
  for (const Finding& finding : outcome.diagnostics.findings()) {
    if (finding.severity == Severity::kError) return finding.message;
  }
  return "";
}

// Runs a scenario without files; its exit code.
int AddScenario(const std::string& file, const RunOptions& options, Sized* sized) {
  const RunOutcome outcome = RunScenario(file, options);
  SayText(stderr, outcome.diagnostics.Text());
  if (!outcome.report) {
    if (outcome.exit_code == 2) return RefuseScenario(file, FirstError(outcome), "", sized);
    return RefuseScenario(file, file + " is not a motion", "size takes scenarios with a motion",
                          sized);
  }
  const Report& report = *outcome.report;
  if (!sized->mechanism.empty() && sized->mechanism != report.mechanism) {
    return RefuseScenario(file,
                          fmt::format("{} is about {}, the others about {}", file, report.mechanism,
                                      sized->mechanism),
                          "size compares scenarios of one mechanism", sized);
  }
  if (report.motors.empty()) {
    return RefuseScenario(file, fmt::format("{} has no motors", report.mechanism),
                          "state them in the model: motors: {DRIVE: {continuous: …, peak: …}}",
                          sized);
  }
  sized->mechanism = report.mechanism;
  sized->scenarios.push_back(report.scenario);
  Widen(report, &sized->envelopes);
  if (outcome.exit_code != 0) Say(stderr, "{}: {}\n", file, report.comparison.reason);
  return outcome.exit_code;
}

bool TooSmall(const Sized& sized, double margin) {
  bool small = false;
  for (const MotorEnvelope& e : sized.envelopes)
    small = small || (e.limited && !(e.margin() >= margin));
  return small;
}

bool IsUnknown(const Sized& sized) {
  return std::any_of(sized.envelopes.begin(), sized.envelopes.end(),
                     [](const MotorEnvelope& e) { return !e.unresolved.empty(); });
}

int PrintSized(const SizeArguments& arguments, const Sized& sized, int exit_code) {
  if (!sized.envelopes.empty()) SayText(arguments.json.text(), ToText(sized.envelopes));
  if (TooSmall(sized, arguments.margin)) exit_code = WorseExit(exit_code, 1);
  if (IsUnknown(sized)) exit_code = WorseExit(exit_code, 3);
  auto json = ParseJson<nlohmann::ordered_json>(ToJson(sized.envelopes, sized.scenarios));
  json["refused"] = sized.refused;
  json["exit_code"] = exit_code;
  return WorseExit(exit_code, arguments.json.Write(json, {}));
}

int RunSize(const SizeArguments& arguments) {
  RunOptions options;
  options.out_dir.clear();
  options.pictures = options.page = false;
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code == 0) {
    exit_code = AskForPrograms(files, options.scenario, arguments.trust, false, &options.programs);
  }
  if (exit_code != 0) return exit_code;
  Sized sized;
  for (const std::string& file : files) {
    exit_code = WorseExit(exit_code, AddScenario(file, options, &sized));
  }
  return PrintSized(arguments, sized, exit_code);
}

}  // namespace

void AddSizeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SizeArguments>();
  CLI::App* size = app->add_subcommand(
      "size", "What several scenarios ask of the motors: the largest of each, and the margin");
  size->add_option("scenarios", arguments->scenarios, "scenario files or folders of one mechanism")
      ->required();
  size->add_option("--margin", arguments->margin, "smaller ones end with exit code 1")
      ->check(Positive())
      ->capture_default_str();
  AddTrustOption(size, &arguments->trust);
  arguments->json.AddTo(size);
  size->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenarios (repeatable)")
      ->allow_extra_args(false);
  SetFooter(
      size,
      {"size scenarios/slider_crank", "size slow.yaml fast.yaml --margin 1.2 --json size.json"},
      "0 agree and margins are kept, 1 disagree or a margin is smaller, 2 bad input, 3 could "
      "not run, 4 internal error");
  size->callback([arguments, exit_code] { *exit_code = RunSize(*arguments); });
}

}  // namespace mbv
