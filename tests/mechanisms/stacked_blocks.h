// Blocks that slide on each other, for closed forms of stick and slip.
#pragma once

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {

/// Blocks of these masses in a row, each sliding along x on the one before (the first on the
/// ground), with these laws of friction between them; the first on a spring whose force vanishes at
/// x = 0.
struct StackedBlocks {
  std::vector<double> masses;
  std::vector<FrictionLaw> laws;
  double stiffness = 0.0;

  [[nodiscard]] Mechanism Make() const {
    Mechanism m;
    m.name = "stack";
    m.gravity_W.setZero();
    m.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero())};
    for (size_t i = 0; i < masses.size(); ++i) {
      const std::string number = std::to_string(i + 1);
      m.bodies.push_back(MakeBody("block" + number, masses[i], Vec3::Zero(), Vec3::Constant(0.01)));
      m.joints.push_back(MakeJoint("slide" + number, JointKind::kPrismatic, static_cast<int>(i),
                                   Vec3::Zero(), static_cast<int>(i) + 1, Vec3::Zero()));
      m.joints.back().axis = Vec3::UnitX();
      Drive motor;
      motor.name = "motor" + number;
      motor.kind = JointDrive{static_cast<int>(i), 0};
      m.drives.push_back(motor);
      ForceElement dry;
      dry.name = "dry" + number;
      dry.joint = static_cast<int>(i);
      dry.law = laws[i];
      m.elements.push_back(dry);
    }
    if (stiffness > 0.0) {
      ForceElement spring;
      spring.name = "spring";
      spring.joint = 0;
      spring.law = SpringLaw{.polynomial = {stiffness}};
      m.elements.push_back(spring);
    }
    AddTree(&m);
    m.X_WB_home.assign(m.bodies.size(), Pose::Identity());
    return m;
  }

  /// From x and v of the first block; the others rest on it.
  [[nodiscard]] static Motion From(const Mechanism& m, double x, double v, double duration_s) {
    Motion motion;
    motion.duration_s = duration_s;
    motion.sample_s = 0.01;
    for (size_t d = 0; d < m.drives.size(); ++d) {
      const int drive = static_cast<int>(d);
      motion.forces.push_back({drive, {}});
      motion.initial.push_back({.name = m.drives[d].name,
                                .coordinate = {Coordinate::Kind::kDrive, drive, 0},
                                .position = d == 0 ? x : 0.0,
                                .rate = d == 0 ? v : 0.0});
    }
    return motion;
  }
};

/// A block thrown up from a rigid stop at 0 by a force that pulls it back: its n-th flight begins
/// with v0 ε^n and lasts 2 v0 ε^n/g, and at rest_s() it rests there.
struct BouncingBlock {
  static constexpr double mass = 2.0, g = 10.0, v0 = 1.5;
  double restitution = 0.6;

  [[nodiscard]] Mechanism Make() const {
    Mechanism m = StackedBlocks{{mass}, {{}}}.Make();
    m.elements[0].law = StopLaw{.lower = 0.0, .restitution = restitution};
    return m;
  }
  [[nodiscard]] static Motion Thrown(const Mechanism& m, double duration_s) {
    Motion motion = StackedBlocks::From(m, 0.0, v0, duration_s);
    motion.forces[0].force = Constant(-mass * g);
    return motion;
  }
  [[nodiscard]] double rest_s() const { return 2.0 * v0 / g / (1.0 - restitution); }
  [[nodiscard]] double Position(double t) const {
    if (t >= rest_s()) return 0.0;
    double v = v0;
    while (t >= 2.0 * v / g) t -= 2.0 * v / g, v *= restitution;
    return v * t - 0.5 * g * t * t;
  }
};

/// A block on a freewheel that holds it against smaller positions, pushed by A sin ωt − B: it
/// starts where that pushes forward, at t_0, comes to rest at t_1, and starts again a period later.
struct RatchetedBlock {
  static constexpr double mass = 2.0, A = 5.0, w = 3.0, capacity = 20.0;
  double B = 2.0;

  [[nodiscard]] Mechanism Make() const {
    return StackedBlocks{{mass}, {{.coulomb = capacity, .breakaway = capacity, .resists = -1}}}
        .Make();
  }
  [[nodiscard]] Motion Pushed(const Mechanism& m, double duration_s) const {
    Motion motion = StackedBlocks::From(m, 0.0, 0.0, duration_s);
    motion.forces[0].force = {{SineTerm{A, w / (2.0 * std::numbers::pi), 0.0}, ConstantTerm{-B}}};
    return motion;
  }
  [[nodiscard]] double start() const { return std::asin(B / A) / w; }
  [[nodiscard]] double period() const { return 2.0 * std::numbers::pi / w; }
  [[nodiscard]] double Velocity(double since) const {
    const double t0 = start(), t = t0 + since;
    return (A / w * (std::cos(w * t0) - std::cos(w * t)) - B * since) / mass;
  }
  [[nodiscard]] double Way(double since) const {
    const double t0 = start(), t = t0 + since;
    return (A / w * (std::cos(w * t0) * since - (std::sin(w * t) - std::sin(w * t0)) / w) -
            0.5 * B * since * since) /
           mass;
  }
  /// After t_0.
  [[nodiscard]] double moves() const {
    double low = 0.5 * period(), high = period();
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (Velocity(middle) > 0.0 ? low : high) = middle;
    }
    return low;
  }
  /// Of the k-th event: it starts, rests, starts, …
  [[nodiscard]] double EventTime(size_t k) const {
    const size_t turns = k / 2;
    return start() + period() * static_cast<double>(turns) + (k % 2 == 0 ? 0.0 : moves());
  }
  [[nodiscard]] double Position(double t) const {
    if (t < start()) return 0.0;
    const double turns = std::floor((t - start()) / period()), whole = Way(moves());
    return turns * whole + Way(std::min(t - start() - turns * period(), moves()));
  }
};

/// A block that brakes harder beyond a place than before it: it flies on, turns round and comes
/// back. The force jumps at that place, by an expression of two branches.
struct JumpingForce {
  static constexpr double mass = 2.0, place = 0.2, v0 = 1.5, before = 2.0;
  double beyond = 20.0;

  [[nodiscard]] ExpressionLaw Law() const {
    const auto on_branch = [far = beyond](int branch, double, double) {
      return branch == 0 ? -before : -far;
    };
    const auto branch = [](double x, double) { return x < place ? 0 : 1; };
    return {.text = "x < 0.2 ? -2 : -20",
            .force = [=](double x, double v) { return on_branch(branch(x, v), x, v); },
            .branch = branch,
            .on_branch = on_branch};
  }
  [[nodiscard]] static double passes() {  ///< [s]
    const double a = before / mass;
    return (v0 - std::sqrt(v0 * v0 - 2.0 * a * place)) / a;
  }
  /// A block alone returns where it passed with the opposite rate.
  [[nodiscard]] double returns() const {
    return passes() + 2.0 * (v0 - before / mass * passes()) / (beyond / mass);
  }
  [[nodiscard]] double Position(double t) const {
    const double a = before / mass, v = v0 - a * passes();
    if (t < passes()) return v0 * t - 0.5 * a * t * t;
    if (t < returns()) {
      const double since = t - passes();
      return place + v * since - 0.5 * beyond / mass * since * since;
    }
    const double since = t - returns();
    return place - v * since - 0.5 * a * since * since;
  }
};

inline FrictionLaw CoulombFriction(double force) { return {.coulomb = force, .breakaway = force}; }
/// `breakaway` at rest, `coulomb` as soon as it slides.
inline FrictionLaw JumpingFriction(double coulomb, double breakaway) {
  return {.coulomb = coulomb, .breakaway = breakaway, .stribeck_rate = 0.0};
}

}  // namespace mbv::fixtures
