#include "simulation/engine_version.h"

#include <mujoco/mujoco.h>

namespace mbv {

std::string EngineVersion() { return mj_versionString(); }

}  // namespace mbv
