#include "simulation/mjcf/foreign_frames.h"

#include <fmt/format.h>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <locale>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "base/types.h"

namespace mbv::mjcf {
namespace {

using tinyxml2::XMLElement;
using tinyxml2::XMLNode;

constexpr std::array<const char*, 5> kOrientations = {"quat", "axisangle", "euler", "xyaxes",
                                                      "zaxis"};

bool IsOneOf(const XMLElement* e, std::initializer_list<const char*> tags) {
  for (const char* tag : tags) {
    if (IsTag(e, tag)) return true;
  }
  return false;
}

}  // namespace

double AngleUnit(const XMLElement* root) {
  double unit = std::numbers::pi / 180.0;
  for (const XMLElement* e = root->FirstChildElement("compiler"); e != nullptr;
       e = e->NextSiblingElement("compiler")) {
    const char* angle = e->Attribute("angle");
    if (angle != nullptr) unit = std::string_view(angle) == "radian" ? 1.0 : std::numbers::pi / 180;
  }
  return unit;
}

const char* Inherited(const XMLElement* e, const char* attribute) {
  if (const char* own = e->Attribute(attribute)) return own;
  const XMLElement* root = e->GetDocument()->RootElement();
  const char* name = e->Attribute("class");
  for (const XMLNode* up = e->Parent(); name == nullptr && up != nullptr; up = up->Parent()) {
    if (up->ToElement() != nullptr) name = up->ToElement()->Attribute("childclass");
  }
  const XMLElement* of_class = nullptr;
  const auto visit = [&](const auto& self, const XMLElement* parent) -> void {
    for (const XMLElement* d = parent->FirstChildElement("default"); d != nullptr;
         d = d->NextSiblingElement("default")) {
      const char* is = d->Attribute("class");
      const bool meant =
          name == nullptr ? parent == root : is != nullptr && std::string_view(is) == name;
      if (meant && of_class == nullptr) of_class = d;
      self(self, d);
    }
  };
  visit(visit, root);
  for (const XMLElement* d = of_class; d != nullptr && IsTag(d, "default");
       d = d->Parent()->ToElement()) {
    const XMLElement* row = d->FirstChildElement(e->Name());
    const char* value = row == nullptr ? nullptr : row->Attribute(attribute);
    if (value != nullptr) return value;
  }
  return nullptr;
}

namespace {

class FrameDissolver {
 public:
  explicit FrameDissolver(tinyxml2::XMLDocument* document) : document_(*document) {}

  FrameTrouble Run(std::optional<double> unit) {
    ReadCompiler();
    // The innermost first: names get its suffix before those of the outer ones.
    while (trouble_.text.empty()) {
      XMLElement* innermost = nullptr;
      ForEach(root(), [&](XMLElement* e) {
        if (IsTag(e, "replicate")) innermost = e;
      });
      if (innermost == nullptr) break;
      Replicate(innermost);
    }
    while (trouble_.text.empty()) {
      XMLElement* outermost = nullptr;
      ForEach(root(), [&](XMLElement* e) {
        if (outermost == nullptr && IsTag(e, "frame")) outermost = e;
      });
      if (outermost == nullptr) break;
      Dissolve(outermost);
    }
    if (unit && trouble_.text.empty()) StateAngles(*unit);
    return trouble_;
  }

 private:
  XMLElement* root() { return document_.RootElement(); }

  void Fail(const XMLElement* at, const std::string& text, const std::string& hint = "") {
    if (trouble_.text.empty()) trouble_ = {at->GetLineNum(), text, hint};
  }

  void ReadCompiler() {
    unit_ = AngleUnit(root());
    for (XMLElement* e = root()->FirstChildElement("compiler"); e != nullptr;
         e = e->NextSiblingElement("compiler")) {
      if (const char* order = e->Attribute("eulerseq")) order_ = order;
    }
  }

  std::vector<double> Numbers(const XMLElement* e, const char* attribute, const char* text,
                              size_t count) {
    std::istringstream stream(text);
    stream.imbue(std::locale::classic());
    std::vector<double> numbers;
    for (double x = 0.0; stream >> x;) numbers.push_back(x);
    if (numbers.size() == count && stream.eof()) return numbers;
    Fail(e, fmt::format("<{}> {} = '{}' is not {} numbers", e->Name(), attribute, text, count));
    return std::vector<double>(count, 0.0);
  }
  Vec3 Vector(const XMLElement* e, const char* attribute, const char* text) {
    const std::vector<double> v = Numbers(e, attribute, text, 3);
    return {v[0], v[1], v[2]};
  }

  Mat3 EulerRotation(const Vec3& angles) const {
    Mat3 R = Mat3::Identity();
    for (size_t k = 0; k < 3 && k < order_.size(); ++k) {
      const int axis = std::tolower(order_[k]) - 'x';
      if (axis < 0 || axis > 2) continue;
      const Mat3 turn =
          Eigen::AngleAxisd(angles[static_cast<int>(k)], Vec3::Unit(axis)).toRotationMatrix();
      R = std::islower(order_[k]) != 0 ? Mat3(R * turn) : Mat3(turn * R);
    }
    return R;
  }

  Mat3 RotationOf(const XMLElement* e) {
    // The element's own words go before those of its class, whichever they are.
    const char* attribute = nullptr;
    for (const char* each : kOrientations) {
      if (attribute == nullptr && e->Attribute(each) != nullptr) attribute = each;
    }
    for (const char* each : kOrientations) {
      if (attribute == nullptr && Inherited(e, each) != nullptr) attribute = each;
    }
    if (attribute == nullptr) return Mat3::Identity();
    const char* text = Inherited(e, attribute);
    const std::string_view kind = attribute;
    if (kind == "quat") {
      const auto q = Numbers(e, attribute, text, 4);
      return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
    }
    if (kind == "axisangle") {
      const auto v = Numbers(e, attribute, text, 4);
      return Eigen::AngleAxisd(unit_ * v[3], Vec3(v[0], v[1], v[2]).normalized())
          .toRotationMatrix();
    }
    if (kind == "euler") return EulerRotation(unit_ * Vector(e, attribute, text));
    if (kind == "zaxis") {
      return Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), Vector(e, attribute, text))
          .toRotationMatrix();
    }
    const auto v = Numbers(e, attribute, text, 6);
    Mat3 R;
    R.col(0) = Vec3(v[0], v[1], v[2]).normalized();
    const Vec3 y(v[3], v[4], v[5]);
    R.col(1) = (y - y.dot(R.col(0)) * R.col(0)).normalized();
    R.col(2) = R.col(0).cross(R.col(1));
    return R;
  }

  Pose PoseOf(const XMLElement* e) {
    Pose X = Pose::Identity();
    if (const char* text = Inherited(e, "pos")) X.translation() = Vector(e, "pos", text);
    X.linear() = RotationOf(e);
    if (!X.matrix().allFinite()) Fail(e, fmt::format("<{}> has no pose", e->Name()));
    return X;
  }

  static std::string TextOf(const Vec3& v) { return fmt::format("{} {} {}", v.x(), v.y(), v.z()); }
  static void SetPosition(XMLElement* e, const Vec3& p) {
    e->SetAttribute("pos", TextOf(p).c_str());
  }
  static void SetPose(XMLElement* e, const Pose& X) {
    SetPosition(e, X.translation());
    for (const char* attribute : kOrientations) e->DeleteAttribute(attribute);
    const Eigen::Quaterniond q(X.linear());
    e->SetAttribute("quat", fmt::format("{} {} {} {}", q.w(), q.x(), q.y(), q.z()).c_str());
  }

  void Dissolve(XMLElement* frame) {
    const Pose X = PoseOf(frame);
    const char* childclass = frame->Attribute("childclass");
    XMLNode *parent = frame->Parent(), *last = frame;
    while (XMLElement* child = frame->FirstChildElement()) {
      if (childclass != nullptr) {
        const bool of_tree = IsOneOf(child, {"body", "frame"});
        const char* key = of_tree ? "childclass" : "class";
        if (child->Attribute(key) == nullptr &&
            IsOneOf(child, {"body", "frame", "joint", "geom", "site"})) {
          child->SetAttribute(key, childclass);
        }
      }
      Shift(X, child);
      last = parent->InsertAfterChild(last, child);
      if (!trouble_.text.empty()) return;
    }
    document_.DeleteNode(frame);
  }

  // Orientations as quaternions, angles of joints in `unit`; no class states any.
  void StateAngles(double unit) {
    std::vector<XMLElement*> rows;
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      if (parent != nullptr && IsTag(parent, "default")) {
        rows.push_back(e);
      } else if (IsOneOf(e, {"body", "geom", "site", "inertial"})) {
        StateOrientation(e);
      } else if (IsTag(e, "joint") && parent != nullptr && IsOneOf(parent, {"body", "worldbody"})) {
        StateJoint(unit, e);
      }
    });
    for (XMLElement* row : rows) {
      for (const char* attribute : kOrientations) row->DeleteAttribute(attribute);
      if (!IsTag(row, "joint")) continue;
      for (const char* attribute : {"range", "ref", "springref"}) row->DeleteAttribute(attribute);
    }
  }

  void StateOrientation(XMLElement* e) {
    bool turned = false;
    for (const char* each : kOrientations) turned = turned || Inherited(e, each) != nullptr;
    const bool spans = IsOneOf(e, {"geom", "site"}) && Inherited(e, "fromto") != nullptr;
    if (turned && !spans) SetPose(e, PoseOf(e));
  }

  void StateJoint(double unit, XMLElement* e) {
    const char* type = Inherited(e, "type");
    const bool turns =
        type == nullptr || std::string_view(type) == "hinge" || std::string_view(type) == "ball";
    const double factor = turns ? unit_ / unit : 1.0;
    for (const auto& [attribute, count] : {std::pair("range", 2), {"ref", 1}, {"springref", 1}}) {
      const char* text = Inherited(e, attribute);
      if (text == nullptr) continue;
      std::string scaled = text;
      if (factor != 1.0) {
        scaled.clear();
        for (const double x : Numbers(e, attribute, text, static_cast<size_t>(count))) {
          scaled += fmt::format("{}{}", scaled.empty() ? "" : " ", factor * x);
        }
      }
      e->SetAttribute(attribute, scaled.c_str());
    }
  }

  // Poses an element of a frame as if it stood outside.
  void Shift(const Pose& X, XMLElement* e) {
    const char* fromto = IsOneOf(e, {"geom", "site"}) ? Inherited(e, "fromto") : nullptr;
    if (fromto != nullptr) {
      const auto v = Numbers(e, "fromto", fromto, 6);
      const Vec3 from = X * Vec3(v[0], v[1], v[2]), to = X * Vec3(v[3], v[4], v[5]);
      e->SetAttribute("fromto", (TextOf(from) + " " + TextOf(to)).c_str());
    } else if (IsOneOf(e, {"body", "frame", "geom", "site"})) {
      SetPose(e, X * PoseOf(e));
    } else if (IsTag(e, "inertial")) {
      ShiftInertial(X, e);
    } else if (IsTag(e, "joint")) {
      const char *pos = Inherited(e, "pos"), *axis = Inherited(e, "axis");
      SetPosition(e, X * (pos == nullptr ? Vec3(Vec3::Zero()) : Vector(e, "pos", pos)));
      const Vec3 a = axis == nullptr ? Vec3(Vec3::UnitZ()) : Vector(e, "axis", axis);
      e->SetAttribute("axis", TextOf(X.linear() * a).c_str());
    } else if (IsTag(e, "composite") && !X.isApprox(Pose::Identity(), 0.0)) {
      Fail(e, "a <composite> stands in a <frame> with a pose, which is not read",
           "put it into a body of its own");
    }
  }

  void ShiftInertial(const Pose& X, XMLElement* e) {
    const char* full = e->Attribute("fullinertia");
    if (full == nullptr) {
      SetPose(e, X * PoseOf(e));
      return;
    }
    const char* pos = e->Attribute("pos");
    SetPosition(e, X * (pos == nullptr ? Vec3(Vec3::Zero()) : Vector(e, "pos", pos)));
    const auto v = Numbers(e, "fullinertia", full, 6);
    Mat3 I;
    I << v[0], v[3], v[4], v[3], v[1], v[5], v[4], v[5], v[2];
    const Mat3 J = X.linear() * I * X.linear().transpose();
    e->SetAttribute("fullinertia", fmt::format("{} {} {} {} {} {}", J(0, 0), J(1, 1), J(2, 2),
                                               J(0, 1), J(0, 2), J(1, 2))
                                       .c_str());
  }

  void Replicate(XMLElement* replicate) {
    constexpr int kMost = 10000;  // elements that are written out
    int count = 0, elements = 1;
    if (replicate->QueryIntAttribute("count", &count) != tinyxml2::XML_SUCCESS || count < 0) {
      Fail(replicate, "<replicate> count is not a number >= 0");
      return;
    }
    ForEach(replicate, [&](XMLElement*) { ++elements; });
    written_ += static_cast<long>(count) * elements;
    if (written_ > kMost) {
      Fail(replicate, fmt::format("<replicate> makes more than {} elements", kMost));
      return;
    }
    const auto vector = [&](const char* name) -> Vec3 {
      const char* text = replicate->Attribute(name);
      return text == nullptr ? Vec3(Vec3::Zero()) : Vector(replicate, name, text);
    };
    const Vec3 offset = vector("offset"), euler = unit_ * vector("euler");
    const char* separator = replicate->Attribute("sep");
    std::vector<std::string> suffixes;
    const size_t digits = fmt::format("{}", count).size();
    std::set<std::string> names;
    ForEach(replicate, [&](XMLElement* e) {
      if (const char* name = e->Attribute("name")) names.insert(name);
    });
    Vec3 p = Vec3::Zero();
    XMLNode *parent = replicate->Parent(), *last = replicate;
    for (int i = 0; i < count; ++i) {
      suffixes.push_back(fmt::format("{}{:0{}}", separator == nullptr ? "" : separator, i, digits));
      XMLElement* frame = document_.NewElement("frame");
      Pose X = Pose::Identity();
      X.translation() = p;
      X.linear() = EulerRotation(i * euler);
      p = X * offset;
      SetPose(frame, X);
      if (const char* childclass = replicate->Attribute("childclass")) {
        frame->SetAttribute("childclass", childclass);
      }
      for (const XMLElement* e = replicate->FirstChildElement(); e != nullptr;
           e = e->NextSiblingElement()) {
        frame->InsertEndChild(e->DeepClone(&document_));
      }
      ForEach(frame, [&](XMLElement* e) { Suffix(e, "name", suffixes.back()); });
      last = parent->InsertAfterChild(last, frame);
    }
    document_.DeleteNode(replicate);
    // Tendons first: equalities and actuators refer to them.
    for (const char* section : {"tendon", "contact", "equality", "actuator", "sensor"}) {
      for (XMLElement* s = root()->FirstChildElement(section); s != nullptr;
           s = s->NextSiblingElement(section)) {
        RepeatReferring(s, suffixes, &names);
      }
    }
  }

  static void Suffix(XMLElement* e, const char* attribute, const std::string& suffix) {
    if (const char* name = e->Attribute(attribute)) {
      e->SetAttribute(attribute, (name + suffix).c_str());
    }
  }

  // The attributes by which an element refers to one of `names`.
  static std::vector<std::string> ReferringTo(const std::set<std::string>& names,
                                              const XMLElement* e) {
    static const std::set<std::string> kOthers = {"name", "class", "type", "objtype", "reftype"};
    std::vector<std::string> found;
    for (const auto* a = e->FirstAttribute(); a != nullptr; a = a->Next()) {
      if (!kOthers.contains(a->Name()) && names.contains(a->Value())) found.emplace_back(a->Name());
    }
    return found;
  }

  void RepeatReferring(XMLElement* section, const std::vector<std::string>& suffixes,
                       std::set<std::string>* names) {
    std::vector<XMLElement*> referring;
    for (XMLElement* e = section->FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      bool refers = !ReferringTo(*names, e).empty();
      ForEach(e,
              [&](XMLElement* inner) { refers = refers || !ReferringTo(*names, inner).empty(); });
      if (refers) referring.push_back(e);
    }
    const std::set<std::string> of_bodies = *names;
    for (XMLElement* e : referring) {
      if (const char* name = e->Attribute("name")) names->insert(name);
      XMLNode* last = e;
      for (const std::string& suffix : suffixes) {
        XMLElement* copy = e->DeepClone(&document_)->ToElement();
        const auto refer = [&](XMLElement* to) {
          for (const std::string& attribute : ReferringTo(of_bodies, to)) {
            Suffix(to, attribute.c_str(), suffix);
          }
        };
        refer(copy);
        ForEach(copy, refer);
        Suffix(copy, "name", suffix);
        last = section->InsertAfterChild(last, copy);
      }
      document_.DeleteNode(e);
    }
  }

  tinyxml2::XMLDocument& document_;
  double unit_ = std::numbers::pi / 180.0;  // of angles
  std::string order_ = "xyz";
  long written_ = 0;
  FrameTrouble trouble_;
};

}  // namespace

FrameTrouble DissolveFrames(tinyxml2::XMLDocument* document) {
  return FrameDissolver(document).Run({});
}

FrameTrouble DissolveFrames(double unit, tinyxml2::XMLDocument* document) {
  return FrameDissolver(document).Run(unit);
}

namespace {

namespace fs = std::filesystem;
using tinyxml2::XMLElement;

class MeshTaker {
 public:
  MeshTaker(const fs::path& folder, const std::function<bool(const fs::path&)>& is_open,
            tinyxml2::XMLDocument* document)
      : folder_(folder), is_open_(is_open), document_(*document) {}

  MeshGeoms Run() {
    const std::vector<XMLElement*> geoms = WithMeshesStated();
    const std::map<std::string, ForeignMesh> assets = MeshAssets();
    for (XMLElement* geom : geoms) {
      const char* type = Inherited(geom, "type");
      const XMLElement* body = geom->Parent()->ToElement();
      const bool states_inertia = IsTag(body, "worldbody") || StatesInertia(body);
      const auto asset = assets.find(geom->Attribute("mesh"));
      // Others are primitives that are fitted to a mesh.
      const bool shown = type != nullptr && std::string_view(type) == "mesh";
      if (shown && asset != assets.end()) {
        PutSphere(geom, asset->second);
      } else if (states_inertia) {
        ++result_.lost;
      }
      if (states_inertia || HasNoMass(geom)) {
        document_.DeleteNode(geom);
      } else {
        FindFile(geom, *body);
      }
    }
    return std::move(result_);
  }

 private:
  XMLElement* root() { return document_.RootElement(); }

  [[nodiscard]] const char* OfCompiler(const char* attribute) {
    const XMLElement* compiler = root()->FirstChildElement("compiler");
    return compiler == nullptr ? nullptr : compiler->Attribute(attribute);
  }

  // The geoms of bodies that have a mesh, each with its name; classes then have none, which what
  // stands for a geom would inherit.
  std::vector<XMLElement*> WithMeshesStated() {
    std::vector<XMLElement*> geoms, defaults;
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      if (!IsTag(e, "geom") || parent == nullptr) return;
      if (IsTag(parent, "default")) defaults.push_back(e);
      if (!IsTag(parent, "body") && !IsTag(parent, "worldbody")) return;
      const char* mesh = Inherited(e, "mesh");
      if (mesh == nullptr) return;
      e->SetAttribute("mesh", std::string(mesh).c_str());
      geoms.push_back(e);
    });
    for (XMLElement* e : defaults) e->DeleteAttribute("mesh");
    return geoms;
  }

  // <inertial> counts unless the compiler takes geoms instead.
  [[nodiscard]] bool StatesInertia(const XMLElement* body) {
    const char* from_geom = OfCompiler("inertiafromgeom");
    return body->FirstChildElement("inertial") != nullptr &&
           (from_geom == nullptr || std::string_view(from_geom) != "true");
  }

  // A geom for pictures or touch alone, by its mass, density or group.
  [[nodiscard]] bool HasNoMass(const XMLElement* geom) {
    const auto number = [&](const char* attribute, double fallback) {
      const char* text = Inherited(geom, attribute);
      return text == nullptr ? fallback : std::strtod(text, nullptr);
    };
    double first = 0.0, last = 5.0;  // groups that count
    if (const char* range = OfCompiler("inertiagrouprange")) {
      std::istringstream(range) >> first >> last;
    }
    const double group = number("group", 0.0);
    if (group < first || group > last) return true;
    return Inherited(geom, "mass") != nullptr ? number("mass", 1.0) == 0.0
                                              : number("density", 1000.0) == 0.0;
  }

  // Notes a mesh whose file is not there.
  void FindFile(const XMLElement* geom, const XMLElement& body) {
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      const char* file = e->Attribute("file");
      if (!IsTag(e, "mesh") || file == nullptr || parent == nullptr || !IsTag(parent, "asset")) {
        return;
      }
      const char* name = e->Attribute("name");
      const std::string known = name == nullptr ? fs::path(file).stem().string() : name;
      std::error_code error;
      if (known != geom->Attribute("mesh") || fs::exists(folder_ / file, error)) return;
      const char* of_body = body.Attribute("name");
      result_.missing.push_back({.line = geom->GetLineNum(),
                                 .body = of_body == nullptr ? "without a name" : of_body,
                                 .file = file});
    });
  }

  // A sphere where a geom is. Its pose may be written in many ways, and come from its class.
  void PutSphere(XMLElement* geom, const ForeignMesh& mesh) {
    XMLElement* sphere = geom->DeepClone(&document_)->ToElement();
    const std::string name = fmt::format("mesh of geom {}", result_.meshes.size());
    for (const char* attribute : {"mesh", "fitscale", "shellinertia", "density", "fromto"}) {
      sphere->DeleteAttribute(attribute);
    }
    sphere->SetAttribute("name", name.c_str());
    sphere->SetAttribute("type", "sphere");
    sphere->SetAttribute("size", "1");
    sphere->SetAttribute("mass", "0");
    const std::string rgba = MaterialColor(Inherited(geom, "material"));
    if (!rgba.empty() && Inherited(geom, "rgba") == nullptr) {
      sphere->SetAttribute("rgba", rgba.c_str());
    }
    geom->Parent()->InsertAfterChild(geom, sphere);
    result_.meshes.emplace(name, mesh);
  }

  // "" without one.
  std::string MaterialColor(const char* name) {
    std::string rgba;
    ForEach(root(), [&](XMLElement* e) {
      const bool meant = name != nullptr && IsTag(e, "material") &&
                         e->Attribute("name") != nullptr &&
                         std::string_view(e->Attribute("name")) == name;
      if (meant && e->Attribute("rgba") != nullptr) rgba = e->Attribute("rgba");
    });
    return rgba;
  }

  // What <default> says about an attribute of meshes in a class, "main" being the outermost one.
  const char* MeshDefault(const char* of_class, const char* attribute) {
    const char* found = nullptr;
    // Inner classes inherit from outer ones.
    const auto visit = [&](const auto& self, const XMLElement* e, const char* inherited) -> void {
      const XMLElement* mesh = e->FirstChildElement("mesh");
      const char* own = mesh == nullptr ? nullptr : mesh->Attribute(attribute);
      const char* value = own == nullptr ? inherited : own;
      const char* name = e->Attribute("class");
      const bool is_main = e->Parent() == root();
      const bool meant =
          of_class == nullptr ? is_main : name != nullptr && std::string_view(name) == of_class;
      if (meant && value != nullptr) found = value;
      for (const XMLElement* inner = e->FirstChildElement("default"); inner != nullptr;
           inner = inner->NextSiblingElement("default")) {
        self(self, inner, value);
      }
    };
    for (const XMLElement* e = root()->FirstChildElement("default"); e != nullptr;
         e = e->NextSiblingElement("default")) {
      visit(visit, e, nullptr);
    }
    return found;
  }

  // Numbers of an attribute of a mesh; `fallback` where it is left out or broken.
  std::vector<double> MeshNumbers(const XMLElement* mesh, const char* attribute,
                                  const std::vector<double>& fallback) {
    const char* text = mesh->Attribute(attribute);
    if (text == nullptr) text = MeshDefault(mesh->Attribute("class"), attribute);
    if (text == nullptr) return fallback;
    std::istringstream stream(text);
    std::vector<double> numbers;
    for (double x = 0.0; stream >> x;) numbers.push_back(x);
    return numbers.size() == fallback.size() ? numbers : fallback;
  }

  // Meshes from files of the model's folder, by name.
  std::map<std::string, ForeignMesh> MeshAssets() {
    std::map<std::string, ForeignMesh> assets;
    ForEach(root(), [&](XMLElement* e) {
      const auto* parent = e->Parent()->ToElement();
      const char* file = e->Attribute("file");
      if (!IsTag(e, "mesh") || file == nullptr || parent == nullptr || !IsTag(parent, "asset")) {
        return;
      }
      const fs::path path = folder_ / file;
      if (!is_open_(path)) return;
      ForeignMesh mesh;
      mesh.file = path.string();
      const auto scale = MeshNumbers(e, "scale", {1, 1, 1});
      const auto p = MeshNumbers(e, "refpos", {0, 0, 0});
      const auto q = MeshNumbers(e, "refquat", {1, 0, 0, 0});
      mesh.scale = Vec3(scale[0], scale[1], scale[2]);
      Pose X_FG = Pose::Identity();
      X_FG.translation() = Vec3(p[0], p[1], p[2]);
      X_FG.linear() = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
      mesh.X_GF = X_FG.inverse();
      const char* name = e->Attribute("name");
      assets.emplace(name == nullptr ? fs::path(file).stem().string() : name, mesh);
    });
    return assets;
  }

  const fs::path& folder_;
  const std::function<bool(const fs::path&)>& is_open_;
  tinyxml2::XMLDocument& document_;
  MeshGeoms result_;
};

}  // namespace

MeshGeoms TakeMeshGeoms(const fs::path& folder, const std::function<bool(const fs::path&)>& is_open,
                        tinyxml2::XMLDocument* document) {
  return MeshTaker(folder, is_open, document).Run();
}

}  // namespace mbv::mjcf
