// Vertices that lie at one place.
#pragma once

#include "core/triangle_mesh.h"

namespace mbv {

/// Vertices within `tolerance` [m] of an earlier one become that one (0: equal numbers only);
/// triangles that lose a corner by it, and vertices that no triangle uses, go.
[[nodiscard]] TriangleMesh Welded(const TriangleMesh& mesh, double tolerance);

/// Diagonal of the box around the vertices [m]; 0 without any.
[[nodiscard]] double DiagonalOf(const TriangleMesh& mesh);

/// How many directed edges have no partner in the other direction; 0: the surface bounds a volume.
/// Unlike IsClosed() it lets several sheets meet in one edge.
[[nodiscard]] size_t OpenEdges(const TriangleMesh& mesh);

/// The surface's connected parts.
[[nodiscard]] std::vector<TriangleMesh> PartsOf(const TriangleMesh& mesh);

}  // namespace mbv
