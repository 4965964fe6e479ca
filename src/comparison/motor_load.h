// What a run asks of a drive's motor (mechanism/mechanism.h), and how much of the motor that uses.
#pragma once

#include <optional>
#include <span>
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
  VecX electric_W = {};         ///< τω and, where k_t and resistance are given, losses R i²
  double fed_back_J = kNan;     ///< electrical, per cycle; >= 0

  VecX winding_C = {};  ///< over a cycle of the motion that is repeated for ever [°C]
  double winding_peak_C = kNan, housing_peak_C = kNan;  ///< of it; infinite: thermal runaway
  double overheated_s = kNan;  ///< from ambient temperature to the highest allowed; NaN: never
  double gear_torque = kNan, gear_mean_torque = kNan;  ///< at the gearbox's output
  double gear_emergency_torque = kNan;                 ///< also where the brake stops the motor
  double holding_torque = kNan;                        ///< that the brake needs, at rest
  double stop_energy_J = kNan;                         ///< largest of one stop by the brake

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

/// What a brake of a drive bears at each sample, by the reference; empty where it is not known.
struct DriveAtRest {
  VecX force = {};     ///< that holds the mechanism at rest there, without friction
  VecX energy_J = {};  ///< this drive's share p v/2 of the kinetic energy; shares may be negative
};

/// What is known of a drive in addition to a witness's trace.
struct DriveFacts {
  double load_inertia = kNan;  ///< what it moves, at the drive [kg m² or kg]
  DriveAtRest at_rest = {};
};

/// `drive`: its name.
[[nodiscard]] MotorLoad MotorLoadOf(const std::string& drive, const Motor& motor,
                                    const Trace& trace, const DriveFacts& facts = {});
/// Of all motors whose drive the witness records. `facts` by motor; empty: nothing is known.
[[nodiscard]] std::vector<MotorLoad> MotorLoadsOf(const Mechanism& mechanism, const Trace& trace,
                                                  std::span<const DriveFacts> facts = {});

/// The DC link of one witness over a cycle of the repeated motion.
struct LinkLoad {
  std::string witness = {};
  VecX power = {};           ///< that all motors draw, by sample; negative: fed back [W]
  double peak_power = kNan;  ///< largest that is drawn [W]
  double drawn_J = kNan, fed_back_J = kNan;           ///< by all motors together, per cycle; >= 0
  double capacitor_J = kNan, resistor_J = kNan;       ///< of what is fed back: kept, and burnt
  double resistor_mean = kNan, resistor_peak = kNan;  ///< power [W]
  std::string unresolved = {};                        ///< see MotorLoad
  std::vector<MotorLoad::Use> uses = {};
};
/// `loads`: of all motors by one witness, over the same samples. Empty without loads.
[[nodiscard]] std::optional<LinkLoad> LinkLoadOf(const DcLink& link,
                                                 std::span<const MotorLoad> loads);

/// The use that is largest; null without limits.
[[nodiscard]] const MotorLoad::Use* LargestUse(std::span<const MotorLoad::Use> uses);

}  // namespace mbv
