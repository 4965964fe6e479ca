#include "mesh/mass_properties.h"

#include <cmath>

namespace mbv {
namespace {

// Sums over pieces: amount, first and second moments about a point near the mesh.
struct Moments {
  double amount = 0.0;
  Vec3 first = Vec3::Zero();
  Mat3 second = Mat3::Zero();
};

Vec3 MiddleOf(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : mesh.vertices) box.extend(p);
  return box.isEmpty() ? Vec3(Vec3::Zero()) : Vec3(box.center());
}

MassShape ShapeOf(const Moments& m, const Vec3& origin) {
  const Vec3 c = m.first / m.amount;
  const Mat3 C = m.second / m.amount - c * c.transpose();
  return {std::abs(m.amount), origin + c, C.trace() * Mat3::Identity() - C};
}

}  // namespace

MassShape SolidShape(const TriangleMesh& mesh) {
  const Vec3 origin = MiddleOf(mesh);  // far from the origin, the moments would cancel
  Moments sum;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin, s = a + b + c;
    const double V = a.dot(b.cross(c)) / 6.0;
    sum.amount += V;
    sum.first += V / 4.0 * s;
    sum.second +=
        V / 20.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return ShapeOf(sum, origin);
}

MassShape ShellShape(const TriangleMesh& mesh) {
  const Vec3 origin = MiddleOf(mesh);
  Moments sum;
  for (const auto& t : mesh.triangles) {
    const Vec3 a = mesh.vertices[t[0]] - origin, b = mesh.vertices[t[1]] - origin,
               c = mesh.vertices[t[2]] - origin, s = a + b + c;
    const double A = 0.5 * (b - a).cross(c - a).norm();
    sum.amount += A;
    sum.first += A / 3.0 * s;
    sum.second +=
        A / 12.0 * (a * a.transpose() + b * b.transpose() + c * c.transpose() + s * s.transpose());
  }
  return ShapeOf(sum, origin);
}

Mat3 PointInertia(const Vec3& p) { return p.squaredNorm() * Mat3::Identity() - p * p.transpose(); }

}  // namespace mbv
