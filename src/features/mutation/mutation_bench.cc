#include "features/mutation/mutation_bench.h"

#include <algorithm>

#include "base/demand.h"
#include "kinematics/mobility.h"

namespace mbv {
namespace {

constexpr double kRoundoff = 1e-12;
constexpr double kAboveBase = 5.0;

// There is a motion to hold, and a simulation.
bool CanBeBent(const Scenario& scenario, Diagnostics* diagnostics) {
  if (scenario.motion.free()) {
    diagnostics->AddError(
        scenario.file,
        "the motion follows from forces, so there is none to hold while a model is bent",
        "command the drives or the outputs");
  } else if (!scenario.simulation.on) {
    diagnostics->AddError(scenario.file, "has no simulation to bend",
                          "e.g. simulation: {mode: forward}");
  } else {
    return true;
  }
  return false;
}

// Why there is nothing to compare; "" if there is.
std::string WhyNothing(const WitnessRuns& runs, bool ignore_ranges) {
  if (runs.bad_input.has_errors()) return runs.bad_input.findings().front().message;
  if (!ignore_ranges && !runs.violations.empty()) return runs.violations.front().Text();
  if (const RunSummary& summary = runs.Find(role::kSimulated)->summary; !summary.ok()) {
    return summary.message;
  }
  const WitnessRecord* reached = runs.Find(role::kReached);
  if (reached == nullptr || reached->summary.ok()) return "";
  return "on the motion that was reached: " + reached->summary.message;
}

}  // namespace

double BentRun::ValueOf(const std::string& check) const {
  const CheckResult* found = comparison.FindCheck(check);
  return found == nullptr ? 0.0 : found->value;
}

double MutationBench::Visible(double base) { return std::max(kRoundoff, kAboveBase * base); }

std::unique_ptr<MutationBench> MutationBench::Make(const std::string& file, BenchMode mode,
                                                   Diagnostics* diagnostics, int* exit_code) {
  *exit_code = 2;
  ScenarioOptions options;
  if (mode == BenchMode::kInverse) options.set = {{"simulation.mode", "inverse"}};
  if (ReadScenarioHead(file).is_stiffness()) {
    diagnostics->AddError(file, "is a stiffness scenario", "mutate bends the model of a motion");
    return nullptr;
  }
  std::optional<Prepared> prepared = Prepare(file, options, diagnostics);
  if (!prepared || !CanBeBent(prepared->scenario, diagnostics)) return nullptr;
  std::unique_ptr<MutationBench> bench(new MutationBench(*std::move(prepared)));
  bench->literals_ = LoadModel(bench->scenario().model_file, bench->SimulatedOptions()).literals;
  bench->RunTruths();
  WitnessRuns unbent = bench->Follow(bench->mechanism(), bench->scenario());
  if (unbent.simulation) {
    bench->reactions_not_unique_ =
        ReactionsNotUnique(bench->prepared_.base, unbent.simulation->X_WB);
  }
  bench->base_ = bench->Judge(std::move(unbent), bench->scenario());
  const BentRun& base = bench->base_;
  if (base.ran && base.comparison.verdict == Verdict::kAgree) {
    *exit_code = 0;
    return bench;
  }
  *exit_code = base.ran && base.comparison.verdict == Verdict::kDisagree ? 1 : 3;
  diagnostics->AddError(file,
                        "does not agree before anything is bent: " +
                            (base.ran ? base.comparison.reason : base.failure),
                        "mbverify run shows why");
  return nullptr;
}

std::string MutationBench::ForceCheck() const {
  return PairName(role::kSimulated, truth()) + "." + RowOf(Metric::kForceNrmse).key;
}

// The generic solver takes part only where no closed form does.
void MutationBench::RunTruths() {
  driven_ = known_motion_.Of(prepared_.MakeDrivenMotion());
  if (DriveForces forces = prepared_.MakeDriveForces()) forces_ = known_forces_.Of(forces);
  const bool analytic = prepared_.has_closed_form();
  WitnessRunner runner(prepared_, {.forces = forces_});
  if (analytic) runner.Run(role::kAnalytic);
  if (!analytic || prepared_.has_table()) runner.Run(role::kReference);
  if (runner.TakesPart(role::kSolver)) runner.Run(role::kSolver);
  // In open loop the limits of motion are how far wrong forces lead.
  const SimulationSettings& settings = scenario().simulation;
  if (settings.forward && settings.drive_by == DriveBy::kForces) runner.RunBent();
  truths_ = runner.Take();
}

LoadOptions MutationBench::SimulatedOptions() const {
  return ModelOptions(scenario(), scenario().simulation.parameters);
}

std::optional<Mechanism> MutationBench::Bend(const Replacement& replacement,
                                             std::string* why) const {
  LoadOptions options = SimulatedOptions();
  (replacement.literal ? options.literals : options.overrides)[replacement.name] =
      replacement.value;
  LoadResult loaded = LoadModel(scenario().model_file, options);
  if (loaded.mechanism) return *std::move(loaded.mechanism);
  *why = "the model does not load";
  for (const Finding& finding : loaded.diagnostics.findings()) {
    if (finding.severity != Severity::kError) continue;
    *why = finding.message;
    break;
  }
  return {};
}

BentRun MutationBench::Run(const Replacement& replacement) const {
  BentRun bent;
  const auto mechanism = Bend(replacement, &bent.failure);
  if (!mechanism) {
    bent.loaded = false;
    return bent;
  }
  if (!scenario().simulation.extrapolate) return Run(*mechanism);
  // Extrapolation loads the model anew, so the bend has to be in the scenario.
  MBV_DEMAND(!replacement.literal, replacement.name);
  Scenario wrong = scenario();
  wrong.simulation.parameters[replacement.name] = replacement.value;
  return Run(*mechanism, wrong);
}

BentRun MutationBench::Run(const Mechanism& wrong) const { return Run(wrong, scenario()); }

// Motion, forces and servos are those of the unbent model: only the simulated side is wrong.
WitnessRuns MutationBench::Follow(const Mechanism& wrong, const Scenario& scenario) const {
  WitnessRunner runner(prepared_, {.scenario = &scenario,
                                   .mechanism = &wrong,
                                   .ranges = &wrong,
                                   .driven = driven_,
                                   .forces = forces_});
  runner.RunFollowing();
  return runner.Take();
}

BentRun MutationBench::Run(const Mechanism& wrong, const Scenario& scenario) const {
  return Judge(Follow(wrong, scenario), scenario);
}

BentRun MutationBench::Judge(WitnessRuns runs, const Scenario& scenario) const {
  BentRun bent;
  bent.failure = WhyNothing(runs, scenario.simulation.ignore_ranges);
  if (!bent.failure.empty()) return bent;
  ComparisonInput input = InputOf(prepared_);
  input.reactions_not_unique = reactions_not_unique_;
  truths_.HandOver(&input);
  runs.HandOver(&input);
  bent.comparison = Compare(input);
  bent.trace = std::move(runs.records.front().trace);
  bent.ran = true;
  return bent;
}

}  // namespace mbv
