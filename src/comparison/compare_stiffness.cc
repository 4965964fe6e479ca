#include "comparison/compare_stiffness.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "comparison/pair_reader.h"

namespace mbv {
namespace {

// sqrt(M_ii) per row. An entry that vanishes (a DOF that nothing holds) is compared in units of
// its kind's largest, times 1e-3.
Vec6 ScaleOf(const Mat6& M) {
  Vec6 scale;
  for (int first : {0, 3}) {
    const double most = M.diagonal().segment<3>(first).cwiseAbs().maxCoeff();
    for (int i = first; i < first + 3; ++i) scale[i] = std::sqrt(std::max(M(i, i), 1e-6 * most));
  }
  return scale;
}

Mat6 Scaled(const Mat6& M, const Vec6& scale) {
  const Vec6 inverse = scale.cwiseInverse();
  return inverse.asDiagonal() * M * inverse.asDiagonal();
}

// True if `value` is worse than the worst so far; NaN is worst and stays.
bool IsWorse(double value, double worst) { return !std::isnan(worst) && !(value <= worst); }

Measured WorstOf(const Mat6& difference, const char* matrix) {
  Measured worst;
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double value = std::abs(difference(i, j));
      if (std::isnan(value)) return {};
      if (!worst.channel.empty() && !IsWorse(value, worst.value)) continue;
      worst = {.value = value,
               .channel = fmt::format("{}({}, {})", matrix, AxisName(i), AxisName(j))};
    }
  }
  return worst;
}

Measured WorstShare(const StiffnessResult& measured, const StiffnessResult& truth) {
  const Vec6 scale = ScaleOf(truth.C);
  Measured worst{.value = 0.0};
  for (const ComplianceShare& share : truth.shares) {
    const auto found = std::ranges::find(measured.shares, share.element, &ComplianceShare::element);
    if (found == measured.shares.end()) return {.channel = share.element + " is missing"};
    const Measured entry = WorstOf(Scaled(found->C - share.C, scale), "C");
    if (!worst.channel.empty() && !IsWorse(entry.value, worst.value)) continue;
    worst = {.value = entry.value, .channel = share.element + ", " + entry.channel};
  }
  return worst;
}

LoadErrors CompareLoads(const std::vector<Vec6>& measured, const std::vector<Vec6>& truth) {
  LoadErrors errors;
  errors.scale = errors.max = errors.mean = Vec6::Zero();
  errors.vector_max = errors.vector_mean = 0.0;
  for (const Vec6& d : truth) errors.scale = errors.scale.cwiseMax(d.cwiseAbs());
  // An axis that hardly moves is compared in units of its kind's largest, times 1e-3.
  for (int first : {0, 3}) {
    const double floor = 1e-3 * errors.scale.segment<3>(first).maxCoeff();
    for (int i = first; i < first + 3; ++i) errors.scale[i] = std::max(errors.scale[i], floor);
  }
  double worst = -1.0;
  const auto count = static_cast<double>(truth.size());
  for (size_t k = 0; k < truth.size(); ++k) {
    const Vec6 error = measured[k] - truth[k];
    const Vec6 relative = error.cwiseAbs().cwiseQuotient(errors.scale);
    errors.mean += relative / count;
    for (int i = 0; i < 6; ++i) {
      if (IsWorse(relative[i], errors.max[i])) errors.max[i] = relative[i];
    }
    if (const double most = relative.tail<3>().maxCoeff<Eigen::PropagateNaN>();
        IsWorse(most, worst)) {
      worst = most;
      errors.worst_load = static_cast<int>(k);
    }
    const double of_vector = error.tail<3>().norm() / truth[k].tail<3>().norm();
    errors.vector.push_back(of_vector);
    errors.vector_mean += of_vector / count;
    if (k == 0 || IsWorse(of_vector, errors.vector_max)) {
      errors.vector_max = of_vector;
      errors.worst_vector = static_cast<int>(k);
    }
  }
  return errors;
}

// Of the axes from `first` on, rotations or displacements.
Measured WorstAxis(const LoadErrors& errors, int first) {
  Measured worst;
  for (int i = first; i < first + 3; ++i) {
    if (!worst.channel.empty() && !IsWorse(errors.max[i], worst.value)) continue;
    worst = {.value = errors.max[i], .channel = AxisName(i)};
  }
  return worst;
}

}  // namespace

StiffnessDifference DifferenceOf(const StiffnessWitness& measured, const StiffnessWitness& truth) {
  const StiffnessResult &a = measured.result, &b = truth.result;
  StiffnessDifference difference;
  difference.K = Scaled(a.K - b.K, ScaleOf(b.K));
  if (a.C.allFinite() && b.C.allFinite()) difference.C = Scaled(a.C - b.C, ScaleOf(b.C));
  const size_t loads = measured.displacements.size();
  if (loads > 0 && loads == truth.displacements.size()) {
    difference.loads = CompareLoads(measured.displacements, truth.displacements);
  }
  return difference;
}

PairComparison CompareStiffnesses(const Witness& measured, const Witness& truth) {
  PairComparison pair;
  pair.measured = measured.name;
  pair.truth = truth.name;
  pair.reason = internal::NotComparedReason(measured, truth);
  if (!pair.reason.empty()) return pair;
  pair.compared = true;
  const StiffnessWitness &a = *measured.stiffness, &b = *truth.stiffness;
  const StiffnessDifference difference = DifferenceOf(a, b);
  pair.metrics[Metric::kStiffnessEntry] = WorstOf(difference.K, "K");
  if (a.result.C.allFinite() && b.result.C.allFinite()) {
    pair.metrics[Metric::kComplianceEntry] = WorstOf(difference.C, "C");
    if (!a.result.shares.empty() && !b.result.shares.empty()) {
      pair.metrics[Metric::kShareEntry] = WorstShare(a.result, b.result);
    }
  }
  if (!difference.loads) return pair;
  const LoadErrors& loads = *difference.loads;
  Measured& axis = pair.metrics[Metric::kDisplacementAxis] = WorstAxis(loads, 3);
  axis.channel += fmt::format(", load {}", loads.worst_load + 1);
  pair.metrics[Metric::kRotationAxis] = WorstAxis(loads, 0);
  pair.metrics[Metric::kDisplacementVector] = {
      .value = loads.vector_max, .channel = fmt::format("load {}", loads.worst_vector + 1)};
  return pair;
}

std::map<Metric, Measured> MeasureStiffness(const StiffnessWitness& stiffness, bool simulated) {
  const StiffnessResult& result = stiffness.result;
  std::map<Metric, Measured> metrics;
  const Vec6 scale = ScaleOf(result.K);
  metrics[Metric::kSymmetry] = WorstOf(Scaled(result.K - result.K.transpose(), scale), "K");
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(
      Mat6(Scaled(0.5 * (result.K + result.K.transpose()), scale)));
  metrics[Metric::kDefinite].value = std::max(0.0, -solver.eigenvalues()[0]);
  if (!result.shares.empty() && result.C.allFinite()) {
    Mat6 rest = -result.C;
    for (const ComplianceShare& share : result.shares) rest += share.C;
    metrics[Metric::kSharesSum] = WorstOf(Scaled(rest, ScaleOf(result.C)), "C");
  }
  if (!simulated) return metrics;
  metrics[Metric::kResidual].value = stiffness.residual;
  metrics[Metric::kExtrapolation].value = stiffness.extrapolation_error;
  return metrics;
}

void internal::AddStiffnessNotes(const ComparisonInput& input, Comparison* comparison) {
  const bool loaded = std::ranges::any_of(
      input.witnesses, [](const Witness& w) { return !w.stiffness->displacements.empty(); });
  const auto note = [&](const PairComparison& pair, const char* what, const char* why) {
    comparison->not_compared.push_back({pair.name() + what, why});
  };
  for (const PairComparison& pair : comparison->pairs) {
    if (!pair.compared) continue;
    if (!pair.metrics.contains(Metric::kComplianceEntry)) {
      note(pair, ".compliance", "the stiffness is singular and has no inverse");
    }
    if (!pair.metrics.contains(Metric::kShareEntry)) {
      note(pair, ".shares", "not both give the elements' shares");
    }
    if (loaded && !pair.metrics.contains(Metric::kDisplacementAxis)) {
      note(pair, ".loads", "not both give displacements");
    }
  }
}

std::vector<Vec6> Displacements(const StiffnessResult& result, const std::vector<Vec6>& loads) {
  std::vector<Vec6> displacements;
  if (!result.C.allFinite()) return displacements;
  for (const Vec6& load : loads) displacements.push_back(result.C * load);
  return displacements;
}

const char* AxisName(int row) {
  static constexpr const char* kNames[] = {"rx", "ry", "rz", "x", "y", "z"};
  return kNames[row];
}

}  // namespace mbv
