#include "render/stage_meshes.h"

#include <fmt/format.h>

#include "mesh/decimate.h"
#include "simulation/engine.h"

namespace mbv::render {
namespace {

// What the renderer takes of each mesh: MuJoCo wants at least four vertices.
constexpr std::size_t kMostTriangles = 400'000;  // of all meshes together
constexpr double kEdge_rad = 0.6;                // sharper edges stay edges

std::vector<TriangleMesh> StageMeshes(
    const std::vector<std::shared_ptr<const TriangleMesh>>& surfaces) {
  std::vector<const TriangleMesh*> all;
  all.reserve(surfaces.size());
  for (const auto& mesh : surfaces) all.push_back(mesh.get());
  const std::vector<std::size_t> shares = SharesOf(all, kMostTriangles);
  std::vector<TriangleMesh> meshes;
  for (std::size_t i = 0; i < all.size(); ++i) {
    meshes.push_back(WithSharpEdges(Decimated(*all[i], shares[i]), kEdge_rad));
    TriangleMesh& mesh = meshes.back();
    while (mesh.vertices.size() < 4) mesh.vertices.push_back(Vec3::Zero());
    if (mesh.triangles.empty()) mesh.triangles.push_back({0, 1, 2});
  }
  return meshes;
}

}  // namespace

std::pair<std::string, std::string> MeshMjcf(
    const std::vector<std::shared_ptr<const TriangleMesh>>& surfaces) {
  const std::vector<TriangleMesh> meshes = StageMeshes(surfaces);
  std::string assets, geoms;
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    assets += fmt::format("<mesh name='mesh{}' vertex='", i);
    for (const Vec3& p : meshes[i].vertices) {
      assets += fmt::format("{:.7g} {:.7g} {:.7g} ", p.x(), p.y(), p.z());
    }
    assets += "' face='";
    for (const auto& t : meshes[i].triangles) {
      assets += fmt::format("{} {} {} ", t[0], t[1], t[2]);
    }
    assets += "'/>";
    geoms += fmt::format(
        "<geom name='mesh{0}' type='mesh' mesh='mesh{0}' group='5' contype='0' "
        "conaffinity='0'/>",
        i);
  }
  if (!meshes.empty()) {
    geoms = "<body><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>" + geoms + "</body>";
  }
  return {assets, geoms};
}

std::vector<Pose> MeshFrames(const mjModel& model, std::size_t count) {
  std::vector<Pose> frames;
  for (std::size_t i = 0; i < count; ++i) {
    const int g = simulation::IdOf(model, mjOBJ_GEOM, fmt::format("mesh{}", i));
    const mjtNum *p = model.geom_pos + 3L * g, *q = model.geom_quat + 4L * g;
    Pose X = Pose::Identity();
    X.translation() = Vec3(p[0], p[1], p[2]);
    X.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    frames.push_back(X);
  }
  return frames;
}

}  // namespace mbv::render
