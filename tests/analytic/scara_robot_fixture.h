// Published and assumed constants of the SCARA robot, written by hand (no model file needed).
#pragma once

#include <numbers>
#include <utility>
#include <vector>

#include "analytic/scara_robot/dynamics.h"

namespace mbv::scara {

inline constexpr double kDeg = std::numbers::pi / 180.0;

inline Vec4 PoseOf(double x_mm, double y_mm, double z_mm, double phi_deg) {
  return {1e-3 * x_mm, 1e-3 * y_mm, 1e-3 * z_mm, phi_deg * kDeg};
}

inline std::vector<std::pair<const char*, double>> PaperValues() {
  return {{"R", 0.1},           {"r", 0.05},          {"l1", 0.1},
          {"l2", 0.15},         {"l3", 0.185},        {"e", 0.05},
          {"m_p", 0.4677},      {"I_p_z", 3.8975e-4}, {"m_arm", 0.1902},
          {"arm_radius", 4e-3}, {"arm_com", 0.5},     {"m_rods", 0.2037},
          {"rod_radius", 4e-3}, {"branch", 1.0},      {"home_x", -0.03},
          {"home_y", 0.075},    {"home_z", -0.13},    {"home_phi", 30.0 * kDeg}};
}

inline Mechanism PaperMechanism() {
  Mechanism mechanism;
  mechanism.name = "scara_robot";
  for (const auto& [name, value] : PaperValues())
    mechanism.parameters.push_back({name, value, "", {}, ""});
  mechanism.bodies.resize(2);
  mechanism.bodies[0].name = "world";
  mechanism.bodies[1].name = "platform";
  for (int i = 0; i < kLimbs; ++i) {
    Joint motor;
    motor.name = std::string(LimbName(i)) + ".motor";
    motor.kind = JointKind::kRevolute;
    mechanism.joints.push_back(motor);
    mechanism.drives.push_back({std::string(LimbName(i)) + ".drive", JointDrive{i, 0}, {}, 0.0});
  }
  Output platform;
  platform.name = "platform";
  platform.body = 1;
  mechanism.outputs.push_back(platform);
  return mechanism;
}

inline Parameters PaperParameters() { return ParametersOf(PaperMechanism()); }

}  // namespace mbv::scara
