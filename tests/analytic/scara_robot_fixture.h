// The SCARA robot's constants written by hand (no model file), and its scenarios' motions.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "analytic/scara_robot/dynamics.h"

namespace mbv::scara_robot {

inline constexpr double kDeg = std::numbers::pi / 180.0;

inline Vec4 PoseOf(double x_mm, double y_mm, double z_mm, double phi_deg) {
  return {1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * z_mm, phi_deg * kDeg};
}

/// Table 1 of the paper and the assumed constants.
inline Mechanism PaperMechanism() {
  Mechanism mechanism;
  mechanism.name = "scara_robot";
  const std::vector<std::pair<std::string, double>> values = {
      {"R", 0.1},           {"r", 0.05},          {"l1", 0.1},
      {"l2", 0.15},         {"l3", 0.185},        {"e", 0.05},
      {"m_p", 0.4677},      {"I_p_z", 3.8975e-4}, {"m_arm", 0.1902},
      {"arm_com", 0.5},     {"m_rods", 0.2037},   {"arm_radius", 4e-3},
      {"rod_radius", 4e-3}, {"branch", 1.0},      {"home_x", -0.03},
      {"home_y", 0.075},    {"home_z", -0.13},    {"home_phi", 30.0 * kDeg}};
  for (const auto& [name, value] : values) {
    mechanism.parameters.push_back({name, value, "", Source::kUnstated, ""});
  }
  mechanism.bodies.resize(2);
  mechanism.bodies[0].name = "world";
  mechanism.bodies[1].name = "platform";
  for (int i = 0; i < kLimbs; ++i) {
    Joint motor;
    motor.name = std::string(LimbName(i)) + ".motor";
    motor.kind = JointKind::kRevolute;
    mechanism.joints.push_back(motor);
    Drive drive;
    drive.name = std::string(LimbName(i)) + ".drive";
    drive.kind = JointDrive{i, 0};
    mechanism.drives.push_back(drive);
  }
  Output platform;
  platform.name = "platform";
  platform.body = 1;
  mechanism.outputs.push_back(platform);
  return mechanism;
}

inline Parameters PaperParameters() { return ParametersOf(PaperMechanism()); }

/// Random poses well inside one quadrant of the workspace (det J_θ keeps its sign there).
inline std::vector<Vec4> QuadrantPoses(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<Vec4> poses;
  while (static_cast<int>(poses.size()) < count) {
    const Vec4 X =
        PoseOf(uniform(-70, -35), uniform(-70, -35), uniform(-200, -120), uniform(-10, 20));
    Position position;
    if (!InversePosition(PaperParameters(), X, &position).ok()) continue;
    const Singularity singularity = Measure(PaperParameters(), position);
    if (singularity.s_min > 0.05 && singularity.V_min > 0.2) poses.push_back(X);
  }
  return poses;
}

/// θ_i = θ_i,home + A_i sin(0.2 π t), the paper's (49) about a home pose.
struct SineCase {
  Vec4 home_X;
  Vec4 amplitude;
};
inline SineCase DefaultCase() {
  return {PoseOf(-30, 75, -130, 30), Vec4(1, -1, 1, -1) * std::numbers::pi / 90};
}
inline SineCase AxisCase() {
  return {PoseOf(-50, -50, -130, 15), Vec4(1, 1, -1, -1) * std::numbers::pi / 15};
}

/// Pose, rates and drive torques at one time of a motion.
struct Instant {
  Position position;
  Rates rates;
};

inline Instant SineInstant(const Parameters& parameters, const SineCase& c, double t_s) {
  Instant at;
  EXPECT_TRUE(InversePosition(parameters, c.home_X, &at.position).ok());
  const double w = 0.2 * std::numbers::pi;
  const Vec4 theta = at.position.theta + c.amplitude * std::sin(w * t_s);
  at.rates.dtheta = c.amplitude * w * std::cos(w * t_s);
  at.rates.ddtheta = -c.amplitude * w * w * std::sin(w * t_s);
  Parameters from_home = parameters;
  from_home.home_X = c.home_X;
  ForwardTracker tracker(from_home);
  EXPECT_TRUE(tracker.Follow(theta, &at.position).ok());
  PlatformRates(parameters, at.position, &at.rates);
  return at;
}

/// Value and derivatives of 10τ³ − 15τ⁴ + 6τ⁵ of τ = t/T, held outside 0 … 1.
inline Vec3 Step(double t_s, double T_s) {
  const double s = t_s / T_s;
  if (s <= 0.0) return Vec3(0, 0, 0);
  if (s >= 1.0) return Vec3(1, 0, 0);
  return {s * s * s * (10 + s * (-15 + 6 * s)), 30 * s * s * (1 - s) * (1 - s) / T_s,
          60 * s * (1 - s) * (1 - 2 * s) / (T_s * T_s)};
}

/// The pick-and-place cycle, 0 ≤ t ≤ 0.4 s.
inline Instant PickPlaceInstant(const Parameters& parameters, double t_s) {
  const Vec4 a = PoseOf(-90, -25, -165, -15), b = PoseOf(-25, -90, -165, 15);
  const bool back = t_s >= 0.2;
  const double t = back ? t_s - 0.2 : t_s;
  const Vec4 from = back ? b : a, delta = back ? Vec4(a - b) : Vec4(b - a);
  const Vec3 move = Step(t - 0.03, 0.12), lift = Step(t, 0.06) - Step(t - 0.12, 0.06);
  Instant at;
  Vec4 X = from + delta * move[0];
  at.rates.dX = delta * move[1];
  at.rates.ddX = delta * move[2];
  X[2] += 0.010 * lift[0];
  at.rates.dX[2] += 0.010 * lift[1];
  at.rates.ddX[2] += 0.010 * lift[2];
  EXPECT_TRUE(InversePosition(parameters, X, &at.position).ok());
  DriveRates(parameters, at.position, &at.rates);
  return at;
}

/// Mirrored at the plane y = x.
inline Vec4 MirrorPose(const Vec4& X) { return {X[1], X[0], X[2], -X[3]}; }
inline Vec4 MirrorLimbs(const Vec4& v) { return {v[1], v[0], v[3], v[2]}; }

}  // namespace mbv::scara_robot
