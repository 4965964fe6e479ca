#include "features/mjcf_audit/source_options.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/markup.h"
#include "mechanism/channels.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/session.h"
#include "simulation/import/mjcf_import.h"
#include "simulation/import/read_mjcf.h"
#include "simulation/mjcf/foreign.h"
#include "simulation/mjcf/mjcf.h"

// A user's compiled MJCF, made ready to follow a motion. Internal to simulation/.

namespace mbv::simulation {

/// A drive in the user's model.
struct OwnDrive {
  int joint = -1;  ///< MuJoCo joint
  int qpos = -1;   ///< address
  int dof = -1;
  double zero = 0.0;  ///< joint position where the drive's position is 0
  DriveHold hold = DriveHold::kAdded;
  int equality = -1;           ///< of the file; -1: none
  int added = -1;              ///< equality that was added, off unless it holds the drive
  std::vector<int> actuators;  ///< that move it
};

struct OwnClosure {
  int equality = -1;
  int joint = -1;  ///< of the mechanism
  bool weld = false;
};

struct SourceModel {
  ModelHandle m;
  SourceModelFacts facts;
  std::vector<OwnDrive> drives;  ///< per drive of the mechanism
  std::vector<OwnClosure> closures;
  VecX home;  ///< qpos
};

// The parts of making a user's model ready, in the order in which they are done. Internal to
// simulation/.

/// The file's own step, integrator, solver and settings of closures, as facts.
void ReportSettings(SourceModel* own);
/// Finds what holds each drive; switches off what the mechanism does not have and what would push
/// against the commanded motion.
void FindLeads(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own);
/// Holds free bodies and changes what the task's settings say.
void TakeSettings(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own);

class OwnStepper {
 public:
  /// All outlive the stepper.
  OwnStepper(const SourceModelTask& task, const SourceModel& own, SourceModelRun* run);
  ~OwnStepper();
  OwnStepper(const OwnStepper&) = delete;
  OwnStepper& operator=(const OwnStepper&) = delete;

  [[nodiscard]] RunSummary Run();

 private:
  struct Point {  // of the commanded motion
    DrivenSample now, before, after;
  };

  static void OnControl(const mjModel* m, mjData* d);
  void Correct();
  void SupplyVelocityTerm();
  void LeadExactly();
  [[nodiscard]] RunSummary Command(long n);
  void LeadByActuators(const OwnDrive& drive, double position, double velocity);
  void FindRows();
  [[nodiscard]] RunSummary Start();
  void Compensate();
  [[nodiscard]] double CompensationAt(int dof) const;
  [[nodiscard]] RunSummary Trouble(double t_s) const;
  void Record(long sample, double t_s);
  void RecordGaps(double t_s);
  void RecordForces(long sample);
  void Watch(double t_s);
  void Note(const std::string& what, double t_s);
  [[nodiscard]] double TargetRate(size_t k) const;
  [[nodiscard]] double TargetAcceleration(size_t k) const;

  const SourceModelTask& task_;
  const SourceModel& own_;
  SourceModelRun* const run_;
  const mjModel* const m_;
  const DataHandle d_, shifted_;  // the second one for differences
  const double h_;
  const bool staged_;  // forces are evaluated inside the step, too
  Point at_;
  std::vector<int> row_;              // first row per equality, or -1
  std::vector<mjtNum> forth_, back_;  // J(q ± εq̇) q̇
  std::vector<std::string> noted_;
};

namespace {

RunSummary Unsupported(const std::string& why) {
  return {.stop = Stop::kUnsupported, .message = why};
}

std::string AddedName(size_t drive) { return fmt::format("mbverify:drive:{}", drive); }

class SourceModelMaker {
 public:
  SourceModelMaker(const SourceModelTask& task, SourceModel* own)
      : task_(task), mechanism_(*task.mechanism), own_(*own) {}

  RunSummary Make() {
    std::vector<std::string> warnings;
    const EngineSession session(&warnings);
    Diagnostics findings;
    auto imported = ImportMjcf(task_.text, task_.file, {.held = task_.base}, warnings, &findings);
    if (!imported) return Unsupported("the file was refused: " + findings.Text());
    imported_ = &*imported;
    if (RunSummary summary = FindDrives(*imported->model); !summary.ok()) return summary;
    own_.m = CompileMjcf(WithAddedEqualities(*imported->model));
    if (RunSummary summary = CheckLayout(*imported->model); !summary.ok()) return summary;
    m_ = own_.m.get();
    FindClosures();
    FindHome();
    ReportSettings(&own_);
    FindLeads(task_, *imported_, &own_);
    TakeSettings(task_, *imported_, &own_);
    return RunSummary::Done();
  }

 private:
  RunSummary FindDrives(const mjModel& m) {
    if (imported_->mechanism.joints.size() != mechanism_.joints.size()) {
      return Unsupported("the scenario's model is not the one that this file gives");
    }
    if (std::ranges::count(imported_->joint_of, -1) > 0) {
      return Unsupported("in the file a free body cannot stand in for the one that is held");
    }
    for (const Drive& drive : mechanism_.drives) {
      const auto* on = std::get_if<JointDrive>(&drive.kind);
      OwnDrive place;
      for (int j = 0; on != nullptr && j < m.njnt; ++j) {
        const bool scalar = m.jnt_type[j] == mjJNT_HINGE || m.jnt_type[j] == mjJNT_SLIDE;
        if (imported_->joint_of[static_cast<size_t>(j)] == on->joint && scalar) place.joint = j;
      }
      if (place.joint < 0) {
        return Unsupported(fmt::format(
            "drive '{}' acts on a degree of freedom that is not a hinge or slide of the file",
            drive.name));
      }
      if (mj_id2name(&m, mjOBJ_JOINT, place.joint) == nullptr) {
        return Unsupported(fmt::format(
            "the joint of drive '{}' has no name in the file: give it one", drive.name));
      }
      place.qpos = m.jnt_qposadr[place.joint];
      place.dof = m.jnt_dofadr[place.joint];
      place.zero = m.qpos0[place.qpos];
      own_.drives.push_back(place);
    }
    return RunSummary::Done();
  }

  [[nodiscard]] std::string WithAddedEqualities(const mjModel& m) const {
    std::string lines = "<equality>\n";
    for (size_t k = 0; k < own_.drives.size(); ++k) {
      const char* name = mj_id2name(&m, mjOBJ_JOINT, own_.drives[k].joint);
      lines += fmt::format(
          "<joint name=\"{}\" joint1=\"{}\" active=\"false\" solref=\"0.02 1\" "
          "solimp=\"{} {} 0.001 0.5 2\"/>\n",
          AddedName(k), EscapeMarkup(name), kMjcfImpedance, kMjcfImpedance);
    }
    std::string text = imported_->text;
    const size_t end = text.rfind("</mujoco>");
    return text.insert(std::min(end, text.size()), lines + "</equality>\n");
  }

  // What was found in the file's own model must stand at the same places in this one.
  RunSummary CheckLayout(const mjModel& m) {
    const mjModel& with = *own_.m;
    const int added = static_cast<int>(own_.drives.size());
    if (with.nq != m.nq || with.nbody != m.nbody || with.neq != m.neq + added) {
      return Unsupported("its drives cannot be held by added equalities");
    }
    for (size_t k = 0; k < own_.drives.size(); ++k) {
      own_.drives[k].added = IdOf(with, mjOBJ_EQUALITY, AddedName(k));
    }
    own_.m->njmax += added;  // room for their rows
    return RunSummary::Done();
  }

  void FindClosures() {
    for (int e = 0; e < static_cast<int>(imported_->closure_of.size()); ++e) {
      const int joint = imported_->closure_of[static_cast<size_t>(e)];
      if (joint < 0) continue;
      own_.closures.push_back({e, joint, m_->eq_type[e] == mjEQ_WELD});
      own_.facts.closures.push_back(mechanism_.joints[static_cast<size_t>(joint)].name);
      if (imported_->closed_by_sites[static_cast<size_t>(e)]) PlaceBySites(own_.closures.back());
    }
  }

  // MuJoCo 2.2 would take their place from the pose of the file.
  void PlaceBySites(const OwnClosure& closure) {
    const Joint& joint = imported_->mechanism.joints[static_cast<size_t>(closure.joint)];
    SetAnchors(closure.weld, {joint.X_PF, joint.X_CM}, m_->eq_data + mjNEQDATA * closure.equality);
  }

  // The mechanism's closed home pose as MuJoCo's configuration.
  void FindHome() {
    own_.home = Eigen::Map<const VecX>(m_->nkey > 0 ? m_->key_qpos : m_->qpos0, m_->nq);
    for (int j = 0; j < m_->njnt; ++j) {
      const Joint& joint =
          mechanism_.joints[static_cast<size_t>(imported_->joint_of[static_cast<size_t>(j)])];
      const int at = m_->jnt_qposadr[j], body = m_->jnt_bodyid[j];
      if (m_->jnt_type[j] == mjJNT_HINGE || m_->jnt_type[j] == mjJNT_SLIDE) {
        own_.home[at] = m_->qpos0[at] + joint.home[0];
      } else if (m_->jnt_type[j] == mjJNT_FREE) {
        const Pose& X_WB = mechanism_.X_WB_home[static_cast<size_t>(joint.child)];
        const Eigen::Quaterniond turn(X_WB.linear());
        own_.home.segment<3>(at) = X_WB.translation();
        own_.home.segment<4>(at + 3) << turn.w(), turn.x(), turn.y(), turn.z();
      } else if (m_->jnt_type[j] == mjJNT_BALL) {
        const mjtNum* q = m_->body_quat + 4 * body;
        Mat3 R = mechanism_.X_WB_home[static_cast<size_t>(joint.parent)].linear();
        if (m_->body_jntadr[body] == j) {
          R = R * Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
        }
        const Eigen::Quaterniond turn(
            Mat3(R.transpose() * mechanism_.X_WB_home[static_cast<size_t>(joint.child)].linear()));
        own_.home.segment<4>(at) << turn.w(), turn.x(), turn.y(), turn.z();
      }
    }
  }

  const SourceModelTask& task_;
  const Mechanism& mechanism_;
  SourceModel& own_;
  const ImportedMjcf* imported_ = nullptr;
  mjModel* m_ = nullptr;
};

}  // namespace

// Compiles the file with an equality for each drive, finds what holds the drives and applies the
// settings. kUnsupported with the reason where that cannot be; throws EngineError.
RunSummary MakeSourceModel(const SourceModelTask& task, SourceModel* own) {
  return SourceModelMaker(task, own).Make();
}

// Settings of a user's model: what the file says, and what is changed.

namespace {

class SettingsTaker {
 public:
  SettingsTaker(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own)
      : task_(task), imported_(imported), own_(*own), m_(own->m.get()) {}

  void Run() {
    ReportLeftOut();
    for (int dof = 0; dof < m_->nv; ++dof) own_.facts.has_friction |= HasFriction(dof);
    if (task_.settings.plain) LeaveOut();
    HoldFreeBodies();
    Apply();
  }

 private:
  // A free joint whose body does not move.
  [[nodiscard]] bool IsHeld(int j) const {
    const auto joint = static_cast<size_t>(imported_.joint_of[static_cast<size_t>(j)]);
    return m_->jnt_type[j] == mjJNT_FREE &&
           imported_.mechanism.joints[joint].kind == JointKind::kFixed;
  }

  [[nodiscard]] bool HasFriction(int dof) const {
    return !IsHeld(m_->dof_jntid[dof]) && m_->dof_frictionloss[dof] > 0.0;
  }

  // A tendon that the mechanism has as a spring and damper.
  [[nodiscard]] bool IsSpring(int tendon) const {
    const std::string name = NameAt(*m_, mjOBJ_TENDON, tendon, "tendon");
    return std::ranges::any_of(imported_.mechanism.springs,
                               [&](const SpringDamper& spring) { return spring.name == name; });
  }

  // Calls visit(word, value) on every number that acts on forces and that the mechanism lacks.
  template <typename Visit>
  void ForLeftOut(const Visit& visit) {
    for (int dof = 0; dof < m_->nv; ++dof) {
      if (!IsHeld(m_->dof_jntid[dof]) && m_->dof_damping[dof] < 0.0) {
        visit("negative damping", &m_->dof_damping[dof]);
      }
    }
    for (int t = 0; t < m_->ntendon; ++t) {
      if (!IsSpring(t)) {
        visit("tendon springs", &m_->tendon_stiffness[t]);
        visit("tendon damping", &m_->tendon_damping[t]);
      }
      visit("tendon friction", &m_->tendon_frictionloss[t]);
    }
    visit("the medium's density", &m_->opt.density);
    visit("the medium's viscosity", &m_->opt.viscosity);
  }

  void ReportLeftOut() {
    ForLeftOut([&](const char* word, const mjtNum* value) {
      std::vector<std::string>& words = own_.facts.left_out;
      if (*value == 0.0 || std::find(words.begin(), words.end(), word) != words.end()) return;
      words.emplace_back(word);
    });
  }

  void LeaveOut() {
    ForLeftOut([](const char*, mjtNum* value) { *value = 0.0; });
  }

  // By an inertia against which nothing in the mechanism moves them; derived constants follow, but
  // not the one that says when the solver is done.
  void HoldFreeBodies() {
    constexpr double kHeavier = 1e12;
    const double scale = m_->stat.meaninertia;
    double most = 0.0;
    for (int b = 0; b < m_->nbody; ++b) most = std::max(most, m_->body_subtreemass[b]);
    for (int j = 0; j < m_->njnt; ++j) {
      if (!IsHeld(j)) continue;
      own_.facts.held.push_back(NameAt(*m_, mjOBJ_BODY, m_->jnt_bodyid[j], "body"));
      const double length = std::max(m_->stat.extent, 1e-3);
      for (int i = 0; i < 6; ++i) {
        m_->dof_armature[m_->jnt_dofadr[j] + i] = kHeavier * most * (i < 3 ? 1.0 : length * length);
      }
    }
    if (own_.facts.held.empty() && !task_.settings.plain) return;
    const DataHandle scratch = MakeData(*m_);
    mj_setConst(m_, scratch.get());
    if (!own_.facts.held.empty()) m_->stat.meaninertia = scale;
  }

  void Apply() {
    const SourceModelSettings& settings = task_.settings;
    m_->opt.timestep *= settings.step_factor;
    if (settings.integrator != SourceModelIntegrator::kOwn) {
      m_->opt.integrator = settings.integrator == SourceModelIntegrator::kEuler ? mjINT_EULER
                           : settings.integrator == SourceModelIntegrator::kRk4 ? mjINT_RK4
                                                                                : mjINT_IMPLICIT;
    }
    if (settings.impratio > 0.0) m_->opt.impratio = settings.impratio;
    if (settings.exact_solver) {
      m_->opt.solver = mjSOL_NEWTON;
      m_->opt.iterations = 200;
      m_->opt.tolerance = 1e-14;
    }
    const std::array<mjtNum, 5> stiff{kMjcfImpedance, kMjcfImpedance, 0.001, 0.5, 2.0};
    for (int dof = 0; settings.stiff_friction && dof < m_->nv; ++dof) {
      if (!HasFriction(dof)) continue;
      m_->dof_solref[mjNREF * dof] = 2.0 * m_->opt.timestep;
      m_->dof_solref[mjNREF * dof + 1] = 1.0;
      std::copy(stiff.begin(), stiff.end(), m_->dof_solimp + mjNIMP * dof);
    }
    for (const OwnClosure& closure : own_.closures) {
      mjtNum* ref = m_->eq_solref + mjNREF * closure.equality;
      mjtNum* imp = m_->eq_solimp + mjNIMP * closure.equality;
      if (settings.time_constant_s > 0.0) {
        ref[0] = settings.time_constant_s;
        ref[1] = 1.0;
      }
      if (settings.impedance > 0.0) {
        const std::array<mjtNum, 5> solimp{settings.impedance, settings.impedance, 0.001, 0.5, 2.0};
        std::copy(solimp.begin(), solimp.end(), imp);
      }
    }
  }

  const SourceModelTask& task_;
  const ImportedMjcf& imported_;
  SourceModel& own_;
  mjModel* const m_;
};

}  // namespace

void ReportSettings(SourceModel* own) {
  static constexpr std::array<const char*, 3> kIntegrators = {"Euler", "RK4", "implicit"};
  static constexpr std::array<const char*, 3> kSolvers = {"PGS", "CG", "Newton"};
  SourceModelFacts& facts = own->facts;
  const mjOption& option = own->m->opt;
  facts.step_s = option.timestep;
  facts.integrator = kIntegrators.at(static_cast<size_t>(option.integrator));
  facts.solver = kSolvers.at(static_cast<size_t>(option.solver));
  facts.tolerance = option.tolerance;
  facts.iterations = option.iterations;
  constexpr double kDefaultTolerance = 1e-8;
  constexpr int kDefaultIterations = 100;
  facts.rough_solver = option.solver != mjSOL_NEWTON || option.tolerance > kDefaultTolerance ||
                       option.iterations < kDefaultIterations;
  for (const OwnClosure& closure : own->closures) {
    const mjtNum* ref = own->m->eq_solref + mjNREF * closure.equality;
    const mjtNum* imp = own->m->eq_solimp + mjNIMP * closure.equality;
    facts.solref.push_back(fmt::format("{:g} {:g}", ref[0], ref[1]));
    facts.solimp.push_back(
        fmt::format("{:g} {:g} {:g} {:g} {:g}", imp[0], imp[1], imp[2], imp[3], imp[4]));
  }
}

void TakeSettings(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own) {
  SettingsTaker(task, imported, own).Run();
}

// What holds the drives of a user's model, and what is switched off.

namespace {

bool HoldsOneJoint(const mjModel& m, int e) {
  return m.eq_type[e] == mjEQ_JOINT && m.eq_obj2id[e] < 0;
}

bool IsLoop(const mjModel& m, int e) {
  return m.eq_type[e] == mjEQ_CONNECT || m.eq_type[e] == mjEQ_WELD;
}

// Affine feedback without states of its own, on the actuator's length or on its velocity only.
bool IsServo(const mjModel& m, int u, bool of_position) {
  const mjtNum* bias = m.actuator_biasprm + mjNBIAS * u;
  if (m.actuator_dyntype[u] != mjDYN_NONE || m.actuator_gaintype[u] != mjGAIN_FIXED ||
      m.actuator_biastype[u] != mjBIAS_AFFINE || m.actuator_gainprm[mjNGAIN * u] == 0.0) {
    return false;
  }
  return of_position ? bias[1] != 0.0 : bias[1] == 0.0 && bias[2] != 0.0;
}

bool IsMotor(const mjModel& m, int u) {
  return m.actuator_dyntype[u] == mjDYN_NONE && m.actuator_gaintype[u] == mjGAIN_FIXED &&
         m.actuator_biastype[u] == mjBIAS_NONE;
}

bool ActsOn(const mjModel& m, int u, int joint) {
  const int type = m.actuator_trntype[u];
  return (type == mjTRN_JOINT || type == mjTRN_JOINTINPARENT) && m.actuator_trnid[2 * u] == joint;
}

class LeadFinder {
 public:
  LeadFinder(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own)
      : task_(task),
        mechanism_(*task.mechanism),
        imported_(&imported),
        own_(*own),
        m_(own->m.get()) {}

  void Run() {
    DampServos();
    FindLeads();
    SwitchOff();
  }

 private:
  void DampServos() {
    const auto dampings = mjcf::ServoDampings(task_.text);
    for (int u = 0; u < m_->nu; ++u) {
      const char* own = mj_id2name(m_, mjOBJ_ACTUATOR, u);
      const int target = m_->actuator_trnid[2 * u];
      const bool named = own != nullptr && own[0] != '\0';
      if (!IsServo(*m_, u, true) || (!named && !ActsOn(*m_, u, target))) continue;
      const std::string name = named ? own : NameAt(*m_, mjOBJ_JOINT, target, "joint");
      const auto found = dampings.find(name);
      if (found == dampings.end()) continue;
      m_->actuator_biasprm[mjNBIAS * u + 2] = -found->second;
      own_.facts.damped.push_back(name);
    }
  }

  void FindLeads() {
    for (OwnDrive& drive : own_.drives) {
      std::string motor;
      bool servo = false;
      for (int u = 0; u < m_->nu; ++u) {
        if (!ActsOn(*m_, u, drive.joint)) continue;
        servo = servo || IsServo(*m_, u, true);
        if (IsServo(*m_, u, true) || IsServo(*m_, u, false)) drive.actuators.push_back(u);
        if (IsMotor(*m_, u) && motor.empty()) motor = NameAt(*m_, mjOBJ_ACTUATOR, u, "actuator");
      }
      for (int e = 0; e < m_->neq; ++e) {
        if (e < static_cast<int>(imported_->closure_of.size()) && HoldsOneJoint(*m_, e) &&
            m_->eq_active[e] != 0 && m_->eq_obj1id[e] == drive.joint) {
          drive.equality = e;
        }
      }
      drive.hold = drive.equality >= 0 ? DriveHold::kEquality
                   : servo             ? DriveHold::kServo
                                       : DriveHold::kAdded;
      own_.facts.held_by.push_back(drive.hold);
      own_.facts.motors.push_back(motor);
      if (task_.settings.exact_drives) drive.hold = DriveHold::kAdded;
      if (drive.hold != DriveHold::kServo) drive.actuators.clear();
      if (drive.hold != DriveHold::kEquality) drive.equality = -1;
      if (drive.hold == DriveHold::kAdded) m_->eq_active[drive.added] = 1;
    }
  }

  [[nodiscard]] bool Drives(int actuator) const {
    return std::any_of(own_.drives.begin(), own_.drives.end(), [&](const OwnDrive& drive) {
      return std::find(drive.actuators.begin(), drive.actuators.end(), actuator) !=
             drive.actuators.end();
    });
  }
  [[nodiscard]] bool IsCoupling(const std::string& name) const {
    return std::any_of(
        mechanism_.couplings.begin(), mechanism_.couplings.end(),
        [&](const Coupling& c) { return c.name == name || c.name == NearestName(name); });
  }

  // What the mechanism does not have, or what would push against the commanded motion.
  void SwitchOff() {
    m_->opt.disableflags |= mjDSBL_CONTACT;
    if (task_.ignore_ranges) m_->opt.disableflags |= mjDSBL_LIMIT;
    for (int e = 0; e < static_cast<int>(imported_->closure_of.size()); ++e) {
      const bool holds_drive =
          std::any_of(own_.drives.begin(), own_.drives.end(),
                      [&](const OwnDrive& drive) { return drive.equality == e; });
      const std::string name = NameAt(*m_, mjOBJ_EQUALITY, e, "equality");
      if (m_->eq_active[e] == 0 || holds_drive || IsLoop(*m_, e) || IsCoupling(name)) continue;
      m_->eq_active[e] = 0;
      if (!HoldsOneJoint(*m_, e) || !task_.settings.exact_drives)
        own_.facts.couplings.push_back(name);
    }
    for (int u = 0; u < m_->nu; ++u) {
      if (Drives(u)) continue;
      const bool pushes = !IsMotor(*m_, u);
      std::fill_n(m_->actuator_gainprm + mjNGAIN * u, mjNGAIN, 0.0);
      std::fill_n(m_->actuator_biasprm + mjNBIAS * u, mjNBIAS, 0.0);
      m_->actuator_gaintype[u] = mjGAIN_FIXED;
      m_->actuator_biastype[u] = mjBIAS_NONE;
      if (pushes) own_.facts.unused_actuators.push_back(NameAt(*m_, mjOBJ_ACTUATOR, u, "actuator"));
    }
  }

  const SourceModelTask& task_;
  const Mechanism& mechanism_;
  const ImportedMjcf* const imported_;
  SourceModel& own_;
  mjModel* const m_;
};

}  // namespace

void FindLeads(const SourceModelTask& task, const ImportedMjcf& imported, SourceModel* own) {
  LeadFinder(task, imported, own).Run();
}

namespace {

thread_local OwnStepper* stepping = nullptr;

RunSummary Unsound(const std::string& what, double t_s) {
  return {.stop = Stop::kEngineFailure,
          .message = fmt::format("{} at {:.4g} s", what, t_s),
          .time_s = t_s};
}

}  // namespace

OwnStepper::OwnStepper(const SourceModelTask& task, const SourceModel& own, SourceModelRun* run)
    : task_(task),
      own_(own),
      run_(run),
      m_(own.m.get()),
      d_(MakeData(*own.m)),
      shifted_(MakeData(*own.m)),
      h_(own.m->opt.timestep),
      staged_(own.m->opt.integrator == mjINT_RK4),
      row_(static_cast<size_t>(own.m->neq), -1) {
  stepping = this;
  mjcb_control = &OwnStepper::OnControl;
}

OwnStepper::~OwnStepper() {
  mjcb_control = nullptr;
  stepping = nullptr;
}

// Between the velocity stage and the constraint solver, in every stage of the step.
void OwnStepper::OnControl(const mjModel* /*m*/, mjData* d) {
  if (stepping != nullptr && d == stepping->d_.get()) stepping->Correct();
}

void OwnStepper::FindRows() {
  std::fill(row_.begin(), row_.end(), -1);
  for (int i = d_->nefc - 1; i >= 0; --i) {
    if (d_->efc_type[i] == mjCNSTR_EQUALITY) row_[static_cast<size_t>(d_->efc_id[i])] = i;
  }
}

void OwnStepper::Correct() {
  FindRows();
  if (task_.settings.velocity_term) SupplyVelocityTerm();
  LeadExactly();
}

// J̇q̇ = d/dε J(q ⊕ ε q̇) q̇, a central difference: wrong by ε² of the rates squared.
void OwnStepper::SupplyVelocityTerm() {
  constexpr double kStep_s = 1e-5;
  const auto rates = [&](double step_s, std::vector<mjtNum>* out) {
    mjData* s = shifted_.get();
    mju_copy(s->qpos, d_->qpos, m_->nq);
    mj_integratePos(m_, s->qpos, d_->qvel, step_s);
    mj_kinematics(m_, s);
    mj_comPos(m_, s);
    mj_tendon(m_, s);
    mj_makeConstraint(m_, s);
    if (s->ne != d_->ne) throw EngineError("an equality constrains nothing in this pose");
    out->resize(static_cast<size_t>(s->nefc));
    mj_mulJacVec(m_, s, out->data(), d_->qvel);
  };
  rates(kStep_s, &forth_);
  rates(-kStep_s, &back_);
  for (int i = 0; i < d_->ne; ++i) {
    const auto k = static_cast<size_t>(i);
    d_->efc_aref[i] -= (forth_[k] - back_[k]) / (2.0 * kStep_s);
  }
}

// Semi-implicit steps change the position by the new velocity: what they can follow exactly are
// the differences of the commanded positions.
double OwnStepper::TargetRate(size_t k) const {
  const auto i = static_cast<Eigen::Index>(k);
  if (staged_) return at_.now.velocity[i];
  return (at_.now.position[i] - at_.before.position[i]) / h_;
}

double OwnStepper::TargetAcceleration(size_t k) const {
  const auto i = static_cast<Eigen::Index>(k);
  if (staged_) return at_.now.acceleration[i];
  return (at_.after.position[i] - 2.0 * at_.now.position[i] + at_.before.position[i]) / (h_ * h_);
}

// Reference acceleration of the added equalities: the commanded one, softly stabilized.
void OwnStepper::LeadExactly() {
  constexpr double kGuidance_s = 0.02, kGuidanceSteps = 20.0;
  const double tc = std::max(kGuidance_s, kGuidanceSteps * h_);
  if (staged_ && !task_.driven(d_->time, &at_.now).ok()) return;
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    if (drive.hold != DriveHold::kAdded) continue;
    const double q = d_->qpos[drive.qpos] - drive.zero, v = d_->qvel[drive.dof];
    const int row = row_[static_cast<size_t>(drive.added)];
    if (row < 0) continue;
    d_->efc_aref[row] = TargetAcceleration(k) + 2.0 / tc * (TargetRate(k) - v) +
                        (at_.now.position[static_cast<Eigen::Index>(k)] - q) / (tc * tc);
  }
}

RunSummary OwnStepper::Command(long n) {
  const double t = static_cast<double>(n) * h_;
  if (RunSummary s = task_.driven(t, &at_.now); !s.ok()) return s;
  if (RunSummary s = task_.driven(std::max(0.0, t - h_), &at_.before); !s.ok()) return s;
  if (RunSummary s = task_.driven(t + h_, &at_.after); !s.ok()) return s;
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    const double position = at_.now.position[static_cast<Eigen::Index>(k)];
    if (drive.hold == DriveHold::kServo) {
      LeadByActuators(drive, drive.zero + position, at_.now.velocity[static_cast<Eigen::Index>(k)]);
    } else if (drive.hold == DriveHold::kEquality) {
      own_.m->eq_data[mjNEQDATA * drive.equality] = position;
    }
  }
  return RunSummary::Done();
}

// The control at which an actuator exerts no force where the joint is as commanded.
void OwnStepper::LeadByActuators(const OwnDrive& drive, double position, double velocity) {
  for (const int u : drive.actuators) {
    const mjtNum* bias = m_->actuator_biasprm + mjNBIAS * u;
    const double gear = m_->actuator_gear[6 * u], gain = m_->actuator_gainprm[mjNGAIN * u];
    const double control =
        -(bias[0] + (bias[1] != 0.0 ? bias[1] * gear * position : bias[2] * gear * velocity)) /
        gain;
    d_->ctrl[u] = control;
    const mjtNum* range = m_->actuator_ctrlrange + 2 * u;
    if (m_->actuator_ctrllimited[u] != 0 && (control < range[0] || control > range[1])) {
      Note("a servo's ctrlrange cuts its command", d_->time);
    }
  }
}

RunSummary OwnStepper::Start() {
  DrivenSample first;
  if (RunSummary summary = task_.driven(0.0, &first); !summary.ok()) return summary;
  constexpr double kNear = 1e-6;  // [m, rad, per second]
  double off = first.velocity.cwiseAbs().maxCoeff();
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    off = std::max(off, std::abs(own_.home[drive.qpos] - drive.zero -
                                 first.position[static_cast<Eigen::Index>(k)]));
  }
  if (off > kNear) {
    return {.stop = Stop::kUnsupported, .message = "the motion does not start at home and at rest"};
  }
  mj_resetData(m_, d_.get());
  Eigen::Map<VecX>(d_->qpos, m_->nq) = own_.home;
  std::fill_n(d_->qvel, m_->nv, 0.0);
  Compensate();
  return RunSummary::Done();
}

// MuJoCo 2.2 does not know gravcomp: as a force that stays (xfrc_applied).
void OwnStepper::Compensate() {
  if (!HasGravityCompensation(*task_.mechanism) || m_->nuser_body == 0) return;
  const auto which = static_cast<int>(mjcf::UserNumber::kGravityCompensation);
  for (int b = 1; b < m_->nbody; ++b) {
    const double carried = m_->body_user[m_->nuser_body * b + which] * m_->body_mass[b];
    for (int i = 0; i < 3; ++i) d_->xfrc_applied[6 * b + i] = -carried * m_->opt.gravity[i];
  }
}

// What that does along a DOF, where the drive exerts it.
double OwnStepper::CompensationAt(int dof) const {
  std::vector<mjtNum> along(static_cast<size_t>(m_->nv), 0.0);
  const mjtNum none[3] = {};
  for (int b = 1; b < m_->nbody; ++b) {
    mj_applyFT(m_, d_.get(), d_->xfrc_applied + 6 * b, none, d_->xipos + 3 * b, b, along.data());
  }
  return along[static_cast<size_t>(dof)];
}

void OwnStepper::Note(const std::string& what, double t_s) {
  if (std::find(noted_.begin(), noted_.end(), what) != noted_.end()) return;
  noted_.push_back(what);
  run_->notes.push_back(fmt::format("{}, first at {:.4g} s", what, t_s));
}

RunSummary OwnStepper::Trouble(double t_s) const {
  static constexpr std::array<std::pair<int, const char*>, 5> kWarnings = {
      {{mjWARN_BADQPOS, "MuJoCo reset the simulation, which had diverged (positions),"},
       {mjWARN_BADQVEL, "MuJoCo reset the simulation, which had diverged (velocities),"},
       {mjWARN_BADQACC, "MuJoCo reset the simulation, which had diverged (accelerations),"},
       {mjWARN_INERTIA, "MuJoCo found the inertia matrix singular"},
       {mjWARN_CNSTRFULL, "MuJoCo had no room for all constraint rows (<size njmax>)"}}};
  for (const auto& [warning, text] : kWarnings) {
    if (d_->warning[warning].number > 0) return Unsound(text, t_s);
  }
  if (!IsSane(d_->qpos, m_->nq) || !IsSane(d_->qvel, m_->nv) || !IsSane(d_->qacc, m_->nv)) {
    return Unsound("the motion is not finite", t_s);
  }
  return RunSummary::Done();
}

RunSummary OwnStepper::Run() {
  if (RunSummary summary = Start(); !summary.ok()) return summary;
  // The file's own steps carry the samples, whatever the step is now.
  const double own_step = own_.facts.step_s;
  const long per_sample =
      std::max(1L, std::lround(task_.sample_s / own_step)) * std::lround(own_step / h_);
  const double spacing = static_cast<double>(per_sample) * h_;
  const long samples = std::lround(std::floor(task_.duration_s / spacing * (1.0 + 4 * kEps)));
  std::vector<Channel> channels;
  for (const Drive& drive : task_.mechanism->drives) {
    channels.push_back(
        MakeChannel(Quantity::kForce, ForceUnit(*task_.mechanism, drive), drive.name));
  }
  for (const OwnClosure& closure : own_.closures) {
    const auto all = ReactionChannels(task_.mechanism->joints[static_cast<size_t>(closure.joint)]);
    channels.insert(channels.end(), all.begin(), all.begin() + 3);
  }
  run_->trace.Reset(SampleTimes(static_cast<double>(samples) * spacing, spacing),
                    std::move(channels));
  run_->gaps.resize(own_.closures.size());
  run_->tracking.assign(own_.drives.size(), 0.0);
  double cpu_s = 0.0;
  for (long n = 0; n <= samples * per_sample; ++n) {
    const double t = static_cast<double>(n) * h_;
    if (RunSummary summary = Command(n); !summary.ok()) return summary;
    if (n % per_sample == 0) Record(n / per_sample, t);
    const double from = ComputingTime::ThreadSeconds();
    mj_step(m_, d_.get());
    cpu_s += ComputingTime::ThreadSeconds() - from;
    if (RunSummary trouble = Trouble(t); !trouble.ok()) return trouble;
  }
  run_->cost_ms = 1e3 * cpu_s / (static_cast<double>(samples * per_sample + 1) * h_);
  return RunSummary::Done();
}

// What is read off a user's model at a sample.

namespace {

using OwnVec3 = Eigen::Map<const Vec3>;

Eigen::Quaterniond QuaternionAt(const mjtNum* q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

// What acts in addition to motion and loops.
void OwnStepper::Watch(double t_s) {
  for (int i = 0; i < d_->nefc; ++i) {
    const int type = d_->efc_type[i];
    if ((type == mjCNSTR_LIMIT_JOINT || type == mjCNSTR_LIMIT_TENDON) && d_->efc_force[i] != 0.0) {
      Note("a limit of a joint or tendon pushes", t_s);
    }
  }
  for (const OwnDrive& drive : own_.drives) {
    for (const int u : drive.actuators) {
      const mjtNum* range = m_->actuator_forcerange + 2 * u;
      const mjtNum force = d_->actuator_force[u];
      if (m_->actuator_forcelimited[u] != 0 && (force <= range[0] || force >= range[1])) {
        Note("a servo pushes as hard as its forcerange allows", t_s);
      }
    }
  }
}

void OwnStepper::RecordGaps(double t_s) {
  const auto point = [&](int body, const mjtNum* p_B) {
    const Pose X_WB = PoseOf(*d_, body);
    return Vec3(X_WB * Vec3(OwnVec3{p_B}));
  };
  for (size_t c = 0; c < own_.closures.size(); ++c) {
    const OwnClosure& closure = own_.closures[c];
    const int b1 = m_->eq_obj1id[closure.equality], b2 = m_->eq_obj2id[closure.equality];
    const mjtNum* data = m_->eq_data + mjNEQDATA * closure.equality;
    SourceModelRun::Gap& gap = run_->gaps[c];
    const Vec3 apart =
        point(b1, data + (closure.weld ? 3 : 0)) - point(b2, data + (closure.weld ? 0 : 3));
    if (apart.norm() > gap.position_m) {
      gap.position_m = apart.norm();
      gap.position_at_s = t_s;
    }
    if (!closure.weld) continue;
    const Eigen::Quaterniond turn = QuaternionAt(d_->xquat + 4 * b2).conjugate() *
                                    QuaternionAt(d_->xquat + 4 * b1) * QuaternionAt(data + 6);
    const double angle = 2.0 * std::asin(std::min(1.0, turn.normalized().vec().norm()));
    if (angle > gap.rotation_rad) {
      gap.rotation_rad = angle;
      gap.rotation_at_s = t_s;
    }
  }
}

void OwnStepper::RecordForces(long sample) {
  Eigen::Index column = 0;
  for (size_t k = 0; k < own_.drives.size(); ++k) {
    const OwnDrive& drive = own_.drives[k];
    double force = 0.0;
    for (const int u : drive.actuators) force += m_->actuator_gear[6 * u] * d_->actuator_force[u];
    const int e = drive.hold == DriveHold::kAdded ? drive.added : drive.equality;
    if (e >= 0 && row_[static_cast<size_t>(e)] >= 0) {
      force = d_->efc_force[row_[static_cast<size_t>(e)]];
    }
    if (task_.mechanism->drives[k].compensates_gravity) force += CompensationAt(drive.dof);
    run_->trace.values(sample, column++) = force;
    const double q = d_->qpos[drive.qpos] - drive.zero;
    run_->tracking[k] =
        std::max(run_->tracking[k], std::abs(q - at_.now.position[static_cast<Eigen::Index>(k)]));
  }
  // The rows push body 1 forwards and body 2 back; a reaction is what body 1 exerts on body 2.
  for (const OwnClosure& closure : own_.closures) {
    const int row = row_[static_cast<size_t>(closure.equality)];
    const Joint& joint = task_.mechanism->joints[static_cast<size_t>(closure.joint)];
    const Mat3 R_WF = PoseOf(*d_, m_->eq_obj1id[closure.equality]).linear() * joint.X_PF.linear();
    Vec3 force = Vec3::Constant(kNan);
    if (row >= 0) force = R_WF.transpose() * -Vec3(OwnVec3{d_->efc_force + row});
    for (int i = 0; i < 3; ++i) run_->trace.values(sample, column++) = force[i];
  }
}

void OwnStepper::Record(long sample, double t_s) {
  mj_forward(m_, d_.get());
  FindRows();
  RecordForces(sample);
  RecordGaps(t_s);
  Watch(t_s);
}

}  // namespace mbv::simulation

namespace mbv {

SourceModelRun RunSourceModel(const SourceModelTask& task) {
  SourceModelRun run;
  std::vector<std::string> warnings;
  const simulation::EngineSession session(&warnings);
  try {
    simulation::SourceModel own;
    run.summary = simulation::MakeSourceModel(task, &own);
    run.facts = own.facts;
    if (!run.summary.ok()) return run;
    run.step_s = own.m->opt.timestep;
    simulation::OwnStepper stepper(task, own, &run);
    run.summary = stepper.Run();
  } catch (const simulation::EngineError& error) {
    run.summary = {.stop = Stop::kEngineFailure, .message = std::string("MuJoCo: ") + error.what()};
  }
  return run;
}

}  // namespace mbv
