// Numbers of a scenario that follow from time and from the mechanism's state.
//
//   "-k*(slider.position - 0.1) - c*slider.velocity + 5*sin(2*pi*t)"
// Names with dots are coordinates (StateCoordinates()) with .position or .velocity behind, t is the
// time [s]; other names are parameters, which are constants. SI units, radians.
#pragma once

#include <optional>
#include <string>

#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// True for a text that names the time or a coordinate.
[[nodiscard]] bool FollowsState(const ValueReader& values, const YamlNode& node);

/// Empty after a finding.
[[nodiscard]] std::optional<StateFunction> ReadStateFunction(ValueReader* values,
                                                             const Mechanism& mechanism,
                                                             const YamlNode& node,
                                                             const std::string& path);

}  // namespace mbv
