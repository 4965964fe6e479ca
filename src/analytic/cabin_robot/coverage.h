// What the equations of the cabin robot take for granted.
#pragma once

#include "analytic/coverage.h"

namespace mbv::cabin {

/// A planar linkage on three sliders, hinges along the rail, and a wrist by the angles of Table 1;
/// principal axes along the body frames.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

/// Of the stiffness: both linkages, every link, column, arm, rail and tool a beam of rectangular
/// section, all drives locked.
[[nodiscard]] Coverage StiffnessCoverageOf(const Mechanism& mechanism);

}  // namespace mbv::cabin
