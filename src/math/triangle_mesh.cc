#include "math/triangle_mesh.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>

namespace mbv {
namespace {

// Little-endian bytes, as STL asks for on every machine.
template <typename T>
void Append(std::string* out, T value) {
  static_assert(std::endian::native == std::endian::little);
  char bytes[sizeof(T)];
  std::memcpy(bytes, &value, sizeof(T));
  out->append(bytes, sizeof(T));
}

void Append(std::string* out, const Vec3& v) {
  for (int k = 0; k < 3; ++k) Append(out, static_cast<float>(v[k]));
}

// Twice the area times the unit normal.
Vec3 AreaVector(const TriangleMesh& mesh, const std::array<int, 3>& t) {
  const Vec3& p = mesh.vertices[t[0]];
  return (mesh.vertices[t[1]] - p).cross(mesh.vertices[t[2]] - p);
}

}  // namespace

SolidProperties PropertiesOf(const TriangleMesh& mesh) {
  double volume = 0.0, area = 0.0;
  Vec3 moment = Vec3::Zero();
  for (const auto& t : mesh.triangles) {
    const Vec3 &p = mesh.vertices[t[0]], &q = mesh.vertices[t[1]], &r = mesh.vertices[t[2]];
    // The tetrahedron from the origin to the triangle.
    const double tetrahedron = p.dot(q.cross(r)) / 6.0;
    volume += tetrahedron;
    moment += tetrahedron / 4.0 * (p + q + r);
    area += 0.5 * AreaVector(mesh, t).norm();
  }
  return {volume, area, moment / volume};
}

double AreaOf(const TriangleMesh& mesh, size_t first, size_t count) {
  double area = 0.0;
  for (size_t i = first; i < first + count; ++i) {
    area += 0.5 * AreaVector(mesh, mesh.triangles[i]).norm();
  }
  return area;
}

bool IsClosed(const TriangleMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;  // directed edges
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) ++edges[{t[k], t[(k + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto back = edges.find({edge.second, edge.first});
    if (count != 1 || back == edges.end()) return false;
  }
  return !edges.empty();
}

std::string ToStl(const TriangleMesh& mesh, const std::string& title) {
  std::string out = title.substr(0, 80);
  out.resize(80, ' ');
  Append(&out, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const auto& t : mesh.triangles) {
    Append(&out, Vec3(AreaVector(mesh, t).normalized()));
    for (int corner : t) Append(&out, mesh.vertices[corner]);
    Append(&out, std::uint16_t{0});
  }
  return out;
}

std::string ToPly(const TriangleMesh& mesh, const std::string& title) {
  std::string out = fmt::format(
      "ply\nformat ascii 1.0\ncomment {}; metres\nelement vertex {}\nproperty double x\n"
      "property double y\nproperty double z\nelement face {}\n"
      "property list uchar int vertex_indices\nend_header\n",
      title, mesh.vertices.size(), mesh.triangles.size());
  for (const Vec3& p : mesh.vertices) {
    out += fmt::format("{:.15g} {:.15g} {:.15g}\n", p.x(), p.y(), p.z());
  }
  for (const auto& t : mesh.triangles) out += fmt::format("3 {} {} {}\n", t[0], t[1], t[2]);
  return out;
}

}  // namespace mbv
