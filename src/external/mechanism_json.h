// mechanism.json: a mechanism with everything resolved to numbers, for other programs.
//
// docs/how-to/external_solvers.md describes every key; the schema has a version that changes when a
// reader could be misled.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

inline constexpr const char* kMechanismSchema = "mbverify/mechanism/1";

/// SI units and radians; poses as `p` [m] and `R` (rows); bodies, joints and drives by name.
[[nodiscard]] std::string MechanismJson(const Mechanism& mechanism);

// Checks a mechanism.json: against its schema (mechanism.schema.json), and what no schema can say:
// that names are unique and known, axes are unit vectors, frames rotations, inertias possible, and
// that the joints which close no loop make one tree.

struct JsonFinding {
  std::vector<std::string> path;  ///< keys and indices from the root
  std::string message, hint = {};
  int line = 0, column = 0;  ///< where the text is not JSON; 0 elsewhere
};

/// "joints[3].parent.body".
[[nodiscard]] std::string PathText(const std::vector<std::string>& path);

/// All findings; those beyond the schema only where the schema is met.
[[nodiscard]] std::vector<JsonFinding> CheckMechanismJson(const std::string& text);

/// The schema: JSON Schema, draft 7, with units.
[[nodiscard]] const std::string& MechanismSchemaText();

}  // namespace mbv
