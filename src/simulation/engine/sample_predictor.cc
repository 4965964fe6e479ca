#include "simulation/engine/sample_predictor.h"

#include <algorithm>

namespace mbv::simulation {

void SamplePredictor::Predict(double h, mjData* d) {
  const mjModel* m = engine_.m.get();
  history_.Remember(Eigen::Map<const VecX>(d->qvel, m->nv), Eigen::Map<const VecX>(d->qacc, m->nv));
  known_ = std::min(known_ + 1, kMostRateSamples);
  history_.Sum(known_, RateRulesOf(known_).mean, h, 0, m->nv, &u_);
  u_ *= h;
  for (int i = 0; i < m->nv; ++i) {
    if (!engine_.dof_is_rotation3[static_cast<size_t>(i)]) continue;
    u_.segment<3>(i) += history_.Turn(known_, h, i, false);
  }
  mj_integratePos(m, d->qpos, u_.data(), 1.0);
}

}  // namespace mbv::simulation
