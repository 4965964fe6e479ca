// A parallelogram four-bar in the x-y plane, small enough to check by hand: cranks 0.2 m, coupler
// and ground 0.5 m, at 60°.
#pragma once

#include <gtest/gtest.h>

#include <string>

namespace mbv {

inline const char kFourBar[] = R"(name: four_bar
parameters:
  crank: 0.2
  ground: {value_mm: 500, unit: m, source: assumed, note: between the pivots}
gravity: [0, -9.81, 0]
world:
  frames:
    A: [0, 0, 0]
    D: {position: [ground, 0, 0]}
bodies:
  crank:
    mass: 2
    com: [crank/2, 0, 0]
    inertia: {xx: 0.01, yy: 0.02, zz: 0.02}
    frames: {foot: {}, end: [crank, 0, 0]}
    shapes: [{capsule: {from: foot, to: end, radius_mm: 10}, color: accent}]
  coupler:
    frames: {start: {}, end: [ground, 0, 0], tool: {position: [ground/2, 0.1, 0], rotation: {rpy_deg: [0, 0, 30]}}}
  rocker:
    frames: {foot: {}, end: [crank, 0, 0]}
joints:
  A: {kind: revolute, parent: world.A, child: crank.foot, axis: z, guess_deg: 60}
  B: {kind: revolute, parent: crank.end, child: coupler.start, axis: z, guess_deg: -60}
  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z, guess_deg: -60, closure: true}
  D: {kind: revolute, parent: world.D, child: rocker.foot, axis: z, guess_deg: 60}
drives:
  motor: {kind: joint, joint: A, range_deg: [0, 170]}
outputs:
  tool: coupler.tool
)";

/// `text` with its only `from` replaced.
inline std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << "the test looks for '" << from << "'";
  if (at == std::string::npos) return text;
  EXPECT_EQ(text.find(from, at + 1), std::string::npos) << "'" << from << "' is there twice";
  return text.replace(at, from.size(), to);
}

}  // namespace mbv
