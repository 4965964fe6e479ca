// The stabilizing platform's default data and motions, for tests that need no model file.
#pragma once

#include <fmt/format.h>

#include <map>
#include <numbers>
#include <string>

#include "analytic/stabilizing_platform/closed_form.h"
#include "analytic/stabilizing_platform/dynamics.h"
#include "base/demand.h"

namespace mbv::stabilizing_platform {

inline constexpr double kDegree = std::numbers::pi / 180;

/// Default parameters by name [Li 2018, section 4; theta_2 corrected].
inline std::map<std::string, double> DefaultParameters() {
  return {{"r_a", 7.5},
          {"r_b", 7.38},
          {"z_0", 3.5},
          {"theta_1", 120 * kDegree},
          {"theta_2", 240 * kDegree},
          {"theta_3", 10.2 * kDegree},
          {"L1", 4.8},
          {"L2", 4.79},
          {"L3", 2.25},
          {"L4", 0.785},
          {"L5", 2.5},
          {"s_r_so", 0.225},
          {"m_p", 50000},
          {"I_p_x", 4.76e5},
          {"I_p_y", 8.36e5},
          {"I_p_z", 4.3e5},
          {"m_1", 1705},
          {"m_1p", 1776},
          {"I_1_x", 4.3e4},
          {"I_1_y", 1.9e3},
          {"I_1_z", 4.28e4},
          {"I_1p_x", 4.53e4},
          {"I_1p_y", 2.6e3},
          {"I_1p_z", 4.57e4},
          {"m_2", 754},
          {"m_2p", 735},
          {"I_2_x", 397},
          {"I_2_y", 86},
          {"I_2_z", 460},
          {"I_2p_x", 391},
          {"I_2p_y", 72},
          {"I_2p_z", 441},
          {"c_1", 0.5},
          {"c_2", 0.5},
          {"g", 9.8},
          {"link_mass_scale", 1.0},
          {"link1_inertia_scale", 1.0}};
}

/// A mechanism with nothing but the names that the closed form looks up.
inline Mechanism MechanismOfNames(const std::map<std::string, double>& parameters) {
  Mechanism m;
  m.name = "stabilizing_platform";
  for (const auto& [name, value] : parameters) {
    m.parameters.push_back({.name = name, .value = value, .unit = "", .note = ""});
    if (name == "g") m.gravity_W = Vec3(0, 0, -value);
  }
  auto add_body = [&](const std::string& name) {
    Body body;
    body.name = name;
    m.bodies.push_back(body);
  };
  for (const char* body : {"world", "lower_platform", "platform"}) add_body(body);
  for (int i = 1; i <= 3; ++i) {
    for (const char* link : kLinkNames) add_body(fmt::format("limb{}.{}", i, link));
    for (const char* drive : {"drive", "drive_p"}) {
      Drive d;
      d.name = fmt::format("limb{}.{}", i, drive);
      d.kind = DistanceDrive{};
      m.drives.push_back(d);
    }
  }
  for (const char* name : {"roll", "pitch", "heave"}) m.prescribed.push_back({.name = name});
  Output output;
  output.name = "platform";
  output.body = 2;
  m.outputs.push_back(output);
  return m;
}

/// The ship's motion of the paper's example: roll 6° at 6 s, pitch 3° at 4 s, heave 1.5 m at 6 s.
inline PoseCommand SeaState(double t, double scale = 1.0) {
  const SineTerm roll{6 * kDegree * scale, 1.0 / 6, 0}, pitch{3 * kDegree * scale, 0.25, 0};
  const SineTerm heave{1.5 * scale, 1.0 / 6, 0};
  PoseCommand command;
  command.roll = Evaluate(roll, t);
  command.pitch = Evaluate(pitch, t);
  command.heave = Evaluate(heave, t);
  command.platform.fill(Jet{});
  command.platform[2].value = 3.5;
  return command;
}

inline PlatformParameters ParametersOf(const std::map<std::string, double>& values) {
  Diagnostics diagnostics;
  PlatformParameters p = ReadParameters(MechanismOfNames(values), &diagnostics);
  MBV_DEMAND(diagnostics.empty(), diagnostics.Text());
  return p;
}

inline const PlatformParameters& Default() {
  static const PlatformParameters p = ParametersOf(DefaultParameters());
  return p;
}

/// Kinematics and dynamics at one instant; fails the demand when the pose cannot be computed.
inline Evaluation Evaluate(const PlatformEquations& equations, const PoseCommand& command,
                           std::span<const BodyLoad> loads = {}) {
  Evaluation e;
  RunSummary summary = equations.EvaluateKinematics(command, &e);
  if (summary.ok()) summary = equations.EvaluateDynamics(loads, &e);
  MBV_DEMAND(summary.ok(), summary.message);
  return e;
}

/// Motion of a scenario: sea state; synchronous unless `hold_still`.
inline Motion SeaStateMotion(const Mechanism& mechanism, bool hold_still = false) {
  using Kind = Coordinate::Kind;
  Motion motion;
  motion.duration_s = 12;
  motion.sample_s = 0.02;
  auto single = [&](const char* name, Kind kind, int index, int component, ProfileTerm term) {
    motion.commands.push_back({name, {{{kind, index, component}, 1.0}}, {{term}}});
  };
  auto ship = [&](const std::string& name, ProfileTerm term) {
    for (size_t k = 0; k < mechanism.prescribed.size(); ++k) {
      if (mechanism.prescribed[k].name != name) continue;
      single(name.c_str(), Kind::kPrescribed, static_cast<int>(k), 0, term);
    }
  };
  ship("roll", SineTerm{6 * kDegree, 1.0 / 6, 0});
  ship("pitch", SineTerm{3 * kDegree, 0.25, 0});
  ship("heave", SineTerm{1.5, 1.0 / 6, 0});
  const char* names[] = {"platform.x",    "platform.y",     "platform.z",
                         "platform.roll", "platform.pitch", "platform.yaw"};
  const int output = mechanism.FindOutput("platform");
  for (int c = 0; c < 6; ++c) {
    const bool follows = c == 0 || c == 1 || c == 5;
    if (follows && !hold_still) continue;
    single(names[c], Kind::kOutput, output, c, ConstantTerm{c == 2 ? 3.5 : 0.0});
  }
  for (int i = 1; i <= 3 && !hold_still; ++i) {
    const int drive = mechanism.FindDrive(fmt::format("limb{}.drive", i));
    const int drive_p = mechanism.FindDrive(fmt::format("limb{}.drive_p", i));
    motion.commands.push_back(
        {fmt::format("limb{0}.drive - limb{0}.drive_p", i),
         {{{Kind::kDrive, drive, 0}, 1.0}, {{Kind::kDrive, drive_p, 0}, -1.0}},
         {{ConstantTerm{0}}}});
  }
  return motion;
}
/// The same on MechanismOfNames.
inline Motion SeaStateMotion(bool hold_still = false) {
  return SeaStateMotion(MechanismOfNames(DefaultParameters()), hold_still);
}

}  // namespace mbv::stabilizing_platform
