// The checks of a run: which quantities are judged and how good they must be.
//
// Every quantity has three default limits, because three kinds of computation are judged by it: a
// simulation integrated forward in time, a simulation evaluated by inverse dynamics, and the two
// computations without an engine (closed form and generic reference). A scenario changes them by
//   checks: {force_nrmse: 1e-7}                               both simulation modes
//           {force_nrmse: {forward: 1e-7, inverse: 1e-10}}    each mode
//           {reference_force_nrmse: 1e-10}                    reference against closed form
//           {force_nrmse: {servo: 1e-3}}                      servos against the commanded motion
//           {force_max: null}                                 switched off, and reported as such
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace mbv {

/// Before a check's key: its limit between closed form and reference.
inline constexpr std::string_view kReferencePrefix = "reference_";

/// A judged quantity. Those of a pair compare two witnesses; the others need one witness only.
enum class Metric {
  kForceNrmse,       ///< pair: RMS error of all drive forces of one unit / RMS force
  kForceMax,         ///< pair: largest error / largest force, drives of one unit
  kForceOwn,         ///< pair: worst drive's RMS error / its own RMS force (at least 0.1 % of what
                     ///< it carries, and of drives that carry the same)
  kPositionM,        ///< pair: drive positions [m]
  kPositionRad,      ///< pair: drive positions [rad]
  kVelocity,         ///< pair: drive velocities, RMS error / RMS
  kAcceleration,     ///< pair: drive accelerations, RMS error / RMS
  kPoseM,            ///< pair: outputs, distance of origins [m]
  kPoseRad,          ///< pair: outputs, angle of the relative rotation [rad]
  kReaction,         ///< pair: unique joint reactions, RMS error / RMS
  kReactionOwn,      ///< pair: worst joint's RMS error / its own RMS reaction
  kBaseForce,        ///< pair: worst prescribed joint's RMS error / its own RMS force
  kCommandM,         ///< commanded lengths against what the witness did [m]
  kCommandRad,       ///< commanded angles against what the witness did [rad]
  kCommandVelocity,  ///< commanded outputs' rates against what the witness did, RMS error / RMS
  kCommandAcceleration,  ///< their accelerations, the same way
  kClosureM,             ///< loop gap [m]
  kClosureRad,           ///< loop twist gap [rad]
  kPower,                ///< |input power − energy rate| / largest power
  kDerivatives,          ///< drive velocity and acceleration against differences of the positions
  kEnergy,     ///< |energy − start − work| / energy turned over, where work is integrated
  kTableTube,  ///< pair with a table: worst column's difference / its tolerance tube
  kMotorUse,   ///< motors: the largest share of a limit that is used, 1/margin; judged where a
               ///< scenario states `motor_margin`, as 1/motor_margin
  // Of a stiffness at a pose. Entries are compared in units of sqrt(K_ii K_jj): that number does
  // not change with the units of length and angle, and is the relative error for i = j.
  kStiffnessEntry,    ///< pair: max |ΔK_ij| / sqrt(K_ii K_jj)
  kComplianceEntry,   ///< pair: max |ΔC_ij| / sqrt(C_ii C_jj)
  kShareEntry,        ///< pair: the same for each element's share of C, in units of the whole C
  kDisplacementAxis,  ///< pair: max error of Δx, Δy, Δz over the loads / max |Δ| of that axis
  kDisplacementVector,  ///< pair: max over the loads of |error of (Δx, Δy, Δz)| / |(Δx, Δy, Δz)|
  kRotationAxis,        ///< pair: as displacement_axis, for the rotation vector
  kSymmetry,            ///< |K_ij − K_ji| / sqrt(K_ii K_jj)
  kDefinite,            ///< how far the scaled K's smallest eigenvalue is below zero
  kSharesSum,           ///< elements' shares add up to C
  kResidual,            ///< simulation: unbalanced force of the equilibria, over the load
  kExtrapolation,       ///< simulation: error of the extrapolation to zero load
};
inline constexpr int kMetrics = 34;

/// Judges a stiffness; the others judge motions.
[[nodiscard]] constexpr bool IsOfStiffness(Metric metric) {
  return metric >= Metric::kStiffnessEntry;
}

/// Which column of limits applies.
enum class LimitColumn { kForward, kInverse, kReference, kServo };

/// Limits of one metric; an empty one is switched off.
struct MetricLimits {
  std::optional<double> forward, inverse, reference;
  /// Of what servos do to what they are commanded: depends on their gains, so there is no default.
  std::optional<double> servo = std::nullopt;

  [[nodiscard]] std::optional<double> Of(LimitColumn column) const;
};

/// What is known about a metric at compile time.
struct MetricRow {
  Metric metric;
  const char* key;      ///< in `checks:` and in check names
  const char* json;     ///< in summary.json's metrics
  const char* title;    ///< shown
  const char* unit;     ///< "m", "rad" or "" for a ratio
  bool of_pair;         ///< compares two witnesses
  MetricLimits limits;  ///< defaults
};

/// Judges drive forces.
[[nodiscard]] constexpr bool IsDriveForce(Metric metric) {
  return metric == Metric::kForceNrmse || metric == Metric::kForceMax ||
         metric == Metric::kForceOwn;
}

/// Judges positions, velocities or accelerations of drives.
[[nodiscard]] constexpr bool IsDriveMotion(Metric metric) {
  return metric == Metric::kPositionM || metric == Metric::kPositionRad ||
         metric == Metric::kVelocity || metric == Metric::kAcceleration;
}

/// A relative limit above this verifies nothing; lengths and angles likewise, relative to the size
/// of the mechanism and to 1 rad.
inline constexpr double kCoarsestLimit = 0.1;

/// Of motions.
[[nodiscard]] std::span<const MetricRow> MetricRows();
/// Of stiffnesses: both modes of a simulation have one limit.
[[nodiscard]] std::span<const MetricRow> StiffnessMetricRows();
[[nodiscard]] const MetricRow& RowOf(Metric metric);
[[nodiscard]] const MetricRow* FindMetric(const std::string& key,
                                          std::span<const MetricRow> rows = MetricRows());

/// All limits of a scenario, starting from the defaults.
struct CheckLimits {
  CheckLimits();
  std::array<MetricLimits, kMetrics> of;

  [[nodiscard]] const MetricLimits& operator[](Metric m) const { return of[static_cast<int>(m)]; }
  [[nodiscard]] MetricLimits& operator[](Metric m) { return of[static_cast<int>(m)]; }
};

}  // namespace mbv
