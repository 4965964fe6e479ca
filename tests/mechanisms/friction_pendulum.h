// A pendulum with every kind of force element, and its equation of motion.
#pragma once

#include <cmath>

#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {

/// About z on the world, gravity along −y, q from x:
///   τ = (J + J_r n²) q̈ + m g r cos q + c q̇ + F0 + k1 x + k2 x² + k3 x³
///       + (Fc + (Fs − Fc) exp(−(q̇/vs)²)) sign q̇,  x = q − q0
/// `linear`: only what MuJoCo itself has.
struct PendulumWithFriction {
  static constexpr double m = 1.3, r = 0.21, I = 0.012, g = 9.81;
  double damping = 0.07;
  double free = 0.4, preload = 0.9, k1 = 2.5, k2 = -0.3, k3 = 0.11;
  double rotor = 3e-5, ratio = -35.0;
  double coulomb = 0.25, breakaway = 0.6, stribeck = 1.5;
  bool linear = false;

  [[nodiscard]] Mechanism Make() const {
    Mechanism mechanism;
    mechanism.name = "friction_pendulum";
    mechanism.gravity_W = Vec3(0, -g, 0);
    mechanism.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
                        MakeBody("bob", m, Vec3(r, 0, 0), Vec3(0.01, 0.01, I))};
    mechanism.joints = {MakeJoint("pivot", JointKind::kRevolute, 0, Vec3::Zero(), 1, Vec3::Zero())};
    mechanism.drives = {{.name = "motor", .kind = JointDrive{0, 0}, .range = {}}};
    AddElements(&mechanism);
    AddTree(&mechanism);
    mechanism.X_WB_home = TreePoses(mechanism, {mechanism.joints[0].guess});
    return mechanism;
  }

  /// The pivot is a prescribed joint instead of a drive.
  [[nodiscard]] Mechanism Prescribed() const {
    Mechanism mechanism = Make();
    mechanism.drives.clear();
    mechanism.prescribed = {{.name = "base", .joint = 0}};
    return mechanism;
  }

  [[nodiscard]] double Torque(double q, double rate, double acceleration) const {
    const double x = q - free, v = rate / stribeck;
    const double spring = preload + k1 * x + (linear ? 0.0 : k2 * x * x + k3 * x * x * x);
    const double dry = coulomb + (breakaway - coulomb) * std::exp(-v * v);
    return (I + m * r * r + rotor * ratio * ratio) * acceleration + m * g * r * std::cos(q) +
           damping * rate + spring + (linear ? 0.0 : std::copysign(dry, rate));
  }

 private:
  void AddElements(Mechanism* mechanism) const {
    const auto add = [&](const char* name, const auto& law) {
      mechanism->elements.push_back({.name = name, .joint = 0, .law = law});
    };
    add("oil", DampingLaw{damping});
    SpringLaw spring{.polynomial = {k1}, .free = free, .preload = preload};
    if (!linear) spring.polynomial = {k1, k2, k3};
    add("spring", spring);
    add("rotor", RotorLaw{.inertia = rotor, .ratio = ratio});
    if (!linear) {
      add("dry",
          FrictionLaw{.coulomb = coulomb, .breakaway = breakaway, .stribeck_rate = stribeck});
    }
  }
};

/// The pendulum's body on a journal with friction whose axis is not level: weight along it is not a
/// load.
struct JournalPendulum {
  static constexpr double m = PendulumWithFriction::m, r = PendulumWithFriction::r,
                          g = PendulumWithFriction::g;
  double coefficient = 0.15, radius = 0.04;

  [[nodiscard]] Mechanism Make() const {
    Mechanism mechanism = PendulumWithFriction().Make();
    mechanism.gravity_W = Vec3(0, -g, -5.0);
    mechanism.elements = {{.name = "journal",
                           .joint = 0,
                           .law = FrictionLaw{.coefficient = coefficient, .radius = radius}}};
    return mechanism;
  }
  /// Held by a second hinge on the same axis, which shares the load.
  [[nodiscard]] Mechanism OnTwoHinges() const {
    Mechanism mechanism = Make();
    const Vec3 above(0, 0, 0.1);
    mechanism.joints.push_back(MakeJoint("second", JointKind::kRevolute, 0, above, 1, above));
    mechanism.joints.back().closure = true;
    return mechanism;
  }
  /// What no drive gives: 0 where friction is that of the load by these accelerations.
  [[nodiscard]] double FreeTorque(double q, double rate, double acceleration) const {
    const double s = std::sin(q), c = std::cos(q);
    const double x = r * (-rate * rate * c - acceleration * s);
    const double y = g + r * (-rate * rate * s + acceleration * c);
    return (PendulumWithFriction::I + m * r * r) * acceleration + m * g * r * c +
           std::copysign(coefficient * radius * m * std::hypot(x, y), rate);
  }
  /// At an even rate: weight, and friction by weight and centrifugal force.
  [[nodiscard]] double Torque(double q, double rate) const {
    const double x = -rate * rate * r * std::cos(q), y = g - rate * rate * r * std::sin(q);
    return m * g * r * std::cos(q) +
           std::copysign(coefficient * radius * m * std::hypot(x, y), rate);
  }
};

}  // namespace mbv::fixtures
