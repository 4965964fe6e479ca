#include "simulation/own_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/markup.h"
#include "mjcf/mjcf.h"
#include "simulation/engine_model.h"
#include "simulation/own_model_parts.h"

namespace mbv::simulation {
namespace {

RunSummary Unsupported(const std::string& why) {
  return {.stop = Stop::kUnsupported, .message = why, .where = {}, .unit = {}};
}

std::string AddedName(size_t drive) { return fmt::format("mbverify:drive:{}", drive); }

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
    TellSettings(&own_);
    FindLeads(task_, *imported_, &own_);
    TakeSettings(task_, &own_);
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
