// Whether two mechanisms have the same geometry, to the last bit: what was found from one's poses,
// joints and drives then holds for the other.
#pragma once

#include "mechanism/mechanism.h"

namespace mbv {

/// Joints with their frames, guesses, home and ranges; drives, prescribed joints, outputs and
/// couplings; spanning tree and home poses; which bodies have no mass; the characteristic length.
/// Names, and masses otherwise, may differ. Zeros count with their signs.
[[nodiscard]] bool HaveSameGeometry(const Mechanism& a, const Mechanism& b);

/// The same spins at home (mechanism/idle_spins.h), idle or not.
[[nodiscard]] bool HaveSameSpins(const Mechanism& a, const Mechanism& b);

}  // namespace mbv
