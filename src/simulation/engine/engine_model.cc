#include "simulation/engine/engine_model.h"

#include <algorithm>
#include <array>

#include "mechanism/joint_pose.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv::simulation {
namespace {

using mjcf::PlannedClosure;

// MuJoCo takes one of the two anchors of a closure from the reference pose, where a small gap would
// be frozen in: both are stated here.
void MakeAnchorsExact(const EngineModel& engine) {
  for (size_t c = 0; c < engine.plan.closures.size(); ++c) {
    const PlannedClosure& closure = engine.plan.closures[c];
    const Joint& joint = engine.mechanism->joints[closure.joint];
    AnchorFrames frames{joint.X_CM, joint.X_PF};
    if (closure.type == PlannedClosure::Type::kSplit) {
      frames.X_1 = frames.X_2 = closure.split_parent ? joint.X_PF : joint.X_CM;
    }
    SetAnchors(closure.type != PlannedClosure::Type::kConnect, frames,
               engine.m->eq_data + mjNEQDATA * engine.closure_equality[c]);
  }
}

RunSummary FindDriven(EngineModel* engine) {
  const Mechanism& mechanism = *engine->mechanism;
  const mjModel& m = *engine->m;
  const auto add_joint = [&](const std::string& name, const std::string& equality, int joint,
                             int coordinate) {
    DrivenPlace place{.name = name, .equality = IdOf(m, mjOBJ_EQUALITY, equality)};
    place.object = IdOf(m, mjOBJ_JOINT, mjcf::JointName(mechanism.joints[joint], coordinate));
    place.dof = m.jnt_dofadr[place.object];
    place.home = m.qpos0[m.jnt_qposadr[place.object]];
    engine->driven.push_back(place);
  };
  for (const Drive& drive : mechanism.drives) {
    const std::string equality = mjcf::DriveEqualityName(drive);
    const auto* driven = std::get_if<JointDrive>(&drive.kind);
    if (driven == nullptr) {
      DrivenPlace place{.name = drive.name, .equality = IdOf(m, mjOBJ_EQUALITY, equality)};
      place.is_tendon = true;
      place.object = IdOf(m, mjOBJ_TENDON, drive.name);
      place.home = m.tendon_length0[place.object];
      engine->driven.push_back(place);
      continue;
    }
    const JointKind kind = mechanism.joints[driven->joint].kind;
    if (!IsScalar(kind, driven->coordinate)) {
      return {.stop = Stop::kUnsupported,
              .message = "drive '" + drive.name +
                         "' acts on a coordinate of the ball or free joint '" +
                         mechanism.joints[driven->joint].name + "', which MuJoCo does not have",
              .where = drive.name,
              .names_where = true};
    }
    add_joint(drive.name, equality, driven->joint, driven->coordinate);
  }
  for (const Prescribed& base : mechanism.prescribed) {
    add_joint(base.name, mjcf::BaseEqualityName(base), base.joint, 0);
  }
  return RunSummary::Done();
}

// MuJoCo has equalities of two joints, one a polynomial of the other, and fixed tendons.
RunSummary CheckCouplings(const Mechanism& mechanism) {
  for (const Coupling& coupling : mechanism.couplings) {
    const bool known =
        mjcf::PlanCoupling(mechanism, coupling).type != mjcf::PlannedCoupling::Type::kUnknown;
    const auto on_ball = std::ranges::find_if(coupling.terms, [&](const Coupling::Term& term) {
      return !IsScalar(mechanism.joints[term.joint].kind, term.coordinate);
    });
    if (known && on_ball == coupling.terms.end()) continue;
    return {.stop = Stop::kUnsupported,
            .message = known ? "coupling '" + coupling.name +
                                   "' uses a coordinate of the ball or free joint '" +
                                   mechanism.joints[on_ball->joint].name +
                                   "', which MuJoCo does not have"
                             : "MuJoCo cannot hold coupling '" + coupling.name +
                                   "': it is neither linear nor one coordinate as a polynomial of "
                                   "one other; the other witnesses take it as it is",
            .where = coupling.name,
            .names_where = true};
  }
  return RunSummary::Done();
}

int EngineBody(const EngineModel& engine, int body) {
  return engine.body_id[static_cast<size_t>(engine.PlannedOf(body))];
}

// The bodies of bushings and rotors are never merged into others (simulation/mjcf/plan.cc).
void FindElementBodies(const EngineModel& engine, const ForceElement& element,
                       ElementPlace* place) {
  if (IsGyroscopic(element)) {
    place->carrier = EngineBody(engine, std::get<RotorLaw>(element.law).carrier->body);
  }
  if (element.bushing < 0) return;
  const Bushing& bushing = engine.mechanism->bushings[static_cast<size_t>(element.bushing)];
  place->bushing_parent = EngineBody(engine, bushing.parent);
  place->bushing_child = EngineBody(engine, bushing.child);
}

// MuJoCo's velocities of a ball are those of its outboard body, seen from the inboard one, about
// axes of the outboard one: where that is not the child, or M's axes are not its own, the three
// elements of a rotation still are these three together, but for friction, which is limited about
// each axis of M. A free joint's first three are those of the body's origin along the world's axes.
bool FindOfBallOrFree(const EngineModel& engine, const ForceElement& element, ElementPlace* place) {
  const mjModel& m = *engine.m;
  const Joint& joint = engine.mechanism->joints[static_cast<size_t>(element.joint)];
  const auto is_round = [&](int id) {
    return m.jnt_type[id] == mjJNT_BALL || m.jnt_type[id] == mjJNT_FREE;
  };
  const std::vector<int>& ids = engine.joint_ids[static_cast<size_t>(element.joint)];
  const auto round = std::ranges::find_if(ids, is_round);
  if (round == ids.end()) return false;
  const bool free = m.jnt_type[*round] == mjJNT_FREE;
  place->joint = *round;
  place->dof = m.jnt_dofadr[*round] + (free ? 3 : 0) + BallAxis(joint.kind, element.coordinate);
  place->qpos = m.jnt_qposadr[*round];  // has no meaning
  const auto outboard = std::ranges::find(engine.body_id, m.jnt_bodyid[*round]);
  const auto at = static_cast<size_t>(outboard - engine.body_id.begin());
  const double sense = engine.plan.bodies[at].body == joint.child ? 1.0 : -1.0;
  const bool turned = sense < 0.0 || !joint.X_CM.linear().isIdentity(0.0);
  if (IsOfBall(joint.kind, element.coordinate)) {
    if (!turned || !HasFriction(element)) return true;
    place->turned = EngineBody(engine, joint.child);
    place->axis_C = sense * joint.X_CM.linear().col(BallAxis(joint.kind, element.coordinate));
    return true;
  }
  return free && !turned && joint.X_PF.linear().isIdentity(0.0) &&
         joint.X_CM.translation().isZero(0.0);
}

RunSummary FindElements(EngineModel* engine) {
  const Mechanism& mechanism = *engine->mechanism;
  const mjModel& m = *engine->m;
  for (const ForceElement& element : mechanism.elements) {
    ElementPlace place;
    FindElementBodies(*engine, element, &place);
    if (element.bushing >= 0) {
      engine->elements.push_back(place);
      continue;
    }
    if (element.drive >= 0 || element.spring >= 0) {
      const std::string& name = element.drive >= 0
                                    ? mechanism.drives[static_cast<size_t>(element.drive)].name
                                    : mechanism.springs[static_cast<size_t>(element.spring)].name;
      place.tendon = IdOf(m, mjOBJ_TENDON, name);
      engine->elements.push_back(place);
      continue;
    }
    const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
    if (IsScalar(joint.kind, element.coordinate)) {
      place.joint = IdOf(m, mjOBJ_JOINT, mjcf::JointName(joint, element.coordinate));
      place.dof = m.jnt_dofadr[place.joint];
      place.qpos = m.jnt_qposadr[place.joint];
    } else if (!FindOfBallOrFree(*engine, element, &place)) {
      return {.stop = Stop::kUnsupported,
              .message = "element '" + element.name + "' acts on a coordinate of the free joint '" +
                         joint.name + "', which MuJoCo does not have",
              .where = element.name,
              .names_where = true};
    }
    engine->elements.push_back(place);
  }
  return RunSummary::Done();
}

// MuJoCo compiles no body whose inertia violates the triangle inequality, and then steps it as any
// other.
void SetImpossibleInertias(EngineModel* engine) {
  bool any = false;
  for (size_t i = 1; i < engine->plan.bodies.size(); ++i) {
    const mjcf::PlannedBody& body = engine->plan.bodies[i];
    if (body.mass <= 0.0) continue;
    const PrincipalInertia principal = PrincipalInertiaOf(body.I_Bcm_B, body.mass);
    if (principal.moments == principal.admissible) continue;
    Eigen::Map<Vec3>{engine->m->body_inertia + 3 * engine->body_id[i]} = principal.moments;
    any = true;
  }
  if (!any) return;
  const DataHandle scratch = MakeData(*engine->m);
  mj_setConst(engine->m.get(), scratch.get());
}

}  // namespace

void SetAnchors(bool weld, const AnchorFrames& frames, mjtNum* eq_data) {
  const Pose &X_1 = frames.X_1, &X_2 = frames.X_2;
  // Of a weld the anchor on the second body comes first.
  Eigen::Map<Vec3>{eq_data} = (weld ? X_2 : X_1).translation();
  Eigen::Map<Vec3>{eq_data + 3} = (weld ? X_1 : X_2).translation();
  if (!weld) return;
  const Eigen::Quaterniond q(Mat3(X_1.linear() * X_2.linear().transpose()));
  Eigen::Map<Eigen::Vector4d>(eq_data + 6) << q.w(), q.x(), q.y(), q.z();
}

namespace {

// The text of a free joint has one number for its six DOFs.
void SetForcesOfBalls(EngineModel* engine) {
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    const ElementPlace& place = engine->elements[e];
    if (IsOfRoundJoint(*engine, e)) {
      engine->m->dof_damping[place.dof] = engine->m->dof_armature[place.dof] = 0.0;
    }
  }
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    const ElementPlace& place = engine->elements[e];
    if (!IsOfRoundJoint(*engine, e)) continue;
    const ForceElement& element = engine->mechanism->elements[e];
    if (const auto* damping = std::get_if<DampingLaw>(&element.law)) {
      engine->m->dof_damping[place.dof] += damping->damping;
    } else if (const auto* rotor = std::get_if<RotorLaw>(&element.law)) {
      engine->m->dof_armature[place.dof] += rotor->reflected();
    }
  }
}

}  // namespace

bool IsOfRoundJoint(const EngineModel& engine, size_t element) {
  const int joint = engine.elements[element].joint;
  return joint >= 0 &&
         (engine.m->jnt_type[joint] == mjJNT_BALL || engine.m->jnt_type[joint] == mjJNT_FREE);
}

RunSummary MakeEngineModel(const Mechanism& mechanism, const std::string& mjcf,
                           EngineModel* engine) {
  if (RunSummary summary = CheckCouplings(mechanism); !summary.ok()) return summary;
  engine->mechanism = &mechanism;
  engine->plan = mjcf::MakePlan(mechanism);
  if (std::string trouble = mjcf::NestingTrouble(engine->plan); !trouble.empty()) {
    return {.stop = Stop::kUnsupported, .message = std::move(trouble)};
  }
  engine->m = CompileMjcf(mjcf);
  engine->sparse = mj_isSparse(engine->m.get()) != 0;
  engine->m->opt.jacobian = mjJAC_DENSE;
  const mjModel& m = *engine->m;
  engine->joint_ids.resize(mechanism.joints.size());
  for (const mjcf::PlannedBody& body : engine->plan.bodies) {
    engine->body_id.push_back(IdOf(m, mjOBJ_BODY, body.name));
    for (const mjcf::PlannedJoint& joint : body.joints) {
      if (joint.joint < 0) continue;
      engine->joint_ids[joint.joint].push_back(IdOf(m, mjOBJ_JOINT, joint.name));
    }
  }
  SetImpossibleInertias(engine);
  for (const mjcf::PlannedClosure& closure : engine->plan.closures) {
    engine->closure_equality.push_back(IdOf(m, mjOBJ_EQUALITY, closure.name));
  }
  for (const Coupling& coupling : mechanism.couplings) {
    engine->coupling_equality.push_back(IdOf(m, mjOBJ_EQUALITY, mjcf::CouplingName(coupling)));
  }
  for (const SpringDamper& spring : mechanism.springs) {
    engine->spring_tendon.push_back(IdOf(m, mjOBJ_TENDON, spring.name));
  }
  engine->dof_is_rotation3.assign(m.nv, false);
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_type[j] == mjJNT_BALL) engine->dof_is_rotation3[m.jnt_dofadr[j]] = true;
    if (m.jnt_type[j] == mjJNT_FREE) engine->dof_is_rotation3[m.jnt_dofadr[j] + 3] = true;
  }
  MakeAnchorsExact(*engine);
  if (RunSummary summary = FindElements(engine); !summary.ok()) return summary;
  // Rows of friction about other axes than MuJoCo's have more entries than its sparse ones.
  if (std::ranges::any_of(engine->elements, [](const auto& at) { return at.turned >= 0; })) {
    engine->sparse = false;
  }
  SetForcesOfBalls(engine);
  return FindDriven(engine);
}

void LeaveOutShapes(EngineModel* engine) {
  mjModel& m = *engine->m;
  m.ngeom = 0;
  std::fill_n(m.body_geomnum, m.nbody, 0);
  std::vector<bool> passed(static_cast<size_t>(m.nsite), false);
  for (int w = 0; w < m.nwrap; ++w) {
    if (m.wrap_type[w] == mjWRAP_SITE) passed[static_cast<size_t>(m.wrap_objid[w])] = true;
  }
  for (int s = 0; s < m.nsite; ++s) {
    if (!passed[static_cast<size_t>(s)]) m.site_sameframe[s] = 1;
  }
}

void SetRestRates(double duration_s, EngineModel* engine) {
  const Mechanism& mechanism = *engine->mechanism;
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    engine->elements[e].rest_rate = RestRate(mechanism, mechanism.elements[e], duration_s);
  }
}

void AddFrictionRows(EngineModel* engine) {
  mjModel& m = *engine->m;
  std::vector<FrictionPlace> places;
  places.reserve(static_cast<size_t>(m.nv) + static_cast<size_t>(m.ntendon));
  for (int dof = 0; dof < m.nv; ++dof) places.push_back({.dof = dof, .elements = {}});
  for (int t = 0; t < m.ntendon; ++t) places.push_back({.tendon = t, .elements = {}});
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    const ElementPlace& place = engine->elements[e];
    const ForceElement& element = engine->mechanism->elements[e];
    if (place.prescribed || (!HasFriction(element) && !IsRigidStop(element))) continue;
    const int at = place.tendon >= 0 ? m.nv + place.tendon : place.dof;
    const auto* law = std::get_if<FrictionLaw>(&element.law);
    // Without a loss there is no row; that by the load is written into it at every node.
    const double loss = law != nullptr && law->breakaway > 0.0 ? law->breakaway : 1.0;
    (place.tendon >= 0 ? m.tendon_frictionloss[place.tendon] : m.dof_frictionloss[place.dof]) +=
        loss;
    places[static_cast<size_t>(at)].elements.push_back(e);
  }
  std::erase_if(places, [](const FrictionPlace& place) { return place.elements.empty(); });
  m.njmax += static_cast<int>(places.size());
  engine->frictions = std::move(places);
}

bool IsReleased(const EngineModel& engine) {
  return std::ranges::any_of(engine.driven, [](const DrivenPlace& place) { return place.forced; });
}

void AddArmatures(EngineModel* engine) {
  for (size_t e = 0; e < engine->elements.size(); ++e) {
    ElementPlace& place = engine->elements[e];
    const ForceElement& element = engine->mechanism->elements[e];
    if (place.dof < 0 || !IsGyroscopic(element)) continue;
    engine->m->dof_armature[place.dof] += std::get<RotorLaw>(element.law).reflected();
    place.armature = true;
  }
}

void ReleaseForcedDrives(const Motion& motion, EngineModel* engine) {
  for (const DriveForce& force : motion.forces) {
    DrivenPlace& place = engine->driven[static_cast<size_t>(force.drive)];
    place.forced = true;
    engine->m->eq_active[place.equality] = 0;
  }
}

void PrescribeDrives(bool on, EngineModel* engine) {
  for (size_t k = 0; k < engine->mechanism->drives.size(); ++k) {
    engine->driven[k].forced = !on;
    engine->m->eq_active[engine->driven[k].equality] = on ? 1 : 0;
  }
}

void FindServos(EngineModel* engine) {
  const mjModel& m = *engine->m;
  for (size_t k = 0; k < engine->mechanism->drives.size(); ++k) {
    DrivenPlace& place = engine->driven[k];
    place.motor = IdOf(m, mjOBJ_ACTUATOR, place.name);
    place.position_servo = IdOf(m, mjOBJ_ACTUATOR, place.name + mjcf::kPositionServo);
    place.velocity_servo = IdOf(m, mjOBJ_ACTUATOR, place.name + mjcf::kVelocityServo);
  }
}

Pose PoseOf(const mjData& d, int body_id) {
  Pose X = Pose::Identity();
  X.linear() = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(d.xmat + 9 * body_id);
  X.translation() = Eigen::Map<const Vec3>(d.xpos + 3 * body_id);
  return X;
}

void BodyPoses(const EngineModel& engine, const mjData& d, std::vector<Pose>* X_WB) {
  const Mechanism& mechanism = *engine.mechanism;
  X_WB->resize(mechanism.bodies.size());
  (*X_WB)[0] = Pose::Identity();
  for (size_t k = 0; k < mechanism.tree_joints.size(); ++k) {
    const Joint& joint = mechanism.joints[mechanism.tree_joints[k]];
    const bool reversed = mechanism.tree_reversed[k];
    const int body = reversed ? joint.parent : joint.child;
    if (const int planned = engine.PlannedOf(body); planned >= 0) {
      (*X_WB)[body] = PoseOf(d, engine.body_id[planned]);
      continue;
    }
    // A merged body has hinges and slides only; their positions are the joint's coordinates.
    std::array<double, 6> q{};
    const std::vector<int>& ids = engine.joint_ids[mechanism.tree_joints[k]];
    for (size_t i = 0; i < ids.size(); ++i) {
      const size_t coordinate = reversed ? ids.size() - 1 - i : i;
      q[coordinate] = d.qpos[engine.m->jnt_qposadr[ids[i]]];
    }
    const Pose X_PC = joint.X_PF * JointPose(joint, q) * joint.X_CM.inverse();
    (*X_WB)[body] = reversed ? (*X_WB)[joint.child] * X_PC.inverse() : (*X_WB)[joint.parent] * X_PC;
  }
}

}  // namespace mbv::simulation
