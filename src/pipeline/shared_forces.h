// Forces that a run reports although many would do: which, and how one was chosen.
#pragma once

#include <string>
#include <vector>

#include "kinematics/mobility.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Drives that share a force among them, those of given force left out; none if it is only one.
[[nodiscard]] std::vector<std::string> SharedDrives(const Mechanism& mechanism,
                                                    const Motion& motion, const Mobility& mobility);

/// Sentences for people. `simulated`: drives and prescribed joints that MuJoCo's rows leave open at
/// the last sample, where a pose may have taken a constraint away that is there at home.
[[nodiscard]] std::vector<std::string> SharedForceTexts(const Mechanism& mechanism,
                                                        const std::vector<std::string>& drives,
                                                        const std::vector<std::string>& simulated);

}  // namespace mbv
