// Meshes of solids whose mass properties are known, and bodies made of them.
#pragma once

#include <cmath>
#include <memory>
#include <numbers>

#include "mechanism/mechanism.h"
#include "model_file/mesh/mass_properties.h"

namespace mbv::test {

/// A polygon (counter-clockwise, seen whole from its first corner), extruded from z = 0 to
/// `height`.
inline TriangleMesh Prism(const std::vector<Eigen::Vector2d>& outline, double height) {
  TriangleMesh mesh;
  const int n = static_cast<int>(outline.size());
  for (const double z : {0.0, height}) {
    for (const auto& p : outline) mesh.vertices.emplace_back(p.x(), p.y(), z);
  }
  for (int k = 0; k < n; ++k) {
    const int next = (k + 1) % n;
    mesh.triangles.push_back({k, next, n + next});
    mesh.triangles.push_back({k, n + next, n + k});
    if (k == 0 || next == 0) continue;
    mesh.triangles.push_back({0, next, k});
    mesh.triangles.push_back({n, n + k, n + next});
  }
  return mesh;
}

inline std::vector<Eigen::Vector2d> Circle(double radius, int corners) {
  std::vector<Eigen::Vector2d> outline;
  for (int k = 0; k < corners; ++k) {
    const double angle = 2.0 * std::numbers::pi * k / corners;
    outline.emplace_back(radius * std::cos(angle), radius * std::sin(angle));
  }
  return outline;
}

inline TriangleMesh Moved(TriangleMesh mesh, const Pose& X) {
  for (Vec3& p : mesh.vertices) p = X * p;
  return mesh;
}
inline Pose At(const Vec3& p, const Mat3& R = Mat3::Identity()) {
  Pose X = Pose::Identity();
  X.translation() = p;
  X.linear() = R;
  return X;
}

inline TriangleMesh Together(TriangleMesh a, const TriangleMesh& b) {
  const int first = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  for (const auto& t : b.triangles)
    a.triangles.push_back({first + t[0], first + t[1], first + t[2]});
  return a;
}

/// Edges a, b, c along x, y, z from the origin [m].
inline TriangleMesh BoxMesh(double a, double b, double c) {
  return Prism({{0, 0}, {a, 0}, {a, b}, {0, b}}, c);
}
/// Arms along x and y from the origin, `thick` wide, extruded along z.
inline TriangleMesh BracketMesh(double x, double y, double thick, double height) {
  return Prism({{thick, thick}, {thick, y}, {0, y}, {0, 0}, {x, 0}, {x, thick}}, height);
}
inline TriangleMesh CylinderMesh(double radius, double height, int corners = 64) {
  return Prism(Circle(radius, corners), height);
}

/// Around z, standing on z = 0.
inline TriangleMesh TubeMesh(double outer, double inner, double height, int corners = 64) {
  TriangleMesh mesh;
  const int n = corners;
  for (const double radius : {outer, inner}) {
    for (const double z : {0.0, height}) {
      for (const auto& p : Circle(radius, n)) mesh.vertices.emplace_back(p.x(), p.y(), z);
    }
  }
  const auto quad = [&](int a, int b, int c, int d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  for (int k = 0; k < n; ++k) {
    const int j = (k + 1) % n;
    quad(k, j, n + j, n + k);                          // outside
    quad(2 * n + j, 2 * n + k, 3 * n + k, 3 * n + j);  // inside
    quad(j, k, 2 * n + k, 2 * n + j);                  // bottom
    quad(n + k, n + j, 3 * n + j, 3 * n + k);          // top
  }
  return mesh;
}

/// About the origin; its volume is some per mille below that of the smooth one.
inline TriangleMesh EllipsoidMesh(const Vec3& axes, int rings = 48) {
  TriangleMesh mesh;
  const int sectors = 2 * rings;
  mesh.vertices.emplace_back(0, 0, axes.z());
  for (int r = 1; r < rings; ++r) {
    const double polar = std::numbers::pi * r / rings;
    for (const auto& p : Circle(std::sin(polar), sectors)) {
      mesh.vertices.emplace_back(axes.x() * p.x(), axes.y() * p.y(), axes.z() * std::cos(polar));
    }
  }
  mesh.vertices.emplace_back(0, 0, -axes.z());
  const int last = static_cast<int>(mesh.vertices.size()) - 1;
  for (int s = 0; s < sectors; ++s) {
    const int t = (s + 1) % sectors;
    mesh.triangles.push_back({0, 1 + s, 1 + t});
    for (int r = 0; r + 2 < rings; ++r) {
      const int a = 1 + r * sectors, b = a + sectors;
      mesh.triangles.push_back({a + s, b + s, b + t});
      mesh.triangles.push_back({a + s, b + t, a + t});
    }
    const int ring = last - sectors;
    mesh.triangles.push_back({ring + s, last, ring + t});
  }
  return mesh;
}

/// A body that shows `mesh` and states what a homogeneous solid of it has.
inline Body SoundBody(const TriangleMesh& mesh, double density,
                      const Pose& X_BG = Pose::Identity()) {
  Body body;
  body.name = "part";
  body.shapes.push_back(
      {Mesh{
           .X_BG = X_BG, .file = "part.stl", .surface = std::make_shared<const TriangleMesh>(mesh)},
       "steel"});
  const MassShape solid = SolidShape(Moved(mesh, X_BG));
  body.mass = density * solid.amount;
  body.p_BoBcm_B = solid.p_cm;
  body.I_Bcm_B = body.mass * solid.G_cm;
  return body;
}

}  // namespace mbv::test
