// Flat meshes, drawn over the solids into the same buffer.
#pragma once

#include <vector>

#include "core/types.h"
#include "render/annotations.h"
#include "render/gl_objects.h"
#include "render/projection.h"

namespace mbv::render {

class FlatPass {
 public:
  FlatPass();
  /// Sorts the meshes' triangles for this view, the farthest first.
  void Load(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const Projection& view);
  /// Draws them against what is already in the depth buffer.
  void Draw(const Projection& view) const;

 private:
  GlMesh mesh_;
  GlProgram program_;
  int hidden_ = 0, visible_ = 0;  // vertices: those that show through solids come first
};

}  // namespace mbv::render
