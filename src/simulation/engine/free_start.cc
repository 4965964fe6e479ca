// The start of a free motion: body states → MuJoCo's coordinates, then onto its own loops.
#include <algorithm>

#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/tree_motion.h"
#include "simulation/engine/session.h"

namespace mbv::simulation {
namespace {

using mjcf::PlannedBody;
using mjcf::PlannedJoint;

// Quaternion of a rotation, as MuJoCo stores it.
void PutRotation(const Mat3& R, double* wxyz) {
  const Eigen::Quaterniond q(R);
  wxyz[0] = q.w();
  wxyz[1] = q.x();
  wxyz[2] = q.y();
  wxyz[3] = q.z();
}

// Per joint and coordinate a value within half a turn: home, or what the states followed on their
// way (BodyStates::coupled, turns).
std::vector<std::array<double, 6>> NearValues(const Mechanism& mechanism, const Motion& motion,
                                              const BodyStates& states) {
  std::vector<std::array<double, 6>> near;
  for (const Joint& joint : mechanism.joints) near.push_back(joint.home);
  if (!states.coupled.empty()) {
    const double* value = states.coupled.data();
    for (const Coupling& coupling : mechanism.couplings) {
      for (const Coupling::Term& term : coupling.terms)
        near[term.joint][term.coordinate] = *value++;
    }
  }
  if (states.turns.empty()) return near;
  for (const FollowedAngle& angle : FollowedAngles(mechanism, motion)) {
    const Coordinate& at = angle.coordinate;
    if (at.kind != Coordinate::Kind::kJoint) continue;
    near[at.index][at.component] = FollowedNear(mechanism, states, angle);
  }
  const double* value = states.turns.data();
  for (const ForceElement& element : mechanism.elements) {
    if (element.joint >= 0) near[element.joint][element.coordinate] = *value;
    ++value;
  }
  for (const Drive& drive : mechanism.drives) {
    if (const auto* on = std::get_if<JointDrive>(&drive.kind))
      near[on->joint][on->coordinate] = *value;
    ++value;
  }
  for (const Prescribed& prescribed : mechanism.prescribed) near[prescribed.joint][0] = *value++;
  return near;
}

class Start {
 public:
  Start(const EngineModel& engine, const Motion& motion, const BodyStates& states, mjData* d)
      : engine_(engine), mechanism_(*engine.mechanism), states_(states), d_(d) {
    coordinates_ =
        JointCoordinatesAt(mechanism_, states.X_WB, NearValues(mechanism_, motion, states));
  }

  // False if a joint has coordinates that body states do not give one by one.
  bool Put() {
    for (size_t b = 1; b < engine_.plan.bodies.size(); ++b) {
      const PlannedBody& body = engine_.plan.bodies[b];
      for (const PlannedJoint& joint : body.joints) {
        if (!PutJoint(body, joint)) return false;
      }
    }
    return true;
  }

 private:
  bool PutJoint(const PlannedBody& body, const PlannedJoint& joint) {
    const mjModel& m = *engine_.m;
    const int id = IdOf(m, mjOBJ_JOINT, joint.name);
    double* qpos = d_->qpos + m.jnt_qposadr[id];
    double* qvel = d_->qvel + m.jnt_dofadr[id];
    const int planned_parent = body.parent;
    const int outboard = body.body, inboard = engine_.plan.bodies[planned_parent].body;
    const Pose& X_WB = states_.X_WB[outboard];
    const Vec6& V = states_.V_WB[outboard];
    switch (joint.type) {
      case PlannedJoint::Type::kHinge:
      case PlannedJoint::Type::kSlide: {
        if (joint.coordinate < 0) return false;
        const Joint& source = mechanism_.joints[joint.joint];
        const ScalarRow row = JointCoordinateRow(source, joint.coordinate, states_);
        *qpos = coordinates_[joint.joint][joint.coordinate];
        *qvel = RateOf(row, states_.V_WB);
        return true;
      }
      case PlannedJoint::Type::kBall: {
        // The ball turns the body from where its parent, and slides, would carry it.
        const Mat3 R_PB_home = mechanism_.X_WB_home[inboard].linear().transpose() *
                               mechanism_.X_WB_home[outboard].linear();
        const Mat3 R_WB_carried = states_.X_WB[inboard].linear() * R_PB_home;
        PutRotation(R_WB_carried.transpose() * X_WB.linear(), qpos);
        Eigen::Map<Vec3>{qvel} =
            X_WB.linear().transpose() * (V.head<3>() - states_.V_WB[inboard].head<3>());
        return std::ranges::none_of(body.joints, [](const PlannedJoint& other) {
          return other.type == PlannedJoint::Type::kHinge;
        });
      }
      case PlannedJoint::Type::kFree:
        Eigen::Map<Vec3>{qpos} = X_WB.translation();
        PutRotation(X_WB.linear(), qpos + 3);
        Eigen::Map<Vec3>{qvel} = V.tail<3>();
        Eigen::Map<Vec3>(qvel + 3) = X_WB.linear().transpose() * V.head<3>();
        return true;
    }
    return false;
  }

  const EngineModel& engine_;
  const Mechanism& mechanism_;
  const BodyStates& states_;
  mjData* d_;
  std::vector<std::array<double, 6>> coordinates_;
};

}  // namespace

bool PutStates(const EngineModel& engine, const Motion& motion, const BodyStates& states,
               mjData* d) {
  return Start(engine, motion, states, d).Put();
}

RunSummary PutAtFreeStart(Session* s, const DrivenSample& first) {
  const BodyStates& start = s->options.start;
  if (start.X_WB.size() != s->engine.mechanism->bodies.size()) {
    return {.stop = Stop::kUnsupported,
            .message = "a free motion needs the states of all bodies at its start",
            .time_s = 0.0};
  }
  if (!PutStates(s->engine, s->motion, start, s->data.get())) {
    return {
        .stop = Stop::kUnsupported,
        .message =
            "a free joint between moving bodies, or a ball beside a hinge on its body, cannot be "
            "started",
        .time_s = 0.0};
  }
  if (RunSummary summary = s->solver.Close(first.position); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  s->solver.CorrectVelocity(first.velocity);
  s->spins.StopVelocity();
  s->solver.SolveAcceleration(first.acceleration);
  return RunSummary::Done();
}

}  // namespace mbv::simulation
