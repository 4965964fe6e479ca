#include "scenario/tables/table_spline.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "math/quintic_spline.h"

namespace mbv {
namespace {

constexpr int kHalvings = 60;  // of the logarithm of λ: to 1e-15 of its range
constexpr int kLooks = 4;      // in each interval

// Three rounds of a periodic table, the middle one at its own times.
SplineRows Repeated(const SplineRows& rows, double advance) {
  SplineRows all{.deviation = rows.deviation,
                 .rate_deviation = rows.rate_deviation,
                 .stated = rows.stated,
                 .cutoff_hz = rows.cutoff_hz};
  const size_t last = rows.time_s.size() - 1;
  const double period_s = rows.time_s[last] - rows.time_s[0];
  const auto add = [&](size_t i, double time_s, double more) {
    all.time_s.push_back(time_s);
    all.values.push_back(rows.values[i] + more);
    if (!rows.rates.empty()) all.rates.push_back(rows.rates[i]);
  };
  for (const double round : {-1.0, 0.0, 1.0}) {
    for (size_t i = 0; i < last; ++i) {
      const bool seam = round == 1.0 && i == 0;
      add(i, seam ? rows.time_s[last] : rows.time_s[i] + round * period_s, round * advance);
    }
  }
  add(0, rows.time_s[last] + period_s, 2.0 * advance);
  return all;
}

// The part of a spline between two of its knots, as one round.
Piecewise Round(const Piecewise& all, double from_s, double to_s, double advance) {
  Piecewise round;
  round.outside = Piecewise::Outside::kRepeat;
  round.advance = advance;
  for (size_t i = 0; i < all.coefficients.size(); ++i) {
    if (all.knots[i] < from_s || all.knots[i] >= to_s) continue;
    round.knots.push_back(all.knots[i]);
    round.coefficients.push_back(all.coefficients[i]);
  }
  round.knots.push_back(to_s);
  return round;
}

class RowFit {
 public:
  explicit RowFit(const SplineRows& rows)
      : rows_(rows), knots_(FreeKnots(rows.time_s, !rows.rates.empty())) {
    const bool exact = rows.deviation <= 0.0 || (!rows.rates.empty() && rows.rate_deviation <= 0.0);
    const double weight = exact ? 1.0 : 1.0 / rows.deviation;
    const double rate_weight = exact ? 1.0 : 1.0 / rows.rate_deviation;
    for (size_t i = 0; i < rows.time_s.size(); ++i) {
      data_.push_back({rows.time_s[i], rows.values[i], 0, weight});
      if (!rows.rates.empty()) data_.push_back({rows.time_s[i], rows.rates[i], 1, rate_weight});
    }
    exact_ = exact;
  }

  [[nodiscard]] Piecewise Through() const { return FitSpline(knots_, data_); }

  [[nodiscard]] Piecewise Near(double* cutoff_hz) const {
    *cutoff_hz = rows_.cutoff_hz;
    if (rows_.cutoff_hz > 0.0) return FitSpline(knots_, data_, LambdaOf(rows_.cutoff_hz));
    *cutoff_hz = std::numeric_limits<double>::infinity();
    if (exact_) return Through();
    const double lambda = std::exp(rows_.stated ? Allowed() : CrossValidated());
    *cutoff_hz = CutoffOf(lambda);
    return FitSpline(knots_, data_, lambda);
  }

 private:
  static constexpr double kBeyond = 16.0;  // seven decades
  static constexpr int kGrid = 30;
  static constexpr double kParabola = 3.0;     // parameters of what ∫ f'''² leaves alone
  static constexpr double kTraceHolds = 0.02;  // parameters per datum
  static constexpr double kFewFree = 1e-3;     // of the data: (2) is 0/0 where all are met

  struct Span {
    double low, high;
  };

  // λ whose cut-off (3) this is.
  [[nodiscard]] double LambdaOf(double cutoff_hz) const {
    const double w = 2.0 * std::numbers::pi * cutoff_hz;
    const double rate_weight = rows_.rates.empty() ? 0.0 : data_[1].weight;
    const double whole_s = rows_.time_s.back() - rows_.time_s.front();
    const double step_s = whole_s / static_cast<double>(rows_.time_s.size() - 1);
    const double weight2 = data_[0].weight * data_[0].weight + rate_weight * rate_weight * w * w;
    return weight2 / (step_s * std::pow(w, 6));
  }

  // The inverse: λ falls with the cut-off.
  [[nodiscard]] double CutoffOf(double lambda) const {
    double low = -40.0, high = 40.0;  // of the logarithm of the frequency
    while (high - low > 1e-9) {
      const double middle = 0.5 * (low + high);
      (LambdaOf(std::exp(middle)) > lambda ? low : high) = middle;
    }
    return std::exp(low);
  }

  // Logarithms of λ between what deforms freely within the shortest step and what is a parabola
  // over all rows.
  [[nodiscard]] Span LambdaSpan() const {
    const double whole_s = rows_.time_s.back() - rows_.time_s.front();
    double shortest_s = whole_s;
    for (size_t i = 1; i < rows_.time_s.size(); ++i) {
      shortest_s = std::min(shortest_s, rows_.time_s[i] - rows_.time_s[i - 1]);
    }
    const double weight2 = data_[0].weight * data_[0].weight;
    const auto count = static_cast<double>(data_.size());
    return {std::log(weight2) + 5.0 * std::log(shortest_s) - kBeyond,
            std::log(count * weight2) + 5.0 * std::log(whole_s) + kBeyond};
  }

  // Reinsch's λ, by halving.
  [[nodiscard]] double Allowed() const {
    const auto allowed = static_cast<double>(data_.size());
    auto [low, high] = LambdaSpan();
    for (int k = 0; k < kHalvings && high - low > 1e-9; ++k) {
      const double middle = 0.5 * (low + high);
      (FitSmooth(knots_, data_, std::exp(middle)).misfit <= allowed ? low : high) = middle;
    }
    return low;
  }

  // The effective number of parameters where round-off leaves it: the trace loses its digits once
  // a datum counts for little, but there it follows λ^(-1/6) [Wahba 1990, ch. 4].
  struct Anchor {
    double log_lambda = 0.0, parameters = 0.0;
  };

  // (2), infinite where nothing is left to judge by; `anchor` moves to what is less than it.
  [[nodiscard]] double Score(double log_lambda, Anchor* anchor) const {
    const SplineFit fit = FitSmooth(knots_, data_, std::exp(log_lambda));
    const auto n = static_cast<double>(data_.size());
    double parameters = fit.parameters;
    const bool first = anchor->parameters == 0.0, beyond = log_lambda > anchor->log_lambda;
    const bool falls = first || !beyond || parameters < anchor->parameters;
    if (parameters >= kTraceHolds * n && falls) {
      if (first || beyond) *anchor = {log_lambda, parameters};
    } else {
      parameters = kParabola + (anchor->parameters - kParabola) *
                                   std::exp((anchor->log_lambda - log_lambda) / 6.0);
    }
    const double free = n - parameters;
    if (!(free > kFewFree * n)) return std::numeric_limits<double>::infinity();
    return n * fit.misfit / (free * free);
  }

  // The least of a grid, then by thirds around it.
  [[nodiscard]] double CrossValidated() const {
    const auto [low, high] = LambdaSpan();
    const double step = (high - low) / kGrid;
    double best = low, least = std::numeric_limits<double>::infinity();
    Anchor anchor;
    for (int k = 0; k <= kGrid; ++k) {
      const double score = Score(low + k * step, &anchor);
      if (!(score < least)) continue;
      least = score;
      best = low + k * step;
    }
    double a = best - step, b = best + step;
    while (b - a > 0.2) {
      const double c = a + (b - a) / 3.0, d = b - (b - a) / 3.0;
      const bool left = Score(c, &anchor) < Score(d, &anchor);
      (left ? b : a) = left ? d : c;
    }
    return 0.5 * (a + b);
  }

  const SplineRows& rows_;
  const std::vector<double> knots_;
  std::vector<SplineDatum> data_;
  bool exact_ = false;
};

// Through all rows without `cutoff_hz`.
Piecewise FitRows(const SplineRows& rows, const Rounds& rounds, double* cutoff_hz) {
  const bool smooth = cutoff_hz != nullptr;
  if (!rounds.periodic) return smooth ? RowFit(rows).Near(cutoff_hz) : RowFit(rows).Through();
  const SplineRows all = Repeated(rows, rounds.advance);
  const RowFit fit(all);
  return Round(smooth ? fit.Near(cutoff_hz) : fit.Through(), rows.time_s.front(),
               rows.time_s.back(), rounds.advance);
}

template <typename Look>
JetSize Sizes(const std::vector<double>& time_s, const Look& look) {
  JetSize size;
  double count = 0.0;
  for (size_t i = 0; i + 1 < time_s.size(); ++i) {
    for (int k = 0; k < kLooks; ++k, ++count) {
      const Jet jet = look(time_s[i] + (time_s[i + 1] - time_s[i]) * k / kLooks);
      for (double Jet::*part : {&Jet::value, &Jet::rate, &Jet::acceleration}) {
        size.rms.*part += jet.*part * jet.*part;
        size.max.*part = std::max(size.max.*part, std::abs(jet.*part));
      }
    }
  }
  for (double Jet::*part : {&Jet::value, &Jet::rate, &Jet::acceleration}) {
    size.rms.*part = std::sqrt(size.rms.*part / count);
  }
  return size;
}

}  // namespace

Piecewise Interpolated(const SplineRows& rows, const Rounds& rounds) {
  return FitRows(rows, rounds, nullptr);
}

Piecewise Smoothed(const SplineRows& rows, const Rounds& rounds, double* cutoff_hz) {
  double unwanted = 0.0;
  return FitRows(rows, rounds, cutoff_hz == nullptr ? &unwanted : cutoff_hz);
}

JetSize DifferenceOf(const Piecewise& a, const Piecewise& b, const std::vector<double>& time_s) {
  return Sizes(time_s, [&](double t) {
    const Jet x = Evaluate(a, t), y = Evaluate(b, t);
    return Jet{x.value - y.value, x.rate - y.rate, x.acceleration - y.acceleration};
  });
}

JetSize SizeOf(const Piecewise& a, const std::vector<double>& time_s) {
  return Sizes(time_s, [&](double t) { return Evaluate(a, t); });
}

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
    if (table_.moves) EstimateErrors();
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
    double cutoff_hz = kNan;
    const Piecewise through = Interpolated(rows_, rounds_);
    const Piecewise smooth = Smoothed(rows_, rounds_, &cutoff_hz);
    const JetSize change = DifferenceOf(smooth, through, rows_.time_s);
    const Piecewise& used = table_.smoothed() ? smooth : through;
    if (table_.smoothed() && std::isfinite(cutoff_hz)) table_.cutoff_hz = cutoff_hz;
    table_.change_rms = change.rms.value;
    table_.change_max = change.max.value;
    table_.acceleration_change_rms = change.rms.acceleration;
    table_.acceleration_change_max = change.max.acceleration;
    table_.acceleration_rms = SizeOf(used, rows_.time_s).rms.acceleration;
    table_.interpolated = std::make_shared<const Piecewise>(through);
    table_.spline = std::make_shared<const Piecewise>(used);
  }

  void EstimateErrors() {
    const double share = table_.noise_share();
    if (table_.smoothed() || share <= kMostlyNoise) return;
    place_.yaml->AddAt(
        Severity::kWarning, place_.csv.line, place_.csv.column,
        fmt::format("{}: the second derivative of {} is mostly noise: {:.0f} % of its mean square "
                    "vanish when {:.2g} {} of noise are smoothed away (RMS {:.3g} of {:.3g} {}/s²)",
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
