// Loads of a stiffness scenario: wrenches [m; f] on the output, about its origin, world axes.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types.h"

namespace mbv {

/// Random wrenches that every computer draws alike. Each number is
///   x ← 6364136223846793005 x + 1442695040888963407 mod 2⁶⁴,  u = (x >> 11) 2⁻⁵³ in [0, 1),
/// starting at x = seed; one wrench takes six: Fx, Fy, Fz = force_max·u, Mx, My, Mz = moment_max·u.
struct RandomLoads {
  int count = 50;  ///< > 0
  std::uint64_t seed = 20250201;
  double force_max = 1000.0;  ///< [N], >= 0
  double moment_max = 1.0;    ///< [N m], >= 0
};

[[nodiscard]] std::vector<Vec6> DrawLoads(const RandomLoads& loads);

}  // namespace mbv
