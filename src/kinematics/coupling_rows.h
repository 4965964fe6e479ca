// Couplings of joint coordinates as constraint rows.
//
// The row Σ_k P_k(q_k) + constant = 0 is differentiated as
//   ṙ = Σ_k P_k′ q̇_k,  r̈ = Σ_k (P_k′ q̈_k + P_k″ q̇_k²).
#pragma once

#include <array>
#include <set>
#include <utility>
#include <vector>

#include "kinematics/constraints.h"

namespace mbv {

/// A coupling's row: the sum of its pieces.
struct CouplingRow {
  std::vector<ScalarRow> pieces;    ///< per term; the constant is in the first
  std::vector<double> coordinates;  ///< per term: q_k, which counts turns
  bool angular = true;              ///< all coordinates are angles
  double value = 0.0;               ///< of the sum: in the unit of the coordinates

  [[nodiscard]] double LargestPiece() const;  ///< |P_k(q_k)|, which the sum's rounding follows
};

/// The rows of all couplings at poses, with velocities for the bias, in the turns that
/// `states.coupled` tells.
[[nodiscard]] std::vector<CouplingRow> CouplingRows(const Mechanism& mechanism,
                                                    const BodyStates& states);

/// The same, and brings `states->coupled` to the poses, which lie within half a turn of those it
/// was last brought to (or of home).
std::vector<CouplingRow> FollowCouplings(const Mechanism& mechanism, BodyStates* states);

/// The coordinate of every term of every coupling, in the turns that `states.coupled` tells.
[[nodiscard]] std::vector<ScalarRow> CoupledCoordinates(const Mechanism& mechanism,
                                                        const BodyStates& states);

/// How many turns the coupled coordinates count at the joints' guesses, for poses near them.
[[nodiscard]] std::vector<double> CoupledGuesses(const Mechanism& mechanism);

/// Coordinates by joint and number.
using CoordinateSet = std::set<std::pair<int, int>>;
/// Gives the one coordinate of a coupling that is not `known` the value that the others ask for, in
/// any turn, and counts it as known; for as long as there is such a coupling. `q`: by joint.
void SolveFollowers(const Mechanism& mechanism, CoordinateSet* known,
                    std::vector<std::array<double, 6>>* q);

/// Names of the coupled joints, for messages: "wheel, pinion".
[[nodiscard]] std::string CoupledJoints(const Mechanism& mechanism, const Coupling& coupling);

}  // namespace mbv
