// What leads the drives of a user's model, and what is switched off.
#include <algorithm>

#include "core/names.h"
#include "mjcf/closure_settings.h"
#include "simulation/own_model_parts.h"

namespace mbv::simulation {
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
  LeadFinder(const OwnTask& task, const ImportedMjcf& imported, OwnModel* own)
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

  const OwnTask& task_;
  const Mechanism& mechanism_;
  const ImportedMjcf* const imported_;
  OwnModel& own_;
  mjModel* const m_;
};

}  // namespace

void FindLeads(const OwnTask& task, const ImportedMjcf& imported, OwnModel* own) {
  LeadFinder(task, imported, own).Run();
}

}  // namespace mbv::simulation
