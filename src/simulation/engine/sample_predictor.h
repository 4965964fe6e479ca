// Predicts the configuration at the next of equally spaced samples (math/rate_extrapolation.h).
#pragma once

#include "math/rate_extrapolation.h"
#include "simulation/engine/engine_model.h"

namespace mbv::simulation {

class SamplePredictor {
 public:
  /// The model outlives it.
  explicit SamplePredictor(const EngineModel& engine) : engine_(engine) {}

  /// Moves d.qpos to the next sample, h later, by the present d.qvel and d.qacc and those of the
  /// calls before.
  void Predict(double h, mjData* d);

 private:
  const EngineModel& engine_;
  int known_ = 0;
  RateHistory history_;
  VecX u_;
};

}  // namespace mbv::simulation
