// Stiffness by simulation: MuJoCo on a compliant model in which every beam is cut at mid-span and
// its halves are held together by six springs (the compliance of an Euler–Bernoulli beam is
// diagonal there), loaded and brought to static equilibrium.
#pragma once

#include <string>
#include <vector>

#include "core/stiffness.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Largest loads of the small-load extrapolation. They are reduced where the output would move by
/// more than 1e-4 of the mechanism's size or rad: larger motions bring geometry in, smaller ones
/// drown in the round-off of positions.
struct CompliantOptions {
  double force_N = 1000.0;   ///< > 0
  double moment_Nm = 100.0;  ///< > 0
};

/// One finite load: the platform's displacement in equilibrium, geometry included.
struct LoadedDisplacement {
  Vec6 displacement = Vec6::Constant(kNan);  ///< [Δγ; Δε], rotation vector, world axes
  double residual = kNan;  ///< unbalanced force after the last Newton step, relative to the load
  int iterations = 0;
};

struct CompliantRun {
  StiffnessResult result;             ///< at zero load, extrapolated
  double extrapolation_error = kNan;  ///< relative, of C: difference of the last two extrapolates
  double residual = kNan;             ///< worst of all load cases
  std::vector<LoadedDisplacement> loaded;  ///< per given wrench
  std::string mjcf;                        ///< the model as simulated
};

/// Stiffness of output `output` with all drives held by their servos in the pose X_WB (one pose
/// per body, loops closed), and the displacements under finite `wrenches` [m; f] (world axes, about
/// the output's origin). kEngineFailure and kNoConvergence in the result's summary.
[[nodiscard]] CompliantRun SimulateStiffness(const Mechanism& mechanism,
                                             const std::vector<Pose>& X_WB, int output,
                                             const std::vector<Vec6>& wrenches,
                                             const CompliantOptions& options = {});

}  // namespace mbv
