// The times at which a motion is not smooth.
#pragma once

#include <vector>

#include "mechanism/motion.h"

namespace mbv {

/// Times [s] at which a command, given force or load of the motion changes its formula; increasing,
/// the same time may occur more than once.
[[nodiscard]] std::vector<double> BreakTimes(const Motion& motion);

}  // namespace mbv
