// The home pose: where all loops close, solved from the joint guesses.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// Gap of one loop closure at the end of the home solution.
struct LoopGap {
  int joint = -1;              ///< index of the closure joint
  double position_m = kNan;    ///< largest translation row
  double rotation_rad = kNan;  ///< largest rotation row (direction cosine ≈ rad)
};

struct HomeResult {
  bool closed = false;
  int iterations = 0;
  double gap = kNan;           ///< largest row of all closures [m or ≈ rad]
  double gap_at_guess = kNan;  ///< the same at the joint guesses
  std::vector<LoopGap> gaps;   ///< per closure joint, worst first

  /// One line for people: "loop at limb1.S is open by 0.12 m, 0.3 rad; …" (at most three loops).
  [[nodiscard]] std::string Text(const Mechanism& mechanism) const;
};

/// Loop closure tolerance of the home pose [m or rad].
inline constexpr double kHomeTolerance = 1e-12;

/// Solves all loop closures by damped minimum-norm Newton steps in the coordinates of the spanning
/// tree (BuildSpanningTree first), from Joint::guess; among the poses that close, one near the
/// guesses is found. Fills X_WB_home and Joint::home of every joint, closures included (angles
/// within π of their guess), with the best pose found even if the loops do not close.
HomeResult SolveHome(Mechanism* mechanism);

/// Joint coordinates of every joint at given body poses; angles within π of `near[joint]`.
[[nodiscard]] std::vector<std::array<double, 6>> JointCoordinatesAt(
    const Mechanism& mechanism, const std::vector<Pose>& X_WB,
    const std::vector<std::array<double, 6>>& near);

}  // namespace mbv
