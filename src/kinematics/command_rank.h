// Which commands determine the motion, which contradict each other, and what stays free.
#pragma once

#include <string>
#include <vector>

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
/// those before are held.
[[nodiscard]] CoordinateChoice ChooseCoordinates(const Mechanism& mechanism,
                                                 const std::vector<Coordinate>& candidates,
                                                 size_t preferred);

/// Drives that cannot move at home, by index.
[[nodiscard]] std::vector<size_t> StuckDrives(const Mechanism& mechanism);

/// A DOF that stays when these coordinates are held: twists [ω; v] per body, world axes, the
/// largest entry 1. Empty if none stays.
[[nodiscard]] std::vector<Vec6> FreeMotion(const Mechanism& mechanism,
                                           const std::vector<Coordinate>& held);

}  // namespace mbv
