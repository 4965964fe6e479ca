#include "simulation/sample_predictor.h"

#include <algorithm>
#include <cmath>

namespace mbv::simulation {
namespace {

// Gauss's five points and weights on [0, 1], exact to degree nine.
constexpr std::array<std::pair<double, double>, 5> kGauss = {{
    {0.5 - 0.45308992296933193, 0.11846344252809454},
    {0.5 - 0.26923465505284155, 0.23931433524968324},
    {0.5, 0.28444444444444444},
    {0.5 + 0.26923465505284155, 0.23931433524968324},
    {0.5 + 0.45308992296933193, 0.11846344252809454},
}};

// Of (2).
const std::array<double, 3> kPlaces = {0.5 - std::sqrt(0.15), 0.5, 0.5 + std::sqrt(0.15)};

// Adds Hermite's polynomials of the nodes 0, −1 … 1 − n at x: those of values and of derivatives.
template <typename Weights>
void AddHermite(int n, double x, double factor, Weights* weights) {
  for (int i = 0; i < n; ++i) {
    double lagrange = 1.0, slope = 0.0;
    for (int j = 0; j < n; ++j) {
      if (j == i) continue;
      lagrange *= (x + j) / (j - i);
      slope += 1.0 / (j - i);
    }
    const double square = factor * lagrange * lagrange, from = x + i;
    (*weights)[0][static_cast<size_t>(i)] += (1.0 - 2.0 * slope * from) * square;
    (*weights)[1][static_cast<size_t>(i)] += from * square;
  }
}

}  // namespace

SamplePredictor::SamplePredictor(const EngineModel& engine) : engine_(engine) {
  for (int n = 1; n <= kMost; ++n) {
    Rules& rules = rules_[static_cast<size_t>(n - 1)];
    rules = {};
    for (const auto& [x, weight] : kGauss) AddHermite(n, x, weight, &rules.mean);
    for (size_t i = 0; i < kPlaces.size(); ++i) AddHermite(n, kPlaces[i], 1.0, &rules.places[i]);
  }
}

void SamplePredictor::Remember(const mjData& d) {
  for (size_t i = kMost - 1; i > 0; --i) {
    v_[i].swap(v_[i - 1]);
    a_[i].swap(a_[i - 1]);
  }
  const int nv = engine_.m->nv;
  v_[0] = Eigen::Map<const VecX>(d.qvel, nv);
  a_[0] = Eigen::Map<const VecX>(d.qacc, nv);
  known_ = std::min(known_ + 1, kMost);
}

template <typename Out>
void SamplePredictor::Sum(const Weights& weights, double h, int first, int count, Out* sum) const {
  sum->setZero(count);
  for (size_t i = 0; i < static_cast<size_t>(known_); ++i) {
    *sum += weights[0][i] * v_[i].segment(first, count) +
            h * weights[1][i] * a_[i].segment(first, count);
  }
}

// What (2) adds to (1).
Vec3 SamplePredictor::Turn(double h, int dof) const {
  const Rules& rules = rules_[static_cast<size_t>(known_ - 1)];
  std::array<Vec3, 3> w;
  for (size_t i = 0; i < w.size(); ++i) Sum(rules.places[i], h, dof, 3, &w[i]);
  const Vec3 a_1 = h * w[1], a_2 = std::sqrt(15.0) / 3.0 * h * (w[2] - w[0]),
             a_3 = 10.0 / 3.0 * h * (w[2] - 2.0 * w[1] + w[0]);
  const Vec3 b = a_2.cross(a_1), c = (2.0 * a_3 + b).cross(a_1) / -60.0;
  return (a_2 + c).cross(b - 20.0 * a_1 - a_3) / 240.0;
}

void SamplePredictor::Predict(double h, mjData* d) {
  Remember(*d);
  const mjModel* m = engine_.m.get();
  Sum(rules_[static_cast<size_t>(known_ - 1)].mean, h, 0, m->nv, &u_);
  u_ *= h;
  for (int i = 0; i < m->nv; ++i) {
    if (engine_.dof_is_rotation3[static_cast<size_t>(i)]) u_.segment<3>(i) += Turn(h, i);
  }
  mj_integratePos(m, d->qpos, u_.data(), 1.0);
}

}  // namespace mbv::simulation
