// What a run asks of a drive's motor (mechanism/mechanism.h), and how much of the motor that uses.
#pragma once

#include <string>
#include <vector>

#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Over the samples of one witness. RMS and means are over time (trapezoidal rule); the run counts
/// as one cycle. Torque and speed are the motor's, see Motor. Where friction at rest leaves the
/// force open, the end of its band counts that asks more of the motor.
struct MotorLoad {
  /// A limit and the share of it that is used; 1/use is the margin.
  struct Use {
    const char* of = "";  ///< "continuous", "peak", "speed", "rated speed", "current", …
    double use = kNan;
    double time_s = kNan;  ///< of the largest; NaN where it is about the whole run
  };

  std::string drive = {}, witness = {};
  std::string torque_unit = {}, speed_unit = {};
  std::vector<double> time_s = {};
  VecX torque = {},
       speed = {};  ///< at the motor; empty where the witness does not record the drive

  double peak_torque = kNan, rms_torque = kNan, mean_torque = kNan;  ///< peak with its sign
  double peak_speed = kNan, mean_speed = kNan;                       ///< of magnitudes
  double peak_power = kNan, peak_brake_power = kNan;  ///< motor shaft; driving, braking (≤ 0) [W]
  double energy_J = kNan, brake_energy_J = kNan;      ///< per cycle; braking ≤ 0
  double duty = kNan;                                 ///< share of the time in motion
  double above_continuous = kNan;   ///< share of the time above the continuous torque
  double continuous_torque = kNan;  ///< that the motor can bear at the mean speed
  double rms_current = kNan, peak_current = kNan;  ///< where k_t is given [A]
  double peak_voltage = kNan;                      ///< where k_t and resistance are [V]
  double inertia_ratio = kNan;  ///< of the load, reflected to the rotor, to the rotor's own
  size_t samples_at_rest = 0;   ///< at which the force is open
  std::string unresolved = {};  ///< why the samples do not resolve the motion; "" if they do
  std::vector<Use> uses = {};   ///< of every limit that the motor states

  [[nodiscard]] bool known() const { return torque.size() > 0; }
  /// The use that is largest; NaN without limits.
  [[nodiscard]] double largest_use() const;
  [[nodiscard]] double largest_use_time_s() const;
  [[nodiscard]] const char* limited_by() const;
  [[nodiscard]] double margin() const { return 1.0 / largest_use(); }
};

/// `load_inertia`: what the drive moves, at the drive [kg m² or kg]; NaN where it is not known.
[[nodiscard]] MotorLoad MotorLoadOf(const Mechanism& mechanism, const Motor& motor,
                                    const Trace& trace, double load_inertia = kNan);

}  // namespace mbv
