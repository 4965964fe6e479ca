#include "reference/closure_solver.h"

#include <fmt/format.h>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "math/sparse.h"
#include "math/spatial.h"
#include "mechanism/reach.h"
#include "reference/force_solver.h"
#include "reference/row_set.h"
#include "reference/square_system.h"

namespace mbv::internal {

namespace {

// Samples lie at equal distances to this share of one.
constexpr double kEqual = 1e-6;
// Higher order is believed where it changes a pose by less than this [rad, characteristic lengths]:
// farther, samples lie too far apart, or something happened between them.
constexpr double kBelieved = 0.02;

}  // namespace

void PosePredictor::Remember(double time_s, const BodyStates& states) {
  std::rotate(times_s_.begin(), times_s_.end() - 1, times_s_.end());
  times_s_[0] = time_s;
  Stack(states.V_WB, &V_);
  Stack(states.A_WB, &A_);
  history_.Remember(V_, A_);
}

int PosePredictor::Usable(double dt_s) const {
  size_t usable = 1;
  while (usable < times_s_.size()) {
    const double apart = times_s_[usable - 1] - times_s_[usable];
    if (!(std::abs(apart - dt_s) <= kEqual * dt_s)) break;
    ++usable;
  }
  return static_cast<int>(usable);
}

void PosePredictor::Predict(double h) {
  const Eigen::Index size = history_.size();
  int samples = Usable(h);
  history_.Sum(1, RateRulesOf(1).mean, h, 0, size, &by_one_);
  history_.Sum(samples, RateRulesOf(samples).mean, h, 0, size, &step_);
  step_ *= h;
  by_one_ *= h;
  by_one_ -= step_;
  if (!(SizeOf(by_one_, length_) < kBelieved)) {
    step_ += by_one_;
    samples = 1;
  }
  history_.Sum(samples, RateRulesOf(samples).end, h, 0, size, &V_);
  history_.Sum(samples, RateRulesOf(samples).end_slope, h, 0, size, &A_);
  A_ /= h;
  for (Eigen::Index i = 0; i < size; i += 6) {
    step_.segment<3>(i) += history_.Turn(samples, h, i, true);
  }
}

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
constexpr double kFirstStep = 0.1;   ///< [rad, characteristic lengths], by the tangent
constexpr double kShortStep = 1e-3;  ///< the same: by the last pose's tangent as well
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

// Are the commands all drives, then all prescribed joints, each alone?
bool AreDriven(const Mechanism& mechanism, const std::vector<Command>& commands) {
  const size_t drives = mechanism.drives.size();
  if (commands.size() != drives + mechanism.prescribed.size()) return false;
  for (size_t k = 0; k < commands.size(); ++k) {
    if (commands[k].terms.size() != 1 || commands[k].terms.front().factor != 1.0) return false;
    const Coordinate& coordinate = commands[k].terms.front().coordinate;
    const bool drive = k < drives;
    if (coordinate.kind != (drive ? Coordinate::Kind::kDrive : Coordinate::Kind::kPrescribed) ||
        coordinate.index != static_cast<int>(drive ? k : k - drives)) {
      return false;
    }
  }
  return true;
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
      followed_(FollowedAngles(mechanism, motion)),
      commands_are_driven_(AreDriven(mechanism, commands_)),
      system_(mechanism.bodies.size(), length_),
      predictor_(length_) {
  MBV_DEMAND(mechanism.X_WB_home.size() == mechanism.bodies.size(), mechanism.name);
  states_.Resize(mechanism.bodies.size());
  states_.X_WB = mechanism.X_WB_home;
}

void ClosureSolver::EvaluateRows(Trial* trial, bool biases) {
  rows_are_here_ = false;
  rows_.Clear();
  for (const Joint& joint : mechanism_.joints) {
    const ConstraintRows rows = RowsOf(joint, trial->states, false, biases);
    rows_.Add(rows, rows.rows);
  }
  first_coupling_ = rows_.size();
  coupled_size_.clear();
  FollowCouplings(mechanism_, &trial->states, &coupled_);
  for (const CouplingRow& row : coupled_) {
    rows_.Add(row);
    coupled_size_.push_back(row.LargestPiece());
  }
  joint_rows_ = rows_.size();
  for (size_t k = 0; k < commands_.size(); ++k) {
    rows_.Add(mechanism_, commands_[k], trial->states, &trial->near_values[k]);
  }
  for (const Spin& spin : spins_) rows_.Add(IdleRow(spin, trial->states), true);
}

void ClosureSolver::VaryRows(const std::vector<Vec6>& by, RowSet* varied) const {
  varied->Clear();
  for (const Joint& joint : mechanism_.joints) {
    const ConstraintRows rows = VariedRowsOf(joint, states_, by, false);
    varied->Add(rows, rows.rows);
  }
  for (const CouplingRow& row : VariedCouplingRows(mechanism_, states_, by)) varied->Add(row);
  for (const Command& command : commands_) {
    CouplingRow sum;
    for (const Command::Term& term : command.terms) {
      ScalarRow& piece =
          sum.pieces.emplace_back(VariedRow(mechanism_, term.coordinate, states_, by));
      piece.J_parent *= term.factor, piece.J_child *= term.factor;
      piece.bias *= term.factor;
    }
    varied->Add(sum);
  }
  for (const Spin& spin : spins_) varied->Add(VariedIdleRow(spin, states_, by), true);
}

double ClosureSolver::Openness(const VecX& target, const std::vector<Pose>& X_WB) {
  missing_.resize(system_.size());
  const double closed_m = std::max(options_.closure_tolerance_m * length_, Rounding(X_WB));
  double openness = 0.0;
  for (int k = 0; k < system_.size(); ++k) {
    const int row = selection_[k];
    const double asked = row < joint_rows_ ? 0.0 : target[row - joint_rows_];
    const double coordinate = row < first_coupling_ ? 0.0
                              : row < joint_rows_   ? coupled_size_[row - first_coupling_]
                                                    : std::abs(asked);
    // Angles count turns, and both they and lengths may be large beside the mechanism.
    const double tolerance = std::max(rows_.angular[row] ? options_.closure_tolerance_m : closed_m,
                                      32 * kEps * coordinate);
    missing_[k] = asked - rows_.value[row];
    const double open = std::abs(missing_[k]) / tolerance;
    if (std::isnan(open)) return open;
    openness = std::max(openness, open);
  }
  return openness;
}

void ClosureSolver::FindTransmitting() {
  int row = 0;
  const auto take = [&](int count) {
    for (int i = 0; i < count; ++i) transmitting_.push_back(row + i);
  };
  for (const Joint& joint : mechanism_.joints) {
    take(ReactionRows(joint));
    row += 6 - DofsOf(joint.kind);
  }
  take(joint_rows_ - first_coupling_);
}

RunSummary ClosureSolver::SelectRows(bool of_forces) {
  // What transmits forces may hold what all joints do: then forces have the same factors.
  if (of_forces) selection_ = system_.IndependentRows(rows_, transmitting_);
  if (!of_forces || selection_.size() + free_rows() < static_cast<size_t>(system_.size())) {
    std::vector<int> all(static_cast<size_t>(joint_rows_));
    std::iota(all.begin(), all.end(), 0);
    selection_ = system_.IndependentRows(rows_, all);
  }
  selection_is_new_ = true;
  orientation_ = 0;
  const int dofs = system_.size() - static_cast<int>(selection_.size() + spins_.size());
  if (dofs != static_cast<int>(commands_.size())) {
    return Failed(
        Stop::kUnsupported,
        fmt::format("the joints leave {} degrees of freedom, but {} coordinates are commanded",
                    dofs, commands_.size()));
  }
  for (int k = joint_rows_; k < rows_.size(); ++k) selection_.push_back(k);
  return RunSummary::Done();
}

// The smallest singular value at home, with rows chosen there. It falls with the number of loops
// that hang together, regular as they may be.
double ClosureSolver::ControlAtHome() {
  Trial home{states_, near_values_};
  home.states.X_WB = mechanism_.X_WB_home;
  EvaluateRows(&home);
  std::vector<int> rows(static_cast<size_t>(joint_rows_));
  std::iota(rows.begin(), rows.end(), 0);
  SquareSystem system(mechanism_.bodies.size(), length_);
  rows = system.IndependentRows(rows_, rows);
  for (int k = joint_rows_; k < rows_.size(); ++k) rows.push_back(k);
  const bool square = static_cast<int>(rows.size()) == system.size();
  return square && system.Factor(rows_, rows, true) ? system.SmallestSingularValue(1) : 0.0;
}

bool ClosureSolver::SelectAnew() {
  if (static_cast<int>(selection_.size()) == rows_.size()) return false;
  // Clearly away from a singular pose: by the smallest singular value, by its share of that at
  // home, and by a multiple of what cannot be distinguished from zero.
  constexpr double kRegular = 1e-2, kOfHome = 0.1, kClear = 10.0;
  const double least = std::max(std::min(kRegular, kOfHome * ControlAtHome()),
                                kClear * SingularValueLimit(Rounding(states_.X_WB) / length_));
  EvaluateHere();
  const std::vector<int> before = std::exchange(selection_, {});
  const int orientation = orientation_;
  if (SelectRows(false).ok() && selection_ != before && system_.Factor(rows_, selection_, true) &&
      system_.SmallestSingularValue(1) > least) {
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
  rows_are_here_ = true;
  FindTransmitting();
  near_values_ = home.near_values;
  target_ = Eigen::Map<const VecX>(rows_.value.data() + joint_rows_, rows_.size() - joint_rows_);
  return SelectRows(true);
}

ClosureSolver::Step ClosureSolver::Newton(const VecX& target, bool limit_step, Trial* trial) {
  bool factored = false;
  double previous = std::numeric_limits<double>::infinity(), moved = 0.0;
  for (int i = 0; i < options_.max_iterations; ++i) {
    EvaluateRows(trial);
    const double largest = Openness(target, trial->states.X_WB);
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
    system_.SolveTransposed(missing_, &step_);
    const double size = SizeOf(step_, length_);
    moved += size;
    if (limit_step && moved > kTrustedCorrection) return Step::kFar;
    if (!(size < 10.0)) return Step::kSlow;
    MoveBodies(step_, &trial->states);
    if (small) {
      if (size > kNoStep) EvaluateRows(trial);
      return Turned() ? Step::kSingular : Step::kDone;
    }
    previous = largest;
  }
  return Step::kSlow;
}

void ClosureSolver::Accept(const VecX& target, Trial* trial) {
  rows_are_here_ = false;
  std::swap(states_, trial->states);
  FollowElements(mechanism_, &states_);
  FollowDriven(mechanism_, &states_);
  FollowAngles(mechanism_, followed_, &states_);
  std::swap(near_values_, trial->near_values);
  target_ = target;
  orientation_ = system_.determinant_sign();
}

int ClosureSolver::StepsTo(const VecX& target) {
  missing_.setZero(system_.size());
  missing_.tail(target.size()) = target - target_;
  // A short way needs no better factors than those of the last one.
  if (!selection_is_new_) {
    system_.SolveTransposed(missing_, &step_);
    if (SizeOf(step_, length_) < kShortStep) return 1;
  }
  if (!rows_are_here_) EvaluateHere();
  if (!system_.Factor(rows_, selection_, selection_is_new_)) return options_.homotopy_steps;
  selection_is_new_ = false;
  system_.SolveTransposed(missing_, &step_);
  const double steps = std::ceil(SizeOf(step_, length_) / kFirstStep);
  if (!(steps < options_.homotopy_steps)) return options_.homotopy_steps;
  return std::max(1, static_cast<int>(steps));
}

RunSummary ClosureSolver::Follow(const VecX& target, int first_steps) {
  const VecX start = target_;
  double reached = 0.0, step = 1.0 / first_steps, selected_at = -1.0;
  int easy = 0;
  while (reached < 1.0) {
    const double next = std::min(1.0, reached + step);
    const VecX between = start + next * (target - start);
    trial_.states = states_;
    trial_.near_values = near_values_;
    if (Newton(between, true, &trial_) == Step::kDone) {
      Accept(between, &trial_);
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
      if (!options_.explain_unreached) return Failed(Stop::kUnreachable, "the pose is not reached");
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
    row += 6 - DofsOf(joint.kind);
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
  const double sigma = control_ = system_.SmallestSingularValue(1);
  if (sigma < SingularValueLimit(rounding / length_)) {
    RunSummary summary = Singular(fmt::format(
        "the commands do not hold the mechanism at this pose (smallest singular value {:.1e})",
        sigma));
    summary.amount = sigma;
    summary.unit = std::string("1");
    return summary;
  }
  if (gap_position_m_ > kOpen * length_ + rounding || gap_rotation_rad_ > kOpen) {
    RunSummary summary = Failed(
        Stop::kNoConvergence,
        "a constraint that depends on others at the home pose is violated: either the loops close "
        "there only (rounded lengths or axes), or home is a singular pose from which they go on in "
        "another way (guesses beside it choose one)");
    summary.where = OwnerOf(worst);
    summary.amount = rows_.value[worst];
    summary.unit = rows_.angular[worst] ? "rad" : "m";
    return summary;
  }
  return RunSummary::Done();
}

RunSummary ClosureSolver::Solve(const CommandSample& command) {
  const bool first = near_values_.empty();
  if (first) {
    if (RunSummary summary = Prepare(); !summary.ok()) return summary;
  }
  VecX& target = next_target_;
  target = target_;
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
  const bool predict = !first && dt > 0.0 && std::isfinite(dt);
  if (predict) {
    trial_.states = states_;
    trial_.near_values = near_values_;
    PredictTurns(mechanism_, dt, &trial_.states);
    PredictAngles(mechanism_, followed_, dt, &trial_.states);
    predictor_.Predict(dt);
    MoveBodies(predictor_.step(), &trial_.states);
    if (Newton(target, true, &trial_) == Step::kDone) {
      Accept(target, &trial_);
      Unstack(predictor_.V(), &states_.V_WB);
      Unstack(predictor_.A(), &states_.A_WB);
      done = true;
    }
  }
  // Asked for one pose or another, without a time between: along the tangent, if that is short.
  if (!predict && !first && target == target_) done = true;
  int steps = 4;
  if (!predict && !done) {
    steps = StepsTo(target);
    if (!first && steps == 1) {
      trial_.states = states_;
      trial_.near_values = near_values_;
      MoveBodies(step_, &trial_.states);
      if (Newton(target, true, &trial_) == Step::kDone) {
        Accept(target, &trial_);
        done = true;
      }
    }
  }
  RunSummary summary = RunSummary::Done();
  if (!done) summary = Follow(target, steps);
  if (first && summary.ok()) summary = TakeLeastTurns();
  if (first && summary.ok()) StartAngles(mechanism_, followed_, &states_);
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

namespace {

constexpr double kHard = 1e3;      // weight of rows that should hold, against 1 of the others
constexpr double kReached = 1e-6;  // residual [1] of a pose that closes after all
// Steps in rad, or characteristic lengths: short, so that assemblies stay apart.
constexpr DampingRule kDamping{.most_steps = 60,
                               .largest_step = 0.3,
                               .first = 1e-3,
                               .least = 1e-12,
                               .most = 1e12,
                               .easier = 0.1,
                               .stronger = 10.0};

// All joint rows and commands as a weighted least-squares problem, lengths per L.
class OpenLoops {
 public:
  OpenLoops(const Mechanism& mechanism, const std::vector<Command>& commands, const VecX& target,
            const std::vector<std::vector<double>>& near_values)
      : mechanism_(mechanism),
        commands_(commands),
        target_(target),
        near_values_(near_values),
        length_(CharacteristicLength(mechanism)),
        any_closure_(!mechanism.couplings.empty() ||
                     std::any_of(mechanism.joints.begin(), mechanism.joints.end(),
                                 [](const Joint& joint) { return joint.closure; })) {}

  // Weighted residual; with the Jacobian when J is given.
  VecX Evaluate(const BodyStates& states, bool weighted, MatX* J) {
    RowSet rows;
    std::vector<double> weight;
    for (const Joint& joint : mechanism_.joints) {
      const ConstraintRows joint_rows = RowsOf(joint, states, false);
      rows.Add(joint_rows, joint_rows.rows);
      weight.resize(rows.size(), weighted && !joint.closure ? kHard : 1.0);
    }
    for (const CouplingRow& row : CouplingRows(mechanism_, states)) rows.Add(row);
    weight.resize(rows.size(), 1.0);
    for (size_t k = 0; k < commands_.size(); ++k) {
      rows.Add(mechanism_, commands_[k], states, &near_values_[k]);
      rows.value.back() -= target_[k];
    }
    weight.resize(rows.size(), weighted && any_closure_ ? kHard : 1.0);

    VecX r(rows.size());
    if (J != nullptr) J->setZero(rows.size(), 6 * (mechanism_.bodies.size() - 1));
    for (int i = 0; i < rows.size(); ++i) {
      const double scale = weight[i] / (rows.angular[i] ? 1.0 : length_);
      r[i] = scale * rows.value[i];
      if (J == nullptr) continue;
      for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
        const int at = 6 * (rows.body[p] - 1);
        J->block<1, 3>(i, at) = scale * rows.J[p].head<3>().transpose();
        J->block<1, 3>(i, at + 3) = scale * length_ * rows.J[p].tail<3>().transpose();
      }
    }
    return r;
  }

  // Unscales a step of twists whose velocities are per L.
  [[nodiscard]] VecX Unscaled(VecX twists) const {
    for (Eigen::Index i = 3; i < twists.size(); i += 6) twists.segment<3>(i) *= length_;
    return twists;
  }

  // From `states`, which end at the best compromise.
  void Minimise(BodyStates* states) {
    constexpr double kSettled = 1e-9;    // a smaller share of the residual is no progress
    constexpr double kRounding = 1e-12;  // of scaled rows
    const auto evaluate = [&](BodyStates* at, MatX* J) { return Evaluate(*at, true, J); };
    const auto move = [&](const VecX& s, BodyStates* at) {
      MoveBodies(Unscaled(s), at);
      FollowCouplings(mechanism_, at);
    };
    const auto enough = [](const internal::DampedStepMade& step) {
      const double now = step.r.norm();
      return step.better && (now > (1 - kSettled) * step.before || now < kRounding);
    };
    internal::DampedSearch(kDamping, states, evaluate, move, enough);
  }

  [[nodiscard]] double length() const { return length_; }

 private:
  const Mechanism& mechanism_;
  const std::vector<Command>& commands_;
  const VecX& target_;
  std::vector<std::vector<double>> near_values_;
  double length_;
  bool any_closure_;
};

// The least singular value; of large matrices by sparse factors.
SingularPair LeastOf(const MatX& J) {
  constexpr Eigen::Index kMostDense = 300;
  if (J.cols() > kMostDense) {
    const SparseLu::Matrix rows = J.transpose().sparseView();
    SingularPair least = LeastSingular(rows, SparseLu::Matrix(J.cols(), 0));
    if (least.converged) return least;
  }
  const Eigen::BDCSVD<MatX> svd(J, Eigen::ComputeThinV);
  const Eigen::Index last = svd.singularValues().size() - 1;
  return {svd.singularValues()[last], svd.matrixV().col(last), true};
}

// The largest open joint, or the largest missed command where no loop can open.
void NameWorst(const Mechanism& mechanism, const std::vector<Command>& commands,
               const BodyStates& states, const VecX& r, double length, RunSummary* summary) {
  double worst = 0.0;
  int row = 0;
  const auto offer = [&](const std::string& name, double size, double amount, const char* unit) {
    if (size <= worst) return;
    worst = size;
    summary->where = name;
    summary->amount = amount;
    summary->unit = unit;
  };
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows rows = RowsOf(joint, states, false);
    const double gap = rows.residual.head(rows.translation_rows).norm();
    const double turn =
        r.segment(row + rows.translation_rows, rows.rows - rows.translation_rows).norm();
    offer(joint.name, gap / length, gap, "m");
    offer(joint.name, turn, turn, "rad");
    row += rows.rows;
  }
  const std::vector<CouplingRow> coupled = CouplingRows(mechanism, states);
  for (size_t c = 0; c < coupled.size(); ++c) {
    const bool angular = coupled[c].angular;
    const double miss = std::abs(r[row++]);
    offer(mechanism.couplings[c].name, miss, angular ? miss : miss * length, angular ? "rad" : "m");
  }
  for (const Command& command : commands) {
    const bool angle = !IsLength(mechanism, command.terms.front().coordinate);
    const double miss = std::abs(r[row++]);
    offer(command.name, miss, angle ? miss : miss * length, angle ? "rad" : "m");
  }
}

}  // namespace

std::string MostMovingJoint(const Mechanism& mechanism, const BodyStates& states,
                            const VecX& twists) {
  std::vector<Vec6> motion(mechanism.bodies.size(), Vec6::Zero());
  if (twists.size() == 6 * (static_cast<Eigen::Index>(motion.size()) - 1)) {
    Unstack(twists, &motion);
  }
  const double length = CharacteristicLength(mechanism);
  std::string name;
  double most = 0.0;
  for (const Joint& joint : mechanism.joints) {
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      const ScalarRow row = JointCoordinateRow(joint, c, states);
      const bool length_unit = !row.J_child.tail<3>().isZero();
      const double rate =
          std::abs(row.J_parent.dot(motion[joint.parent]) + row.J_child.dot(motion[joint.child])) /
          (length_unit ? length : 1.0);
      if (rate > most) {
        most = rate;
        name = joint.name;
      }
    }
  }
  return name;
}

RunSummary ExplainUnreached(const Mechanism& mechanism, const std::vector<Command>& commands,
                            const VecX& target, const BodyStates& nearest,
                            std::vector<std::vector<double>> near_values) {
  OpenLoops loops(mechanism, commands, target, near_values);
  BodyStates best = nearest;
  loops.Minimise(&best);
  const VecX r = loops.Evaluate(best, false, nullptr);

  RunSummary summary;
  if (r.norm() > kReached) {
    summary.stop = Stop::kUnreachable;
    summary.names_where = true;
    NameWorst(mechanism, commands, best, r, loops.length(), &summary);
    summary.message =
        fmt::format("the commanded pose cannot be reached: {} stays open by {:.4g} {}",
                    summary.where, summary.amount, summary.unit);
    return summary;
  }
  MatX J;
  (void)loops.Evaluate(nearest, false, &J);
  const SingularPair least = LeastOf(J);
  summary.stop = Stop::kSingular;
  summary.where = MostMovingJoint(mechanism, nearest, loops.Unscaled(least.vector));
  summary.names_where = true;
  summary.amount = least.value;
  summary.unit = "1";
  summary.message = fmt::format(
      "the commanded motion passes a singular pose near {} (smallest singular value {:.1e})",
      summary.where, summary.amount);
  return summary;
}

// Velocities and accelerations of closed poses, and idle spins: parts of ClosureSolver.

namespace {

// Rates that miss by this share of the largest are as good as they can be.
constexpr double kRatesMiss = 4 * kEps;
// Solutions go on below it, but while that helps; what misses more than the second is wrong.
constexpr double kRatesGood = 1e-12, kRatesAccurate = 1e-9;
constexpr double kBiasRounding = 32 * kEps;
constexpr int kMostSolutions = 12;
// Velocities that changed by more of themselves since biases were evaluated have changed these.
// What they missed does not show it: near singular poses little that misses is much that changes.
constexpr double kRatesSettled = 1e-14;

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

double ClosureSolver::AddMissing(std::vector<Vec6>* per_body) {
  system_.SolveTransposed(missing_, &step_);
  for (size_t b = 1; b < per_body->size(); ++b) {
    (*per_body)[b] += step_.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
  }
  return SizeOf(step_, length_);
}

// The factors belong to a pose nearby; refinement against the true rows restores all digits.
ClosureSolver::Refinement ClosureSolver::Refine(const VecX& rates, double round_off,
                                                std::vector<Vec6>* per_body) {
  double scale = 0.0;
  for (const int i : selection_) {
    scale = std::max(scale, std::abs(rates[i]) / system_.RateUnit(rows_.angular[i]));
  }
  Refinement refinement;
  double previous = std::numeric_limits<double>::infinity();
  for (int solutions = 0;; ++solutions) {
    const double largest = Miss(rates, *per_body);
    if (scale == 0.0 && !std::isnan(largest)) {  // exactly, where sums leave round-off
      std::ranges::fill(*per_body, Vec6::Zero());
      refinement.accurate = true;
      break;
    }
    refinement.accurate = largest <= std::max(kRatesAccurate * scale, round_off);
    if (largest <= kRatesMiss * scale || solutions == kMostSolutions) break;
    if (largest < std::max(kRatesGood * scale, round_off) && largest > 0.1 * previous) break;
    refinement.change += AddMissing(per_body);
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
    (void)Refine(rates_, 0.0, &states_.V_WB);
    EvaluateHere();
    const Refinement velocity = Refine(rates_, 0.0, &states_.V_WB);
    // What is left of biases that cancel is round-off of their terms, which are products of rates.
    double speed = 0.0;
    for (const Vec6& V : states_.V_WB) {
      speed = std::max({speed, V.head<3>().norm(), V.tail<3>().norm() / length_});
    }
    if (velocity.change > kRatesSettled * speed) EvaluateHere();
    PutAtEnd(command.acceleration, rows_.size() - joint_rows_, &rates_);
    rates_ -= Eigen::Map<const VecX>(rows_.bias.data(), rows_.size());
    const Refinement acceleration = Refine(rates_, kBiasRounding * speed * speed, &states_.A_WB);
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

RunSummary ClosureSolver::UnitMotions(int count, MatX* motions) {
  motions->resize(system_.size(), count);
  std::vector<Vec6> twists(mechanism_.bodies.size(), Vec6::Zero());
  for (const bool refactor : {false, true}) {
    if (refactor && !system_.Factor(rows_, selection_, false)) break;
    bool accurate = true;
    for (int k = 0; k < count && accurate; ++k) {
      rates_.setZero(rows_.size());
      rates_[joint_rows_ + k] = 1.0;
      std::ranges::fill(twists, Vec6::Zero());
      accurate = Refine(rates_, 0.0, &twists).accurate;
      motions->col(k) = Stack(twists);
    }
    if (accurate) return RunSummary::Done();
  }
  return Singular("the coordinates do not determine the motion at this pose");
}

// Rows at the pose found; biases depend on the velocities.
void ClosureSolver::EvaluateHere() {
  trial_.states = states_;
  trial_.near_values = near_values_;
  EvaluateRows(&trial_, true);
  rows_are_here_ = true;
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
