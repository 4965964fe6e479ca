#include "reference/pose_predictor.h"

#include <algorithm>
#include <cmath>

#include "reference/square_system.h"

namespace mbv::internal {
namespace {

// Samples lie at equal distances to this share of one.
constexpr double kEqual = 1e-6;
// Higher order is believed where it changes a pose by less than this [rad, characteristic lengths]:
// farther, samples lie too far apart, or something happened between them.
constexpr double kBelieved = 0.02;

}  // namespace

void PosePredictor::Remember(double time_s, const BodyStates& states) {
  std::rotate(times_s_.begin(), times_s_.end() - 1, times_s_.end());
  times_s_[0] = time_s;
  Stack(states.V_WB, &V_);
  Stack(states.A_WB, &A_);
  history_.Remember(V_, A_);
}

int PosePredictor::Usable(double dt_s) const {
  size_t usable = 1;
  while (usable < times_s_.size()) {
    const double apart = times_s_[usable - 1] - times_s_[usable];
    if (!(std::abs(apart - dt_s) <= kEqual * dt_s)) break;
    ++usable;
  }
  return static_cast<int>(usable);
}

void PosePredictor::Predict(double h) {
  const Eigen::Index size = history_.size();
  int samples = Usable(h);
  history_.Sum(1, RateRulesOf(1).mean, h, 0, size, &by_one_);
  history_.Sum(samples, RateRulesOf(samples).mean, h, 0, size, &step_);
  step_ *= h;
  by_one_ *= h;
  by_one_ -= step_;
  if (!(SizeOf(by_one_, length_) < kBelieved)) {
    step_ += by_one_;
    samples = 1;
  }
  history_.Sum(samples, RateRulesOf(samples).end, h, 0, size, &V_);
  history_.Sum(samples, RateRulesOf(samples).end_slope, h, 0, size, &A_);
  A_ /= h;
  for (Eigen::Index i = 0; i < size; i += 6) {
    step_.segment<3>(i) += history_.Turn(samples, h, i, true);
  }
}

}  // namespace mbv::internal
