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

#include <vector>

#include "core/piecewise.h"

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

}  // namespace mbv
