// mechanism.json: a mechanism with everything resolved to numbers, for other programs.
//
// docs/how-to/external_solvers.md describes every key; the schema has a version that changes when a
// reader could be misled.
#pragma once

#include <string>

#include "mechanism/mechanism.h"

namespace mbv {

inline constexpr const char* kMechanismSchema = "mbverify/mechanism/1";

/// SI units and radians; poses as `p` [m] and `R` (rows); bodies, joints and drives by name.
[[nodiscard]] std::string MechanismJson(const Mechanism& mechanism);

}  // namespace mbv
