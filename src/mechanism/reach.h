// How large the coordinates are that a mechanism is computed with, and what that leaves of small
// differences.
//
// CharacteristicLength() measures what constrains: the root mean square distance of two points of
// one body (the world included) where joints or distance drives are attached. It depends neither on
// where the mechanism stands nor on where its bodies have their origins, nor on frames that hold
// nothing (free joints, ends of springs and bushings, outputs, shapes), which may lie anywhere.
// Where all these points of every body fall together, centres of mass count as points, too; then
// radii of gyration; of point masses that only forces hold, the ends of springs and bushings.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// A length typical of the mechanism [m], to weigh metres against radians: the root mean square
/// distance of two constrained points of one body, wherever the bodies' origins lie.
[[nodiscard]] double CharacteristicLength(const Mechanism& mechanism);

/// The largest coordinate [m] of joint frames and drive ends in their bodies (the world included).
/// Gaps are differences of this or of Reach(), and keep the rounding of the larger one.
[[nodiscard]] double LongestLever(const Mechanism& mechanism);
/// The larger of `longest_lever` and the distance of the farthest body from the world's origin [m].
[[nodiscard]] double Reach(double longest_lever, const std::vector<Pose>& X_WB);
/// Rounding [m] that a gap between frames may have: a few ten operations with coordinates that
/// large.
[[nodiscard]] inline double GapRounding(double reach_m) { return 32 * kEps * reach_m; }

// Inertias that no distribution of mass has.

/// "principal inertias 1, 2, 4 kg m² violate I1 + I2 >= I3", or "" if the body's inertia obeys the
/// triangle inequality (to 1e-9: laminae are on its bound).
[[nodiscard]] std::string TriangleViolation(const Body& body);
/// A connecting piece, or an end that nothing weighs on.
[[nodiscard]] bool IsMassless(const Body& body);
/// The same, "mass = 2 without inertia" of a mass point, "principal inertias … violate I > 0"; ""
/// of a massless body without inertia.
[[nodiscard]] std::string ImpossibleInertia(const Body& body);

/// "principal inertias 1, 2, 4 kg m²".
[[nodiscard]] std::string PrincipalInertiaText(const Vec3& principal);

}  // namespace mbv
