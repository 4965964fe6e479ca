// A user's compiled MJCF, made ready to be led along a motion. Internal to simulation/.
#pragma once

#include <string>
#include <vector>

#include "simulation/imported_mjcf.h"
#include "simulation/own_file.h"

namespace mbv::simulation {

/// A drive in the user's model.
struct OwnDrive {
  int joint = -1;  ///< MuJoCo joint
  int qpos = -1;   ///< address
  int dof = -1;
  double zero = 0.0;  ///< joint position where the drive's position is 0
  DriveLead lead = DriveLead::kAdded;
  int equality = -1;           ///< of the file; -1: none
  int added = -1;              ///< equality that was added, off unless it leads
  std::vector<int> actuators;  ///< that lead it
};

struct OwnClosure {
  int equality = -1;
  int joint = -1;  ///< of the mechanism
  bool weld = false;
};

struct OwnModel {
  ModelHandle m;
  OwnFacts facts;
  std::vector<OwnDrive> drives;  ///< per drive of the mechanism
  std::vector<OwnClosure> closures;
  VecX home;  ///< qpos
};

/// Compiles the file with an equality for each drive, finds what leads the drives and applies the
/// settings. kUnsupported with the reason where that cannot be; throws EngineError.
[[nodiscard]] RunSummary MakeOwnModel(const OwnTask& task, OwnModel* own);

}  // namespace mbv::simulation
