#include "reference/closure_solver.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/demand.h"
#include "core/spatial.h"
#include "kinematics/element_rows.h"
#include "kinematics/idle_rows.h"
#include "reference/closure_failure.h"

namespace mbv::internal {
namespace {

// A Newton solution farther than this from its prediction [rad, characteristic lengths] may lie on
// another branch; the way there is then divided into steps.
constexpr double kTrustedCorrection = 0.2;
// Redundant rows may miss by this [rad, characteristic lengths] and rounding.
constexpr double kOpen = 1e-9;
// Residuals below this share of their tolerances need no further step.
constexpr double kRoundOff = 1e-2;
// A step that is round-off itself [rad, characteristic lengths]: rows are not evaluated again.
constexpr double kNoStep = 1e-14;
constexpr int kSmallestStep = 4096;  ///< the way to a sample is cut into at most this many steps

std::vector<Command> AllCommands(const Mechanism& mechanism, const Motion& motion) {
  std::vector<Command> commands = motion.commands;
  for (size_t p = 0; p < mechanism.prescribed.size(); ++p) {
    const auto commanded = [&](const Command& command) {
      return std::any_of(command.terms.begin(), command.terms.end(), [&](const auto& term) {
        return term.coordinate.kind == Coordinate::Kind::kPrescribed &&
               term.coordinate.index == static_cast<int>(p);
      });
    };
    if (std::any_of(commands.begin(), commands.end(), commanded)) continue;
    const Prescribed& prescribed = mechanism.prescribed[p];
    commands.push_back({.name = prescribed.name,
                        .terms = {{{Coordinate::Kind::kPrescribed, static_cast<int>(p), 0}, 1.0}},
                        .profile = Constant(mechanism.joints[prescribed.joint].home[0])});
  }
  return commands;
}

// A value of the coordinate at home that says which turn an angle is in.
double HomeTurn(const Mechanism& mechanism, const Coordinate& coordinate, double commanded) {
  return coordinate.kind == Coordinate::Kind::kOutput ? commanded
                                                      : HomeValue(mechanism, coordinate);
}

RunSummary Failed(Stop stop, const std::string& message) {
  RunSummary summary;
  summary.stop = stop;
  summary.message = message;
  return summary;
}

}  // namespace

void MoveBodies(const VecX& twists, BodyStates* states) {
  for (size_t b = 1; b < states->X_WB.size(); ++b) {
    const auto at = 6 * (static_cast<Eigen::Index>(b) - 1);
    Pose& X = states->X_WB[b];
    const Mat3 R = ExpRotation(twists.segment<3>(at)) * X.linear();
    // One Newton step towards the nearest rotation.
    X.linear() = 0.5 * R * (3.0 * Mat3::Identity() - R.transpose() * R);
    X.translation() += twists.segment<3>(at + 3);
  }
}

ClosureSolver::ClosureSolver(const Mechanism& mechanism, const Motion& motion,
                             const ReferenceOptions& options)
    : mechanism_(mechanism),
      options_(options),
      length_(CharacteristicLength(mechanism)),
      lever_(LongestLever(mechanism)),
      commands_(AllCommands(mechanism, motion)),
      spins_(IdleSpins(mechanism)),
      system_(mechanism.bodies.size(), length_),
      predictor_(length_) {
  MBV_DEMAND(mechanism.X_WB_home.size() == mechanism.bodies.size(), mechanism.name);
  states_.Resize(mechanism.bodies.size());
  states_.X_WB = mechanism.X_WB_home;
}

void ClosureSolver::EvaluateRows(Trial* trial) {
  rows_.Clear();
  for (const Joint& joint : mechanism_.joints) {
    const ConstraintRows rows = RowsOf(joint, trial->states, false);
    rows_.Add(rows, rows.rows);
  }
  first_coupling_ = rows_.size();
  coupled_size_.clear();
  for (const CouplingRow& row : FollowCouplings(mechanism_, &trial->states)) {
    rows_.Add(row);
    coupled_size_.push_back(row.LargestPiece());
  }
  joint_rows_ = rows_.size();
  for (size_t k = 0; k < commands_.size(); ++k) {
    rows_.Add(mechanism_, commands_[k], trial->states, &trial->near_values[k]);
  }
  for (const Spin& spin : spins_) rows_.Add(IdleRow(spin, trial->states), true);
}

VecX ClosureSolver::Residual(const VecX& target) const {
  VecX r = Eigen::Map<const VecX>(rows_.value.data(), rows_.size());
  r.tail(target.size()) -= target;
  return r;
}

double ClosureSolver::Openness(const VecX& residual, const VecX& target,
                               const std::vector<Pose>& X_WB) const {
  const double closed_m = std::max(options_.closure_tolerance_m * length_, Rounding(X_WB));
  double openness = 0.0;
  for (int k = 0; k < system_.size(); ++k) {
    const int row = selection_[k];
    const double coordinate = row < first_coupling_ ? 0.0
                              : row < joint_rows_   ? coupled_size_[row - first_coupling_]
                                                    : std::abs(target[row - joint_rows_]);
    // Angles count turns, and both they and lengths may be large beside the mechanism.
    const double tolerance = std::max(rows_.angular[row] ? options_.closure_tolerance_m : closed_m,
                                      32 * kEps * coordinate);
    const double open = std::abs(residual[k]) / tolerance;
    if (std::isnan(open)) return open;
    openness = std::max(openness, open);
  }
  return openness;
}

RunSummary ClosureSolver::SelectRows() {
  selection_ = system_.IndependentRows(rows_, 0, joint_rows_);
  selection_is_new_ = true;
  orientation_ = 0;
  const int freedoms = system_.size() - static_cast<int>(selection_.size() + spins_.size());
  if (freedoms != static_cast<int>(commands_.size())) {
    return Failed(Stop::kUnsupported,
                  fmt::format("the joints leave {} freedoms, but {} coordinates are commanded",
                              freedoms, commands_.size()));
  }
  for (int k = joint_rows_; k < rows_.size(); ++k) selection_.push_back(k);
  return RunSummary::Done();
}

bool ClosureSolver::SelectAnew() {
  if (static_cast<int>(selection_.size()) == rows_.size()) return false;
  constexpr double kRegular = 1e-2;  // smallest singular value, clearly away from a singular pose
  EvaluateHere();
  const std::vector<int> before = std::exchange(selection_, {});
  const int orientation = orientation_;
  if (SelectRows().ok() && selection_ != before && system_.Factor(rows_, selection_, true) &&
      system_.SmallestSingularValue(1) > kRegular) {
    selection_is_new_ = false;
    orientation_ = system_.determinant_sign();
    return true;
  }
  selection_ = before;
  selection_is_new_ = true;
  orientation_ = orientation;
  return false;
}

RunSummary ClosureSolver::Prepare() {
  near_values_.clear();
  for (const Command& command : commands_) {
    const double commanded = Evaluate(command.profile, 0.0).value;
    auto& near = near_values_.emplace_back();
    for (const auto& term : command.terms) {
      near.push_back(HomeTurn(mechanism_, term.coordinate,
                              command.terms.size() == 1 ? commanded / term.factor : 0.0));
    }
  }
  Trial home{states_, near_values_};
  EvaluateRows(&home);
  near_values_ = home.near_values;
  target_ = Eigen::Map<const VecX>(rows_.value.data() + joint_rows_, rows_.size() - joint_rows_);
  return SelectRows();
}

ClosureSolver::Step ClosureSolver::Newton(const VecX& target, bool limit_step, Trial* trial) {
  bool factored = false;
  double previous = std::numeric_limits<double>::infinity(), moved = 0.0;
  for (int i = 0; i < options_.max_iterations; ++i) {
    EvaluateRows(trial);
    const VecX r_all = Residual(target);
    VecX r(system_.size());
    for (int k = 0; k < system_.size(); ++k) r[k] = r_all[selection_[k]];
    const double largest = Openness(r, target, trial->states.X_WB);
    if (!std::isfinite(largest)) return Step::kSlow;
    const bool small = largest < 1.0;
    if (factored && largest < kRoundOff) return Turned() ? Step::kSingular : Step::kDone;
    if (!factored || (!small && largest > 0.01 * previous)) {
      if (!system_.Factor(rows_, selection_, selection_is_new_)) return Step::kSingular;
      selection_is_new_ = false;
      factored = true;
      // Other row orders have other signs; within one, a change means a singular pose between.
      if (small && Turned()) return Step::kSingular;
    }
    const VecX step = -system_.SolveTransposed(r);
    const double size = SizeOf(step, length_);
    moved += size;
    if (limit_step && moved > kTrustedCorrection) return Step::kFar;
    if (!(size < 10.0)) return Step::kSlow;
    MoveBodies(step, &trial->states);
    if (small) {
      if (size > kNoStep) EvaluateRows(trial);
      return Turned() ? Step::kSingular : Step::kDone;
    }
    previous = largest;
  }
  return Step::kSlow;
}

void ClosureSolver::Accept(const VecX& target, Trial* trial) {
  std::swap(states_, trial->states);
  FollowElements(mechanism_, &states_);
  FollowDriven(mechanism_, &states_);
  std::swap(near_values_, trial->near_values);
  target_ = target;
  orientation_ = system_.determinant_sign();
}

RunSummary ClosureSolver::Follow(const VecX& target, int first_steps) {
  const VecX start = target_;
  double reached = 0.0, step = 1.0 / first_steps, selected_at = -1.0;
  int easy = 0;
  while (reached < 1.0) {
    const double next = std::min(1.0, reached + step);
    const VecX between = start + next * (target - start);
    Trial trial{states_, near_values_};
    if (Newton(between, true, &trial) == Step::kDone) {
      Accept(between, &trial);
      reached = next;
      if (++easy >= 3) step = std::min(2 * step, 4.0 / first_steps);
      continue;
    }
    easy = 0;
    step *= 0.5;
    if (step * kSmallestStep < 1.0) {
      if (reached > selected_at && SelectAnew()) {
        selected_at = reached;
        step = 1.0 / first_steps;
        continue;
      }
      return ExplainUnreached(mechanism_, commands_, target, states_, near_values_);
    }
  }
  return RunSummary::Done();
}

RunSummary ClosureSolver::Singular(const std::string& why) const {
  RunSummary summary = Failed(Stop::kSingular, why);
  summary.where = MostMovingJoint(mechanism_, states_, system_.SoftMotion());
  return summary;
}

std::string ClosureSolver::OwnerOf(int joint_row) const {
  if (joint_row >= first_coupling_) return mechanism_.couplings[joint_row - first_coupling_].name;
  int row = 0;
  for (const Joint& joint : mechanism_.joints) {
    row += 6 - FreedomsOf(joint.kind);
    if (joint_row < row) return joint.name;
  }
  return "";
}

int ClosureSolver::MeasureGaps() {
  gap_position_m_ = gap_rotation_rad_ = 0.0;
  int worst = 0;
  for (int i = 0; i < joint_rows_; ++i) {
    double& gap = rows_.angular[i] ? gap_rotation_rad_ : gap_position_m_;
    gap = std::max(gap, std::abs(rows_.value[i]));
    if (std::abs(rows_.value[i]) > std::abs(rows_.value[worst])) worst = i;
  }
  return worst;
}

RunSummary ClosureSolver::CheckPose() {
  RunSummary summary = CheckHere();
  if (summary.ok() || !SelectAnew()) return summary;
  Trial trial{states_, near_values_};
  if (Newton(target_, true, &trial) != Step::kDone) return summary;
  Accept(target_, &trial);
  return CheckHere().ok() ? RunSummary::Done() : summary;
}

RunSummary ClosureSolver::CheckHere() {
  const int worst = MeasureGaps();
  const double rounding = Rounding(states_.X_WB);
  if (gap_position_m_ > kOpen * length_ + rounding || gap_rotation_rad_ > kOpen) {
    RunSummary summary = Failed(
        Stop::kNoConvergence,
        "a constraint that was redundant at the home pose is violated: the loops close there only");
    summary.where = OwnerOf(worst);
    summary.amount = rows_.value[worst];
    summary.unit = rows_.angular[worst] ? "rad" : "m";
    return summary;
  }
  const double sigma = system_.SmallestSingularValue(1);
  if (sigma < SingularValueLimit(rounding / length_)) {
    RunSummary summary = Singular(fmt::format(
        "the commands do not hold the mechanism at this pose (smallest singular value {:.1e})",
        sigma));
    summary.amount = sigma;
    summary.unit = std::string("1");
    return summary;
  }
  return RunSummary::Done();
}

RunSummary ClosureSolver::Solve(const CommandSample& command) {
  const bool first = near_values_.empty();
  if (first) {
    if (RunSummary summary = Prepare(); !summary.ok()) return summary;
  }
  VecX target = target_;
  target.head(command.position.size()) = command.position;
  if (first) {
    // Prescribed joints without a command stay at their home coordinate.
    for (size_t k = command.position.size(); k < commands_.size(); ++k) {
      target[k] = Evaluate(commands_[k].profile, 0.0).value;
    }
  }

  // Extrapolate the previous sample; where that does not lead, follow the commands in steps.
  const double dt = command.time_s - predictor_.last_s();
  bool done = false;
  if (!first && dt > 0.0 && std::isfinite(dt)) {
    trial_.states = states_;
    trial_.near_values = near_values_;
    PredictTurns(mechanism_, dt, &trial_.states);
    predictor_.Predict(dt);
    MoveBodies(predictor_.step(), &trial_.states);
    if (Newton(target, true, &trial_) == Step::kDone) {
      Accept(target, &trial_);
      Unstack(predictor_.V(), &states_.V_WB);
      Unstack(predictor_.A(), &states_.A_WB);
      done = true;
    }
  }
  RunSummary summary = RunSummary::Done();
  if (!done) summary = Follow(target, first ? options_.homotopy_steps : 4);
  if (first && summary.ok()) summary = TakeLeastTurns();
  if (summary.ok()) summary = CheckPose();
  if (summary.ok()) summary = SolveRates(command);
  if (summary.ok()) summary = TransportTurns(command);
  if (summary.ok()) MeasureGaps();
  if (summary.ok()) {
    predictor_.Remember(command.time_s, states_);
  } else {
    last_lines_.clear();
    predictor_ = PosePredictor(length_);
    summary.time_s = command.time_s;
  }
  return summary;
}

}  // namespace mbv::internal
