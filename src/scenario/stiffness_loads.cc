#include "scenario/stiffness_loads.h"

namespace mbv {

std::vector<Vec6> DrawLoads(const RandomLoads& loads) {
  std::uint64_t state = loads.seed;
  const auto draw = [&state] {
    state = 6364136223846793005ULL * state + 1442695040888963407ULL;
    return static_cast<double>(state >> 11U) * 0x1p-53;
  };
  std::vector<Vec6> wrenches(static_cast<size_t>(loads.count));
  for (Vec6& wrench : wrenches) {
    for (int i = 3; i < 6; ++i) wrench[i] = loads.force_max * draw();
    for (int i = 0; i < 3; ++i) wrench[i] = loads.moment_max * draw();
  }
  return wrenches;
}

}  // namespace mbv
