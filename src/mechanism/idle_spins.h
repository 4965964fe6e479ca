// Rods and telescopic legs between two balls, which can spin about the line through both.
//
//   P, Q: centres of the balls; n = PQ/|PQ|; I the inertia of all that spins together
//   symmetric about the line: every centre of mass lies on it, every inertia is
//     I n = a n,  I e = c e for all e ⟂ n                                                       (1)
// Forces of frictionless balls have no moment about the line, and weight has none either. Euler's
// equation along n is then
//   d/dt (a n·ω) = 0  (H·ṅ = c (n × ṅ)·ṅ = 0)                                                   (2)
// so the spin rate stays what it was, 0, and whatever turn about the line there is, nothing else
// feels it:
//   n·ω = 0, n·ε = 0  (ṅ·ω = (ω × n)·ω = 0)                                                     (3)
// Such a spin is idle: it needs no command and no force. The turn itself follows from (3) along the
// motion (n is transported parallel); a motion starts with the least turn from home.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "mechanism/mechanism.h"

namespace mbv {

/// What spins together about the line through two balls.
struct Spin {
  std::string name;            ///< of the body, or of the part that its bodies belong to
  std::vector<int> bodies;     ///< the first one carries balls[0]; slides along the line join them
  std::array<int, 2> balls{};  ///< joints
  Vec3 p_BP = Vec3::Zero();    ///< centre of balls[0] in the frame of bodies[0] [m]
  Vec3 n_B = Vec3::UnitZ();    ///< unit, towards balls[1]
  std::string why_not;         ///< why it is not idle; empty: it is
};

/// Every part that two balls and nothing else connect with the rest, at the home pose.
[[nodiscard]] std::vector<Spin> FindSpins(const Mechanism& mechanism);
/// Those that are idle.
[[nodiscard]] std::vector<Spin> IdleSpins(const Mechanism& mechanism);

/// Angle about n [rad] by which `R_WB` of bodies[0] is turned beyond the least turn that brings the
/// line there from home.
[[nodiscard]] double TurnFromHome(const Mechanism& mechanism, const Spin& spin, const Mat3& R_WB);

}  // namespace mbv
