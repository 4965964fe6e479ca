// Predicts the configuration at the next of equally spaced samples (core/rate_extrapolation.h).
#pragma once

#include <array>

#include "core/rate_extrapolation.h"
#include "simulation/engine_model.h"

namespace mbv::simulation {

class SamplePredictor {
 public:
  /// The model outlives it.
  explicit SamplePredictor(const EngineModel& engine) : engine_(engine) {}

  /// Moves d.qpos to the next sample, h later, by the present d.qvel and d.qacc and those of the
  /// calls before.
  void Predict(double h, mjData* d);

 private:
  void Remember(const mjData& d);
  template <typename Out>
  void Sum(const RateWeights& weights, double h, int first, int count, Out* sum) const;
  [[nodiscard]] Vec3 Turn(double h, int dof) const;

  const EngineModel& engine_;
  int known_ = 0;
  std::array<VecX, kMostRateSamples> v_, a_;  // newest first
  VecX u_;
};

}  // namespace mbv::simulation
