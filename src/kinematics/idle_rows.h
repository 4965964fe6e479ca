// The rows of idle spins (mechanism/idle_spins.h, eq. 3): ṙ = n·ω, r̈ = n·ε. There is no r: the turn
// about n is left where it is, so its value is always 0.
#pragma once

#include "kinematics/constraints.h"
#include "mechanism/idle_spins.h"

namespace mbv {

[[nodiscard]] inline ScalarRow IdleRow(const Spin& spin, const BodyStates& states) {
  ScalarRow row;
  row.child = spin.bodies[0];
  row.J_child.head<3>() = states.X_WB[static_cast<size_t>(row.child)].linear() * spin.n_B;
  return row;
}

}  // namespace mbv
