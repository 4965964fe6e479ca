// mbverify-read-sdf: libsdformat's reading of an SDF file, as a model.
//   mbverify-read-sdf SOURCE ANSWER     files of bytes (math/bytes.h): SdfSource, ForeignModel

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <map>
#include <memory>
#include <numeric>
#include <sdf/sdf.hh>
#include <set>
#include <sstream>

#include "base/files.h"
#include "base/text.h"
#include "math/bytes.h"
#include "mechanism/joint_pose.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/sdf/read_sdf.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kNoSdfLimit = 1e15;  // SDF has ±1e16 where nothing limits
constexpr size_t kMostNames = 6;

Vec3 ToVec(const ignition::math::Vector3d& v) { return {v.X(), v.Y(), v.Z()}; }

Pose ToPose(const ignition::math::Pose3d& p) {
  Pose X = Pose::Identity();
  X.translation() = ToVec(p.Pos());
  X.linear() = Eigen::Quaterniond(p.Rot().W(), p.Rot().X(), p.Rot().Y(), p.Rot().Z())
                   .normalized()
                   .toRotationMatrix();
  return X;
}

// Where an included file's text is put for libsdformat, in the working folder.
fs::path CopyOf(const SdfSource& source, const SdfSource::Include& include) {
  return fs::absolute(fmt::format("include{}.sdf", &include - source.includes.data()));
}

// The file that was included, of its copy's path.
std::string OriginalOf(const SdfSource& source, const std::string& path) {
  for (const SdfSource::Include& include : source.includes) {
    if (path == CopyOf(source, include)) return include.file;
  }
  return path;
}

class SdfImporter {
 public:
  SdfImporter(const SdfSource& source, Diagnostics* diagnostics)
      : source_(source), diagnostics_(*diagnostics) {
    m_.bodies.push_back({.name = "world", .frames = {}, .shapes = {}});
    m_.file = (fs::path(source.folder) / fs::path(source.file).filename()).string();
  }

  void Read(const sdf::Root& root) {
    std::vector<const sdf::Model*> models;
    if (root.Model() != nullptr) models.push_back(root.Model());
    if (root.WorldCount() > 1) {
      Error("", fmt::format("the file has {} worlds", root.WorldCount()), "leave one");
      return;
    }
    if (root.WorldCount() == 1) {
      const sdf::World& world = *root.WorldByIndex(0);
      for (uint64_t k = 0; k < world.ModelCount(); ++k) models.push_back(world.ModelByIndex(k));
      m_.gravity_W = ToVec(world.Gravity());
      if (m_.gravity_W.norm() > 0.0) m_.up_W = -m_.gravity_W.normalized();
    }
    if (models.empty()) {
      Error("", "the file holds no model");
      return;
    }
    // What is static is a part of the world, unless all is.
    const auto moves = [](const sdf::Model* model) { return !model->Static(); };
    const std::ptrdiff_t moving = std::ranges::count_if(models, moves);
    prefixed_ = moving > 1 || (moving == 0 && models.size() > 1);
    m_.name = (moving > 0 ? *std::ranges::find_if(models, moves) : models.front())->Name();
    if (prefixed_ && root.WorldCount() == 1) m_.name = root.WorldByIndex(0)->Name();
    for (const sdf::Model* model : models) {
      if (moving == 0) frozen_.push_back(model->Name());
      ignition::math::Pose3d pose = model->RawPose();
      if (root.WorldCount() == 1) Check(model->SemanticPose().Resolve(pose), model->Name());
      AddLinks(*model, ToPose(pose), model->Name() + "::", moving > 0 && model->Static());
    }
    if (!frozen_.empty()) {
      LeaveOut("model", "static", fmt::format("<static> of {}", Joined(frozen_, kMostNames)));
    }
    for (const Waiting& waiting : models_) AddJoints(waiting);
    if (diagnostics_.has_errors()) return;
    for (const Waiting& waiting : models_) AddFollowers(waiting);
    HoldWhatFloats();
    AddDrives();
    ReportBodies();
    ReportMeshes();
    for (const auto& [what, names] : lost_) {
      LeaveOut(what.first, what.second,
               fmt::format("{} of {} joint{} ({})",
                           what.first == "gearbox"     ? "the gear ratio"
                           : what.second == "negative" ? "the negative damping"
                                                       : what.second,
                           names.size(), names.size() == 1 ? "" : "s", Joined(names, kMostNames)));
    }
  }

  ForeignModel Take() {
    ForeignModel model{.findings = diagnostics_.findings(),
                       .model = "",
                       .left_out = std::move(left_out_),
                       .printed = {}};
    if (!diagnostics_.has_errors()) model.model = ForeignModelText(std::move(m_));
    return model;
  }

 private:
  // A link: the body that it is, or the world, which static ones are parts of.
  struct Link {
    int body = 0;
    Pose X_WL = Pose::Identity();  // in the pose of the file
  };
  // A model whose links are known.
  struct Waiting {
    const sdf::Model* model;
    Pose X_WM;
    std::string scope;
  };

  [[nodiscard]] SdfSource::Place PlaceOf(const std::string& what) const {
    const auto found = std::ranges::find(source_.places, what, &SdfSource::Place::name);
    return found == source_.places.end() ? SdfSource::Place{"", source_.file, 0} : *found;
  }
  void Add(Severity severity, const std::string& what, const std::string& text,
           const std::string& hint) {
    const SdfSource::Place place = PlaceOf(what);
    diagnostics_.Add({severity, place.file, place.line, place.line > 0 ? 1 : 0, text, hint});
  }
  void Error(const std::string& what, const std::string& text, const std::string& hint = "") {
    Add(Severity::kError, what, text, hint);
  }
  void Warn(const std::string& what, const std::string& text, const std::string& hint = "") {
    Add(Severity::kWarning, what, text, hint);
  }
  void LeaveOut(const std::string& element, const std::string& value, const std::string& what) {
    left_out_.push_back(LeftOutOfSdf(element, value, what));
    Warn("", left_out_.back().text, "forces are computed without it");
  }
  bool Check(const sdf::Errors& errors, const std::string& of) {
    if (errors.empty()) return true;
    Error(of, fmt::format("{}: {}", of, errors.front().Message()));
    return false;
  }

  // "MODEL::NAME", without the model where there is only one.
  [[nodiscard]] std::string NameOf(const std::string& scope, const std::string& name) const {
    const std::string full = scope + name;
    return prefixed_ ? full : full.substr(full.find("::") + 2);
  }

  void AddLinks(const sdf::Model& model, const Pose& X_WM, const std::string& scope,
                bool is_static) {
    models_.push_back({&model, X_WM, scope});
    for (uint64_t k = 0; k < model.LinkCount(); ++k) {
      const sdf::Link& link = *model.LinkByIndex(k);
      ignition::math::Pose3d pose;
      if (!Check(link.SemanticPose().Resolve(pose, "__model__"), "link " + scope + link.Name())) {
        continue;
      }
      Link known{.body = 0, .X_WL = X_WM * ToPose(pose)};
      if (!is_static) {
        known.body = static_cast<int>(m_.bodies.size());
        m_.bodies.push_back(BodyOf(link, scope));
        X_WB_.push_back(known.X_WL);
        if (model.CanonicalLinkName() == link.Name()) canonical_.insert(known.body);
      }
      if (!known.X_WL.matrix().allFinite()) {
        Error("link " + scope + link.Name(),
              fmt::format("link '{}': its pose is not finite", link.Name()));
      }
      links_[scope + link.Name()] = known;
    }
    for (uint64_t k = 0; k < model.ModelCount(); ++k) {
      const sdf::Model& inner = *model.ModelByIndex(k);
      ignition::math::Pose3d pose;
      if (!Check(inner.SemanticPose().Resolve(pose, "__model__"), "model " + inner.Name())) {
        continue;
      }
      if (inner.Static() && !is_static) frozen_.push_back(inner.Name());
      AddLinks(inner, X_WM * ToPose(pose), scope + inner.Name() + "::", is_static);
    }
    for (uint64_t k = 0; k < model.FrameCount(); ++k) {
      const sdf::Frame& frame = *model.FrameByIndex(k);
      std::string link;
      ignition::math::Pose3d pose;
      if (!frame.ResolveAttachedToBody(link).empty() ||
          !frame.SemanticPose().Resolve(pose, "__model__").empty()) {
        continue;  // of nothing that moves
      }
      const auto found = links_.find(scope + link);
      if (found == links_.end() || found->second.body == 0) continue;
      m_.bodies[static_cast<size_t>(found->second.body)].frames.push_back(
          {NameOf(scope, frame.Name()), found->second.X_WL.inverse() * X_WM * ToPose(pose)});
    }
  }

  // libsdformat refuses inertias that no body has, which robots' files hold: read from the
  // elements.
  Body BodyOf(const sdf::Link& link, const std::string& scope) {
    Body body{.name = NameOf(scope, link.Name()), .frames = {}, .shapes = {}};
    const sdf::ElementPtr element = link.Element();
    const sdf::ElementPtr inertial = element != nullptr && element->HasElement("inertial")
                                         ? element->GetElement("inertial")
                                         : nullptr;
    const sdf::ElementPtr inertia = inertial != nullptr && inertial->HasElement("inertia")
                                        ? inertial->GetElement("inertia")
                                        : nullptr;
    const auto number = [](const sdf::ElementPtr& e, const char* name, double otherwise) {
      return e != nullptr && e->HasElement(name) ? e->Get<double>(name) : otherwise;
    };
    if (inertial == nullptr || !inertial->HasElement("mass") || inertia == nullptr) {
      unstated_.push_back(body.name);
    }
    Pose X_BI = Pose::Identity();
    if (inertial != nullptr && inertial->HasElement("pose")) {
      X_BI = ToPose(inertial->Get<ignition::math::Pose3d>("pose"));
    }
    Mat3 I;
    const double ixy = number(inertia, "ixy", 0.0), ixz = number(inertia, "ixz", 0.0),
                 iyz = number(inertia, "iyz", 0.0);
    I << number(inertia, "ixx", 1.0), ixy, ixz, ixy, number(inertia, "iyy", 1.0), iyz, ixz, iyz,
        number(inertia, "izz", 1.0);
    body.mass = number(inertial, "mass", 1.0);
    if (element != nullptr && element->HasElement("gravity") && !element->Get<bool>("gravity")) {
      body.gravity_compensation = 1.0;
    }
    body.p_BoBcm_B = X_BI.translation();
    body.I_Bcm_B = X_BI.linear() * I * X_BI.linear().transpose();
    body.I_Bcm_B = 0.5 * (body.I_Bcm_B + body.I_Bcm_B.transpose()).eval();
    if (!std::isfinite(body.mass) || !body.p_BoBcm_B.allFinite() || !body.I_Bcm_B.allFinite() ||
        body.mass < 0.0) {
      Error(
          "link " + scope + link.Name(),
          fmt::format("link '{}': its inertial values violate mass >= 0 and finite", link.Name()));
    }
    for (uint64_t k = 0; k < link.VisualCount(); ++k) AddShape(*link.VisualByIndex(k), &body);
    return body;
  }

  // Shapes of no size, planes and heightmaps show nothing.
  void AddShape(const sdf::Visual& visual, Body* body) {
    ignition::math::Pose3d pose;
    if (visual.Geom() == nullptr || !visual.SemanticPose().Resolve(pose).empty()) return;
    const Pose X = ToPose(pose);
    if (!X.matrix().allFinite()) return;
    Shape shape;
    const sdf::Geometry& geometry = *visual.Geom();
    const auto is_size = [](double x) { return x > 0.0 && std::isfinite(x); };
    if (const sdf::Box* box = geometry.BoxShape()) {
      const Vec3 size = ToVec(box->Size());
      if (!is_size(size.minCoeff()) || !size.allFinite()) return;
      shape.geometry = Box{X, size};
    } else if (const sdf::Cylinder* cylinder = geometry.CylinderShape()) {
      const Vec3 half(0, 0, 0.5 * cylinder->Length());
      if (!is_size(cylinder->Length()) || !is_size(cylinder->Radius())) return;
      shape.geometry = Cylinder{X * Vec3(-half), X * half, cylinder->Radius()};
    } else if (const sdf::Capsule* capsule = geometry.CapsuleShape()) {
      const Vec3 half(0, 0, 0.5 * capsule->Length());
      if (!is_size(capsule->Length()) || !is_size(capsule->Radius())) return;
      shape.geometry = Capsule{X * Vec3(-half), X * half, capsule->Radius()};
    } else if (const sdf::Sphere* sphere = geometry.SphereShape()) {
      if (!is_size(sphere->Radius())) return;
      shape.geometry = Ball{X.translation(), sphere->Radius()};
    } else if (const sdf::Mesh* mesh = geometry.MeshShape()) {
      if (!AddMesh(*mesh, X, &shape)) return;
    } else {
      return;
    }
    if (visual.Material() != nullptr) {
      const ignition::math::Color c = visual.Material()->Diffuse();
      const auto byte = [](float x) {
        return static_cast<int>(std::lround(255.0 * std::clamp(double{x}, 0.0, 1.0)));
      };
      shape.color = fmt::format("#{:02x}{:02x}{:02x}{:02x}", byte(c.R()), byte(c.G()), byte(c.B()),
                                byte(c.A()));
    }
    body->shapes.push_back(shape);
  }

  bool AddMesh(const sdf::Mesh& mesh, const Pose& X, Shape* shape) {
    ++meshes_;
    std::string name = mesh.Uri();
    const fs::path from(OriginalOf(source_, mesh.FilePath()));  // of the included file
    if (from.is_absolute() && name.find("://") == std::string::npos) {
      name = (from.parent_path().lexically_proximate(source_.folder) / name).string();
    }
    const FoundMesh found = FindMesh(name, source_.folder);
    if (found.path.empty()) {
      if (missing_++ == 0) missing_text_ = fmt::format("'{}' {}", mesh.Uri(), found.trouble);
      return false;
    }
    const Vec3 scale = ToVec(mesh.Scale());
    if (!scale.allFinite()) return false;
    shape->geometry = Mesh{.X_BG = X,
                           .file = found.path.string(),
                           .scale = scale,
                           .surface = std::make_shared<const TriangleMesh>()};
    return true;
  }

  // The link that a joint names, "world" included; null after a finding.
  const Link* Find(const Waiting& of, const std::string& name, const std::string& joint) {
    static const Link kWorld;
    if (name == "world") return &kWorld;
    const auto found = links_.find(of.scope + name);
    if (found != links_.end()) return &found->second;
    std::vector<std::string> names;
    for (const auto& [link, place] : links_) names.push_back(link);
    Error("joint " + of.scope + joint,
          fmt::format("joint '{}': there is no link '{}'", joint, name), DidYouMean(name, names));
    return nullptr;
  }

  void AddJoints(const Waiting& of) {
    for (uint64_t k = 0; k < of.model->JointCount(); ++k) {
      const sdf::Joint& from = *of.model->JointByIndex(k);
      const std::string what = "joint " + of.scope + from.Name();
      std::string parent_name, child_name;
      ignition::math::Pose3d pose;
      if (!Check(from.ResolveParentLink(parent_name), what) ||
          !Check(from.ResolveChildLink(child_name), what) ||
          !Check(from.SemanticPose().Resolve(pose, "__model__"), what)) {
        continue;
      }
      const Link* parent = Find(of, parent_name, from.Name());
      const Link* child = Find(of, child_name, from.Name());
      if (parent == nullptr || child == nullptr) continue;
      if (from.Type() == sdf::JointType::GEARBOX) continue;  // AddFollowers()
      if (parent->body == child->body) continue;             // in the world
      const Pose X_WJ = of.X_WM * ToPose(pose);
      Joint joint;
      joint.name = NameOf(of.scope, from.Name());
      joint.parent = parent->body;
      joint.child = child->body;
      joint.X_PF = X_WB(parent->body).inverse() * X_WJ;
      joint.X_CM = X_WB(child->body).inverse() * X_WJ;
      if (!X_WJ.matrix().allFinite()) {
        Error(what, fmt::format("joint '{}': its pose is not finite", from.Name()));
        continue;
      }
      if (!MakeKind(from, what, &joint)) continue;
      Store(of, from, joint);
    }
  }

  [[nodiscard]] const Pose& X_WB(int body) const { return X_WB_[static_cast<size_t>(body)]; }

  // The unit axis in the joint's frame; empty after a finding.
  std::optional<Vec3> AxisOf(const sdf::Joint& from, unsigned k, const std::string& what) {
    const sdf::JointAxis* axis = from.Axis(k);
    ignition::math::Vector3d xyz;
    if (axis == nullptr) {
      Error(what, fmt::format("joint '{}' has no <axis{}>", from.Name(), k == 0 ? "" : "2"));
      return std::nullopt;
    }
    if (!Check(axis->ResolveXyz(xyz), what)) return std::nullopt;
    const Vec3 v = ToVec(xyz);
    if (v.norm() > 1e-9 && std::isfinite(v.norm())) return v.normalized();
    Error(what, fmt::format("joint '{}': the axis ({}, {}, {}) has no direction", from.Name(),
                            v.x(), v.y(), v.z()));
    return std::nullopt;
  }

  bool MakeKind(const sdf::Joint& from, const std::string& what, Joint* joint) {
    int axes = 1;
    switch (from.Type()) {
      case sdf::JointType::REVOLUTE:
      case sdf::JointType::CONTINUOUS:
        joint->kind = JointKind::kRevolute;
        break;
      case sdf::JointType::PRISMATIC:
        joint->kind = JointKind::kPrismatic;
        break;
      case sdf::JointType::SCREW:
        joint->kind = JointKind::kCylindrical;
        break;
      case sdf::JointType::BALL:
        joint->kind = JointKind::kSpherical;
        axes = 0;
        break;
      case sdf::JointType::UNIVERSAL:
      case sdf::JointType::REVOLUTE2:
        joint->kind = JointKind::kUniversal;
        axes = 2;
        break;
      case sdf::JointType::FIXED:
        joint->kind = JointKind::kFixed;
        axes = 0;
        break;
      case sdf::JointType::GEARBOX:
      case sdf::JointType::INVALID:
        Error(what, fmt::format("joint '{}' has no known type", from.Name()));
        return false;
    }
    if (axes > 0) {
      const auto axis = AxisOf(from, 0, what);
      if (!axis) return false;
      joint->axis = *axis;
    }
    if (axes > 1) {
      const auto axis = AxisOf(from, 1, what);
      if (!axis) return false;
      joint->axis2 = *axis;
      if (joint->axis.cross(joint->axis2).norm() < 1e-6) {
        Error(what, fmt::format("joint '{}': its two axes are parallel", from.Name()));
        return false;
      }
    }
    return true;
  }

  // Number below an element, or NaN.
  static double NumberOf(const sdf::ElementPtr& element, const std::string& name) {
    if (element == nullptr || !element->HasElement(name)) return kNan;
    const sdf::ElementPtr found = element->FindElement(name);
    const sdf::ParamPtr value = found == nullptr ? nullptr : found->GetValue();
    double x = kNan;
    return value != nullptr && value->Get(x) ? x : kNan;
  }

  // Where the limits of one of two axes are equal, the other one is a hinge: its number, else 0.
  int HoldAxis(const sdf::Joint& from, const std::string& what, Joint* joint) {
    for (const int k : {0, 1}) {
      const sdf::JointAxis& axis = *from.Axis(static_cast<unsigned>(k));
      const double at = axis.Lower();
      if (at != axis.Upper() || !std::isfinite(at)) continue;
      Warn(what, fmt::format("axis {} of joint '{}' is held at {:g}: its limits leave nothing else",
                             k + 1, joint->name, at));
      const Vec3 held = k == 0 ? joint->axis : joint->axis2;
      const Mat3 R = Eigen::AngleAxisd(at, held).toRotationMatrix();
      if (k == 0) {
        joint->X_PF.linear() = joint->X_PF.linear() * R;
        joint->axis = joint->axis2;
      } else {
        joint->X_CM.linear() = joint->X_CM.linear() * R.transpose();
      }
      joint->kind = JointKind::kRevolute;
      return 1 - k;
    }
    return 0;
  }

  void Store(const Waiting& of, const sdf::Joint& from, Joint joint) {
    const int index = static_cast<int>(m_.joints.size());
    const std::string what = "joint " + of.scope + from.Name();
    const sdf::ElementPtr element = from.Element();
    if (from.Type() == sdf::JointType::SCREW && !AddScrew(from, joint.name, what)) return;
    // The coordinate of a screw that SDF means is its angle.
    const int first = from.Type() == sdf::JointType::SCREW ? 1 : 0;
    const int own_axis = joint.kind == JointKind::kUniversal ? HoldAxis(from, what, &joint) : 0;
    const int dofs = joint.kind == JointKind::kSpherical ? 0 : DofsOf(joint.kind);
    for (int k = first; k < dofs; ++k) {
      const sdf::JointAxis& axis = *from.Axis(static_cast<unsigned>(k - first + own_axis));
      if (from.Type() != sdf::JointType::CONTINUOUS) ReadLimits(axis, k, what, &joint);
      if (joint.kind != JointKind::kFixed) AddElements(axis, index, k, joint);
    }
    if (joint.kind == JointKind::kSpherical && from.Axis(0) != nullptr) {
      AddOfBallJoint(*from.Axis(0), index, joint.name);
    }
    if (element != nullptr && element->HasElement("physics")) {
      const sdf::ElementPtr physics = element->GetElement("physics");
      if (physics->HasElement("simbody") &&
          physics->GetElement("simbody")->Get<bool>("must_be_loop_joint")) {
        joint.closure = true;
      }
    }
    if (const double inertia = NumberOf(element, "drake:rotor_inertia");
        inertia > 0.0 && dofs == 1) {
      const double ratio = NumberOf(element, "drake:gear_ratio");
      m_.elements.push_back(
          {.name = joint.name + "_rotor",
           .joint = index,
           .law = RotorLaw{.inertia = inertia, .ratio = std::isnan(ratio) ? 1.0 : ratio}});
    }
    if (dofs - first == 1 && joint.kind != JointKind::kFixed) {
      const sdf::JointAxis& own = *from.Axis(static_cast<unsigned>(own_axis));
      scalars_.push_back({index, first, from.Name(), own.Effort(), own.MaxVelocity()});
    }
    index_[of.scope + from.Name()] = index;
    m_.joints.push_back(std::move(joint));
  }

  // s = lead · θ/2π. Gazebo's thread_pitch counts radians per metre, with the other sign.
  bool AddScrew(const sdf::Joint& from, const std::string& name, const std::string& what) {
    const double lead = NumberOf(from.Element(), "screw_thread_pitch");
    const double per_radian =
        std::isnan(lead) ? -1.0 / from.ThreadPitch() : lead / (2.0 * std::numbers::pi);
    if (!std::isfinite(per_radian) || per_radian == 0.0) {
      Error(what, fmt::format("joint '{}': a thread of this pitch does not move", from.Name()));
      return false;
    }
    const int index = static_cast<int>(m_.joints.size());
    m_.couplings.push_back(
        {.name = name + "_screw", .terms = {{index, 0, {-1.0}}, {index, 1, {per_radian}}}});
    return true;
  }

  void ReadLimits(const sdf::JointAxis& axis, int k, const std::string& what, Joint* joint) {
    CoordinateRange& range = joint->range[static_cast<size_t>(k)];
    const double lower = axis.Lower(), upper = axis.Upper();
    if (!(lower <= upper)) return;
    if (lower > -kNoSdfLimit) range.lower = lower;
    if (upper < kNoSdfLimit) range.upper = upper;
    if (lower < upper || DofsOf(joint->kind) != 1) return;
    Warn(what, fmt::format("joint '{}' is held at {:g}: its limits leave nothing else", joint->name,
                           lower));
    joint->X_PF = joint->X_PF * JointPose(*joint, {lower});
    joint->kind = JointKind::kFixed;
    joint->range = {};
  }

  void AddElements(const sdf::JointAxis& axis, int index, int k, const Joint& joint) {
    const std::string name = DofsOf(joint.kind) == 1 || joint.kind == JointKind::kCylindrical
                                 ? joint.name
                                 : fmt::format("{}_{}", joint.name, k + 1);
    const auto add = [&](const char* suffix, const auto& law) {
      m_.elements.push_back({.name = name + suffix, .joint = index, .coordinate = k, .law = law});
    };
    if (axis.Damping() > 0.0) add("_damping", DampingLaw{axis.Damping()});
    if (axis.Damping() < 0.0) lost_[{"dynamics", "negative"}].push_back(joint.name);
    if (axis.Friction() > 0.0) {
      add("_friction", FrictionLaw{.coulomb = axis.Friction(), .breakaway = axis.Friction()});
    }
    if (axis.SpringStiffness() != 0.0) {
      add("_spring",
          SpringLaw{.polynomial = {axis.SpringStiffness()}, .free = axis.SpringReference()});
    }
    for (const double x :
         {axis.Damping(), axis.Friction(), axis.SpringStiffness(), axis.SpringReference()}) {
      if (!std::isfinite(x))
        Error("", fmt::format("joint '{}': its dynamics are not finite", name));
    }
  }

  // As Drake reads it: the moment −c ω. A spring of a ball has no coordinate.
  void AddOfBallJoint(const sdf::JointAxis& axis, int index, const std::string& name) {
    const auto add = [&](const char* suffix, const auto& law) {
      AddOfBall({.name = name + suffix, .joint = index, .law = law}, JointKind::kSpherical,
                &m_.elements);
    };
    const double damping = axis.Damping(), friction = axis.Friction();
    if (damping > 0.0) add("_damping", DampingLaw{damping});
    if (damping < 0.0) lost_[{"dynamics", "negative"}].push_back(name);
    if (friction > 0.0) add("_friction", FrictionLaw{.coulomb = friction, .breakaway = friction});
    if (axis.SpringStiffness() != 0.0) lost_[{"ball", "spring_stiffness"}].push_back(name);
    if (!std::isfinite(damping) || !std::isfinite(friction)) {
      Error("", fmt::format("joint '{}': its dynamics are not finite", name));
    }
  }

  // Gear boxes and joints that mimic others.
  void AddFollowers(const Waiting& of) {
    for (uint64_t k = 0; k < of.model->JointCount(); ++k) {
      const sdf::Joint& from = *of.model->JointByIndex(k);
      if (from.Type() == sdf::JointType::GEARBOX) AddGearbox(of, from);
      const sdf::ElementPtr axis = from.Axis(0) == nullptr ? nullptr : from.Axis(0)->Element();
      if (axis == nullptr) continue;
      for (const char* tag : {"mimic", "drake:mimic"}) {
        const sdf::ElementPtr mimic = axis->HasElement(tag) ? axis->FindElement(tag)
                                      : from.Element()->HasElement(tag)
                                          ? from.Element()->FindElement(tag)
                                          : nullptr;
        if (mimic != nullptr) AddMimic(of, from, mimic);
      }
    }
  }

  void AddMimic(const Waiting& of, const sdf::Joint& from, const sdf::ElementPtr& mimic) {
    const std::string what = "joint " + of.scope + from.Name();
    const auto number = [&](const char* name, double otherwise) {
      double x = NumberOf(mimic, name);
      if (std::isnan(x) && mimic->HasAttribute(name)) {
        std::istringstream text(mimic->Get<std::string>(name));
        if (!(text >> x)) x = kNan;
      }
      return std::isnan(x) ? otherwise : x;
    };
    const std::string leader = mimic->HasAttribute("joint") ? mimic->Get<std::string>("joint") : "";
    const auto follows = index_.find(of.scope + from.Name()),
               leading = index_.find(of.scope + leader);
    const auto is_scalar = [&](const auto& found) {
      return found != index_.end() &&
             DofsOf(m_.joints[static_cast<size_t>(found->second)].kind) == 1;
    };
    const bool second = mimic->HasAttribute("axis") && mimic->Get<std::string>("axis") == "axis2";
    if (!is_scalar(follows) || !is_scalar(leading) || second ||
        leading->second == follows->second) {
      std::vector<std::string> names;
      for (const auto& [name, index] : index_) names.push_back(name);
      Error(what,
            fmt::format("joint '{}': mimic of '{}', which is not another joint with one coordinate",
                        from.Name(), leader),
            DidYouMean(of.scope + leader, names));
      return;
    }
    const double multiplier = number("multiplier", 1.0);
    const double constant = number("offset", 0.0) - multiplier * number("reference", 0.0);
    if (multiplier == 0.0 || !std::isfinite(multiplier + constant)) {
      Error(what, fmt::format("joint '{}': mimic of '{}': multiplier {} couples nothing",
                              from.Name(), leader, multiplier));
      return;
    }
    m_.couplings.push_back(
        {.name = NameOf(of.scope, from.Name()) + "_mimic",
         .terms = {{follows->second, 0, {-1.0}}, {leading->second, 0, {multiplier}}},
         .constant = constant});
    followers_.insert(follows->second);
  }

  // The hinge between two bodies about a line of this direction, and whether the angle of `b` in
  // `a` about the direction grows with its coordinate; -1 without one.
  [[nodiscard]] std::pair<int, double> HingeBetween(int a, int b, const Vec3& axis_W) const {
    constexpr double kParallel = 1e-6;
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      const Joint& joint = m_.joints[j];
      const bool forth = joint.parent == a && joint.child == b;
      const bool back = joint.parent == b && joint.child == a;
      if (joint.kind != JointKind::kRevolute || (!forth && !back)) continue;
      const Vec3 other_W = (X_WB(joint.parent) * joint.X_PF).linear() * joint.axis;
      if (other_W.cross(axis_W).norm() > kParallel) continue;
      const double along = other_W.dot(axis_W) > 0.0 ? 1.0 : -1.0;
      return {static_cast<int>(j), forth ? along : -along};
    }
    return {-1, 0.0};
  }

  // θ2 = -ratio θ1, angles of child and parent in the reference body about axis2 and axis.
  void AddGearbox(const Waiting& of, const sdf::Joint& from) {
    const std::string what = "joint " + of.scope + from.Name();
    const sdf::ElementPtr element = from.Element();
    const auto axis = AxisOf(from, 0, what);
    const auto axis2 = from.Axis(1) == nullptr ? axis : AxisOf(from, 1, what);
    std::string parent_name, child_name;
    ignition::math::Pose3d pose;
    if (!axis || !axis2 || !Check(from.ResolveParentLink(parent_name), what) ||
        !Check(from.ResolveChildLink(child_name), what) ||
        !Check(from.SemanticPose().Resolve(pose, "__model__"), what)) {
      return;
    }
    const std::string reference_name = element->HasElement("gearbox_reference_body")
                                           ? element->Get<std::string>("gearbox_reference_body")
                                           : "";
    const double given = NumberOf(element, "gearbox_ratio");
    const double ratio = std::isnan(given) ? 1.0 : given;
    const Link* reference = Find(of, reference_name, from.Name());
    const Link* parent = Find(of, parent_name, from.Name());
    const Link* child = Find(of, child_name, from.Name());
    if (reference == nullptr || parent == nullptr || child == nullptr) return;
    const Mat3 R_WJ = (of.X_WM * ToPose(pose)).linear();
    const auto [first, sign1] = HingeBetween(reference->body, parent->body, R_WJ * *axis);
    const auto [second, sign2] = HingeBetween(reference->body, child->body, R_WJ * *axis2);
    if (first < 0 || second < 0 || first == second || ratio == 0.0 || !std::isfinite(ratio)) {
      lost_[{"gearbox", ""}].push_back(NameOf(of.scope, from.Name()));
      return;
    }
    m_.couplings.push_back({.name = NameOf(of.scope, from.Name()),
                            .terms = {{second, 0, {sign2}}, {first, 0, {ratio * sign1}}}});
    followers_.insert(second);
  }

  // Bodies that no joints tie to the world: one of those that hang together is held.
  void HoldWhatFloats() {
    std::vector<int> group(m_.bodies.size());
    std::iota(group.begin(), group.end(), 0);
    for (const Joint& joint : m_.joints) {
      const int a = group[static_cast<size_t>(joint.parent)];
      const int b = group[static_cast<size_t>(joint.child)];
      std::ranges::replace(group, std::max(a, b), std::min(a, b));
    }
    int base = -1;
    if (!source_.base.held.empty()) {
      const std::vector<std::string> names = NamesOf(m_.bodies);
      const auto found = std::ranges::find(names.begin() + 1, names.end(), source_.base.held);
      base = found == names.end() ? -1 : static_cast<int>(found - names.begin());
      if (base < 0) {
        Error("", fmt::format("base {}: there is no link of this name", source_.base.held),
              DidYouMean(source_.base.held, names));
      } else if (group[static_cast<size_t>(base)] == 0) {
        Error("",
              fmt::format("base {}: the link does not float, joints hold it in the world",
                          source_.base.held),
              "only what nothing ties to the world needs a base");
      }
    }
    std::map<int, int> held;  // by group
    for (int b = 1; b < static_cast<int>(m_.bodies.size()); ++b) {
      const int g = group[static_cast<size_t>(b)];
      if (g == 0) continue;
      const auto [at, is_first] = held.emplace(g, b);
      const bool better = base >= 0 && group[static_cast<size_t>(base)] == g
                              ? b == base
                              : canonical_.contains(b) && !canonical_.contains(at->second);
      if (!is_first && better) at->second = b;
    }
    std::vector<std::string> names;
    for (const auto& [g, b] : held) {
      Joint weld;
      weld.name = m_.bodies[static_cast<size_t>(b)].name + (source_.base.free ? "_free" : "_held");
      if (source_.base.free) weld.kind = JointKind::kFree;
      weld.child = b;
      weld.X_PF = X_WB(b);
      m_.joints.push_back(weld);
      names.push_back(m_.bodies[static_cast<size_t>(b)].name);
    }
    if (!names.empty() && !source_.base.free) {
      LeaveOut("floating", "",
               fmt::format("the freedom of {} in the world", Joined(names, kMostNames)));
    }
  }

  // Joints that plugins control; else, where the effort of some is limited to nothing, the others.
  void AddDrives() {
    const bool some_passive =
        std::ranges::any_of(scalars_, [](const Scalar& scalar) { return scalar.effort == 0.0; });
    for (const Scalar& scalar : scalars_) {
      const bool named = Contains(source_.motors, scalar.name);
      const bool is_driven = source_.motors.empty() ? some_passive && scalar.effort != 0.0 : named;
      const Joint& joint = m_.joints[static_cast<size_t>(scalar.joint)];
      if (!is_driven || followers_.contains(scalar.joint)) continue;
      m_.drives.push_back({.name = joint.name,
                           .kind = JointDrive{scalar.joint, scalar.coordinate},
                           .range = joint.range[static_cast<size_t>(scalar.coordinate)]});
      Motor motor;
      motor.drive = static_cast<int>(m_.drives.size()) - 1;
      motor.turns = !IsLength(joint.kind, scalar.coordinate);
      for (const auto& [limit, into] :
           {std::pair(scalar.effort, &motor.peak), {scalar.velocity, &motor.max_speed}}) {
        if (limit > 0.0 && limit < kNoSdfLimit) *into = limit;
      }
      if (std::isinf(motor.peak) && std::isinf(motor.max_speed)) continue;
      m_.motors.push_back(std::move(motor));
    }
  }

  void ReportBodies() {
    if (unstated_.empty()) return;
    Warn("", fmt::format("{} link{} not state mass and inertia ({}): as SDF says, what is missing "
                         "is 1 kg and 1 kg m²",
                         unstated_.size(), unstated_.size() == 1 ? " does" : "s do",
                         Joined(unstated_, kMostNames)));
  }

  void ReportMeshes() {
    if (missing_ == 0) return;
    Warn("",
         fmt::format("{} of {} meshes {} left out: {}{}", missing_, meshes_,
                     missing_ == 1 ? "is" : "are", missing_text_, missing_ == 1 ? "" : ", for one"),
         "--package NAME=DIR names folders of meshes");
  }

  // A coordinate that a drive may have.
  struct Scalar {
    int joint = 0, coordinate = 0;
    std::string name;
    double effort = 0.0, velocity = 0.0;  ///< limits; without one negative or infinite
  };

  const SdfSource& source_;
  Diagnostics& diagnostics_;
  Mechanism m_;
  bool prefixed_ = false;                        // names begin with their model's
  std::vector<Pose> X_WB_ = {Pose::Identity()};  // per body, in the pose of the file
  std::map<std::string, Link> links_;            // by MODEL::NAME
  std::map<std::string, int> index_;             // of joints, by MODEL::NAME
  std::set<int> canonical_, followers_;
  std::vector<Waiting> models_;
  std::vector<Scalar> scalars_;
  std::map<std::pair<std::string, std::string>, std::vector<std::string>> lost_;
  std::vector<std::string> unstated_, frozen_;
  std::vector<ModelCaveat> left_out_;
  size_t meshes_ = 0, missing_ = 0;
  std::string missing_text_;
};

// While it lives, what is written to the C++ streams goes nowhere.
class Silence {
 public:
  Silence() : cerr_(std::cerr.rdbuf(said_.rdbuf())), cout_(std::cout.rdbuf(said_.rdbuf())) {}
  ~Silence() {
    std::cerr.rdbuf(cerr_);
    std::cout.rdbuf(cout_);
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;

 private:
  std::ostringstream said_;
  std::streambuf *cerr_, *cout_;
};

// libsdformat reports as text alone: the joint or link that it quotes.
const SdfSource::Place* PlaceQuoted(const SdfSource& source, const std::string& said) {
  for (const SdfSource::Place& place : source.places) {
    const size_t kind = place.name.find(' ');
    const std::string name = place.name.substr(place.name.find_last_of(" :") + 1);
    const std::string quoted = fmt::format("{} with name[{}]", place.name.substr(0, kind), name);
    if (said.find(quoted) != std::string::npos) return &place;
  }
  return nullptr;
}

Finding FindingOf(const sdf::Error& error, const SdfSource& source) {
  const std::string file = OriginalOf(source, error.FilePath().value_or(""));  // none of a text
  Finding finding{.severity = Severity::kError, .file = source.file, .message = {}, .hint = {}};
  if (!file.empty() && file.front() == '/') finding.file = file;
  finding.line = std::max(0, error.LineNumber().value_or(0));
  finding.message = "libsdformat: " + Shortened(OneLine(error.Message()), 500);
  const SdfSource::Place* place = PlaceQuoted(source, error.Message());
  if (finding.line == 0 && place != nullptr) {
    finding.file = place->file;
    finding.line = place->line;
  }
  finding.column = finding.line > 0 ? 1 : 0;
  return finding;
}

// Without those that only follow from others.
void AddErrors(const sdf::Errors& errors, const SdfSource& source, Diagnostics* found) {
  using sdf::ErrorCode;
  const auto has = [&](ErrorCode code) {
    return std::ranges::any_of(errors, [code](const sdf::Error& e) { return e.Code() == code; });
  };
  if (has(ErrorCode::STRING_READ)) {  // the elements around the first follow
    found->Add(FindingOf(errors.front(), source));
    return;
  }
  std::vector<const sdf::Error*> own, others;
  for (const sdf::Error& error : errors) {
    // Of inertias that no body has, the loader knows more.
    if (error.Code() == ErrorCode::LINK_INERTIA_INVALID) continue;
    const bool follows = error.Code() == ErrorCode::POSE_RELATIVE_TO_GRAPH_ERROR ||
                         error.Code() == ErrorCode::FRAME_ATTACHED_TO_GRAPH_ERROR;
    (follows ? others : own).push_back(&error);
  }
  for (const sdf::Error* error : own.empty() ? others : own) found->Add(FindingOf(*error, source));
}

// An included file for libsdformat, which loses what is merged into a file that is merged itself:
// such a file is written out with its parts. "" or what went wrong.
std::string WriteCopy(const SdfSource& source, const SdfSource::Include& include,
                      const sdf::ParserConfig& config) {
  const fs::path copy = CopyOf(source, include);
  const std::string trouble = WriteFile(copy, include.text);
  if (!trouble.empty() || include.text.find("merge") == std::string::npos) return trouble;
  const sdf::SDFPtr whole(new sdf::SDF());
  sdf::Errors errors;
  if (!sdf::init(whole) || !sdf::readFile(copy.string(), config, whole, errors)) return "";
  return WriteFile(copy, whole->ToString());
}

ForeignModel AnswerOf(const SdfSource& source) {
  Diagnostics found;
  std::vector<MeshPackage> packages;
  for (size_t k = 0; k + 1 < source.packages.size(); k += 2) {
    packages.push_back({source.packages[k], source.packages[k + 1]});
  }
  UseMeshPackages(std::move(packages));
  // Includes are those that were let in. libsdformat looks into folders of its own first.
  for (const SdfSource::Include& include : source.includes) {
    const size_t scheme = include.uri.find("://");
    const std::string name =
        scheme == std::string::npos ? include.uri : include.uri.substr(scheme + 3);
    sdf::ParserConfig none;
    const std::string own = sdf::findFile(name, true, false, none);
    std::error_code error;
    if (!own.empty() && fs::weakly_canonical(own, error) != fs::path(include.file)) {
      found.AddError(source.file,
                     fmt::format("include '{}' is {} for libsdformat", include.uri, own),
                     "give the file another name");
    }
  }
  sdf::ParserConfig config;
  config.SetFindCallback([&](const std::string& uri) {
    const auto include = std::ranges::find(source.includes, uri, &SdfSource::Include::uri);
    return include == source.includes.end() ? std::string() : CopyOf(source, *include).string();
  });
  config.SetUnrecognizedElementsPolicy(sdf::EnforcementPolicy::LOG);
  config.SetDeprecatedElementsPolicy(sdf::EnforcementPolicy::LOG);
  // The innermost come last.
  for (auto include = source.includes.rbegin(); include != source.includes.rend(); ++include) {
    const std::string trouble = WriteCopy(source, *include, config);
    if (!trouble.empty()) found.AddError(include->file, trouble);
  }
  sdf::Root root;
  if (!found.has_errors()) AddErrors(root.LoadSdfString(source.text, config), source, &found);
  if (found.has_errors()) {
    return {.findings = found.findings(), .model = "", .left_out = {}, .printed = {}};
  }
  SdfImporter importer(source, &found);
  importer.Read(root);
  return importer.Take();
}

}  // namespace
}  // namespace mbv

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("mbverify-read-sdf SOURCE ANSWER: a part of mbverify, which calls it\n", stderr);
    return 2;
  }
  const auto bytes = mbv::ReadWholeFile(argv[1]);
  const auto source = bytes ? mbv::FromBytes<mbv::SdfSource>(*bytes) : std::nullopt;
  if (!source) return 2;
  const mbv::Silence silence;
  try {
    return mbv::WriteFile(argv[2], mbv::ToBytes(mbv::AnswerOf(*source))).empty() ? 0 : 3;
  } catch (const std::exception&) {
    return 3;
  }
}
