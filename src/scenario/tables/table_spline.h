// Rows of a table → the spline that a motion follows, with what there is to say about it.
#pragma once

#include <string>
#include <vector>

#include "math/profile.h"
#include "mechanism/motion.h"
#include "model_file/yaml/yaml_reader.h"

// Splines through, or near, the rows of a table.
//
// Smoothing minimises, over the quintic splines on the rows' times,
//   Σ_i ((f(t_i) − y_i)/σ)² + Σ_i ((f'(t_i) − v_i)/σ_v)² + λ ∫ f'''² dt                       (1)
// Where σ is stated, with the largest λ for which the first two sums do not exceed the number of
// data [Reinsch 1967]: as smooth as the noise allows. Else with the λ of generalised
// cross-validation [Craven 1979], which needs no σ but the ratio of σ to σ_v: the least of
//   n misfit / (n − p)²,                                                                    (2)
// p the effective number of parameters; misfit/(n − p) then estimates how far σ is off.
//
// Rows a time h apart make of (1) a filter without delay: it passes a sine of frequency ω by
//   H(ω) = W/(W + λ h ω⁶),  W = 1/σ² + ω²/σ_v²                                              (3)
// (away from the ends; the second part of W where rates are given). Its cut-off halves the
// amplitude, W = λ h ω⁶, and where a cut-off is stated, this gives λ.

namespace mbv {

/// What a table gives of one coordinate.
struct SplineRows {
  std::vector<double> time_s = {};              ///< increasing, 6 or more
  std::vector<double> values = {}, rates = {};  ///< rates may be empty
  double deviation = 0.0;                       ///< σ; 0: exact
  double rate_deviation = 0.0;                  ///< σ_v
  bool stated = false;                          ///< σ is known; else it is near enough for (2)
  double cutoff_hz = 0.0;                       ///< stated cut-off of (3); 0: λ by σ or by (2)
};

/// How often rows occur in time.
struct Rounds {
  bool periodic = false;  ///< the last row is the first one of the next round
  double advance = 0.0;   ///< what each round adds
};

/// The spline that meets every row: four continuous derivatives, three where rates are given. It
/// goes on beyond the rows as its last polynomials do, or repeats.
[[nodiscard]] Piecewise Interpolated(const SplineRows& rows, const Rounds& rounds = {});
/// The smoothing spline (1); Interpolated() where σ is zero and no cut-off is stated. `cutoff_hz`:
/// that of (3), infinite where nothing is smoothed.
[[nodiscard]] Piecewise Smoothed(const SplineRows& rows, const Rounds& rounds = {},
                                 double* cutoff_hz = nullptr);

/// RMS and largest magnitude, of the values and their derivatives.
struct JetSize {
  Jet rms, max;
};
/// Of a − b over the times of both, four times in each interval of `time_s`.
[[nodiscard]] JetSize DifferenceOf(const Piecewise& a, const Piecewise& b,
                                   const std::vector<double>& time_s);
/// Of a alone.
[[nodiscard]] JetSize SizeOf(const Piecewise& a, const std::vector<double>& time_s);

/// Where findings about a table's rows belong.
struct RowsPlace {
  YamlReader* yaml = nullptr;
  YamlEntry csv;      ///< the key that names the file
  std::string path;   ///< of the table
  std::string file;   ///< as written
  double step = 0.0;  ///< of the printed digits, in the values' unit
};

/// Completes a table whose description (unit, periodic, smoothing, moves) is filled in: splines and
/// what smoothing changes. Findings: a round that does not close (errors; of the acceleration a
/// warning), a second derivative that is mostly noise (a warning). False after an error.
bool MakeSplines(const RowsPlace& place, const SplineRows& rows, MotionTable* table);

}  // namespace mbv
