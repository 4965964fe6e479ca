#include "render/flat_pass.h"

#include <GL/gl.h>

#include <algorithm>
#include <cmath>

namespace mbv::render {
namespace {

struct Triangle {
  std::array<Vec3, 3> p_D;
  double depth = 0.0;
  std::array<float, 4> rgba{};
};

Vec3 FromFloats(const float* values) { return {values[0], values[1], values[2]}; }

// The camera of mjr_render as OpenGL matrices.
void LoadMatrices(const FlatView& view) {
  const mjvGLCamera& camera = view.camera;
  const double half = 0.5 * (camera.frustum_top - camera.frustum_bottom) * view.width / view.height;
  glMatrixMode(GL_PROJECTION);
  glLoadIdentity();
  glFrustum(camera.frustum_center - half, camera.frustum_center + half, camera.frustum_bottom,
            camera.frustum_top, camera.frustum_near, camera.frustum_far);
  const Vec3 forward = FromFloats(camera.forward).normalized();
  const Vec3 right = forward.cross(FromFloats(camera.up)).normalized();
  const Vec3 up = right.cross(forward), p = FromFloats(camera.pos);
  Eigen::Matrix4d look = Eigen::Matrix4d::Identity();
  look.block<1, 3>(0, 0) = right.transpose();
  look.block<1, 3>(1, 0) = up.transpose();
  look.block<1, 3>(2, 0) = -forward.transpose();
  look.block<3, 1>(0, 3) = -look.block<3, 3>(0, 0) * p;
  glMatrixMode(GL_MODELVIEW);
  glLoadMatrixd(look.data());
}

// Light on a surface that is lit from the viewer and from above, either side alike.
float LightOn(const Vec3& normal, const Vec3& to_surface) {
  const Vec3 n = normal.norm() > 0.0 ? Vec3(normal.normalized()) : Vec3::UnitZ();
  return static_cast<float>(0.45 + 0.35 * std::abs(n.dot(to_surface.normalized())) +
                            0.25 * std::abs(n.z()));
}

std::vector<Triangle> SortedTriangles(const std::vector<FlatMesh>& meshes, FlatMesh::Depth depth,
                                      const Mat3& R_DW, const FlatView& view) {
  const Vec3 eye = FromFloats(view.camera.pos), forward = FromFloats(view.camera.forward);
  std::vector<Triangle> triangles;
  for (const FlatMesh& mesh : meshes) {
    if (mesh.depth != depth) continue;
    for (const auto& corner : mesh.triangles) {
      Triangle triangle{.p_D = {}, .depth = 0.0, .rgba = mesh.rgba};
      for (int i = 0; i < 3; ++i) triangle.p_D[i] = R_DW * mesh.vertices_W[corner[i]];
      const Vec3 centre = (triangle.p_D[0] + triangle.p_D[1] + triangle.p_D[2]) / 3.0;
      triangle.depth = (centre - eye).dot(forward);
      if (mesh.shaded) {
        const Vec3 normal =
            (triangle.p_D[1] - triangle.p_D[0]).cross(triangle.p_D[2] - triangle.p_D[0]);
        const float light = LightOn(normal, centre - eye);
        for (int i = 0; i < 3; ++i) triangle.rgba[i] = std::min(1.0F, triangle.rgba[i] * light);
      }
      triangles.push_back(triangle);
    }
  }
  std::ranges::stable_sort(triangles, std::ranges::greater{}, &Triangle::depth);
  return triangles;
}

void Emit(const std::vector<Triangle>& triangles) {
  glBegin(GL_TRIANGLES);
  for (const Triangle& triangle : triangles) {
    glColor4fv(triangle.rgba.data());
    for (const Vec3& p_D : triangle.p_D) glVertex3dv(p_D.data());
  }
  glEnd();
}

}  // namespace

void DrawFlats(const std::vector<FlatMesh>& meshes, const Mat3& R_DW, const FlatView& view) {
  if (meshes.empty()) return;
  glPushAttrib(GL_ALL_ATTRIB_BITS);
  glViewport(0, 0, view.width, view.height);
  LoadMatrices(view);
  for (const GLenum off : {GL_LIGHTING, GL_TEXTURE_2D, GL_CULL_FACE, GL_FOG}) glDisable(off);
  glEnable(GL_DEPTH_TEST);
  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDepthFunc(GL_GREATER);
  Emit(SortedTriangles(meshes, FlatMesh::Depth::kHidden, R_DW, view));
  glDepthFunc(GL_LEQUAL);
  Emit(SortedTriangles(meshes, FlatMesh::Depth::kVisible, R_DW, view));
  glPopAttrib();
}

}  // namespace mbv::render
