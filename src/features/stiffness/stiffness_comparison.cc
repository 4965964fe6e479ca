#include "features/stiffness/stiffness_comparison.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "comparison/reservations.h"
#include "comparison/verdict.h"

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

// Infinite instead of NaN when something is missing, so that it never passes.
WorstEntry WorstOf(const Mat6& difference, const char* matrix) {
  WorstEntry worst{0.0, ""};
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      const double value = std::abs(difference(i, j));
      if (std::isnan(value)) return {kNan, ""};
      if (!worst.where.empty() && !IsWorse(value, worst.value)) continue;
      worst = {value, fmt::format("{}({}, {})", matrix, AxisName(i), AxisName(j))};
    }
  }
  return worst;
}

WorstEntry WorstShare(const StiffnessResult& measured, const StiffnessResult& truth) {
  const Vec6 scale = ScaleOf(truth.C);
  WorstEntry worst{0.0, ""};
  for (const ComplianceShare& share : truth.shares) {
    const auto found =
        std::find_if(measured.shares.begin(), measured.shares.end(),
                     [&](const ComplianceShare& other) { return other.element == share.element; });
    if (found == measured.shares.end()) return {kNan, share.element + " is missing"};
    const WorstEntry entry = WorstOf(Scaled(found->C - share.C, scale), "C");
    if (!(entry.value <= worst.value) || worst.where.empty()) {
      worst = {entry.value, share.element + ", " + entry.where};
      if (std::isnan(worst.value)) return worst;
    }
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

WorstEntry WorstAxis(const LoadErrors& errors, int first) {
  WorstEntry worst{0.0, ""};
  for (int i = first; i < first + 3; ++i) {
    if (!worst.where.empty() && !IsWorse(errors.max[i], worst.value)) continue;
    worst = {errors.max[i], AxisName(i)};
  }
  return worst;
}

// "reference: singular pose near …", "…: switched off in the scenario".
std::string Explain(const StiffnessWitness& witness) {
  return witness.name + ": " + witness.result.summary.message;
}

// `subject`: a witness, or a pair in which it is measured.
void AddCheck(const StiffnessInput& input, const std::string& witness, const std::string& subject,
              StiffnessMetric metric, const WorstEntry& measured, StiffnessComparison* comparison) {
  const StiffnessLimit& limit = input.limits[metric];
  StiffnessCheck check{.name = subject + "." + RowOf(metric).key,
                       .subject = subject,
                       .metric = metric,
                       .value = measured.value,
                       .limit = IsEngine(witness) ? limit.simulated : limit.computed,
                       .where = measured.where};
  check.pass = Passes(check.value, check.limit);
  comparison->checks.push_back(std::move(check));
}

void AddPair(const StiffnessInput& input, const RolePair& roles, StiffnessComparison* comparison) {
  const StiffnessWitness* a = FindNamed(input.witnesses, roles.measured->name);
  const StiffnessWitness* b = FindNamed(input.witnesses, roles.truth->name);
  if (a == nullptr || b == nullptr) return;
  StiffnessPair pair = CompareStiffnessPair(*a, *b);
  const auto note = [&](const std::string& what, const std::string& why) {
    comparison->not_compared.push_back({pair.name() + what, why});
  };
  if (!pair.compared) {
    note("", pair.reason);
  } else {
    if (!pair.metrics.contains(StiffnessMetric::kComplianceEntry)) {
      note(".compliance", "the stiffness is singular and has no inverse");
    }
    if (!pair.metrics.contains(StiffnessMetric::kShareEntry)) {
      note(".shares", "not both give the elements' shares");
    }
    if (!pair.loads && !input.loads.empty()) note(".loads", "not both give displacements");
  }
  for (const auto& [metric, worst] : pair.metrics) {
    AddCheck(input, pair.measured, pair.name(), metric, worst, comparison);
  }
  comparison->pairs.push_back(std::move(pair));
}

// What one witness shows by itself.
void AddOwnChecks(const StiffnessInput& input, const StiffnessWitness& witness,
                  StiffnessComparison* comparison) {
  const StiffnessResult& result = witness.result;
  const auto add = [&](StiffnessMetric metric, const WorstEntry& worst) {
    AddCheck(input, witness.name, witness.name, metric, worst, comparison);
  };
  const Vec6 scale = ScaleOf(result.K);
  add(StiffnessMetric::kSymmetry, WorstOf(Scaled(result.K - result.K.transpose(), scale), "K"));
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(
      Mat6(Scaled(0.5 * (result.K + result.K.transpose()), scale)));
  add(StiffnessMetric::kDefinite, {std::max(0.0, -solver.eigenvalues()[0]), ""});
  if (!result.shares.empty() && result.C.allFinite()) {
    Mat6 rest = -result.C;
    for (const ComplianceShare& share : result.shares) rest += share.C;
    add(StiffnessMetric::kSharesSum, WorstOf(Scaled(rest, ScaleOf(result.C)), "C"));
  }
  if (!IsEngine(witness.name)) return;
  add(StiffnessMetric::kResidual, {witness.residual, ""});
  add(StiffnessMetric::kExtrapolation, {witness.extrapolation_error, ""});
}

bool JudgesStiffness(const StiffnessCheck& check) {
  return check.limit && (check.metric == StiffnessMetric::kStiffnessEntry ||
                         check.metric == StiffnessMetric::kComplianceEntry);
}

void Judge(const StiffnessInput& input, StiffnessComparison* comparison) {
  for (const StiffnessWitness& witness : input.witnesses) {
    const RunSummary& summary = witness.result.summary;
    if (summary.ok() || summary.stop == Stop::kNotRun) continue;
    comparison->reason = Explain(witness);
    return;
  }
  if (comparison->MainPair() == nullptr) {
    comparison->reason = "no stiffness could be compared";
    if (!comparison->pairs.empty()) comparison->reason += ": " + comparison->pairs.front().reason;
    return;
  }
  if (std::none_of(comparison->checks.begin(), comparison->checks.end(), JudgesStiffness)) {
    comparison->reason = "every check of K and C is switched off, so nothing was verified";
    return;
  }
  const size_t failed = comparison->failed();
  comparison->verdict = failed == 0 ? Verdict::kAgree : Verdict::kDisagree;
  comparison->reason =
      failed == 0 ? fmt::format("all {} checks are within their limits", comparison->verified())
                  : fmt::format("{} of {} checks exceed their limits", failed,
                                failed + comparison->verified());
}

std::string Amount(double value) {
  return value >= 1e-3 ? fmt::format("{:.2g} %", 100 * value) : fmt::format("{:.1e}", value);
}

double DistanceOf(const StiffnessPair* pair) {
  if (pair == nullptr || !pair->compared) return kNan;
  return pair->metrics.at(StiffnessMetric::kStiffnessEntry).value;
}

// Two against one, by the worst entry of K.
Attribution Attribute(const StiffnessComparison& comparison) {
  const StiffnessPair* main = comparison.MainPair();
  if (main == nullptr) return {};
  std::vector<PairDistance> distances;
  for (const StiffnessPair& pair : comparison.pairs) {
    const double distance = DistanceOf(&pair);
    if (!std::isnan(distance)) distances.push_back({pair.measured, pair.truth, distance});
  }
  if (distances.size() < 3) {
    return {"", fmt::format("only two computations were compared: K differs by {} at most",
                            Amount(DistanceOf(main)))};
  }
  const bool stiffness_fails =
      std::any_of(comparison.checks.begin(), comparison.checks.end(),
                  [](const StiffnessCheck& c) { return JudgesStiffness(c) && !c.pass; });
  if (!stiffness_fails) {
    const auto amount = [&](const Role& measured) {
      return Amount(DistanceOf(comparison.FindPair(PairName(measured, role::kAnalytic))));
    };
    return {"", fmt::format("all three agree: K to {} between closed form and frame elements, to "
                            "{} with the simulation",
                            amount(role::kReference), amount(role::kSimulated))};
  }
  SortByDistance(&distances);
  const std::string odd = OddOneOut(distances);
  if (odd.empty()) {
    return {"", "the three computations differ among each other; none stands out"};
  }
  // Shown is the first pair that it takes part in.
  const auto takes_part = [&](const StiffnessPair& pair) {
    return odd == pair.measured || odd == pair.truth;
  };
  const WorstEntry& worst =
      std::find_if(comparison.pairs.begin(), comparison.pairs.end(), takes_part)
          ->metrics.at(StiffnessMetric::kStiffnessEntry);
  return {odd, fmt::format("{} and {} agree on K to {}; {} differs from them by {}, most at {}",
                           distances[0].measured, distances[0].truth, Amount(distances[0].value),
                           odd, Amount(worst.value), worst.where)};
}

}  // namespace

const StiffnessPair* StiffnessComparison::FindPair(const std::string& name) const {
  return FindPairNamed(pairs, name);
}

const StiffnessCheck* StiffnessComparison::FindCheck(const std::string& name) const {
  return FindNamed(checks, name);
}

const StiffnessPair* StiffnessComparison::MainPair() const { return MainPairOf(pairs); }

size_t StiffnessComparison::failed() const { return CountFailed(checks); }

size_t StiffnessComparison::verified() const {
  return CountPassed(checks, [](const StiffnessCheck&) { return true; });
}

StiffnessPair CompareStiffnessPair(const StiffnessWitness& measured,
                                   const StiffnessWitness& truth) {
  StiffnessPair pair;
  pair.measured = measured.name;
  pair.truth = truth.name;
  pair.reason.clear();
  for (const StiffnessWitness* witness : {&measured, &truth}) {
    if (witness->ran()) continue;
    pair.reason += (pair.reason.empty() ? "" : "; ") + Explain(*witness);
  }
  if (!pair.reason.empty()) return pair;
  pair.compared = true;
  const StiffnessResult &a = measured.result, &b = truth.result;
  pair.K_difference = Scaled(a.K - b.K, ScaleOf(b.K));
  pair.metrics[StiffnessMetric::kStiffnessEntry] = WorstOf(pair.K_difference, "K");
  if (a.C.allFinite() && b.C.allFinite()) {
    pair.C_difference = Scaled(a.C - b.C, ScaleOf(b.C));
    pair.metrics[StiffnessMetric::kComplianceEntry] = WorstOf(pair.C_difference, "C");
    if (!a.shares.empty() && !b.shares.empty()) {
      pair.metrics[StiffnessMetric::kShareEntry] = WorstShare(a, b);
    }
  }
  if (measured.displacements.empty() ||
      measured.displacements.size() != truth.displacements.size()) {
    return pair;
  }
  pair.loads = CompareLoads(measured.displacements, truth.displacements);
  WorstEntry axis = WorstAxis(*pair.loads, 3);
  axis.where = fmt::format("{}, load {}", axis.where, pair.loads->worst_load + 1);
  pair.metrics[StiffnessMetric::kDisplacementAxis] = axis;
  pair.metrics[StiffnessMetric::kRotationAxis] = WorstAxis(*pair.loads, 0);
  pair.metrics[StiffnessMetric::kDisplacementVector] = {
      pair.loads->vector_max, fmt::format("load {}", pair.loads->worst_vector + 1)};
  return pair;
}

std::vector<Vec6> Displacements(const StiffnessResult& result, const std::vector<Vec6>& loads) {
  std::vector<Vec6> displacements;
  if (!result.C.allFinite()) return displacements;
  for (const Vec6& load : loads) displacements.push_back(result.C * load);
  return displacements;
}

StiffnessComparison CompareStiffness(const StiffnessInput& input) {
  StiffnessComparison comparison;
  for (const RolePair& pair : kRolePairs) AddPair(input, pair, &comparison);
  for (const StiffnessWitness& witness : input.witnesses) {
    if (witness.ran()) AddOwnChecks(input, witness, &comparison);
  }
  Judge(input, &comparison);
  for (const std::string& text : input.left_out) {
    comparison.caveats.push_back(LeftOutCaveat(text));
  }
  for (const StiffnessWitness& witness : input.witnesses) {
    if (witness.gap == WitnessGap::kNone || witness.ran()) continue;
    comparison.caveats.push_back(
        MissingWitnessCaveat(witness.name, witness.gap, witness.result.summary.message));
    Caveat& caveat = comparison.caveats.back();
    caveat.text = "without " + caveat.text;
  }
  comparison.attribution = Attribute(comparison);
  return comparison;
}

namespace {

// Signed so that the largest component is positive: a direction has no sense of its own.
template <typename Vector>
Vector WithPositiveMain(const Vector& v) {
  Eigen::Index k = 0;
  v.cwiseAbs().maxCoeff(&k);
  return v[k] < 0 ? Vector(-v) : v;
}

// Principal compliances, ascending.
struct Principal {
  Vec3 values = Vec3::Constant(kNan);
  Mat3 directions = Mat3::Constant(kNan);
};
Principal PrincipalOf(const Mat3& block) {
  Principal principal;
  if (!block.allFinite()) return principal;
  const Eigen::SelfAdjointEigenSolver<Mat3> solver(Mat3(0.5 * (block + block.transpose())));
  principal.values = solver.eigenvalues();
  principal.directions = solver.eigenvectors();
  return principal;
}

WeakDirection WeakestOf(const Mat3& block) {
  const Principal principal = PrincipalOf(block);
  if (!principal.values.allFinite()) return {};
  return {WithPositiveMain(Vec3(principal.directions.col(2))), 1.0 / principal.values[2]};
}

double NaturalLength(const Mat6& C) {
  return std::sqrt(C.bottomRightCorner<3, 3>().trace() / C.topLeftCorner<3, 3>().trace());
}

// Condition number of C with rotations times L.
double Condition(const Mat6& C) {
  const double L = NaturalLength(C);
  if (!C.allFinite() || !(L > 0.0)) return kNan;
  Vec6 s = Vec6::Ones();
  s.head<3>().setConstant(L);
  const Mat6 scaled = s.asDiagonal() * C * s.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(Mat6(0.5 * (scaled + scaled.transpose())));
  return solver.eigenvalues()[5] / solver.eigenvalues()[0];
}

}  // namespace

WeakDirection WeakestTranslation(const Mat6& C) { return WeakestOf(C.bottomRightCorner<3, 3>()); }
WeakDirection WeakestRotation(const Mat6& C) { return WeakestOf(C.topLeftCorner<3, 3>()); }

WeakScrew WeakestScrew(const Mat6& C, double length_m) {
  WeakScrew screw;
  if (!C.allFinite()) return screw;
  screw.length_m = std::isnan(length_m) ? NaturalLength(C) : length_m;
  if (!(screw.length_m > 0.0)) return screw;
  Vec6 s = Vec6::Ones();
  s.head<3>().setConstant(screw.length_m);
  const Mat6 scaled = s.asDiagonal() * C * s.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Mat6> solver(Mat6(0.5 * (scaled + scaled.transpose())));
  screw.stiffness = 1.0 / solver.eigenvalues()[5];
  screw.twist = WithPositiveMain(Vec6(solver.eigenvectors().col(5)));
  screw.twist.head<3>() /= screw.length_m;
  const Vec3 rotation = screw.twist.head<3>(), shift = screw.twist.tail<3>();
  const double turn = rotation.norm();
  if (turn * screw.length_m < 1e-9) {
    screw.axis = shift.normalized();
    screw.point = Vec3::Zero();
    screw.pitch_m = std::numeric_limits<double>::infinity();
    return screw;
  }
  screw.axis = rotation / turn;
  screw.point = rotation.cross(shift) / (turn * turn);
  screw.pitch_m = rotation.dot(shift) / (turn * turn);
  return screw;
}

std::vector<Contribution> Contributions(const StiffnessResult& result) {
  std::vector<Contribution> rows;
  if (!result.C.allFinite()) return rows;
  const Vec3 weak_shift = WeakestTranslation(result.C).direction;
  const Vec3 weak_turn = WeakestRotation(result.C).direction;
  const auto along = [](const Mat3& block, const Vec3& d) { return d.dot(block * d); };
  const double shift = along(result.C.bottomRightCorner<3, 3>(), weak_shift);
  const double turn = along(result.C.topLeftCorner<3, 3>(), weak_turn);
  for (const ComplianceShare& share : result.shares) {
    Contribution row;
    row.element = share.element;
    row.translation = along(share.C.bottomRightCorner<3, 3>(), weak_shift) / shift;
    row.rotation = along(share.C.topLeftCorner<3, 3>(), weak_turn) / turn;
    row.axis = share.C.diagonal().cwiseQuotient(result.C.diagonal());
    rows.push_back(std::move(row));
  }
  std::stable_sort(rows.begin(), rows.end(), [](const Contribution& a, const Contribution& b) {
    return a.translation > b.translation;
  });
  return rows;
}

std::vector<NamedIndex> GeneralIndices(const StiffnessResult& result) {
  const Principal shift = PrincipalOf(result.C.bottomRightCorner<3, 3>());
  const Principal turn = PrincipalOf(result.C.topLeftCorner<3, 3>());
  return {{"k_translation_min", "N/m", "against a force in the weakest direction",
           1.0 / shift.values[2]},
          {"k_translation_max", "N/m", "against a force in the stiffest direction",
           1.0 / shift.values[0]},
          {"k_rotation_min", "N m/rad", "against a moment about the weakest axis",
           1.0 / turn.values[2]},
          {"k_rotation_max", "N m/rad", "against a moment about the stiffest axis",
           1.0 / turn.values[0]},
          {"k_screw_min", "N/m", "against the weakest screw, rotations times L",
           WeakestScrew(result.C).stiffness},
          {"condition", "1", "largest over smallest compliance, rotations times L",
           Condition(result.C)}};
}

const char* AxisName(int row) {
  static constexpr const char* kNames[] = {"rx", "ry", "rz", "x", "y", "z"};
  return kNames[row];
}

const char* StiffnessUnit(int row, int column) {
  if (row < 3) return column < 3 ? "N m/rad" : "N m/m";
  return column < 3 ? "N/rad" : "N/m";
}

const char* ComplianceUnit(int row, int column) {
  if (row < 3) return column < 3 ? "rad/(N m)" : "rad/N";
  return column < 3 ? "m/(N m)" : "m/N";
}

}  // namespace mbv
