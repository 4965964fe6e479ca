#include "comparison/force_scale.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kinematics/constraints.h"
#include "kinematics/tree_motion.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

// Of the centripetal acceleration: it mostly turns a force instead of making it larger.
constexpr double kTurning = 1e-2;
// Parts below this share of the largest are round-off.
constexpr double kRoundoff = 1e-9;
// Forces through an axis are felt about it as with this lever, in characteristic lengths.
constexpr double kLever = 1e-3;

// RMS rates of a driven coordinate, and its largest velocity.
struct Rates {
  double velocity = 0.0, acceleration = 0.0, fastest = 0.0;
};

Rates DriveRates(const Drive& drive, const Trace& trace) {
  Rates rates;
  const auto rms = [&](Quantity quantity, double* largest) {
    const int column = trace.Find(quantity, drive.name);
    if (column < 0 || trace.values.rows() == 0) return 0.0;
    const auto values = trace.values.col(column);
    const double value = std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
    if (!std::isfinite(value)) return 0.0;
    if (largest != nullptr) *largest = values.cwiseAbs().maxCoeff();
    return value;
  };
  rates.velocity = rms(Quantity::kVelocity, &rates.fastest);
  rates.acceleration = rms(Quantity::kAcceleration, nullptr);
  return rates;
}

// No witness records them: from the commands.
Rates PrescribedRates(const Motion& motion, int prescribed, const Trace& trace) {
  Rates rates;
  for (const Command& command : motion.commands) {
    for (const Command::Term& term : command.terms) {
      const Coordinate& c = term.coordinate;
      if (c.kind != Coordinate::Kind::kPrescribed || c.index != prescribed) continue;
      for (const double t_s : trace.time_s) {
        const Jet jet = Evaluate(command.profile, t_s);
        rates.velocity += jet.rate * jet.rate;
        rates.acceleration += jet.acceleration * jet.acceleration;
        rates.fastest = std::max(rates.fastest, std::abs(jet.rate));
      }
    }
  }
  const double n = std::max<double>(1.0, static_cast<double>(trace.time_s.size()));
  return {std::sqrt(rates.velocity / n), std::sqrt(rates.acceleration / n), rates.fastest};
}

// From the energy: F = √(2 k E), at most.
double LargestSpringForce(const Mechanism& mechanism, const Trace& trace) {
  const int column = trace.Find(Quantity::kSpringEnergy);
  if (column < 0 || trace.values.rows() == 0) return 0.0;
  double stiffness = 0.0;
  for (const SpringDamper& spring : mechanism.springs) {
    stiffness = std::max(stiffness, spring.stiffness);
  }
  const double energy = trace.values.col(column).maxCoeff();
  return energy > 0.0 ? std::sqrt(2.0 * stiffness * energy) : 0.0;
}

class Scales {
 public:
  Scales(const ComparisonInput& input, const Trace& trace, const DrivenTwists& twists)
      : mechanism_(*input.mechanism), motion_(*input.motion), twists_(twists) {
    scale_.length_m = CharacteristicLength(mechanism_);
    X_WB_ = mechanism_.X_WB_home;
    if (X_WB_.empty()) X_WB_.assign(mechanism_.bodies.size(), Pose::Identity());
    for (const Drive& drive : mechanism_.drives) rates_.push_back(DriveRates(drive, trace));
    for (size_t p = 0; p < mechanism_.prescribed.size(); ++p) {
      rates_.push_back(PrescribedRates(motion_, static_cast<int>(p), trace));
    }
    spring_N_ = LargestSpringForce(mechanism_, trace);
    TakeElements(trace);
    TakeLoads(trace);
    for (size_t b = 0; b < mechanism_.bodies.size(); ++b) bodies_.push_back(MotionOf(b));
  }

  ForceScale Find() {
    scale_.driven.assign(rates_.size(), 0.0);
    std::vector<size_t> heaviest(rates_.size(), 0);
    for (size_t k = 0; k < rates_.size(); ++k) heaviest[k] = FindDriven(k);
    FindCarries(heaviest);
    FindForce();
    if (!scale_.acts) TakeRound();
    TakeMassless();
    for (size_t b = 0; b < bodies_.size(); ++b) {
      scale_.acceleration.push_back(bodies_[b].acceleration);
      scale_.moment.push_back(MomentOf(b));
    }
    return std::move(scale_);
  }

 private:
  struct BodyMotion {
    double inertial = 0.0;      // acceleration of the centre of mass
    double acceleration = 0.0;  // the same or gravity
    double turning = 0.0;       // angular acceleration
    double speed = 0.0;         // largest
  };
  struct LargestLoad {
    double force_N = 0.0, moment_Nm = 0.0;
  };

  [[nodiscard]] Vec3 VelocityOf(size_t k, size_t b, const Vec3& p_B) const {
    const Vec6& V = twists_.V_WB[k][b];
    return V.tail<3>() + V.head<3>().cross(X_WB_[b].linear() * p_B);
  }
  [[nodiscard]] Vec3 Centre(size_t k, size_t b) const {
    return VelocityOf(k, b, mechanism_.bodies[b].p_BoBcm_B);
  }

  void TakeLoads(const Trace& trace) {
    loads_.resize(motion_.loads.size());
    BodyStates home;
    home.Resize(mechanism_.bodies.size());
    home.X_WB = mechanism_.X_WB_home;
    for (size_t l = 0; l < loads_.size(); ++l) {
      const Load& load = motion_.loads[l];
      for (const double t_s : trace.time_s) {
        LoadSample sample{.load = &load, .time_s = t_s};
        for (int c = 0; c < 3; ++c) {
          sample.force[c] = Evaluate(load.force[c], t_s).value;
          sample.moment[c] = Evaluate(load.moment[c], t_s).value;
        }
        // What follows the state counts as at home, at rest.
        sample = AtStates(mechanism_, home, sample);
        loads_[l].force_N = std::max(loads_[l].force_N, sample.force.norm());
        loads_[l].moment_Nm = std::max(loads_[l].moment_Nm, sample.moment.norm());
      }
    }
  }

  [[nodiscard]] BodyMotion MotionOf(size_t b) const {
    BodyMotion motion;
    for (size_t k = 0; k < rates_.size(); ++k) {
      const double v = Centre(k, b).norm(), w = twists_.V_WB[k][b].head<3>().norm();
      const Rates& rates = rates_[k];
      motion.inertial = std::max({motion.inertial, v * rates.acceleration,
                                  kTurning * w * v * rates.velocity * rates.velocity});
      motion.turning = std::max(motion.turning, w * rates.acceleration);
      motion.speed += v * rates.fastest;
    }
    motion.acceleration = std::max(motion.inertial, mechanism_.gravity_W.norm());
    return motion;
  }

  // A balanced body that turns evenly, or rests, needs none; rounding leaves some.
  [[nodiscard]] double MomentOf(size_t b) const {
    double turning = bodies_[b].turning;
    for (size_t k = 0; k < rates_.size(); ++k) {
      const double w = twists_.V_WB[k][b].head<3>().norm() * rates_[k].velocity;
      turning = std::max(turning, kTurning * w * w);
    }
    turning = std::max(turning, 1.0 / (motion_.duration_s * motion_.duration_s));
    return mechanism_.bodies[b].I_Bcm_B.norm() * turning;
  }

  // What a prescribed joint whose bodies are balanced about it feels all the same.
  [[nodiscard]] double CrossWork(size_t k) const {
    double largest = 0.0;
    for (size_t b = 1; b < bodies_.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      const double w = twists_.V_WB[k][b].head<3>().norm();
      largest =
          std::max({largest, w * kLever * scale_.length_m * body.mass * bodies_[b].acceleration,
                    w * MomentOf(b)});
    }
    return largest;
  }

  // Scale of one driven coordinate; returns the body that weighs most on it.
  size_t FindDriven(size_t k) {
    size_t heaviest = 0;
    double largest = 0.0;
    for (size_t b = 1; b < bodies_.size(); ++b) {
      const Body& body = mechanism_.bodies[b];
      const Vec3 v = Centre(k, b);
      const double w = twists_.V_WB[k][b].head<3>().norm();
      const double work = std::max(body.mass * v.norm() * bodies_[b].acceleration,
                                   w * body.I_Bcm_B.norm() * bodies_[b].turning);
      if (work > largest) heaviest = b;
      largest = std::max(largest, work);
      const double weight = std::abs(mechanism_.gravity_W.dot(v));
      const double all = mechanism_.gravity_W.norm() * v.norm();
      acts_ = acts_ || (IsCompared(k) && body.mass > 0.0 && weight > kRoundoff * all);
    }
    const double applied = std::max({LoadWork(k), SpringWork(k), ElementWork(k)});
    acts_ = acts_ || (IsCompared(k) && applied > 0.0);
    const double crossed = k >= mechanism_.drives.size() ? CrossWork(k) : 0.0;
    scale_.driven[k] = std::max({largest, applied, crossed});
    if (IsCompared(k)) {
      double& of_unit = scale_.of_unit[ForceUnit(mechanism_, mechanism_.drives[k])];
      of_unit = std::max(of_unit, scale_.driven[k]);
    }
    return heaviest;
  }

  [[nodiscard]] bool IsCompared(size_t k) const {
    return k < mechanism_.drives.size() && motion_.FindForce(static_cast<int>(k)) < 0;
  }

  [[nodiscard]] double LoadWork(size_t k) const {
    double largest = 0.0;
    for (size_t l = 0; l < loads_.size(); ++l) {
      const auto b = static_cast<size_t>(motion_.loads[l].body);
      largest =
          std::max(largest, loads_[l].force_N * VelocityOf(k, b, motion_.loads[l].p_BoQ_B).norm() +
                                loads_[l].moment_Nm * twists_.V_WB[k][b].head<3>().norm());
    }
    return largest;
  }

  // Rate of the springs' lengths.
  [[nodiscard]] double SpringWork(size_t k) const {
    double largest = 0.0;
    for (const SpringDamper& spring : mechanism_.springs) {
      const auto from = static_cast<size_t>(spring.body_from);
      const auto to = static_cast<size_t>(spring.body_to);
      const Vec3 d = X_WB_[to] * spring.p_to - X_WB_[from] * spring.p_from;
      const Vec3 rate = VelocityOf(k, to, spring.p_to) - VelocityOf(k, from, spring.p_from);
      largest = std::max(largest, spring_N_ * std::abs(d.normalized().dot(rate)));
    }
    return largest;
  }

  void TakeElements(const Trace& trace) {
    std::vector<internal::DrivenSize> driven;
    for (size_t k = 0; k < rates_.size(); ++k) {
      driven.push_back({&twists_.V_WB[k], rates_[k].velocity, rates_[k].acceleration});
    }
    const int energy = trace.Find(Quantity::kSpringEnergy);
    const double most =
        energy < 0 || trace.values.rows() == 0 ? 0.0 : trace.values.col(energy).maxCoeff();
    elements_ = internal::SizesOfElements(
        mechanism_, driven, {.duration_s = motion_.duration_s, .most_energy_J = most});
  }

  [[nodiscard]] double ElementWork(size_t k) const {
    double largest = 0.0;
    for (const internal::ElementSize& element : elements_) {
      largest = std::max(largest, element.force * element.rate[k]);
    }
    return largest;
  }

  void FindCarries(const std::vector<size_t>& heaviest) {
    const size_t drives = mechanism_.drives.size();
    scale_.carries.assign(drives, std::vector<bool>(drives, false));
    for (size_t c = 0; c < drives; ++c) {
      for (size_t d = 0; d < drives; ++d) {
        double largest = 0.0;
        for (size_t b = 1; b < bodies_.size(); ++b) largest = std::max(largest, Size(d, b));
        scale_.carries[c][d] = c == d || Size(d, heaviest[c]) > kRoundoff * largest;
      }
    }
  }
  [[nodiscard]] double Size(size_t k, size_t b) const {
    const Vec6& V = twists_.V_WB[k][b];
    return V.tail<3>().norm() + scale_.length_m * V.head<3>().norm();
  }

  // Where nothing acts, forces are round-off, as of masses that go their own length in the time.
  void TakeRound() {
    const double acceleration = scale_.length_m / (motion_.duration_s * motion_.duration_s);
    for (size_t b = 1; b < bodies_.size(); ++b) {
      bodies_[b].acceleration = std::max(bodies_[b].acceleration, acceleration);
      if (!twists_.moved[b] && !mechanism_.drives.empty()) continue;
      scale_.force_N = std::max(scale_.force_N, mechanism_.bodies[b].mass * acceleration);
    }
    for (size_t k = 0; k < rates_.size(); ++k) {
      for (size_t b = 1; b < bodies_.size(); ++b) {
        const Body& body = mechanism_.bodies[b];
        const double turning = twists_.V_WB[k][b].head<3>().norm() / scale_.length_m;
        scale_.driven[k] =
            std::max({scale_.driven[k], body.mass * acceleration * Centre(k, b).norm(),
                      body.I_Bcm_B.norm() * acceleration * turning});
      }
      if (!IsCompared(k)) continue;
      double& of_unit = scale_.of_unit[ForceUnit(mechanism_, mechanism_.drives[k])];
      of_unit = std::max(of_unit, scale_.driven[k]);
    }
  }

  // What moves no mass needs no force. A simulation gives it 1e-11 of the mass of all, which is no
  // part of the mechanism: what that takes is no error, on the scale of all.
  void TakeMassless() {
    for (size_t k = 0; k < mechanism_.drives.size(); ++k) {
      bool moves_mass = scale_.driven[k] > 0.0, moves = false;
      for (size_t b = 1; b < bodies_.size(); ++b) {
        const bool moved = Size(k, b) > kRoundoff;
        moves = moves || moved;
        moves_mass = moves_mass || (moved && !IsMassless(mechanism_.bodies[b]));
      }
      if (!moves || moves_mass) continue;
      const bool is_force = ForceUnit(mechanism_, mechanism_.drives[k]) == "N";
      scale_.driven[k] = scale_.force_N * (is_force ? 1.0 : scale_.length_m);
    }
  }

  void FindForce() {
    const double still = kRoundoff / (motion_.duration_s * motion_.duration_s);
    double fastest = 0.0;
    for (size_t b = 1; b < bodies_.size(); ++b) {
      if (!twists_.moved[b] && !mechanism_.drives.empty()) continue;
      const Body& body = mechanism_.bodies[b];
      scale_.force_N = std::max(scale_.force_N, body.mass * bodies_[b].acceleration);
      scale_.moment_Nm = std::max(scale_.moment_Nm, MomentOf(b));
      if (!twists_.moved[b]) continue;
      acts_ = acts_ || (body.mass > 0.0 && bodies_[b].inertial > still * scale_.length_m) ||
              (!body.I_Bcm_B.isZero(0.0) && bodies_[b].turning > still);
      fastest = std::max(fastest, bodies_[b].speed);
    }
    for (size_t l = 0; l < loads_.size(); ++l) {
      if (!twists_.moved[static_cast<size_t>(motion_.loads[l].body)]) continue;
      scale_.force_N =
          std::max({scale_.force_N, loads_[l].force_N, loads_[l].moment_Nm / scale_.length_m});
    }
    scale_.force_N = std::max(scale_.force_N, spring_N_);
    const bool alike = mechanism_.prescribed.empty() || mechanism_.drives.empty();
    scale_.power_W = alike ? std::numeric_limits<double>::infinity() : scale_.force_N * fastest;
    scale_.acts = acts_;
  }

  const Mechanism& mechanism_;
  const Motion& motion_;
  const DrivenTwists& twists_;
  std::vector<Pose> X_WB_;
  std::vector<Rates> rates_;        // drives, then prescribed joints
  std::vector<LargestLoad> loads_;  // as motion_.loads
  std::vector<BodyMotion> bodies_;
  double spring_N_ = 0.0;
  std::vector<internal::ElementSize> elements_;  // as mechanism_.elements
  bool acts_ = false;
  ForceScale scale_;
};

}  // namespace

double ForceScale::Floor(const std::string& unit) const {
  const auto found = of_unit.find(unit);
  if (found == of_unit.end()) return 0.0;
  // Where nothing acts along any of them, round-off of the forces across them is left.
  const double across = unit == "N" ? force_N : moment_Nm;
  return kIdle * (found->second > kEps * across ? found->second : across);
}

DrivenTwists TwistsFor(const ComparisonInput& input) {
  std::vector<bool> held;
  for (size_t d = 0; d < input.mechanism->drives.size(); ++d) {
    held.push_back(input.motion->FindForce(static_cast<int>(d)) < 0);
  }
  return TwistsOfDriven(*input.mechanism, held);
}

ForceScale ForceScaleOf(const ComparisonInput& input, const Trace& trace) {
  if (input.twists != nullptr) return Scales(input, trace, *input.twists).Find();
  const DrivenTwists twists = TwistsFor(input);
  return Scales(input, trace, twists).Find();
}

RestFloor RestFloorOf(const ComparisonInput& input, const std::string& position_unit) {
  constexpr double kOfGravity = 1e-4;
  const double length_m = CharacteristicLength(*input.mechanism);
  const double T = input.motion->duration_s;
  const double size = position_unit == "rad" ? 1.0 : length_m;
  return {ForceScale::kIdle * size / T,
          std::max(ForceScale::kIdle * size / (T * T),
                   kOfGravity * input.mechanism->gravity_W.norm() * size / length_m)};
}

namespace {

// RMS rates of the bodies as one mass M that has their kinetic energy E: v² = 2 E/M; its
// acceleration from v²/L, and from the power Ė = M v a.
RestFloor BodyRates(const Mechanism& mechanism, const Trace& trace) {
  const int column = trace.Find(Quantity::kKineticEnergy);
  const Eigen::Index rows = trace.values.rows();
  double mass = 0.0;
  for (const Body& body : mechanism.bodies) mass += body.mass;
  if (column < 0 || rows < 2 || !(mass > 0.0)) return {};
  const VecX energy = trace.values.col(column);
  const double v = std::sqrt(2.0 * std::max(0.0, energy.mean()) / mass);
  if (!energy.allFinite() || !(v > 0.0)) return {};
  const Eigen::Map<const VecX> time(trace.time_s.data(), rows);
  const VecX power = (energy.tail(rows - 1) - energy.head(rows - 1))
                         .cwiseQuotient(time.tail(rows - 1) - time.head(rows - 1));
  return {v, std::max(v * v / CharacteristicLength(mechanism), Rms(power) / (mass * v))};
}

}  // namespace

RestFloor RestFloorOf(const ComparisonInput& input, const std::string& position_unit,
                      const Trace& trace) {
  const double length_m = CharacteristicLength(*input.mechanism);
  RestFloor floor = RestFloorOf(input, position_unit);
  for (const Drive& drive : input.mechanism->drives) {
    const std::string unit = PositionUnit(*input.mechanism, drive);
    const double size = unit == position_unit ? 1.0 : unit == "rad" ? length_m : 1.0 / length_m;
    const Rates rates = DriveRates(drive, trace);
    floor.velocity = std::max(floor.velocity, ForceScale::kIdle * size * rates.velocity);
    floor.acceleration =
        std::max(floor.acceleration, ForceScale::kIdle * size * rates.acceleration);
  }
  const double size = position_unit == "rad" ? 1.0 / length_m : 1.0;
  const RestFloor bodies = BodyRates(*input.mechanism, trace);
  floor.velocity = std::max(floor.velocity, ForceScale::kIdle * size * bodies.velocity);
  floor.acceleration = std::max(floor.acceleration, ForceScale::kIdle * size * bodies.acceleration);
  return floor;
}

}  // namespace mbv

namespace mbv::internal {
namespace {

// Along the element's coordinate.
struct Rates {
  double velocity = 0.0, acceleration = 0.0, home = 0.0;
};

double SizeOf(const DampingLaw& law, const Rates& rates, const MotionSize& /*motion*/) {
  return law.damping * rates.velocity;
}
double SizeOf(const SpringLaw& law, const Rates& rates, const MotionSize& motion) {
  double at_home = law.preload, power = 1.0;
  for (const double k : law.polynomial) at_home += k * (power *= rates.home - law.free);
  const double k = std::abs(law.polynomial[0]);
  const double by_energy = std::sqrt(2.0 * k * std::max(0.0, motion.most_energy_J));
  return std::max(std::abs(at_home), std::min(by_energy, k * rates.velocity * motion.duration_s));
}
// By the energy that springs have and by how far beyond its ends the motion may come.
double SizeOf(const StopLaw& law, const Rates& rates, const MotionSize& motion) {
  if (law.rigid()) return 0.0;
  const double way = rates.velocity * motion.duration_s;
  const double deepest =
      std::max({0.0, rates.home + way - law.upper, law.lower - (rates.home - way)});
  const double stored = std::max(0.0, motion.most_energy_J) * (law.exponent + 1.0) / law.stiffness;
  const double depth = std::min(deepest, std::pow(stored, 1.0 / (law.exponent + 1.0)));
  return law.stiffness * std::pow(depth, law.exponent);
}
// The largest force at knots that the motion may come to, and at the next ones.
double SizeOf(const CurveLaw& law, const Rates& rates, const MotionSize& motion) {
  const double middle = law.of_rate ? 0.0 : rates.home;
  const double way = law.of_rate ? rates.velocity : rates.velocity * motion.duration_s;
  const auto& knots = law.knots;
  const auto first = std::ranges::lower_bound(knots, middle - way, {}, &CurveLaw::Knot::at);
  const auto last = std::ranges::upper_bound(knots, middle + way, {}, &CurveLaw::Knot::at);
  double largest = 0.0;
  for (auto knot = first == knots.begin() ? first : first - 1; knot != knots.end() && knot <= last;
       ++knot) {
    largest = std::max(largest, std::abs(knot->force));
  }
  return largest;
}
double SizeOf(const CurvesLaw& law, const Rates& rates, const MotionSize& motion) {
  double largest = 0.0;
  for (const CurveLaw& curve : law.curves) {
    largest = std::max(largest, SizeOf(curve, rates, motion));
  }
  return largest;
}
// At home, at the ends of the way and halfway, standing and both ways at full speed.
double SizeOf(const ExpressionLaw& law, const Rates& rates, const MotionSize& motion) {
  const double way = rates.velocity * motion.duration_s;
  double largest = 0.0;
  for (const double share : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    for (const double v : {-rates.velocity, 0.0, rates.velocity}) {
      const double force = std::abs(law.force(rates.home + share * way, v));
      if (std::isfinite(force)) largest = std::max(largest, force);
    }
  }
  return largest;
}
double SizeOf(const RotorLaw& law, const Rates& rates, const MotionSize& /*motion*/) {
  return law.reflected() * rates.acceleration;
}
double SizeOf(const FrictionLaw& law, const Rates& /*rates*/, const MotionSize& /*motion*/) {
  return law.coulomb;
}

}  // namespace

std::vector<ElementSize> SizesOfElements(const Mechanism& mechanism,
                                         const std::vector<DrivenSize>& driven,
                                         const MotionSize& motion) {
  std::vector<ElementSize> sizes;
  if (mechanism.elements.empty() || mechanism.X_WB_home.empty()) return sizes;
  BodyStates home;
  home.Resize(mechanism.bodies.size());
  home.X_WB = mechanism.X_WB_home;
  const std::vector<ScalarRow> rows = ElementRows(mechanism, home);
  for (size_t e = 0; e < rows.size(); ++e) {
    const ScalarRow& row = rows[e];
    ElementSize size;
    Rates rates{.home = row.value};
    for (const DrivenSize& one : driven) {
      const double rate = std::abs(RateOf(row, *one.V_WB));
      size.rate.push_back(rate);
      rates.velocity = std::max(rates.velocity, rate * one.velocity);
      rates.acceleration = std::max(rates.acceleration, rate * one.acceleration);
    }
    size.force = std::visit([&](const auto& law) { return SizeOf(law, rates, motion); },
                            mechanism.elements[e].law);
    sizes.push_back(size);
  }
  return sizes;
}

}  // namespace mbv::internal
