#include "simulation/engine/compliant.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "base/demand.h"
#include "math/spatial.h"
#include "mechanism/reach.h"

namespace mbv::simulation {
namespace {

constexpr int kMaxChord = 40, kMaxNewtonSteps = 25, kMaxLoadSteps = 64;
// Iterations go on to round-off: until this often nothing improves.
constexpr int kMaxStalls = 2;
constexpr double kNewtonMerit = 1e-3;  // of the limits of a converged state
// Scaled eigenvalues below this are idle DOFs and redundant rows: those of the shipped
// mechanisms are below 1e-13, all others above 1e-5.
constexpr double kStaticsRankTolerance = 1e-10;
// A first-order answer must satisfy its equations to this.
constexpr double kLinearTolerance = 1e-6;
// Differences for the tangent; largest rotation of one Newton step [rad].
constexpr double kDifference = 1e-6, kLargestStep = 0.2;

// Factors s with max_j |s_i A_ij s_j| ≈ 1 (Ruiz).
VecX Equilibration(const MatX& A) {
  VecX s = VecX::Ones(A.rows());
  for (int pass = 0; pass < 8; ++pass) {
    const MatX scaled = s.asDiagonal() * A * s.asDiagonal();
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      const double largest = scaled.row(i).cwiseAbs().maxCoeff();
      if (largest > 0.0) s[i] /= std::sqrt(largest);
    }
  }
  return s;
}

MatX PseudoInverse(const MatX& A) {
  if (A.rows() == 0) return A;
  const VecX s = Equilibration(A);
  const Eigen::SelfAdjointEigenSolver<MatX> eigen(MatX(s.asDiagonal() * A * s.asDiagonal()));
  VecX inverse = eigen.eigenvalues();
  const double threshold = kStaticsRankTolerance * inverse.cwiseAbs().maxCoeff();
  for (double& x : inverse) x = std::abs(x) > threshold ? 1.0 / x : 0.0;
  const MatX Q = s.asDiagonal() * eigen.eigenvectors();
  return Q * inverse.asDiagonal() * Q.transpose();
}

double LoadOf(const Vec6& F, double size) {
  return std::max(F.tail<3>().norm(), F.head<3>().norm() / size);
}

}  // namespace

Statics::Statics(const mjcf::CompliantModel& model, RunSummary* summary) : model_(model) {
  *summary = MakeEngineModel(model.mechanism, model.mjcf, &engine_);
  if (!summary->ok()) return;
  const mjModel& m = *engine_.m;
  data_ = MakeData(m);
  system_ = std::make_unique<ConstraintSystem>(engine_, data_.get());
  size_ = CharacteristicLength(model.mechanism);
  output_body_ = engine_.body_id[engine_.PlannedOf(model.mechanism.outputs[0].body)];
  unit_.setConstant(m.nv, size_);
  flexibility_.setZero(m.nv);
  for (int j = 0; j < m.njnt; ++j) {
    const int dof = m.jnt_dofadr[j];
    if (m.jnt_type[j] == mjJNT_SLIDE) unit_[dof] = 1.0;
    if (m.jnt_type[j] == mjJNT_FREE) unit_.segment<3>(dof).setOnes();
    if (m.jnt_stiffness[j] > 0.0) flexibility_[dof] = 1.0 / m.jnt_stiffness[j];
  }
  for (int i = 0; i < m.nv; ++i) {
    if (flexibility_[i] == 0.0) free_dofs_.push_back(i);
  }
  for (const mjcf::ElasticSpring& spring : model.springs) {
    SpringPlace place;
    if (spring.is_tendon) {
      place.tendon = IdOf(m, mjOBJ_TENDON, spring.object);
    } else {
      place.qpos = m.jnt_qposadr[IdOf(m, mjOBJ_JOINT, spring.object)];
    }
    springs_.push_back(place);
  }
  applied_ = Condense(false);
  held_ = Condense(true);
}

Statics::State Statics::Home() const {
  State home;
  home.q = Eigen::Map<const VecX>(engine_.m->qpos0, engine_.m->nq);
  home.lambda.setZero(system_->rows());
  return home;
}

Pose Statics::OutputPose() const {
  return PoseOf(*data_, output_body_) * model_.mechanism.outputs[0].X_BO;
}

void Statics::Evaluate(const State& state, const Target& target) {
  const mjModel* m = engine_.m.get();
  mjData* d = data_.get();
  Eigen::Map<VecX>(d->qpos, m->nq) = state.q;
  system_->EvaluatePosition();
  mj_passive(m, d);
  const Pose X_WO = OutputPose();
  const Vec3 p_WO = X_WO.translation();
  RowMajor translation(3, m->nv), rotation(3, m->nv);
  mj_jac(m, d, translation.data(), rotation.data(), p_WO.data(), output_body_);
  J_o_.resize(6, m->nv);
  J_o_ << rotation, translation;
  const int loops = system_->rows();
  J_.resize(loops + (target.held ? 6 : 0), m->nv);
  r_.resize(J_.rows());
  if (loops > 0) {
    J_.topRows(loops) = MatX(system_->J());
    r_.head(loops) = system_->residual();
  }
  if (target.held) {
    J_.bottomRows<6>() = J_o_;
    r_.tail<6>() << LogRotation(X_WO.linear() * target.X_WO.linear().transpose()),
        p_WO - target.X_WO.translation();
  }
  f_ = Eigen::Map<const VecX>(d->qfrc_passive, m->nv);
  f_.noalias() += J_o_.transpose() * state.F;
  if (loops > 0) f_.noalias() += J_.topRows(loops).transpose() * state.lambda;
}

void Statics::Measure(State* state, const Target& target) const {
  const double load = std::max(target.load, LoadOf(state->F, size_));
  state->residual = f_.cwiseQuotient(unit_).cwiseAbs().maxCoeff() / load;
  state->gap = 0.0;
  for (const double r : r_) state->gap = std::max(state->gap, std::abs(r) / std::max(size_, 1.0));
  if (!f_.allFinite() || !r_.allFinite()) state->residual = state->gap = kNan;
}

void Statics::Apply(const VecX& dq, const VecX& dlambda, State* state, const Target& target) const {
  mj_integratePos(engine_.m.get(), state->q.data(), dq.data(), 1.0);
  state->lambda += dlambda.head(state->lambda.size());
  if (target.held) state->F += dlambda.segment<6>(state->lambda.size());
}

Statics::Condensed Statics::Condense(bool held) {
  const mjModel& m = *engine_.m;
  Target target;
  target.held = held;
  Evaluate(Home(), target);
  Condensed condensed;
  condensed.held = held;
  std::vector<int> tendons;
  for (const SpringPlace& place : springs_) {
    if (place.tendon >= 0) tendons.push_back(place.tendon);
  }
  const Eigen::Index rows = J_.rows(), all = rows + static_cast<Eigen::Index>(tendons.size());
  const auto free = static_cast<Eigen::Index>(free_dofs_.size());
  condensed.J.resize(all, m.nv);
  condensed.J.topRows(rows) = J_;
  for (size_t t = 0; t < tendons.size(); ++t) {
    condensed.J.row(rows + t) =
        Eigen::Map<const Eigen::RowVectorXd>(data_->ten_J + m.nv * tendons[t], m.nv);
  }
  // (3)
  MatX A = MatX::Zero(all + free, all + free);
  A.topLeftCorner(all, all) = condensed.J * flexibility_.asDiagonal() * condensed.J.transpose();
  for (size_t t = 0; t < tendons.size(); ++t) {
    A(rows + t, rows + t) += 1.0 / m.tendon_stiffness[tendons[t]];
  }
  for (Eigen::Index i = 0; i < free; ++i) {
    A.col(all + i).head(all) = condensed.J.col(free_dofs_[i]);
    A.row(all + i).head(all) = condensed.J.col(free_dofs_[i]).transpose();
  }
  condensed.inverse = PseudoInverse(A);
  return condensed;
}

void Statics::CondensedStep(const Condensed& condensed, const VecX& f, const VecX& r, VecX* dq,
                            VecX* dlambda) const {
  const Eigen::Index all = condensed.J.rows();
  VecX b = VecX::Zero(condensed.inverse.rows());
  b.head(all) = -condensed.J * flexibility_.cwiseProduct(f);
  b.head(r.size()) -= r;
  for (size_t i = 0; i < free_dofs_.size(); ++i) b[all + i] = -f[free_dofs_[i]];
  const VecX x = condensed.inverse * b;
  *dlambda = x.head(all);
  *dq = flexibility_.cwiseProduct(f + condensed.J.transpose() * *dlambda);  // (2)
  for (size_t i = 0; i < free_dofs_.size(); ++i) (*dq)[free_dofs_[i]] = x[all + i];
}

// ∂f/∂q with λ and F as they are.
MatX Statics::ForceTangent(const State& state, const Target& target) {
  const mjModel* m = engine_.m.get();
  MatX tangent(m->nv, m->nv);
  State moved = state;
  VecX dq = VecX::Zero(m->nv), f_plus;
  for (int i = 0; i < m->nv; ++i) {
    const double h = kDifference * size_ / unit_[i];
    for (const double sign : {1.0, -1.0}) {
      dq[i] = sign * h;
      moved.q = state.q;
      mj_integratePos(m, moved.q.data(), dq.data(), 1.0);
      Evaluate(moved, target);
      if (sign > 0.0) f_plus = f_;
    }
    dq[i] = 0.0;
    tangent.col(i) = (f_plus - f_) / (2.0 * h);
  }
  Evaluate(state, target);
  return tangent;
}

void Statics::NewtonStep(const State& state, const Target& target, VecX* dq, VecX* dlambda) {
  const Eigen::Index nv = engine_.m->nv;
  const MatX tangent = ForceTangent(state, target);
  const Eigen::Index rows = J_.rows();
  MatX A = MatX::Zero(nv + rows, nv + rows);
  A.topLeftCorner(nv, nv) = tangent;
  A.topRightCorner(nv, rows) = J_.transpose();
  A.bottomLeftCorner(rows, nv) = J_;
  VecX b(nv + rows);
  b << -f_, -r_;
  const VecX s = Equilibration(A);
  Eigen::CompleteOrthogonalDecomposition<MatX> solver;
  solver.setThreshold(kStaticsRankTolerance);
  solver.compute(s.asDiagonal() * A * s.asDiagonal());
  VecX x = s.asDiagonal() * VecX(solver.solve(VecX(s.asDiagonal() * b)));
  // Rotations do not add up like vectors: short steps far away.
  const double turn = x.head(nv).cwiseProduct(unit_).cwiseAbs().maxCoeff() / size_;
  if (turn > kLargestStep) x *= kLargestStep / turn;
  *dq = x.head(nv);
  *dlambda = x.tail(rows);
}

// Steps until nothing improves; the best state met.
Statics::State Statics::Iterate(const State& from, const Target& target, bool newton) {
  const auto merit = [](const State& s) {
    return std::max(s.residual / kBalanced, s.gap / kClosed);
  };
  State state = from, best;
  if (!target.held) state.F = target.F;
  VecX dq, dlambda;
  int stalls = 0;
  for (int i = 0; i <= (newton ? kMaxNewtonSteps : kMaxChord) && stalls <= kMaxStalls; ++i) {
    Evaluate(state, target);
    Measure(&state, target);
    if (!std::isfinite(state.residual)) break;
    state.iterations = from.iterations + i;
    const bool better = std::isnan(best.residual) || merit(state) < 0.5 * merit(best);
    stalls = better ? 0 : stalls + 1;
    if (std::isnan(best.residual) || merit(state) < merit(best)) best = state;
    if (newton && merit(state) < kNewtonMerit) break;  // its steps are dear
    if (newton) {
      NewtonStep(state, target, &dq, &dlambda);
    } else {
      CondensedStep(target.held ? held_ : applied_, f_, r_, &dq, &dlambda);
    }
    if (!dq.allFinite()) break;
    Apply(dq, dlambda, &state, target);
  }
  return best;
}

Statics::State Statics::Solve(const State& from, const Target& target) {
  State best = Iterate(from, target, false);
  if (best.converged()) return best;
  best = Iterate(from, target, true);
  if (best.converged() || target.held) return best;
  for (int steps = 2; steps <= kMaxLoadSteps; steps *= 4) {
    State state = from;
    for (int i = 1; i <= steps; ++i) {
      Target part = target;
      part.F = from.F + (target.F - from.F) * i / steps;
      state = Iterate(state, part, true);
      if (!state.converged()) break;
    }
    if (state.converged() && state.F == target.F) return state;
  }
  return best;
}

Statics::State Statics::UnderLoad(const State& from, const Vec6& F, double load_N) {
  Target target;
  target.F = F;
  target.load = F.isZero(0.0) ? load_N : LoadOf(F, size_);
  State start = from;
  start.iterations = 0;
  return Solve(start, target);
}

Statics::State Statics::Displaced(const State& base, const Vec6& D, double load_N) {
  Target target;
  target.held = true;
  target.load = load_N;
  Evaluate(base, target);
  const Pose X_WO = OutputPose();
  target.X_WO.linear() = ExpRotation(D.head<3>()) * X_WO.linear();
  target.X_WO.translation() = X_WO.translation() + D.tail<3>();
  State start = base;
  start.iterations = 0;
  return Solve(start, target);
}

bool Statics::LinearWrench(const Vec6& D, Vec6* F) {
  VecX r = VecX::Zero(system_->rows() + 6), dq, dlambda;
  r.tail<6>() = -D;
  CondensedStep(held_, VecX::Zero(engine_.m->nv), r, &dq, &dlambda);
  *F = dlambda.segment<6>(system_->rows());
  // The output may not be able to move so.
  const VecX reached = held_.J.topRows(r.size()) * dq + r;
  return reached.cwiseAbs().maxCoeff() <= kLinearTolerance * D.norm();
}

bool Statics::LinearDisplacement(const Vec6& F, Vec6* D) {
  Evaluate(Home(), Target{});
  const VecX f = J_o_.transpose() * F;
  VecX dq, dlambda;
  CondensedStep(applied_, f, VecX::Zero(system_->rows()), &dq, &dlambda);
  *D = J_o_ * dq;
  // A DOF without spring may give way.
  const VecX rest = f + applied_.J.transpose() * dlambda;
  double worst = 0.0;
  for (const int i : free_dofs_) worst = std::max(worst, std::abs(rest[i]) / unit_[i]);
  return worst <= kLinearTolerance * LoadOf(F, size_);
}

Vec6 Statics::Displacement(const State& base, const State& state) {
  Evaluate(base, Target{});
  const Pose X_0 = OutputPose();
  Evaluate(state, Target{});
  const Pose X_1 = OutputPose();
  Vec6 D;
  D << LogRotation(X_1.linear() * X_0.linear().transpose()), X_1.translation() - X_0.translation();
  return D;
}

VecX Statics::Deformations(const State& state) {
  Evaluate(state, Target{});
  VecX deformation(static_cast<Eigen::Index>(springs_.size()));
  for (size_t k = 0; k < springs_.size(); ++k) {
    const double position = springs_[k].tendon >= 0 ? data_->ten_length[springs_[k].tendon]
                                                    : data_->qpos[springs_[k].qpos];
    deformation[static_cast<Eigen::Index>(k)] = position - model_.springs[k].reference;
  }
  return deformation;
}

}  // namespace mbv::simulation

namespace mbv {
namespace {

using simulation::EngineError;
using simulation::EngineSession;
using simulation::Statics;

// Small loads move the output by no more than this fraction of the mechanism's size (or rad).
constexpr double kSmallMotion = 1e-4;
// Scaled eigenvalues of K below this fraction of the largest are zero.
constexpr double kSingular = 1e-9;
constexpr int kLevels = 3;  // load sizes: full, half, quarter

// Central differences at load sizes h, h/2, h/4 have errors in h², h⁴, …: Richardson's tableau.
struct Extrapolated {
  VecX value;
  VecX change;  // between the last two extrapolates of one order
};
Extrapolated Extrapolate(const std::array<VecX, kLevels>& D) {
  const VecX first = (4.0 * D[1] - D[0]) / 3.0, second = (4.0 * D[2] - D[1]) / 3.0;
  return {(16.0 * second - first) / 15.0, second - first};
}

RunSummary Trouble(Stop stop, const std::string& message) {
  return {.stop = stop, .message = message};
}

class Witness {
 public:
  Witness(const mjcf::CompliantModel& model, Statics* statics, const CompliantOptions& options,
          CompliantRun* run)
      : model_(model), statics_(*statics), options_(options), run_(*run) {
    const double L = statics_.size();
    size_ << 1, 1, 1, L, L, L;
  }

  RunSummary Measure(const std::vector<Vec6>& wrenches) {
    base_ = statics_.UnderLoad(statics_.Home(), Vec6::Zero(), options_.force_N);
    if (RunSummary summary = Note(base_, "without load"); !summary.ok()) return summary;
    if (RunSummary summary = LinearAnswers(); !summary.ok()) return summary;
    RunSummary end = singular_ ? MeasureStiffness() : MeasureCompliance();
    if (!end.ok()) return end;
    for (size_t k = 0; k < wrenches.size(); ++k) {
      RunSummary loaded = MeasureLoaded(wrenches[k], fmt::format("under wrench {}", k + 1));
      if (!loaded.ok()) end = loaded;
    }
    if (!end.ok() || !singular_) return end;
    return Trouble(Stop::kSingular,
                   fmt::format("the stiffness has rank {}: the output can move without force",
                               run_.result.rank));
  }

 private:
  // The worst residual counts for the run; a state that does not balance ends it.
  RunSummary Note(const Statics::State& state, const std::string& where) {
    if (!(state.residual <= run_.residual)) run_.residual = state.residual;
    if (state.converged()) return RunSummary::Done();
    RunSummary summary = Trouble(
        Stop::kNoConvergence,
        fmt::format("no static equilibrium {}: unbalanced force {:.2g} of the load, gap {:.2g}",
                    where, state.residual, state.gap));
    summary.where = where;
    summary.names_where = true;
    summary.amount = state.residual;
    return summary;
  }

  // First-order K and C at the unloaded pose: the rank, and how large small loads may be.
  RunSummary LinearAnswers() {
    for (int i = 0; i < 6; ++i) {
      Vec6 column;
      if (!statics_.LinearWrench(Vec6::Unit(i), &column)) {
        return Trouble(Stop::kSingular,
                       "the output is rigidly held in some direction: infinite stiffness");
      }
      K_linear_.col(i) = column;
    }
    const Mat6 scaled = size_.asDiagonal() * K_linear_ * size_.asDiagonal();
    const VecX eigenvalues =
        Eigen::SelfAdjointEigenSolver<Mat6>(Mat6(0.5 * (scaled + scaled.transpose())))
            .eigenvalues();
    const double largest = eigenvalues.cwiseAbs().maxCoeff();
    run_.result.rank = static_cast<int>((eigenvalues.array() > kSingular * largest).count());
    singular_ = run_.result.rank < 6;
    if (singular_) return RunSummary::Done();
    for (int i = 0; i < 6; ++i) {
      Vec6 column;
      if (!statics_.LinearDisplacement(Vec6::Unit(i), &column)) {
        return Trouble(Stop::kSingular, "a load on the output finds no resistance");
      }
      C_linear_.col(i) = column;
    }
    return RunSummary::Done();
  }

  // The output's displacement and all springs' deformations per unit of wrench i.
  RunSummary Respond(int i, Extrapolated* response) {
    const double motion = C_linear_.col(i).cwiseQuotient(size_).cwiseAbs().maxCoeff();
    const double allowed = i < 3 ? options_.moment_Nm : options_.force_N;
    double load = std::min(allowed, kSmallMotion / motion);
    std::array<VecX, kLevels> D;
    for (VecX& difference : D) {
      std::array<VecX, 2> seen;
      for (const int side : {0, 1}) {
        const Vec6 F = (side == 0 ? load : -load) * Vec6::Unit(i);
        const Statics::State state = statics_.UnderLoad(base_, F, options_.force_N);
        if (RunSummary summary = Note(state, fmt::format("under small load {}", i + 1));
            !summary.ok()) {
          return summary;
        }
        seen[side].resize(6 + static_cast<Eigen::Index>(model_.springs.size()));
        seen[side] << statics_.Displacement(base_, state), statics_.Deformations(state);
      }
      difference = (seen[0] - seen[1]) / (2.0 * load);
      load /= 2.0;
    }
    *response = Extrapolate(D);
    return RunSummary::Done();
  }

  RunSummary MeasureCompliance() {
    Mat6 C, change;
    MatX deformation(model_.springs.size(), 6);
    for (int i = 0; i < 6; ++i) {
      Extrapolated response;
      if (RunSummary summary = Respond(i, &response); !summary.ok()) return summary;
      C.col(i) = response.value.head<6>();
      change.col(i) = response.change.head<6>();
      deformation.col(i) = response.value.tail(deformation.rows());
    }
    run_.extrapolation_error = Norm(change, size_.cwiseInverse()) / Norm(C, size_.cwiseInverse());
    run_.result.C = 0.5 * (C + C.transpose());
    const Mat6 K = run_.result.C.inverse();
    run_.result.K = 0.5 * (K + K.transpose());
    AddShares(deformation);
    return RunSummary::Done();
  }

  // C_e(i, j) = Σ k δ_i δ_j over the springs of an element.
  void AddShares(const MatX& deformation) {
    std::vector<ComplianceShare>& shares = run_.result.shares;
    for (size_t k = 0; k < model_.springs.size(); ++k) {
      const mjcf::ElasticSpring& spring = model_.springs[k];
      if (shares.empty() || shares.back().element != spring.element) {
        shares.push_back({.element = spring.element});
      }
      const Vec6 delta = deformation.row(static_cast<Eigen::Index>(k)).transpose();
      shares.back().C += spring.stiffness * delta * delta.transpose();
    }
  }

  // K where C does not exist: the wrench that holds the output in displaced poses.
  RunSummary MeasureStiffness() {
    const double turn = K_linear_.leftCols<3>().topRows<3>().norm();
    const double shift = K_linear_.rightCols<3>().bottomRows<3>().norm();
    Mat6 K, change;
    for (int i = 0; i < 6; ++i) {
      double step = i < 3 ? std::min(kSmallMotion, options_.moment_Nm / turn)
                          : std::min(kSmallMotion * statics_.size(), options_.force_N / shift);
      std::array<VecX, kLevels> D;
      for (VecX& difference : D) {
        const auto plus = statics_.Displaced(base_, step * Vec6::Unit(i), options_.force_N);
        const auto minus = statics_.Displaced(base_, -step * Vec6::Unit(i), options_.force_N);
        for (const auto* state : {&plus, &minus}) {
          const std::string where = fmt::format("at small displacement {}", i + 1);
          if (RunSummary summary = Note(*state, where); !summary.ok()) return summary;
        }
        difference = (plus.F - minus.F) / (2.0 * step);
        step /= 2.0;
      }
      const Extrapolated column = Extrapolate(D);
      K.col(i) = column.value;
      change.col(i) = column.change;
    }
    run_.extrapolation_error = Norm(change, size_) / Norm(K, size_);
    run_.result.K = 0.5 * (K + K.transpose());
    return RunSummary::Done();
  }

  [[nodiscard]] static double Norm(const Mat6& A, const Vec6& scale) {
    return (scale.asDiagonal() * A * scale.asDiagonal()).norm();
  }

  RunSummary MeasureLoaded(const Vec6& F, const std::string& where) {
    const Statics::State state = statics_.UnderLoad(base_, F, options_.force_N);
    run_.loaded.push_back({.residual = state.residual, .iterations = state.iterations});
    if (RunSummary summary = Note(state, where); !summary.ok()) return summary;
    run_.loaded.back().displacement = statics_.Displacement(base_, state);
    return RunSummary::Done();
  }

  const mjcf::CompliantModel& model_;
  Statics& statics_;
  const CompliantOptions& options_;
  CompliantRun& run_;
  Statics::State base_;
  Vec6 size_;  // of a unit step in each component
  Mat6 K_linear_ = Mat6::Zero(), C_linear_ = Mat6::Zero();
  bool singular_ = false;
};

RunSummary Simulate(const Mechanism& mechanism, const std::vector<Pose>& X_WB, int output,
                    const std::vector<Vec6>& wrenches, const CompliantOptions& options,
                    CompliantRun* run) {
  std::string error;
  const auto model = mjcf::MakeCompliantModel(mechanism, X_WB, output, &error);
  if (!model) return Trouble(Stop::kUnsupported, error);
  if (model->springs.empty()) return Trouble(Stop::kUnsupported, "nothing is elastic");
  if (model->mechanism.outputs[0].body == 0) {
    return Trouble(Stop::kSingular, "the output is rigidly fixed to the world");
  }
  run->mjcf = model->mjcf;
  std::vector<std::string> warnings;
  const EngineSession session(&warnings);
  try {
    RunSummary summary;
    Statics statics(*model, &summary);
    if (!summary.ok()) return summary;
    return Witness(*model, &statics, options, run).Measure(wrenches);
  } catch (const EngineError& e) {
    return Trouble(Stop::kEngineFailure, e.what());
  }
}

}  // namespace

CompliantRun SimulateStiffness(const Mechanism& mechanism, const std::vector<Pose>& X_WB,
                               int output, const std::vector<Vec6>& wrenches,
                               const CompliantOptions& options) {
  MBV_DEMAND(options.force_N > 0.0, options.force_N);
  MBV_DEMAND(options.moment_Nm > 0.0, options.moment_Nm);
  const auto start = std::chrono::steady_clock::now();
  CompliantRun run;
  run.result.summary = Simulate(mechanism, X_WB, output, wrenches, options, &run);
  run.result.summary.wall_s =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return run;
}

}  // namespace mbv
