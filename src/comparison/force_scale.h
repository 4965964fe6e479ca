// How small a force, a power or a rate is that a mechanism does not notice.
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/types.h"
#include "comparison/comparison.h"
#include "kinematics/command_rank.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// What a run has anyway, by virtual work at the home pose: while a driven coordinate moves alone
/// by 1 m (or 1 rad) it does work on the bodies that it carries, against their weight, their
/// inertia at the RMS accelerations of all driven coordinates, the loads on them and the springs
/// between them; the largest of these works is its scale [N or N m]. What only prescribed joints
/// carry, and what is fixed, does not count for drives.
struct ForceScale {
  double length_m = 1.0;       ///< characteristic length of the mechanism
  double force_N = 0.0;        ///< largest such force on a body that drives can move, or,
                               ///< without drives, on any
  double moment_Nm = 0.0;      ///< largest moment that turning such a body takes
  std::vector<double> driven;  ///< per drive, then per prescribed joint [N or N m]
  std::map<std::string, double> of_unit;  ///< the largest of the compared drives by unit
  /// Gravity, motion, a load or a spring acts in the direction of some compared drive.
  bool acts = false;
  std::vector<double> acceleration;  ///< per body: gravity or what the motion asks for [m/s²]
  std::vector<double> moment;        ///< per body: to turn it so, or by 1 rad in the time [N m]
  /// `force_N` at the fastest such body; infinite where no joint is prescribed, or all are [W].
  double power_W = 0.0;
  /// carries[c][d]: drive d moves the body that weighs most on drive c.
  std::vector<std::vector<bool>> carries;

  /// Relative errors of forces below 0.1 % of the scale are taken from there: forces that cancel
  /// out leave round-off of this size, and its relative error says nothing.
  [[nodiscard]] double Floor(const std::string& unit) const;
  [[nodiscard]] double Floor(size_t coordinate) const { return kIdle * driven[coordinate]; }
  static constexpr double kIdle = 1e-3;
};
[[nodiscard]] ForceScale ForceScaleOf(const ComparisonInput& input, const Trace& trace);

/// Twists of the motions that force scales need; drives with given forces are not held.
[[nodiscard]] DrivenTwists TwistsFor(const ComparisonInput& input);

/// Rates below which a coordinate counts as at rest: 0.1 % of the characteristic length (1 rad) in
/// the motion's duration; for accelerations also 0.01 % of gravity.
struct RestFloor {
  double velocity = 0.0, acceleration = 0.0;
};
[[nodiscard]] RestFloor RestFloorOf(const ComparisonInput& input, const std::string& position_unit);
/// At least 0.1 % of the RMS rates of the fastest drive in `trace`, too, whatever its unit, and of
/// those of the bodies: a coordinate that is held changes as its moving ends leave it.
[[nodiscard]] RestFloor RestFloorOf(const ComparisonInput& input, const std::string& position_unit,
                                    const Trace& trace);

}  // namespace mbv

// How large the forces of force elements are in a motion, for the force scale.

namespace mbv::internal {

/// A driven coordinate: twists of all bodies per its unit rate at home, and RMS rates.
struct DrivenSize {
  const std::vector<Vec6>* V_WB = nullptr;
  double velocity = 0.0, acceleration = 0.0;
};

/// Of the motion.
struct MotionSize {
  double duration_s = 0.0;
  double most_energy_J = 0.0;  ///< largest energy in springs
};

/// Of one force element.
struct ElementSize {
  std::vector<double> rate;  ///< of its coordinate per unit rate of each driven coordinate
  double force = 0.0;        ///< along its coordinate [N or N m]
};

/// Per element: dampers at the RMS rates, rotors at the RMS accelerations, springs at home and as
/// far away as they can get in the time or by the energy that springs store.
[[nodiscard]] std::vector<ElementSize> SizesOfElements(const Mechanism& mechanism,
                                                       const std::vector<DrivenSize>& driven,
                                                       const MotionSize& motion);

}  // namespace mbv::internal
