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
  std::rotate(samples_.begin(), samples_.end() - 1, samples_.end());
  samples_[0] = {time_s, Stack(states.V_WB), Stack(states.A_WB)};
}

int PosePredictor::Usable(double dt_s) const {
  int usable = 1;
  while (usable < 3) {
    const double apart = samples_[usable - 1].time_s - samples_[usable].time_s;
    if (!(std::abs(apart - dt_s) <= kEqual * dt_s)) break;
    ++usable;
  }
  return usable;
}

VecX PosePredictor::Predict(double h) const {
  const auto& [now, before, first] = samples_;
  const VecX by_one = h * (now.V + 0.5 * h * now.A);
  VecX step = by_one;
  switch (Usable(h)) {
    case 2:
      step = h * (1.5 * before.V - 0.5 * now.V) + h * h / 12.0 * (17.0 * now.A + 7.0 * before.A);
      break;
    case 3:
      step = h / 240.0 * (-949.0 * now.V + 608.0 * before.V + 581.0 * first.V) +
             h * h / 240.0 * (637.0 * now.A + 1080.0 * before.A + 173.0 * first.A);
      break;
    default:
      break;
  }
  if (!(SizeOf(step - by_one, length_) < kBelieved)) return by_one;
  for (Eigen::Index i = 0; i < step.size(); i += 6) {
    const Vec3 w = now.V.segment<3>(i);
    step.segment<3>(i) += h * h * h / 12.0 * now.A.segment<3>(i).cross(w);
  }
  return step;
}

}  // namespace mbv::internal
