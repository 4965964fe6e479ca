// Meshes in the stage's MuJoCo model.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "core/triangle_mesh.h"

namespace mbv::render {

/// MJCF of the meshes: assets "mesh0", …, and a body with a hidden geom of each, of the same name,
/// in its own frame. Decimated to 400 000 triangles together.
[[nodiscard]] std::pair<std::string, std::string> MeshMjcf(
    const std::vector<std::shared_ptr<const TriangleMesh>>& meshes);

/// Where MuJoCo's frames of the meshes lie in those of the files: it moves them to the middle and
/// the principal axes, and the hidden geoms against that.
[[nodiscard]] std::vector<Pose> MeshFrames(const mjModel& model, std::size_t count);

}  // namespace mbv::render
