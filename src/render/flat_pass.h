// Flat meshes, drawn with plain OpenGL after MuJoCo's pass into the same buffer.
#pragma once

#include <mujoco/mujoco.h>

#include <vector>

#include "core/types.h"
#include "render/annotations.h"

namespace mbv::render {

struct FlatView {
  mjvGLCamera camera;  ///< as used by mjr_render
  int width = 0, height = 0;
};

/// Draws the meshes, farthest triangle first, against what is already in the depth buffer.
void DrawFlats(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const FlatView& view);

}  // namespace mbv::render
