// A block on a horizontal guide, pushed by a leg from below: friction that grows with the push.
#pragma once

#include <cmath>

#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {

/// A block of mass m on a rail along x under gravity along −z, pushed by a distance drive from a
/// point a distance h below the rail, which it reaches at an angle θ, cos θ = x/L:
///   F cos θ − μ |m g − F sin θ| sign ẋ = m ẍ
struct PushedBlock {
  static constexpr double m = 2.0, g = 9.81, h = 0.3;
  double coefficient = 0.25;

  [[nodiscard]] Mechanism Make() const {
    Mechanism mechanism;
    mechanism.name = "pushed_block";
    mechanism.gravity_W = Vec3(0, 0, -g);
    mechanism.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
                        MakeBody("block", m, Vec3::Zero(), Vec3::Constant(0.01))};
    mechanism.joints = {MakeJoint("rail", JointKind::kPrismatic, 0, Vec3::Zero(), 1, Vec3::Zero())};
    mechanism.joints[0].axis = Vec3::UnitX();
    mechanism.joints[0].guess[0] = mechanism.joints[0].home[0] = 0.4;
    mechanism.drives = {
        {.name = "leg", .kind = DistanceDrive{0, {0, 0, -h}, 1, {0, 0, 0}}, .range = {}}};
    mechanism.elements = {
        {.name = "guide", .joint = 0, .law = FrictionLaw{.coefficient = coefficient}}};
    AddTree(&mechanism);
    mechanism.X_WB_home = TreePoses(mechanism, {mechanism.joints[0].guess});
    return mechanism;
  }

  /// Of the leg, by its length and its derivatives; the block presses on the guide.
  [[nodiscard]] double Force(double L, double rate, double acceleration) const {
    const double x = std::sqrt(L * L - h * h), v = L * rate / x;
    const double a = (rate * rate + L * acceleration - v * v) / x;
    const double mu = v == 0.0 ? 0.0 : std::copysign(coefficient, v);
    return m * (a + mu * g) / (x / L + mu * h / L);
  }
};

}  // namespace mbv::fixtures
