// What the equations of the 3-SPR mechanism take for granted.
#pragma once

#include "analytic/coverage.h"

namespace mbv::spr_tripod {

/// Three equal legs at 120, −120 and 0 degrees with tangential hinges; any inertias.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

}  // namespace mbv::spr_tripod
