// Where the closed form finds its inputs among a motion's commands and loads.
#pragma once

#include <array>
#include <vector>

#include "analytic/stabilizing_platform/equations.h"
#include "core/diagnostics.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"

namespace mbv::stabilizing_platform {

/// Indices into Motion::commands; −1 where not commanded.
struct CommandMap {
  DrivePairs pairs = DrivePairs::kSynchronous;
  std::array<int, 3> ship = {-1, -1, -1};  ///< roll, pitch, heave
  std::array<int, 6> platform = {-1, -1, -1, -1, -1, -1};
  std::array<int, 3> pair = {-1, -1, -1};                ///< difference of limb i's drives
  std::array<int, 6> drives = {-1, -1, -1, -1, -1, -1};  ///< into Mechanism::drives: 1, 1', 2, …
  std::array<int, 3> prescribed = {-1, -1, -1};          ///< into Mechanism::prescribed
};

/// Matches the motion to one of the two sets of commands; what does not fit becomes findings.
[[nodiscard]] CommandMap MapCommands(const Mechanism& mechanism, const Motion& motion,
                                     Diagnostics* diagnostics);

/// The commands at one instant. Fails with kUnsupported when a synchronous motion commands a
/// tilted platform or unequal drives.
[[nodiscard]] RunSummary ReadCommand(const CommandMap& map, const CommandSample& sample,
                                     PoseCommand* command);

/// Which body a load acts on, by its index in Motion::loads.
struct LoadPlace {
  bool on_ship = false;  ///< no effect on drives and limbs
  int limb = -1, link = 0;
};
[[nodiscard]] std::vector<LoadPlace> MapLoads(const Mechanism& mechanism, const Motion& motion,
                                              Diagnostics* diagnostics);

}  // namespace mbv::stabilizing_platform
