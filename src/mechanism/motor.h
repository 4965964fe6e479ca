// Motors: what moves a drive, as its data sheet says. No witness knows them: they say what of the
// computed drive forces and speeds a motor can give.
//
//   n    gear ratio: motor speed / drive speed (a spindle of lead h: 2π/h per metre)
//   ω_m = n v                                                                               (1)
//   τ_m = F/(n η) where the motor drives, F v >= 0;  η F/n where it brakes                  (2)
//         + J_r n v̇                                                                         (3)
//
// Limits are symmetric: they hold for magnitudes of speed and torque. A motor that turns has rad/s
// and N m, one that slides has m/s and N ("torque" and "speed" below stand for both).
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "core/types.h"

namespace mbv {

/// A point of a torque–speed curve, at the motor.
struct CurvePoint {
  double speed = 0.0, torque = 0.0;
};

struct Motor {
  static constexpr double kNoLimit = std::numeric_limits<double>::infinity();

  int drive = -1;                 ///< index into Mechanism::drives
  bool turns = true;              ///< else it slides
  double continuous = kNoLimit;   ///< torque that it can bear for ever (RMS)
  double peak = kNoLimit;         ///< torque that it can give for short
  double rated_speed = kNoLimit;  ///< up to it, `continuous` may be used
  double max_speed = kNoLimit;    ///< never faster
  double rotor_inertia = 0.0;     ///< J_r [kg m²], or mass of the slider [kg]
  double gear_ratio = 1.0;        ///< n > 0
  double efficiency = 1.0;        ///< η of the gear, 0 < η <= 1
  double torque_constant = kNan;  ///< k_t [N m/A]; [N/A]
  double resistance = kNan;       ///< of the winding [Ω]
  double voltage = kNoLimit;      ///< of the supply [V]
  double continuous_current = kNoLimit, peak_current = kNoLimit;  ///< [A]
  /// Instead of `continuous` and `peak` constant over speed: increasing speeds, straight lines
  /// between; beyond the last point nothing is left.
  std::vector<CurvePoint> continuous_curve, peak_curve;

  [[nodiscard]] const char* torque_unit() const { return turns ? "N m" : "N"; }
  [[nodiscard]] const char* speed_unit() const { return turns ? "rad/s" : "m/s"; }
};

/// The torque that is left at a speed (its magnitude counts): the curve if there is one, else the
/// constant up to its highest speed, and zero beyond.
[[nodiscard]] double ContinuousTorque(const Motor& motor, double speed);
[[nodiscard]] double PeakTorque(const Motor& motor, double speed);

}  // namespace mbv
