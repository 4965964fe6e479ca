// How well a mechanism moves and carries at the poses of a set.
//
//   K = W D⁻¹        twist of the output by the drives' rates: W, D per rate of the coordinates (1)
//   v = K ṁ, |ṁ_i| ≤ s_i: a zonotope; its inscribed sphere is the least speed in every direction,
//       its farthest corner the largest [Fukuda 2004; Krut 2004] (2)
//   τ = Kᵀ w, |τ_i| ≤ t_i: a polytope of forces at the output's origin, the same of moments (3)
//   V(y)² = mean of |v|² over the points where joints hold the output's body, ṁ(y) with angles
//       by the characteristic length: type-2 distance min |ṁ|/V; type-1 distance min |ẋ|/|ṁ| with
//       the set's coordinates x, angles by that length, too                                    (4)
//   M_d = D⁻ᵀ M D⁻¹   mass matrix as the drives feel it                                      (5)
//   det(K_y − ω² M) = 0, K_y = ∂(forces at rest by the motions)/∂y + Dᵀ k D, k of the servos (6)
//   |τ_g + m Kᵀ g| ≤ t: the payload m at the output's origin that motors hold                 (7)
//   More drives than degrees of freedom: speeds {W y : |D y| ≤ s}; forces that some τ holds,
//   Wᵀ w ∈ {Dᵀτ : |τ| ≤ t}, a zonotope: |wᵀ W y_k| ≤ Σ t_i |D_i y_k| by its facets' normals y_k
//   [Bouchard, Gosselin, Moore 2010]; its load in (7) likewise                               (8)
//   W_t K_y⁻¹ W_tᵀ    compliance of the output's origin                                      (9)
//
// The type-2 distance measures points of the body alone: it depends on no frame [Voglewede,
// Ebert-Uphoff 2005].
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "features/workspace/reachable_set.h"

namespace mbv {

struct QualityIndex {
  std::string name;   ///< "condition"
  std::string unit;   ///< "1", "m/s" …
  std::string about;  ///< a sentence
  bool low_is_bad = true;
  double mean = kNan, mean_error = kNan;  ///< over the set; what every second pose changes
  double least = kNan, most = kNan;
  Vec3 least_at = Vec3::Constant(kNan), most_at = Vec3::Constant(kNan);
};

struct QualityMap {
  std::string output;
  std::vector<QualityIndex> indices;
  std::vector<size_t> points;       ///< of FloodedSet::lattice
  std::vector<VecX> values;         ///< per point and index; NaN where it is not defined
  std::vector<TracedArc> singular;  ///< type-2 curves inside a set of two dimensions
  size_t missed = 0;                ///< poses that have no values
  std::string why_none;             ///< no map, and why
};

[[nodiscard]] QualityMap MapQuality(const SetQuestion& question, const ReachableSet& set,
                                    const std::string& output, int threads,
                                    const std::function<void(double)>& progress = {});

}  // namespace mbv
