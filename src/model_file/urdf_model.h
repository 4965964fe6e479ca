// A URDF file given where a model file is expected. Internal to the model loader.
#pragma once

#include <string>

namespace mbv::internal {

/// Whether a file is taken as URDF by its name.
[[nodiscard]] bool IsUrdfFile(const std::string& file);

/// The model.yaml that a URDF file stands for: itself, and the closure file beside it, if there is
/// one: STEM.yaml, robot.yaml, loop_closures.yaml or config/loop_closures.yaml in its folder, or
/// ../config/loop_closures.yaml.
[[nodiscard]] std::string UrdfModelText(const std::string& file, const std::string& urdf);

}  // namespace mbv::internal
