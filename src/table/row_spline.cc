#include "table/row_spline.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/quintic_spline.h"

namespace mbv {
namespace {

constexpr int kHalvings = 60;  // of the logarithm of λ: to 1e-15 of its range
constexpr int kLooks = 4;      // in each interval

// Three rounds of a periodic table, the middle one at its own times.
SplineRows Repeated(const SplineRows& rows, double advance) {
  SplineRows all{
      .deviation = rows.deviation, .rate_deviation = rows.rate_deviation, .stated = rows.stated};
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

  [[nodiscard]] Piecewise Near() const {
    if (exact_) return Through();
    return FitSpline(knots_, data_, std::exp(rows_.stated ? Allowed() : CrossValidated()));
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

  // Logarithms of λ between what bends freely within the shortest step and what is a parabola over
  // all rows.
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

Piecewise FitRows(const SplineRows& rows, const Rounds& rounds, bool smooth) {
  if (!rounds.periodic) return smooth ? RowFit(rows).Near() : RowFit(rows).Through();
  const SplineRows all = Repeated(rows, rounds.advance);
  const RowFit fit(all);
  return Round(smooth ? fit.Near() : fit.Through(), rows.time_s.front(), rows.time_s.back(),
               rounds.advance);
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
  return FitRows(rows, rounds, false);
}

Piecewise Smoothed(const SplineRows& rows, const Rounds& rounds) {
  return FitRows(rows, rounds, true);
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

}  // namespace mbv
