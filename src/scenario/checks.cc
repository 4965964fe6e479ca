#include "scenario/checks.h"

#include "base/demand.h"

namespace mbv {
namespace {

constexpr MetricRow Pair(Metric metric, const char* key, const char* json, const char* title,
                         const char* unit, const MetricLimits& limits) {
  return {metric, key, json, title, unit, true, limits};
}
constexpr MetricRow Alone(Metric metric, const char* key, const char* json, const char* title,
                          const char* unit, const MetricLimits& limits) {
  return {metric, key, json, title, unit, false, limits};
}

// Two linear computations differ by rounding only. The simulated stiffness is extrapolated to zero
// load; its finite displacements also contain the geometric non-linearity of the load itself.
constexpr MetricLimits OfStiffness(double simulated, double computed) {
  return {.forward = simulated, .inverse = simulated, .reference = computed};
}

// Forward limits hold for the corrected engine at 1 ms on the shipped motions: most come to 1e-10
// or less, the fastest (pick_place) to 4.3e-7. The others are far above what double precision
// leaves after a 20-unknown linear solve, 1e-14 there: a user's mechanism may stand near a singular
// pose.
constexpr MetricRow kRows[] = {
    Pair(Metric::kForceNrmse, "force_nrmse", "force_nrmse", "drive force, RMS", "",
         {1e-6, 1e-10, 1e-10}),
    Pair(Metric::kForceMax, "force_max", "force_max_rel", "drive force, max", "",
         {1e-5, 1e-9, 1e-9}),
    Pair(Metric::kForceOwn, "force_nrmse_own", "force_nrmse_own", "drive force, own scale", "",
         {1e-5, 1e-9, 1e-9}),
    Pair(Metric::kPositionM, "position_m", "position_max_m", "drive position", "m",
         {1e-6, 1e-10, 1e-10}),
    Pair(Metric::kPositionRad, "position_rad", "position_max_rad", "drive angle", "rad",
         {1e-6, 1e-10, 1e-10}),
    Pair(Metric::kVelocity, "velocity_nrmse", "velocity_nrmse", "drive velocity, RMS", "",
         {1e-5, 1e-9, 1e-9}),
    Pair(Metric::kAcceleration, "acceleration_nrmse", "acceleration_nrmse",
         "drive acceleration, RMS", "", {1e-4, 1e-8, 1e-8}),
    Pair(Metric::kPoseM, "pose_m", "pose_max_m", "output position", "m", {1e-6, 1e-9, 1e-9}),
    Pair(Metric::kPoseRad, "pose_rad", "pose_max_rad", "output orientation", "rad",
         {1e-6, 1e-9, 1e-9}),
    Pair(Metric::kReaction, "reaction_nrmse", "reaction_nrmse", "joint reactions, RMS", "",
         {1e-5, 1e-8, 1e-8}),
    Pair(Metric::kReactionOwn, "reaction_nrmse_own", "reaction_nrmse_own",
         "joint reactions, own scale", "", {1e-4, 1e-7, 1e-7}),
    Pair(Metric::kBaseForce, "base_force", "base_force_nrmse", "force of prescribed joints", "",
         {1e-5, 1e-9, 1e-9}),
    Alone(Metric::kCommandM, "command_m", "command_max_m", "commanded position", "m",
          {1e-6, 1e-9, 1e-9}),
    Alone(Metric::kCommandRad, "command_rad", "command_max_rad", "commanded angle", "rad",
          {1e-6, 1e-9, 1e-9}),
    Alone(Metric::kCommandVelocity, "command_velocity", "command_velocity_nrmse",
          "commanded velocity, RMS", "", {1e-5, 1e-9, 1e-9}),
    Alone(Metric::kCommandAcceleration, "command_acceleration", "command_acceleration_nrmse",
          "commanded acceleration", "", {1e-4, 1e-8, 1e-8}),
    Alone(Metric::kClosureM, "closure_m", "closure_max_m", "loop gap", "m", {1e-8, 1e-10, 1e-10}),
    Alone(Metric::kClosureRad, "closure_rad", "closure_max_rad", "loop twist", "rad",
          {1e-8, 1e-10, 1e-10}),
    Alone(Metric::kPower, "power_balance", "power_balance_rel", "power balance", "",
          {1e-6, 1e-8, 1e-8}),
    Alone(Metric::kDerivatives, "derivatives", "derivatives_rel", "rates are derivatives", "",
          {1e-4, 1e-4, 1e-4}),
    Alone(Metric::kEnergy, "energy_drift", "energy_drift_rel", "energy drift", "",
          {1e-6, 1e-6, 1e-8}),
    Pair(Metric::kTableTube, "table_tube", "table_tube_max", "table column / its tube", "",
         {1.0, 1.0, 1.0}),
    Alone(Metric::kMotorUse, "motor_margin", "motor_use", "motor use, 1 / margin", "", {}),
    Pair(Metric::kStiffnessEntry, "stiffness_entry", "stiffness_entry", "stiffness, worst entry",
         "", OfStiffness(1e-4, 1e-9)),
    Pair(Metric::kComplianceEntry, "compliance_entry", "compliance_entry",
         "compliance, worst entry", "", OfStiffness(1e-4, 1e-9)),
    Pair(Metric::kShareEntry, "share_entry", "share_entry", "elements' shares, worst entry", "",
         OfStiffness(1e-4, 1e-9)),
    Pair(Metric::kDisplacementAxis, "displacement_axis", "displacement_axis",
         "displacement, worst axis", "", OfStiffness(1e-2, 1e-9)),
    Pair(Metric::kDisplacementVector, "displacement_vector", "displacement_vector",
         "displacement, worst vector", "", OfStiffness(1e-2, 1e-9)),
    Pair(Metric::kRotationAxis, "rotation_axis", "rotation_axis", "rotation, worst axis", "",
         OfStiffness(1e-2, 1e-9)),
    Alone(Metric::kSymmetry, "symmetry", "symmetry", "symmetry", "", OfStiffness(1e-6, 1e-9)),
    Alone(Metric::kDefinite, "definite", "definite", "no negative stiffness", "",
          OfStiffness(1e-6, 1e-9)),
    Alone(Metric::kSharesSum, "shares_sum", "shares_sum", "shares add up", "",
          OfStiffness(1e-6, 1e-9)),
    Alone(Metric::kResidual, "residual", "residual", "equilibrium, unbalanced force", "",
          OfStiffness(1e-8, 1e-8)),
    Alone(Metric::kExtrapolation, "extrapolation", "extrapolation", "extrapolation to zero load",
          "", OfStiffness(1e-5, 1e-5)),
};
static_assert(std::size(kRows) == kMetrics);
constexpr size_t kOfMotion = static_cast<size_t>(Metric::kStiffnessEntry);

}  // namespace

std::optional<double> MetricLimits::Of(LimitColumn column) const {
  switch (column) {
    case LimitColumn::kForward:
      return forward;
    case LimitColumn::kInverse:
      return inverse;
    case LimitColumn::kReference:
      return reference;
    case LimitColumn::kServo:
      return servo;
  }
  return {};
}

std::span<const MetricRow> MetricRows() { return std::span(kRows).first(kOfMotion); }

std::span<const MetricRow> StiffnessMetricRows() { return std::span(kRows).subspan(kOfMotion); }

const MetricRow& RowOf(Metric metric) {
  const MetricRow& row = kRows[static_cast<int>(metric)];
  MBV_DEMAND(row.metric == metric, row.key);
  return row;
}

const MetricRow* FindMetric(const std::string& key, std::span<const MetricRow> rows) {
  for (const MetricRow& row : rows) {
    if (key == row.key) return &row;
  }
  return nullptr;
}

CheckLimits::CheckLimits() {
  for (const MetricRow& row : kRows) (*this)[row.metric] = row.limits;
}

}  // namespace mbv
