// Robots of foreign formats.
#pragma once

#include <string>

#include "model_file/load_bodies.h"
#include "model_file/load_model.h"

namespace mbv {

/// Whether a file is a robot of a foreign format (.urdf, .xml), by its name.
[[nodiscard]] bool IsRobotFile(const std::string& file);

/// LoadModel(), which takes .urdf, and MJCF (.xml) by MuJoCo's compiler in a process of its own.
[[nodiscard]] LoadResult LoadRobot(const std::string& file, const LoadOptions& options = {});

/// LoadBodies() of the same files.
[[nodiscard]] LoadedBodies LoadRobotBodies(const std::string& file);

}  // namespace mbv
