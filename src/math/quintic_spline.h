// Quintic splines through data, or near noisy data.
//
//   f(t) = Σ_j c_j B_j(t), B_j the B-splines of degree 5 on `knots`: between simple knots f has
//   four continuous derivatives, between double ones three.
//
// The coefficients minimise
//   Σ_i w_i² (f^(k_i)(t_i) − y_i)² + λ ∫ f'''(t)² dt                                        (1)
// With λ = 0 and as many data as B-splines, f meets every datum. Orthogonal rotations of one row of
// (1) after the other into a triangular band [Cox 1981; de Boor, A Practical Guide to Splines,
// chapters IX, XIV] do not square the problem's condition, as normal equations would.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "math/profile.h"

namespace mbv {

/// One datum: the derivative of `order` (0, 1 or 2) at a time.
struct SplineDatum {
  double time_s = 0.0;
  double value = 0.0;
  int order = 0;
  double weight = 1.0;
};

/// Knots of a spline through rows at `time_s` (increasing), without those that only data at the
/// ends would need: of values alone (at least 6 rows), the second and third knot from each end are
/// left out ("not a knot"); of values and rates (at least 3), knots are double and one beside each
/// end is simple.
[[nodiscard]] std::vector<double> FreeKnots(const std::vector<double>& time_s, bool with_rates);
/// A spline (1), and how it lies to the data.
struct SplineFit {
  Piecewise spline;
  double misfit = 0.0;  ///< the first sum of (1)
  /// Effective number of parameters: the trace of the matrix that makes f^(k_i)(t_i) of the y_i. As
  /// many as B-splines without smoothing, 3 for a parabola.
  double parameters = 0.0;
};
/// The spline (1) on `knots` (from the first to the last time, inner ones at most double); `data`
/// in the order of time. With rate and acceleration given at both ends, knots are all times.
[[nodiscard]] SplineFit FitSmooth(const std::vector<double>& knots,
                                  const std::vector<SplineDatum>& data, double lambda);
/// Only the spline.
[[nodiscard]] Piecewise FitSpline(const std::vector<double>& knots,
                                  const std::vector<SplineDatum>& data, double lambda = 0.0);

// Polylines with rounded corners, run at a constant speed between two ramps.
//
// The path parameter σ runs along the polyline; straight, x' = dx/dσ is the unit vector d_i of a
// segment. A corner is rounded from r before it to r behind it:
//   x' = d_1 + (d_2 − d_1) w(u),  w = 3u² − 2u³,  u = (σ − σ_0)/(2r)                            (1)
//   x  = x_0 + d_1 (σ − σ_0) + 2r (d_2 − d_1) (u³ − u⁴/2)                                       (2)
// which joins the straights with continuous second derivative, and, since the mean of w is 1/2,
// ends r behind the corner. |x'| <= 1: the point slows down in corners. Its acceleration is largest
// in the middle, 3/4 v² |d_2 − d_1|/r.

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
