#include "pipeline/study_values.h"

#include <algorithm>
#include <cmath>

#include "comparison/derivatives.h"
#include "comparison/motor_load.h"
#include "core/text.h"
#include "kinematics/mobility.h"

namespace mbv {
namespace {

const Role& RoleOfWitness(const std::string& name) {
  return name == "analytic"    ? role::kAnalytic
         : name == "reference" ? role::kReference
                               : role::kSimulated;
}

// Measures checks of one run; what several of them need is found once. Several witnesses are
// compared and judged as `mbverify run` does it.
class CheckMeter {
 public:
  explicit CheckMeter(const StudyRun& run) : run_(run), input_(InputOf(*run.prepared)) {
    run.runs.HandOver(&input_);
    input_.reactions_not_unique = ReactionsNotUnique(
        run.prepared->base,
        run.runs.simulation ? run.runs.simulation->X_WB : std::vector<std::vector<Pose>>());
    if (run.witnesses.size() > 1) {
      comparison_ = Compare(input_);
    } else {
      comparison_.witnesses = {MeasureWitness(input_, run.witnesses.front()->trace)};
      comparison_.witnesses.front().witness = run.witnesses.front()->name;
    }
  }

  [[nodiscard]] const Comparison& comparison() const { return comparison_; }

  double Worst(const MetricRow& row) {
    if (row.metric == Metric::kMotorUse) return SmallestMargin();
    Measured worst;
    const auto keep = [&](const std::map<Metric, Measured>& metrics) {
      const auto found = metrics.find(row.metric);
      if (found == metrics.end()) return;
      if (std::isnan(worst.value) || !(found->second.value <= worst.value)) worst = found->second;
    };
    if (row.of_pair) {
      for (const PairComparison& pair : comparison_.pairs) {
        if (IsNamed(pair.measured) && IsNamed(pair.truth)) keep(pair.metrics);
      }
    } else {
      for (const WitnessMetrics& witness : comparison_.witnesses) {
        if (IsNamed(witness.witness)) keep(witness.metrics);
      }
    }
    return worst.value;
  }

 private:
  // Others may have run because these need them.
  [[nodiscard]] bool IsNamed(const std::string& witness) const {
    return std::any_of(run_.witnesses.begin(), run_.witnesses.end(),
                       [&](const WitnessRecord* record) { return record->name == witness; });
  }

  [[nodiscard]] double SmallestMargin() const {
    double smallest = kNan;
    const Mechanism& mechanism = run_.prepared->base;
    for (const WitnessRecord* record : run_.witnesses) {
      for (const Motor& motor : mechanism.motors) {
        const MotorLoad load = MotorLoadOf(mechanism, motor, record->trace);
        if (!load.known() || std::isnan(load.largest_use())) continue;
        if (!(load.margin() >= smallest)) smallest = load.margin();
      }
    }
    return smallest;
  }

  const StudyRun& run_;
  ComparisonInput input_;
  Comparison comparison_;
};

double OfChannel(const StudyRun& run, const StudyQuantity& quantity) {
  for (const WitnessRecord* record : run.witnesses) {
    const int column = record->trace.Find(quantity.channel);
    if (column >= 0) return StatisticOf(record->trace.values.col(column), quantity.statistic);
  }
  return kNan;
}

// Drives beyond their strokes are no result, unless the scenario says so.
std::string StrokeFailure(const Prepared& prepared, const WitnessRecord& record) {
  if (prepared.scenario.simulation.ignore_ranges) return "";
  const auto violations = DriveViolations(prepared.base, record.trace);
  return violations.empty() ? "" : violations.front().Text();
}

}  // namespace

std::string ModeOf(const std::vector<std::string>& names) {
  for (const char* mode : {"inverse", "forward"}) {
    if (Contains(names, mode)) return mode;
  }
  return "";
}

double StatisticOf(const VecX& samples, Statistic statistic) {
  if (samples.size() == 0 || !samples.allFinite()) return kNan;
  switch (statistic) {
    case Statistic::kMax:
      return samples.maxCoeff();
    case Statistic::kMin:
      return samples.minCoeff();
    case Statistic::kPeak:
      return samples.cwiseAbs().maxCoeff();
    case Statistic::kRms:
      return Rms(samples);
    case Statistic::kMean:
      return samples.mean();
    case Statistic::kEnd:
      return samples[samples.size() - 1];
  }
  return kNan;
}

StudyRun RunStudyWitnesses(const Prepared& prepared, const std::vector<std::string>& names) {
  StudyRun result{.prepared = &prepared, .runs = {}, .witnesses = {}, .failure = {}};
  WitnessRunner runner(prepared);
  const auto ran = [&](const Role& role) { return runner.runs().Find(role) != nullptr; };
  for (const std::string& name : names) {
    const Role& role = RoleOfWitness(name);
    if (role.is_engine()) {
      if (!ran(prepared.driver())) runner.Run(prepared.driver());
      if (!runner.CheckStrokes()) continue;
    }
    if (!ran(role)) runner.Run(role);
  }
  result.runs = runner.Take();
  for (const std::string& name : names) {
    const WitnessRecord* record = result.runs.Find(RoleOfWitness(name));
    result.witnesses.push_back(record);
    if (!result.failure.empty()) continue;
    if (!record->summary.ok()) {
      result.failure = name + ": " + record->summary.message;
    } else {
      result.failure = StrokeFailure(prepared, *record);
    }
  }
  return result;
}

std::string UnresolvedBySamples(const StudyRun& run) {
  const ComparisonInput input = InputOf(*run.prepared);
  for (const WitnessRecord* record : run.witnesses) {
    const std::string why = UnresolvedBySamples(input, record->trace);
    if (!why.empty()) return record->name + ": " + why;
  }
  return "";
}

StudyMeasures MeasureQuantities(const StudyRun& run, const std::vector<StudyQuantity>& quantities) {
  StudyMeasures measures;
  std::optional<CheckMeter> meter;
  const auto ready = [&]() -> CheckMeter& {
    if (!meter) meter.emplace(run);
    return *meter;
  };
  for (const StudyQuantity& quantity : quantities) {
    measures.values.push_back(quantity.is_check() ? ready().Worst(*FindMetric(quantity.name))
                                                  : OfChannel(run, quantity));
  }
  if (run.witnesses.size() > 1) {
    measures.verdict = ready().comparison().verdict;
    measures.reason = ready().comparison().reason;
  }
  return measures;
}

}  // namespace mbv
