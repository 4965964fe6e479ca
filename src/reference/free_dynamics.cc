#include "reference/free_dynamics.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "mechanism/reach.h"
#include "reference/closure_solver.h"
#include "reference/element_forces.h"
#include "reference/force_solver.h"
#include "reference/sample_recorder.h"
#include "reference/square_system.h"

namespace mbv::internal {

Hermite::Hermite(const std::vector<double>& times, const std::vector<VecX>& values,
                 const std::vector<VecX>& derivatives) {
  MBV_DEMAND(!times.empty() && values.size() == times.size(), times.size());
  MBV_DEMAND(derivatives.size() == times.size(), derivatives.size());
  const size_t n = 2 * times.size();
  for (size_t i = 0; i < times.size(); ++i) {
    for (int twice = 0; twice < 2; ++twice) {
      nodes_.push_back(times[i]);
      coefficients_.push_back(values[i]);
    }
  }
  // Divided differences in place; where both nodes are one, the derivative.
  for (size_t order = 1; order < n; ++order) {
    for (size_t i = n - 1; i >= order; --i) {
      if (order == 1 && i % 2 == 1) {
        coefficients_[i] = derivatives[i / 2];
      } else {
        coefficients_[i] =
            (coefficients_[i] - coefficients_[i - 1]) / (nodes_[i] - nodes_[i - order]);
      }
    }
  }
}

void Hermite::Evaluate(double t, VecX* value, VecX* derivative) const {
  *value = coefficients_.back();
  derivative->setZero(value->size());
  for (size_t i = coefficients_.size() - 1; i-- > 0;) {
    *derivative = *value + (t - nodes_[i]) * *derivative;
    *value = coefficients_[i] + (t - nodes_[i]) * *value;
  }
}

namespace {

// A row with a smaller pivot (relative) is lost: accelerations divide by it.
constexpr double kLost = 1e-9;
// A row beyond the expected rank with a larger pivot contradicts it; closed loops leave 1e-11.
constexpr double kExtra = 1e-6;
constexpr int kMostCorrections = 12;
// Poses are closed to this [rad, characteristic lengths] or to rounding; where Newton no longer
// helps, to this many times that.
constexpr double kClosed = 1e-13, kStalled = 100.0;

}  // namespace

FreeDynamics::FreeDynamics(const Mechanism& mechanism, const Motion& motion)
    : mechanism_(mechanism),
      motion_(motion),
      length_(CharacteristicLength(mechanism)),
      lever_(LongestLever(mechanism)),
      size_(6 * (static_cast<int>(mechanism.bodies.size()) - 1)),
      dofs_(static_cast<int>(motion.initial.size())),
      spins_(IdleSpins(mechanism)),
      followed_(FollowedAngles(mechanism, motion)),
      factors_(mechanism.bodies.size(), length_, dofs_),
      near_(mechanism, length_),
      scales_(mechanism.bodies.size(), length_),
      loaded_(LoadedElements(mechanism)) {
  body_scale_.setOnes(size_);
  for (int i = 0; i < size_; i += 6) body_scale_.segment<3>(i).setConstant(1.0 / length_);
  EvaluateMotion(motion, 0.0, &command_);
  for (size_t k = 0; k < motion.commands.size(); ++k) {
    const size_t terms = motion.commands[k].terms.size();
    const double start = terms == 1 ? command_.position[static_cast<Eigen::Index>(k)] : 0.0;
    near_values_.emplace_back(terms, start);
  }
}

void FreeDynamics::FillRows(double t_s, const BodyStates& states) {
  EvaluateMotion(motion_, t_s, &command_);
  rows_.Clear();
  for (const Joint& joint : mechanism_.joints) {
    const ConstraintRows rows = RowsOf(joint, states, false);
    rows_.Add(rows, rows.rows);
  }
  for (const CouplingRow& row : CouplingRows(mechanism_, states)) rows_.Add(row);
  for (const Spin& spin : spins_) rows_.Add(IdleRow(spin, states), true);
  joint_rows_ = rows_.size();
  for (size_t k = 0; k < motion_.commands.size(); ++k) {
    rows_.Add(mechanism_, motion_.commands[k], states, &near_values_[k]);
    rows_.value.back() -= command_.position[static_cast<Eigen::Index>(k)];
  }
}

void FreeDynamics::Factor(double t_s, const BodyStates& states) {
  FillRows(t_s, states);
  factors_.Factor(rows_);
}

std::string FreeDynamics::SoftJoint(const BodyStates& states) const {
  return size_ == dofs_ ? "" : MostMovingJoint(mechanism_, states, factors_.WeakestMotion());
}

RunSummary FreeDynamics::Singular(double t_s, const BodyStates& states) const {
  RunSummary summary;
  summary.stop = Stop::kSingular;
  summary.time_s = t_s;
  summary.where = SoftJoint(states);
  summary.names_where = true;
  summary.amount = pivot();
  summary.unit = std::string("1");
  summary.message = fmt::format(
      "the loops lose a constraint at this pose: in addition to the {} degree{} of freedom of the "
      "mechanism, {} is uncontrolled there, so the way on is not determined (relative pivot "
      "{:.1e})",
      dofs_ + static_cast<int>(motion_.commands.size()),
      dofs_ + motion_.commands.size() == 1 ? "" : "s", summary.where, pivot());
  return summary;
}

RunSummary FreeDynamics::CheckDofs(double t_s) const {
  if (!(factors_.extra() > kExtra)) return RunSummary::Done();
  RunSummary summary;
  summary.stop = Stop::kUnsupported;
  summary.time_s = t_s;
  summary.amount = factors_.extra();
  summary.unit = std::string("1");
  summary.message = fmt::format(
      "the loops and commands leave fewer than the {} degrees of freedom that have initial values: "
      "the home pose was singular, or a command contradicts another (relative pivot {:.1e})",
      dofs_, summary.amount);
  return summary;
}

void FreeDynamics::AddDriveForces(double t_s, const BodyStates& states,
                                  std::vector<Vec6>* wrench_W) const {
  for (const DriveForce& drive : motion_.forces) {
    const ScalarRow row = DriveRow(mechanism_, mechanism_.drives[drive.drive], states);
    const double force = ForceAtStates(mechanism_, states, drive, t_s);
    (*wrench_W)[row.parent] += force * row.J_parent;
    (*wrench_W)[row.child] += force * row.J_child;
  }
}

RunSummary FreeDynamics::Accelerate(double t_s, BodyStates* states) {
  FollowCouplings(mechanism_, states);
  FollowElements(mechanism_, states);
  FollowAngles(mechanism_, followed_, states);
  Factor(t_s, *states);
  states->engaged = command_.engaged;
  states->carried = command_.carried;
  if (!(pivot() > kLost)) return Singular(t_s, *states);
  if (RunSummary summary = CheckDofs(t_s); !summary.ok()) return summary;
  VecX rates = -Eigen::Map<const VecX>(rows_.bias.data(), rows_.size());
  rates.tail(command_.acceleration.size()) += command_.acceleration;
  const VecX A_p = factors_.LeastMotion(rates, false);
  Unstack(A_p, &states->A_WB);

  std::vector<Vec6> required, drives(mechanism_.bodies.size(), Vec6::Zero());
  RequiredWrenches(mechanism_, *states, command_.loads, SignsAt(*states), &required);
  AddDriveForces(t_s, *states, &drives);
  if (!Stack(required).allFinite() || !Stack(drives).allFinite()) {
    RunSummary summary = CheckForcesAt(mechanism_, *states, t_s, command_.loads, motion_.forces);
    if (!summary.ok()) return summary;
  }
  if (RunSummary summary = CheckSpinsIdle(spins_, *states, required, length_); !summary.ok()) {
    summary.time_s = t_s;
    return summary;
  }
  const MatX R = Motions();
  MatX& inertia = rest_.H;
  inertia = R.transpose() * Momenta(mechanism_, *states, R);
  const Eigen::LDLT<MatX> factors(inertia);
  const VecX D = factors.vectorD();
  if (!(D.minCoeff() > kEps * D.maxCoeff())) {
    const Eigen::SelfAdjointEigenSolver<MatX> eigen(inertia);
    RunSummary summary;
    summary.stop = Stop::kSingular;
    summary.time_s = t_s;
    summary.where = MostMovingJoint(mechanism_, *states, R * eigen.eigenvectors().col(0));
    summary.names_where = true;
    summary.message = fmt::format(
        "a degree of freedom near {} has no inertia, so forces do not determine its acceleration",
        summary.where);
    return summary;
  }
  rest_.f = R.transpose() * (Stack(drives) - Stack(required));
  FillRest(*states, A_p, R);
  Unstack(A_p + R * MotionBy(rest_.f), &states->A_WB);
  if (loaded_.empty()) return RunSummary::Done();
  if (RunSummary summary = AddLoadFriction(t_s, *states, R, A_p); !summary.ok()) return summary;
  Unstack(A_p + R * MotionBy(rest_.f), &states->A_WB);
  return RunSummary::Done();
}

void FreeDynamics::ChooseNear() {
  if (near_.chosen()) return;
  std::vector<int> rows = factors_.IndependentRows(rows_);
  if (static_cast<int>(rows.size()) == size_ - dofs_) near_.Choose(std::move(rows));
}

RunSummary FreeDynamics::AccelerateNear(double t_s, BodyStates* states) {
  if (!near_.chosen() || !phase_.held.empty() || !loaded_.empty()) return Accelerate(t_s, states);
  FollowCouplings(mechanism_, states);
  FollowElements(mechanism_, states);
  FollowAngles(mechanism_, followed_, states);
  FillRows(t_s, *states);
  states->engaged = command_.engaged;
  states->carried = command_.carried;
  VecX rates = -Eigen::Map<const VecX>(rows_.bias.data(), rows_.size());
  rates.tail(command_.acceleration.size()) += command_.acceleration;
  Unstack(VecX::Zero(size_), &states->A_WB);
  const VecX needed = NeededWrenches(t_s, *states);
  if (!needed.allFinite()) {
    RunSummary summary = CheckForcesAt(mechanism_, *states, t_s, command_.loads, motion_.forces);
    if (!summary.ok()) return summary;
  }
  std::vector<Vec6> required(mechanism_.bodies.size(), Vec6::Zero());
  Unstack(needed, &required);
  if (RunSummary summary = CheckSpinsIdle(spins_, *states, required, length_); !summary.ok()) {
    summary.time_s = t_s;
    return summary;
  }
  VecX A;
  if (!near_.Solve(*states, rows_, -needed, rates, &A)) return Accelerate(t_s, states);
  Unstack(A, &states->A_WB);
  return RunSummary::Done();
}

VecX FreeDynamics::MotionBy(const VecX& f) {
  if (phase_.held.empty()) return rest_.H.ldlt().solve(f);
  RestSystem by = rest_;
  by.f = f;
  return HeldMotion(by);
}

FreeDynamics::Held FreeDynamics::HeldRows(const BodyStates& states) const {
  const auto count = static_cast<Eigen::Index>(phase_.held.size());
  Held held{.gradients = MatX(count, size_), .gaps = VecX(count), .bias = VecX(count)};
  if (count == 0) return held;
  const std::vector<ScalarRow> rows = ElementRows(mechanism_, states);
  for (size_t k = 0; k < phase_.held.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const ScalarRow& row = rows[phase_.held[k]];
    held.gradients.row(at) = GradientOf(row, mechanism_.bodies.size()).transpose();
    held.gaps[at] = row.value - phase_.at[k];
    held.bias[at] = row.bias;
  }
  return held;
}

VecX FreeDynamics::MotionOfHeld(const MatX& rows, const VecX& amount) const {
  if (rows.rows() == 0) return VecX::Zero(size_);
  const MatX R = Motions();
  Eigen::CompleteOrthogonalDecomposition<MatX> cod;
  cod.setThreshold(kLost);
  cod.compute(rows * R);
  return R * cod.solve(amount);
}

void FreeDynamics::FillRest(const BodyStates& states, const VecX& A_p, const MatX& R) {
  if (phase_.held.empty()) return;
  const Held held = HeldRows(states);
  rest_.G = held.gradients * R;
  rest_.d = held.gradients * A_p + held.bias;
  rest_.most.resize(held.gaps.size());
  for (size_t k = 0; k < phase_.held.size(); ++k) {
    const auto* friction = std::get_if<FrictionLaw>(&mechanism_.elements[phase_.held[k]].law);
    // Where it holds nothing, any force moves it. A rigid stop in touch yields to none.
    rest_.most[static_cast<Eigen::Index>(k)] =
        friction == nullptr ? 1.0
                            : std::max(states.Engaged(phase_.held[k]) * friction->half_band(),
                                       std::numeric_limits<double>::min());
  }
}

RunSummary FreeDynamics::Project(double t_s, BodyStates* states, double* moved) {
  if (moved != nullptr) *moved = 0.0;
  double open = kNan, previous = std::numeric_limits<double>::infinity();
  for (int i = 0; i < kMostCorrections; ++i) {
    FollowCouplings(mechanism_, states);
    FollowElements(mechanism_, states);
    FollowAngles(mechanism_, followed_, states);
    Factor(t_s, *states);
    const VecX r = Eigen::Map<const VecX>(rows_.value.data(), rows_.size());
    const Held held = HeldRows(*states);
    open = LargestOpen();
    for (size_t k = 0; k < phase_.held.size(); ++k) {
      const bool length = ActsOnLength(mechanism_, mechanism_.elements[phase_.held[k]]);
      open = std::max(open,
                      std::abs(held.gaps[static_cast<Eigen::Index>(k)]) / (length ? length_ : 1.0));
    }
    if (!std::isfinite(open)) break;
    const double tolerance = std::max(kClosed, Rounding(*states));
    if (open < tolerance || (open < kStalled * tolerance && open > 0.5 * previous)) {
      VecX rates = VecX::Zero(rows_.size());
      rates.tail(command_.velocity.size()) = command_.velocity;
      rates -= rows_.Rates(states->V_WB);
      VecX V = Stack(states->V_WB) + factors_.LeastMotion(rates, true);
      V -= MotionOfHeld(held.gradients, held.gradients * V);
      Unstack(V, &states->V_WB);
      FollowDriven(mechanism_, states);
      ChooseNear();
      return RunSummary::Done();
    }
    previous = open;
    VecX step = factors_.LeastMotion(-r, true);
    step -= MotionOfHeld(held.gradients, held.gradients * step + held.gaps);
    if (moved != nullptr) *moved += SizeOf(step, length_);
    MoveBodies(step, states);
  }
  RunSummary summary;
  summary.stop = Stop::kNoConvergence;
  summary.time_s = t_s;
  summary.amount = open * length_;
  summary.unit = std::string("m");
  summary.message = fmt::format("the loops cannot be closed again (open by {:.3g} m or {:.3g} rad)",
                                summary.amount, open);
  return summary;
}

double FreeDynamics::LargestOpen() const {
  double open = 0.0;
  for (int i = 0; i < rows_.size(); ++i) {
    const double size = std::abs(rows_.value[i]) / (rows_.angular[i] ? 1.0 : length_);
    if (std::isnan(size)) return size;
    open = std::max(open, size);
  }
  return open;
}

double FreeDynamics::Rounding(const BodyStates& states) const {
  double largest_angle = 0.0;
  for (Eigen::Index k = 0; k < command_.position.size(); ++k) {
    if (!rows_.angular[joint_rows_ + k]) continue;
    largest_angle = std::max(largest_angle, std::abs(command_.position[k]));
  }
  for (const CouplingRow& row : CouplingRows(mechanism_, states)) {
    if (row.angular) largest_angle = std::max(largest_angle, row.LargestPiece());
  }
  return std::max(GapRounding(Reach(lever_, states.X_WB)) / length_, 32 * kEps * largest_angle);
}

void FreeDynamics::Gaps(const BodyStates& states, double* position_m, double* rotation_rad) const {
  *position_m = *rotation_rad = 0.0;
  for (const Joint& joint : mechanism_.joints) {
    const ConstraintRows rows = RowsOf(joint, states, false);
    for (int i = 0; i < rows.rows; ++i) {
      double* gap = i < rows.translation_rows ? position_m : rotation_rad;
      *gap = std::max(*gap, std::abs(rows.residual[i]));
    }
  }
  for (const CouplingRow& row : CouplingRows(mechanism_, states)) {
    double* gap = row.angular ? rotation_rad : position_m;
    *gap = std::max(*gap, std::abs(row.value));
  }
}

}  // namespace mbv::internal
