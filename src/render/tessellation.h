// Solids as triangles with normals, in their own frame G.
#pragma once

#include <array>
#include <vector>

#include "math/triangle_mesh.h"
#include "render/scene.h"

namespace mbv::render {

struct Facets {
  std::vector<Vec3> points_G = {}, normals_G = {};  ///< [m]; unit vectors
  std::vector<int> faces = {};                      ///< per point: which face, each smooth
  std::vector<std::array<int, 3>> triangles = {};   ///< counter-clockwise from outside
};
constexpr int kMostFaces = 8;  ///< of a primitive solid

/// A primitive solid, round ones with so many sides; empty for a mesh.
[[nodiscard]] Facets FacetsOf(const Item& item, int sides);
/// A mesh with at most `most` triangles, smooth but for its sharp edges.
[[nodiscard]] Facets FacetsOf(const TriangleMesh& mesh, std::size_t most);
/// Sides of a circle of this radius that looks round.
[[nodiscard]] int SidesFor(double radius_px);

}  // namespace mbv::render
