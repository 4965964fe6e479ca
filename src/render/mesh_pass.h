// Translucent triangle meshes, drawn with plain OpenGL after MuJoCo's pass into the same buffer.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "core/types.h"
#include "render/render.h"

namespace mbv::render {

struct MeshView {
  mjvGLCamera camera;  ///< as used by mjr_render
  int width = 0, height = 0;
};

/// Draws the meshes, farthest triangle first, hidden by what is already in the depth buffer.
void DrawMeshes(const std::vector<MeshOverlay>& meshes, const Mat3& R_DW, const MeshView& view);

}  // namespace mbv::render
