// How well a mechanism moves and carries at the poses of a set.
//
//   K = W D⁻¹        twist of the output by the drives' rates: W, D per rate of the coordinates (1)
//   v = K ṁ, |ṁ_i| ≤ s_i: a zonotope; its inscribed sphere is the least speed in every direction,
//       its farthest corner the largest [Fukuda 2004; Krut 2004] (2)
//   τ = Kᵀ w, |τ_i| ≤ t_i: a polytope of forces at the output's origin, the same of moments (3)
//   distances from singular poses: kinematics/singularity.h, of the set's coordinates, free and
//       held                                                                                  (4)
//   M_d = D⁻ᵀ M D⁻¹   mass matrix as the drives feel it                                      (5)
//   det(K_y − ω² M) = 0, K_y = ∂(forces at rest by the motions)/∂y + Dᵀ k D, k of the servos (6)
//   |τ_g + m Kᵀ g| ≤ t: the payload m at the output's origin that motors hold                 (7)
//   More drives than degrees of freedom: speeds {W y : |D y| ≤ s}; forces that some τ holds,
//   Wᵀ w ∈ {Dᵀτ : |τ| ≤ t}, a zonotope: |wᵀ W y_k| ≤ Σ t_i |D_i y_k| by its facets' normals y_k
//   [Bouchard, Gosselin, Moore 2010]; its load in (7) likewise                               (8)
//   W_t K_y⁻¹ W_tᵀ    compliance of the output's origin; of elastic bodies that of their frame
//       (reference/frame_stiffness.h)                                                          (9)
//   sin μ_i = |f_i·v_P| / |f_i||v_P|: transmission angle of drive i, 90° less the pressure angle
//       between the force f_i by which its limb holds the output's body at P and the velocity of P
//       while the other drives rest [Alt 1932; Wang, Wu, Liu 2010]                            (10)
//
// f_i: a limb is a single chain from the base to the output's body with one drive; the wrench that
// it transmits does no work on its passive joints. Where that is a moment, too, there is no angle.
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
  std::vector<size_t> points;        ///< of FloodedSet::lattice
  std::vector<VecX> values;          ///< per point and index; NaN where it is not defined
  std::vector<TracedArc> singular;   ///< type-2 curves inside a set of two dimensions
  size_t missed = 0;                 ///< poses that have no values
  std::vector<std::string> no_limb;  ///< drives without a limb of (10)
  std::string why_none;              ///< no map, and why
};

[[nodiscard]] QualityMap MapQuality(const SetQuestion& question, const ReachableSet& set,
                                    const std::string& output, int threads,
                                    const std::function<void(double)>& progress = {});

}  // namespace mbv
