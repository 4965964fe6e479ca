// The loops of the spanning tree, one per closure.
#pragma once

#include <vector>

#include "kinematics/mobility_report.h"

namespace mbv {

/// Joints around each loop, their freedoms, and the rank of their screws at home.
[[nodiscard]] std::vector<LoopCount> CountLoops(const Mechanism& mechanism);

}  // namespace mbv
