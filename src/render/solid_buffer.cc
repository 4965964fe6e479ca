#include "render/solid_buffer.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "mesh/decimate.h"

namespace mbv::render {
namespace {

constexpr std::size_t kMostTriangles = 400'000;  // of all meshes together

std::uint8_t Byte(float share) {
  return static_cast<std::uint8_t>(std::lround(255.0F * std::clamp(share, 0.0F, 1.0F)));
}

// Whether a rod or ball goes on where the one before ends: arcs, coils and paths are one part.
bool GoesOn(const Item& before, const Item& item) {
  const auto end = [](const Item& of, double side) {
    const double half = of.solid == Solid::kCapsule ? of.size.z() : 0.0;
    return Vec3(of.X_WG * Vec3(0.0, 0.0, side * half));
  };
  const auto is_rod = [](const Item& of) {
    return of.solid == Solid::kCapsule || of.solid == Solid::kBall;
  };
  return is_rod(before) && is_rod(item) && before.casts_shadow == item.casts_shadow &&
         before.material.rgba == item.material.rgba &&
         (end(before, 1.0) - end(item, -1.0)).norm() < before.size.x();
}

}  // namespace

DrawnMeshes DrawnMeshesOf(const std::vector<std::shared_ptr<const TriangleMesh>>& meshes) {
  std::vector<const TriangleMesh*> all;
  for (const auto& mesh : meshes) all.push_back(mesh.get());
  const std::vector<std::size_t> shares = SharesOf(all, kMostTriangles);
  DrawnMeshes drawn;
  for (std::size_t i = 0; i < all.size(); ++i) drawn[all[i]] = FacetsOf(*all[i], shares[i]);
  return drawn;
}

double SolidBuffer::PixelsOf(const Item& item, double length_m) const {
  const Vec3 p_D = R_DW_ * item.X_WG.translation();
  const double reach = item.size.norm();
  double depth = camera_.distance_m;
  if (!camera_.parallel) {
    depth = std::max((p_D - camera_.position_D()).dot(camera_.forward_D()) - reach,
                     0.05 * camera_.distance_m);
  }
  return length_m * height_px_ * camera_.distance_m / (HeightAtLookat(camera_) * depth);
}

void SolidBuffer::Append(const Part& part, const Facets& facets) {
  const Item& item = *part.item;
  const auto base = static_cast<std::uint32_t>(vertices_.size());
  const Mat3 R_DG = R_DW_ * item.X_WG.linear();
  const Vec3 p_DG = R_DW_ * item.X_WG.translation();
  const Material& m = item.material;
  // Meshes have no numbers of faces, which a negative number says.
  for (std::size_t i = 0; i < facets.points_G.size(); ++i) {
    const Vec3 p = R_DG * facets.points_G[i] + p_DG, n = R_DG * facets.normals_G[i];
    const int face =
        item.solid == Solid::kMesh ? -part.number : part.number * kMostFaces + facets.faces[i];
    Vertex vertex{.position = {}, .normal = {}, .color = {}, .finish = {}};
    for (int k = 0; k < 3; ++k) {
      vertex.position[k] = static_cast<float>(p[k]);
      vertex.normal[k] = static_cast<float>(n[k]);
    }
    for (int k = 0; k < 4; ++k) vertex.color[k] = Byte(m.rgba[static_cast<std::size_t>(k)]);
    vertex.finish[0] = m.specular;
    vertex.finish[1] = m.shininess;
    vertex.finish[2] = m.emission;
    vertex.finish[3] = static_cast<float>(face);
    vertices_.push_back(vertex);
  }
  for (const auto& triangle : facets.triangles) {
    for (const int corner : triangle) {
      indices_.push_back(base + static_cast<std::uint32_t>(corner));
    }
  }
}

void SolidBuffer::AddOne(const Part& part) {
  const Item& item = *part.item;
  if (item.solid != Solid::kMesh) {
    const double radius = item.solid == Solid::kArrow ? 2.0 * item.size.x() : item.size.x();
    Append(part, FacetsOf(item, SidesFor(PixelsOf(item, radius))));
    return;
  }
  if (const auto found = meshes_.find(item.mesh.get()); found != meshes_.end()) {
    Append(part, found->second);
  }
}

// What ends nearest first, so that decks and floors come last: what others hide is not lit.
template <typename Test>
IndexRange SolidBuffer::AddThose(std::vector<Part> parts, const Test& test) {
  const int first = static_cast<int>(indices_.size());
  std::erase_if(parts, [&](const Part& part) { return !test(*part.item); });
  std::ranges::stable_sort(parts, {}, [&](const Part& part) {
    const Vec3 p_D = R_DW_ * part.item->X_WG.translation();
    return p_D.dot(camera_.forward_D()) + part.item->size.norm();
  });
  for (const Part& part : parts) AddOne(part);
  return {first, static_cast<int>(indices_.size()) - first};
}

SolidRanges SolidBuffer::Add(const std::vector<Item>& items) {
  std::vector<Part> parts;
  for (std::size_t i = 0; i < items.size(); ++i) {
    const bool same = i > 0 && GoesOn(items[i - 1], items[i]);
    parts.push_back({&items[i], same ? parts_ : ++parts_});
  }
  const auto is_mesh = [](const Item& item) { return item.solid == Solid::kMesh; };
  return {.primitives = AddThose(
              parts, [&](const Item& item) { return item.casts_shadow && !is_mesh(item); }),
          .meshes = AddThose(parts, is_mesh),
          .marks = AddThose(
              parts, [&](const Item& item) { return !item.casts_shadow && !is_mesh(item); })};
}

void SolidBuffer::Upload(GlMesh* mesh) const {
  mesh->Fill(vertices_.data(), vertices_.size() * sizeof(Vertex));
  mesh->FillIndices(indices_.data(), indices_.size() * sizeof(std::uint32_t));
  mesh->Attribute(0, 3, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, position));
  mesh->Attribute(1, 3, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, normal));
  mesh->Attribute(2, 4, GL_UNSIGNED_BYTE, sizeof(Vertex), offsetof(Vertex, color));
  mesh->Attribute(3, 4, GL_FLOAT, sizeof(Vertex), offsetof(Vertex, finish));
}

}  // namespace mbv::render
