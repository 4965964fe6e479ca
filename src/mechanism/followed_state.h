// What loads that follow the state read, and what they report where they have no value.
//
// Lengths need no more than poses. Angles count rotations: those of joints, drives and prescribed
// joints from home, those of outputs from the command or start value that gives them; from there
// all go on without a jump. Reference and simulation count each by itself.
#pragma once

#include <span>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "mechanism/motion.h"

namespace mbv {

/// An angle of a joint or an output that some load follows.
struct FollowedAngle {
  Coordinate coordinate;
  double start = 0.0;  ///< within half a rotation of it at t = 0 [rad]
};
/// Of all loads, in their order; drives and prescribed joints are not among them.
[[nodiscard]] std::vector<FollowedAngle> FollowedAngles(const Mechanism& mechanism,
                                                        const Motion& motion);

/// A value within half a rotation of an angle at t = 0: the command or the start value that gives
/// this very coordinate, else its value at home [rad].
[[nodiscard]] double StartAngle(const Mechanism& mechanism, const Motion& motion,
                                const Coordinate& coordinate);

/// Its name in scenario files, without .position or .velocity: "motor", "tool.yaw", "hip.0".
[[nodiscard]] std::string NameOf(const Mechanism& mechanism, const Coordinate& coordinate);

/// How a run ends where a part of a load is `value`, which is not finite, at these inputs (as in
/// its function) and time.
[[nodiscard]] RunSummary LoadHasNoValue(const Mechanism& mechanism, const Load& load,
                                        const Load::Following& part, double t_s,
                                        std::span<const double> inputs, double value);

}  // namespace mbv
