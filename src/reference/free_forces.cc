// Forces of a free motion, and friction by the joints' loads: the part of FreeDynamics that solves
// for what transmits.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/free_dynamics.h"

namespace mbv::internal {
namespace {

// Columns that depend on others to this share do.
constexpr double kDependentForces = 1e-9;
// Sparse solutions miss no more of the wrenches than this share.
constexpr double kBalanced = 1e-9;
// A smaller share of a self-stress that a load takes is round-off.
constexpr double kBears = 1e-9;
// Passes that find the loads of what rests, and the change below which round-off may end them.
constexpr int kMostLoadPasses = 500;
constexpr double kStalledLoads = 1e-12;

}  // namespace

// The forces with columns · force = wrenches as well as can be; LeastForces of them.
VecX FreeDynamics::ForceRows::Solve(const VecX& scaled_wrenches) const {
  if (rows.size() == 0) return VecX();
  if (sparse != nullptr) {
    const VecX all = sparse->LeastNorm(scaled_wrenches), force = all.head(rows.size());
    const VecX missed = scaled_wrenches - columns.leftCols(rows.size()) * force;
    if (missed.norm() <= kBalanced * scaled_wrenches.norm()) return force.cwiseProduct(scale);
    ForceRows other = *this;
    other.FactorDense();
    return other.Solve(scaled_wrenches);
  }
  VecX force = factors.solve(scaled_wrenches);
  force += factors.solve(VecX(scaled_wrenches - dense * force));  // refinement
  if (self_stress.cols() > 0) LeastForces().Take(self_stress, first_driven, &force);
  return force.cwiseProduct(scale);
}

void FreeDynamics::ForceRows::FactorDense() {
  sparse = nullptr;
  dense = columns.leftCols(rows.size());
  factors.setThreshold(kDependentForces);
  factors.compute(dense);
  const Eigen::Index rank = factors.rank();
  self_stress.resize(rows.size(), 0);
  if (rank == rows.size()) return;
  const MatX Q = OrthogonalFactor(Eigen::ColPivHouseholderQR<MatX>(dense.transpose()));
  self_stress = Q.rightCols(rows.size() - rank);
}

FreeDynamics::ForceRows FreeDynamics::ForceRowsAt(const BodyStates& states, bool held) {
  ForceRows at;
  RowSet& rows = at.rows;
  AddReactionRows(mechanism_, states, &rows);
  at.first_driven = rows.size();
  for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
    if (motion_.FindForce(static_cast<int>(d)) >= 0) continue;
    rows.Add(DriveRow(mechanism_, mechanism_.drives[d], states),
             PositionUnit(mechanism_, mechanism_.drives[d]) == "rad");
  }
  at.first_prescribed = rows.size();
  for (const Prescribed& prescribed : mechanism_.prescribed) {
    const Joint& joint = mechanism_.joints[prescribed.joint];
    rows.Add(JointCoordinateRow(joint, 0, states), !IsLength(joint.kind, 0));
  }
  at.first_held = rows.size();
  const std::vector<ScalarRow> elements = ElementRows(mechanism_, states);
  for (const size_t e : held ? phase_.held : std::vector<size_t>{}) {
    rows.Add(elements[e], !ActsOnLength(mechanism_, mechanism_.elements[e]));
  }
  at.scale.resize(rows.size());
  for (int i = 0; i < rows.size(); ++i) at.scale[i] = scales_.RowScale(rows.angular[i]);
  if (rows.size() == 0) return at;
  // What is held moves no more, so that other rows would complete them.
  if (!FactorSparse(states, rows.size() > at.first_held, &at)) at.FactorDense();
  return at;
}

bool FreeDynamics::FactorSparse(const BodyStates& states, bool held, ForceRows* at) {
  RowSet all = at->rows;
  for (const Spin& spin : spins_) all.Add(IdleRow(spin, states), true);
  for (const InitialValue& value : motion_.initial) {
    all.Add(CoordinateRow(mechanism_, value.coordinate, states),
            !IsLength(mechanism_, value.coordinate));
  }
  std::vector<int> columns(static_cast<size_t>(all.size()));
  std::iota(columns.begin(), columns.end(), 0);
  scales_.MakeColumns(all, columns, &at->columns);
  if (held) return false;
  if (!forces_.Factor(at->columns, 0.0)) {
    forces_.Reset();
    return false;
  }
  const VecX stress = RandomSelfStress(forces_, at->columns);
  const double size = std::sqrt(static_cast<double>(stress.size()));
  if (!((at->columns * stress).norm() <= kBalanced * size)) return false;
  if (stress.norm() > kBalanced * size) {
    if (SelfStressReaches(stress, at->first_driven)) return false;
    at->self_stress = stress.head(at->rows.size());
  }
  at->sparse = &forces_;
  return true;
}

std::vector<int> FreeDynamics::SignsAt(const BodyStates& states) const {
  std::vector<int> sign = phase_.sign;
  if (sign.empty()) sign.assign(mechanism_.elements.size(), 0);  // before the first phase
  if (phase_.prescribed.empty()) return sign;
  std::vector<int> signs;
  FrictionDirections(mechanism_, states, motion_.duration_s, &signs);
  for (const size_t e : phase_.prescribed) sign[e] = signs[e];
  return sign;
}

// A load that a self-stress changes is not a load that friction could follow.
RunSummary FreeDynamics::CheckLoadsUnique(const ForceRows& at, const BodyStates& states) const {
  for (Eigen::Index k = 0; k < at.self_stress.cols(); ++k) {
    const VecX force = at.self_stress.col(k).cwiseProduct(at.scale);
    MatX reactions;
    (void)FillReactions(mechanism_, states, at.rows, force, &reactions);
    for (const size_t e : loaded_) {
      const BearingLoad load = LoadOf(mechanism_, e, states, reactions);
      if (SizeOf(load) > kBears * force.cwiseAbs().maxCoeff()) return LoadShared(mechanism_, e);
    }
  }
  return RunSummary::Done();
}

MatX FreeDynamics::ReactionsBy(const ForceRows& at, const BodyStates& states,
                               const VecX& wrenches) const {
  MatX reactions;
  (void)FillReactions(mechanism_, states, at.rows, at.Solve(body_scale_.cwiseProduct(wrenches)),
                      &reactions);
  return reactions;
}

// (5), by states without friction by load.
LoadSystem FreeDynamics::LoadsAt(double t_s, const ForceRows& at, const BodyStates& states,
                                 const MatX& R, MatX* along) {
  const std::vector<int> sign = SignsAt(states);
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, states);
  const MatX without = ReactionsBy(at, states, NeededWrenches(t_s, states));
  LoadSystem system;
  std::vector<MatX> unit;  // reactions per unit of each
  along->resize(rest_.f.size(), static_cast<Eigen::Index>(loaded_.size()));
  RestSystem push = rest_;
  push.d.setZero();
  for (size_t d = 0; d < loaded_.size(); ++d) {
    const size_t e = loaded_[d];
    const VecX gradient = GradientOf(rows[e], mechanism_.bodies.size());
    along->col(static_cast<Eigen::Index>(d)) = push.f = R.transpose() * gradient;
    const VecX a = phase_.held.empty() ? VecX(rest_.H.ldlt().solve(push.f)) : HeldMotion(push);
    unit.push_back(ReactionsBy(at, states, Momenta(mechanism_, states, R * a) - gradient));
    system.Add(mechanism_, e, states, sign[e], LoadOf(mechanism_, e, states, without));
  }
  for (const size_t e : loaded_) {
    std::vector<BearingLoad>& row = system.P.emplace_back();
    for (const MatX& of : unit) row.push_back(LoadOf(mechanism_, e, states, of));
  }
  return system;
}

RunSummary FreeDynamics::AddLoadFriction(double t_s, const BodyStates& states, const MatX& R,
                                         const VecX& A_p) {
  const ForceRows loops = ForceRowsAt(states, false);
  RunSummary summary = CheckLoadsUnique(loops, states);
  MatX along;
  LoadSystem system;
  std::vector<BearingLoad> v;
  if (summary.ok()) {
    const bool held = !phase_.held.empty();
    system = LoadsAt(t_s, held ? ForceRowsAt(states, true) : loops, states, R, &along);
    summary = system.Solve(&v);
    if (!summary.ok()) summary.where = mechanism_.elements[loaded_[system.MostRaised()]].name;
  }
  const RestSystem without = rest_;
  const auto take = [&] { TakeLoads(system, along, without, v); };
  if (summary.ok()) take();
  if (summary.ok() && !phase_.held.empty()) {
    summary = FollowHeld(t_s, loops, states, R, A_p, take, &v);
  }
  summary.time_s = t_s;
  return summary;
}

// Friction by loads v among the forces of what slides and the bounds of what rests.
void FreeDynamics::TakeLoads(const LoadSystem& system, const MatX& along, const RestSystem& without,
                             const std::vector<BearingLoad>& v) {
  load_friction_.setZero(static_cast<Eigen::Index>(mechanism_.elements.size()));
  load_force_ = load_friction_;
  rest_.f = without.f;
  for (size_t d = 0; d < loaded_.size(); ++d) {
    const auto e = static_cast<Eigen::Index>(loaded_[d]);
    load_friction_[e] = system.Size(d, v[d]);
    load_force_[e] = system.Force(d, v[d]);
    rest_.f += load_force_[e] * along.col(static_cast<Eigen::Index>(d));
  }
  for (size_t k = 0; k < phase_.held.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double by_load = load_friction_[static_cast<Eigen::Index>(phase_.held[k])];
    // Where nothing bears, any force moves it.
    rest_.most[at] = std::max(without.most[at] + by_load, std::numeric_limits<double>::min());
  }
}

// What several joints at rest share, their loads depend on: by the shares of LeastShares(), until
// these and the loads agree.
RunSummary FreeDynamics::FollowHeld(double t_s, const ForceRows& loops, const BodyStates& states,
                                    const MatX& R, const VecX& A_p,
                                    const std::function<void()>& take,
                                    std::vector<BearingLoad>* v) {
  BodyStates moved = states;
  double last = std::numeric_limits<double>::infinity();
  for (int pass = 0; pass < kMostLoadPasses; ++pass) {
    Unstack(A_p + R * MotionBy(rest_.f), &moved.A_WB);
    const VecX share = LeastShares(rest_);
    if (!share.allFinite()) return RunSummary::Done();  // as LoadRatio() says
    VecX wrenches = NeededWrenches(t_s, moved) - LoadFrictionWrenches(moved);
    wrenches -= HeldRows(moved).gradients.transpose() * share;
    const MatX reactions = ReactionsBy(loops, moved, wrenches);
    double change = 0.0, most = 0.0;
    for (size_t d = 0; d < loaded_.size(); ++d) {
      const BearingLoad next = LoadOf(mechanism_, loaded_[d], moved, reactions);
      change = std::max(change, std::abs(SizeOf(next) - SizeOf((*v)[d])));
      most = std::max(most, SizeOf(next));
      (*v)[d] = next;
    }
    take();
    if (change <= 8.0 * kEps * most || (change >= last && change <= kStalledLoads * most)) {
      return RunSummary::Done();
    }
    last = change;
  }
  const std::string& name = mechanism_.elements[phase_.held.front()].name;
  return {.stop = Stop::kSingular,
          .message = fmt::format("the loads of joints at rest beside '{}' and the friction that "
                                 "holds them raise each other (by {:.3g} N per pass)",
                                 name, last),
          .where = name,
          .amount = last,
          .unit = std::string("N"),
          .names_where = true};
}

VecX FreeDynamics::NeededWrenches(double t_s, const BodyStates& states) const {
  std::vector<Vec6> required, drives(mechanism_.bodies.size(), Vec6::Zero());
  RequiredWrenches(mechanism_, states, command_.loads, SignsAt(states), &required);
  AddDriveForces(t_s, states, &drives);
  return Stack(required) - Stack(drives);
}

VecX FreeDynamics::LoadFrictionWrenches(const BodyStates& states) const {
  VecX wrenches = VecX::Zero(size_);
  if (loaded_.empty()) return wrenches;
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, states);
  for (const size_t e : loaded_) {
    wrenches +=
        load_force_[static_cast<Eigen::Index>(e)] * GradientOf(rows[e], mechanism_.bodies.size());
  }
  return wrenches;
}

VecX FreeDynamics::GivenOr(double t_s, const BodyStates& states, const VecX& solved) const {
  VecX force(static_cast<Eigen::Index>(mechanism_.drives.size()));
  Eigen::Index next = 0;
  for (Eigen::Index d = 0; d < force.size(); ++d) {
    const int given = motion_.FindForce(static_cast<int>(d));
    force[d] =
        given >= 0 ? ForceAtStates(mechanism_, states, motion_.forces[given], t_s) : solved[next++];
  }
  return force;
}

void FreeDynamics::SolveForces(double t_s, ReferenceSample* sample) {
  const BodyStates& states = sample->states;
  VecX held = VecX::Zero(static_cast<Eigen::Index>(phase_.held.size()));
  if (!loaded_.empty() || held.size() > 0) {  // loads and shares of this very state
    BodyStates again = states;
    (void)Accelerate(t_s, &again);
    sample->load_friction = load_friction_;
    sample->load_force = load_force_;
    if (held.size() > 0) held = LeastShares(rest_);
  }
  EvaluateMotion(motion_, t_s, &command_);
  const bool open = !held.allFinite();  // too many ways to share: least norm
  const ForceRows at = ForceRowsAt(states, open);
  sample->friction_signs = SignsAt(states);
  VecX wrenches = NeededWrenches(t_s, states) - LoadFrictionWrenches(states);
  if (!open && held.size() > 0) wrenches -= HeldRows(states).gradients.transpose() * held;
  const VecX force = at.Solve(body_scale_.cwiseProduct(wrenches));
  const int drives = at.first_prescribed - at.first_driven;
  MBV_DEMAND(
      FillReactions(mechanism_, states, at.rows, force, &sample->reactions) == at.first_driven,
      at.first_driven);
  sample->drive_force = GivenOr(t_s, states, force.segment(at.first_driven, drives));
  sample->prescribed_force =
      force.segment(at.first_prescribed, at.first_held - at.first_prescribed);
  FindPrescribedBands(at, sample);
}

// Friction at rest is what the held state needs: nothing is open but for what commands hold.
void FreeDynamics::FindPrescribedBands(const ForceRows& at, ReferenceSample* sample) const {
  sample->drive_band = VecX::Zero(sample->drive_force.size());
  sample->prescribed_band = VecX::Zero(sample->prescribed_force.size());
  if (phase_.prescribed.empty()) return;
  std::vector<int> held_too = sample->friction_signs;
  for (const size_t e : phase_.held) held_too[e] = 1;
  const int drives = at.first_prescribed - at.first_driven;
  for (const VecX& wrenches :
       RestingWrenches(mechanism_, sample->states, held_too, sample->load_friction)) {
    VecX part = at.Solve(body_scale_.cwiseProduct(wrenches)).cwiseQuotient(at.scale).cwiseAbs();
    const double least = kBears * part.maxCoeff();
    part = (part.array() > least).select(part, 0.0);
    part.array() *= at.scale.array();
    Eigen::Index next = at.first_driven;
    for (Eigen::Index d = 0; d < sample->drive_band.size(); ++d) {
      if (motion_.FindForce(static_cast<int>(d)) < 0) sample->drive_band[d] += part[next++];
    }
    MBV_DEMAND(next == at.first_driven + drives, next);
    sample->prescribed_band +=
        part.segment(at.first_prescribed, at.first_held - at.first_prescribed);
  }
}

void FreeDynamics::Forces(double t_s, ReferenceSample* sample) {
  SolveForces(t_s, sample);
  AuditSample(mechanism_, command_.loads, sample);
}

VecX FreeDynamics::WorkRates(double t_s, const BodyStates& states) {
  ReferenceSample sample;
  sample.states = states;
  if (motion_.commands.empty() && mechanism_.prescribed.empty() && loaded_.empty()) {
    EvaluateMotion(motion_, t_s, &command_);
    sample.drive_force =
        GivenOr(t_s, states, VecX::Zero(static_cast<Eigen::Index>(mechanism_.drives.size())));
  } else {
    SolveForces(t_s, &sample);
  }
  VecX rates(works());
  Eigen::Index next = 0;
  const auto put = [&](double force, const ScalarRow& row) {
    rates[next++] = force * RateOf(row, states.V_WB);
  };
  for (size_t d = 0; d < mechanism_.drives.size(); ++d) {
    put(sample.drive_force[static_cast<Eigen::Index>(d)],
        DriveRow(mechanism_, mechanism_.drives[d], states));
  }
  for (size_t p = 0; p < mechanism_.prescribed.size(); ++p) {
    put(sample.prescribed_force[static_cast<Eigen::Index>(p)],
        JointCoordinateRow(mechanism_.joints[mechanism_.prescribed[p].joint], 0, states));
  }
  const Powers power = PowersOf(mechanism_, states, command_.loads, SignsAt(states));
  rates[next++] = power.loads;
  rates[next++] = power.dampers - LoadFrictionLoss(mechanism_, sample);
  return rates;
}

}  // namespace mbv::internal
