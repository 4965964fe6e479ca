// The `motion:` and `loads:` sections of a scenario.
#pragma once

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "scenario/value_reader.h"

namespace mbv {

/// Reads both sections against a mechanism. Findings go to the reader; the motion is complete only
/// if it reported no error.
[[nodiscard]] Motion ReadMotion(ValueReader* values, const Mechanism& mechanism,
                                const YamlNode* motion, const YamlNode* loads);

/// Names a command may use: prescribed joints, drives, output components ("platform.yaw").
[[nodiscard]] std::vector<std::string> CoordinateNames(const Mechanism& mechanism);
/// The k-th of these names as a coordinate.
[[nodiscard]] Coordinate CoordinateAt(const Mechanism& mechanism, size_t k);

/// Value of a coordinate at the mechanism's home pose [m or rad].
[[nodiscard]] double HomeValue(const Mechanism& mechanism, const Coordinate& coordinate);

}  // namespace mbv
