#include "model_file/mesh/decimate.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "model_file/mesh/mass_properties.h"

namespace mbv {
namespace {

// One vertex per cell of a grid with `cells` along the longest side.
TriangleMesh Clustered(const TriangleMesh& mesh, const Eigen::AlignedBox3d& box, int cells) {
  const double edge = box.sizes().maxCoeff() / cells;
  std::map<std::array<int, 3>, int> index;
  TriangleMesh coarse;
  std::vector<int> of(mesh.vertices.size()), count;
  for (size_t v = 0; v < mesh.vertices.size(); ++v) {
    std::array<int, 3> cell{};
    for (int k = 0; k < 3; ++k) {
      cell[k] = static_cast<int>((mesh.vertices[v][k] - box.min()[k]) / edge);
    }
    const auto [at, is_new] = index.emplace(cell, static_cast<int>(coarse.vertices.size()));
    if (is_new) {
      coarse.vertices.emplace_back(Vec3::Zero());
      count.push_back(0);
    }
    of[v] = at->second;
    coarse.vertices[of[v]] += mesh.vertices[v];
    ++count[of[v]];
  }
  for (size_t v = 0; v < count.size(); ++v) coarse.vertices[v] /= count[v];
  std::set<std::array<int, 3>> seen;  // without regard to the first corner
  for (const auto& t : mesh.triangles) {
    std::array<int, 3> moved{of[t[0]], of[t[1]], of[t[2]]};
    if (moved[0] == moved[1] || moved[1] == moved[2] || moved[2] == moved[0]) continue;
    std::rotate(moved.begin(), std::min_element(moved.begin(), moved.end()), moved.end());
    if (seen.insert(moved).second) coarse.triangles.push_back(moved);
  }
  return coarse;
}

}  // namespace

TriangleMesh Decimated(const TriangleMesh& mesh, size_t most) {
  if (mesh.triangles.size() <= most) return mesh;
  if (most == 0) return {};
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.vertices) box.extend(p);
  // A surface of N cells along a side has some N² of them, each with about two triangles.
  constexpr int kFinest = 1024;
  constexpr double kCoarser = 0.8;
  double cells = std::min<double>(kFinest, 2.0 * std::sqrt(static_cast<double>(most)) + 1.0);
  for (; cells >= 1.0; cells *= kCoarser) {
    TriangleMesh coarse = Clustered(mesh, box, static_cast<int>(cells));
    if (coarse.triangles.size() <= most) return Welded(coarse, 0.0);
  }
  return {};
}

std::vector<size_t> SharesOf(const std::vector<const TriangleMesh*>& meshes, size_t most) {
  std::vector<size_t> order(meshes.size()), shares(meshes.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) {
    return meshes[a]->triangles.size() < meshes[b]->triangles.size();
  });
  size_t left = most;
  for (size_t i = 0; i < order.size(); ++i) {
    const size_t even = left / (order.size() - i);
    shares[order[i]] = std::min(even, meshes[order[i]]->triangles.size());
    left -= shares[order[i]];
  }
  return shares;
}

namespace {

using SharedMesh = std::shared_ptr<const TriangleMesh>;

// A model that is written again and again is decimated once. What is known is kept alive, so that
// no other surface can take its address.
SharedMesh DecimatedOnce(const SharedMesh& surface, size_t most) {
  if (surface->triangles.size() <= most) return surface;
  constexpr size_t kMostKnown = 200;
  thread_local std::map<std::pair<SharedMesh, size_t>, SharedMesh> known;
  if (known.size() > kMostKnown) known.clear();
  SharedMesh& found = known[{surface, most}];
  if (found == nullptr) {
    found = std::make_shared<const TriangleMesh>(Decimated(*surface, most));
  }
  return found;
}

}  // namespace

DrawnSurfaces::DrawnSurfaces(const Mechanism& mechanism, size_t most) {
  for (const Body& body : mechanism.bodies) {
    for (const Shape& shape : body.shapes) {
      const auto* mesh = std::get_if<Mesh>(&shape.geometry);
      if (mesh == nullptr || IndexOf(*mesh) >= 0) continue;
      surfaces_.push_back(mesh->surface.get());
      drawn_.push_back(mesh->surface);
    }
  }
  const std::vector<size_t> shares = SharesOf(surfaces_, most);
  for (size_t i = 0; i < drawn_.size(); ++i) drawn_[i] = DecimatedOnce(drawn_[i], shares[i]);
}

int DrawnSurfaces::IndexOf(const Mesh& mesh) const {
  const auto at = std::find(surfaces_.begin(), surfaces_.end(), mesh.surface.get());
  return at == surfaces_.end() ? -1 : static_cast<int>(at - surfaces_.begin());
}

TriangleMesh WithSharpEdges(const TriangleMesh& mesh, double angle_rad) {
  std::vector<Vec3> normals;
  std::vector<std::vector<int>> around(mesh.vertices.size());
  for (size_t i = 0; i < mesh.triangles.size(); ++i) {
    const auto& t = mesh.triangles[i];
    const Vec3& p = mesh.vertices[t[0]];
    normals.push_back((mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p).stableNormalized());
    for (const int corner : t) around[corner].push_back(static_cast<int>(i));
  }
  TriangleMesh sharp;
  sharp.triangles.resize(mesh.triangles.size());
  const double level = std::cos(angle_rad);
  for (size_t v = 0; v < around.size(); ++v) {
    // Groups of triangles that are level with the first of the group.
    std::vector<std::pair<int, int>> groups;  // first triangle, vertex
    for (const int i : around[v]) {
      auto group = std::find_if(groups.begin(), groups.end(), [&](const auto& g) {
        return normals[g.first].dot(normals[i]) >= level;
      });
      if (group == groups.end()) {
        groups.emplace_back(i, static_cast<int>(sharp.vertices.size()));
        sharp.vertices.push_back(mesh.vertices[v]);
        group = std::prev(groups.end());
      }
      for (int k = 0; k < 3; ++k) {
        if (mesh.triangles[i][k] == static_cast<int>(v)) sharp.triangles[i][k] = group->second;
      }
    }
  }
  return sharp;
}

}  // namespace mbv
