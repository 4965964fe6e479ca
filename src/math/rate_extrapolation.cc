#include "math/rate_extrapolation.h"

#include <algorithm>
#include <cmath>

#include "base/demand.h"

namespace mbv {
namespace {

// Gauss's five points and weights on [0, 1], exact to degree nine.
constexpr std::array<std::pair<double, double>, 5> kFivePoints = {{
    {0.5 - 0.45308992296933193, 0.11846344252809454},
    {0.5 - 0.26923465505284155, 0.23931433524968324},
    {0.5, 0.28444444444444444},
    {0.5 + 0.26923465505284155, 0.23931433524968324},
    {0.5 + 0.45308992296933193, 0.11846344252809454},
}};

// Adds Hermite's polynomials of the nodes 0, −1 … 1 − n at x > 0, those of values and of
// derivatives, and their slopes.
void AddHermite(int n, double x, double factor, RateWeights* weights, RateWeights* slopes) {
  for (int i = 0; i < n; ++i) {
    double lagrange = 1.0, at_node = 0.0, at_x = 0.0;
    for (int j = 0; j < n; ++j) {
      if (j == i) continue;
      lagrange *= (x + j) / (j - i);
      at_node += 1.0 / (j - i);
      at_x += 1.0 / (x + j);
    }
    const double square = factor * lagrange * lagrange, slope = 2.0 * square * at_x, from = x + i;
    const double line = 1.0 - 2.0 * at_node * from;
    const auto k = static_cast<size_t>(i);
    weights->of_v[k] += line * square;
    weights->of_a[k] += from * square;
    slopes->of_v[k] += line * slope - 2.0 * at_node * square;
    slopes->of_a[k] += from * slope + square;
  }
}

RateRules MakeRules(int n) {
  RateRules rules;
  RateWeights unused;
  for (const auto& [x, weight] : kFivePoints) AddHermite(n, x, weight, &rules.mean, &unused);
  AddHermite(n, 1.0, 1.0, &rules.end, &rules.end_slope);
  const double apart = std::sqrt(0.15);
  for (size_t i = 0; i < 3; ++i) {
    AddHermite(n, 0.5 + apart * (static_cast<double>(i) - 1.0), 1.0, &rules.places[i], &unused);
  }
  return rules;
}

}  // namespace

const RateRules& RateRulesOf(int samples) {
  static const std::array<RateRules, kMostRateSamples> kRules = {
      MakeRules(1), MakeRules(2), MakeRules(3), MakeRules(4), MakeRules(5)};
  MBV_DEMAND(samples >= 1 && samples <= kMostRateSamples, samples);
  return kRules[static_cast<size_t>(samples - 1)];
}

Vec3 TurnOfAxes(double h, const std::array<Vec3, 3>& w, bool fixed_in_space) {
  const auto bracket = [&](const Vec3& x, const Vec3& y) {
    return Vec3(fixed_in_space ? x.cross(y) : y.cross(x));
  };
  const Vec3 a_1 = h * w[1], a_2 = std::sqrt(15.0) / 3.0 * h * (w[2] - w[0]),
             a_3 = 10.0 / 3.0 * h * (w[2] - 2.0 * w[1] + w[0]);
  const Vec3 b = bracket(a_1, a_2), c = bracket(a_1, 2.0 * a_3 + b) / -60.0;
  return bracket(b - 20.0 * a_1 - a_3, a_2 + c) / 240.0;
}

void RateHistory::Remember(const Eigen::Ref<const VecX>& v, const Eigen::Ref<const VecX>& a) {
  std::rotate(samples_.begin(), samples_.end() - 1, samples_.end());
  samples_[0].v = v;
  samples_[0].a = a;
}

Vec3 RateHistory::Turn(int n, double h, Eigen::Index first, bool fixed_in_space) const {
  std::array<Vec3, 3> w;
  for (size_t i = 0; i < w.size(); ++i) Sum(n, RateRulesOf(n).places[i], h, first, 3, &w[i]);
  return TurnOfAxes(h, w, fixed_in_space);
}

}  // namespace mbv
