#include "simulation/sample_predictor.h"

#include <algorithm>

namespace mbv::simulation {

void SamplePredictor::Remember(const mjData& d) {
  for (size_t i = v_.size() - 1; i > 0; --i) {
    v_[i].swap(v_[i - 1]);
    a_[i].swap(a_[i - 1]);
  }
  const int nv = engine_.m->nv;
  v_[0] = Eigen::Map<const VecX>(d.qvel, nv);
  a_[0] = Eigen::Map<const VecX>(d.qacc, nv);
  known_ = std::min(known_ + 1, kMostRateSamples);
}

template <typename Out>
void SamplePredictor::Sum(const RateWeights& weights, double h, int first, int count,
                          Out* sum) const {
  sum->setZero(count);
  for (size_t i = 0; i < static_cast<size_t>(known_); ++i) {
    *sum += weights.of_v[i] * v_[i].segment(first, count) +
            h * weights.of_a[i] * a_[i].segment(first, count);
  }
}

Vec3 SamplePredictor::Turn(double h, int dof) const {
  std::array<Vec3, 3> w;
  for (size_t i = 0; i < w.size(); ++i) Sum(RateRulesOf(known_).places[i], h, dof, 3, &w[i]);
  return TurnOfAxes(h, w, false);
}

void SamplePredictor::Predict(double h, mjData* d) {
  Remember(*d);
  const mjModel* m = engine_.m.get();
  Sum(RateRulesOf(known_).mean, h, 0, m->nv, &u_);
  u_ *= h;
  for (int i = 0; i < m->nv; ++i) {
    if (engine_.dof_is_rotation3[static_cast<size_t>(i)]) u_.segment<3>(i) += Turn(h, i);
  }
  mj_integratePos(m, d->qpos, u_.data(), 1.0);
}

}  // namespace mbv::simulation
