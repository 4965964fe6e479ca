// How much of the drive forces smoothing of a motion's tables takes out.
#pragma once

#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "report/report.h"

namespace mbv {

/// The reference along the motion against the reference along the same motion with every smoothed
/// table's spline put through all its rows. Empty without a smoothed command, for free motions, and
/// where the reference fails.
[[nodiscard]] std::vector<SmoothedForce> SmoothedForces(const Mechanism& mechanism,
                                                        const Motion& motion);

}  // namespace mbv
