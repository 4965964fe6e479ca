// Simulated torques against an equation of motion.
#pragma once

#include <algorithm>
#include <cmath>

#include "simulation/engine/simulation.h"

namespace mbv::fixtures {

/// Largest error of the torque of drive "motor", which `driven` moves, over the largest torque;
/// `truth` knows the equation of motion: Torque(position, velocity, acceleration).
template <typename Driven, typename Truth>
double TorqueError(const SimulationRun& run, const Driven& driven, const Truth& truth) {
  const int column = run.trace.Find("motor.force");
  double error = 0.0, size = 0.0;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    DrivenSample at;
    (void)driven(run.trace.time_s[i], &at);
    const double torque = truth.Torque(at.position[0], at.velocity[0], at.acceleration[0]);
    error =
        std::max(error, std::abs(run.trace.values(static_cast<Eigen::Index>(i), column) - torque));
    size = std::max(size, std::abs(torque));
  }
  return error / size;
}

}  // namespace mbv::fixtures
