#include "render/flat_pass.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "render/shaders.h"

namespace mbv::render {
namespace {

struct Triangle {
  std::array<Vec3, 3> p_D;
  double depth = 0.0;
  std::array<float, 4> rgba{};
};

// Light on a surface that is lit from the viewer and from above, either side alike.
float LightOn(const Vec3& normal, const Vec3& to_surface) {
  const Vec3 n = normal.norm() > 0.0 ? Vec3(normal.normalized()) : Vec3::UnitZ();
  return static_cast<float>(0.45 + 0.35 * std::abs(n.dot(to_surface.normalized())) +
                            0.25 * std::abs(n.z()));
}

std::vector<Triangle> SortedTriangles(const std::vector<FlatMesh>& meshes, FlatMesh::Depth depth,
                                      const Mat3& R_DW, const Projection& view) {
  std::vector<Triangle> triangles;
  for (const FlatMesh& mesh : meshes) {
    if (mesh.depth != depth) continue;
    for (const auto& corner : mesh.triangles) {
      Triangle triangle{.p_D = {}, .depth = 0.0, .rgba = mesh.rgba};
      for (int i = 0; i < 3; ++i) triangle.p_D[i] = R_DW * mesh.vertices_W[corner[i]];
      const Vec3 centre = (triangle.p_D[0] + triangle.p_D[1] + triangle.p_D[2]) / 3.0;
      triangle.depth = (centre - view.eye_D).dot(view.forward_D);
      if (mesh.shaded) {
        const Vec3 normal =
            (triangle.p_D[1] - triangle.p_D[0]).cross(triangle.p_D[2] - triangle.p_D[0]);
        const float light =
            LightOn(normal, view.parallel ? view.forward_D : Vec3(centre - view.eye_D));
        for (int i = 0; i < 3; ++i) triangle.rgba[i] = std::min(1.0F, triangle.rgba[i] * light);
      }
      triangles.push_back(triangle);
    }
  }
  std::ranges::stable_sort(triangles, std::ranges::greater{}, &Triangle::depth);
  return triangles;
}

struct FlatVertex {
  std::array<float, 3> position;
  std::array<float, 4> rgba;
};

int Append(const std::vector<Triangle>& triangles, std::vector<FlatVertex>* vertices) {
  for (const Triangle& triangle : triangles) {
    for (const Vec3& p : triangle.p_D) {
      vertices->push_back(
          {{static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())},
           triangle.rgba});
    }
  }
  return static_cast<int>(3 * triangles.size());
}

}  // namespace

FlatPass::FlatPass() : program_(kFlatVertex, kFlatFragment) {}

void FlatPass::Load(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const Projection& view) {
  std::vector<FlatVertex> vertices;
  hidden_ = Append(SortedTriangles(meshes, FlatMesh::Depth::kHidden, R_DW, view), &vertices);
  visible_ = Append(SortedTriangles(meshes, FlatMesh::Depth::kVisible, R_DW, view), &vertices);
  mesh_.Fill(vertices.data(), vertices.size() * sizeof(FlatVertex));
  mesh_.Attribute(0, 3, GL_FLOAT, sizeof(FlatVertex), offsetof(FlatVertex, position));
  mesh_.Attribute(1, 4, GL_FLOAT, sizeof(FlatVertex), offsetof(FlatVertex, rgba));
}

void FlatPass::Draw(const Projection& view) const {
  if (hidden_ + visible_ == 0) return;
  mesh_.Bind();
  program_.Use();
  program_.Set("clip_D", view.clip_D);
  glDisable(GL_CULL_FACE);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glDepthFunc(GL_GREATER);
  glDrawArrays(GL_TRIANGLES, 0, hidden_);
  glDepthFunc(GL_LEQUAL);
  glDrawArrays(GL_TRIANGLES, hidden_, visible_);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
}

}  // namespace mbv::render
