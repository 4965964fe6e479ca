// Structural faults: models of the simulated side with one thing wrong that is not a number.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// One fault put into a copy of the model, or why the mechanism cannot have it.
struct StructuralFault {
  std::string kind;        ///< "swapped drives", "flipped axis", …
  std::string where = {};  ///< "limb1.drive and limb1.drive_p"; "" if not applicable
  /// Empty if not applicable. Of an assembly several candidates: the first that moves differently
  /// is the fault, the others are the same assembly after all.
  std::vector<Mechanism> wrong = {};
  std::string not_applicable = {};      ///< the reason, where there is no `wrong`
  std::string first = {}, second = {};  ///< the drives of a swap
  size_t alike = 0;  ///< further places that are the same by symmetry of parts, left out
};

/// Every fault of the list that applies, one per place (equal parts once), the others with reasons:
/// swapped drives, flipped axis of a drive, exchanged universal-joint axes, sign of products of
/// inertia, wrong assembly (elbow branch), missing closure, 9.80665 for 9.81.
[[nodiscard]] std::vector<StructuralFault> StructuralFaults(const Mechanism& mechanism);

}  // namespace mbv
