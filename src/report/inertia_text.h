// What `mbverify inertia` tells: stated mass properties against those of meshes.
#pragma once

#include <string>
#include <vector>

#include "mesh/inertia_diagnosis.h"

namespace mbv {

/// A row per body with meshes, then each finding with its hint.
[[nodiscard]] std::string InertiaTable(const std::vector<BodyInertia>& bodies);

/// The same for programs, with centres and tensors; numbers that are not known are null.
[[nodiscard]] std::string InertiaJson(const std::vector<BodyInertia>& bodies,
                                      const std::string& file);

}  // namespace mbv
