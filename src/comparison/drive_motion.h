// Whose motion the drives follow, and which comparisons are therefore no evidence.
#pragma once

#include <string>

#include "comparison/comparison.h"

namespace mbv {

/// One sentence about who gives the simulation its motion; "" where nothing was simulated.
[[nodiscard]] std::string DrivingText(const ComparisonInput& input);

/// True of coordinates of outputs and of joints without a drive.
[[nodiscard]] bool IsOfTask(const Coordinate& coordinate);
/// True when some command is about one of these: drive motions are then computed, not given.
[[nodiscard]] bool IsTaskSpace(const Motion& motion);

/// True when the commands determine every drive's motion, so that all computations are given it.
[[nodiscard]] bool GivesAllDriveMotion(const ComparisonInput& input);

/// True when a check compares a drive motion with itself: the simulation's with its own command
/// to follow, or a drive that the scenario commands with its command. Such a check can fail; that
/// it passes verifies nothing.
[[nodiscard]] bool ComparesMotionWithItself(const ComparisonInput& input, const CheckResult& check);

}  // namespace mbv
