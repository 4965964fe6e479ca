// The mobility report of `mbverify model` as text and as JSON.
#pragma once

#include <string>

#include "kinematics/mobility.h"

namespace mbv {

/// Lines for the terminal.
[[nodiscard]] std::string MobilityText(const Mechanism& mechanism, const MobilityReport& report);

/// JSON, schema "mbverify.model/1": name, file, bodies, joints, DOFs, loops, redundant
/// constraints, undetermined forces.
[[nodiscard]] std::string MobilityJson(const Mechanism& mechanism, const MobilityReport& report);

}  // namespace mbv
