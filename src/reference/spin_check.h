// Whether idle spins are idle (mechanism/idle_spins.h). Internal to reference/.
#pragma once

#include <vector>

#include "core/run_summary.h"
#include "mechanism/body_states.h"
#include "mechanism/idle_spins.h"

namespace mbv::internal {

/// Moment about the line through a spin's balls of the wrenches [m about Bo; f] of all bodies, in
/// world axes:  Σ_b n·m_b + (n × p_PBo)·f_b                                                   (1)
[[nodiscard]] double SpinMoment(const Spin& spin, const BodyStates& states,
                                const std::vector<Vec6>& wrench_W);

/// kUnsupported where what the bodies need beyond loads, springs and weight has such a moment: no
/// reaction of a ball gives it, so it would change the spin.
[[nodiscard]] RunSummary CheckSpinsIdle(const std::vector<Spin>& spins, const BodyStates& states,
                                        const std::vector<Vec6>& required_W, double length);

}  // namespace mbv::internal
