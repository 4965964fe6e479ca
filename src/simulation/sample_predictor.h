// Predicts the configuration at the next of equally spaced samples, a time h apart.
//
// With the polynomial p through velocities and accelerations of the last n samples, of degree
// 2n − 1 in the time x since the last one in units of h, the displacement is
//   u = h ∫₀¹ p dx                                                                              (1)
// and of a rotation with angular velocities ω₁, ω₂, ω₃ = p(½ − √15/10), p(½), p(½ + √15/10) in its
// own axes
//   α₁ = h ω₂,  α₂ = √15/3 h (ω₃ − ω₁),  α₃ = 10/3 h (ω₃ − 2 ω₂ + ω₁),  β = α₂ × α₁,
//   u = h ∫₀¹ p dx + 1/240 (α₂ + γ) × (β − 20 α₁ − α₃),  γ = −1/60 (2 α₃ + β) × α₁ (2)
// Source: Blanes, Casas, Oteo, Ros: The Magnus expansion and some of its applications, Physics
// Reports 470 (2009), the expansion of sixth order, with the commutators of axes that turn.
#pragma once

#include <array>

#include "simulation/engine_model.h"

namespace mbv::simulation {

class SamplePredictor {
 public:
  /// The model outlives it.
  explicit SamplePredictor(const EngineModel& engine);

  /// Moves d.qpos to the next sample, by the present d.qvel and d.qacc and those of the calls
  /// before.
  void Predict(double h, mjData* d);

 private:
  static constexpr int kMost = 5;  // samples
  /// Of velocities, newest first, and of accelerations times h.
  using Weights = std::array<std::array<double, kMost>, 2>;
  void Remember(const mjData& d);
  template <typename Out>
  void Sum(const Weights& weights, double h, int first, int count, Out* sum) const;
  [[nodiscard]] Vec3 Turn(double h, int dof) const;

  const EngineModel& engine_;
  int known_ = 0;
  std::array<VecX, kMost> v_, a_;  // newest first
  // Per number of samples less one.
  struct Rules {
    Weights mean;
    std::array<Weights, 3> places;  // of (2)
  };
  std::array<Rules, kMost> rules_;
  VecX u_;
};

}  // namespace mbv::simulation
