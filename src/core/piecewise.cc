#include "core/piecewise.h"

#include <algorithm>
#include <cmath>

namespace mbv {

Jet Evaluate(const Piecewise::Polynomial& c, double x) {
  // Horner's rule for the value and, along with it, its two derivatives.
  double value = 0.0, rate = 0.0, half = 0.0;
  for (int k = Piecewise::kDegree; k >= 0; --k) {
    half = half * x + rate;
    rate = rate * x + value;
    value = value * x + c[static_cast<size_t>(k)];
  }
  return {value, rate, 2.0 * half};
}

Jet Evaluate(const Piecewise& pieces, double t_s) {
  double t = t_s, added = 0.0;
  if (pieces.outside == Piecewise::Outside::kRepeat) {
    const double period_s = pieces.end_s() - pieces.start_s();
    const double rounds = std::floor((t_s - pieces.start_s()) / period_s);
    t -= rounds * period_s;
    added = rounds * pieces.advance;
  }
  const auto above = std::upper_bound(pieces.knots.begin() + 1, pieces.knots.end() - 1, t);
  const auto i = static_cast<size_t>(above - pieces.knots.begin()) - 1;
  const bool held = pieces.outside == Piecewise::Outside::kHold;
  const double inside = held ? std::clamp(t, pieces.start_s(), pieces.end_s()) : t;
  Jet jet = Evaluate(pieces.coefficients[i], inside - pieces.knots[i]);
  if (inside != t) jet.rate = jet.acceleration = 0.0;
  jet.value += added;
  return jet;
}

}  // namespace mbv
