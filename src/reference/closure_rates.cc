// Velocities and accelerations of closed poses, and idle spins: parts of ClosureSolver.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/spatial.h"
#include "reference/closure_failure.h"
#include "reference/closure_solver.h"

namespace mbv::internal {
namespace {

// Rates that miss by this share of the largest are as good as they can be.
constexpr double kRatesMiss = 4 * kEps;
// Solutions go on below it, but while that helps; what misses more than the second is wrong.
constexpr double kRatesGood = 1e-12, kRatesAccurate = 1e-9;
constexpr int kMostSolutions = 12;
// Velocities that missed by more when the biases were evaluated have changed these.
constexpr double kRatesSettled = 1e-13;

// Of the command rows; those of idle spins, behind them, are zero.
void PutAtEnd(const VecX& values, Eigen::Index count, VecX* rates) {
  rates->tail(count).setZero();
  rates->segment(rates->size() - count, values.size()) = values;
}

}  // namespace

double ClosureSolver::Miss(const VecX& rates, const std::vector<Vec6>& per_body) {
  double largest_m = 0.0, largest_rad = 0.0;
  missing_.resize(system_.size());
  double* missing = missing_.data();
  for (const int i : selection_) {
    const double miss = rates[i] - rows_.Rate(i, per_body.data());
    double& largest = rows_.angular.data()[i] != 0 ? largest_rad : largest_m;
    if (std::isnan(miss)) return kNan;
    largest = std::max(largest, std::abs(miss));
    *missing++ = miss;
  }
  return std::max(largest_rad, largest_m / length_);
}

void ClosureSolver::AddMissing(std::vector<Vec6>* per_body) {
  const VecX change = system_.SolveTransposed(missing_);
  for (size_t b = 1; b < per_body->size(); ++b) {
    (*per_body)[b] += change.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
  }
}

// The factors belong to a pose nearby; refinement against the true rows restores all digits.
ClosureSolver::Refinement ClosureSolver::Refine(const VecX& rates, std::vector<Vec6>* per_body) {
  double scale = 0.0;
  for (const int i : selection_) {
    scale = std::max(scale, std::abs(rates[i]) / system_.RateUnit(rows_.angular[i]));
  }
  Refinement refinement;
  double previous = std::numeric_limits<double>::infinity();
  for (int solutions = 0;; ++solutions) {
    const double largest = Miss(rates, *per_body);
    if (solutions == 0) refinement.began_settled = largest <= kRatesSettled * scale;
    if (scale == 0.0 && !std::isnan(largest)) {  // exactly, where sums leave round-off
      std::ranges::fill(*per_body, Vec6::Zero());
      refinement.accurate = true;
      break;
    }
    refinement.accurate = largest <= kRatesAccurate * scale;
    if (largest <= kRatesMiss * scale || solutions == kMostSolutions) break;
    if (largest < kRatesGood * scale && largest > 0.1 * previous) break;
    AddMissing(per_body);
    previous = largest;
  }
  return refinement;
}

RunSummary ClosureSolver::SolveRates(const CommandSample& command) {
  // Near a singular pose the factors from the way here are too far off: take those of the pose.
  for (const bool refactor : {false, true}) {
    if (refactor) {
      if (!system_.Factor(rows_, selection_, false)) break;
      if (system_.determinant_sign() != orientation_) break;
      const double rounding = Rounding(states_.X_WB) / length_;
      if (system_.SmallestSingularValue(3) < SingularValueLimit(rounding)) break;
    }
    rates_.setZero(rows_.size());
    PutAtEnd(command.velocity, rows_.size() - joint_rows_, &rates_);
    Miss(rates_, states_.V_WB);
    AddMissing(&states_.V_WB);
    EvaluateHere();
    const Refinement velocity = Refine(rates_, &states_.V_WB);
    if (!velocity.began_settled) EvaluateHere();
    PutAtEnd(command.acceleration, rows_.size() - joint_rows_, &rates_);
    rates_ -= Eigen::Map<const VecX>(rows_.bias.data(), rows_.size());
    const Refinement acceleration = Refine(rates_, &states_.A_WB);
    if (velocity.accurate && acceleration.accurate) return RunSummary::Done();
  }
  const double sigma = system_.SmallestSingularValue(3);
  RunSummary summary =
      Singular(fmt::format("the commands do not determine the velocities at this pose (smallest "
                           "singular value {:.1e})",
                           sigma));
  summary.amount = sigma;
  summary.unit = std::string("1");
  return summary;
}

// Rows at the pose found; biases depend on the velocities.
void ClosureSolver::EvaluateHere() {
  trial_.states = states_;
  trial_.near_values = near_values_;
  EvaluateRows(&trial_);
}

RunSummary ClosureSolver::TurnBack(const std::vector<double>& turns) {
  Trial trial{states_, near_values_};
  for (size_t k = 0; k < spins_.size(); ++k) {
    const Spin& spin = spins_[k];
    const Pose X_WB = trial.states.X_WB[static_cast<size_t>(spin.bodies[0])];
    const Mat3 back = ExpRotation(-turns[k] * (X_WB.linear() * spin.n_B));
    const Vec3 p_WP = X_WB * spin.p_BP;
    for (const int b : spin.bodies) {
      Pose& X = trial.states.X_WB[static_cast<size_t>(b)];
      X.linear() = back * X.linear();
      X.translation() = p_WP + back * (X.translation() - p_WP);
    }
  }
  if (Newton(target_, false, &trial) != Step::kDone) {
    return ExplainUnreached(mechanism_, commands_, target_, states_, near_values_);
  }
  Accept(target_, &trial);
  return RunSummary::Done();
}

// Where the way to the first sample leaves the idle spins depends on how it was cut into steps.
RunSummary ClosureSolver::TakeLeastTurns() {
  if (spins_.empty()) return RunSummary::Done();
  std::vector<double> turns;
  for (const Spin& spin : spins_) {
    const Pose& X_WB = states_.X_WB[static_cast<size_t>(spin.bodies[0])];
    turns.push_back(TurnFromHome(mechanism_, spin, X_WB.linear()));
  }
  return TurnBack(turns);
}

MovingDirection ClosureSolver::LineOf(const Spin& spin) const {
  const auto b = static_cast<size_t>(spin.bodies[0]);
  return DirectionOf(states_.X_WB[b].linear() * spin.n_B, states_.V_WB[b].head<3>(),
                     states_.A_WB[b].head<3>());
}

// The prediction transports the lines to a lower order, and Newton not at all.
RunSummary ClosureSolver::TransportTurns(const CommandSample& command) {
  if (spins_.empty()) return RunSummary::Done();
  const double h = command.time_s - predictor_.last_s();
  if (last_lines_.size() == spins_.size() && h > 0.0) {
    std::vector<double> turns;
    for (size_t k = 0; k < spins_.size(); ++k) {
      const Mat3& R_WB = states_.X_WB[static_cast<size_t>(spins_[k].bodies[0])].linear();
      const MovingDirection line = LineOf(spins_[k]);
      const Mat3 R = Transported(last_lines_[k].R_WB, last_lines_[k].line, line, h);
      turns.push_back(TurnBeyond(R, R_WB, line.n));
    }
    if (RunSummary summary = TurnBack(turns); !summary.ok()) return summary;
    if (RunSummary summary = SolveRates(command); !summary.ok()) return summary;
  }
  last_lines_.clear();
  for (const Spin& spin : spins_) {
    const auto b = static_cast<size_t>(spin.bodies[0]);
    last_lines_.push_back({LineOf(spin), states_.X_WB[b].linear()});
  }
  return RunSummary::Done();
}

}  // namespace mbv::internal
