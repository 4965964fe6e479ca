#include "simulation/own_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/names.h"
#include "mjcf/closure_settings.h"

namespace mbv::simulation {
namespace {

constexpr double kStiffest = 0.9999;  // MuJoCo's limit of the impedance

RunSummary Unsupported(const std::string& why) {
  return {.stop = Stop::kUnsupported, .message = why, .where = {}, .unit = {}};
}

std::string NameAt(const mjModel& m, mjtObj type, int id, const char* kind) {
  const char* name = mj_id2name(&m, type, id);
  return name != nullptr && name[0] != '\0' ? name : fmt::format("{}_{}", kind, id);
}

std::string AddedName(size_t drive) { return fmt::format("mbverify:drive:{}", drive); }

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

class OwnModelMaker {
 public:
  OwnModelMaker(const OwnTask& task, OwnModel* own)
      : task_(task), mechanism_(*task.mechanism), own_(*own) {}

  RunSummary Make() {
    std::vector<std::string> warnings;
    const EngineSession session(&warnings);
    Diagnostics findings;
    auto imported = ImportMjcf(task_.text, task_.file, warnings, &findings);
    if (!imported) return Unsupported("the file was refused: " + findings.Text());
    imported_ = &*imported;
    if (RunSummary summary = FindDrives(*imported->model); !summary.ok()) return summary;
    own_.m = CompileMjcf(WithAddedEqualities(*imported->model));
    if (RunSummary summary = CheckLayout(*imported->model); !summary.ok()) return summary;
    m_ = own_.m.get();
    FindClosures();
    FindHome();
    TellSettings();
    DampServos();
    FindLeads();
    SwitchOff();
    TellLeftOut();
    if (task_.settings.plain) LeaveOut();
    HoldFreeBodies();
    Apply();
    return RunSummary::Done();
  }

 private:
  RunSummary FindDrives(const mjModel& m) {
    if (imported_->mechanism.joints.size() != mechanism_.joints.size()) {
      return Unsupported("the scenario's model is not the one that this file gives");
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
            "drive '{}' acts on a freedom that is no hinge or slide of the file", drive.name));
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
      std::string joint;
      for (const char c : std::string(mj_id2name(&m, mjOBJ_JOINT, own_.drives[k].joint))) {
        joint += c == '&' ? "&amp;" : c == '<' ? "&lt;" : c == '"' ? "&quot;" : std::string(1, c);
      }
      lines += fmt::format(
          "<joint name=\"{}\" joint1=\"{}\" active=\"false\" solref=\"0.02 1\" "
          "solimp=\"{} {} 0.001 0.5 2\"/>\n",
          AddedName(k), joint, kStiffest, kStiffest);
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
      return Unsupported("its drives cannot be led by added equalities");
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
    mjtNum* data = m_->eq_data + mjNEQDATA * closure.equality;
    const Vec3 p_1 = joint.X_PF.translation(), p_2 = joint.X_CM.translation();
    Eigen::Map<Vec3>{data} = closure.weld ? p_2 : p_1;
    Eigen::Map<Vec3>{data + 3} = closure.weld ? p_1 : p_2;
    if (!closure.weld) return;
    const Eigen::Quaterniond q(Mat3(joint.X_PF.linear() * joint.X_CM.linear().transpose()));
    const std::array<double, 4> wxyz{q.w(), q.x(), q.y(), q.z()};
    std::copy(wxyz.begin(), wxyz.end(), data + 6);
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

  void TellSettings() {
    static constexpr std::array<const char*, 3> kIntegrators = {"Euler", "RK4", "implicit"};
    static constexpr std::array<const char*, 3> kSolvers = {"PGS", "CG", "Newton"};
    OwnFacts& facts = own_.facts;
    const mjOption& option = m_->opt;
    facts.step_s = option.timestep;
    facts.integrator = kIntegrators.at(static_cast<size_t>(option.integrator));
    facts.solver = kSolvers.at(static_cast<size_t>(option.solver));
    facts.tolerance = option.tolerance;
    facts.iterations = option.iterations;
    constexpr double kDefaultTolerance = 1e-8;
    constexpr int kDefaultIterations = 100;
    facts.rough_solver = option.solver != mjSOL_NEWTON || option.tolerance > kDefaultTolerance ||
                         option.iterations < kDefaultIterations;
    for (const OwnClosure& closure : own_.closures) {
      const mjtNum* ref = m_->eq_solref + mjNREF * closure.equality;
      const mjtNum* imp = m_->eq_solimp + mjNIMP * closure.equality;
      facts.solref.push_back(fmt::format("{:g} {:g}", ref[0], ref[1]));
      facts.solimp.push_back(
          fmt::format("{:g} {:g} {:g} {:g} {:g}", imp[0], imp[1], imp[2], imp[3], imp[4]));
    }
  }

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
      drive.lead = drive.equality >= 0 ? DriveLead::kEquality
                   : servo             ? DriveLead::kServo
                                       : DriveLead::kAdded;
      own_.facts.leads.push_back(drive.lead);
      own_.facts.motors.push_back(motor);
      if (task_.settings.exact_drives) drive.lead = DriveLead::kAdded;
      if (drive.lead != DriveLead::kServo) drive.actuators.clear();
      if (drive.lead != DriveLead::kEquality) drive.equality = -1;
      if (drive.lead == DriveLead::kAdded) m_->eq_active[drive.added] = 1;
    }
  }

  [[nodiscard]] bool Leads(int actuator) const {
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
      const bool leads = std::any_of(own_.drives.begin(), own_.drives.end(),
                                     [&](const OwnDrive& drive) { return drive.equality == e; });
      const std::string name = NameAt(*m_, mjOBJ_EQUALITY, e, "equality");
      if (m_->eq_active[e] == 0 || leads || IsLoop(*m_, e) || IsCoupling(name)) continue;
      m_->eq_active[e] = 0;
      if (!HoldsOneJoint(*m_, e) || !task_.settings.exact_drives)
        own_.facts.couplings.push_back(name);
    }
    for (int u = 0; u < m_->nu; ++u) {
      if (Leads(u)) continue;
      const bool pushes = !IsMotor(*m_, u);
      std::fill_n(m_->actuator_gainprm + mjNGAIN * u, mjNGAIN, 0.0);
      std::fill_n(m_->actuator_biasprm + mjNBIAS * u, mjNBIAS, 0.0);
      m_->actuator_gaintype[u] = mjGAIN_FIXED;
      m_->actuator_biastype[u] = mjBIAS_NONE;
      if (pushes) own_.facts.pushers.push_back(NameAt(*m_, mjOBJ_ACTUATOR, u, "actuator"));
    }
  }

  [[nodiscard]] bool IsHeld(int dof) const {
    return m_->jnt_type[m_->dof_jntid[dof]] == mjJNT_FREE;
  }

  // Calls visit(word, value) on every number that acts on forces and that the mechanism lacks.
  template <typename Visit>
  void ForLeftOut(const Visit& visit) {
    for (int dof = 0; dof < m_->nv; ++dof) {
      if (IsHeld(dof)) continue;
      visit("armature", &m_->dof_armature[dof]);
      visit("damping", &m_->dof_damping[dof]);
      visit("friction loss", &m_->dof_frictionloss[dof]);
    }
    for (int j = 0; j < m_->njnt; ++j) visit("joint springs", &m_->jnt_stiffness[j]);
    for (int t = 0; t < m_->ntendon; ++t) {
      visit("tendon springs", &m_->tendon_stiffness[t]);
      visit("tendon damping", &m_->tendon_damping[t]);
      visit("tendon friction", &m_->tendon_frictionloss[t]);
    }
    visit("the medium's density", &m_->opt.density);
    visit("the medium's viscosity", &m_->opt.viscosity);
  }

  void TellLeftOut() {
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
      if (m_->jnt_type[j] != mjJNT_FREE) continue;
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
    const OwnSettings& settings = task_.settings;
    m_->opt.timestep *= settings.step_factor;
    if (settings.integrator != OwnIntegrator::kOwn) {
      m_->opt.integrator = settings.integrator == OwnIntegrator::kEuler ? mjINT_EULER
                           : settings.integrator == OwnIntegrator::kRk4 ? mjINT_RK4
                                                                        : mjINT_IMPLICIT;
    }
    if (settings.impratio > 0.0) m_->opt.impratio = settings.impratio;
    if (settings.exact_solver) {
      m_->opt.solver = mjSOL_NEWTON;
      m_->opt.iterations = 200;
      m_->opt.tolerance = 1e-14;
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

  const OwnTask& task_;
  const Mechanism& mechanism_;
  OwnModel& own_;
  const ImportedMjcf* imported_ = nullptr;
  mjModel* m_ = nullptr;
};

}  // namespace

RunSummary MakeOwnModel(const OwnTask& task, OwnModel* own) {
  return OwnModelMaker(task, own).Make();
}

}  // namespace mbv::simulation
