#include "pipeline/version.h"

#include <Eigen/Core>

#include <fmt/format.h>

namespace mbv {

std::vector<std::pair<std::string, std::string>> Versions() {
  return {{"mbverify", kVersion},
          {"eigen",
           fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)},
          {"compiler", __VERSION__}};
}

}  // namespace mbv
