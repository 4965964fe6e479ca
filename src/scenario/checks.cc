#include "scenario/checks.h"

#include "base/demand.h"

namespace mbv {
namespace {

// Forward limits hold for the corrected engine at 1 ms on the shipped motions: most come to 1e-10
// or less, the fastest (pick_place) to 4.3e-7. The others are far above what double precision
// leaves after a 20-unknown linear solve, 1e-14 there: a user's mechanism may stand near a singular
// pose.
constexpr MetricRow kRows[] = {
    {Metric::kForceNrmse,
     "force_nrmse",
     "force_nrmse",
     "drive force, RMS",
     "",
     true,
     {1e-6, 1e-10, 1e-10}},
    {Metric::kForceMax,
     "force_max",
     "force_max_rel",
     "drive force, max",
     "",
     true,
     {1e-5, 1e-9, 1e-9}},
    {Metric::kForceOwn,
     "force_nrmse_own",
     "force_nrmse_own",
     "drive force, own scale",
     "",
     true,
     {1e-5, 1e-9, 1e-9}},
    {Metric::kPositionM,
     "position_m",
     "position_max_m",
     "drive position",
     "m",
     true,
     {1e-6, 1e-10, 1e-10}},
    {Metric::kPositionRad,
     "position_rad",
     "position_max_rad",
     "drive angle",
     "rad",
     true,
     {1e-6, 1e-10, 1e-10}},
    {Metric::kVelocity,
     "velocity_nrmse",
     "velocity_nrmse",
     "drive velocity, RMS",
     "",
     true,
     {1e-5, 1e-9, 1e-9}},
    {Metric::kAcceleration,
     "acceleration_nrmse",
     "acceleration_nrmse",
     "drive acceleration, RMS",
     "",
     true,
     {1e-4, 1e-8, 1e-8}},
    {Metric::kPoseM, "pose_m", "pose_max_m", "output position", "m", true, {1e-6, 1e-9, 1e-9}},
    {Metric::kPoseRad,
     "pose_rad",
     "pose_max_rad",
     "output orientation",
     "rad",
     true,
     {1e-6, 1e-9, 1e-9}},
    {Metric::kReaction,
     "reaction_nrmse",
     "reaction_nrmse",
     "joint reactions, RMS",
     "",
     true,
     {1e-5, 1e-8, 1e-8}},
    {Metric::kReactionOwn,
     "reaction_nrmse_own",
     "reaction_nrmse_own",
     "joint reactions, own scale",
     "",
     true,
     {1e-4, 1e-7, 1e-7}},
    {Metric::kBaseForce,
     "base_force",
     "base_force_nrmse",
     "force of prescribed joints",
     "",
     true,
     {1e-5, 1e-9, 1e-9}},
    {Metric::kCommandM,
     "command_m",
     "command_max_m",
     "commanded position",
     "m",
     false,
     {1e-6, 1e-9, 1e-9}},
    {Metric::kCommandRad,
     "command_rad",
     "command_max_rad",
     "commanded angle",
     "rad",
     false,
     {1e-6, 1e-9, 1e-9}},
    {Metric::kCommandVelocity,
     "command_velocity",
     "command_velocity_nrmse",
     "commanded velocity, RMS",
     "",
     false,
     {1e-5, 1e-9, 1e-9}},
    {Metric::kCommandAcceleration,
     "command_acceleration",
     "command_acceleration_nrmse",
     "commanded acceleration",
     "",
     false,
     {1e-4, 1e-8, 1e-8}},
    {Metric::kClosureM, "closure_m", "closure_max_m", "loop gap", "m", false, {1e-8, 1e-10, 1e-10}},
    {Metric::kClosureRad,
     "closure_rad",
     "closure_max_rad",
     "loop twist",
     "rad",
     false,
     {1e-8, 1e-10, 1e-10}},
    {Metric::kPower,
     "power_balance",
     "power_balance_rel",
     "power balance",
     "",
     false,
     {1e-6, 1e-8, 1e-8}},
    {Metric::kDerivatives,
     "derivatives",
     "derivatives_rel",
     "rates are derivatives",
     "",
     false,
     {1e-4, 1e-4, 1e-4}},
    {Metric::kEnergy,
     "energy_drift",
     "energy_drift_rel",
     "energy drift",
     "",
     false,
     {1e-6, 1e-6, 1e-8}},
    {Metric::kTableTube,
     "table_tube",
     "table_tube_max",
     "table column / its tube",
     "",
     true,
     {1.0, 1.0, 1.0}},
    {Metric::kMotorUse, "motor_margin", "motor_use", "motor use, 1 / margin", "", false, {}},
};
static_assert(std::size(kRows) == kMetrics);

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

std::span<const MetricRow> MetricRows() { return kRows; }

const MetricRow& RowOf(Metric metric) {
  const MetricRow& row = kRows[static_cast<int>(metric)];
  MBV_DEMAND(row.metric == metric, row.key);
  return row;
}

const MetricRow* FindMetric(const std::string& key) {
  for (const MetricRow& row : kRows) {
    if (key == row.key) return &row;
  }
  return nullptr;
}

CheckLimits::CheckLimits() {
  for (const MetricRow& row : kRows) (*this)[row.metric] = row.limits;
}

}  // namespace mbv
