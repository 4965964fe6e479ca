// Loads that follow the mechanism's state, from poses and twists of all bodies.
#pragma once

#include "mechanism/body_states.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// The load at the states: its sample with what follows from coordinates and rates added. `load`
/// and `time_s` of the sample must be set where there is such a part.
[[nodiscard]] LoadSample AtStates(const Mechanism& mechanism, const BodyStates& states,
                                  const LoadSample& sample);

}  // namespace mbv
