// What is read off a user's model at a sample.
#include <algorithm>
#include <cmath>

#include "simulation/engine_model.h"
#include "simulation/own_stepper.h"

namespace mbv::simulation {
namespace {

using OwnVec3 = Eigen::Map<const Vec3>;

Eigen::Quaterniond QuaternionAt(const mjtNum* q) { return {q[0], q[1], q[2], q[3]}; }

}  // namespace

// What acts besides motion and loops.
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
    OwnRun::Gap& gap = run_->gaps[c];
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
    const int e = drive.lead == DriveLead::kAdded ? drive.added : drive.equality;
    if (e >= 0 && row_[static_cast<size_t>(e)] >= 0) {
      force = d_->efc_force[row_[static_cast<size_t>(e)]];
    }
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
