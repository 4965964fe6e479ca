// What a logged drive force differs by from the model's, as a fit.
//
//   y(t) = g m(t − τ) + o + Fc sign v(t − τ) + Fv v(t − τ) + J a(t − τ) + e(t)              (1)
//
// y: the log's force, m: the model's, v, a: rate and acceleration of the drive. τ > 0: the log's
// force comes late. Fc, Fv > 0: the motor overcomes friction that the model does not have; J > 0:
// it accelerates an inertia that it does not have. τ is searched for by correlation (the lag at
// which (1) without it leaves least), then fitted with the rest by Gauss and Newton.
//
// Standard errors are those of least squares with the correlation of e in time taken into account
// [Newey 1987], up to the lag at which it first vanishes; neighbouring samples of a log say almost
// the same, and the usual ones would be too small by far.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"
#include "math/profile.h"

namespace mbv {

/// One drive's force by log and model.
struct LogForce {
  std::vector<double> time_s;           ///< increasing; rows without a number are not in it
  std::vector<double> log;              ///< y [N or N m]
  const Piecewise* model = nullptr;     ///< m
  const Piecewise* velocity = nullptr;  ///< v and, as its rate, a
  double end_s = 0.0;                   ///< the model is known on 0 … end_s
  double size = 1.0;                    ///< LogAxis::size of the drive
};

/// A number of the fit.
struct LogTerm {
  enum class Kind { kGain, kOffset, kDelay, kCoulomb, kViscous, kInertia };
  Kind kind = Kind::kGain;
  double value = kNan, error = kNan;  ///< standard error
  double effect = 0.0;                ///< RMS of what it changes [N or N m]
  bool fitted = false;                ///< false: the log does not distinguish it from the others
  bool named = false;                 ///< beyond 3 standard errors and 0.5 % of the log's RMS

  [[nodiscard]] const char* word() const;  ///< "gain"
};

struct LogFit {
  size_t rows = 0;  ///< compared
  double rms_log = kNan, rms_model = kNan;
  double rms_difference = kNan;  ///< of y − m
  double bias = kNan;            ///< mean of y − m
  double correlation = kNan;     ///< of y and m
  size_t fit_rows = 0;           ///< that the fit takes: not near rest, not at the ends
  double rms_left = kNan;        ///< of e
  double rms_before = kNan;      ///< of y − m over the rows of the fit
  std::array<LogTerm, 6> terms = {};

  [[nodiscard]] const LogTerm& term(LogTerm::Kind kind) const {
    return terms[static_cast<size_t>(kind)];
  }
  /// RMS of y − m by that of y; NaN where the log is zero.
  [[nodiscard]] double share() const { return rms_difference / rms_log; }
};

/// Delays are searched for within ± `most_delay_s`.
[[nodiscard]] LogFit FitLogForce(const LogForce& force, double most_delay_s);

}  // namespace mbv
