#include "simulation/read_mjcf.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <vector>

#include "core/spatial.h"
#include "core/text.h"
#include "mjcf/foreign.h"
#include "simulation/import_mjcf.h"

namespace mbv {
namespace {

using simulation::EngineError;
using simulation::ModelHandle;

Vec3 VecAt(const mjtNum* data) { return {data[0], data[1], data[2]}; }

Mat3 RotationAt(const mjtNum* quat) {
  return Eigen::Quaterniond(quat[0], quat[1], quat[2], quat[3]).normalized().toRotationMatrix();
}

Pose PoseAt(const mjtNum* pos, const mjtNum* quat) {
  Pose X = Pose::Identity();
  X.translation() = VecAt(pos);
  X.linear() = RotationAt(quat);
  return X;
}

Pose Shifted(const Vec3& p) {
  Pose X = Pose::Identity();
  X.translation() = p;
  return X;
}

class MjcfImporter {
 public:
  MjcfImporter(const mjModel& m, const mjcf::ForeignMjcf& foreign, const std::string& file,
               Diagnostics* diagnostics)
      : m_(m), foreign_(foreign), file_(file), diagnostics_(diagnostics) {}

  Mechanism Run() {
    mechanism_.file = file_;
    mechanism_.gravity_W = VecAt(m_.opt.gravity);
    if (mechanism_.gravity_W.norm() > 0.0) {
      mechanism_.up_W = -mechanism_.gravity_W.normalized();
    }
    qpos_ = m_.nkey > 0 ? m_.key_qpos : m_.qpos0;
    mechanism_.bodies.push_back({.name = "world", .frames = {}, .shapes = {}});
    index_.assign(static_cast<size_t>(m_.nbody), 0);
    joint_index_.assign(static_cast<size_t>(m_.njnt), -1);
    closure_index_.assign(static_cast<size_t>(m_.neq), -1);
    for (int b = 1; b < m_.nbody; ++b) AddBody(b);
    for (int e = 0; e < m_.neq; ++e) AddEquality(e);
    for (int u = 0; u < m_.nu; ++u) AddActuator(u);
    AddSites();
    AddShapes();
    SayWhatIsLost();
    return std::move(mechanism_);
  }

  /// Per joint and equality of MuJoCo: the mechanism's joint, or -1.
  [[nodiscard]] const std::vector<int>& joint_index() const { return joint_index_; }
  [[nodiscard]] const std::vector<int>& closure_index() const { return closure_index_; }

 private:
  void Say(const std::string& text, const std::string& hint = "") {
    diagnostics_->Add({Severity::kWarning, file_, 0, 0, text, hint});
  }
  [[nodiscard]] std::string NameOf(mjtObj type, int id, const char* kind) const {
    const char* name = mj_id2name(&m_, type, id);
    return name != nullptr && name[0] != '\0' ? name : fmt::format("{}_{}", kind, id);
  }
  [[nodiscard]] std::string JointNameOf(int j) const { return NameOf(mjOBJ_JOINT, j, "joint"); }

  int NewBody(const std::string& name) {
    mechanism_.bodies.push_back({.name = name, .frames = {}, .shapes = {}});
    return static_cast<int>(mechanism_.bodies.size()) - 1;
  }

  void AddBody(int b) {
    const std::string name = NameOf(mjOBJ_BODY, b, "body");
    const int first = m_.body_jntadr[b], count = m_.body_jntnum[b];
    int inboard = index_[static_cast<size_t>(m_.body_parentid[b])];
    Pose X_PB = PoseAt(m_.body_pos + 3 * b, m_.body_quat + 4 * b);
    // Each joint but the last carries a massless piece that lies where the body does.
    for (int k = 0; k < count; ++k) {
      const int j = first + k;
      const bool last = k + 1 == count;
      const int outboard = NewBody(last ? name : fmt::format("{}_{}", name, JointNameOf(j)));
      AddJoint(j, inboard, outboard, X_PB);
      inboard = outboard;
      X_PB = Pose::Identity();
    }
    if (count == 0) {
      const int outboard = NewBody(name);
      Joint weld;
      weld.name = name + "_fixed";
      weld.parent = inboard;
      weld.child = outboard;
      weld.X_PF = X_PB;
      mechanism_.joints.push_back(weld);
      inboard = outboard;
    }
    index_[static_cast<size_t>(b)] = inboard;
    Body& body = mechanism_.bodies[static_cast<size_t>(inboard)];
    const Mat3 R = RotationAt(m_.body_iquat + 4 * b);
    body.mass = m_.body_mass[b];
    body.p_BoBcm_B = VecAt(m_.body_ipos + 3 * b);
    body.I_Bcm_B = R * VecAt(m_.body_inertia + 3 * b).asDiagonal() * R.transpose();
    body.I_Bcm_B = 0.5 * (body.I_Bcm_B + body.I_Bcm_B.transpose()).eval();
    if (body.mass == 0.0) body.I_Bcm_B.setZero();
  }

  // `X_PB`: the body at the joint's reference position.
  void AddJoint(int j, int inboard, int outboard, const Pose& X_PB) {
    const Vec3 anchor = VecAt(m_.jnt_pos + 3 * j);
    const int at = m_.jnt_qposadr[j];
    Joint joint;
    joint.name = JointNameOf(j);
    joint.parent = inboard;
    joint.child = outboard;
    joint.axis = VecAt(m_.jnt_axis + 3 * j).normalized();
    switch (m_.jnt_type[j]) {
      case mjJNT_HINGE:
      case mjJNT_SLIDE:
        joint.kind = m_.jnt_type[j] == mjJNT_HINGE ? JointKind::kRevolute : JointKind::kPrismatic;
        joint.X_PF = X_PB * Shifted(anchor);
        joint.X_CM = Shifted(anchor);
        joint.home[0] = qpos_[at] - m_.qpos0[at];
        if (m_.jnt_limited[j] != 0) {
          joint.range[0] = {m_.jnt_range[2 * j] - m_.qpos0[at],
                            m_.jnt_range[2 * j + 1] - m_.qpos0[at]};
        }
        if (m_.qpos0[at] != 0.0) shifted_.push_back(joint.name);
        if (m_.nkey == 0) StartInside(&joint);
        break;
      case mjJNT_BALL: {
        joint.kind = JointKind::kSpherical;
        joint.X_PF = X_PB * Shifted(anchor);
        joint.X_CM = Shifted(anchor);
        const Mat3 R = RotationAt(m_.qpos0 + at).transpose() * RotationAt(qpos_ + at);
        const Vec3 rpy = RpyOf(R);
        joint.home = {rpy.x(), rpy.y(), rpy.z(), 0, 0, 0};
        break;
      }
      default:  // free
        joint.kind = JointKind::kFixed;
        joint.X_PF = PoseAt(qpos_ + at, qpos_ + at + 3);
        held_.push_back(mechanism_.bodies[static_cast<size_t>(outboard)].name);
        break;
    }
    joint.guess = joint.home;
    joint_index_[static_cast<size_t>(j)] = static_cast<int>(mechanism_.joints.size());
    mechanism_.joints.push_back(joint);
  }

  // Without a pose of the file, the zero of a joint may be far from where it works: a stretched
  // leg.
  void StartInside(Joint* joint) {
    constexpr double kShare = 0.2;  // of the range, from its near end
    const CoordinateRange& range = joint->range[0];
    const double width = range.upper - range.lower;
    if (joint->home[0] >= range.lower && joint->home[0] <= range.upper) return;
    joint->home[0] =
        joint->home[0] < range.lower ? range.lower + kShare * width : range.upper - kShare * width;
    moved_.push_back(joint->name);
  }

  void AddEquality(int e) {
    const std::string name = NameOf(mjOBJ_EQUALITY, e, "equality");
    const mjtNum* data = m_.eq_data + mjNEQDATA * e;
    const bool connect = m_.eq_type[e] == mjEQ_CONNECT, weld = m_.eq_type[e] == mjEQ_WELD;
    if (m_.eq_active[e] == 0) {
      Say(fmt::format("equality '{}' is switched off in the file, and left out", name));
      return;
    }
    if (!connect && !weld) {
      AddCoupling(e, name, data);
      return;
    }
    Joint joint;
    joint.name = name;
    joint.closure = true;
    joint.kind = connect ? JointKind::kSpherical : JointKind::kFixed;
    joint.parent = index_[static_cast<size_t>(m_.eq_obj1id[e])];
    joint.child = index_[static_cast<size_t>(m_.eq_obj2id[e])];
    const auto sites = foreign_.closures_by_sites().find(name);
    if (sites != foreign_.closures_by_sites().end()) {
      joint.X_PF = SitePose(sites->second.first);
      joint.X_CM = SitePose(sites->second.second);
    } else if (connect) {
      joint.X_PF = Shifted(VecAt(data));
      joint.X_CM = Shifted(VecAt(data + 3));
    } else {
      joint.X_PF = PoseAt(data + 3, data + 6);
      joint.X_CM = Shifted(VecAt(data));
    }
    if (joint.parent == joint.child) {
      Say(fmt::format("equality '{}' connects a body with itself and is left out", name));
      return;
    }
    closure_index_[static_cast<size_t>(e)] = static_cast<int>(mechanism_.joints.size());
    mechanism_.joints.push_back(joint);
  }

  // q_1 = Σ_i a_i q_2^i of two joints or fixed tendons, all counted from the reference pose.
  void AddCoupling(int e, const std::string& name, const mjtNum* a) {
    Coupling coupling{.name = name, .terms = {}};
    bool known = m_.eq_type[e] == mjEQ_JOINT || m_.eq_type[e] == mjEQ_TENDON;
    const auto add = [&](int object, const std::vector<double>& polynomial) {
      known = known && AddTerms(m_.eq_type[e], object, polynomial, &coupling);
    };
    add(m_.eq_obj1id[e], {-1.0});
    std::vector<double> polynomial(a + 1, a + 5);
    while (!polynomial.empty() && polynomial.back() == 0.0) polynomial.pop_back();
    if (m_.eq_obj2id[e] >= 0 && !polynomial.empty()) add(m_.eq_obj2id[e], polynomial);
    coupling.constant = a[0];
    if (known && coupling.terms.size() == 1) {
      Say(fmt::format("equality '{}' holds joint '{}' alone and is left out: it is driven, or free",
                      name, mechanism_.joints[static_cast<size_t>(coupling.terms[0].joint)].name));
      return;
    }
    if (known) {
      mechanism_.couplings.push_back(coupling);
      return;
    }
    Say(fmt::format("equality '{}' is left out: what it couples is free", name),
        "couplings are known of hinges and slides, by a polynomial or by linear fixed tendons");
  }

  // A joint's polynomial, or that of a fixed tendon Σ c_k q_k, which must be linear.
  bool AddTerms(int type, int object, const std::vector<double>& polynomial, Coupling* coupling) {
    const auto add = [&](int joint, const std::vector<double>& p) {
      if (m_.jnt_type[joint] != mjJNT_HINGE && m_.jnt_type[joint] != mjJNT_SLIDE) return false;
      const int at = joint_index_[static_cast<size_t>(joint)];
      const bool twice = std::ranges::any_of(
          coupling->terms, [&](const Coupling::Term& term) { return term.joint == at; });
      coupling->terms.push_back({.joint = at, .coordinate = 0, .polynomial = p});
      return !twice;
    };
    if (type == mjEQ_JOINT) return add(object, polynomial);
    if (polynomial.size() != 1) return false;
    if (m_.tendon_stiffness[object] == 0.0 && m_.tendon_damping[object] == 0.0) {
      coupling_tendons_.insert(object);
    }
    const int first = m_.tendon_adr[object];
    for (int w = first; w < first + m_.tendon_num[object]; ++w) {
      if (m_.wrap_type[w] != mjWRAP_JOINT) return false;
      if (!add(m_.wrap_objid[w], {polynomial[0] * m_.wrap_prm[w]})) return false;
    }
    return true;
  }

  [[nodiscard]] Pose SitePose(const std::string& name) const {
    const int s = simulation::IdOf(m_, mjOBJ_SITE, name);
    return PoseAt(m_.site_pos + 3 * s, m_.site_quat + 4 * s);
  }

  void AddActuator(int u) {
    const std::string name = NameOf(mjOBJ_ACTUATOR, u, "actuator");
    const int target = m_.actuator_trnid[2 * u];
    const bool on_joint =
        m_.actuator_trntype[u] == mjTRN_JOINT || m_.actuator_trntype[u] == mjTRN_JOINTINPARENT;
    const int j = on_joint ? joint_index_[static_cast<size_t>(target)] : -1;
    if (j < 0 || FreedomsOf(mechanism_.joints[static_cast<size_t>(j)].kind) != 1) {
      Say(fmt::format("actuator '{}' does not act on a hinge or slide and is left out", name));
      return;
    }
    for (const Drive& drive : mechanism_.drives) {
      if (std::get<JointDrive>(drive.kind).joint == j) return;  // a second actuator on it
    }
    if (m_.actuator_gear[6 * u] != 1.0) geared_.push_back(name);
    Drive drive{.name = name,
                .kind = JointDrive{j, 0},
                .range = mechanism_.joints[static_cast<size_t>(j)].range[0]};
    mechanism_.drives.push_back(drive);
  }

  void AddSites() {
    for (int s = 0; s < m_.nsite; ++s) {
      Body& body =
          mechanism_.bodies[static_cast<size_t>(index_[static_cast<size_t>(m_.site_bodyid[s])])];
      body.frames.push_back(
          {NameOf(mjOBJ_SITE, s, "site"), PoseAt(m_.site_pos + 3 * s, m_.site_quat + 4 * s)});
    }
  }

  void AddMesh(int g, const mjcf::ForeignMesh& mesh) {
    Shape shape;
    shape.geometry = Mesh{.X_BG = PoseAt(m_.geom_pos + 3 * g, m_.geom_quat + 4 * g) * mesh.X_GF,
                          .file = mesh.file,
                          .scale = mesh.scale,
                          .surface = std::make_shared<const TriangleMesh>()};
    const float* rgba = m_.geom_rgba + 4 * g;
    const auto byte = [](float x) {
      return static_cast<int>(std::lround(255.0 * std::clamp(double{x}, 0.0, 1.0)));
    };
    const bool plain = rgba[0] == 0.5F && rgba[1] == 0.5F && rgba[2] == 0.5F;  // MuJoCo's default
    if (!plain) {
      shape.color = fmt::format("#{:02x}{:02x}{:02x}{:02x}", byte(rgba[0]), byte(rgba[1]),
                                byte(rgba[2]), byte(rgba[3]));
    }
    const int b = index_[static_cast<size_t>(m_.geom_bodyid[g])];
    auto& shapes = mechanism_.bodies[static_cast<size_t>(b)].shapes;
    const auto& geometry = std::get<Mesh>(shape.geometry);
    // The same mesh once more, to be touched.
    const bool again = std::any_of(shapes.begin(), shapes.end(), [&](const Shape& other) {
      const auto* known = std::get_if<Mesh>(&other.geometry);
      return known != nullptr && known->file == geometry.file && known->scale == geometry.scale &&
             known->X_BG.isApprox(geometry.X_BG, 1e-12);
    });
    constexpr int kHidden = 3;  // groups from here on are switched off in MuJoCo's viewer
    if (!again && m_.geom_group[g] < kHidden) shapes.push_back(shape);
  }

  void AddShapes() {
    for (int g = 0; g < m_.ngeom; ++g) {
      if (m_.geom_contype[g] != 0 || m_.geom_conaffinity[g] != 0) touching_ = true;
      const int b = m_.geom_bodyid[g];
      const auto mesh = foreign_.meshes().find(NameOf(mjOBJ_GEOM, g, "geom"));
      if (mesh != foreign_.meshes().end()) {
        AddMesh(g, mesh->second);
        continue;
      }
      if (b == 0) continue;  // floors
      const Pose X = PoseAt(m_.geom_pos + 3 * g, m_.geom_quat + 4 * g);
      const mjtNum* size = m_.geom_size + 3 * g;
      const Vec3 half(0, 0, size[1]);
      Shape shape;
      switch (m_.geom_type[g]) {
        case mjGEOM_SPHERE:
          shape.geometry = Ball{X.translation(), size[0]};
          break;
        case mjGEOM_CAPSULE:
          shape.geometry = Capsule{X * Vec3(-half), X * half, size[0]};
          break;
        case mjGEOM_CYLINDER:
          shape.geometry = Cylinder{X * Vec3(-half), X * half, size[0]};
          break;
        case mjGEOM_BOX:
          shape.geometry = Box{X, 2.0 * VecAt(size)};
          break;
        default:
          continue;
      }
      mechanism_.bodies[static_cast<size_t>(index_[static_cast<size_t>(b)])].shapes.push_back(
          shape);
    }
  }

  // Joints of which a number that acts on forces is not zero.
  std::vector<std::string> JointsWith(const mjtNum* per_dof) const {
    std::vector<std::string> names;
    for (int d = 0; d < m_.nv; ++d) {
      const std::string name = JointNameOf(m_.dof_jntid[d]);
      const bool held = m_.jnt_type[m_.dof_jntid[d]] == mjJNT_FREE;
      if (per_dof[d] != 0.0 && !held && (names.empty() || names.back() != name)) {
        names.push_back(name);
      }
    }
    return names;
  }

  void SayWhatIsLost() {
    constexpr size_t kMost = 6;
    const auto lost = [&](const char* what, const std::vector<std::string>& names,
                          const std::string& hint) {
      if (names.empty()) return;
      Say(fmt::format("{} of {} joint{} is left out: {}", what, names.size(),
                      names.size() == 1 ? "" : "s", Joined(names, kMost)),
          hint);
    };
    const std::string forces = "drive forces are computed without it";
    lost("armature", JointsWith(m_.dof_armature), forces);
    lost("damping", JointsWith(m_.dof_damping), forces);
    lost("friction loss", JointsWith(m_.dof_frictionloss), forces);
    std::vector<std::string> springs;
    for (int j = 0; j < m_.njnt; ++j) {
      if (m_.jnt_stiffness[j] != 0.0) springs.push_back(JointNameOf(j));
    }
    lost("stiffness", springs, forces);
    if (const size_t lost_tendons = static_cast<size_t>(m_.ntendon) - coupling_tendons_.size();
        lost_tendons > 0) {
      Say(fmt::format("{} tendons are left out", lost_tendons), forces);
    }
    if (!geared_.empty()) {
      Say("the gears of these actuators are left out: " + Joined(geared_, kMost),
          "positions and forces are those of the joint, not of the motor");
    }
    if (!held_.empty()) {
      Say("free bodies are held where they are, fixed to the world: " + Joined(held_, kMost));
    }
    if (!shifted_.empty()) {
      Say("positions of these joints count from the file's reference (ref): " +
          Joined(shifted_, kMost));
    }
    if (!moved_.empty()) {
      Say("zero is beyond the range of these joints, the loops are closed from inside it: " +
          Joined(moved_, kMost));
    }
    if (touching_) Say("there are no contacts here: geoms do not touch");
    if (m_.nkey > 0) {
      Say(fmt::format("the loops are closed from the keyframe '{}'",
                      NameOf(mjOBJ_KEY, 0, "keyframe")));
    }
  }

  const mjModel& m_;
  const mjcf::ForeignMjcf& foreign_;
  const std::string& file_;
  Diagnostics* diagnostics_;
  Mechanism mechanism_;
  const mjtNum* qpos_ = nullptr;                  // pose of the file
  std::vector<int> index_;                        // per MuJoCo body
  std::vector<int> joint_index_, closure_index_;  // per MuJoCo joint, equality
  std::vector<std::string> held_, geared_, shifted_, moved_;
  std::set<int> coupling_tendons_;  // that are nothing but the sum in a coupling
  bool touching_ = false;
};

}  // namespace

namespace simulation {

std::optional<ImportedMjcf> ImportMjcf(const std::string& text, const std::string& file,
                                       const std::vector<std::string>& warnings,
                                       Diagnostics* diagnostics) {
  mjcf::ForeignMjcf foreign(text, file, diagnostics);
  if (!foreign.ok()) return std::nullopt;
  constexpr int kMostRounds = 200;
  for (int round = 0; round < kMostRounds; ++round) {
    try {
      ImportedMjcf imported;
      imported.text = foreign.Text();
      imported.model = CompileMjcf(imported.text);
      const mjModel& m = *imported.model;
      MjcfImporter importer(m, foreign, file, diagnostics);
      imported.mechanism = importer.Run();
      imported.mechanism.name = foreign.ModelName();
      imported.joint_of = importer.joint_index();
      imported.closure_of = importer.closure_index();
      for (int e = 0; e < m.neq; ++e) {
        const char* name = mj_id2name(&m, mjOBJ_EQUALITY, e);
        imported.closed_by_sites.push_back(name != nullptr &&
                                           foreign.closures_by_sites().contains(name));
      }
      for (const std::string& warning : warnings) {
        diagnostics->Add({Severity::kWarning, file, 0, 0, "MuJoCo: " + warning, ""});
      }
      return imported;
    } catch (const EngineError& error) {
      if (foreign.DropWhatIsUnknown(error.what())) continue;
      diagnostics->AddError(file, std::string("MuJoCo: ") + error.what());
      return std::nullopt;
    }
  }
  diagnostics->AddError(file, "too many things in it are unknown to MuJoCo 2.2");
  return std::nullopt;
}

}  // namespace simulation

std::optional<Mechanism> ReadMjcf(const std::string& text, const std::string& file,
                                  Diagnostics* diagnostics) {
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  auto imported = simulation::ImportMjcf(text, file, warnings, diagnostics);
  if (!imported) return std::nullopt;
  return std::move(imported->mechanism);
}

}  // namespace mbv
