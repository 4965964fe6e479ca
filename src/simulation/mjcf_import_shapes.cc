// Frames and shapes of an MJCF file.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

#include "simulation/mjcf_import.h"

namespace mbv::simulation {
namespace {

// "" for MuJoCo's default grey.
std::string ColorOf(const float* rgba) {
  if (rgba[0] == 0.5F && rgba[1] == 0.5F && rgba[2] == 0.5F) return "";
  const auto byte = [](float x) {
    return static_cast<int>(std::lround(255.0 * std::clamp(double{x}, 0.0, 1.0)));
  };
  return fmt::format("#{:02x}{:02x}{:02x}{:02x}", byte(rgba[0]), byte(rgba[1]), byte(rgba[2]),
                     byte(rgba[3]));
}

void AddMesh(int g, const mjcf::ForeignMesh& mesh, MjcfImport* in) {
  constexpr int kHidden = 3;  // groups from here on are switched off in MuJoCo's viewer
  const mjModel& m = in->m;
  const Mesh geometry{.X_BG = PoseAt(m.geom_pos + 3 * g, m.geom_quat + 4 * g) * mesh.X_GF,
                      .file = mesh.file,
                      .scale = mesh.scale,
                      .surface = std::make_shared<const TriangleMesh>()};
  std::vector<Shape>& shapes = in->BodyOf(m.geom_bodyid[g]).shapes;
  // The same mesh once more, to be touched.
  const bool again = std::ranges::any_of(shapes, [&](const Shape& other) {
    const auto* known = std::get_if<Mesh>(&other.geometry);
    return known != nullptr && known->file == geometry.file && known->scale == geometry.scale &&
           known->X_BG.isApprox(geometry.X_BG, 1e-12);
  });
  if (again || m.geom_group[g] >= kHidden) return;
  Shape shape{.geometry = geometry};
  if (const std::string color = ColorOf(m.geom_rgba + 4 * g); !color.empty()) shape.color = color;
  shapes.push_back(shape);
}

// Of a geom that MuJoCo draws by itself; empty for planes and others.
std::optional<Shape> SolidOf(const mjModel& m, int g) {
  const Pose X = PoseAt(m.geom_pos + 3 * g, m.geom_quat + 4 * g);
  const mjtNum* size = m.geom_size + 3 * g;
  const Vec3 half(0, 0, size[1]);
  switch (m.geom_type[g]) {
    case mjGEOM_SPHERE:
      return Shape{.geometry = Ball{X.translation(), size[0]}};
    case mjGEOM_CAPSULE:
      return Shape{.geometry = Capsule{X * Vec3(-half), X * half, size[0]}};
    case mjGEOM_CYLINDER:
      return Shape{.geometry = Cylinder{X * Vec3(-half), X * half, size[0]}};
    case mjGEOM_BOX:
      return Shape{.geometry = Box{X, 2.0 * VecAt(size)}};
    default:
      return std::nullopt;
  }
}

}  // namespace

void AddSites(MjcfImport* in) {
  const mjModel& m = in->m;
  for (int s = 0; s < m.nsite; ++s) {
    in->BodyOf(m.site_bodyid[s])
        .frames.push_back(
            {in->NameOf(mjOBJ_SITE, s, "site"), PoseAt(m.site_pos + 3 * s, m.site_quat + 4 * s)});
  }
}

void AddShapes(MjcfImport* in) {
  const mjModel& m = in->m;
  for (int g = 0; g < m.ngeom; ++g) {
    if (m.geom_contype[g] != 0 || m.geom_conaffinity[g] != 0) in->touching = true;
    const auto mesh = in->foreign.meshes().find(in->NameOf(mjOBJ_GEOM, g, "geom"));
    if (mesh != in->foreign.meshes().end()) {
      AddMesh(g, mesh->second, in);
      continue;
    }
    if (m.geom_bodyid[g] == 0) continue;  // floors
    if (auto solid = SolidOf(m, g)) in->BodyOf(m.geom_bodyid[g]).shapes.push_back(*solid);
  }
}

}  // namespace mbv::simulation
