// Which commands determine the motion, which contradict each other, and what stays free.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv {

/// Rank of a set of commands at the home pose. Idle spins (mechanism/idle_spins.h) are no DOFs
/// here and below: nothing needs to hold them.
struct CommandRank {
  int dofs = 0;                          ///< of the mechanism without commands, at home
  int undriven = 0;                      ///< DOFs that are left with the commands held
  int redundant = 0;                     ///< commands too many: they cannot be given independently
  std::vector<int> dependent;            ///< commands that share the redundancy, by index
  std::vector<std::string> free_joints;  ///< joints that still move with the commands held
};

/// At a singular home pose the numbers hold there only.
[[nodiscard]] CommandRank RankCommands(const Mechanism& mechanism,
                                       const std::vector<Command>& commands);

/// The first candidates, in their order, that together with `commands` hold each DOF once; by
/// index. At most `count`.
[[nodiscard]] std::vector<size_t> IndependentCommands(const Mechanism& mechanism,
                                                      const std::vector<Command>& commands,
                                                      const std::vector<Command>& candidates,
                                                      size_t count);

/// A set of coordinates that holds each DOF once.
struct CoordinateChoice {
  int dofs = 0;                   ///< of the mechanism, at home
  std::vector<size_t> chosen;     ///< of the candidates, by index
  std::vector<size_t> dependent;  ///< of the first ones, what depends on others before it
  [[nodiscard]] int left() const { return dofs - static_cast<int>(chosen.size()); }
};

/// Takes the first `preferred` candidates in their order, as far as they are independent at home
/// (first those of which the others hold less than 99 %), then of the rest what moves most while
/// those before are held. Candidates from `makeshift` on have to move ten times more than others.
[[nodiscard]] CoordinateChoice ChooseCoordinates(const Mechanism& mechanism,
                                                 const std::vector<Coordinate>& candidates,
                                                 size_t preferred,
                                                 size_t makeshift = static_cast<size_t>(-1));

/// A set of coordinates by name that holds each DOF once: the prescribed joints that are not
/// chosen, which are held, and the others.
struct NamedChoice {
  std::vector<NamedCoordinate> held, coordinates;
};
/// `names` of NamedMotionCoordinates(); without any those `first`, then drives, then others, as far
/// as they are independent at home. Nothing after a finding.
[[nodiscard]] std::optional<NamedChoice> ChooseNamedCoordinates(
    const Mechanism& mechanism, const std::vector<std::string>& names,
    const std::vector<Coordinate>& first, Diagnostics* diagnostics);

/// Drives that cannot move at home, by index.
[[nodiscard]] std::vector<size_t> StuckDrives(const Mechanism& mechanism);

/// A DOF that stays when these coordinates are held: twists [ω; v] per body, world axes, the
/// largest entry 1. Empty if none stays.
[[nodiscard]] std::vector<Vec6> FreeMotion(const Mechanism& mechanism,
                                           const std::vector<Coordinate>& held);

// What moves with what: the bodies' twists when driven coordinates move one at a time.

struct DrivenTwists {
  /// Per drive, then per prescribed joint, and per body: the twist [ω; v of Bo] in world axes at
  /// one unit of this coordinate's rate, the other ones at rest. DOFs that nothing drives
  /// follow by inertia; coordinates that depend on each other share the motion with least rates.
  /// All zero where the coordinate is not held, or hardly moves anything at home.
  std::vector<std::vector<Vec6>> V_WB;
  /// Per body: it can move while the prescribed joints rest.
  std::vector<bool> moved;
};

/// At the home pose. `held[d]` is false for a drive whose motion is not given.
[[nodiscard]] DrivenTwists TwistsOfDriven(const Mechanism& mechanism,
                                          const std::vector<bool>& held);

}  // namespace mbv
