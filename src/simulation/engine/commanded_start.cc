// The start of a commanded motion, from MuJoCo's home pose.
//
// Positions of the drives alone do not say in which assembly the loops are closed: where a singular
// pose lies between home and the start, the drives that the commanded outputs need lead from home
// somewhere else. The commands themselves lead there: with the closures r and the commanded
// coordinates c(q), both by MuJoCo's own kinematics,
//   r(q) = 0,  c(q) = c_home + s (c_start − c_home),  s = 0 … 1                               (1)
// is followed by Newton, and then the loops are closed with the drive positions.
//
//   O the output's frame, R its reference frame: p = R_WRᵀ (p_WO − p_WR),
//   ṗ = R_WRᵀ (v_O − v of the point of R's body at O),  ω = R_WRᵀ (ω_O − ω_R)                 (2)
//   of R_RO = Rz(ψ) Ry(θ) Rx(φ), e = Rz x, e2 = Rz y:
//   φ̇ = e·ω / cos θ,  θ̇ = e2·ω,  ψ̇ = ω_z + φ̇ sin θ                                            (3)
//   of a joint with unit twists S in F's axes, O = M and R = F: [ω; ṗ] = S q̇                  (4)
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mechanism/joint_pose.h"
#include "simulation/engine/session.h"

namespace mbv::simulation {
namespace {

constexpr int kMostNewton = 15;
// In the units of ConstraintSystem::ScaledJ(), as ClosureSolver's.
constexpr double kSquaredIsNothing = 1e-8, kIsClosed = 1e-10, kDependent = 1e-9;
// What one step of the way may move: poses of other assemblies are farther.
constexpr double kFarthestWay = 0.2;
constexpr double kShortestPart = 1e-4;  // of the way
// Solutions of the same assembly differ by less, in characteristic lengths.
constexpr double kSamePlace = 1e-6;

// Other coordinates are the drives' own.
bool IsPassive(const Coordinate& coordinate) {
  return coordinate.kind == Coordinate::Kind::kOutput ||
         coordinate.kind == Coordinate::Kind::kJoint;
}

bool CommandsPassive(const Motion& motion) {
  return std::ranges::any_of(motion.commands, [](const Command& command) {
    return std::ranges::any_of(
        command.terms, [](const Command::Term& term) { return IsPassive(term.coordinate); });
  });
}

// Closures, couplings and commands at the data's position.
class CommandRows {
 public:
  CommandRows(const Motion& motion, ConstraintSystem* system)
      : system_(*system), engine_(system->engine()), commands_(motion.commands) {
    const auto drives = static_cast<int>(engine_.mechanism->drives.size());
    std::vector<bool> commanded(engine_.mechanism->prescribed.size(), false);
    for (const Command& command : commands_) {
      for (const Command::Term& term : command.terms) {
        if (term.coordinate.kind != Coordinate::Kind::kPrescribed) continue;
        commanded[static_cast<size_t>(term.coordinate.index)] = true;
      }
      const double target = Evaluate(command.profile, 0.0).value;
      targets_.push_back(target);
      // The turn of an output's angle is the command's; joints turn from home.
      const bool alone = command.terms.size() == 1;
      for (const Command::Term& term : command.terms) {
        const bool joint = term.coordinate.kind == Coordinate::Kind::kJoint;
        near_.push_back(joint   ? HomeValue(*engine_.mechanism, term.coordinate)
                        : alone ? target / term.factor
                                : 0.0);
      }
    }
    for (size_t p = 0; p < commanded.size(); ++p) {
      if (!commanded[p]) resting_.push_back(drives + static_cast<int>(p));
    }
    const auto closures = system_.closure_rows();
    const auto rows = closures + static_cast<Eigen::Index>(commands_.size() + resting_.size());
    unit_.setOnes(rows);
    unit_.head(closures) = system_.row_unit().head(closures);
    residual_.setZero(rows);
    J_.setZero(rows, system_.nv());
  }

  // Commanded coordinates at the start of the motion; resting ones stay where they are.
  [[nodiscard]] VecX Targets() const {
    VecX targets(commands());
    targets.head(static_cast<Eigen::Index>(targets_.size())) =
        Eigen::Map<const VecX>(targets_.data(), static_cast<Eigen::Index>(targets_.size()));
    for (size_t k = 0; k < resting_.size(); ++k) {
      targets[static_cast<Eigen::Index>(targets_.size() + k)] =
          engine_.driven[static_cast<size_t>(resting_[k])].home;
    }
    return targets;
  }

  // Everything at the data's position: angles within half a turn of those of the last call.
  void EvaluateHere() {
    system_.EvaluatePosition();
    BodyPoses(engine_, *system_.data(), &X_WB_);
    const auto closures = system_.closure_rows();
    residual_.head(closures) = system_.residual().head(closures);
    J_.topRows(closures) = MatX(system_.J().topRows(closures));
    auto row = static_cast<Eigen::Index>(closures);
    size_t term_index = 0;
    for (const Command& command : commands_) {
      residual_[row] = 0.0;
      J_.row(row).setZero();
      bool angle = false;
      for (const Command::Term& term : command.terms) {
        const Value value = ValueOf(term.coordinate, near_[term_index]);
        if (IsPassive(term.coordinate)) near_[term_index] = value.position;
        ++term_index;
        residual_[row] += term.factor * value.position;
        J_.row(row) += term.factor * value.gradient.transpose();
        angle = angle || !IsLength(*engine_.mechanism, term.coordinate);
      }
      unit_[row++] = angle ? 1.0 : system_.length();
    }
    for (const int k : resting_) {
      residual_[row] = PositionOf(k);
      J_.row(row) = system_.DrivenJacobian(k).transpose();
      unit_[row++] = system_.dof_unit()[engine_.driven[static_cast<size_t>(k)].dof];
    }
  }

  [[nodiscard]] Eigen::Index commands() const { return residual_.size() - system_.closure_rows(); }
  /// Per term of every command, what says in which turn an angle is.
  [[nodiscard]] const std::vector<double>& turns() const { return near_; }
  void TakeTurns(const std::vector<double>& turns) { near_ = turns; }
  /// Of the closures; of the commands, the coordinates themselves.
  [[nodiscard]] const VecX& values() const { return residual_; }
  [[nodiscard]] const VecX& unit() const { return unit_; }
  [[nodiscard]] MatX ScaledJ() const {
    return unit_.cwiseInverse().asDiagonal() * J_ * system_.dof_unit().asDiagonal();
  }
  [[nodiscard]] double PositionOf(int driven) const {
    const DrivenPlace& place = engine_.driven[static_cast<size_t>(driven)];
    const mjData& d = *system_.data();
    return place.is_tendon ? d.ten_length[place.object]
                           : d.qpos[engine_.m->jnt_qposadr[place.object]];
  }

 private:
  struct Value {
    double position = kNan;
    VecX gradient;
  };
  struct FrameRates {
    RowMajor J_v, J_w;
  };

  // Velocity of a point and angular velocity of a mechanism body, in world axes, by the velocities.
  FrameRates RatesOf(int body, const Vec3& p_W) const {
    const Mechanism& mechanism = *engine_.mechanism;
    const mjModel& m = *engine_.m;
    FrameRates rates{RowMajor::Zero(3, m.nv), RowMajor::Zero(3, m.nv)};
    const auto take = [&](int id) {
      mj_jac(&m, system_.data(), rates.J_v.data(), rates.J_w.data(), p_W.data(), id);
    };
    if (body == 0) return rates;
    if (engine_.PlannedOf(body) >= 0) {
      take(engine_.body_id[static_cast<size_t>(engine_.PlannedOf(body))]);
      return rates;
    }
    for (size_t k = 0; k < mechanism.tree_joints.size(); ++k) {
      const int j = mechanism.tree_joints[k];
      const Joint& joint = mechanism.joints[static_cast<size_t>(j)];
      const bool reversed = mechanism.tree_reversed[k];
      if ((reversed ? joint.parent : joint.child) != body) continue;
      const std::vector<int>& ids = engine_.joint_ids[static_cast<size_t>(j)];
      if (ids.empty()) return RatesOf(reversed ? joint.child : joint.parent, p_W);
      // Merged into the body that it carries: the joints between both do not move it.
      const int id = m.jnt_bodyid[ids.back()];
      take(id);
      for (int i = ids.back() + 1; i < m.body_jntadr[id] + m.body_jntnum[id]; ++i) {
        rates.J_v.col(m.jnt_dofadr[i]).setZero();
        rates.J_w.col(m.jnt_dofadr[i]).setZero();
      }
      return rates;
    }
    return rates;
  }

  // [ω; ṗ] of frame O of a body against frame R of another, in R's axes, by the velocities: (2).
  RowMajor RelativeRates(int reference_body, const Pose& X_WR, int body, const Pose& X_WO) const {
    const FrameRates of = RatesOf(body, X_WO.translation());
    const FrameRates from = RatesOf(reference_body, X_WO.translation());
    const Mat3 R_RW = X_WR.linear().transpose();
    RowMajor J(6, of.J_v.cols());
    J << R_RW * (of.J_w - from.J_w), R_RW * (of.J_v - from.J_v);
    return J;
  }

  // (2), (3)
  Value OutputValue(const Output& output, int component, double near) const {
    const Pose X_WR = X_WB_[static_cast<size_t>(output.reference_body)] * output.X_RbR;
    const Pose X_WO = X_WB_[static_cast<size_t>(output.body)] * output.X_BO;
    const Pose X_RO = X_WR.inverse() * X_WO;
    const RowMajor J = RelativeRates(output.reference_body, X_WR, output.body, X_WO);
    if (component < 3) return {X_RO.translation()[component], J.row(3 + component).transpose()};
    const Mat3 R = X_RO.linear();
    const double cosine = std::hypot(R(0, 0), R(1, 0)), sine = -R(2, 0);
    const Vec3 e(R(0, 0) / cosine, R(1, 0) / cosine, 0.0), e2 = Vec3::UnitZ().cross(e);
    const Vec3 roll = e / cosine, yaw = Vec3::UnitZ() + sine * roll;
    const Vec3& axis = component == 3 ? roll : component == 4 ? e2 : yaw;
    const double angle = component == 3   ? std::atan2(R(2, 1), R(2, 2))
                         : component == 4 ? std::atan2(sine, cosine)
                                          : std::atan2(R(1, 0), R(0, 0));
    return {near + std::remainder(angle - near, 2.0 * std::numbers::pi),
            (axis.transpose() * J.topRows<3>()).transpose()};
  }

  // (4)
  Value JointValue(const Joint& joint, int coordinate, double near) const {
    const Pose X_WF = X_WB_[static_cast<size_t>(joint.parent)] * joint.X_PF;
    const Pose X_WM = X_WB_[static_cast<size_t>(joint.child)] * joint.X_CM;
    const Pose X_FM = X_WF.inverse() * X_WM;
    const RowMajor J = RelativeRates(joint.parent, X_WF, joint.child, X_WM);
    const JointTwists S = UnitTwists(joint, Mat3::Identity(), X_FM.linear());
    const MatX rates = S.colPivHouseholderQr().solve(MatX(J));
    double position = CoordinatesOf(joint, X_FM)[static_cast<size_t>(coordinate)];
    if (!IsLength(joint.kind, coordinate)) {
      position = near + std::remainder(position - near, 2.0 * std::numbers::pi);
    }
    return {position, rates.row(coordinate).transpose()};
  }

  Value ValueOf(const Coordinate& coordinate, double near) const {
    const Mechanism& mechanism = *engine_.mechanism;
    if (coordinate.kind == Coordinate::Kind::kOutput) {
      return OutputValue(mechanism.outputs[static_cast<size_t>(coordinate.index)],
                         coordinate.component, near);
    }
    if (coordinate.kind == Coordinate::Kind::kJoint) {
      return JointValue(mechanism.joints[static_cast<size_t>(coordinate.index)],
                        coordinate.component, near);
    }
    const bool base = coordinate.kind == Coordinate::Kind::kPrescribed;
    const int k = coordinate.index + (base ? static_cast<int>(mechanism.drives.size()) : 0);
    return {PositionOf(k), system_.DrivenJacobian(k)};
  }

  ConstraintSystem& system_;
  const EngineModel& engine_;
  const std::vector<Command>& commands_;
  std::vector<double> targets_, near_;  // per command; per term
  std::vector<int> resting_;            // prescribed joints without a command, as driven
  std::vector<Pose> X_WB_;
  VecX residual_, unit_;
  MatX J_;
};

// Brings the data from home along (1). False, at home, where Newton does not arrive.
class CommandWalk {
 public:
  CommandWalk(const Motion& motion, ConstraintSystem* system)
      : system_(*system), rows_(motion, system) {}

  bool Arrive() {
    const auto nq = system_.engine().m->nq;
    Eigen::Map<VecX> qpos(system_.data()->qpos, nq);
    const VecX home = qpos;
    rows_.EvaluateHere();
    const VecX from = rows_.values().tail(rows_.commands()), to = rows_.Targets();
    VecX reached = qpos;
    std::vector<double> turns = rows_.turns();
    double s = 0.0, part = 0.25;
    while (s < 1.0) {
      const double next = std::min(1.0, s + part);
      if (Close(from + next * (to - from))) {
        s = next;
        part *= 1.5;
        reached = qpos;
        turns = rows_.turns();
        continue;
      }
      qpos = reached;
      rows_.TakeTurns(turns);
      part *= 0.5;
      if (part >= kShortestPart) continue;
      qpos = home;
      return false;
    }
    return true;
  }

  // Of everything driven.
  [[nodiscard]] VecX DrivenPositions() const {
    VecX positions(static_cast<Eigen::Index>(system_.engine().driven.size()));
    for (int k = 0; k < positions.size(); ++k) positions[k] = rows_.PositionOf(k);
    return positions;
  }

 private:
  // Newton; false where it does not converge or goes far.
  bool Close(const VecX& commanded) {
    double size = kNan, moved = 0.0;
    for (int i = 0; i < kMostNewton; ++i) {
      rows_.EvaluateHere();
      VecX residual = rows_.values();
      residual.tail(commanded.size()) -= commanded;
      residual = residual.cwiseQuotient(rows_.unit());
      const double open = residual.lpNorm<Eigen::Infinity>();
      if (i > 0 && size < kSquaredIsNothing && open < kIsClosed + system_.Rounding()) return true;
      const MatX J = rows_.ScaledJ();
      if (!J.allFinite()) return false;
      Eigen::CompleteOrthogonalDecomposition<MatX> cod;
      cod.setThreshold(kDependent);
      cod.compute(J);
      VecX step = -cod.solve(residual);
      size = step.lpNorm<Eigen::Infinity>();
      moved += size;
      if (!(moved < kFarthestWay)) return false;
      step = step.cwiseProduct(system_.dof_unit());
      mj_integratePos(system_.engine().m.get(), system_.data()->qpos, step.data(), 1.0);
    }
    return false;
  }

  ConstraintSystem& system_;
  CommandRows rows_;
};

// Both ends of every joint at the data's position: what spins about its own line stays.
std::vector<Vec3> JointPlaces(const ConstraintSystem& system) {
  const EngineModel& engine = system.engine();
  mj_kinematics(engine.m.get(), system.data());
  std::vector<Pose> X_WB;
  BodyPoses(engine, *system.data(), &X_WB);
  std::vector<Vec3> places;
  for (const Joint& joint : engine.mechanism->joints) {
    places.push_back(X_WB[static_cast<size_t>(joint.parent)] * joint.X_PF.translation());
    places.push_back(X_WB[static_cast<size_t>(joint.child)] * joint.X_CM.translation());
  }
  return places;
}

// Where the drive positions alone would have gone from home; empty: to the same place.
std::string WhereDrivesLead(const std::vector<Vec3>& places, const DrivenSample& first,
                            ConstraintSystem* system, ClosureSolver* solver) {
  const EngineModel& engine = system->engine();
  Eigen::Map<VecX> qpos(system->data()->qpos, engine.m->nq);
  qpos = Eigen::Map<const VecX>(engine.m->qpos0, engine.m->nq);
  if (const RunSummary summary = solver->Follow(HomePositions(engine), first.position);
      !summary.ok()) {
    return "the drive positions alone do not lead there from home";
  }
  const std::vector<Vec3> elsewhere = JointPlaces(*system);
  double most = 0.0;
  size_t at = 0;
  for (size_t i = 0; i < places.size(); ++i) {
    const double distance = (places[i] - elsewhere[i]).norm();
    if (distance > most) most = distance, at = i;
  }
  if (most <= kSamePlace * system->length()) return "";
  return fmt::format(
      "the drive positions alone lead from home into another assembly, with {} {:.3g} m away",
      engine.mechanism->joints[at / 2].name, most);
}

}  // namespace

RunSummary CloseAtStart(const Motion& motion, const DrivenSample& first, ConstraintSystem* system,
                        ClosureSolver* solver, std::vector<std::string>* notes) {
  const VecX home = HomePositions(system->engine());
  if (!CommandsPassive(motion)) return solver->Follow(home, first.position);
  CommandWalk walk(motion, system);
  if (!walk.Arrive()) return solver->Follow(home, first.position);
  if (RunSummary summary = solver->Follow(walk.DrivenPositions(), first.position); !summary.ok()) {
    return summary;
  }
  Eigen::Map<VecX> qpos(system->data()->qpos, system->engine().m->nq);
  const VecX start = qpos;
  const std::string elsewhere = WhereDrivesLead(JointPlaces(*system), first, system, solver);
  if (!elsewhere.empty()) {
    notes->push_back(
        "the simulation starts in the assembly to which the commanded coordinates lead "
        "from home; " +
        elsewhere);
  }
  qpos = start;
  return solver->Close(first.position);
}

RunSummary FindCommandedStart(const Motion& motion, const DrivenSample& first, EngineModel* engine,
                              EngineState* start, std::vector<std::string>* notes) {
  PrescribeDrives(true, engine);
  const DataHandle data = MakeData(*engine->m);
  ConstraintSystem system(*engine, data.get());
  ClosureSolver solver(&system);
  if (RunSummary summary = CloseAtStart(motion, first, &system, &solver, notes); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  SpinStopper spins(&system);
  if (RunSummary summary = spins.TakeLeastTurns(&solver, first); !summary.ok()) {
    summary.time_s = 0.0;
    return summary;
  }
  solver.SolveVelocity(first.velocity);
  spins.StopVelocity();
  start->qpos = Eigen::Map<const VecX>(data->qpos, engine->m->nq);
  start->qvel = Eigen::Map<const VecX>(data->qvel, engine->m->nv);
  return RunSummary::Done();
}

RunSummary PutAtCommandedStart(Session* s, const DrivenSample& first) {
  std::copy(s->start.qpos.begin(), s->start.qpos.end(), s->data->qpos);
  std::copy(s->start.qvel.begin(), s->start.qvel.end(), s->data->qvel);
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
