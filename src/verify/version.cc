#include "verify/version.h"

#include <fmt/format.h>

#include <Eigen/Core>

#include "simulation/engine/engine.h"

namespace mbv {

std::vector<std::pair<std::string, std::string>> Versions() {
  return {{"mbverify", kVersion},
          {"mujoco", EngineVersion()},
          {"eigen",
           fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"compiler", __VERSION__}};
}

}  // namespace mbv
