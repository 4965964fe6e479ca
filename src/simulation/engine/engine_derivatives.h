// MuJoCo's own derivative of a mechanism at rest: mjd_transitionFD, which differentiates a step of
// time by differences, loops as soft as its equalities are.
#pragma once

#include <string>

#include "base/run_summary.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

struct EngineDerivatives {
  RunSummary summary;  ///< kUnsupported where MuJoCo's model lacks a part of the mechanism
  MatX by_position, by_velocity;  ///< ∂a/∂q, ∂a/∂v of the coordinates that `T` has columns for
  // What it was asked, for another MuJoCo: the model, its configuration, and MuJoCo's rates per
  // unit rate of each coordinate (nv × n).
  std::string mjcf;
  VecX qpos;
  MatX U;

  /// Of MuJoCo's own rates, those of the coordinates by least squares (both … × n).
  [[nodiscard]] MatX InCoordinates(const MatX& rates) const;
};

/// At poses `X_WB`, at rest, under `drive_force` on the generated MJCF, whose motors act alone.
/// `T`: twists of the moving bodies per unit rate of each coordinate (reduced_model.h), the
/// directions in which MuJoCo's coordinates are varied; what it accelerates is seen in them by
/// least squares. `default_softness`: of its equalities, else as stiff as its step allows.
[[nodiscard]] EngineDerivatives DifferentiateEngine(const Mechanism& mechanism,
                                                    const std::vector<Pose>& X_WB, const MatX& T,
                                                    const VecX& drive_force, bool default_softness);

}  // namespace mbv
