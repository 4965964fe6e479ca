#include "pipeline/mutation_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/demand.h"
#include "kinematics/mobility.h"
#include "mechanism/channels.h"
#include "model_file/load_model.h"
#include "pipeline/drive_by.h"
#include "pipeline/ranges.h"
#include "reference/reference.h"

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

Engine EngineOf(const Scenario& scenario) {
  return scenario.simulation.stock_engine ? Engine::kStock : Engine::kCorrected;
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
  bench->reactions_not_unique_ = ReactionsNotUnique(bench->prepared_.base, {});
  bench->literals_ = LoadModel(bench->scenario().model_file, bench->SimulatedOptions()).literals;
  bench->RunTruths();
  bench->RunUnbent();
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

void MutationBench::RunTruths() {
  const auto add = [this](const std::string& name, RunSummary summary, Trace trace) {
    trace.witness = name;
    summaries_.emplace_back(name, std::move(summary));
    traces_.push_back(std::move(trace));
  };
  const Motion& motion = scenario().motion;
  const bool analytic = prepared_.closed_form.closed_form != nullptr;
  if (analytic) {
    ClosedFormRun run = RunClosedForm(prepared_.mechanisms.analytic, motion,
                                      prepared_.closed_form.closed_form.get());
    add("analytic", std::move(run.summary), std::move(run.trace));
  }
  if (scenario().reference.table != nullptr) {
    table_ = AlignTable(*scenario().reference.table, motion);
    add("reference", RunSummary::Done(), table_->trace);
  }
  if (!analytic) {
    ReferenceRun run = RunReference(prepared_.mechanisms.reference, motion);
    add(table_ ? "solver" : "reference", std::move(run.summary), std::move(run.trace));
  }
  truth_ = analytic ? "analytic" : "reference";
}

DriveForces MutationBench::GivenForces() const {
  if (!forces_source_) return {};
  return [this](double t_s, VecX* force) {
    const auto found = forces_.find(t_s);
    if (found != forces_.end()) {
      *force = found->second;
      return RunSummary::Done();
    }
    RunSummary summary = forces_source_(t_s, force);
    if (summary.ok()) forces_[t_s] = *force;
    return summary;
  };
}

// In open loop the limits of motion are how far wrong forces lead.
void MutationBench::RunGrowth() {
  const SimulationSettings& settings = scenario().simulation;
  if (!settings.forward || settings.drive_by != DriveBy::kForces) return;
  const auto truth = std::find_if(traces_.begin(), traces_.end(), [&](const Trace& trace) {
    return trace.witness == prepared_.driven_by;
  });
  MBV_DEMAND(truth != traces_.end(), prepared_.driven_by);
  growth_bend_ = scenario().checks[Metric::kForceNrmse].forward.value_or(
      *RowOf(Metric::kForceNrmse).limits.forward);
  SimulationOptions options = OptionsOf(scenario(), mechanism(), EngineOf(scenario()));
  options.forces = Bent(GivenForces(), prepared_.base, *truth, growth_bend_);
  SimulatedWitness wrong =
      RunSimulation(scenario(), mechanism(), prepared_.MakeDrivenMotion(), options, {});
  if (!wrong.run.summary.ok()) return;
  growth_ = std::move(wrong.run.trace);
  growth_->witness = "bent";
}

void MutationBench::RunUnbent() {
  forces_source_ = prepared_.MakeDriveForces();
  RunGrowth();
  const DrivenMotion driven = prepared_.MakeDrivenMotion();
  base_ = Run(mechanism(), scenario(), [&](double t_s, DrivenSample* sample) {
    RunSummary summary = driven(t_s, sample);
    if (summary.ok()) driven_[t_s] = *sample;
    return summary;
  });
}

ComparisonInput MutationBench::Input() const {
  ComparisonInput input{
      .mechanism = &prepared_.base,
      .motion = &scenario().motion,
      .limits = scenario().checks,
      .simulation_limits =
          scenario().simulation.forward ? LimitColumn::kForward : LimitColumn::kInverse,
      .start_window_s = scenario().start_window_s,
      .witnesses = {},
      .driven_by = prepared_.driven_by,
      .reactions_not_unique = reactions_not_unique_,
      .table = table_ ? &*table_ : nullptr,
      .drive_by = scenario().simulation.forward ? scenario().simulation.drive_by : DriveBy::kMotion,
      .bent = growth_ ? &*growth_ : nullptr,
      .bend = growth_bend_};
  for (size_t k = 0; k < traces_.size(); ++k) {
    input.witnesses.push_back({summaries_[k].first, &traces_[k], summaries_[k].second});
  }
  return input;
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
  return Run(*mechanism, wrong, Remembered());
}

BentRun MutationBench::Run(const Mechanism& wrong) const {
  return Run(wrong, scenario(), Remembered());
}

DrivenMotion MutationBench::Remembered() const {
  return [this](double t_s, DrivenSample* sample) {
    const auto found = driven_.find(t_s);
    MBV_DEMAND(found != driven_.end(), t_s);
    *sample = found->second;
    return RunSummary::Done();
  };
}

BentRun MutationBench::Run(const Mechanism& wrong, const Scenario& scenario,
                           const DrivenMotion& driven) const {
  BentRun bent;
  // Forces and servos are those of the unbent model: only the simulated side is wrong.
  SimulationOptions options = OptionsOf(scenario, wrong, EngineOf(scenario));
  options.forces = GivenForces();
  SimulatedWitness witness = RunSimulation(scenario, wrong, driven, options, {});
  if (witness.diagnostics.has_errors()) {
    bent.failure = witness.diagnostics.findings().front().message;
    return bent;
  }
  if (!witness.run.summary.ok()) {
    bent.failure = witness.run.summary.message;
    return bent;
  }
  if (!scenario.simulation.ignore_ranges) {
    const auto violations = JointViolations(wrong, witness.run.trace.time_s, witness.run.X_WB);
    if (!violations.empty()) {
      bent.failure = violations.front().Text();
      return bent;
    }
  }
  bent.trace = std::move(witness.run.trace);
  bent.trace.witness = "simulated";
  ComparisonInput input = Input();
  input.witnesses.push_back({"simulated", &bent.trace, RunSummary::Done()});
  // Servos: the reference where they went.
  ReferenceRun reached;
  if (input.drive_by == DriveBy::kServos) {
    reached = RunReached(prepared_.mechanisms.reference, scenario.motion, bent.trace);
    if (!reached.summary.ok()) {
      bent.failure = "on the motion that was reached: " + reached.summary.message;
      return bent;
    }
    input.witnesses.push_back({"reached", &reached.trace, reached.summary});
  }
  bent.comparison = Compare(input);
  bent.ran = true;
  return bent;
}

}  // namespace mbv
