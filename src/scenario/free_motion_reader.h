// Forward dynamics in scenario files: `forces:`, `motion.initial` and `motion.initial_rates`.
#pragma once

#include <string>
#include <vector>

#include "input/value_reader.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "scenario/profile_reader.h"

namespace mbv {

struct NamedCoordinate {
  std::string name;
  Coordinate coordinate;
};
/// What a state is made of, by name: drives, OUTPUT.x … OUTPUT.yaw, JOINT, and JOINT.0, JOINT.1 …
/// where a joint has several.
[[nodiscard]] std::vector<NamedCoordinate> StateCoordinates(const Mechanism& mechanism);

/// True when the scenario leaves freedoms to forces.
[[nodiscard]] bool IsFree(const YamlNode* motion, const YamlNode* forces);

/// Reads drive forces and start values into a motion whose commands have been read, and completes
/// the start values: freedoms that are not named start at home, at rest, in joint coordinates in
/// model order. Findings go to the reader.
void ReadFreeMotion(ValueReader* values, const Mechanism& mechanism, const YamlNode& motion_node,
                    const YamlNode* forces, ProfileTables* tables, Motion* motion);

}  // namespace mbv
