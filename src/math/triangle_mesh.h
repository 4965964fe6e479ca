// Triangle meshes: surfaces that closed forms compute (workspaces) and that files hold.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "base/types.h"

namespace mbv {

/// Vertices [m] and triangles whose corners turn counter-clockwise seen from outside.
struct TriangleMesh {
  std::vector<Vec3> vertices;
  std::vector<std::array<int, 3>> triangles;
};

/// Measures of a closed surface; NaN until computed.
struct SolidProperties {
  double volume = kNan;                    ///< [m³]; negative when turned inside out
  double area = kNan;                      ///< [m²]
  Vec3 centroid = Vec3(kNan, kNan, kNan);  ///< of the enclosed volume [m]
};

/// Volume and centroid by the divergence theorem, exact for the flat triangles. The mesh must be
/// closed.
[[nodiscard]] SolidProperties PropertiesOf(const TriangleMesh& mesh);

/// Area of triangles first … first + count − 1 [m²].
[[nodiscard]] double AreaOf(const TriangleMesh& mesh, size_t first, size_t count);

/// True when each edge belongs to exactly two triangles, once in either direction.
[[nodiscard]] bool IsClosed(const TriangleMesh& mesh);

/// Binary STL (single precision, metres) with normals; `title` goes into the 80-byte header.
[[nodiscard]] std::string ToStl(const TriangleMesh& mesh, const std::string& title);

/// ASCII PLY with double vertices [m].
[[nodiscard]] std::string ToPly(const TriangleMesh& mesh, const std::string& title);

}  // namespace mbv
