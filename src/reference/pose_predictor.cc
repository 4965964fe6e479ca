#include "reference/pose_predictor.h"

#include <algorithm>
#include <cmath>
#include <utility>

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
  for (size_t i = samples_.size() - 1; i > 0; --i) std::swap(samples_[i], samples_[i - 1]);
  samples_[0].time_s = time_s;
  samples_[0].V = Stack(states.V_WB);
  samples_[0].A = Stack(states.A_WB);
}

int PosePredictor::Usable(double dt_s) const {
  size_t usable = 1;
  while (usable < samples_.size()) {
    const double apart = samples_[usable - 1].time_s - samples_[usable].time_s;
    if (!(std::abs(apart - dt_s) <= kEqual * dt_s)) break;
    ++usable;
  }
  return static_cast<int>(usable);
}

template <typename Out>
void PosePredictor::Sum(int samples, const RateWeights& weights, double h, Eigen::Index first,
                        Eigen::Index count, Out* sum) const {
  sum->setZero(count);
  for (size_t i = 0; i < static_cast<size_t>(samples); ++i) {
    *sum += weights.of_v[i] * samples_[i].V.segment(first, count) +
            h * weights.of_a[i] * samples_[i].A.segment(first, count);
  }
}

void PosePredictor::Predict(double h) {
  const Eigen::Index size = samples_[0].V.size();
  int samples = Usable(h);
  Sum(1, RateRulesOf(1).mean, h, 0, size, &by_one_);
  Sum(samples, RateRulesOf(samples).mean, h, 0, size, &step_);
  step_ *= h;
  by_one_ *= h;
  by_one_ -= step_;
  if (!(SizeOf(by_one_, length_) < kBelieved)) {
    step_ += by_one_;
    samples = 1;
  }
  const RateRules& rules = RateRulesOf(samples);
  Sum(samples, rules.end, h, 0, size, &V_);
  Sum(samples, rules.end_slope, h, 0, size, &A_);
  A_ /= h;
  std::array<Vec3, 3> w;
  for (Eigen::Index i = 0; i < size; i += 6) {
    for (size_t k = 0; k < w.size(); ++k) Sum(samples, rules.places[k], h, i, 3, &w[k]);
    step_.segment<3>(i) += TurnOfAxes(h, w, true);
  }
}

}  // namespace mbv::internal
