// Mass properties of a robot against its meshes.
#pragma once

#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mesh/inertia_diagnosis.h"

namespace mbv {

struct InertiaCheck {
  std::vector<BodyInertia> bodies;  ///< with meshes, in the file's order
  Diagnostics diagnostics;          ///< errors: nothing was checked
  [[nodiscard]] bool sound() const;
};
/// `file`: anything LoadRobotBodies() takes. Loops need not close, and tensors may be impossible.
[[nodiscard]] InertiaCheck CheckInertia(const std::string& file);

}  // namespace mbv
