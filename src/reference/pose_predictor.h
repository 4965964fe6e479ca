// Where all bodies will be at the next sample of a motion, and how they will move there
// (math/rate_extrapolation.h). Internal to reference/.
#pragma once

#include <array>

#include "math/rate_extrapolation.h"
#include "mechanism/motion.h"

namespace mbv::internal {

class PosePredictor {
 public:
  explicit PosePredictor(double length) : length_(length) { times_s_.fill(kNan); }

  /// States of a sample, with twists and accelerations.
  void Remember(double time_s, const BodyStates& states);
  /// From the sample remembered last to dt later, > 0; by as many samples as lie dt apart and agree
  /// with the last one alone.
  void Predict(double dt_s);
  /// Twists times dt, stacked.
  [[nodiscard]] const VecX& step() const { return step_; }
  /// Twists and accelerations there, stacked.
  [[nodiscard]] const VecX& V() const { return V_; }
  [[nodiscard]] const VecX& A() const { return A_; }
  [[nodiscard]] double last_s() const { return times_s_[0]; }

 private:
  [[nodiscard]] int Usable(double dt_s) const;

  double length_;
  std::array<double, kMostRateSamples> times_s_;  ///< newest first
  RateHistory history_;
  VecX step_, by_one_, V_, A_;
};

}  // namespace mbv::internal
