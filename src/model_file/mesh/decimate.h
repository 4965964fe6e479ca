// Meshes with fewer triangles, for pictures.
#pragma once

#include <memory>
#include <vector>

#include "math/triangle_mesh.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// The mesh with at most `most` triangles: vertices that share a cell of an even grid become their
/// mean, on the finest grid that is coarse enough (vertex clustering [Rossignac, Borrel 1993]). As
/// it is where it has no more.
[[nodiscard]] TriangleMesh Decimated(const TriangleMesh& mesh, size_t most);

/// How many of `most` triangles each mesh may have: small ones all they have, the others even
/// shares.
[[nodiscard]] std::vector<size_t> SharesOf(const std::vector<const TriangleMesh*>& meshes,
                                           size_t most);

/// The distinct surfaces of a mechanism's meshes, in the order of bodies and shapes, each decimated
/// to its share.
class DrawnSurfaces {
 public:
  DrawnSurfaces(const Mechanism& mechanism, size_t most);
  /// Index of the surface in `drawn()`; -1: of no mesh that was there.
  [[nodiscard]] int IndexOf(const Mesh& mesh) const;
  [[nodiscard]] const std::vector<std::shared_ptr<const TriangleMesh>>& drawn() const {
    return drawn_;
  }

 private:
  std::vector<const TriangleMesh*> surfaces_;
  std::vector<std::shared_ptr<const TriangleMesh>> drawn_;
};

/// Each triangle with vertices of its own where it meets its neighbours at more than `angle_rad`,
/// so that renderers that blend normals show edges as edges.
[[nodiscard]] TriangleMesh WithSharpEdges(const TriangleMesh& mesh, double angle_rad);

}  // namespace mbv
