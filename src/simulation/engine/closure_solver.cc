#include "simulation/engine/closure_solver.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <random>

namespace mbv::simulation {

void SamplePredictor::Predict(double h, mjData* d) {
  const mjModel* m = engine_.m.get();
  history_.Remember(Eigen::Map<const VecX>(d->qvel, m->nv), Eigen::Map<const VecX>(d->qacc, m->nv));
  known_ = std::min(known_ + 1, kMostRateSamples);
  history_.Sum(known_, RateRulesOf(known_).mean, h, 0, m->nv, &u_);
  u_ *= h;
  for (int i = 0; i < m->nv; ++i) {
    if (!engine_.dof_is_rotation3[static_cast<size_t>(i)]) continue;
    u_.segment<3>(i) += history_.Turn(known_, h, i, false);
  }
  mj_integratePos(m, d->qpos, u_.data(), 1.0);
}

namespace {

constexpr int kMaxNewton = 15;
// All in the units of ConstraintSystem::ScaledJ(): characteristic lengths, radians.
//
// Newton stops after a step whose square is round-off. After one that is round-off itself nothing
// is evaluated again.
constexpr double kSmallSquare = 1e-8;
constexpr double kNoStep = 1e-14;
// Reflections mix all equations: without one refinement the force that accelerates a heavy
// prescribed body leaves its rounding in the drives that do not move it.
constexpr int kOrthogonalRefinements = 1;
// A solution of Newton must be closed to this and rounding.
constexpr double kClosed = 1e-10;
// What Newton moves further than this, or corrects of a prediction, may be another assembly.
constexpr double kFarthestStep = 0.5, kFarthestCorrection = 0.1;
// Of the way between two samples.
constexpr double kShortestStep = 1e-4;
// Relative rank tolerance.
constexpr double kRankTolerance = 1e-9;
// A self-stress with a smaller share in a row does not act there.
constexpr double kActs = 1e-6;
// With more rows than velocities: of more velocities, factors are sparse. Where motions are left
// open, of many velocities alone that leave few, by this share.
constexpr int kLargestDense = 6, kFewVelocities = 100;
constexpr double kFewMotions = 0.25;

bool LeavesFew(int motions, int rank) { return motions <= kFewMotions * rank; }

// The shortest x with A x = b as well as can be, refined once.
VecX LeastNorm(const MatX& A, const VecX& b) {
  if (A.size() == 0) return VecX::Zero(A.cols());
  Eigen::CompleteOrthogonalDecomposition<MatX> cod;
  cod.setThreshold(kRankTolerance);
  cod.compute(A);
  VecX x = cod.solve(b);
  const VecX rest = b - A * x;
  x += cod.solve(rest);
  return x;
}

}  // namespace

ClosureSolver::ClosureSolver(ConstraintSystem* system) : system_(system) {
  const int rows = system->rows(), nv = system->nv();
  rhs_.setZero(rows);
  step_.setZero(nv);
  bias_.setZero(rows);
}

void ClosureSolver::Factor() {
  const int rows = system_->rows(), nv = system_->nv();
  factors_ = Factors::kNone;
  rank_ = 0;
  if (rows == 0) return;
  system_->FillScaledTranspose(&columns_);
  // The ratio of the pivots is a cheap warning sign of rank deficiency.
  if (rows == nv && lu_.Factor(columns_) && lu_.PivotRatio() > kRankTolerance) {
    factors_ = Factors::kSquare;
    rank_ = nv;
    return;
  }
  if (rows > nv && nv > kLargestDense && least_.Factor(columns_, kRankTolerance)) {
    factors_ = Factors::kOverdefined;
    rank_ = nv;
    return;
  }
  if (nv > kFewVelocities && FactorBeside()) {
    factors_ = Factors::kBeside;
    rank_ = nv - static_cast<int>(motions_.cols());
    return;
  }
  factors_ = Factors::kOrthogonal;
  cod_.setThreshold(kRankTolerance);
  cod_.compute(system_->ScaledJ());
  rank_ = static_cast<int>(cod_.rank());
}

// Where J leaves motions, rows are added that hold as many velocities: what J' x can be stays the
// same, as motions may be added to x until it has none of these velocities, and Jᵀλ + Eᵀe = τ has
// e = 0 where λ can balance τ.
bool ClosureSolver::FactorBeside() {
  const SparseRank rank(SparseLu::Matrix(columns_.transpose()), kRankTolerance);
  const int left = system_->nv() - rank.rank();
  if (!rank.clear() || left == 0 || !LeavesFew(left, rank.rank())) return false;
  const MatX basis = rank.NullSpace();
  motions_ =
      Eigen::HouseholderQR<MatX>(basis).householderQ() * MatX::Identity(basis.rows(), basis.cols());
  Hold(rank);
  least_.Reset();
  return least_.Factor(SideBySide({&columns_, &held_rows_}), kRankTolerance);
}

// Velocities on which the others depend.
void ClosureSolver::Hold(const SparseRank& rank) {
  const std::vector<int> free = rank.FirmlyIndependent();
  held_.clear();
  for (int i = 0; i < system_->nv(); ++i) {
    if (!std::ranges::binary_search(free, i)) held_.push_back(i);
  }
  held_rows_.resize(system_->nv(), static_cast<Eigen::Index>(held_.size()));
  held_rows_.setZero();
  for (size_t k = 0; k < held_.size(); ++k) {
    held_rows_.insert(held_[k], static_cast<Eigen::Index>(k)) = 1.0;
  }
  held_rows_.makeCompressed();
  least_here_.Reset();
  soft_.resize(0);
}

VecX ClosureSolver::WithoutMotions(const VecX& x) const {
  return x - motions_ * (motions_.transpose() * x);
}

// λ of least norm that balances what can be balanced of τ, both scaled.
VecX ClosureSolver::LeastForces(const VecX& tau) const {
  if (factors_ == Factors::kOverdefined) return least_.LeastNorm(tau);
  return least_.LeastNorm(WithoutMotions(tau)).head(system_->rows());
}

// J = R J' D⁻¹ with the factored J', units R of the rows and D of the velocities.
void ClosureSolver::SolveInto(const VecX& b, VecX* x, int refinements) {
  if (factors_ == Factors::kNone) {
    x->setZero(system_->nv());
    return;
  }
  scaled_ = b.cwiseQuotient(system_->row_unit());
  switch (factors_) {
    case Factors::kSquare:
      lu_.SolveTransposed(&scaled_);
      break;
    case Factors::kOverdefined:
      scaled_ = least_.LeastSquares(scaled_, refinements);
      break;
    case Factors::kBeside:
      scaled_.conservativeResizeLike(VecX::Zero(scaled_.size() + motions_.cols()));
      scaled_ = WithoutMotions(least_.LeastSquares(scaled_, refinements));
      break;
    default:
      scaled_ = cod_.solve(scaled_).eval();
  }
  *x = scaled_.cwiseProduct(system_->dof_unit());
}

void ClosureSolver::SolveTransposedInto(const VecX& b, VecX* x) {
  if (factors_ == Factors::kNone) {
    x->setZero(system_->rows());
    return;
  }
  const VecX &row = system_->row_unit(), &dof = system_->dof_unit();
  scaled_ = b.cwiseProduct(dof);
  if (factors_ == Factors::kSquare) {
    lu_.Solve(&scaled_);
    *x = scaled_.cwiseQuotient(row);
    return;
  }
  if (factors_ == Factors::kOverdefined || factors_ == Factors::kBeside) {
    *x = LeastForces(scaled_).cwiseQuotient(row);
    return;
  }
  const auto solve = [&](const VecX& right) -> VecX { return cod_.transpose().solve(right); };
  *x = solve(scaled_).cwiseQuotient(row);
  for (int i = 0; i < kOrthogonalRefinements; ++i) {
    refinement_ = b - system_->J().transpose() * *x;
    scaled_ = refinement_.cwiseProduct(dof);
    *x += solve(scaled_).cwiseQuotient(row);
  }
}

RunSummary ClosureSolver::Close(const VecX& to) {
  const mjModel* m = system_->engine().m.get();
  mjData* d = system_->data();
  system_->SetTargets(to);
  double size = kNan;
  moved_ = 0.0;
  for (int iteration = 0; iteration < kMaxNewton; ++iteration) {
    system_->EvaluatePosition();
    rhs_ = -system_->residual();
    const double open = rhs_.cwiseQuotient(system_->row_unit()).lpNorm<Eigen::Infinity>();
    const bool closed = open < kClosed + system_->Rounding();
    const bool done = iteration > 0 && size < kSmallSquare && closed;
    Factor();
    if (done) return RunSummary::Done();
    SolveInto(rhs_, &step_, 0);
    size = step_.cwiseQuotient(system_->dof_unit()).lpNorm<Eigen::Infinity>();
    if (!std::isfinite(size) || size > 1e3) break;
    moved_ += size;
    mj_integratePos(m, d->qpos, step_.data(), 1.0);
    if (size < kNoStep && closed) return RunSummary::Done();
  }
  const double open = system_->residual().lpNorm<Eigen::Infinity>();
  return {.stop = Stop::kNoConvergence,
          .message = fmt::format("the loops do not close with the commanded drive positions (open "
                                 "by {:.3g} after {} iterations)",
                                 open, kMaxNewton),
          .amount = open,
          .unit = "m or rad"};
}

template <typename Way>
RunSummary ClosureSolver::CloseOr(const VecX& to, double farthest, VecX* here, Way&& way) {
  Eigen::Map<VecX> qpos(system_->data()->qpos, system_->engine().m->nq);
  *here = qpos;
  const bool direct = Close(to).ok();
  if (direct && moved_ < farthest) return RunSummary::Done();
  RunSummary summary = way(qpos);
  if (summary.ok() || !direct) return summary;
  qpos = *here;
  return Close(to);
}

RunSummary ClosureSolver::Follow(const VecX& from, const VecX& to) {
  return CloseOr(to, kFarthestStep, &began_, [&](Eigen::Map<VecX>& qpos) {
    qpos = began_;
    return Walk(from, to);
  });
}

// In steps that adapt to what Newton can bridge.
RunSummary ClosureSolver::Walk(const VecX& from, const VecX& to) {
  mjData* d = system_->data();
  const int nq = system_->engine().m->nq;
  reached_.assign(d->qpos, d->qpos + nq);
  double s = 0.0, ds = 0.25;
  while (s < 1.0) {
    std::copy(reached_.begin(), reached_.end(), d->qpos);
    const double next = std::min(1.0, s + ds);
    const RunSummary summary = Close(from + next * (to - from));
    if (summary.ok() && (moved_ < kFarthestStep || ds < kShortestStep)) {
      s = next;
      ds *= 1.5;
      reached_.assign(d->qpos, d->qpos + nq);
    } else {
      if (ds < kShortestStep) return summary;
      ds *= 0.5;
    }
  }
  return RunSummary::Done();
}

RunSummary ClosureSolver::FollowPredicted(const VecX& closed, const VecX& from, const VecX& to) {
  return CloseOr(to, kFarthestCorrection, &predicted_, [&](Eigen::Map<VecX>& qpos) {
    qpos = closed;
    return Follow(from, to);
  });
}

void ClosureSolver::CorrectVelocity(const VecX& driven_velocity) {
  Eigen::Map<VecX> qvel(system_->data()->qvel, system_->nv());
  rhs_ = -(system_->J() * qvel);
  system_->AddPrescribed(1.0, driven_velocity, &rhs_);
  SolveInto(rhs_, &step_);
  qvel += step_;
  mj_comVel(system_->engine().m.get(), system_->data());
}

void ClosureSolver::SolveVelocity(const VecX& driven_velocity) {
  rhs_.setZero();
  system_->AddPrescribed(1.0, driven_velocity, &rhs_);
  SolveInto(rhs_, &step_);
  std::copy(step_.begin(), step_.end(), system_->data()->qvel);
  mj_comVel(system_->engine().m.get(), system_->data());
}

void ClosureSolver::SolveAcceleration(const VecX& driven_acceleration) {
  system_->Bias(&bias_);
  rhs_ = -bias_;
  system_->AddPrescribed(1.0, driven_acceleration, &rhs_);
  SolveInto(rhs_, &step_);
  std::copy(step_.begin(), step_.end(), system_->data()->qacc);
}

void ClosureSolver::SolveForces(const VecX& tau) {
  SolveTransposedInto(tau, &rhs_);
  system_->force() = rhs_;
}

// The same of the present J.
bool ClosureSolver::FactorHere() {
  system_->FillScaledTranspose(&columns_here_);
  if (undriven() == 0) return least_here_.Factor(columns_here_, kRankTolerance);
  if (system_->nv() <= kFewVelocities || !LeavesFew(undriven(), rank_)) return false;
  if (static_cast<int>(held_.size()) != undriven()) {
    Hold(SparseRank(SparseLu::Matrix(columns_here_.transpose()), kRankTolerance));
    if (static_cast<int>(held_.size()) != undriven()) return false;
  }
  if (least_here_.Factor(SideBySide({&columns_here_, &held_rows_}), kRankTolerance)) return true;
  held_.clear();
  return false;
}

void ClosureSolver::RemoveSelfStress(VecX* force) {
  if (redundant() == 0) return;
  const VecX& unit = system_->row_unit();
  if (FactorHere()) {  // J x next to the force: rounding in x is not a self-stress
    VecX scaled = VecX::Zero(system_->rows() + undriven());
    scaled.head(system_->rows()) = force->cwiseProduct(unit);
    const VecX x = least_here_.LeastSquares(scaled, 0);
    *force = (columns_here_.transpose() * x).cwiseQuotient(unit);
    return;
  }
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->ScaledJ());
  VecX y = qr.householderQ().adjoint() * force->cwiseProduct(unit);
  y.tail(redundant()).setZero();
  *force = (qr.householderQ() * y).cwiseQuotient(unit);
}

void ClosureSolver::SolveForcesHere(const VecX& tau) {
  const VecX force =
      LeastNorm(system_->ScaledJ().transpose(), tau.cwiseProduct(system_->dof_unit()));
  system_->force() = force.cwiseQuotient(system_->row_unit());
}

double ClosureSolver::WeakestPivot() {
  if (rank_ == 0) return 1.0;
  for (int attempt = 0; attempt < 2 && undriven() > 0 && FactorHere(); ++attempt) {
    const double weakest = WeakestByIteration();
    if (!std::isnan(weakest)) return weakest;
    held_.clear();
  }
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->ScaledJ().transpose());
  const auto pivots = qr.matrixQR().diagonal();
  return std::abs(pivots[rank_ - 1]) / std::abs(pivots[0]);
}

// The least singular value of J' that is not zero, over its longest row, by inverse iteration
// from where the last call ended. NaN where the velocities held are a poor choice here.
double ClosureSolver::WeakestByIteration() {
  constexpr int kFirst = 24, kNext = 3;
  constexpr double kPoor = 1e4;
  const int rows = system_->rows(), nv = system_->nv();
  MatX motions(nv, undriven());
  VecX right = VecX::Zero(rows + undriven());
  for (int k = 0; k < undriven(); ++k) {
    right.tail(undriven()) = VecX::Unit(undriven(), k);
    motions.col(k) = least_here_.LeastSquares(right, 1);
  }
  if (!(motions.norm() < kPoor)) return kNan;
  motions = Eigen::HouseholderQR<MatX>(motions).householderQ() * MatX::Identity(nv, undriven());
  const int iterations = soft_.size() == 0 ? kFirst : kNext;
  if (soft_.size() == 0) {
    soft_.resize(nv);
    for (Eigen::Index i = 0; i < soft_.size(); ++i) {
      soft_[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));  // a share in every direction
    }
  }
  right.setZero();
  for (int i = 0; i < iterations; ++i) {
    soft_ -= motions * (motions.transpose() * soft_);
    soft_.normalize();
    right.head(rows) = least_here_.LeastNorm(soft_).head(rows);
    soft_ = least_here_.LeastSquares(right, 0);
  }
  soft_ -= motions * (motions.transpose() * soft_);
  soft_.normalize();
  double longest = 0.0;
  for (int i = 0; i < rows; ++i) longest = std::max(longest, columns_here_.col(i).norm());
  return (columns_here_.transpose() * soft_).norm() / longest;
}

void ClosureSolver::SolveLeastDriven(const VecX& tau) {
  const int nv = system_->nv(), closures = system_->first_driven_row();
  const int driven = system_->driven_rows();
  // In these units a force counts as its moment at the characteristic length.
  const MatX J = system_->ScaledJ();
  const VecX scaled_tau = tau.cwiseProduct(system_->dof_unit());
  const MatX J_c = J.topRows(closures), J_u = J.bottomRows(driven);
  MatX N = MatX::Identity(nv, nv);
  if (closures > 0) {
    Eigen::ColPivHouseholderQR<MatX> qr;
    qr.setThreshold(kRankTolerance);
    qr.compute(J_c.transpose());
    const MatX Q = OrthogonalFactor(qr);
    N = Q.rightCols(nv - qr.rank());
  }
  VecX lambda(closures + driven);
  const VecX u = LeastNorm((J_u * N).transpose(), N.transpose() * scaled_tau);
  lambda.tail(driven) = u;
  if (closures > 0) {
    lambda.head(closures) = LeastNorm(J_c.transpose(), scaled_tau - J_u.transpose() * u);
  }
  system_->force() = lambda.cwiseQuotient(system_->row_unit());
}

// The null space of Jᵀ, from the Q factor behind the rank.
MatX ClosureSolver::ScaledSelfStress() const {
  const Eigen::ColPivHouseholderQR<MatX> qr(system_->ScaledJ());
  const MatX Q = OrthogonalFactor(qr);
  return Q.rightCols(redundant());
}

MatX ClosureSolver::SelfStress() const {
  if (redundant() == 0) return MatX(system_->rows(), 0);
  return system_->row_unit().cwiseInverse().asDiagonal() * ScaledSelfStress();
}

// What the projection on the null space leaves of row forces; of a unit force the length of a row
// of its basis.
double ClosureSolver::SelfStressIn(const VecX& force) const {
  return (force - LeastForces(columns_ * force)).norm();
}

// Where random forces of all driven rows have no part in a self-stress, none of these rows has one:
// three times, as one may cancel by chance.
bool ClosureSolver::DrivenRowsAreUnique() const {
  constexpr int kTries = 3;
  constexpr double kNoShare = 1e-3 * kActs;
  std::mt19937_64 random(20261130);
  for (int k = 0; k < kTries; ++k) {
    VecX force = VecX::Zero(system_->rows());
    for (double& x : force.tail(system_->driven_rows())) {
      x = std::ldexp(static_cast<double>(random() >> 11), -52) - 1.0;
    }
    if (SelfStressIn(force) > kNoShare) return false;
  }
  return true;
}

std::vector<int> ClosureSolver::DrivenRowsNotUnique() const {
  std::vector<int> rows;
  if (redundant() == 0) return rows;
  const bool sparse = factors_ == Factors::kOverdefined || factors_ == Factors::kBeside;
  if (sparse && DrivenRowsAreUnique()) return rows;
  const MatX self_stress = sparse ? MatX() : ScaledSelfStress();
  for (int i = system_->first_driven_row(); i < system_->rows(); ++i) {
    const double share =
        sparse ? SelfStressIn(VecX::Unit(system_->rows(), i)) : self_stress.row(i).norm();
    if (share > kActs) rows.push_back(i);
  }
  return rows;
}

}  // namespace mbv::simulation
