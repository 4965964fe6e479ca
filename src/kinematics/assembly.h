// How loops can be put together: all ways that a bounded search finds, the nearest first.
//
// Loops that share joints form a group; groups are solved by themselves, so that a robot with many
// legs is no harder than one leg. A group is closed by damped Gauss–Newton on a residual that falls
// in some direction wherever it is not zero: rotations enter as rotation vectors, which unlike
// direction cosines do not vanish where an axis points backwards.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "kinematics/mobility.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// Coordinates of every joint, by joint index.
using JointCoordinates = std::vector<std::array<double, 6>>;

/// One way to close a group.
struct Assembly {
  JointCoordinates q;      ///< of the group's joints, in the order of LoopGroup::joints
  double distance = kNan;  ///< from the guesses: root mean square over the joints [rad, lengths]
};

struct GroupAssemblies {
  LoopGroup group;
  std::vector<Assembly> assemblies = {};  ///< distinct ones, nearest to the guesses first
  bool from_guess = false;                ///< the first one was reached from the guesses themselves
  bool drives_moved = false;              ///< driven joints had to leave their guesses
  JointCoordinates best;                  ///< least gap, where nothing closes
  int starts = 0;                         ///< tried
};

/// A group as a mechanism of its own, its innermost body as the world: the group's tree joints,
/// then its closures; at home where the whole is. Drives, couplings and elements stay behind.
[[nodiscard]] Mechanism GroupAlone(const Mechanism& whole, const LoopGroup& group);

/// Searches the ways to close one group near `guess` (by joint index of the mechanism): from the
/// guesses, then from a fixed sequence of random starts around them, farther and farther away.
/// First with driven joints held, and if that does not close, with them free.
[[nodiscard]] GroupAssemblies FindAssemblies(const Mechanism& mechanism, const LoopGroup& group,
                                             const std::vector<bool>& driven,
                                             const JointCoordinates& guess);

/// "knee.A, knee.B: 3 ways to close; taken: knee = 0.42, …; also: knee = -1.2, …" to read.
[[nodiscard]] std::string AssemblyText(const Mechanism& mechanism, const GroupAssemblies& found);

}  // namespace mbv

// Residual of closures for the search of assemblies. Internal to kinematics/.

namespace mbv::internal {

/// What is left open at a closure, and its derivative by the twists of its two bodies. Lengths are
/// relative to `length`.
struct ClosureGap {
  VecX residual;
  MatX J_parent, J_child;  ///< rows × 6
};
struct ClosureFrames {
  Pose X_WP, X_WC;  ///< of parent and child body
};
[[nodiscard]] ClosureGap AssemblyResidual(const Joint& joint, const ClosureFrames& frames,
                                          double length);

}  // namespace mbv::internal
