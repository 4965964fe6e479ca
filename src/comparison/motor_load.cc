#include "comparison/motor_load.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

// Temperatures above ambient of winding and housing, and 1: each step maps them linearly. Over one
// the losses at the stated resistance are p:
//   τ1/R1 dw/dt = p (1 + α (w + ambient − stated)) − (w − h)/R1
//   τ2/R2 dh/dt = (w − h)/R1 − h/R2
class WindingHeat {
 public:
  WindingHeat(const MotorThermal& thermal, const std::vector<double>& time_s, const VecX& loss_W)
      : thermal_(thermal), time_s_(time_s) {
    reached_.push_back(Mat3::Identity());
    for (size_t i = 1; i < time_s.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(i);
      reached_.push_back(StepOf(0.5 * (loss_W[k - 1] + loss_W[k]), time_s[i] - time_s[i - 1]) *
                         reached_.back());
    }
  }

  // At the start of the cycle that repeats; empty where each one is hotter without end.
  [[nodiscard]] std::optional<Vec3> Steady() const {
    const Mat3& cycle = reached_.back();
    const Eigen::Matrix2d A = cycle.topLeftCorner<2, 2>(), rest = Eigen::Matrix2d::Identity() - A;
    // Both eigenvalues, which are real and positive, are below 1.
    if (!(A.trace() < 2.0) || !(rest.determinant() > 0.0)) return {};
    Vec3 start(0.0, 0.0, 1.0);
    start.head<2>() = rest.inverse() * cycle.topRightCorner<2, 1>();
    return start;
  }
  // Of the winding (0) or the housing (1) at sample i of a cycle [°C].
  [[nodiscard]] double At(int body, size_t i, const Vec3& start) const {
    return reached_[i].row(body).dot(start) + thermal_.ambient_C;
  }
  // From ambient temperature until a sample of the winding is above its limit, given that the
  // motion repeated for ever is. Each cycle is hotter than the one before.
  [[nodiscard]] double TimeToLimit() const {
    std::vector<Mat3> cycles = {reached_.back()};  // 1, 2, 4, …
    while (cycles.size() < kMostDoublings) cycles.push_back(cycles.back() * cycles.back());
    Vec3 start(0.0, 0.0, 1.0);
    double before = 0.0;
    for (size_t k = cycles.size(); k-- > 0 && !TimeAbove(start);) {
      const Vec3 later = cycles[k] * start;
      if (TimeAbove(later)) continue;
      start = later;
      before += std::ldexp(1.0, static_cast<int>(k));
    }
    if (const auto time = TimeAbove(start)) return *time;
    const double span_s = time_s_.back() - time_s_.front();
    return (before + 1.0) * span_s + TimeAbove(reached_.back() * start).value_or(kNan);
  }

 private:
  static constexpr size_t kMostDoublings = 40;

  [[nodiscard]] std::optional<double> TimeAbove(const Vec3& start) const {
    for (size_t i = 0; i < reached_.size(); ++i) {
      if (!(At(0, i, start) <= thermal_.max_winding_C)) return time_s_[i] - time_s_.front();
    }
    return {};
  }

  // exp(A dt): of A dt/2^n by its series, then squared n times.
  [[nodiscard]] Mat3 StepOf(double loss_W, double dt) const {
    const MotorThermal& t = thermal_;
    const double C1 = t.winding_time / t.winding_to_housing, G1 = 1.0 / t.winding_to_housing;
    const double C2 = t.housing_time / t.housing_to_ambient, G2 = 1.0 / t.housing_to_ambient;
    const double growth = t.resistance_growth;
    Mat3 A;
    A << (loss_W * growth - G1) / C1, G1 / C1,
        loss_W * (1.0 + growth * (t.ambient_C - t.resistance_at_C)) / C1,  //
        G1 / C2, -(G1 + G2) / C2, 0.0,                                     //
        0.0, 0.0, 0.0;
    A *= dt;
    int halvings = 0;
    for (double size = A.topLeftCorner<2, 2>().norm(); size > 0.5; size /= 2) ++halvings;
    A /= std::ldexp(1.0, halvings);
    Mat3 sum = Mat3::Identity();
    for (int k = kSeries; k > 0; --k) sum = Mat3::Identity() + A * sum / k;
    for (int k = 0; k < halvings; ++k) sum = (sum * sum).eval();
    return sum;
  }
  static constexpr int kSeries = 14;  // 0.5^15/15! is below a double's ε

  const MotorThermal& thermal_;
  const std::vector<double>& time_s_;
  std::vector<Mat3> reached_;  // from the start of a cycle, by sample
};

class Meter {
 public:
  // `force`: of the drive, the larger end of what is open.
  Meter(const Motor& motor, const VecX& force, const DriveAtRest& at_rest, MotorLoad* load)
      : motor_(motor), force_(force), at_rest_(at_rest), load_(*load) {}

  void Measure() {
    const double span_s = load_.time_s.back() - load_.time_s.front();
    if (span_s <= 0.0) return;
    Torques(span_s);
    Powers();
    Currents();
    Limits();
    Heat();
    Brake();
    Gearbox(span_s);
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

  void Powers() {
    const VecX power = load_.torque.cwiseProduct(load_.speed);
    const auto at = [&](size_t i) { return power[static_cast<Eigen::Index>(i)]; };
    load_.peak_power = std::max(0.0, power.maxCoeff());
    load_.peak_brake_power = std::min(0.0, power.minCoeff());
    load_.energy_J = Integral(load_.time_s, [&](size_t i) { return std::max(0.0, at(i)); });
    load_.brake_energy_J = Integral(load_.time_s, [&](size_t i) { return std::min(0.0, at(i)); });
    load_.electric_W = power + CopperLoss();
    load_.fed_back_J = Integral(load_.time_s, [&](size_t i) {
      return std::max(0.0, -load_.electric_W[static_cast<Eigen::Index>(i)]);
    });
  }

  // R i² at the stated resistance; 0 where it is not known.
  [[nodiscard]] VecX CopperLoss() const {
    const double k = motor_.torque_constant, R = motor_.resistance;
    const double factor = std::isnan(k) || std::isnan(R) ? 0.0 : R / (k * k);
    return factor * load_.torque.cwiseAbs2();
  }

  void Heat() {
    if (!motor_.thermal) return;
    const MotorThermal& thermal = *motor_.thermal;
    const WindingHeat heat(thermal, load_.time_s, CopperLoss());
    load_.winding_peak_C = load_.housing_peak_C = std::numeric_limits<double>::infinity();
    if (const auto start = heat.Steady()) {
      load_.winding_C.resize(load_.torque.size());
      load_.housing_peak_C = -load_.housing_peak_C;
      for (size_t i = 0; i < load_.time_s.size(); ++i) {
        load_.winding_C[static_cast<Eigen::Index>(i)] = heat.At(0, i, *start);
        load_.housing_peak_C = std::max(load_.housing_peak_C, heat.At(1, i, *start));
      }
      load_.winding_peak_C = load_.winding_C.maxCoeff();
    }
    const double allowed = thermal.max_winding_C - thermal.ambient_C;
    const double use = (load_.winding_peak_C - thermal.ambient_C) / allowed;
    load_.uses.push_back({"winding temperature", use, kNan});
    if (use > 1.0) load_.overheated_s = heat.TimeToLimit();
  }

  // What the brake holds comes through the gear: losses help. A stop brakes the drive's share of
  // the motion and the rotor with what the brake has left of holding.
  void Brake() {
    if (!motor_.brake) return;
    const double torque = motor_.brake->torque, n = motor_.gear_ratio, eta = motor_.efficiency;
    const Eigen::Index samples = std::min(at_rest_.force.size(), load_.torque.size());
    if (samples == 0) return;
    MotorLoad::Use hold{.of = "holding brake", .use = 0.0}, stop{.of = "brake energy", .use = 0.0};
    load_.holding_torque = load_.stop_energy_J = 0.0;
    for (Eigen::Index i = 0; i < samples; ++i) {
      const double holds = std::abs(at_rest_.force[i]) * eta / n, time_s = load_.time_s[i];
      if (holds > load_.holding_torque) load_.holding_torque = holds, hold.time_s = time_s;
      const double moving = 0.5 * motor_.rotor_inertia * load_.speed[i] * load_.speed[i] +
                            eta * std::max(0.0, at_rest_.energy_J[i]);
      const double energy = moving == 0.0    ? 0.0
                            : holds < torque ? moving * torque / (torque - holds)
                                             : std::numeric_limits<double>::infinity();
      if (energy > load_.stop_energy_J) load_.stop_energy_J = energy, stop.time_s = time_s;
    }
    hold.use = load_.holding_torque / torque;
    load_.uses.push_back(hold);
    if (std::isinf(motor_.brake->energy)) return;
    stop.use = load_.stop_energy_J / motor_.brake->energy;
    load_.uses.push_back(stop);
  }

  // Mean torque of the power p over revolutions, (∫|v||T|^p dt / ∫|v| dt)^(1/p) [HarmonicDrive,
  // "Average torque"; Nabtesco with p = 10/3, "Average load torque"]; means of speeds are over
  // time.
  void Gearbox(double span_s) {
    if (!motor_.gearbox) return;
    const MotorGearbox& gearbox = *motor_.gearbox;
    Eigen::Index peak = 0;
    load_.gear_torque = force_.cwiseAbs().maxCoeff(&peak) / motor_.spindle;
    const auto weighted = [&](size_t i) {
      const double share = std::abs(force_[static_cast<Eigen::Index>(i)] / force_[peak]);
      return std::abs(Speed(i)) * std::pow(share, gearbox.exponent);
    };
    load_.gear_mean_torque = 0.0;
    if (load_.gear_torque > 0.0 && load_.mean_speed > 0.0) {
      load_.gear_mean_torque =
          load_.gear_torque *
          std::pow(Mean(span_s, weighted) / load_.mean_speed, 1.0 / gearbox.exponent);
    }
    load_.gear_emergency_torque = load_.gear_torque;
    if (motor_.brake) {
      const double stops =
          motor_.brake->torque * motor_.gear_ratio / motor_.spindle / motor_.efficiency;
      load_.gear_emergency_torque = std::max(load_.gear_torque, stops);
    }
    Add("gearbox peak", load_.gear_torque, gearbox.peak_torque);
    Add("gearbox mean torque", load_.gear_mean_torque, gearbox.mean_torque);
    Add("gearbox emergency", load_.gear_emergency_torque, gearbox.emergency_torque);
    Add("gearbox speed", load_.peak_speed, gearbox.max_speed);
    Add("gearbox mean speed", load_.mean_speed, gearbox.mean_speed);
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
  const VecX& force_;
  const DriveAtRest& at_rest_;
  MotorLoad& load_;
};

}  // namespace

const MotorLoad::Use* LargestUse(std::span<const MotorLoad::Use> uses) {
  const auto largest = std::max_element(
      uses.begin(), uses.end(),
      [](const MotorLoad::Use& a, const MotorLoad::Use& b) { return a.use < b.use; });
  return largest == uses.end() ? nullptr : &*largest;
}

double MotorLoad::largest_use() const {
  const Use* use = LargestUse(uses);
  return use == nullptr ? kNan : use->use;
}

double MotorLoad::largest_use_time_s() const {
  const Use* use = LargestUse(uses);
  return use == nullptr ? kNan : use->time_s;
}

const char* MotorLoad::limited_by() const {
  const Use* use = LargestUse(uses);
  return use == nullptr ? "" : use->of;
}

MotorLoad MotorLoadOf(const std::string& drive, const Motor& motor, const Trace& trace,
                      const DriveFacts& facts) {
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
  VecX larger(load.speed.size());
  const ForceSignal signal(trace, force);
  for (Eigen::Index i = 0; i < load.torque.size(); ++i) {
    const ForceBand at = signal.At(i);
    load.torque[i] = WorstTorque(motor, at, trace.values(i, v), trace.values(i, a));
    larger[i] = std::max(std::abs(at.lower()), std::abs(at.upper()));
    load.samples_at_rest += at.open() ? 1 : 0;
  }
  if (motor.rotor_inertia > 0.0) {
    load.inertia_ratio =
        facts.load_inertia / (motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia);
  }
  Meter(motor, larger, facts.at_rest, &load).Measure();
  return load;
}

std::vector<MotorLoad> MotorLoadsOf(const Mechanism& mechanism, const Trace& trace,
                                    std::span<const DriveFacts> facts) {
  std::vector<MotorLoad> loads;
  for (size_t k = 0; k < mechanism.motors.size(); ++k) {
    const Motor& motor = mechanism.motors[k];
    MotorLoad load = MotorLoadOf(mechanism.drives[static_cast<size_t>(motor.drive)].name, motor,
                                 trace, facts.empty() ? DriveFacts() : facts[k]);
    if (load.known()) loads.push_back(std::move(load));
  }
  return loads;
}

std::optional<LinkLoad> LinkLoadOf(const DcLink& link, std::span<const MotorLoad> loads) {
  if (loads.empty()) return {};
  const std::vector<double>& time_s = loads.front().time_s;
  const double span_s = time_s.back() - time_s.front();
  VecX power = VecX::Zero(static_cast<Eigen::Index>(time_s.size()));
  for (const MotorLoad& motor : loads) {
    if (motor.electric_W.size() != power.size()) return {};
    power += motor.electric_W.unaryExpr(
        [&](double P) { return P > 0.0 ? P / link.efficiency : P * link.efficiency; });
  }
  const auto drawn = [&](size_t i) { return std::max(0.0, power[static_cast<Eigen::Index>(i)]); };
  const auto back = [&](size_t i) { return std::max(0.0, -power[static_cast<Eigen::Index>(i)]); };
  LinkLoad load{.witness = loads.front().witness, .unresolved = loads.front().unresolved};
  load.peak_power = std::max(0.0, power.maxCoeff());
  load.drawn_J = Integral(time_s, drawn);
  load.fed_back_J = Integral(time_s, back);
  // The capacitor between its voltages. From empty, or from full where more comes back than is
  // drawn, the second cycle is the one that repeats: the first has reached that end.
  const double room =
      link.capacitance > 0.0
          ? 0.5 * link.capacitance *
                (link.brake_voltage * link.brake_voltage - link.voltage * link.voltage)
          : 0.0;
  double stored = load.fed_back_J > load.drawn_J ? room : 0.0;
  for (int cycle = 0; cycle < 2; ++cycle) {
    load.resistor_J = load.resistor_peak = 0.0;
    for (size_t i = 1; i < time_s.size(); ++i) {
      const double half_s = 0.5 * (time_s[i] - time_s[i - 1]);
      stored = std::max(0.0, stored - half_s * (drawn(i - 1) + drawn(i)));
      stored += half_s * (back(i - 1) + back(i));
      if (stored <= room) continue;
      load.resistor_J += stored - room;
      load.resistor_peak = std::max({load.resistor_peak, back(i - 1), back(i)});
      stored = room;
    }
  }
  load.power = std::move(power);
  load.capacitor_J = load.fed_back_J - load.resistor_J;
  load.resistor_mean = load.resistor_J / span_s;
  const auto add = [&](const char* of, double used, double limit) {
    if (std::isfinite(limit)) load.uses.push_back({of, Share(used, limit), kNan});
  };
  add("brake resistor, mean", load.resistor_mean, link.mean_power);
  add("brake resistor, peak", load.resistor_peak, link.peak_power);
  add("brake resistor, resistance", load.resistor_peak,
      link.brake_voltage * link.brake_voltage / link.resistance);
  return load;
}

}  // namespace mbv
