#include "simulation/closure_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "mechanism/constraints.h"

namespace mbv::simulation {
namespace {

constexpr int kMaxNewton = 15;
// Newton stops when its step is round-off, or must be after a step whose square is.
constexpr double kSmallStep = 1e-14;
constexpr double kSmallSquare = 1e-8;
// Below this step the factors of the previous iterate serve on, with refinement.
constexpr double kChordStep = 1e-5;
// Each refinement shrinks the error of factors that are kChordStep old by about kChordStep times
// the condition: one leaves up to 1e-9 of the forces, three leave round-off.
constexpr int kRefinements = 3;
// A solution of Newton must be closed to this [m or rad].
constexpr double kClosed = 1e-10;
// Relative rank tolerance, columns of J having the natural scale of metres and radians.
constexpr double kRankTolerance = 1e-9;

// The shortest x with A x = b as well as can be, refined once.
VecX LeastNorm(const MatX& A, const VecX& b) {
  Eigen::CompleteOrthogonalDecomposition<MatX> cod;
  cod.setThreshold(kRankTolerance);
  cod.compute(A);
  VecX x = cod.solve(b);
  const VecX rest = b - A * x;
  x += cod.solve(rest);
  return x;
}

}  // namespace

ClosureSolver::ClosureSolver(ConstraintSystem* system)
    : system_(system), length_(CharacteristicLength(*system->engine().mechanism)) {
  const int rows = system->rows(), nv = system->nv();
  rhs_.setZero(rows);
  step_.setZero(nv);
  bias_.setZero(rows);
  if (rows == nv) lu_ = Eigen::PartialPivLU<MatX>(rows);
}

void ClosureSolver::Factor() {
  stale_ = false;
  if (system_->rows() == system_->nv()) {
    lu_.compute(system_->J());
    // The ratio of the pivots is a cheap warning sign of rank deficiency.
    const auto pivots = lu_.matrixLU().diagonal().cwiseAbs();
    if (pivots.minCoeff() > kRankTolerance * pivots.maxCoeff()) {
      regular_ = true;
      rank_ = system_->nv();
      return;
    }
  }
  regular_ = false;
  cod_.setThreshold(kRankTolerance);
  cod_.compute(system_->J());
  rank_ = static_cast<int>(cod_.rank());
}

void ClosureSolver::SolveInto(const VecX& b, VecX* x) {
  if (!regular_) {
    *x = cod_.solve(b);
    return;
  }
  *x = lu_.solve(b);
  for (int i = 0; stale_ && i < kRefinements; ++i) {
    refinement_ = b;
    refinement_.noalias() -= system_->J() * *x;
    *x += lu_.solve(refinement_);
  }
}

void ClosureSolver::SolveTransposedInto(const VecX& b, VecX* x) {
  if (!regular_) {
    *x = cod_.transpose().solve(b);
    return;
  }
  *x = lu_.transpose().solve(b);
  for (int i = 0; stale_ && i < kRefinements; ++i) {
    refinement_ = b;
    refinement_.noalias() -= system_->J().transpose() * *x;
    step_ = lu_.transpose().solve(refinement_);
    *x += step_;
  }
}

RunSummary ClosureSolver::Close(const VecX& to) {
  const mjModel* m = system_->engine().m.get();
  mjData* d = system_->data();
  system_->SetTargets(to);
  double size = kNan;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    system_->EvaluatePosition();
    rhs_ = -system_->residual();
    const bool closed = rhs_.lpNorm<Eigen::Infinity>() < kClosed;
    stale_ = iteration > 0 && size < kChordStep && regular_;
    if (stale_ && size < kSmallSquare && closed) return RunSummary::Done();
    if (!stale_) Factor();
    SolveInto(rhs_, &step_);
    size = step_.lpNorm<Eigen::Infinity>();
    if (!std::isfinite(size) || size > 1e3) break;
    if (size < kSmallStep && closed) return RunSummary::Done();
    mj_integratePos(m, d->qpos, step_.data(), 1.0);
  }
  const double open = system_->residual().lpNorm<Eigen::Infinity>();
  return {.stop = Stop::kNoConvergence,
          .message = fmt::format("the loops do not close with the commanded drive positions (open "
                                 "by {:.3g} after {} iterations)",
                                 open, kMaxNewton),
          .where = {},
          .amount = open,
          .unit = "m or rad"};
}

RunSummary ClosureSolver::Follow(const VecX& from, const VecX& to) {
  const mjModel& m = *system_->engine().m;
  mjData* d = system_->data();
  reached_.assign(d->qpos, d->qpos + m.nq);
  RunSummary summary = Close(to);
  if (summary.ok()) return summary;
  // Walk there in steps that adapt to what Newton can bridge.
  double s = 0.0, ds = 0.25;
  while (s < 1.0) {
    std::copy(reached_.begin(), reached_.end(), d->qpos);
    const double next = std::min(1.0, s + ds);
    summary = Close(from + next * (to - from));
    if (summary.ok()) {
      s = next;
      ds *= 1.5;
      reached_.assign(d->qpos, d->qpos + m.nq);
    } else {
      ds *= 0.5;
      if (ds < 1e-4) return summary;
    }
  }
  return RunSummary::Done();
}

void ClosureSolver::CorrectVelocity(const VecX& driven_velocity) {
  Eigen::Map<VecX> qvel(system_->data()->qvel, system_->nv());
  rhs_ = -(system_->J() * qvel);
  rhs_.tail(system_->driven_rows()) += system_->Guided(driven_velocity);
  SolveInto(rhs_, &step_);
  qvel += step_;
  mj_comVel(system_->engine().m.get(), system_->data());
}

void ClosureSolver::SolveVelocity(const VecX& driven_velocity) {
  rhs_.setZero();
  rhs_.tail(system_->driven_rows()) = system_->Guided(driven_velocity);
  SolveInto(rhs_, &step_);
  std::copy(step_.begin(), step_.end(), system_->data()->qvel);
  mj_comVel(system_->engine().m.get(), system_->data());
}

void ClosureSolver::SolveAcceleration(const VecX& driven_acceleration) {
  system_->Bias(&bias_);
  rhs_ = -bias_;
  rhs_.tail(system_->driven_rows()) += system_->Guided(driven_acceleration);
  SolveInto(rhs_, &step_);
  std::copy(step_.begin(), step_.end(), system_->data()->qacc);
}

void ClosureSolver::SolveForces(const VecX& tau) {
  SolveTransposedInto(tau, &rhs_);
  system_->force() = rhs_;
}

void ClosureSolver::RemoveSelfStress(VecX* force) const {
  if (redundant() == 0) return;
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->J());
  VecX y = qr.householderQ().adjoint() * *force;
  y.tail(redundant()).setZero();
  *force = qr.householderQ() * y;
}

void ClosureSolver::SolveForcesHere(const VecX& tau) {
  system_->force() = LeastNorm(system_->J().transpose(), tau);
}

double ClosureSolver::WeakestPivot() const {
  if (rank_ == 0) return 1.0;
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->J().transpose());
  const auto pivots = qr.matrixQR().diagonal();
  return std::abs(pivots[rank_ - 1]) / std::abs(pivots[0]);
}

void ClosureSolver::SolveLeastDriven(const VecX& tau) {
  const EngineModel& engine = system_->engine();
  const int nv = system_->nv(), closures = system_->first_driven_row();
  const int driven = system_->driven_rows();
  VecX scale = VecX::Ones(driven);
  for (size_t k = 0; k < engine.driven.size(); ++k) {
    const int row = system_->driven_row(static_cast<int>(k)) - closures;
    const DrivenPlace& place = engine.driven[k];
    const bool angle = !place.is_tendon && engine.m->jnt_type[place.object] == mjJNT_HINGE;
    if (row >= 0 && angle) scale[row] = length_;
  }
  const MatX J_c = system_->J().topRows(closures), J_u = system_->J().bottomRows(driven);
  MatX N = MatX::Identity(nv, nv);
  if (closures > 0) {
    Eigen::ColPivHouseholderQR<MatX> qr;
    qr.setThreshold(kRankTolerance);
    qr.compute(J_c.transpose());
    const MatX Q = qr.householderQ();
    N = Q.rightCols(nv - qr.rank());
  }
  const MatX B = (J_u * N).transpose() * scale.asDiagonal();
  const VecX u = scale.cwiseProduct(LeastNorm(B, N.transpose() * tau));
  VecX lambda(closures + driven);
  lambda.tail(driven) = u;
  if (closures > 0) {
    lambda.head(closures) = LeastNorm(J_c.transpose(), tau - J_u.transpose() * u);
  }
  system_->force() = lambda;
}

std::vector<int> ClosureSolver::DrivenRowsNotUnique() const {
  std::vector<int> rows;
  if (redundant() == 0) return rows;
  // Self-stress: the null space of Jᵀ, from the Q factor behind the rank.
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->J());
  const MatX Q = qr.householderQ();
  const MatX self_stress = Q.rightCols(redundant());
  for (int i = system_->first_driven_row(); i < system_->rows(); ++i) {
    if (self_stress.row(i).norm() > 1e-6) rows.push_back(i);
  }
  return rows;
}

}  // namespace mbv::simulation
