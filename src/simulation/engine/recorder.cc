#include "simulation/engine/recorder.h"

#include <cmath>
#include <limits>
#include <utility>

#include "base/demand.h"
#include "math/spatial.h"
#include "mechanism/channels.h"
#include "mechanism/joint_pose.h"
#include "simulation/engine/element_forces.h"

namespace mbv::simulation {
namespace {

using ConstVec3 = Eigen::Map<const Vec3>;
using ConstVecX = Eigen::Map<const VecX>;

// Velocity of a point of a body, from MuJoCo's twist about the root's centre of mass.
Vec3 VelocityOf(const mjModel& m, const mjData& d, int body, const Vec3& p_W) {
  const Eigen::Map<const Vec6> V(d.cvel + 6 * body);
  const ConstVec3 c(d.subtree_com + 3 * m.body_rootid[body]);
  return V.tail<3>() + V.head<3>().cross(p_W - c);
}

// Rate of a spring's length [m/s].
double SpringRate(const ConstraintSystem& system, size_t spring) {
  const EngineModel& engine = system.engine();
  const int nv = engine.m->nv;
  const double* const J = system.data()->ten_J + engine.spring_tendon[spring] * nv;
  return ConstVecX(J, nv).dot(ConstVecX(system.data()->qvel, nv));
}

}  // namespace

void WorkRates(const ConstraintSystem& system, const Loads& loads, VecX* rates) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  const auto driven = static_cast<Eigen::Index>(engine.driven.size());
  rates->setZero(driven + 2);
  for (Eigen::Index k = 0; k < driven; ++k) {
    const int coordinate = static_cast<int>(k);
    (*rates)[k] = system.DrivenForce(coordinate) * system.AlongDriven(coordinate, d.qvel);
  }
  for (const WorldLoad& load : loads.world()) {
    const ConstVec3 w(d.cvel + 6 * load.body_id);
    (*rates)[driven] +=
        load.moment.dot(w) + load.force.dot(VelocityOf(m, d, load.body_id, load.p_WQ));
  }
  for (const JointForce& force : loads.joint_forces()) {
    (*rates)[driven] += force.force * d.qvel[force.dof];
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const double rate = SpringRate(system, s);
    (*rates)[driven + 1] -= engine.mechanism->springs[s].damping * rate * rate;
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    if (!Dissipates(element)) continue;
    const ElementMotion at = ElementMotionOf(system, e);
    (*rates)[driven + 1] += PowerOf(element, at) - SpringPowerOf(element, at);
  }
}

void FindPowers(const ConstraintSystem& system, const Loads& loads, Powers* found) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  Powers& power = *found;
  WorkRates(system, loads, &power.rates);
  power.gravity = power.springs = power.rotors = 0.0;
  const ConstVec3 g(m.opt.gravity);
  for (int b = 1; b < m.nbody; ++b) {
    power.gravity += m.body_mass[b] * g.dot(VelocityOf(m, d, b, ConstVec3(d.xipos + 3 * b)));
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    power.springs -= spring.stiffness *
                     (d.ten_length[engine.spring_tendon[s]] - spring.free_length_m) *
                     SpringRate(system, s);
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ForceElement& element = engine.mechanism->elements[e];
    const ElementMotion at = ElementMotionOf(system, e);
    power.springs += SpringPowerOf(element, at);
    if (std::holds_alternative<RotorLaw>(element.law)) power.rotors -= PowerOf(element, at);
  }
}

Energies EnergiesOf(const ConstraintSystem& system) {
  const EngineModel& engine = system.engine();
  const mjModel& m = *engine.m;
  const mjData& d = *system.data();
  Energies energy;
  const ConstVec3 g(m.opt.gravity);
  for (int b = 1; b < m.nbody; ++b) {
    const ConstVec3 p(d.xipos + 3 * b), w(d.cvel + 6 * b), I(m.body_inertia + 3 * b);
    const Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> R(d.ximat + 9 * b);
    const Vec3 w_I = R.transpose() * w;
    energy.kinetic += 0.5 * (m.body_mass[b] * VelocityOf(m, d, b, p).squaredNorm() +
                             w_I.dot(I.cwiseProduct(w_I)));
    energy.gravity -= m.body_mass[b] * g.dot(p);
  }
  for (size_t s = 0; s < engine.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine.mechanism->springs[s];
    const double stretch = d.ten_length[engine.spring_tendon[s]] - spring.free_length_m;
    energy.springs += 0.5 * spring.stiffness * stretch * stretch;
  }
  for (size_t e = 0; e < engine.elements.size(); ++e) {
    const ElementEnergy of = EnergyOf(engine.mechanism->elements[e], ElementMotionOf(system, e));
    energy.springs += of.stored;
    energy.kinetic += of.kinetic;
  }
  return energy;
}

void WorkMeter::Start(const VecX& power) {
  work_.setZero(power.size());
  power_.fill(power);
}

void WorkMeter::Step(double h, bool multistep, const VecX& power) {
  if (multistep) {
    work_ += h / 24.0 * (9.0 * power + 19.0 * power_[0] - 5.0 * power_[1] + power_[2]);  // (1)
  } else {
    work_ += h / 6.0 * (power_[0] + 4.0 * middle_ + power);
  }
  power_[2].swap(power_[1]);
  power_[1].swap(power_[0]);
  power_[0] = power;
}

// Terms: O the output's frame, R its reference frame, both fixed in bodies; all vectors in world
// axes unless a name says otherwise.
//
//   r  = p_RO,  v = v_O − v_R − ω_R × r                        seen from R, world axes          (1)
//   a  = a_O − a_R − α_R × r − ω_R × (ω_R × r) − 2 ω_R × v                                      (2)
//   ω  = ω_O − ω_R,  α = α_O − α_R − ω_R × ω                                                    (3)
// With R_RO = Rz(ψ) Ry(θ) Rx(φ) and, in R's axes, e1 = Rz Ry x, e2 = Rz y, e3 = z:
//   ω  = φ̇ e1 + θ̇ e2 + ψ̇ e3                                                                     (4)
//   α  = φ̈ e1 + θ̈ e2 + ψ̈ e3 + φ̇ (ψ̇ e3 + θ̇ e2) × e1 + θ̇ ψ̇ e3 × e2                               (5)
// e1 is the first column of R_RO; e2 is square to both others, and e = Rz x to e2 and e3:
//   θ̇ = e2·ω,  φ̇ = e·ω / cos θ,  ψ̇ = e3·ω + φ̇ sin θ                                             (6)

namespace {

// Below this cosine of the pitch, roll and yaw turn about the same axis.
constexpr double kLocked = 1e-8;

// A point of a body with all that moves there.
struct Place {
  Vec3 p, v, a, w, alpha;
};

// The origin of a frame fixed in a body, at p_BQ. MuJoCo's accelerations contain −gravity.
Place PlaceOf(const EngineModel& engine, const mjData& d, int body, const Vec3& p_BQ) {
  const mjModel& m = *engine.m;
  const Vec3 rest = Vec3::Zero();
  if (body == 0) return {.p = p_BQ, .v = rest, .a = rest, .w = rest, .alpha = rest};
  const int id = engine.body_id[engine.PlannedOf(body)];
  Vec6 V, A;
  mj_objectVelocity(&m, &d, mjOBJ_XBODY, id, V.data(), 0);
  mj_objectAcceleration(&m, &d, mjOBJ_XBODY, id, A.data(), 0);
  const Pose X_WB = PoseOf(d, id);
  const Vec3 w = V.head<3>(), alpha = A.head<3>(), r = X_WB.linear() * p_BQ;
  const Eigen::Map<const Vec3> g(m.opt.gravity);
  return {.p = X_WB.translation() + r,
          .v = V.tail<3>() + w.cross(r),
          .a = A.tail<3>() + g + alpha.cross(r) + w.cross(w.cross(r)),
          .w = w,
          .alpha = alpha};
}

// Roll, pitch, yaw rates and accelerations, (4) to (6), from ω and α in R's axes.
void PutAngles(const Mat3& R_RO, const Vec3& w, const Vec3& alpha, OutputRates* rates) {
  const Vec3 e1 = R_RO.col(0), e3 = Vec3::UnitZ();
  const double cosine = std::hypot(e1.x(), e1.y()), sine = -e1.z();
  if (cosine < kLocked) return;
  const Vec3 e(e1.x() / cosine, e1.y() / cosine, 0.0), e2 = e3.cross(e);
  const auto angles = [&](const Vec3& turn) {
    const double roll = e.dot(turn) / cosine;
    return Vec3(roll, e2.dot(turn), turn.z() + roll * sine);
  };
  const Vec3 rate = angles(w);
  const Vec3 bias =
      rate[0] * (rate[2] * e3 + rate[1] * e2).cross(e1) + rate[1] * rate[2] * e3.cross(e2);
  rates->velocity.tail<3>() = rate;
  rates->acceleration.tail<3>() = angles(alpha - bias);
}

}  // namespace

bool HasOutputRates(const EngineModel& engine, const Output& output) {
  return engine.PlannedOf(output.body) >= 0 && engine.PlannedOf(output.reference_body) >= 0;
}

bool HasJointRates(const EngineModel& engine, const Joint& joint) {
  return engine.PlannedOf(joint.child) >= 0 && engine.PlannedOf(joint.parent) >= 0;
}

namespace {

// How frame O of a body moves against frame R of another, (1) to (3) in R's axes.
struct Relative {
  Mat3 R_RO;
  Vec3 v, a, w, alpha;
};

Relative RelativeOf(const EngineModel& engine, const mjData& d, int reference_body,
                    const Pose& X_BR, int body, const Pose& X_BO) {
  const Place o = PlaceOf(engine, d, body, X_BO.translation());
  const Place f = PlaceOf(engine, d, reference_body, X_BR.translation());
  const auto rotation = [&](int of) {
    return Mat3(PoseOf(d, engine.body_id[engine.PlannedOf(of)]).linear());
  };
  const Mat3 R_RW = (rotation(reference_body) * X_BR.linear()).transpose();
  const Vec3 r = o.p - f.p, w = o.w - f.w;
  const Vec3 v = o.v - f.v - f.w.cross(r);
  const Vec3 a = o.a - f.a - f.alpha.cross(r) - f.w.cross(f.w.cross(r)) - 2.0 * f.w.cross(v);
  const Vec3 alpha = o.alpha - f.alpha - f.w.cross(w);
  return {.R_RO = R_RW * rotation(body) * X_BO.linear(),
          .v = R_RW * v,
          .a = R_RW * a,
          .w = R_RW * w,
          .alpha = R_RW * alpha};
}

}  // namespace

OutputRates OutputRatesOf(const EngineModel& engine, const mjData& d, const Output& output) {
  const Relative motion =
      RelativeOf(engine, d, output.reference_body, output.X_RbR, output.body, output.X_BO);
  OutputRates rates;
  rates.velocity.head<3>() = motion.v;
  rates.acceleration.head<3>() = motion.a;
  PutAngles(motion.R_RO, motion.w, motion.alpha, &rates);
  return rates;
}

// With S the joint's unit twists in F's axes, [ω; v] = S q̇ and [α; a] = S q̈ + b. What the joint may
// do along and about axes that are fixed in F or M has b = 0; the second axis of a universal joint
// turns about the first, b = q̇1 q̇2 axis × axis2, which is square to both: least squares of both
// equations give q̇ and q̈.                                                                       (7)
CoordinateRates JointRatesOf(const EngineModel& engine, const mjData& d, const Joint& joint,
                             int coordinate) {
  const Relative motion = RelativeOf(engine, d, joint.parent, joint.X_PF, joint.child, joint.X_CM);
  const JointTwists S = UnitTwists(joint, Mat3::Identity(), motion.R_RO);
  const Eigen::ColPivHouseholderQR<JointTwists> qr(S);
  Vec6 V, A;
  V << motion.w, motion.v;
  A << motion.alpha, motion.a;
  return {VecX(qr.solve(V))[coordinate], VecX(qr.solve(A))[coordinate]};
}

namespace {

using mjcf::PlannedClosure;
using ConstVec3 = Eigen::Map<const Vec3>;
using ConstVecX = Eigen::Map<const VecX>;

void Append(const std::vector<Channel>& more, std::vector<Channel>* channels) {
  channels->insert(channels->end(), more.begin(), more.end());
}

}  // namespace

std::vector<Channel> Recorder::MakeChannels(bool work) {
  const Mechanism& mechanism = *engine_.mechanism;
  std::vector<Channel> channels = DriveChannels(mechanism);
  Append(OutputChannels(mechanism), &channels);
  Append(PrescribedChannels(mechanism), &channels);
  Append(BandChannels(mechanism), &channels);
  for (const Joint& joint : mechanism.joints) Append(ReactionChannels(joint), &channels);
  Append(AuditChannels(), &channels);
  Append(EnergyChannels(), &channels);
  if (work) Append(WorkChannels(mechanism), &channels);
  for (const Output& output : mechanism.outputs) {
    if (!HasOutputRates(engine_, output)) continue;
    rated_.push_back(&output);
    Append(OutputRateChannels(mechanism, output), &channels);
  }
  for (const Coordinate& at : joints_) {
    const Joint& joint = mechanism.joints[static_cast<size_t>(at.index)];
    Append(JointChannels(mechanism, at, HasJointRates(engine_, joint)), &channels);
  }
  return channels;
}

Recorder::Recorder(ConstraintSystem* system, std::vector<Coordinate> joints, bool work)
    : system_(system),
      engine_(system->engine()),
      joints_(std::move(joints)),
      channels_(MakeChannels(work)),
      columns_(channels_) {
  W_.setZero(6, engine_.m->nbody);
  work_.setZero(engine_.m->nv);
  FindReactionPlaces();
}

void Recorder::FindReactionPlaces() {
  const Mechanism& mechanism = *engine_.mechanism;
  places_.resize(mechanism.joints.size());
  driven_of_.resize(mechanism.joints.size());
  // A merged body passes on what its only outboard body needs: search from the leaves inwards.
  std::vector<int> carrier(mechanism.bodies.size(), -1);
  for (size_t b = 0; b < carrier.size(); ++b) {
    if (const int p = engine_.PlannedOf(static_cast<int>(b)); p >= 0) {
      carrier[b] = engine_.body_id[p];
    }
  }
  for (size_t k = mechanism.tree_joints.size(); k-- > 0;) {
    const int j = mechanism.tree_joints[k];
    const Joint& joint = mechanism.joints[j];
    const bool reversed = mechanism.tree_reversed[k];
    const int outboard = reversed ? joint.parent : joint.child;
    const int inboard = reversed ? joint.child : joint.parent;
    if (carrier[inboard] < 0) carrier[inboard] = carrier[outboard];
    places_[j] = {.body_id = carrier[outboard], .sign = reversed ? -1.0 : 1.0};
  }
  for (size_t c = 0; c < engine_.plan.closures.size(); ++c) {
    const PlannedClosure& closure = engine_.plan.closures[c];
    ReactionPlace& place = places_[closure.joint];
    if (closure.type == PlannedClosure::Type::kSplit) {
      place = {.body_id = engine_.body_id[closure.body2],
               .sign = closure.split_parent ? -1.0 : 1.0};
    } else {
      place.closure = static_cast<int>(c);
    }
  }
  const auto add = [this](int joint, size_t row) {
    if (!engine_.driven[row].is_tendon) {
      driven_of_[joint].emplace_back(static_cast<int>(row), engine_.driven[row].object);
    }
  };
  size_t row = 0;
  for (const Drive& drive : mechanism.drives) {
    if (const auto* driven = std::get_if<JointDrive>(&drive.kind)) add(driven->joint, row);
    ++row;
  }
  for (const Prescribed& base : mechanism.prescribed) add(base.joint, row++);
  universal_.assign(mechanism.joints.size(), {-1, -1});
  for (size_t j = 0; j < places_.size(); ++j) {
    const Joint& joint = mechanism.joints[j];
    if (joint.kind != JointKind::kUniversal) continue;
    for (const int i : {0, 1}) {
      universal_[j][i] = IdOf(*engine_.m, mjOBJ_JOINT, mjcf::JointName(joint, i));
    }
  }
  elements_of_.resize(mechanism.joints.size());
  for (size_t e = 0; e < mechanism.elements.size(); ++e) {
    const int joint = mechanism.elements[e].joint;
    if (joint >= 0) elements_of_[joint].push_back(e);
  }
  coupled_of_.resize(mechanism.joints.size());
  for (size_t c = 0; c < mechanism.couplings.size(); ++c) {
    for (const Coupling::Term& term : mechanism.couplings[c].terms) {
      const std::string name = mjcf::JointName(mechanism.joints[term.joint], term.coordinate);
      coupled_of_[term.joint].emplace_back(system_->coupling_row(static_cast<int>(c)),
                                           IdOf(*engine_.m, mjOBJ_JOINT, name));
    }
  }
}

void Recorder::Record(const Loads& loads, const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row,
                      std::vector<Pose>* X_WB) {
  BodyPoses(engine_, *system_->data(), X_WB);
  RecordDriven(row);
  RecordOutputs(*X_WB, row);
  RecordReactions(loads, *X_WB, row);
  RecordOutputRates(row);
  RecordJoints(*X_WB, row);
  RecordAudit(loads, work, row);
}

void Recorder::RecordDriven(Eigen::Ref<Eigen::RowVectorXd> row) {
  const mjData* d = system_->data();
  system_->BodyBiasAccelerations();
  const int drives = static_cast<int>(engine_.mechanism->drives.size());
  for (int k = 0; k < static_cast<int>(engine_.driven.size()); ++k) {
    const DrivenPlace& place = engine_.driven[k];
    if (k >= drives) {
      row[columns_(Quantity::kBaseForce, k - drives)] = system_->DrivenForce(k);
      continue;
    }
    row[columns_(Quantity::kPosition, k)] = place.is_tendon
                                                ? d->ten_length[place.object]
                                                : d->qpos[engine_.m->jnt_qposadr[place.object]];
    row[columns_(Quantity::kVelocity, k)] = system_->AlongDriven(k, d->qvel);
    row[columns_(Quantity::kAcceleration, k)] =
        system_->AlongDriven(k, d->qacc) + system_->DrivenBias(k);
    row[columns_(Quantity::kForce, k)] = system_->DrivenForce(k);
  }
}

void Recorder::RecordBands(const VecX& bands, Eigen::Ref<Eigen::RowVectorXd> row) const {
  const size_t drives = engine_.mechanism->drives.size();
  for (size_t k = 0; k < engine_.driven.size(); ++k) {
    const int column = k < drives ? columns_(Quantity::kForceBand, k)
                                  : columns_(Quantity::kBaseForceBand, k - drives);
    row[column] = bands[static_cast<Eigen::Index>(k)];
  }
}

void Recorder::RecordOutputs(const std::vector<Pose>& X_WB,
                             Eigen::Ref<Eigen::RowVectorXd> row) const {
  const std::vector<Output>& outputs = engine_.mechanism->outputs;
  for (size_t i = 0; i < outputs.size(); ++i) {
    const Output& output = outputs[i];
    const Pose X_WR = X_WB[output.reference_body] * output.X_RbR;
    const Pose X_RO = X_WR.inverse(Eigen::Isometry) * X_WB[output.body] * output.X_BO;
    row.segment<3>(columns_(Quantity::kPose, 6 * i)) = X_RO.translation().transpose();
    row.segment<3>(columns_(Quantity::kPose, 6 * i + 3)) = RpyOf(X_RO.linear()).transpose();
  }
}

void Recorder::RecordOutputRates(Eigen::Ref<Eigen::RowVectorXd> row) const {
  for (size_t i = 0; i < rated_.size(); ++i) {
    const OutputRates rates = OutputRatesOf(engine_, *system_->data(), *rated_[i]);
    row.segment<6>(columns_(Quantity::kPoseVelocity, 6 * i)) = rates.velocity.transpose();
    row.segment<6>(columns_(Quantity::kPoseAcceleration, 6 * i)) = rates.acceleration.transpose();
  }
}

void Recorder::RecordJoints(const std::vector<Pose>& X_WB,
                            Eigen::Ref<Eigen::RowVectorXd> row) const {
  size_t rated = 0;
  for (size_t k = 0; k < joints_.size(); ++k) {
    const Joint& joint = engine_.mechanism->joints[static_cast<size_t>(joints_[k].index)];
    const auto c = static_cast<size_t>(joints_[k].component);
    const Pose X_FM =
        (X_WB[joint.parent] * joint.X_PF).inverse(Eigen::Isometry) * X_WB[joint.child] * joint.X_CM;
    row[columns_(Quantity::kJointPosition, k)] = CoordinatesOf(joint, X_FM)[c];
    if (!HasJointRates(engine_, joint)) continue;
    const CoordinateRates rates =
        JointRatesOf(engine_, *system_->data(), joint, joints_[k].component);
    row[columns_(Quantity::kJointVelocity, rated)] = rates.velocity;
    row[columns_(Quantity::kJointAcceleration, rated++)] = rates.acceleration;
  }
}

void Recorder::AddExternal(int body_id, const Vec3& p_W, const Vec3& force, const Vec3& moment) {
  if (body_id == 0) return;
  const ConstVec3 c(system_->data()->subtree_com + 3 * engine_.m->body_rootid[body_id]);
  W_.col(body_id).head<3>() -= moment + (p_W - c).cross(force);
  W_.col(body_id).tail<3>() -= force;
}

// A tendon pushes its ends apart with `force`.
void Recorder::AddTendon(int tendon, double force) {
  const mjModel& m = *engine_.m;
  const mjData* d = system_->data();
  const int* sites = m.wrap_objid + m.tendon_adr[tendon];
  const ConstVec3 from(d->site_xpos + 3 * sites[0]), to(d->site_xpos + 3 * sites[1]);
  const Vec3 f = force * (to - from).normalized();
  AddExternal(m.site_bodyid[sites[0]], from, -f, Vec3::Zero());
  AddExternal(m.site_bodyid[sites[1]], to, f, Vec3::Zero());
}

// Wrench [m; f] on the closure's first body at its anchor, world axes.
Vec6 Recorder::ClosureWrench(int c) const {
  const mjData* d = system_->data();
  const PlannedClosure& closure = engine_.plan.closures[c];
  const auto force = system_->force();
  const int row = system_->closure_row(c);
  Vec6 F = Vec6::Zero();
  F.tail<3>() = force.segment<3>(row);
  if (closure.type == PlannedClosure::Type::kConnect) return F;
  // Transpose of the rotation rows, ½ Im(q2⁻¹ ω q1 q_rel).
  const auto quat = [](const double* q) { return Eigen::Quaterniond(q[0], q[1], q[2], q[3]); };
  const double* data = engine_.m->eq_data + mjNEQDATA * engine_.closure_equality[c];
  const int b1 = engine_.body_id[closure.body1], b2 = engine_.body_id[closure.body2];
  const Eigen::Quaterniond q1_rel = quat(d->xquat + 4 * b1) * quat(data + 6);
  const Eigen::Quaterniond q2_inverse = quat(d->xquat + 4 * b2).conjugate();
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Quaterniond e(0, 0, 0, 0);
    e.vec()[axis] = 0.5;
    F[axis] = (q2_inverse * e * q1_rel).vec().dot(force.segment<3>(row + 3));
  }
  return F;
}

void Recorder::TreeWrenches(const Loads& loads) {
  const mjModel& m = *engine_.m;
  const mjData* d = system_->data();
  W_.setZero();
  for (size_t c = 0; c < engine_.plan.closures.size(); ++c) {
    const PlannedClosure& closure = engine_.plan.closures[c];
    const bool connect = closure.type == PlannedClosure::Type::kConnect;
    const double* data = m.eq_data + mjNEQDATA * engine_.closure_equality[c];
    const int b1 = engine_.body_id[closure.body1], b2 = engine_.body_id[closure.body2];
    const Vec6 F = ClosureWrench(static_cast<int>(c));
    AddExternal(b1, PoseOf(*d, b1) * ConstVec3(data + (connect ? 0 : 3)), F.tail<3>(), F.head<3>());
    AddExternal(b2, PoseOf(*d, b2) * ConstVec3(data + (connect ? 3 : 0)), -F.tail<3>(),
                -F.head<3>());
  }
  for (size_t k = 0; k < engine_.driven.size(); ++k) {
    const DrivenPlace& place = engine_.driven[k];
    if (place.is_tendon) {
      AddTendon(place.object, system_->DrivenForce(static_cast<int>(k)));
    }
  }
  for (size_t s = 0; s < engine_.spring_tendon.size(); ++s) {
    const SpringDamper& spring = engine_.mechanism->springs[s];
    const int tendon = engine_.spring_tendon[s];
    const double rate = ConstVecX(d->ten_J + tendon * m.nv, m.nv).dot(ConstVecX(d->qvel, m.nv));
    AddTendon(tendon, -spring.stiffness * (d->ten_length[tendon] - spring.free_length_m) -
                          spring.damping * rate);
  }
  for (size_t e = 0; e < engine_.elements.size(); ++e) {
    const int tendon = engine_.elements[e].tendon;
    if (tendon >= 0) AddTendon(tendon, ElementForce(e));
    AddElement(e);
  }
  for (const WorldLoad& load : loads.world()) {
    AddExternal(load.body_id, load.p_WQ, load.force, load.moment);
  }
  beside_drives_.setZero(static_cast<Eigen::Index>(engine_.driven.size()));
  for (const JointForce& force : loads.joint_forces()) {
    beside_drives_[static_cast<Eigen::Index>(force.driven)] = force.force;
  }
  // What a body needs beyond the forces on it and its subtree comes from its parent.
  for (int b = m.nbody - 1; b > 0; --b) {
    if (m.body_parentid[b] > 0) W_.col(m.body_parentid[b]) += W_.col(b);
  }
  W_ += Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(d->cfrc_int, 6, m.nbody);
}

// Bushings, and what a rotor does to its carrier.
void Recorder::AddElement(size_t e) {
  const ElementPlace& place = engine_.elements[e];
  if (place.carrier >= 0) {
    const Vec3 moment = CarrierMoment(engine_.mechanism->elements[e], ElementMotionOf(*system_, e));
    AddExternal(place.carrier, Vec3::Zero(), Vec3::Zero(), moment);
  }
  if (place.bushing_child < 0) return;
  const BushingLine line = BushingLineOf(*system_, e);
  const double force = ElementForce(e);
  const Vec3 f = force * line.push, m = force * line.turn;
  AddExternal(place.bushing_child, line.p_WM, f, m);
  AddExternal(place.bushing_parent, line.p_WM, -f, -m);
}

double Recorder::ElementForce(size_t e) const {
  return ForceOf(engine_.mechanism->elements[e], ElementMotionOf(*system_, e));
}

// Drives, couplings and force elements act along or about the joint's own axes, through M's origin.
void Recorder::ExcludeDrives(int joint, double sign, Vec6* F_W) const {
  const auto exclude = [&](int id, double force) {
    Vec3 axis = ConstVec3(system_->data()->xaxis + 3 * id);
    const bool slide = engine_.m->jnt_type[id] == mjJNT_SLIDE;
    if (const std::array<int, 2>& ids = universal_[joint]; ids[0] >= 0) {
      // Its moment has no power about the other axis, to which it may be inclined.
      const ConstVec3 other(system_->data()->xaxis + 3 * (ids[0] == id ? ids[1] : ids[0]));
      const double c = axis.dot(other);
      axis = (axis - c * other) / (1.0 - c * c);
    }
    F_W->segment<3>(slide ? 3 : 0) -= sign * force * axis;
  };
  for (const auto& [row, id] : driven_of_[joint]) {
    exclude(id, system_->DrivenForce(row) + beside_drives_[row]);
  }
  for (const auto& [row, id] : coupled_of_[joint]) {
    exclude(id, system_->J().coeff(row, engine_.m->jnt_dofadr[id]) * system_->force()[row]);
  }
  for (const size_t e : elements_of_[joint]) {
    const ElementPlace& place = engine_.elements[e];
    if (IsOfRoundJoint(engine_, e)) {
      *F_W -= sign * ElementForce(e) * AxisOfRound(place);
    } else {
      exclude(place.joint, ElementForce(e));
    }
  }
}

// [moment; force] of a unit force along a velocity of a ball or free joint: moments about the axes
// of its body, of free joints forces along the world's axes, too.
Vec6 Recorder::AxisOfRound(const ElementPlace& place) const {
  const mjModel& m = *engine_.m;
  const int k = place.dof - m.jnt_dofadr[place.joint];
  if (m.jnt_type[place.joint] == mjJNT_FREE && k < 3) return Vec6::Unit(3 + k);
  Vec6 axis = Vec6::Zero();
  axis.head<3>() = place.turned >= 0
                       ? TurnedAxis(*system_->data(), place)
                       : PoseOf(*system_->data(), m.jnt_bodyid[place.joint]).linear().col(k % 3);
  return axis;
}

Vec6 Recorder::ReactionOf(int j, const std::vector<Pose>& X_WB) const {
  const Joint& joint = engine_.mechanism->joints[j];
  const ReactionPlace& place = places_[j];
  Vec6 F_W;
  if (place.closure >= 0) {
    F_W = ClosureWrench(place.closure);
  } else {
    const ConstVec3 c(system_->data()->subtree_com + 3 * engine_.m->body_rootid[place.body_id]);
    const Vec3 p_WM = X_WB[joint.child] * joint.X_CM.translation();
    F_W = place.sign * ShiftWrench(W_.col(place.body_id), c - p_WM);
    ExcludeDrives(j, place.sign, &F_W);
  }
  const Mat3 R_FW = (X_WB[joint.parent].linear() * joint.X_PF.linear()).transpose();
  Vec6 F_F;
  F_F << R_FW * F_W.head<3>(), R_FW * F_W.tail<3>();
  return F_F;
}

std::vector<BearingLoad> Recorder::LoadsOf(const std::vector<size_t>& elements,
                                           const Loads& loads) {
  std::vector<Pose> X_WB;
  BodyPoses(engine_, *system_->data(), &X_WB);
  system_->EvaluateBodyForces();
  TreeWrenches(loads);
  std::vector<BearingLoad> bears;
  for (const size_t e : elements) {
    const ForceElement& element = engine_.mechanism->elements[e];
    const auto& law = std::get<FrictionLaw>(element.law);
    BearingLoad& load = bears.emplace_back(BearingLoad::Zero());
    if (law.coupling >= 0) {
      const int row = system_->coupling_row(law.coupling);
      load(0, 2) = system_->J().coeff(row, engine_.elements[e].dof) * system_->force()[row];
    } else {
      load = InBearings(*engine_.mechanism, element, ReactionOf(element.joint, X_WB), X_WB);
    }
    load *= system_->engaged(e) * law.coefficient;
  }
  return bears;
}

// Forces of the bearings times the radii of their friction; `reaction`: [moment; force] in F.
BearingLoad Recorder::InBearings(const Mechanism& mechanism, const ForceElement& element,
                                 const Vec6& reaction, const std::vector<Pose>& X_WB) {
  const auto& law = std::get<FrictionLaw>(element.law);
  const Joint& joint = mechanism.joints[static_cast<size_t>(element.joint)];
  const Vec3 moment = reaction.head<3>(), force = reaction.tail<3>();
  BearingLoad load = BearingLoad::Zero();
  if (IsOfBall(joint.kind, element.coordinate)) {
    load.col(0) = law.radius * force;
    return load;
  }
  Vec3 axis = joint.axis;
  if (joint.kind == JointKind::kUniversal && element.coordinate == 1) {
    const Pose X_FM = (X_WB[static_cast<size_t>(joint.parent)] * joint.X_PF).inverse() *
                      X_WB[static_cast<size_t>(joint.child)] * joint.X_CM;
    axis = X_FM.linear() * joint.axis2;
  }
  const double thrust = axis.dot(force);
  load(0, 2) = law.thrust_radius * thrust;
  const Vec3 radial = force - thrust * axis;
  if (law.length == std::numeric_limits<double>::infinity()) {
    load.col(0) = law.radius * radial;
    return load;
  }
  // At a distance of ℓ/2 either way along the axis: their sum is `radial`, and
  // ℓ/2 axis × (one − other) the part of the moment across the axis.
  const Vec3 difference = 2.0 / law.length * moment.cross(axis);
  load.col(0) = 0.5 * law.radius * (radial + difference);
  load.col(1) = 0.5 * law.radius * (radial - difference);
  return load;
}

void Recorder::RecordReactions(const Loads& loads, const std::vector<Pose>& X_WB,
                               Eigen::Ref<Eigen::RowVectorXd> row) {
  TreeWrenches(loads);
  for (size_t j = 0; j < places_.size(); ++j) {
    const Vec6 F = ReactionOf(static_cast<int>(j), X_WB);
    row.segment<3>(columns_(Quantity::kReaction, 6 * j)) = F.tail<3>().transpose();
    row.segment<3>(columns_(Quantity::kReaction, 6 * j + 3)) = F.head<3>().transpose();
  }
}

void Recorder::RecordAudit(const Loads& loads, const VecX& work,
                           Eigen::Ref<Eigen::RowVectorXd> row) {
  const mjModel& m = *engine_.m;
  const ConstraintSystem::Gap gap = system_->LargestGap();
  FindPowers(*system_, loads, &power_);
  const Powers& power = power_;
  const Energies energy = EnergiesOf(*system_);
  // d/dt(kinetic + gravity) = q̇·(M q̈ + bias), M without rotors.
  system_->BodyForces(&work_);
  const double energy_rate =
      ConstVecX(system_->data()->qvel, m.nv).dot(work_) + power.rotors - power.springs;
  const auto drives = static_cast<Eigen::Index>(engine_.mechanism->drives.size());
  const double base = power.driven().tail(power.driven().size() - drives).sum();
  const auto put = [&](Quantity quantity, double value) { row[columns_(quantity)] = value; };
  put(Quantity::kLoopGap, gap.position_m);
  put(Quantity::kLoopTwist, gap.rotation_rad);
  put(Quantity::kInputPower, power.driven().sum() + power.loads() + power.dampers());
  put(Quantity::kEnergyRate, energy_rate);
  put(Quantity::kBasePower, base);
  put(Quantity::kLoadPower, power.loads());
  put(Quantity::kDamperPower, power.dampers());
  put(Quantity::kGravityPower, power.gravity);
  put(Quantity::kSpringPower, power.springs);
  put(Quantity::kKineticEnergy, energy.kinetic);
  put(Quantity::kGravityEnergy, energy.gravity);
  put(Quantity::kSpringEnergy, energy.springs);
  if (work.size() > 0) RecordWork(work, row);
}

// Works of drives, prescribed joints, loads and dampers follow each other (WorkChannels).
void Recorder::RecordWork(const VecX& work, Eigen::Ref<Eigen::RowVectorXd> row) const {
  const size_t drives = engine_.mechanism->drives.size();
  const size_t bases = engine_.mechanism->prescribed.size();
  MBV_DEMAND(static_cast<size_t>(work.size()) == drives + bases + 2, work.size());
  Eigen::Index next = 0;
  for (size_t d = 0; d < drives; ++d) row[columns_(Quantity::kWork, d)] = work[next++];
  for (size_t p = 0; p < bases; ++p) row[columns_(Quantity::kBaseWork, p)] = work[next++];
  row[columns_(Quantity::kLoadWork)] = work[next++];
  row[columns_(Quantity::kDamperWork)] = work[next];
}

}  // namespace mbv::simulation
