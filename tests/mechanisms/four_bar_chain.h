// N four-bars side by side, each driven by the rocker before: one DOF, N loops, 2N + 1 bodies.
#pragma once

#include <fmt/format.h>

#include <string>

#include "base/demand.h"
#include "mechanism/motion.h"
#include "model_file/load_model.h"

namespace mbv {

/// model.yaml of a chain of parallelograms with one motor.
inline std::string FourBarChainText(int loops) {
  std::string world, bodies, joints;
  for (int i = 0; i <= loops; ++i) {
    world += fmt::format("    G{}: [{}, 0, 0]\n", i, 0.4 * i);
    bodies += fmt::format(
        "  rocker{}: {{mass: 0.4, com: [0.1, 0, 0], inertia: [2e-5, 1.3e-3, 1.3e-3], frames: "
        "{{end: "
        "[0.2, 0, 0]}}}}\n",
        i);
    joints += fmt::format(
        "  D{0}: {{kind: revolute, parent: world.G{0}, child: rocker{0}, axis: z, guess_deg: "
        "90}}\n",
        i);
  }
  for (int i = 1; i <= loops; ++i) {
    bodies += fmt::format(
        "  coupler{}: {{mass: 0.8, com: [0.2, 0, 0], inertia: [4e-5, 1.1e-2, 1.1e-2], frames: "
        "{{end: "
        "[0.4, 0, 0]}}}}\n",
        i);
    joints += fmt::format(
        "  B{0}: {{kind: revolute, parent: rocker{1}.end, child: coupler{0}, axis: z, guess_deg: "
        "-90}}\n  C{0}: {{kind: revolute, parent: rocker{0}.end, child: coupler{0}.end, axis: "
        "z}}\n",
        i, i - 1);
  }
  return fmt::format(
      "name: chain{}\ngravity: [0, -9.81, 0]\nworld:\n  frames:\n{}bodies:\n{}joints:\n{}drives:\n "
      " "
      "motor: {{kind: joint, joint: D0}}\noutputs:\n  rocker: rocker{}\n",
      loops, world, bodies, joints, loops);
}

inline Mechanism FourBarChain(int loops) {
  LoadResult loaded = LoadModelText(FourBarChainText(loops), "chain.yaml");
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

/// The motor swings by half a radian once a second.
inline Motion FourBarChainMotion(const Mechanism& mechanism) {
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.01;
  const double home = mechanism.joints[mechanism.FindJoint("D0")].home[0];
  motion.commands.push_back(
      {.name = "motor",
       .terms = {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}},
       .profile = {{ConstantTerm{home}, SineTerm{.amplitude = 0.5, .frequency_hz = 1.0}}}});
  return motion;
}

/// It is let go, turning at 1 rad/s.
inline Motion FreeFourBarChainMotion(const Mechanism& mechanism) {
  Motion motion;
  motion.duration_s = 0.2;
  motion.sample_s = 0.01;
  const Coordinate motor{Coordinate::Kind::kDrive, 0, 0};
  motion.initial.push_back(
      {.name = "motor", .coordinate = motor, .position = HomeValue(mechanism, motor), .rate = 1.0});
  motion.forces.push_back({.drive = 0, .force = Constant(0.5)});
  return motion;
}

}  // namespace mbv
