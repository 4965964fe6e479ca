#include "model_file/urdf/urdf_import.h"

#include <console_bridge/console.h>
#include <fmt/format.h>
#include <tinyxml2.h>
#include <urdf_parser/urdf_parser.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <string_view>

#include "base/files.h"
#include "base/text.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "model_file/model_bodies.h"
#include "model_file/urdf/urdf_closures.h"
#include "model_file/write_model.h"
#include "model_file/yaml/yaml_reader.h"

namespace mbv::internal {
namespace {

namespace fs = std::filesystem;

std::string RobotName(const std::string& file, const std::string& urdf) {
  tinyxml2::XMLDocument document;
  std::string name;
  if (document.Parse(urdf.c_str(), urdf.size()) == tinyxml2::XML_SUCCESS) {
    const tinyxml2::XMLElement* robot = document.FirstChildElement("robot");
    if (robot != nullptr && robot->Attribute("name") != nullptr) name = robot->Attribute("name");
  }
  name = NearestName(name);
  if (name.empty()) name = NearestName(fs::path(file).stem().string());
  return name.empty() ? "robot" : name;
}

bool IsClosureFile(const fs::path& path) {
  std::error_code error;
  if (!fs::is_regular_file(path, error)) return false;
  YamlReader reader(path.string());
  const auto text = reader.ReadFile();
  const YamlNodePtr root = text ? reader.Parse(*text) : nullptr;
  // One that cannot be read is named by whoever reads it for good.
  if (root == nullptr) return text.has_value();
  return root->Find("closed_loop") != nullptr || root->Find("closures") != nullptr;
}

std::string FindClosureFile(const fs::path& file) {
  const fs::path folder = file.parent_path();
  for (const fs::path& name :
       {fs::path(file.stem().string() + ".yaml"), fs::path("robot.yaml"),
        fs::path("loop_closures.yaml"), fs::path("config") / "loop_closures.yaml",
        fs::path("..") / "config" / "loop_closures.yaml"}) {
    if (IsClosureFile(folder / name)) return name.string();
  }
  return "";
}

}  // namespace

bool IsUrdfFile(const std::string& file) { return file.ends_with(".urdf"); }

std::string UrdfModelText(const std::string& file, const std::string& urdf) {
  const std::string closures = FindClosureFile(file);
  return fmt::format("name: {}\nurdf: {{file: {}{}}}\n", RobotName(file, urdf),
                     QuotedYaml(fs::path(file).filename().string()),
                     closures.empty() ? "" : ", closures: " + QuotedYaml(closures));
}

}  // namespace mbv::internal

namespace mbv {
namespace {

// urdfdom reports through console_bridge; while this lives, its messages become findings.
class LogCapture : public console_bridge::OutputHandler {
 public:
  LogCapture(std::string file, Diagnostics* diagnostics)
      : file_(std::move(file)), diagnostics_(diagnostics), level_(console_bridge::getLogLevel()) {
    console_bridge::useOutputHandler(this);
    console_bridge::setLogLevel(console_bridge::CONSOLE_BRIDGE_LOG_WARN);
  }
  ~LogCapture() override {
    console_bridge::restorePreviousOutputHandler();
    console_bridge::setLogLevel(level_);
  }
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;

  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    const bool error = level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR;
    diagnostics_->Add({.severity = error ? Severity::kError : Severity::kWarning,
                       .file = file_,
                       .message = "urdfdom: " + text,
                       .hint = ""});
  }

 private:
  std::string file_;
  Diagnostics* diagnostics_;
  console_bridge::LogLevel level_;
};

Vec3 ToVec(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Pose ToPose(const urdf::Pose& p) {
  Pose X = Pose::Identity();
  X.translation() = ToVec(p.position);
  X.linear() = Eigen::Quaterniond(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z)
                   .normalized()
                   .toRotationMatrix();
  return X;
}

class Importer {
 public:
  Importer(const std::string& file, const internal::UrdfDetails& details, Diagnostics* diagnostics)
      : file_(file), details_(details), diagnostics_(diagnostics) {}

  UrdfTree Run(const urdf::ModelInterface& model) {
    tree_.name = model.getName();
    CheckName("robot", tree_.name, 0);
    const urdf::LinkConstSharedPtr root = model.getRoot();
    // Depth first in name order: the order in the file is lost in urdfdom's maps.
    AddLink(*root);
    if (root->name == "world") {
      if (root->inertial) {
        Warn(LineOf(details_.link_lines, "world"),
             "the inertia of the link 'world' has no meaning");
      }
      tree_.root = -1;
    } else {
      tree_.root = 0;
    }
    for (const internal::UrdfClosure& closure : details_.closures) AddClosure(closure);
    tree_.transmission_joints = details_.transmission_joints;
    tree_.gravity_W = details_.gravity_W;
    tree_.left_out = details_.left_out;
    FixMimics();
    CheckMimics();
    TakeExtras();
    const Finding place{.severity = Severity::kWarning, .file = file_, .message = {}, .hint = {}};
    internal::LoadMeshes(std::filesystem::path(file_).parent_path(), place, &tree_.bodies,
                         diagnostics_);
    WarnOfLosses("damping", damped_);
    WarnOfLosses("friction", friction_);
    return std::move(tree_);
  }

 private:
  static int LineOf(const std::map<std::string, int>& lines, const std::string& name) {
    const auto it = lines.find(name);
    return it == lines.end() ? 0 : it->second;
  }
  void Add(Severity severity, int line, const std::string& text, const std::string& hint) {
    diagnostics_->Add({severity, file_, line, line > 0 ? 1 : 0, text, hint});
  }
  void Error(int line, const std::string& text, const std::string& hint = "") {
    Add(Severity::kError, line, text, hint);
  }
  void Warn(int line, const std::string& text, const std::string& hint = "") {
    Add(Severity::kWarning, line, text, hint);
  }

  // Character references (&#27;) can write what the file itself must not hold.
  void CheckName(const char* what, const std::string& name, int line) {
    if (FindNonName(name) == std::string::npos) return;
    Error(line, fmt::format("{} '{}': the name holds control characters", what, name));
  }

  void AddLink(const urdf::Link& start) {
    std::vector<const urdf::Link*> waiting = {&start};
    while (!waiting.empty()) {
      const urdf::Link& link = *waiting.back();
      waiting.pop_back();
      if (&link == &start && link.name == "world") {
        index_[link.name] = -1;
      } else {
        index_[link.name] = static_cast<int>(tree_.bodies.size());
        tree_.body_lines.push_back(LineOf(details_.link_lines, link.name));
        CheckName("link", link.name, tree_.body_lines.back());
        tree_.bodies.push_back(BodyOf(link));
        if (link.parent_joint) AddJoint(*link.parent_joint);
      }
      for (auto it = link.child_links.rbegin(); it != link.child_links.rend(); ++it) {
        waiting.push_back(it->get());
      }
    }
  }

  Body BodyOf(const urdf::Link& link) {
    Body body{.name = link.name, .frames = {}, .shapes = {}};
    if (const auto& inertial = link.inertial) {
      const Pose X_BI = ToPose(inertial->origin);
      Mat3 I;
      I << inertial->ixx, inertial->ixy, inertial->ixz, inertial->ixy, inertial->iyy, inertial->iyz,
          inertial->ixz, inertial->iyz, inertial->izz;
      body.mass = inertial->mass;
      body.p_BoBcm_B = X_BI.translation();
      body.I_Bcm_B = X_BI.linear() * I * X_BI.linear().transpose();
      if (!std::isfinite(body.mass) || !body.p_BoBcm_B.allFinite() || !body.I_Bcm_B.allFinite() ||
          body.mass < 0.0) {
        Error(
            tree_.body_lines.back(),
            fmt::format("link '{}': its inertial values violate mass >= 0 and finite", link.name));
      }
    }
    for (const urdf::VisualSharedPtr& visual : link.visual_array) AddShape(*visual, &body);
    return body;
  }

  // Shapes of no size show nothing.
  void AddShape(const urdf::Visual& visual, Body* body) {
    if (!visual.geometry) return;
    const Pose X = ToPose(visual.origin);
    if (!X.matrix().allFinite()) return;
    Shape shape;
    if (const auto* box = dynamic_cast<const urdf::Box*>(visual.geometry.get())) {
      if (!(ToVec(box->dim).minCoeff() > 0.0)) return;
      shape.geometry = Box{X, ToVec(box->dim)};
    } else if (const auto* c = dynamic_cast<const urdf::Cylinder*>(visual.geometry.get())) {
      const Vec3 half(0, 0, 0.5 * c->length);
      if (!(std::min(c->length, c->radius) > 0.0)) return;
      shape.geometry = Cylinder{X * Vec3(-half), X * half, c->radius};
    } else if (const auto* s = dynamic_cast<const urdf::Sphere*>(visual.geometry.get())) {
      if (!(s->radius > 0.0)) return;
      shape.geometry = Ball{X.translation(), s->radius};
    } else if (const auto* m = dynamic_cast<const urdf::Mesh*>(visual.geometry.get())) {
      shape.geometry = Mesh{.X_BG = X, .file = m->filename, .scale = ToVec(m->scale)};
    } else {
      return;
    }
    if (visual.material) {
      const urdf::Color& c = visual.material->color;
      const auto byte = [](float x) {
        return static_cast<int>(std::lround(255.0 * std::clamp(double{x}, 0.0, 1.0)));
      };
      shape.color =
          fmt::format("#{:02x}{:02x}{:02x}{:02x}", byte(c.r), byte(c.g), byte(c.b), byte(c.a));
    }
    body->shapes.push_back(shape);
  }

  // Joints with a value that is left out.
  struct Losses {
    int joints = 0, line = 0;
    std::string text;
  };
  static void AddLoss(const std::string& joint, double value, int line, Losses* losses) {
    constexpr int kMost = 8;
    if (value == 0.0) return;
    if (losses->joints++ == 0) losses->line = line;
    if (losses->joints > kMost) return;
    losses->text += fmt::format("{}{} ({:g})", losses->joints == 1 ? "" : ", ", joint, value);
    if (losses->joints == kMost) losses->text += ", …";
  }
  void WarnOfLosses(const char* what, const Losses& losses) {
    if (losses.joints == 0) return;
    LeaveOut(losses.line, fmt::format("{} in {} joint{} is left out: {}", what, losses.joints,
                                      losses.joints == 1 ? "" : "s", losses.text));
  }
  void LeaveOut(int line, const std::string& text) {
    tree_.left_out.push_back(
        {.kind = ModelCaveat::Kind::kLeftOut, .text = text, .source = "joint"});
    Warn(line, text, "drive forces are computed without it");
  }

  // Rotors and springs act along a single coordinate.
  void TakeExtras() {
    for (const auto& [name, extra] : details_.extras) {
      const auto joint = std::ranges::find(tree_.joints, name, &Joint::name);
      const bool fits = joint != tree_.joints.end() && DofsOf(joint->kind) == 1;
      const auto is_good = [](double x) { return std::isfinite(x) && x >= 0.0; };
      if (!fits || !is_good(extra.rotor_inertia) || !std::isfinite(extra.gear_ratio) ||
          extra.gear_ratio == 0.0 || !std::isfinite(extra.stiffness) ||
          !std::isfinite(extra.free)) {
        LeaveOut(extra.line, fmt::format("the rotor or spring of '{}' is left out: it acts on no "
                                         "joint with one coordinate, or has no sound number",
                                         name));
        continue;
      }
      if (extra.rotor_inertia == 0.0 && extra.stiffness == 0.0) continue;
      tree_.extras.push_back(
          {name, extra.rotor_inertia, extra.gear_ratio, extra.stiffness, extra.free});
    }
  }

  // What follows a fixed joint does not move, and what is fixed follows nothing.
  void FixMimics() {
    const auto named = [this](const std::string& name) {
      return std::ranges::find(tree_.joints, name, &Joint::name);
    };
    std::map<std::string, double> held;  // coordinates of joints that were fixed here
    const auto is_settled = [&](const UrdfTree::Mimic& mimic) {
      const auto joint = named(mimic.joint), of = named(mimic.of);
      if (joint == tree_.joints.end() || of == tree_.joints.end()) return false;
      const bool is_fixed = joint->kind == JointKind::kFixed;
      if (!is_fixed && (of->kind != JointKind::kFixed || DofsOf(joint->kind) != 1)) return false;
      const int line = LineOf(details_.joint_lines, mimic.joint);
      if (is_fixed) {
        Warn(line,
             fmt::format("joint '{}' is fixed and does not follow '{}'", mimic.joint, mimic.of));
        return true;
      }
      const double at = mimic.multiplier * held[mimic.of] + mimic.offset;
      held[mimic.joint] = at;
      Warn(line, fmt::format("joint '{}' follows '{}', which is fixed: it is held at {:g}",
                             mimic.joint, mimic.of, at));
      joint->X_PF = joint->X_PF * JointPose(*joint, {at});
      joint->kind = JointKind::kFixed;
      joint->range = {};
      std::erase_if(tree_.dynamics,
                    [&](const UrdfTree::Dynamics& on) { return on.joint == mimic.joint; });
      return true;
    };
    while (std::erase_if(tree_.mimics, is_settled) > 0) {
    }
  }

  void CheckMimics() {
    for (const UrdfTree::Mimic& mimic : tree_.mimics) {
      const int line = LineOf(details_.joint_lines, mimic.joint);
      std::vector<std::string> names;
      for (const Joint& joint : tree_.joints) {
        if (DofsOf(joint.kind) == 1) names.push_back(joint.name);
      }
      const std::string says = fmt::format("joint '{}': mimic of '{}'", mimic.joint, mimic.of);
      if (!Contains(names, mimic.of)) {
        Error(line, says + ", which is not a joint with one coordinate",
              DidYouMean(mimic.of, names));
      } else if (!Contains(names, mimic.joint)) {
        Error(line, says + ", but it has no coordinate of its own to couple");
      } else if (mimic.of == mimic.joint) {
        Error(line, says + ", itself");
      } else if (mimic.multiplier == 0.0 || !std::isfinite(mimic.multiplier + mimic.offset)) {
        Error(line, fmt::format("{}: multiplier {} and offset {} couple nothing", says,
                                mimic.multiplier, mimic.offset));
      }
    }
  }

  void AddClosure(const internal::UrdfClosure& closure) {
    Joint joint = closure.joint;
    CheckName("closure", joint.name, closure.line);
    std::vector<std::string> links = {"world"};
    for (const auto& [name, index] : index_) links.push_back(name);
    const auto find = [&](const std::string& link) {
      if (link == "world") return -1;
      if (const auto it = index_.find(link); it != index_.end()) return it->second;
      Error(closure.line, fmt::format("closure '{}': there is no link '{}'", joint.name, link),
            DidYouMean(link, links));
      return -2;
    };
    joint.parent = find(closure.parent);
    joint.child = find(closure.child);
    if (joint.parent == -2 || joint.child == -2) return;
    if (joint.parent == joint.child) {
      Error(closure.line,
            fmt::format("closure '{}' connects link '{}' with itself", joint.name, closure.parent));
      return;
    }
    for (const Joint& other : tree_.joints) {
      if (other.name != joint.name) continue;
      Error(closure.line,
            fmt::format("closure '{}': a joint of this name is there already", joint.name));
      return;
    }
    tree_.joints.push_back(joint);
    tree_.joint_lines.push_back(closure.line);
  }

  void AddJoint(const urdf::Joint& from) {
    const int line = LineOf(details_.joint_lines, from.name);
    CheckName("joint", from.name, line);
    Joint joint;
    joint.name = from.name;
    joint.parent = index_[from.parent_link_name];
    joint.child = index_[from.child_link_name];
    joint.X_PF = ToPose(from.parent_to_joint_origin_transform);
    if (!joint.X_PF.matrix().allFinite()) {
      Error(line, fmt::format("joint '{}': its origin is not finite", from.name));
    }
    bool has_axis = true;
    switch (from.type) {
      case urdf::Joint::REVOLUTE:
      case urdf::Joint::CONTINUOUS:
        joint.kind = JointKind::kRevolute;
        break;
      case urdf::Joint::PRISMATIC:
        joint.kind = JointKind::kPrismatic;
        break;
      case urdf::Joint::PLANAR:
        joint.kind = JointKind::kPlanar;
        break;
      case urdf::Joint::FLOATING:
        joint.kind = JointKind::kFree;
        has_axis = false;
        break;
      case urdf::Joint::FIXED:
        joint.kind = JointKind::kFixed;
        has_axis = false;
        break;
      case urdf::Joint::UNKNOWN:
        Error(line, fmt::format("joint '{}' has no known type", from.name));
        break;
    }
    const Vec3 axis = ToVec(from.axis);
    if (has_axis && !(axis.norm() > 1e-9 && std::isfinite(axis.norm()))) {
      Error(line, fmt::format("joint '{}': the axis ({}, {}, {}) has no direction", from.name,
                              axis.x(), axis.y(), axis.z()));
    } else if (has_axis) {
      joint.axis = axis.normalized();
    }
    ReadLimits(from, &joint);
    if (from.limits && DofsOf(joint.kind) == 1) ReadMotor(from, joint.kind);
    if (from.dynamics) ReadDynamics(from, joint.kind, line);
    if (from.mimic) {
      tree_.mimics.push_back(
          {from.name, from.mimic->joint_name, from.mimic->multiplier, from.mimic->offset});
    }
    tree_.joints.push_back(joint);
    tree_.joint_lines.push_back(line);
  }

  void ReadDynamics(const urdf::Joint& from, JointKind kind, int line) {
    UrdfTree::Dynamics dynamics{.joint = from.name};
    const auto take = [&](double value, double* into, Losses* losses) {
      if (value > 0.0 && std::isfinite(value) && DofsOf(kind) == 1) {
        *into = value;
      } else {
        AddLoss(from.name, value, line, losses);
      }
    };
    take(from.dynamics->damping, &dynamics.damping, &damped_);
    take(from.dynamics->friction, &dynamics.friction, &friction_);
    if (dynamics.damping > 0.0 || dynamics.friction > 0.0) tree_.dynamics.push_back(dynamics);
  }

  // Zero is written where nothing is known, as are very large numbers.
  void ReadMotor(const urdf::Joint& from, JointKind kind) {
    Motor motor;
    motor.turns = !IsLength(kind, 0);
    for (const auto& [limit, into] :
         {std::pair(from.limits->effort, &motor.peak), {from.limits->velocity, &motor.max_speed}}) {
      if (limit > 0.0 && limit < kUrdfNoLimit) *into = limit;
    }
    if (std::isinf(motor.peak) && std::isinf(motor.max_speed)) return;
    tree_.motors[from.name] = std::move(motor);
  }

  void ReadLimits(const urdf::Joint& from, Joint* joint) {
    const bool limited =
        from.limits && (from.type == urdf::Joint::REVOLUTE || from.type == urdf::Joint::PRISMATIC);
    if (!limited || from.limits->lower >= from.limits->upper) return;
    if (from.limits->lower > -kUrdfNoLimit) joint->range[0].lower = from.limits->lower;
    if (from.limits->upper < kUrdfNoLimit) joint->range[0].upper = from.limits->upper;
  }

  std::string file_;
  const internal::UrdfDetails& details_;
  Diagnostics* diagnostics_;
  UrdfTree tree_;
  std::map<std::string, int> index_;
  Losses damped_, friction_;
};

// TinyXML reads nested elements by recursion: refuse what would exhaust the stack.
bool NestsDeeperThan(const std::string& xml, int limit) {
  int depth = 0;
  for (size_t i = 0; i + 1 < xml.size(); ++i) {
    if (xml[i] == '<' && xml.compare(i, 4, "<!--") == 0) {
      i = xml.find("-->", i);
      if (i == std::string::npos) return false;
    } else if ((xml[i] == '<' && xml[i + 1] == '/') || (xml[i] == '/' && xml[i + 1] == '>')) {
      --depth;
    } else if (xml[i] == '<' && xml[i + 1] != '?' && xml[i + 1] != '!') {
      if (++depth > limit) return true;
    }
  }
  return false;
}

// The name of a joint on a link 'world' that the file does not define, as Gazebo and Drake allow;
// empty without one.
std::string OnImpliedWorld(const tinyxml2::XMLElement& robot) {
  const auto has = [](const tinyxml2::XMLElement* element, const char* attribute) {
    return element != nullptr && element->Attribute(attribute, "world") != nullptr;
  };
  const tinyxml2::XMLElement* link = robot.FirstChildElement("link");
  for (; link != nullptr; link = link->NextSiblingElement("link")) {
    if (has(link, "name")) return "";
  }
  const tinyxml2::XMLElement* joint = robot.FirstChildElement("joint");
  for (; joint != nullptr; joint = joint->NextSiblingElement("joint")) {
    const char* name = joint->Attribute("name");
    if (has(joint->FirstChildElement("parent"), "link")) return name == nullptr ? "" : name;
  }
  return "";
}

}  // namespace

int UrdfTree::FindLink(const std::string& link) const {
  if (root == -1 && link == "world") return -1;
  for (size_t b = 0; b < bodies.size(); ++b) {
    if (bodies[b].name == link) return static_cast<int>(b);
  }
  return -2;
}

UrdfTree ReadUrdf(const std::string& text, const std::string& file, Diagnostics* diagnostics) {
  const auto fail = [&](const std::string& message) {
    diagnostics->Add({Severity::kError, file, 0, 0, message, ""});
    return UrdfTree{};
  };
  if (FindNonText(text) != std::string::npos) return fail("the file is not UTF-8 text");
  if (NestsDeeperThan(text, 100)) return fail("XML elements are nested deeper than 100 levels");
  // urdfdom's words would quote a file of another kind.
  tinyxml2::XMLDocument document;
  if (document.Parse(text.c_str(), text.size()) != tinyxml2::XML_SUCCESS) {
    diagnostics->Add({Severity::kError, file, document.ErrorLineNum(), 1,
                      "the file is not well-formed XML", ""});
    return {};
  }
  const tinyxml2::XMLElement* top = document.RootElement();
  if (top == nullptr || std::string_view(top->Name()) != "robot") {
    return fail("no URDF: the root element is not <robot>");
  }
  // urdfdom takes no robot without a name, which nothing depends on.
  std::string named = text;
  if (top->Attribute("name") == nullptr) {
    named.insert(named.find("<robot") + std::string_view("<robot").size(), " name=\"robot\"");
  }
  if (const std::string joint = OnImpliedWorld(*top); !joint.empty()) {
    named.insert(named.rfind("</robot"), "<link name=\"world\"/>");
    diagnostics->Add({Severity::kWarning, file, 0, 0,
                      fmt::format("the parent link 'world' of joint '{}' is not in the file: taken "
                                  "as the world",
                                  joint),
                      ""});
  }
  Diagnostics said;
  urdf::ModelInterfaceSharedPtr model;
  try {
    const LogCapture capture(file, &said);
    model = urdf::parseURDF(named);
  } catch (const std::exception& e) {
    said.Add({Severity::kError, file, 0, 0, std::string("urdfdom: ") + e.what(), ""});
  }
  diagnostics->Append(said);
  if (said.has_errors()) return {};
  if (model == nullptr || model->getRoot() == nullptr) return fail("urdfdom finds no robot");
  Diagnostics read;
  const internal::UrdfDetails details = internal::ReadUrdfDetails(text, file, &read);
  UrdfTree tree = Importer(file, details, &read).Run(*model);
  diagnostics->Append(read);
  return read.has_errors() ? UrdfTree{} : tree;
}

}  // namespace mbv
