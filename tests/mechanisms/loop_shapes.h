// Mechanisms of many loops: how loops hang together decides what they cost.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <string>

#include "base/demand.h"
#include "base/run_summary.h"
#include "mechanism/motion.h"
#include "model_file/load_model.h"

namespace mbv {

/// What a simulation is driven by where the commands are the drives' own motion, which outlives it.
inline auto FollowCommands(const Motion& motion) {
  return [&motion, command = CommandSample()](double t, auto* at) mutable {
    EvaluateMotion(motion, t, &command);
    at->position = command.position;
    at->velocity = command.velocity;
    at->acceleration = command.acceleration;
    return RunSummary::Done();
  };
}

/// model.yaml that is written piece by piece.
struct LoopShapeText {
  std::string name, frames, bodies = {}, joints = {}, drives = {};

  [[nodiscard]] std::string Text() const {
    return fmt::format(
        "name: {}\ngravity: [0, -9.81, 0]\nworld:\n  frames:\n{}bodies:\n{}joints:\n{}drives:\n{}",
        name, frames, bodies, joints, drives);
  }
  void Bar(const std::string& bar, double from, double to) {
    const double I = 0.5 * (to - from) * (to - from) / 12;
    bodies += fmt::format(
        "  {0}: {{mass: 0.5, com: [{1}, 0, 0], inertia: [{2}, {3}, {3}], frames: {{low: [{4}, 0, "
        "0], high: [{5}, 0, 0]}}}}\n",
        bar, 0.5 * (from + to), 0.01 * I, I, from, to);
  }
  void Revolute(const std::string& joint, const std::string& parent, const std::string& child,
                double guess_rad) {
    joints += fmt::format("  {}: {{kind: revolute, parent: {}, child: {}, axis: z, guess: {}}}\n",
                          joint, parent, child, guess_rad);
  }
  /// Its place from the ground, which cuts MuJoCo's tree there.
  void Place(const std::string& body, double x, double y, double angle) {
    joints += fmt::format(
        "  place_{0}: {{kind: free, parent: world, child: {0}, guess: [{1}, {2}, 0, 0, 0, {3}], "
        "closure: false}}\n",
        body, x, y, angle);
  }
  void Drive(const std::string& drive, const std::string& joint) {
    drives += fmt::format("  {}: {{kind: joint, joint: {}}}\n", drive, joint);
  }
};

/// Crossed bars on each other, the lowest pair on the ground: one DOF. `placed`: each second bar
/// has its place from the ground, as in the other shapes some bodies have.
inline std::string ScissorLiftText(int loops, bool placed = false) {
  const double pi = std::numbers::pi, lean = 0.7;
  LoopShapeText shape{.name = "scissors", .frames = "    G: [0, 0, 0]\n"};
  shape.bodies = "  shoe: {mass: 0.2, inertia: [1e-4, 1e-4, 1e-4]}\n";
  for (int i = 0; i < loops; ++i) {
    shape.Bar(fmt::format("a{}", i), -0.2, 0.2);
    shape.Bar(fmt::format("b{}", i), -0.2, 0.2);
    const std::string a = fmt::format("a{}", i), b = fmt::format("b{}", i);
    const std::string a0 = fmt::format("a{}.high", i - 1), b0 = fmt::format("b{}.high", i - 1);
    if (i == 0) {
      shape.Revolute("A0", "world.G", a + ".low", lean);
      shape.joints += fmt::format(
          "  rail: {{kind: prismatic, parent: world.G, child: shoe, axis: x, guess: {}}}\n",
          0.4 * std::cos(lean));
      shape.Revolute("B0", "shoe", b + ".low", pi - lean);
    } else {
      shape.Revolute("A" + a, b0, a + ".low", 2 * lean - pi);
      shape.Revolute("B" + b, a0, b + ".low", pi - 2 * lean);
      if (placed) shape.Place(a, 0.2 * std::cos(lean), 0.2 * std::sin(lean) * (2 * i + 1), lean);
    }
    shape.Revolute("C" + a, a, b, pi - 2 * lean);
  }
  shape.Drive("motor", "A0");
  return shape.Text();
}

/// Parallelograms on each other, each with a motor.
inline std::string StoreysText(int loops, bool placed = false) {
  double x = 0.0, y = 0.0;
  LoopShapeText shape{.name = "storeys", .frames = "    low: [0, 0, 0]\n    high: [0.4, 0, 0]\n"};
  for (int i = 0; i < loops; ++i) {
    const double lean = std::numbers::pi / 2 + (i % 2 == 0 ? 0.2 : -0.2);
    const std::string base = i == 0 ? "world" : fmt::format("beam{}", i - 1);
    shape.Bar(fmt::format("left{}", i), 0.0, 0.3);
    shape.Bar(fmt::format("right{}", i), 0.0, 0.3);
    shape.Bar(fmt::format("beam{}", i), 0.0, 0.4);
    shape.Revolute(fmt::format("A{}", i), base + ".low", fmt::format("left{}", i), lean);
    shape.Revolute(fmt::format("B{}", i), base + ".high", fmt::format("right{}", i), lean);
    shape.Revolute(fmt::format("C{}", i), fmt::format("left{}.high", i),
                   fmt::format("beam{}.low", i), -lean);
    shape.Revolute(fmt::format("D{}", i), fmt::format("right{}.high", i),
                   fmt::format("beam{}.high", i), -lean);
    shape.Drive(fmt::format("motor{}", i), fmt::format("A{}", i));
    x += 0.3 * std::cos(lean);
    y += 0.3 * std::sin(lean);
    if (placed) shape.Place(fmt::format("beam{}", i), x, y, 0.0);
  }
  return shape.Text();
}

/// width² loops of (width + 1)² plates that hang together at their corners, one on the ground: one
/// DOF, which turns every second plate.
inline std::string NetOfPlatesText(int width) {
  const double turn = -0.8, arm = 0.1;
  LoopShapeText shape{.name = "net",
                      .frames = fmt::format("    E: [{0}, 0, 0]\n    N: [0, {0}, 0]\n", arm)};
  const auto plate = [](int i, int j) {
    return i + j == 0 ? std::string("world") : fmt::format("p{}_{}", i, j);
  };
  for (int i = 0; i <= width; ++i) {
    for (int j = 0; j <= width; ++j) {
      const double step = (i + j) % 2 == 0 ? turn : -turn;
      if (i + j > 0) {
        shape.bodies += fmt::format(
            "  {0}: {{mass: 0.5, inertia: [1e-3, 1e-3, 2e-3], frames: {{E: [{1}, 0, 0], N: [0, "
            "{1}, 0], W: [-{1}, 0, 0], S: [0, -{1}, 0]}}}}\n",
            plate(i, j), arm);
      }
      const auto hinge = [&](const char* side, const std::string& next, const char* end) {
        shape.Revolute(fmt::format("{}{}_{}", side, i, j), plate(i, j) + "." + side,
                       next + "." + end, step);
      };
      if (i < width) hinge("E", plate(i + 1, j), "W");
      if (j < width) hinge("N", plate(i, j + 1), "S");
    }
  }
  shape.Drive("motor", "E0_0");
  return shape.Text();
}

/// Stewart platforms on each other, five loops each; each platform has its place from the ground.
inline std::string HexapodsText(int hexapods) {
  const double pi = std::numbers::pi, gap = 0.4, height = 0.4;
  LoopShapeText shape{.name = "hexapods", .frames = {}};
  const auto corner = [](double radius, double angle) {
    return fmt::format("[{}, {}, 0]", radius * std::cos(angle), radius * std::sin(angle));
  };
  const auto low = [&](int leg) { return pi / 3 * (leg - leg % 2) + (leg % 2 ? gap : -gap); };
  const auto high = [&](int leg) { return pi / 3 * (leg + leg % 2) + (leg % 2 ? -gap : gap); };
  std::string sockets;
  for (int leg = 0; leg < 6; ++leg) {
    sockets += fmt::format("{}U{}: {{position: {}, rotation: {{axis: z, angle: {}}}}}",
                           leg == 0 ? "" : ", ", leg, corner(0.4, low(leg)), low(leg));
  }
  std::string balls;
  for (int leg = 0; leg < 6; ++leg) {
    balls += fmt::format(", S{}: {}", leg, corner(0.35, high(leg)));
  }
  shape.frames = "    dummy: [0, 0, 0]\n";
  for (int leg = 0; leg < 6; ++leg) {
    shape.frames += fmt::format("    U{}: {{position: {}, rotation: {{axis: z, angle: {}}}}}\n",
                                leg, corner(0.4, low(leg)), low(leg));
  }
  for (int h = 0; h < hexapods; ++h) {
    const std::string base = h == 0 ? "world" : fmt::format("top{}", h - 1);
    shape.bodies += fmt::format(
        "  top{}: {{mass: 5, inertia: [0.2, 0.2, 0.4], frames: {{{}{}}}}}\n", h, sockets, balls);
    shape.joints += fmt::format(
        "  float{0}: {{kind: free, parent: world, child: top{0}, guess: [0, 0, {1}, 0, 0, 0], "
        "closure: false}}\n",
        h, height * (h + 1));
    for (int leg = 0; leg < 6; ++leg) {
      const double dx = 0.35 * std::cos(high(leg)) - 0.4 * std::cos(low(leg));
      const double dy = 0.35 * std::sin(high(leg)) - 0.4 * std::sin(low(leg));
      const double length = std::sqrt(dx * dx + dy * dy + height * height);
      shape.bodies += fmt::format(
          "  cyl{0}_{1}: {{mass: 0.8, com: [0, 0, 0.1], inertia: [0.006, 0.006, 6e-4]}}\n"
          "  rod{0}_{1}: {{mass: 0.5, com: [0, 0, -0.1], inertia: [0.004, 0.004, 1e-4]}}\n",
          h, leg);
      shape.joints += fmt::format(
          "  U{0}_{1}: {{kind: universal, parent: {2}.U{1}, child: cyl{0}_{1}, axis: y, axis2: "
          "x}}\n"
          "  P{0}_{1}: {{kind: prismatic, parent: cyl{0}_{1}, child: rod{0}_{1}, axis: z, guess: "
          "{3}}}\n"
          "  S{0}_{1}: {{kind: spherical, parent: rod{0}_{1}, child: top{0}.S{1}}}\n",
          h, leg, base, length);
      shape.Drive(fmt::format("leg{}_{}", h, leg), fmt::format("P{}_{}", h, leg));
    }
  }
  return shape.Text();
}

/// One loop of equal links that is a polygon with the ground; all but three joints have motors.
inline std::string LongLoopText(int links, bool placed = false) {
  double x = 0.0, y = 0.0;
  const double side = 0.1, turn = 2 * std::numbers::pi / (links + 1);
  LoopShapeText shape{.name = "loop",
                      .frames = fmt::format("    A: [0, 0, 0]\n    B: [-{}, 0, 0]\n", side)};
  for (int i = 0; i < links; ++i) {
    shape.Bar(fmt::format("link{}", i), 0.0, side);
    const std::string before = i == 0 ? "world.A" : fmt::format("link{}.high", i - 1);
    shape.Revolute(fmt::format("J{}", i), before, fmt::format("link{}.low", i), turn);
    if (placed && i % 5 == 4) shape.Place(fmt::format("link{}", i), x, y, (i + 1) * turn);
    x += side * std::cos((i + 1) * turn);
    y += side * std::sin((i + 1) * turn);
    const bool free = i == links / 4 || i == links / 2 || i == links - links / 4;
    if (!free) shape.Drive(fmt::format("motor{}", i), fmt::format("J{}", i));
  }
  shape.Revolute("last", "world.B", fmt::format("link{}.high", links - 1), -turn);
  shape.Drive("motor_last", "last");
  return shape.Text();
}

inline Mechanism MechanismOf(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "shape.yaml");
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text().substr(0, 2000));
  return *std::move(loaded.mechanism);
}

/// All drives swing about home once a second.
inline Motion SwingAllDrives(const Mechanism& mechanism, double amplitude) {
  Motion motion;
  motion.duration_s = 0.1;
  motion.sample_s = 0.01;
  for (int d = 0; d < static_cast<int>(mechanism.drives.size()); ++d) {
    const Coordinate drive{Coordinate::Kind::kDrive, d, 0};
    const SineTerm sine{.amplitude = amplitude, .frequency_hz = 1.0};
    motion.commands.push_back({.name = mechanism.drives[static_cast<size_t>(d)].name,
                               .terms = {{drive, 1.0}},
                               .profile = {{ConstantTerm{HomeValue(mechanism, drive)}, sine}}});
  }
  return motion;
}

}  // namespace mbv
