// What a scenario may command, by name.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Names a command may use: prescribed joints, drives, output components ("platform.yaw").
[[nodiscard]] std::vector<std::string> CoordinateNames(const Mechanism& mechanism);
/// The k-th of these names as a coordinate.
[[nodiscard]] Coordinate CoordinateAt(const Mechanism& mechanism, size_t k);

}  // namespace mbv
