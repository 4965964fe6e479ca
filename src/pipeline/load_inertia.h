// The inertia that a drive moves.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv {

/// Force of a drive per its own acceleration at the home pose, at rest, while all other drives hold
/// [kg or kg m²], by the reference. NaN where the drives alone do not determine the motion.
[[nodiscard]] double LoadInertia(const Mechanism& mechanism, int drive);

}  // namespace mbv
