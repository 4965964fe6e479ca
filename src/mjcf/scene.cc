#include "mjcf/scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "mechanism/colors.h"

namespace mbv::mjcf {
namespace {

struct Bounds {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

  void Add(const Vec3& p, double radius) {
    low = low.cwiseMin(p - Vec3::Constant(radius));
    high = high.cwiseMax(p + Vec3::Constant(radius));
  }
  [[nodiscard]] bool empty() const { return low.x() > high.x(); }
};

std::string MeshName(int index) { return fmt::format("mesh_{}", index); }

// MuJoCo refuses meshes of fewer than four vertices.
bool IsDrawable(const TriangleMesh& mesh) {
  return mesh.vertices.size() >= 4 && !mesh.triangles.empty();
}

struct ShapeWriter {
  const DrawnSurfaces& surfaces;
  XmlWriter* xml;

  void Stick(const char* type, const Vec3& from, const Vec3& to, double radius) const {
    xml->Set("type", type);
    xml->Set("size", radius);
    const std::array<double, 6> ends{from.x(), from.y(), from.z(), to.x(), to.y(), to.z()};
    xml->Set("fromto", ends);
  }
  void operator()(const Capsule& c) const { Stick("capsule", c.p_from, c.p_to, c.radius); }
  void operator()(const Cylinder& c) const { Stick("cylinder", c.p_from, c.p_to, c.radius); }
  void operator()(const Box& b) const {
    xml->Set("type", "box");
    xml->Set("size", Vec3(0.5 * b.size));
    xml->SetPose(b.X_BG);
  }
  void operator()(const Ball& b) const {
    xml->Set("type", "sphere");
    xml->Set("size", b.radius);
    xml->Set("pos", b.p_centre);
  }
  // The compiler moves the frame of a mesh and the geom against it: here it is still the file's.
  void operator()(const Mesh& m) const {
    xml->Set("type", "mesh");
    xml->Set("mesh", MeshName(surfaces.IndexOf(m)));
    xml->SetPose(m.X_BG);
  }
};

// MuJoCo refuses sticks without length and solids without size.
bool IsDrawable(const Shape& shape, const DrawnSurfaces& surfaces) {
  struct Test {
    const DrawnSurfaces& surfaces;
    bool operator()(const Capsule& c) const { return Stick(c.p_from, c.p_to, c.radius); }
    bool operator()(const Cylinder& c) const { return Stick(c.p_from, c.p_to, c.radius); }
    bool operator()(const Box& b) const { return b.size.minCoeff() > 0.0; }
    bool operator()(const Ball& b) const { return b.radius > 0.0; }
    bool operator()(const Mesh& m) const {
      const int index = surfaces.IndexOf(m);
      return index >= 0 && IsDrawable(*surfaces.drawn()[index]);
    }
    static bool Stick(const Vec3& p, const Vec3& q, double radius) {
      return radius > 0.0 && (q - p).norm() > 1e-9;
    }
  };
  return std::visit(Test{surfaces}, shape.geometry);
}

// Origins of all bodies and frames at home.
Bounds HomeBounds(const Mechanism& mechanism) {
  Bounds bounds;
  for (size_t b = 1; b < mechanism.bodies.size(); ++b) {
    bounds.Add(mechanism.X_WB_home[b].translation(), 0.0);
    for (const NamedFrame& frame : mechanism.bodies[b].frames) {
      bounds.Add((mechanism.X_WB_home[b] * frame.X_BF).translation(), 0.0);
    }
  }
  return bounds;
}

}  // namespace

namespace {

void WriteMesh(const TriangleMesh& mesh, const std::string& name, XmlWriter* xml) {
  std::string vertices, triangles;
  for (const Vec3& p : mesh.vertices) {
    vertices +=
        fmt::format("{}{:.6g} {:.6g} {:.6g}", vertices.empty() ? "" : " ", p.x(), p.y(), p.z());
  }
  for (const auto& t : mesh.triangles) {
    triangles += fmt::format("{}{} {} {}", triangles.empty() ? "" : " ", t[0], t[1], t[2]);
  }
  xml->Open("mesh");
  xml->Set("name", name);
  xml->Set("vertex", vertices);
  xml->Set("face", triangles);
  xml->Close();
}

}  // namespace

void WriteAssets(const Mechanism& mechanism, const DrawnSurfaces& surfaces, XmlWriter* xml) {
  std::set<std::string> names{"ground"};
  for (const Body& body : mechanism.bodies) {
    for (const Shape& shape : body.shapes) names.insert(shape.color);
  }
  xml->Open("asset");
  for (const std::string& name : names) {
    xml->Open("material");
    xml->Set("name", name);
    xml->Set("rgba",
             name == "ground" ? std::array<double, 4>{0.87, 0.87, 0.86, 1} : ShapeColor(name));
    xml->Close();
  }
  for (size_t i = 0; i < surfaces.drawn().size(); ++i) {
    const TriangleMesh& mesh = *surfaces.drawn()[i];
    if (IsDrawable(mesh)) WriteMesh(mesh, MeshName(static_cast<int>(i)), xml);
  }
  xml->Close();
}

void WriteSurroundings(const Mechanism& mechanism, XmlWriter* xml) {
  const Bounds bounds = HomeBounds(mechanism);
  if (bounds.empty()) return;
  const Vec3& up = mechanism.up_W;
  const Vec3 centre = 0.5 * (bounds.low + bounds.high);
  const double extent = std::max((bounds.high - bounds.low).norm(), 1e-3);
  const Vec3 side = up.unitOrthogonal();
  // Two lights from above, and the ground below everything at home.
  for (double sign : {1.0, -1.0}) {
    const Vec3 p = centre + extent * (2.0 * up + sign * side);
    xml->Open("light");
    xml->Set("directional", "true");
    xml->Set("pos", p);
    xml->Set("dir", Vec3((centre - p).normalized()));
    xml->Set("diffuse", Vec3(0.45, 0.45, 0.45));
    xml->Set("castshadow", sign > 0.0 ? "true" : "false");
    xml->Close();
  }
  double lowest = 1e300;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p((corner & 1 ? bounds.high : bounds.low).x(),
                 (corner & 2 ? bounds.high : bounds.low).y(),
                 (corner & 4 ? bounds.high : bounds.low).z());
    lowest = std::min(lowest, up.dot(p));
  }
  const Vec3 ground = centre + (lowest - 0.05 * extent - up.dot(centre)) * up;
  xml->Open("geom");
  xml->Set("name", "ground");
  xml->Set("type", "plane");
  const std::array<double, 3> size{5.0 * extent, 5.0 * extent, extent};
  xml->Set("size", size);
  xml->Set("pos", ground);
  xml->Set("zaxis", up);
  xml->Set("material", "ground");
  xml->Close();
}

void WriteShapes(const Body& body, const DrawnSurfaces& surfaces, XmlWriter* xml) {
  for (const Shape& shape : body.shapes) {
    if (!IsDrawable(shape, surfaces)) continue;
    xml->Open("geom");
    std::visit(ShapeWriter{surfaces, xml}, shape.geometry);
    xml->Set("material", shape.color);
    xml->Close();
  }
}

}  // namespace mbv::mjcf
