// Why a command cannot be followed. Internal to reference/.
#pragma once

#include <vector>

#include "core/run_summary.h"
#include "mechanism/body_states.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::internal {

/// Explains a failure to reach `target` (one entry per command) from the nearest pose that was
/// reached: kUnreachable with the loop that stays open, by least squares with the commands held;
/// kSingular if the target can be reached after all, but not along the commanded way.
/// `near_values` per command and term. The time is left to the caller.
[[nodiscard]] RunSummary ExplainUnreached(const Mechanism& mechanism,
                                          const std::vector<Command>& commands, const VecX& target,
                                          const BodyStates& nearest,
                                          std::vector<std::vector<double>> near_values);

/// Name of the joint that moves most in the motion given by stacked body twists (scaled by a
/// characteristic length).
[[nodiscard]] std::string MostMovingJoint(const Mechanism& mechanism, const BodyStates& states,
                                          const VecX& stacked_twists);

}  // namespace mbv::internal
