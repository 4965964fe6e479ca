// Two wheels of which the second follows the first by a polynomial, with its equation of motion.
#pragma once

#include <cmath>

#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {

/// Wheels about z on the world, gravity along −y. The second one's centre of mass lies off its
/// axis:
///   q2 = P(q1) = offset + ratio q1 + curve q1²,   L = ½ J1 q̇1² + ½ J2 q̇2² − m g r sin q2
///   τ = J1 q̈1 + P′ (J2 (P′ q̈1 + P″ q̇1²) + m g r cos q2)
/// With losses on the first wheel the coupling's part of τ is 1 + μ of itself where τ drives it,
/// and 1 − μ_b where it drives τ's wheel.
struct CoupledWheels {
  static constexpr double J1 = 0.02, I2 = 0.005, m = 1.3, r = 0.11, g = 9.81;
  static constexpr double J2 = I2 + m * r * r;
  double offset = 0.3, ratio = -0.4, curve = 0.015;
  double loss = 0.0, loss_back = 0.0;  ///< μ, μ_b

  [[nodiscard]] Mechanism Make() const {
    Mechanism mechanism;
    mechanism.name = "coupled_wheels";
    mechanism.gravity_W = Vec3(0, -g, 0);
    mechanism.bodies = {MakeBody("world", 0.0, Vec3::Zero(), Vec3::Zero()),
                        MakeBody("first", 1.0, Vec3::Zero(), Vec3(0.01, 0.01, J1)),
                        MakeBody("second", m, Vec3(r, 0, 0), Vec3(0.01, 0.01, I2))};
    mechanism.joints = {
        MakeJoint("one", JointKind::kRevolute, 0, Vec3::Zero(), 1, Vec3::Zero()),
        MakeJoint("two", JointKind::kRevolute, 0, Vec3(0.5, 0, 0), 2, Vec3::Zero(), offset)};
    mechanism.joints[1].guess[0] = offset;
    mechanism.couplings = {
        {.name = "cam", .terms = {{1, 0, {-1.0}}, {0, 0, {ratio, curve}}}, .constant = offset}};
    mechanism.drives = {{.name = "motor", .kind = JointDrive{0, 0}, .range = {}}};
    if (loss > 0.0 || loss_back > 0.0) {
      mechanism.elements = {{.name = "losses",
                             .joint = 0,
                             .law = FrictionLaw{.coefficient = 0.5 * (loss + loss_back),
                                                .skew = 0.5 * (loss - loss_back),
                                                .coupling = 0}}};
    }
    AddTree(&mechanism);
    mechanism.X_WB_home =
        TreePoses(mechanism, {mechanism.joints[0].guess, mechanism.joints[1].guess});
    return mechanism;
  }

  [[nodiscard]] double Torque(double q, double rate, double acceleration) const {
    const double slope = ratio + 2 * curve * q, q2 = offset + ratio * q + curve * q * q;
    const double coupled =
        slope * (J2 * (slope * acceleration + 2 * curve * rate * rate) + m * g * r * std::cos(q2));
    return J1 * acceleration + coupled * (coupled * rate > 0.0 ? 1.0 + loss : 1.0 - loss_back);
  }
};

}  // namespace mbv::fixtures
