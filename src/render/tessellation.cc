#include "render/tessellation.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model_file/mesh/decimate.h"

namespace mbv::render {
namespace {

constexpr double kSagitta_px = 0.15;  // by which a side may miss its arc
constexpr double kEdge_rad = 0.6;     // sharper edges of meshes stay edges

// A circle about z with the normals on it, their part across and along z.
struct Circle {
  double radius, height, across, along;
};

void AddBand(const Circle& low, const Circle& high, int sides, int face, Facets* out) {
  const int first = static_cast<int>(out->points_G.size());
  for (int i = 0; i < sides; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / sides, c = std::cos(angle),
                 s = std::sin(angle);
    for (const Circle& ring : {low, high}) {
      out->points_G.emplace_back(ring.radius * c, ring.radius * s, ring.height);
      out->normals_G.emplace_back(ring.across * c, ring.across * s, ring.along);
      out->faces.push_back(face);
    }
    const int a = first + 2 * i, b = first + 2 * ((i + 1) % sides);
    if (low.radius > 0.0) out->triangles.push_back({a, b, a + 1});
    if (high.radius > 0.0) out->triangles.push_back({a + 1, b, b + 1});
  }
}

// A part of a ball about (0, 0, centre), between two latitudes.
void AddCap(double centre, double radius, double from, double to, int sides, Facets* out) {
  const int bands =
      std::max(2, static_cast<int>(std::lround(sides * (to - from) / (2.0 * std::numbers::pi))));
  const auto ring = [&](int i) {
    const double latitude = from + (to - from) * i / bands;
    const bool pole = std::abs(std::abs(latitude) - 0.5 * std::numbers::pi) < 1e-9;
    const double c = pole ? 0.0 : std::cos(latitude), s = std::sin(latitude);
    return Circle{.radius = radius * c, .height = centre + radius * s, .across = c, .along = s};
  };
  for (int i = 0; i < bands; ++i) AddBand(ring(i), ring(i + 1), sides, 0, out);
}

void AddSide(double radius, double from, double to, int sides, Facets* out) {
  AddBand({radius, from, 1.0, 0.0}, {radius, to, 1.0, 0.0}, sides, 0, out);
}

// A flat ring or disc that looks up (+1) or down (-1).
void AddDisc(double inner, double outer, double height, double up, int sides, int face,
             Facets* out) {
  const Circle a{inner, height, 0.0, up}, b{outer, height, 0.0, up};
  AddBand(up > 0.0 ? b : a, up > 0.0 ? a : b, sides, face, out);
}

// The head is as AddArrowGhost() draws its outline.
void AddArrow(double radius, double length, int sides, Facets* out) {
  const double neck = length - std::min(6.0 * radius, 0.5 * length);
  const double slope = std::hypot(2.0 * radius, length - neck);
  const double across = (length - neck) / slope, along = 2.0 * radius / slope;
  AddDisc(0.0, radius, 0.0, -1.0, sides, 1, out);
  AddSide(radius, 0.0, neck, sides, out);
  AddDisc(radius, 2.0 * radius, neck, -1.0, sides, 2, out);
  AddBand({2.0 * radius, neck, across, along}, {0.0, length, across, along}, sides, 3, out);
}

void AddBox(const Vec3& half, Facets* out) {
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const double side : {-1.0, 1.0}) {
      const int first = static_cast<int>(out->points_G.size());
      for (const auto& [a, b] : {std::pair(-1.0, -1.0), {1.0, -1.0}, {1.0, 1.0}, {-1.0, 1.0}}) {
        Vec3 p;
        p[axis] = side * half[axis];
        p[u] = side * a * half[u];
        p[v] = b * half[v];
        out->points_G.push_back(p);
        out->normals_G.emplace_back(side * Vec3::Unit(axis));
        out->faces.push_back(2 * axis + (side > 0.0 ? 1 : 0));
      }
      out->triangles.push_back({first, first + 1, first + 2});
      out->triangles.push_back({first, first + 2, first + 3});
    }
  }
}

}  // namespace

Facets FacetsOf(const Item& item, int sides) {
  Facets out;
  const double r = item.size.x(), half = item.size.z();
  switch (item.solid) {
    case Solid::kBall:
      AddCap(0.0, r, -0.5 * std::numbers::pi, 0.5 * std::numbers::pi, sides, &out);
      break;
    case Solid::kCapsule:
      AddCap(-half, r, -0.5 * std::numbers::pi, 0.0, sides, &out);
      AddSide(r, -half, half, sides, &out);
      AddCap(half, r, 0.0, 0.5 * std::numbers::pi, sides, &out);
      break;
    case Solid::kCylinder:
      AddDisc(0.0, r, -half, -1.0, sides, 1, &out);
      AddSide(r, -half, half, sides, &out);
      AddDisc(0.0, r, half, 1.0, sides, 2, &out);
      break;
    case Solid::kBox:
      AddBox(item.size, &out);
      break;
    case Solid::kArrow:
      AddArrow(r, half, sides, &out);
      break;
    case Solid::kMesh:
      break;
  }
  return out;
}

Facets FacetsOf(const TriangleMesh& mesh, std::size_t most) {
  const TriangleMesh drawn = WithSharpEdges(Decimated(mesh, most), kEdge_rad);
  Facets out{.points_G = drawn.vertices,
             .normals_G = std::vector<Vec3>(drawn.vertices.size(), Vec3::Zero()),
             .faces = std::vector<int>(drawn.vertices.size(), 0)};
  for (const auto& [i, j, k] : drawn.triangles) {
    const Vec3 &a = drawn.vertices[i], &b = drawn.vertices[j], &c = drawn.vertices[k];
    const Vec3 normal = (b - a).cross(c - a);  // as long as twice the area
    for (const auto corner : {i, j, k}) out.normals_G[corner] += normal;
    out.triangles.push_back({static_cast<int>(i), static_cast<int>(j), static_cast<int>(k)});
  }
  for (Vec3& normal : out.normals_G) {
    normal = normal.norm() > 0.0 ? Vec3(normal.normalized()) : Vec3::UnitZ();
  }
  return out;
}

int SidesFor(double radius_px) {
  if (!(radius_px > kSagitta_px)) return 8;
  const double sides = std::numbers::pi / std::acos(1.0 - kSagitta_px / radius_px);
  return std::clamp(static_cast<int>(std::ceil(sides)), 8, 160);
}

}  // namespace mbv::render
