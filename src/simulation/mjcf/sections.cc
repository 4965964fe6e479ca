#include "simulation/mjcf/sections.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>
#include <variant>

#include "mechanism/named_places.h"

namespace mbv::mjcf {
namespace {

constexpr double kRounding = 2e-16;

double Clean(double x) { return std::abs(x) < kRounding ? 0.0 : x; }

}  // namespace

std::string NumberText(double x) {
  std::string text = fmt::format("{}", x == 0.0 ? 0.0 : x);
  // "1e-05" → "1e-5"
  const size_t exponent = text.find('e');
  if (exponent != std::string::npos && exponent + 2 < text.size() && text[exponent + 2] == '0') {
    text.erase(exponent + 2, 1);
  }
  return text;
}

std::string NumbersText(std::span<const double> numbers) {
  std::string text;
  for (double x : numbers) {
    if (!text.empty()) text += ' ';
    text += NumberText(x);
  }
  return text;
}

Eigen::Vector4d QuatOf(const Mat3& R) {
  const Eigen::Quaterniond q(R);
  Eigen::Vector4d wxyz(q.w(), q.x(), q.y(), q.z());
  wxyz /= wxyz.norm();
  for (double& x : wxyz) x = Clean(x);
  // The double cover: first component that is not zero is positive.
  for (double x : wxyz) {
    if (x != 0.0) return x < 0.0 ? Eigen::Vector4d(-wxyz) : wxyz;
  }
  return wxyz;
}

void XmlWriter::Set(const char* name, const Vec3& v) {
  const Vec3 clean = v.unaryExpr(&Clean);
  Set(name, std::span<const double>(clean.data(), 3));
}

void XmlWriter::SetPose(const Pose& X) {
  const Vec3 p = X.translation().unaryExpr(&Clean);
  if (!p.isZero(0.0)) Set("pos", p);
  const Eigen::Vector4d quat = QuatOf(X.linear());
  if (quat != Eigen::Vector4d(1, 0, 0, 0)) Set("quat", std::span<const double>(quat.data(), 4));
}

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

namespace {

void WriteTendon(const Sections& s, const std::string& name, double width) {
  s.xml->Open("spatial");
  s.xml->Set("name", name);
  if (width > 0.0) s.xml->Set("width", width);
}

void WriteSpring(const Sections& s, double stiffness, double damping, double free_length_m) {
  s.xml->Set("stiffness", stiffness);
  s.xml->Set("damping", damping);
  s.xml->Set("springlength", free_length_m);
}

void FinishTendon(const Sections& s, const std::string& name) {
  for (const char* end : {".from", ".to"}) {
    s.xml->Open("site");
    s.xml->Set("site", name + end);
    s.xml->Close();
  }
  s.xml->Close();
}

void WriteClosure(const Sections& s, const PlannedClosure& closure) {
  const bool connect = closure.type == PlannedClosure::Type::kConnect;
  const Joint& joint = s.mechanism.joints[closure.joint];
  s.xml->Open(connect ? "connect" : "weld");
  s.xml->Set("name", closure.name);
  s.xml->Set("body1", s.plan.bodies[closure.body1].name);
  s.xml->Set("body2", s.plan.bodies[closure.body2].name);
  if (connect) {
    s.xml->Set("anchor", Vec3(joint.X_CM.translation()));
  } else {
    // A weld's anchor lies on its second body; the relative pose is taken from home.
    const bool split = closure.type == PlannedClosure::Type::kSplit;
    const bool on_child = split && !closure.split_parent;
    s.xml->Set("anchor", Vec3((on_child ? joint.X_CM : joint.X_PF).translation()));
  }
  s.xml->Close();
}

std::string NameOf(const Sections& s, const Coupling::Term& term) {
  return JointName(s.mechanism.joints[term.joint], term.coordinate);
}

void WriteFixedTendon(const Sections& s, const Coupling& coupling) {
  s.xml->Open("fixed");
  s.xml->Set("name", CouplingName(coupling));
  for (const Coupling::Term& term : coupling.terms) {
    s.xml->Open("joint");
    s.xml->Set("joint", NameOf(s, term));
    s.xml->Set("coef", term.polynomial[0]);
    s.xml->Close();
  }
  s.xml->Close();
}

void WriteCoupling(const Sections& s, const Coupling& coupling) {
  const PlannedCoupling plan = PlanCoupling(s.mechanism, coupling);
  if (plan.type == PlannedCoupling::Type::kUnknown) return;
  const bool joints = plan.type == PlannedCoupling::Type::kJoint;
  s.xml->Open(joints ? "joint" : "tendon");
  s.xml->Set("name", CouplingName(coupling));
  if (joints) {
    s.xml->Set("joint1", NameOf(s, coupling.terms[plan.first]));
    if (plan.second != plan.first) s.xml->Set("joint2", NameOf(s, coupling.terms[plan.second]));
  } else {
    s.xml->Set("tendon1", CouplingName(coupling));
  }
  s.xml->Set("polycoef", plan.polycoef);
  s.xml->Close();
}

// An equality or sensor on one object.
void WriteOn(const Sections& s, const char* element, const std::string& name,
             const char* object_key, const std::string& object, bool active = true) {
  s.xml->Open(element);
  s.xml->Set("name", name);
  if (!active) s.xml->Set("active", "false");
  s.xml->Set(object_key, object);
  s.xml->Close();
}

// The gap of every closure; its force only for split closures, where it is a tree force (MuJoCo
// 2.2.2 has no sensor for the force of a constraint).
void WriteClosureSensors(const Sections& s, const PlannedClosure& closure) {
  const std::string& name = s.mechanism.joints[closure.joint].name;
  s.xml->Open("framepos");
  s.xml->Set("name", name + ".gap");
  s.xml->Set("objtype", "site");
  s.xml->Set("objname", name + ".M");
  s.xml->Set("reftype", "site");
  s.xml->Set("refname", name + ".F");
  s.xml->Close();
  if (closure.type != PlannedClosure::Type::kSplit) return;
  WriteOn(s, "force", name + ".closure_force", "site", name + ".F");
  WriteOn(s, "torque", name + ".closure_torque", "site", name + ".F");
}

}  // namespace

void WriteTendons(const Sections& s) {
  const auto fixed = [&](const Coupling& coupling) {
    return PlanCoupling(s.mechanism, coupling).type == PlannedCoupling::Type::kTendon;
  };
  bool any = !s.mechanism.springs.empty() || std::ranges::any_of(s.mechanism.couplings, fixed);
  for (const Drive& drive : s.mechanism.drives) {
    any = any || std::holds_alternative<DistanceDrive>(drive.kind);
  }
  if (!any) return;
  s.xml->Open("tendon");
  for (const Drive& drive : s.mechanism.drives) {
    if (!std::holds_alternative<DistanceDrive>(drive.kind)) continue;
    WriteTendon(s, drive.name, drive.radius);
    const PlannedForces forces =
        ForcesOfDrive(s.mechanism, static_cast<int>(&drive - s.mechanism.drives.data()));
    if (forces.any()) WriteSpring(s, forces.stiffness, forces.damping, forces.free);
    FinishTendon(s, drive.name);
  }
  for (const SpringDamper& spring : s.mechanism.springs) {
    WriteTendon(s, spring.name, 0.0);
    WriteSpring(s, spring.stiffness, spring.damping, spring.free_length_m);
    FinishTendon(s, spring.name);
  }
  for (const Coupling& coupling : s.mechanism.couplings) {
    if (fixed(coupling)) WriteFixedTendon(s, coupling);
  }
  s.xml->Close();
}

void WriteEqualities(const Sections& s) {
  if (s.plan.closures.empty() && s.mechanism.drives.empty() && s.mechanism.prescribed.empty() &&
      s.mechanism.couplings.empty()) {
    return;
  }
  s.xml->Open("equality");
  for (const PlannedClosure& closure : s.plan.closures) WriteClosure(s, closure);
  for (const Coupling& coupling : s.mechanism.couplings) WriteCoupling(s, coupling);
  for (const Drive& drive : s.mechanism.drives) {
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    const std::string name = DriveEqualityName(drive);
    if (driven == nullptr) {
      WriteOn(s, "tendon", name, "tendon1", drive.name, s.options.prescribed);
    } else if (IsScalar(s.mechanism.joints[driven->joint].kind, driven->coordinate)) {
      WriteOn(s, "joint", name, "joint1",
              JointName(s.mechanism.joints[driven->joint], driven->coordinate),
              s.options.prescribed);
    }
  }
  for (const Prescribed& base : s.mechanism.prescribed) {
    WriteOn(s, "joint", BaseEqualityName(base), "joint1",
            JointName(s.mechanism.joints[base.joint], 0));
  }
  s.xml->Close();
}

void WriteSensors(const Sections& s) {
  if (s.mechanism.drives.empty() && s.plan.closures.empty()) return;
  s.xml->Open("sensor");
  for (const Drive& drive : s.mechanism.drives) {
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    if (driven == nullptr) {
      WriteOn(s, "tendonpos", drive.name + ".position", "tendon", drive.name);
    } else if (IsScalar(s.mechanism.joints[driven->joint].kind, driven->coordinate)) {
      WriteOn(s, "jointpos", drive.name + ".position", "joint",
              JointName(s.mechanism.joints[driven->joint], driven->coordinate));
    } else {
      continue;
    }
    WriteOn(s, "actuatorfrc", drive.name + ".force", "actuator", drive.name);
  }
  for (const PlannedClosure& closure : s.plan.closures) WriteClosureSensors(s, closure);
  s.xml->Close();
}

}  // namespace mbv::mjcf
