#include "features/mutation/mutation_bench.h"

#include <fmt/format.h>
#include <algorithm>

#include "base/demand.h"
#include "kinematics/mobility.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

constexpr double kRoundoff = 1e-12;
constexpr double kAboveBase = 5.0;

// There is a motion to hold, and a simulation.
bool CanBePerturbed(const Scenario& scenario, Diagnostics* diagnostics) {
  if (scenario.motion.free()) {
    diagnostics->AddError(
        scenario.file,
        "the motion follows from forces, so there is none to hold while a model is perturbed",
        "command the drives or the outputs");
  } else if (!scenario.simulation.on) {
    diagnostics->AddError(scenario.file, "has no simulation to perturb",
                          "e.g. simulation: {mode: forward}");
  } else {
    return true;
  }
  return false;
}

// Why there is nothing to compare; "" if there is.
std::string NothingToCompareReason(const WitnessRuns& runs, bool ignore_ranges) {
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

double PerturbedRun::ValueOf(const std::string& check) const {
  const CheckResult* found = comparison.FindCheck(check);
  return found == nullptr ? 0.0 : found->value;
}

double MutationBench::Visible(double base) { return std::max(kRoundoff, kAboveBase * base); }

std::unique_ptr<MutationBench> MutationBench::Make(const std::string& file, BenchMode mode,
                                                   Diagnostics* diagnostics, int* exit_code) {
  *exit_code = 2;
  ScenarioOptions options;
  if (mode == BenchMode::kInverse) options.set = {{"simulation.mode", "inverse"}};
  if (const DocumentKind& kind = KindOf(file); kind.timeless()) {
    diagnostics->AddError(file, fmt::format("is a {}", kind.name),
                          "mutate perturbs the model of a motion");
    return nullptr;
  }
  std::optional<Prepared> prepared = Prepare(file, options, diagnostics);
  if (!prepared || !CanBePerturbed(prepared->scenario, diagnostics)) return nullptr;
  std::unique_ptr<MutationBench> bench(new MutationBench(*std::move(prepared)));
  bench->literals_ = LoadModel(bench->scenario().model_file, bench->SimulatedOptions()).literals;
  bench->RunTruths();
  WitnessRuns unperturbed = bench->Follow(bench->mechanism(), bench->scenario());
  if (unperturbed.simulation) {
    bench->reactions_not_unique_ =
        ReactionsNotUnique(bench->prepared_.base, unperturbed.simulation->X_WB);
  }
  bench->base_ = bench->Judge(std::move(unperturbed), bench->scenario());
  const PerturbedRun& base = bench->base_;
  if (base.ran && base.comparison.verdict == Verdict::kAgree) {
    *exit_code = 0;
    return bench;
  }
  *exit_code = base.ran && base.comparison.verdict == Verdict::kDisagree ? 1 : 3;
  diagnostics->AddError(file,
                        "does not agree before anything is perturbed: " +
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
  if (settings.mode == DriveMode::kForceDriven) runner.RunPerturbed();
  truths_ = runner.Take();
}

LoadOptions MutationBench::SimulatedOptions() const {
  return ModelOptions(scenario(), scenario().simulation.parameters);
}

std::optional<Mechanism> MutationBench::Perturb(const Replacement& replacement,
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

PerturbedRun MutationBench::Run(const Replacement& replacement) const {
  PerturbedRun perturbed;
  const auto mechanism = Perturb(replacement, &perturbed.failure);
  if (!mechanism) {
    perturbed.loaded = false;
    return perturbed;
  }
  if (!scenario().simulation.extrapolate) return Run(*mechanism);
  // Extrapolation loads the model anew, so the perturbation has to be in the scenario.
  MBV_DEMAND(!replacement.literal, replacement.name);
  Scenario wrong = scenario();
  wrong.simulation.parameters[replacement.name] = replacement.value;
  return Run(*mechanism, wrong);
}

PerturbedRun MutationBench::Run(const Mechanism& wrong) const { return Run(wrong, scenario()); }

// Motion, forces and servos are those of the unperturbed model: only the simulated side is wrong.
WitnessRuns MutationBench::Follow(const Mechanism& wrong, const Scenario& scenario) const {
  WitnessRunner runner(prepared_, {.scenario = &scenario,
                                   .mechanism = &wrong,
                                   .ranges = &wrong,
                                   .driven = driven_,
                                   .forces = forces_});
  runner.RunFollowing();
  return runner.Take();
}

PerturbedRun MutationBench::Run(const Mechanism& wrong, const Scenario& scenario) const {
  return Judge(Follow(wrong, scenario), scenario);
}

PerturbedRun MutationBench::Judge(WitnessRuns runs, const Scenario& scenario) const {
  PerturbedRun perturbed;
  perturbed.failure = NothingToCompareReason(runs, scenario.simulation.ignore_ranges);
  if (!perturbed.failure.empty()) return perturbed;
  ComparisonInput input = InputOf(prepared_);
  input.drive_facts = DriveFactsOf(prepared_);
  input.reactions_not_unique = reactions_not_unique_;
  truths_.HandOver(&input);
  runs.HandOver(&input);
  perturbed.comparison = Compare(input);
  perturbed.trace = std::move(runs.records.front().trace);
  perturbed.ran = true;
  return perturbed;
}

}  // namespace mbv
