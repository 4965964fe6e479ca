// The integrator's constraint stage: forces of the closed loops, of dry friction and of what
// follows accelerations, at a given state.
#include <algorithm>
#include <utility>

#include "mjcf/mjcf.h"
#include "simulation/integrator.h"
#include "simulation/load_friction.h"

namespace mbv::simulation {
namespace {

// Softness R of a constraint row relative to MuJoCo's own at its strongest impedance, 0.9999. The
// force error that it leaves falls with R, the rounding error of the force rises with 1/R; in
// between lie four decades where neither is seen.
constexpr double kSoftness = 1e-5;
// How far off the acceleration is that the solver starts from [m/s², rad/s²].
constexpr double kNudge = 1e-9;
// What MuJoCo's solver takes to decide which rows of friction give way.
constexpr int kFrictionIterations = 100;
// A row that gives way anyway is put so many times as far off as its force could accelerate it.
constexpr double kBeyond = 10.0;
constexpr double kUnbounded = 1e20;
// A smaller share of what its force could do to a row is no acceleration.
constexpr double kMoves = 1e-6;
// Forces that follow accelerations have settled when a pass changes them by less than this share of
// the largest; where round-off keeps that away, when passes no longer help below the second.
constexpr double kSettledForces = 4e-16, kStalledForces = 1e-11;
constexpr int kMostSettling = 400;
}  // namespace

void Integrator::SolveSmooth() {
  mj_fwdAcceleration(m_, d_);
  // MuJoCo starts from here where that is cheaper than the warm start: as far off as that one.
  if (d_->nefc > 0) Eigen::Map<VecX>(d_->qacc_smooth, m_->nv).array() += kNudge;
}

// Forces by the accelerations and loads just found, until they are those that MuJoCo finds.
void Integrator::Settle() {
  if (!s_.follows()) return;
  const VecX units = s_.system.dof_unit();
  double last = kUnbounded;
  for (int pass = 0; pass < kMostSettling; ++pass) {
    const VecX before = Eigen::Map<const VecX>(d_->qfrc_applied, m_->nv);
    const VecX sizes = LoadFrictionOf(&s_);
    double change = 0.0, largest = 0.0;
    for (const size_t e : s_.loaded) {
      const double size = sizes[static_cast<Eigen::Index>(e)];
      const double unit = units[s_.engine.elements[e].dof];
      change = std::max(change, unit * std::abs(size - s_.system.load_friction(e)));
      largest = std::max(largest, unit * size);
    }
    s_.system.SetLoadFriction(sizes);
    s_.ApplyForces(time_s_, at_);
    const Eigen::Map<const VecX> now(d_->qfrc_applied, m_->nv);
    change = std::max(change, (now - before).cwiseProduct(units).cwiseAbs().maxCoeff());
    largest = std::max(largest, now.cwiseProduct(units).cwiseAbs().maxCoeff());
    if (change <= kSettledForces * largest) return;
    if (change >= last && change <= kStalledForces * largest) return;
    last = change;
    SolveSmooth();
    expected_ = s_.system.force();
    ApplyReference();
    SolveConstraints();
  }
  if (s_.trouble.ok()) {
    s_.trouble = {.stop = Stop::kSingular,
                  .message =
                      "friction by loads and the loads, or rotors and the bodies that carry "
                      "them, raise each other",
                  .time_s = time_s_,
                  .where = {},
                  .unit = {}};
  }
}

// MuJoCo's constraint stage, from a start that is a little off: it takes no Newton step shorter
// than 1e-15, and what that leaves undone in the acceleration is divided by R in the force.
void Integrator::SolveConstraints() {
  if (friction_aref_.size() == 0) return SolveOnce();
  HoldFriction(VecX::Zero(friction_aref_.size()));
  SolveOnce();
  if (!FrictionExceeds()) return;
  // MuJoCo decides with soft rows; what that leaves open is decided with hard ones.
  VecX gives = DecideFriction();
  for (Eigen::Index i = 0; i <= 2 * gives.size(); ++i) {
    HoldFriction(gives);
    SolveOnce();
    if (!RefineFriction(&gives)) return;
  }
}

// Rows that hold more than their loss give way, rows that move with their force hold. False where
// there are none.
bool Integrator::RefineFriction(VecX* gives) const {
  bool changed = false;
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int i = s_.system.rows() + row;
    const double loss = s_.system.HeldLoss(row), force = d_->efc_force[i];
    const double moves = s_.system.FrictionJacobian(row).dot(qacc()) - friction_aref_[row];
    double& sign = (*gives)[row];
    if (loss > 0.0 && sign == 0.0 && std::abs(force) > loss) {
      sign = force > 0.0 ? 1.0 : -1.0;
      changed = true;
    } else if (sign * moves > kMoves * loss * d_->efc_diagApprox[i]) {
      sign = 0.0;
      changed = true;
    }
  }
  return changed;
}

void Integrator::SolveOnce() {
  Eigen::Map<VecX>(d_->qacc_warmstart, m_->nv).array() += kNudge;
  const OwnJacobians jacobians(s_.engine);
  mj_fwdConstraint(m_, d_);
}

// Rows hold without bound, but for those that exert ± their loss (`gives`).
void Integrator::HoldFriction(const VecX& gives) {
  for (Eigen::Index row = 0; row < gives.size(); ++row) {
    const int i = s_.system.rows() + static_cast<int>(row);
    const double loss = s_.system.HeldLoss(static_cast<int>(row));
    d_->efc_R[i] = kSoftness * friction_R_[row];
    d_->efc_D[i] = 1.0 / d_->efc_R[i];
    d_->efc_frictionloss[i] = loss > 0.0 && gives[row] == 0.0 ? kUnbounded : loss;
    d_->efc_aref[i] = friction_aref_[row] + kBeyond * gives[row] * loss * d_->efc_diagApprox[i];
  }
}

bool Integrator::FrictionExceeds() const {
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const double loss = s_.system.HeldLoss(row);
    if (loss > 0.0 && std::abs(d_->efc_force[s_.system.rows() + row]) > loss) return true;
  }
  return false;
}

// The sign of the force of each row that MuJoCo finds at its bound, else 0.
VecX Integrator::DecideFriction() {
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int i = s_.system.rows() + row;
    d_->efc_R[i] = friction_R_[row];
    d_->efc_D[i] = 1.0 / d_->efc_R[i];
    d_->efc_frictionloss[i] = s_.system.HeldLoss(row);
    d_->efc_aref[i] = friction_aref_[row];
  }
  mjOption& option = s_.engine.m->opt;
  const int iterations = std::exchange(option.iterations, kFrictionIterations);
  const double tolerance = std::exchange(option.tolerance, 0.0);
  SolveOnce();
  option.iterations = iterations;
  option.tolerance = tolerance;
  VecX gives = VecX::Zero(s_.system.friction_rows());
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const int state = d_->efc_state[s_.system.rows() + row];
    if (state == mjCNSTRSTATE_LINEARNEG) gives[row] = 1.0;
    if (state == mjCNSTRSTATE_LINEARPOS) gives[row] = -1.0;
  }
  return gives;
}

// (1) without the expected force; R and its inverse D.
void Integrator::SetReference(const VecX& v, const DrivenSample& at, Guidance guidance) {
  const int rows = s_.system.rows();
  s_.system.Bias(&bias_);
  rate_ = s_.system.J() * v;
  aref_ = -bias_;
  s_.system.AddGuided(-1.0, at.velocity, &rate_);
  s_.system.AddGuided(1.0, at.acceleration, &aref_);
  if (guidance == Guidance::kNew) guidance_ = b_ * rate_ + k_ * s_.system.residual();
  aref_ -= guidance_;
  Eigen::Map<VecX> R(d_->efc_R, rows);
  R = kSoftness * R.cwiseMin(largest_R_);
  Eigen::Map<VecX>(d_->efc_D, rows) = R.cwiseInverse();
  SetFrictionRows(v);
  ApplyReference();
}

// Rows that hold what rests: no acceleration, as in (1).
void Integrator::SetFrictionRows(const VecX& v) {
  const int rows = s_.system.rows();
  for (int row = 0; row < s_.system.friction_rows(); ++row) {
    const FrictionPlace& place = s_.engine.frictions[static_cast<size_t>(row)];
    const double bias = place.tendon >= 0 ? s_.system.TendonBias(place.tendon) : 0.0;
    friction_R_[row] =
        std::min((1.0 - kMjcfImpedance) * d_->efc_diagApprox[rows + row], largest_friction_R_[row]);
    friction_aref_[row] = -bias - b_ * s_.system.FrictionJacobian(row).dot(v);
  }
}

// With redundant constraints the self-stress is determined through R alone, and a force that relies
// on its own past would drift: no self-stress is expected, so none is found.
void Integrator::ApplyReference() {
  const int rows = s_.system.rows();
  s_.solver.RemoveSelfStress(&expected_);
  Eigen::Map<VecX>(d_->efc_aref, rows) =
      aref_ + Eigen::Map<const VecX>(d_->efc_R, rows).cwiseProduct(expected_);
}

// The constraint stage once more, expecting the force just found.
void Integrator::SolveAgain() {
  expected_ = s_.system.force();
  ApplyReference();
  SolveConstraints();
  Settle();
}

}  // namespace mbv::simulation
