#include "comparison/motor_load.h"

#include <algorithm>
#include <cmath>

#include "comparison/force_band.h"

namespace mbv {
namespace {

constexpr double kMoving = 0.01;  // of the largest speed
constexpr double kNone = 1e-9;    // of the largest torque

// ∫ f dt by the trapezoidal rule.
template <typename F>
double Integral(const std::vector<double>& time_s, const F& f) {
  double sum = 0.0;
  for (size_t i = 1; i < time_s.size(); ++i) {
    sum += 0.5 * (time_s[i] - time_s[i - 1]) * (f(i - 1) + f(i));
  }
  return sum;
}

double Share(double used, double limit) {
  if (used == 0.0) return 0.0;
  return limit > 0.0 ? used / limit : std::numeric_limits<double>::infinity();
}

// Motor torque: Eqs. 2 and 3 of motor.h.
double TorqueOf(const Motor& motor, double force, double velocity, double acceleration) {
  const bool drives = force * velocity >= 0.0;
  const double gear = drives ? 1.0 / motor.efficiency : motor.efficiency;
  return force / motor.gear_ratio * gear + motor.rotor_inertia * motor.gear_ratio * acceleration;
}

// The torque at the end of the band that asks for more.
double WorstTorque(const Motor& motor, const ForceBand& force, double velocity,
                   double acceleration) {
  const double low = TorqueOf(motor, force.lower(), velocity, acceleration);
  const double high = TorqueOf(motor, force.upper(), velocity, acceleration);
  if (HasSides(motor)) {
    const double speed = motor.gear_ratio * velocity;
    const double of_low = PeakShare(motor, low, speed), of_high = PeakShare(motor, high, speed);
    if (of_low != of_high) return of_low > of_high ? low : high;
  }
  return std::abs(low) > std::abs(high) ? low : high;
}

class Meter {
 public:
  Meter(const Motor& motor, MotorLoad* load) : motor_(motor), load_(*load) {}

  void Measure() {
    const double span_s = load_.time_s.back() - load_.time_s.front();
    if (span_s <= 0.0) return;
    Torques(span_s);
    Powers(span_s);
    Currents();
    Limits();
  }

 private:
  [[nodiscard]] double Torque(size_t i) const { return load_.torque[static_cast<Eigen::Index>(i)]; }
  [[nodiscard]] double Speed(size_t i) const { return load_.speed[static_cast<Eigen::Index>(i)]; }

  template <typename F>
  double Mean(double span_s, const F& f) const {
    return Integral(load_.time_s, f) / span_s;
  }

  void Torques(double span_s) {
    Eigen::Index peak = 0;
    load_.torque.cwiseAbs().maxCoeff(&peak);
    load_.peak_torque = load_.torque[peak];
    load_.mean_torque = Mean(span_s, [&](size_t i) { return Torque(i); });
    load_.rms_torque = std::sqrt(Mean(span_s, [&](size_t i) { return Torque(i) * Torque(i); }));
    load_.peak_speed = load_.speed.cwiseAbs().maxCoeff();
    load_.mean_speed = Mean(span_s, [&](size_t i) { return std::abs(Speed(i)); });
    const double still = kMoving * load_.peak_speed;
    load_.duty = Mean(span_s, [&](size_t i) { return std::abs(Speed(i)) > still ? 1.0 : 0.0; });
    load_.continuous_torque = ContinuousTorque(motor_, load_.mean_speed);
    load_.above_continuous = Mean(span_s, [&](size_t i) {
      return std::abs(Torque(i)) > ContinuousTorque(motor_, Speed(i)) ? 1.0 : 0.0;
    });
  }

  void Powers(double) {
    const VecX power = load_.torque.cwiseProduct(load_.speed);
    const auto at = [&](size_t i) { return power[static_cast<Eigen::Index>(i)]; };
    load_.peak_power = std::max(0.0, power.maxCoeff());
    load_.peak_brake_power = std::min(0.0, power.minCoeff());
    load_.energy_J = Integral(load_.time_s, [&](size_t i) { return std::max(0.0, at(i)); });
    load_.brake_energy_J = Integral(load_.time_s, [&](size_t i) { return std::min(0.0, at(i)); });
  }

  // U = R i + k_t ω, i = τ/k_t.
  void Currents() {
    const double k = motor_.torque_constant;
    if (std::isnan(k)) return;
    load_.rms_current = load_.rms_torque / k;
    load_.peak_current = std::abs(load_.peak_torque) / k;
    if (std::isnan(motor_.resistance)) return;
    load_.peak_voltage =
        (motor_.resistance / k * load_.torque + k * load_.speed).cwiseAbs().maxCoeff();
  }

  void Limits() {
    AddPeak();
    Add("continuous", load_.rms_torque, load_.continuous_torque);
    Add("speed", load_.peak_speed, motor_.max_speed);
    Add("rated speed", load_.mean_speed, motor_.rated_speed);
    Add("continuous current", load_.rms_current, motor_.continuous_current);
    Add("peak current", load_.peak_current, motor_.peak_current);
    Add("voltage", load_.peak_voltage, motor_.voltage);
  }

  void Add(const char* of, double used, double limit) {
    if (std::isinf(limit) || std::isnan(limit) || std::isnan(used)) return;
    load_.uses.push_back({of, Share(used, limit), kNan});
  }

  // The peak curve at each sample's own speed.
  void AddPeak() {
    if (std::isinf(motor_.peak) && motor_.peak_curve.empty() && !HasSides(motor_)) return;
    MotorLoad::Use use{.of = "peak", .use = 0.0};
    // A motor of one side is not asked for round-off of the other.
    const double none = HasSides(motor_) ? kNone * std::abs(load_.peak_torque) : 0.0;
    for (size_t i = 0; i < load_.time_s.size(); ++i) {
      if (std::abs(Torque(i)) < none) continue;
      const double share = PeakShare(motor_, Torque(i), Speed(i));
      if (!(share > use.use)) continue;
      use.use = share;
      use.time_s = load_.time_s[i];
    }
    if (HasSides(motor_) && std::isinf(use.use)) use.of = "peak, none on this side";
    load_.uses.push_back(use);
  }

  const Motor& motor_;
  MotorLoad& load_;
};

const MotorLoad::Use* Largest(const std::vector<MotorLoad::Use>& uses) {
  const auto largest = std::max_element(
      uses.begin(), uses.end(),
      [](const MotorLoad::Use& a, const MotorLoad::Use& b) { return a.use < b.use; });
  return largest == uses.end() ? nullptr : &*largest;
}

}  // namespace

double MotorLoad::largest_use() const {
  const Use* use = Largest(uses);
  return use == nullptr ? kNan : use->use;
}

double MotorLoad::largest_use_time_s() const {
  const Use* use = Largest(uses);
  return use == nullptr ? kNan : use->time_s;
}

const char* MotorLoad::limited_by() const {
  const Use* use = Largest(uses);
  return use == nullptr ? "" : use->of;
}

MotorLoad MotorLoadOf(const Mechanism& mechanism, const Motor& motor, const Trace& trace,
                      double load_inertia) {
  const std::string& drive = mechanism.drives[static_cast<size_t>(motor.drive)].name;
  MotorLoad load{.drive = drive,
                 .witness = trace.witness,
                 .torque_unit = motor.torque_unit(),
                 .speed_unit = motor.speed_unit()};
  const int force = trace.Find(Quantity::kForce, drive), v = trace.Find(Quantity::kVelocity, drive);
  const int a = trace.Find(Quantity::kAcceleration, drive);
  if (force < 0 || v < 0 || a < 0 || trace.time_s.empty()) return load;
  const bool complete = trace.values.col(force).allFinite() && trace.values.col(v).allFinite() &&
                        trace.values.col(a).allFinite();
  if (!complete) return load;
  load.time_s = trace.time_s;
  load.speed = motor.gear_ratio * trace.values.col(v);
  load.torque.resize(load.speed.size());
  const ForceSignal signal(trace, force);
  for (Eigen::Index i = 0; i < load.torque.size(); ++i) {
    const ForceBand at = signal.At(i);
    load.torque[i] = WorstTorque(motor, at, trace.values(i, v), trace.values(i, a));
    load.samples_at_rest += at.open() ? 1 : 0;
  }
  if (motor.rotor_inertia > 0.0) {
    load.inertia_ratio = load_inertia / (motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia);
  }
  Meter(motor, &load).Measure();
  return load;
}

}  // namespace mbv
