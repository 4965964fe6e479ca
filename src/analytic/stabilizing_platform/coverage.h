// What the equations of the stabilizing platform take for granted.
#pragma once

#include "analytic/coverage.h"

namespace mbv::stabilizing_platform {

/// Ship joints about fixed axes through the earth's origin; three equal limbs in planes through
/// their azimuths; links with principal axes along the link; rods without mass.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

}  // namespace mbv::stabilizing_platform
