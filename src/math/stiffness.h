// Stiffness of a mechanism at a frame of its moving platform: the currency between the
// computations of stiffness (closed form, frame finite elements, compliant simulation).
//
// Small displacements of the frame about a pose with all drives held: D = [Δγ; Δε], rotation
// vector [rad] first, then displacement of the frame's origin [m]; wrench F = [m; f] about the
// origin; world axes. F = K D, D = C F.
#pragma once

#include <string>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"

namespace mbv {

/// What one elastic element (a beam, or the servo of a drive) contributes to the compliance:
/// C_e(i, j) = Σ over the element of its deformation under unit wrench i times its internal force
/// under unit wrench j. The shares of all elements add up to C.
struct ComplianceShare {
  std::string element;  ///< Beam::name, or "DRIVE (servo)"
  Mat6 C = Mat6::Zero();
};

struct StiffnessResult {
  Mat6 K = Mat6::Constant(kNan);        ///< symmetric
  Mat6 C = Mat6::Constant(kNan);        ///< K⁻¹; NaN where K is singular
  int rank = -1;                        ///< of K made dimensionless with the mechanism's size
  std::vector<ComplianceShare> shares;  ///< empty where a computation does not give them or K is
                                        ///< singular
  RunSummary summary;
};

}  // namespace mbv
