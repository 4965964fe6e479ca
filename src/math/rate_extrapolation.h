// From rates at equally spaced samples to the way to the next one, a time h later.
//
// p is the polynomial through velocities and accelerations of the last n samples, of degree 2n − 1
// in the time x since the last one in units of h. The displacement is
//   u = h ∫₀¹ p dx                                                                              (1)
// and of a rotation with angular velocities ω₁, ω₂, ω₃ = p(½ − √15/10), p(½), p(½ + √15/10)
//   α₁ = h ω₂,  α₂ = √15/3 h (ω₃ − ω₁),  α₃ = 10/3 h (ω₃ − 2 ω₂ + ω₁),
//   β = [α₁, α₂],  γ = −1/60 [α₁, 2 α₃ + β],  u = h ∫₀¹ p dx + 1/240 [β − 20 α₁ − α₃, α₂ + γ] (2)
// with [x, y] = x × y in axes fixed in space and y × x in axes that turn with the body.
// Source: Blanes, Casas, Oteo, Ros: The Magnus expansion and some of its applications, Physics
// Reports 470 (2009), the expansion of sixth order.
#pragma once

#include <array>

#include "base/types.h"

namespace mbv {

inline constexpr int kMostRateSamples = 5;

/// Factors of velocities, newest first, and of accelerations times h.
struct RateWeights {
  std::array<double, kMostRateSamples> of_v{}, of_a{};
};
struct RateRules {
  RateWeights mean;                   ///< ∫₀¹ p dx
  RateWeights end, end_slope;         ///< p(1), p'(1)
  std::array<RateWeights, 3> places;  ///< of (2)
};

/// Of n = 1 … kMostRateSamples samples.
[[nodiscard]] const RateRules& RateRulesOf(int samples);

/// What (2) adds to (1).
[[nodiscard]] Vec3 TurnOfAxes(double h, const std::array<Vec3, 3>& w, bool fixed_in_space);

/// Rates of the last samples.
class RateHistory {
 public:
  /// Velocities and accelerations of the newest sample, in the space of the oldest.
  void Remember(const Eigen::Ref<const VecX>& v, const Eigen::Ref<const VecX>& a);
  [[nodiscard]] Eigen::Index size() const { return samples_[0].v.size(); }  ///< of a sample
  /// Of `count` coordinates from `first`, by the n newest samples.
  template <typename Out>
  void Sum(int n, const RateWeights& weights, double h, Eigen::Index first, Eigen::Index count,
           Out* sum) const {
    sum->setZero(count);
    for (size_t i = 0; i < static_cast<size_t>(n); ++i) {
      *sum += weights.of_v[i] * samples_[i].v.segment(first, count) +
              h * weights.of_a[i] * samples_[i].a.segment(first, count);
    }
  }
  /// TurnOfAxes() of three coordinates.
  [[nodiscard]] Vec3 Turn(int n, double h, Eigen::Index first, bool fixed_in_space) const;

 private:
  struct Sample {
    VecX v, a;
  };
  std::array<Sample, kMostRateSamples> samples_;  // newest first
};

}  // namespace mbv
