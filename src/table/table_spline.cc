#include "table/table_spline.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbv {
namespace {

// More than half of what the interpolating spline's second derivative shows (mean square).
constexpr double kMostlyNoise = 0.5;
// What a round may jump by where it begins again, of the largest magnitude inside, beyond what the
// noise explains.
constexpr double kPositionJump = 1e-6, kRateJump = 1e-2, kAccelerationJump = 0.1;
constexpr double kNoiseAllowed = 4.0;  // deviations

class SplineMaker {
 public:
  SplineMaker(const RowsPlace& place, const SplineRows& rows, MotionTable* table)
      : place_(place), rows_(rows), table_(*table) {}

  bool Make() {
    if (table_.periodic && !CheckRounds()) return false;
    Fit();
    if (table_.moves) Doubt();
    return true;
  }

 private:
  // The end of a round against its start, by the spline that knows nothing of rounds.
  bool CheckRounds() {
    rounds_.periodic = true;
    const double step = rows_.values.back() - rows_.values.front();
    constexpr double kTurn = 2.0 * std::numbers::pi;
    if (table_.unit == "rad") rounds_.advance = kTurn * std::round(step / kTurn);
    const Piecewise smooth = Smoothed(rows_);
    const Jet noise = DifferenceOf(Interpolated(rows_), smooth, rows_.time_s).rms;
    const Jet size = SizeOf(smooth, rows_.time_s).max;
    const Jet start = Evaluate(smooth, table_.from_s), end = Evaluate(smooth, table_.to_s);
    const auto [low, high] = std::minmax_element(rows_.values.begin(), rows_.values.end());
    const bool value =
        Joins(Severity::kError, "value", "", step - rounds_.advance, rows_.values.front(),
              rows_.values.back(),
              kPositionJump * (*high - *low) + kNoiseAllowed * rows_.deviation + place_.step);
    const bool rate = Joins(Severity::kError, "rate", "/s", end.rate - start.rate, start.rate,
                            end.rate, kRateJump * size.rate + kNoiseAllowed * noise.rate);
    (void)Joins(Severity::kWarning, "acceleration", "/s²", end.acceleration - start.acceleration,
                start.acceleration, end.acceleration,
                kAccelerationJump * size.acceleration + kNoiseAllowed * noise.acceleration);
    return value && rate;
  }

  bool Joins(Severity severity, const char* what, const char* per, double jump, double start,
             double end, double allowed) {
    if (std::abs(jump) <= allowed) return true;
    place_.yaml->AddAt(
        severity, place_.csv.line, place_.csv.column,
        fmt::format("{}.periodic: the {} jumps by {:.4g} {}{} where {} begins again (from "
                    "{:.6g} to {:.6g}); at most {:.2g} is round-off or noise",
                    place_.path, what, -jump, table_.unit, per, place_.file, end, start, allowed),
        "the last row repeats the first one, a period later");
    return false;
  }

  void Fit() {
    const Piecewise through = Interpolated(rows_, rounds_), smooth = Smoothed(rows_, rounds_);
    const JetSize change = DifferenceOf(smooth, through, rows_.time_s);
    const Piecewise& used = table_.smoothed() ? smooth : through;
    table_.change_rms = change.rms.value;
    table_.change_max = change.max.value;
    table_.acceleration_change_rms = change.rms.acceleration;
    table_.acceleration_change_max = change.max.acceleration;
    table_.acceleration_rms = SizeOf(used, rows_.time_s).rms.acceleration;
    table_.interpolated = std::make_shared<const Piecewise>(through);
    table_.spline = std::make_shared<const Piecewise>(used);
  }

  void Doubt() {
    const double share = table_.noise_share();
    if (table_.smoothed() || share <= kMostlyNoise) return;
    place_.yaml->AddAt(
        Severity::kWarning, place_.csv.line, place_.csv.column,
        fmt::format("{}: the second derivative of {} is mostly noise: {:.0f} % of its mean "
                    "square vanish when {:.2g} {} of noise are smoothed away (RMS {:.3g} "
                    "of {:.3g} {}/s²)",
                    place_.path, place_.file, 100.0 * share, table_.deviation, table_.unit,
                    table_.acceleration_change_rms, table_.acceleration_rms, table_.unit),
        "drive forces follow it; smoothing: auto takes it out and says what that changes");
  }

  const RowsPlace& place_;
  const SplineRows& rows_;
  MotionTable& table_;
  Rounds rounds_;
};

}  // namespace

bool MakeSplines(const RowsPlace& place, const SplineRows& rows, MotionTable* table) {
  return SplineMaker(place, rows, table).Make();
}

}  // namespace mbv
