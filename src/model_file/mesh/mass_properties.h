// Mass properties of solids and shells that a triangle mesh bounds.
//
// Used terms: G = I / m [m²] is the inertia about the centre of mass per mass: shape alone. It is
// tr(C) 1 − C with C = ∫ (x − c)(x − c)ᵀ dm / m. Over a tetrahedron with corners 0, a, b, c and
// s = a + b + c, ∫ x xᵀ dV = V/20 (a aᵀ + b bᵀ + c cᵀ + s sᵀ); over a triangle of area A the same
// with A/12. [Tonon 2004, "Explicit exact formulas for the 3-D tetrahedron inertia tensor"]
#pragma once

#include "math/triangle_mesh.h"

namespace mbv {

/// Of a homogeneous body; NaN until computed.
struct MassShape {
  double amount = kNan;              ///< volume [m³] of a solid, area [m²] of a shell
  Vec3 p_cm = Vec3::Constant(kNan);  ///< centre of mass, in the mesh's frame [m]
  Mat3 G_cm = Mat3::Constant(kNan);  ///< inertia about it per mass, mesh's axes [m²]
};

/// Of the volume inside, exact for the flat triangles; a surface turned inside out counts as it is
/// meant. The mesh must be closed (OpenEdges() == 0) and enclose something.
[[nodiscard]] MassShape SolidShape(const TriangleMesh& mesh);

/// Of an evenly thin skin on the triangles.
[[nodiscard]] MassShape ShellShape(const TriangleMesh& mesh);

/// The inertia per mass that a point mass at `p` has about the origin: |p|² 1 − p pᵀ [m²],
/// Steiner's term.
[[nodiscard]] Mat3 PointInertia(const Vec3& p);

// Vertices that lie at one place.

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
