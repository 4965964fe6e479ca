// Polylines with rounded corners, run at a constant speed between two ramps.
//
// The path parameter σ runs along the polyline; straight, x' = dx/dσ is the unit vector d_i of a
// segment. A corner is rounded from r before it to r behind it:
//   x' = d_1 + (d_2 − d_1) w(u),  w = 3u² − 2u³,  u = (σ − σ_0)/(2r)                            (1)
//   x  = x_0 + d_1 (σ − σ_0) + 2r (d_2 − d_1) (u³ − u⁴/2)                                       (2)
// which joins the straights with continuous second derivative, and, since the mean of w is 1/2,
// ends r behind the corner. |x'| <= 1: the point slows down in corners. Its acceleration is largest
// in the middle, 3/4 v² |d_2 − d_1|/r.
#pragma once

#include <string>
#include <vector>

#include "core/motion_laws.h"
#include "core/piecewise.h"
#include "core/types.h"

namespace mbv {

struct PolylinePlan {
  std::vector<VecX> points;  ///< two at least, no two neighbours equal
  double blend = 0.0;        ///< r, > 0
  MotionLimits limits;       ///< speed of σ; accelerations of ramps and corners; jerk of ramps
  bool s_curve = false;      ///< ramps of constant jerk instead of constant acceleration
  double start_s = 0.0;
};

/// Why a polyline cannot be run like this: corners overlap, are too sharp for the speed, or the
/// ramps do not fit into the first and the last straight. `hint`: what would.
struct PolylineTrouble {
  std::string text, hint;
};
[[nodiscard]] PolylineTrouble TroubleOf(const PolylinePlan& plan);

/// One per axis, from rest to rest; the plan has no trouble.
[[nodiscard]] std::vector<Piecewise> BlendedPolyline(const PolylinePlan& plan);

}  // namespace mbv
