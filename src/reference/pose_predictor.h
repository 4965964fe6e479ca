// Where all bodies will be at the next sample of a motion. Internal to reference/.
//
// From twists V and accelerations A of the last samples, h apart, the mean twist over the next step
// by the polynomial through one, two or three of them (n: now):
//   V̄ = V_n + h/2 A_n                                                                          (1)
//   V̄ = ½ (3 V_{n−1} − V_n) + h/12 (17 A_n + 7 A_{n−1})                                         (2)
//   V̄ = 1/240 (−949 V_n + 608 V_{n−1} + 581 V_{n−2}) + h/240 (637 A_n + 1080 A_{n−1} + 173 A_{n−2})
//                                                                                              (3)
// and the rotation vector h ω̄ + h²/12 ω_{n+1} × ω_n, ω_{n+1} ≈ ω_n + h ε_n [Iserles et al. 2000].
#pragma once

#include <array>

#include "mechanism/body_states.h"

namespace mbv::internal {

class PosePredictor {
 public:
  explicit PosePredictor(double length) : length_(length) {}

  /// States of a sample, with twists and accelerations.
  void Remember(double time_s, const BodyStates& states);
  /// Twists times dt, stacked, from the sample remembered last to dt later, > 0; by as many samples
  /// as lie dt apart and agree with (1).
  [[nodiscard]] VecX Predict(double dt_s) const;
  [[nodiscard]] double last_s() const { return samples_[0].time_s; }

 private:
  struct Sample {
    double time_s = kNan;
    VecX V, A;
  };
  [[nodiscard]] int Usable(double dt_s) const;

  double length_;
  std::array<Sample, 3> samples_;  ///< newest first
};

}  // namespace mbv::internal
