// What the equations of the SCARA parallel robot take for granted.
#pragma once

#include "analytic/coverage.h"

namespace mbv::scara {

/// Motors at 90 degrees, arms in radial planes, two limbs of two equal rods with a cross-bar and
/// two of one rod, the platform level; rods of the shared bearings' masses (ball_mass, pivot_mass;
/// 0 where the model has none). Only what moves the drives counts: the platform turns about z, arms
/// about their motors, the bars not at all.
[[nodiscard]] Coverage CoverageOf(const Mechanism& mechanism);

/// Of the stiffness: arms, rods and short rods are beams of one round section, the parallelograms
/// R-Pa-R, the servos springs.
[[nodiscard]] Coverage StiffnessCoverageOf(const Mechanism& mechanism);

}  // namespace mbv::scara
