#include "mjcf/scene.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <set>
#include <string_view>

namespace mbv::mjcf {
namespace {

struct NamedColor {
  std::string_view name;
  std::array<double, 4> rgba;
};
constexpr std::array kColors{
    NamedColor{"accent", {0.93, 0.55, 0.14, 1}},    NamedColor{"aluminium", {0.78, 0.8, 0.83, 1}},
    NamedColor{"base", {0.27, 0.3, 0.34, 1}},       NamedColor{"black", {0.1, 0.1, 0.11, 1}},
    NamedColor{"blue", {0.2, 0.42, 0.7, 1}},        NamedColor{"brass", {0.8, 0.65, 0.3, 1}},
    NamedColor{"copper", {0.74, 0.45, 0.28, 1}},    NamedColor{"dark_steel", {0.34, 0.37, 0.41, 1}},
    NamedColor{"deck", {0.52, 0.57, 0.58, 1}},      NamedColor{"glass", {0.7, 0.82, 0.9, 0.3}},
    NamedColor{"green", {0.27, 0.57, 0.36, 1}},     NamedColor{"hull", {0.36, 0.14, 0.13, 1}},
    NamedColor{"light_grey", {0.8, 0.81, 0.82, 1}}, NamedColor{"red", {0.75, 0.2, 0.17, 1}},
    NamedColor{"rubber", {0.16, 0.16, 0.17, 1}},    NamedColor{"sea", {0.16, 0.37, 0.5, 1}},
    NamedColor{"steel", {0.6, 0.64, 0.69, 1}},      NamedColor{"white", {0.93, 0.93, 0.92, 1}},
    NamedColor{"wood", {0.72, 0.56, 0.38, 1}},      NamedColor{"yellow", {0.93, 0.77, 0.2, 1}},
};
constexpr std::array<double, 4> kGrey{0.58, 0.6, 0.62, 1};

std::array<double, 4> ColorOf(const std::string& color) {
  for (const NamedColor& named : kColors) {
    if (named.name == color) return named.rgba;
  }
  if (color.size() != 7 && color.size() != 9) return kGrey;
  std::array<double, 4> rgba{0, 0, 0, 1};
  for (size_t i = 0; 2 * i + 2 < color.size(); ++i) {
    unsigned value = 0;
    std::from_chars(color.data() + 1 + 2 * i, color.data() + 3 + 2 * i, value, 16);
    rgba[i] = value / 255.0;
  }
  return rgba;
}

struct Bounds {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

  void Add(const Vec3& p, double radius) {
    low = low.cwiseMin(p - Vec3::Constant(radius));
    high = high.cwiseMax(p + Vec3::Constant(radius));
  }
  [[nodiscard]] bool empty() const { return low.x() > high.x(); }
};

struct ShapeWriter {
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
};

// MuJoCo refuses sticks without length and solids without size.
bool IsDrawable(const Shape& shape) {
  struct Test {
    bool operator()(const Capsule& c) const { return Stick(c.p_from, c.p_to, c.radius); }
    bool operator()(const Cylinder& c) const { return Stick(c.p_from, c.p_to, c.radius); }
    bool operator()(const Box& b) const { return b.size.minCoeff() > 0.0; }
    bool operator()(const Ball& b) const { return b.radius > 0.0; }
    static bool Stick(const Vec3& p, const Vec3& q, double radius) {
      return radius > 0.0 && (q - p).norm() > 1e-9;
    }
  };
  return std::visit(Test{}, shape.geometry);
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

void WriteMaterials(const Mechanism& mechanism, XmlWriter* xml) {
  std::set<std::string> names{"ground"};
  for (const Body& body : mechanism.bodies) {
    for (const Shape& shape : body.shapes) names.insert(shape.color);
  }
  xml->Open("asset");
  for (const std::string& name : names) {
    xml->Open("material");
    xml->Set("name", name);
    xml->Set("rgba", name == "ground" ? std::array<double, 4>{0.87, 0.87, 0.86, 1} : ColorOf(name));
    xml->Close();
  }
  xml->Close();
}

void WriteSurroundings(const Mechanism& mechanism, XmlWriter* xml) {
  const Bounds bounds = HomeBounds(mechanism);
  if (bounds.empty()) return;
  const double weight = mechanism.gravity_W.norm();
  const Vec3 up = weight > 0.0 ? Vec3(-mechanism.gravity_W / weight) : Vec3::UnitZ();
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

void WriteShapes(const Body& body, XmlWriter* xml) {
  for (const Shape& shape : body.shapes) {
    if (!IsDrawable(shape)) continue;
    xml->Open("geom");
    std::visit(ShapeWriter{xml}, shape.geometry);
    xml->Set("material", shape.color);
    xml->Close();
  }
}

}  // namespace mbv::mjcf
