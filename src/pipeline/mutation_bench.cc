#include "pipeline/mutation_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/demand.h"
#include "mechanism/channels.h"
#include "mechanism/load_model.h"
#include "mechanism/mobility.h"
#include "pipeline/ranges.h"
#include "reference/reference.h"

namespace mbv {
namespace {

constexpr double kRoundoff = 1e-12;
constexpr double kAboveBase = 5.0;

void AddError(const std::string& file, const std::string& message, const std::string& hint,
              Diagnostics* diagnostics) {
  Finding finding;
  finding.file = file;
  finding.message = message;
  finding.hint = hint;
  diagnostics->Add(std::move(finding));
}

}  // namespace

double BentRun::ValueOf(const std::string& check) const {
  const CheckResult* found = comparison.FindCheck(check);
  return found == nullptr ? 0.0 : found->value;
}

double MutationBench::Visible(double base) { return std::max(kRoundoff, kAboveBase * base); }

std::unique_ptr<MutationBench> MutationBench::Make(const std::string& file,
                                                   Diagnostics* diagnostics, int* exit_code) {
  *exit_code = 2;
  ScenarioOptions options;
  options.set = {{"simulation.mode", "inverse"}};
  if (ReadScenarioHead(file).is_stiffness()) {
    AddError(file, "is a stiffness scenario", "mutate bends the model of a motion", diagnostics);
    return nullptr;
  }
  std::optional<Prepared> prepared = Prepare(file, options, diagnostics);
  if (!prepared) return nullptr;
  if (prepared->scenario.motion.free()) {
    AddError(file, "the motion follows from forces, so there is none to hold while a model is bent",
             "command the drives or the outputs", diagnostics);
    return nullptr;
  }
  std::unique_ptr<MutationBench> bench(new MutationBench(*std::move(prepared)));
  bench->joints_not_unique_ = AnalyseMobility(bench->prepared_.base).joints_not_unique;
  bench->RunTruths();
  bench->TakeDrivenMotion();
  bench->base_ = bench->Run(bench->mechanism());
  const Comparison& base = bench->base_.comparison;
  *exit_code = !bench->base_.ran || base.verdict == Verdict::kNotRun ? 3
               : base.verdict == Verdict::kDisagree                  ? 1
                                                                     : 0;
  if (*exit_code == 0) return bench;
  AddError(file,
           "does not agree before anything is bent: " +
               (bench->base_.ran ? base.reason : bench->base_.failure),
           "mbverify run shows why", diagnostics);
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

void MutationBench::TakeDrivenMotion() {
  const DrivenMotion driven = prepared_.MakeDrivenMotion();
  const Motion& motion = scenario().motion;
  for (const double t : SampleTimes(motion.duration_s, motion.sample_s)) {
    driven_.emplace_back();
    driven_summary_ = driven(t, &driven_.back());
    if (!driven_summary_.ok()) return;
  }
}

ComparisonInput MutationBench::Input() const {
  ComparisonInput input{.mechanism = &prepared_.base,
                        .motion = &scenario().motion,
                        .limits = scenario().checks,
                        .simulation_limits = LimitColumn::kInverse,
                        .start_window_s = scenario().start_window_s,
                        .witnesses = {},
                        .driven_by = prepared_.driven_by,
                        .joints_not_unique = joints_not_unique_,
                        .table = table_ ? &*table_ : nullptr};
  for (size_t k = 0; k < traces_.size(); ++k) {
    input.witnesses.push_back({summaries_[k].first, &traces_[k], summaries_[k].second});
  }
  return input;
}

std::optional<Mechanism> MutationBench::Bend(const std::string& parameter, double value,
                                             std::string* why) const {
  LoadOptions options;
  options.overrides =
      Merge(Merge(scenario().parameters, scenario().simulation.parameters), {{parameter, value}});
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

BentRun MutationBench::Run(const std::string& parameter, double value) const {
  BentRun bent;
  const auto mechanism = Bend(parameter, value, &bent.failure);
  if (mechanism) {
    if (!scenario().simulation.extrapolate) return Run(*mechanism);
    // Extrapolation loads the model anew, so the bend has to be in the scenario.
    MutationBench copy(Prepared{.scenario = scenario(),
                                .base = prepared_.base,
                                .mechanisms = prepared_.mechanisms,
                                .closed_form = {},
                                .driven_by = prepared_.driven_by});
    copy.prepared_.scenario.simulation.parameters[parameter] = value;
    copy.summaries_ = summaries_;
    copy.traces_ = traces_;
    copy.table_ = table_;
    copy.driven_ = driven_;
    copy.driven_summary_ = driven_summary_;
    copy.joints_not_unique_ = joints_not_unique_;
    return copy.Run(*mechanism);
  }
  bent.loaded = false;
  return bent;
}

BentRun MutationBench::Run(const Mechanism& wrong) const {
  BentRun bent;
  size_t next = 0;
  const auto driven = [&](double t_s, DrivenSample* sample) {
    // Asked for each sample in turn; an extrapolation starts again.
    if (t_s == 0.0) next = 0;
    if (next >= driven_.size()) return driven_summary_;
    *sample = driven_[next++];
    return next == driven_.size() ? driven_summary_ : RunSummary::Done();
  };
  SimulatedWitness witness = RunSimulation(scenario(), wrong, driven,
                                           OptionsOf(scenario(), wrong, Engine::kCorrected), {});
  if (witness.diagnostics.has_errors()) {
    bent.failure = witness.diagnostics.findings().front().message;
    return bent;
  }
  if (!witness.run.summary.ok()) {
    bent.failure = witness.run.summary.message;
    return bent;
  }
  if (!scenario().simulation.ignore_ranges) {
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
  bent.comparison = Compare(input);
  bent.ran = true;
  return bent;
}

}  // namespace mbv
