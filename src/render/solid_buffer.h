// Solids as one buffer of triangles in the drawing frame, for one picture.
#pragma once

#include <map>
#include <memory>
#include <vector>

#include "core/triangle_mesh.h"
#include "render/camera.h"
#include "render/gl_objects.h"
#include "render/scene.h"
#include "render/tessellation.h"

namespace mbv::render {

/// Meshes as they are drawn, made once for all pictures of a stage.
using DrawnMeshes = std::map<const TriangleMesh*, Facets>;
[[nodiscard]] DrawnMeshes DrawnMeshesOf(
    const std::vector<std::shared_ptr<const TriangleMesh>>& meshes);

/// Indices [first, first + count) of a buffer.
struct IndexRange {
  int first = 0, count = 0;
};
/// Items of one instant, by how they are drawn.
struct SolidRanges {
  IndexRange primitives, meshes;  ///< with shadows
  IndexRange marks;               ///< without
};

class SolidBuffer {
 public:
  SolidBuffer(const DrawnMeshes& meshes, const Camera& camera, const Mat3& R_DW, int height_px)
      : meshes_(meshes), camera_(camera), R_DW_(R_DW), height_px_(height_px) {}

  [[nodiscard]] SolidRanges Add(const std::vector<Item>& items);
  void Upload(GlMesh* mesh) const;

 private:
  struct Vertex {
    float position[3], normal[3];
    std::uint8_t color[4];
    float finish[4];  // specular, shininess, emission, number of the face
  };

  // An item and the number of the part that it belongs to.
  struct Part {
    const Item* item;
    int number;
  };

  template <typename Test>
  [[nodiscard]] IndexRange AddThose(std::vector<Part> parts, const Test& test);
  void AddOne(const Part& part);
  void Append(const Part& part, const Facets& facets);
  [[nodiscard]] double PixelsOf(const Item& item, double length_m) const;

  const DrawnMeshes& meshes_;
  const Camera& camera_;
  Mat3 R_DW_;
  int height_px_, parts_ = 0;
  std::vector<Vertex> vertices_;
  std::vector<std::uint32_t> indices_;
};

}  // namespace mbv::render
