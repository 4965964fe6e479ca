// The home pose: loops that close, and what is said when they do not.

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <set>
#include <utility>
#include <vector>

#include "base/text.h"
#include "kinematics/assembly.h"
#include "kinematics/command_rank.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "kinematics/row_stack.h"
#include "kinematics/tree_motion.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "model_file/model_checks.h"

namespace mbv {

struct DataProjection {
  /// Constraints that are redundant but for a gap of this size at home; 0: the loops are open for
  /// another reason.
  int redundant = 0;
  bool closed = false;       ///< the joint frames were moved, and home is solved with them
  bool began = false;        ///< all poses of the way's first reach close
  double moved_m = kNan;     ///< largest displacement of a joint frame
  double turned_rad = kNan;  ///< largest turn
};

namespace {

using internal::ClosureResidual;
using internal::DampedStep;
using internal::TreeMotion;

// Singular values of redundant rows are as small as the gap that closes them, within this factor.
constexpr double kGapFactor = 30.0;
// Larger gaps [L, rad] are no rounding.
constexpr double kLargestGap = 3e-3;
// A paradoxical loop that closes in too few poses, or in a short arc, is open by a ten thousandth
// of the rounding elsewhere, and its reactions are then noise.
constexpr Eigen::Index kPoses = 24, kFewestPoses = 12;
constexpr double kReach = 2.4;           // of the poses from home [rad, L]
constexpr double kLeastDamping = 1e-12;  // over the residual

// How frames are moved. Beyond singular poses rounding adds up without bound: then those nearer
// home come first, or alone: what closes there moves up to the singular pose. Paradoxical loops
// need damped steps, which move frames farther than others do.
enum class Steps { kClear, kClearThenDamped, kDamped };
struct Way {
  std::vector<double> reaches;
  Steps steps = Steps::kClear;
};
const std::array<Way, 5> kWays = {{{{kReach}, Steps::kClear},
                                   {{0.6, kReach}, Steps::kClearThenDamped},
                                   {{0.6}, Steps::kClearThenDamped},
                                   {{kReach}, Steps::kDamped},
                                   {{0.2}, Steps::kClearThenDamped}}};

constexpr Eigen::Index kMostUnknowns = 800;

BodyStates StatesAt(const std::vector<Pose>& X_WB) {
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  return states;
}

internal::SparseRows ScaledRows(const Mechanism& mechanism) {
  internal::RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, StatesAt(mechanism.X_WB_home), false);
  return stack.Matrix();
}

double RankTolerance(double gap) { return std::max(internal::kRankTolerance, kGapFactor * gap); }

class Projector {
 public:
  Projector(const Mechanism& mechanism, double gap, double reach, Steps steps)
      : mechanism_(mechanism),
        length_(CharacteristicLength(mechanism)),
        tree_(mechanism_, std::vector<bool>(mechanism.joints.size(), false)),
        frames_(static_cast<Eigen::Index>(12 * mechanism.joints.size())),
        steps_(steps),
        xi_(VecX::Zero(frames_)) {
    unit_.setOnes(tree_.dofs());
    for (int c = 0; c < tree_.dofs(); ++c) {
      if (!tree_.angular()[c]) unit_[c] = length_;
    }
    MakePoses(gap, reach);
  }

  [[nodiscard]] Eigen::Index unknowns() const {
    return frames_ + static_cast<Eigen::Index>(poses_.size()) * tree_.dofs();
  }

  /// False where all poses close with the frames as they are.
  [[nodiscard]] bool IsRounded() {
    return Evaluate(poses_, nullptr).lpNorm<Eigen::Infinity>() > kHomeTolerance;
  }

  /// True if all poses close.
  bool Solve() {
    MatX J;
    VecX r = Evaluate(poses_, &J);
    double mu = kLeastDamping;
    for (int i = 0; i < 60 && r.lpNorm<Eigen::Infinity>() > 1e-15; ++i) {
      if (!(steps_ != Steps::kDamped && StepWhereClear(J, r)) &&
          !(steps_ != Steps::kClear && StepDamped(J, r, &mu))) {
        break;
      }
      r = Evaluate(poses_, &J);
    }
    return r.lpNorm<Eigen::Infinity>() < 1e-12;
  }

  /// With the frames moved, in the first of the poses.
  [[nodiscard]] Mechanism mechanism() const {
    Mechanism moved = mechanism_;
    moved.X_WB_home = tree_.States(poses_[0]).X_WB;
    return moved;
  }
  [[nodiscard]] double moved_m() const { return length_ * Largest(3); }
  [[nodiscard]] double turned_rad() const { return Largest(0); }

 private:
  // Damping that vanishes with the residual keeps the convergence quadratic. Rows that only this
  // residual makes independent have singular values of the gap's size: more damping than their
  // squares would hold the steps along them back for good, so each iteration begins far below.
  bool StepDamped(const MatX& J, const VecX& r, double* mu) {
    *mu = std::max(0.01 * *mu, kLeastDamping * r.norm());
    for (int attempt = 0; attempt < 16; ++attempt, *mu *= 30) {
      if (Take(DampedStep(J, r, *mu), r.norm())) return true;
    }
    return false;
  }
  // Along such rows a step is as large as it is arbitrary: here none is taken.
  bool StepWhereClear(const MatX& J, const VecX& r) {
    constexpr double kLargestShare = 1e-3;  // of the largest pivot
    Eigen::CompleteOrthogonalDecomposition<MatX> solver;
    double share = RankTolerance(r.lpNorm<Eigen::Infinity>());
    do {
      solver.setThreshold(share);
      if (Take(-solver.compute(J).solve(r), r.norm())) return true;
      share *= kGapFactor;
    } while (share < kLargestShare);
    return false;
  }
  // Unless nothing gets better by it.
  bool Take(const VecX& s, double norm) {
    const std::vector<std::vector<Pose>> old_poses = poses_;
    const VecX old_xi = xi_;
    Apply(s);
    if (Evaluate(poses_, nullptr).norm() < norm) return true;
    poses_ = old_poses;
    SetFrames(old_xi);
    return false;
  }

  [[nodiscard]] double Largest(Eigen::Index first) const {
    double largest = 0.0;
    for (Eigen::Index i = first; i < frames_; i += 6) {
      largest = std::max(largest, xi_.segment<3>(i).norm());
    }
    return largest;
  }

  // As many as the number of unknowns allows.
  [[nodiscard]] Eigen::Index Poses() const {
    const Eigen::Index room = (kMostUnknowns - frames_) / std::max(1, tree_.dofs());
    return std::clamp(room, kFewestPoses, kPoses);
  }

  // The poses of joints at coordinates, closed as far as the frames as given allow.
  std::vector<Pose> Closed(const std::vector<std::array<double, 6>>& q, double gap) const {
    std::vector<Pose> X_FM;
    for (size_t j = 0; j < q.size(); ++j) X_FM.push_back(JointPose(mechanism_.joints[j], q[j]));
    CloseAsGiven(gap, &X_FM);
    return X_FM;
  }
  [[nodiscard]] bool IsOpen(const std::vector<Pose>& X_FM, double gap) const {
    return !(At(X_FM, nullptr).lpNorm<Eigen::Infinity>() <= kGapFactor * gap);
  }

  // The guesses, if they close but for rounding; else home, which may lie where rounded loops
  // happen to close.
  void Begin(double gap) {
    std::vector<std::array<double, 6>> guess, home;
    for (const Joint& joint : mechanism_.joints) {
      given_.push_back(joint.X_PF);
      given_.push_back(joint.X_CM);
      guess.push_back(joint.guess);
      home.push_back(joint.home);
    }
    std::vector<Pose> X_FM = Closed(guess, gap);
    if (IsOpen(X_FM, gap)) X_FM = Closed(home, gap);
    mechanism_.X_WB_home = tree_.States(X_FM).X_WB;
    poses_.push_back(std::move(X_FM));
  }

  void MakePoses(double gap, double reach) {
    Begin(gap);
    const MatX motion = internal::FindRank(ScaledRows(mechanism_), internal::NullSpaces::kMotion,
                                           RankTolerance(gap))
                            .motion;
    std::mt19937_64 random(20260922);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<std::array<double, 6>> near;
    for (const Joint& joint : mechanism_.joints) near.push_back(joint.home);
    near = JointCoordinatesAt(mechanism_, mechanism_.X_WB_home, near);
    const Eigen::Index poses = motion.cols() == 0 ? 1 : Poses();
    for (Eigen::Index k = 1; k < poses; ++k) {
      VecX dx = VecX::Zero(motion.rows());
      for (Eigen::Index c = 0; c < motion.cols(); ++c) dx += uniform(random) * motion.col(c);
      // Spread over both directions of a single DOF, too.
      const double amplitude =
          reach * (2.0 * static_cast<double>(k) / static_cast<double>(poses) - 1.0);
      if (const double size = dx.lpNorm<Eigen::Infinity>(); size > 0.0) dx *= amplitude / size;
      std::vector<Pose> X_WB = mechanism_.X_WB_home;
      for (size_t b = 1; b < X_WB.size(); ++b) {
        const Vec6 twist = dx.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
        X_WB[b].linear() = ExpRotation(twist.head<3>()) * X_WB[b].linear();
        X_WB[b].translation() += length_ * twist.tail<3>();
      }
      std::vector<Pose> X_FM = Closed(JointCoordinatesAt(mechanism_, X_WB, near), gap);
      // Beyond the range of the motion: no rounding.
      if (!IsOpen(X_FM, gap)) poses_.push_back(std::move(X_FM));
    }
  }

  // As well as the frames as given allow: what is left then is the rounding. Where nothing but
  // rounding is left, no step is taken along motions that it alone hinders: they would end where
  // rounded loops happen to close.
  void CloseAsGiven(double gap, std::vector<Pose>* X_FM) const {
    Eigen::CompleteOrthogonalDecomposition<MatX> solver;
    solver.setThreshold(RankTolerance(gap));
    MatX J;
    VecX r = At(*X_FM, &J);
    for (int i = 0; i < 50; ++i) {
      const double before = r.norm();
      const bool near = r.lpNorm<Eigen::Infinity>() <= kGapFactor * gap;
      double mu = std::max(r.squaredNorm(), 1e-26);
      for (int attempt = 0; attempt < (near ? 1 : 12) && !(r.norm() < before);
           ++attempt, mu *= 30) {
        const MatX J_scaled = J * unit_.asDiagonal();
        const VecX s =
            near ? VecX(-solver.compute(J_scaled).solve(r)) : DampedStep(J_scaled, r, mu);
        std::vector<Pose> next = *X_FM;
        tree_.Step(unit_.cwiseProduct(s), &next);
        MatX J_next;
        const VecX r_next = At(next, &J_next);
        if (!(r_next.norm() < before)) continue;
        *X_FM = std::move(next);
        r = r_next;
        J = J_next;
      }
      if (!(r.norm() < (1 - 1e-6) * before)) return;
    }
  }

  void SetFrames(const VecX& xi) {
    xi_ = xi;
    for (size_t i = 0; i < given_.size(); ++i) MoveFrame(i, xi.segment<6>(6 * i));
  }
  // F of joint i/2 for even i, M for odd.
  void MoveFrame(size_t i, const Vec6& xi) {
    Joint& joint = mechanism_.joints[i / 2];
    Pose& X = i % 2 == 0 ? joint.X_PF : joint.X_CM;
    X.linear() = given_[i].linear() * ExpRotation(xi.head<3>());
    X.translation() = given_[i].translation() + given_[i].linear() * (length_ * xi.tail<3>());
  }

  void Apply(const VecX& s) {
    SetFrames(xi_ + s.head(frames_));
    for (size_t k = 0; k < poses_.size(); ++k) {
      const VecX dq =
          s.segment(frames_ + static_cast<Eigen::Index>(k) * tree_.dofs(), tree_.dofs());
      tree_.Step(unit_.cwiseProduct(dq), &poses_[k]);
    }
  }

  VecX At(const std::vector<Pose>& X_FM, MatX* J) const {
    return ClosureResidual(mechanism_, tree_, tree_.States(X_FM), length_, J);
  }

  // Residuals of all poses; derivatives by the frames from central differences.
  VecX Evaluate(const std::vector<std::vector<Pose>>& poses, MatX* J) {
    // Central differences of fourth order: rounding and what they leave out are both some 1e-13.
    constexpr double kStep = 1e-3;
    constexpr std::array<std::pair<double, double>, 4> kStencil = {
        {{2, -1.0 / 12}, {1, 8.0 / 12}, {-1, -8.0 / 12}, {-2, 1.0 / 12}}};
    const Eigen::Index rows = At(poses[0], nullptr).size(), n = tree_.dofs();
    const auto count = static_cast<Eigen::Index>(poses.size());
    VecX r(rows * count);
    if (J != nullptr) J->setZero(rows * count, unknowns());
    for (Eigen::Index k = 0; k < count; ++k) {
      MatX J_q;
      r.segment(k * rows, rows) = At(poses[k], J == nullptr ? nullptr : &J_q);
      if (J != nullptr) J->block(k * rows, frames_ + k * n, rows, n) = J_q * unit_.asDiagonal();
    }
    if (J == nullptr) return r;
    for (Eigen::Index c = 0; c < frames_; ++c) {
      Vec6 xi = xi_.segment<6>(6 * (c / 6));
      for (const auto& [steps, weight] : kStencil) {
        Vec6 perturbed = xi;
        perturbed[c % 6] += steps * kStep;
        MoveFrame(static_cast<size_t>(c / 6), perturbed);
        for (Eigen::Index k = 0; k < count; ++k) {
          J->block(k * rows, c, rows, 1) += weight / kStep * At(poses[k], nullptr);
        }
      }
      MoveFrame(static_cast<size_t>(c / 6), xi);
    }
    return r;
  }

  Mechanism mechanism_;
  const double length_;
  const TreeMotion tree_;
  const Eigen::Index frames_;
  const Steps steps_;
  VecX xi_, unit_;
  std::vector<Pose> given_;               // X_PF, X_CM of each joint
  std::vector<std::vector<Pose>> poses_;  // X_FM per joint
};

}  // namespace

// Constraints that are redundant but for `gap` [characteristic lengths, rad] at X_WB_home, the
// pose of least gap.
int CountNearlyRedundant(const Mechanism& mechanism, double gap) {
  if (!(gap < kLargestGap)) return 0;
  const internal::SparseRows J = ScaledRows(mechanism);
  const int rank = internal::FindRank(J, internal::NullSpaces::kNone, RankTolerance(gap)).rank;
  return static_cast<int>(J.rows()) - rank;
}

// Moves the joint frames X_PF, X_CM of the loops that `gap` [characteristic lengths, rad] may keep
// from moving, each group by itself.
DataProjection ProjectData(Mechanism* mechanism, double gap, const Way& way) {
  DataProjection projection;
  projection.redundant = CountNearlyRedundant(*mechanism, gap);
  if (projection.redundant == 0) return projection;
  const double length_m = CharacteristicLength(*mechanism);
  Mechanism projected = *mechanism;
  projection.moved_m = projection.turned_rad = 0.0;
  for (const LoopGroup& group : LoopGroups(*mechanism)) {
    const Mechanism part = GroupAlone(*mechanism, group);
    const double part_gap = gap * std::max(1.0, length_m / CharacteristicLength(part));
    if (CountNearlyRedundant(part, part_gap) == 0) continue;
    double moved_m = 0.0, turned_rad = 0.0;
    Mechanism moved = part;
    for (const double reach : way.reaches) {
      Projector projector(moved, part_gap, reach, way.steps);
      if (projector.unknowns() > kMostUnknowns) return projection;
      if (!projector.IsRounded()) break;
      if (!projector.Solve()) return projection;
      projection.began = true;
      moved_m += projector.moved_m();
      turned_rad += projector.turned_rad();
      moved = projector.mechanism();
    }
    if (moved_m == 0.0 && turned_rad == 0.0) continue;
    projection.moved_m = std::max(projection.moved_m, moved_m);
    projection.turned_rad = std::max(projection.turned_rad, turned_rad);
    std::vector<int> joints = group.joints;
    joints.insert(joints.end(), group.closures.begin(), group.closures.end());
    std::vector<std::array<double, 6>> near;
    for (const Joint& joint : part.joints) near.push_back(joint.guess);
    const auto home = JointCoordinatesAt(moved, moved.X_WB_home, near);
    for (size_t k = 0; k < joints.size(); ++k) {
      Joint& joint = projected.joints[static_cast<size_t>(joints[k])];
      joint.X_PF = moved.joints[k].X_PF;
      joint.X_CM = moved.joints[k].X_CM;
      joint.guess = home[k];
    }
  }
  if (projection.moved_m == 0.0 && projection.turned_rad == 0.0) return projection;
  // Home is where it closes now; the guesses stay as they are.
  const bool closed = SolveHome(&projected).closed;
  for (size_t j = 0; j < projected.joints.size(); ++j) {
    projected.joints[j].guess = mechanism->joints[j].guess;
  }
  if (!closed) return projection;
  // What was redundant but for the gap must be so now. More may be: the third crank of a
  // parallelogram is as far off as the gap is wide.
  const int redundant = AnalyseMobility(projected).redundant;
  if (redundant < projection.redundant) return projection;
  projection.redundant = redundant;
  *mechanism = std::move(projected);
  projection.closed = true;
  return projection;
}

}  // namespace mbv

namespace mbv::internal {
namespace {

// Joint frames may have to move farther than the gap that they leave at home is wide, but not
// farther than digits explain.
constexpr double kProjectionReach = 10.0;
// Guesses are given to some digits; a driven joint that home moves farther is reported [rad,
// characteristic lengths].
constexpr double kMovedDrive = 1e-3;

// Moves joint frames where that takes no more than rounding; `why` is what it says then.
bool Project(const ClosureRules& rules, double gap, const std::string& why, Mechanism* mechanism,
             ModelReport* report) {
  const double length_m = CharacteristicLength(*mechanism);
  bool began = true;
  for (size_t w = 0; w < kWays.size(); ++w) {
    const Way& way = kWays[w];
    const bool again = w > 0 && way.steps == kWays[w - 1].steps &&
                       way.reaches.front() == kWays[w - 1].reaches.front();
    if (again && !began) continue;
    Mechanism projected = *mechanism;
    const DataProjection projection = ProjectData(&projected, gap, way);
    began = projection.began;
    const double moved_m = std::max(projection.moved_m, projection.turned_rad * length_m);
    if (!projection.closed || moved_m > rules.farthest_m) continue;
    *mechanism = std::move(projected);
    const std::string text = fmt::format(
        "joint frames moved by up to {:.2g} m and {:.2g} rad, because the loops are "
        "overconstrained by {} and {}",
        projection.moved_m, projection.turned_rad, projection.redundant, why);
    report->AtFile(Severity::kWarning,
                   rules.is_robot ? report->LeaveOut(text)
                                  : report->Allow(fmt::format("{} (closure_tolerance {:.2g} m)",
                                                              text, rules.tolerance_m)));
    return true;
  }
  return false;
}

// What a robot is allowed.
std::string Licence(const ClosureRules& rules) {
  if (!rules.is_robot) return "";
  return fmt::format(" ({} {:.2g} m)",
                     rules.printed.explains() ? "their digits explain" : "--closure-tolerance",
                     rules.tolerance_m);
}

// Rounded loops may close at home and yet not move. How much of a tolerance the rounding takes is
// not known: less of it leaves more rows independent.
bool ProjectLoopsThatCannotMove(const ClosureRules& rules, const std::string& why,
                                Mechanism* mechanism, ModelReport* report) {
  constexpr int kTries = 4;
  double gap = rules.tolerance_m / CharacteristicLength(*mechanism);
  int tried = 0;  // constraints that were redundant
  for (int i = 0; i < kTries && gap > kHomeTolerance; ++i, gap /= kGapFactor) {
    const int redundant = CountNearlyRedundant(*mechanism, gap);
    if (redundant == tried) continue;
    tried = redundant;
    if (Project(rules, gap, why, mechanism, report)) return true;
  }
  return false;
}

// A robot's drive that cannot move has loops that were drawn not quite alike.
void FreeStuckDrives(const ClosureRules& given, Mechanism* mechanism, ModelReport* report) {
  constexpr double kDrawn = 1e-3;  // characteristic lengths; frames move by ten times that
  if (!given.is_robot || !given.printed.explains()) return;
  std::vector<std::string> names;
  for (const size_t d : StuckDrives(*mechanism)) names.push_back(mechanism->drives[d].name);
  if (names.empty()) return;
  ClosureRules rules = given;
  rules.tolerance_m = kDrawn * CharacteristicLength(*mechanism);
  rules.farthest_m = kProjectionReach * rules.tolerance_m;
  (void)ProjectLoopsThatCannotMove(
      rules, fmt::format("{} could not move otherwise", Joined(names, 4)), mechanism, report);
}

void ReportGaps(const ClosureRules& rules, const Mechanism& mechanism, const HomeResult& home,
                const std::string& hint, ModelReport* report) {
  const double tolerance_m = home.tolerance * CharacteristicLength(mechanism);
  for (const LoopGap& gap : home.gaps) {
    const bool in_place = gap.position_m <= tolerance_m;
    const bool turned = !(gap.rotation_rad <= home.tolerance);
    if (in_place && !turned) continue;
    const Joint& joint = mechanism.joints[gap.joint];
    // Of a whole robot's loops the worst one alone has a hint.
    const bool has_hint = rules.bare_urdf && &gap != home.gaps.data();
    std::string text = fmt::format("the loop at joint '{}' does not close: gap", joint.name);
    if (!in_place) text += fmt::format(" {:.3g} m", gap.position_m);
    if (turned) text += fmt::format(" {:.3g} rad", gap.rotation_rad);
    Finding finding{
        .message = text, .hint = hint, .code = FindingCode::kOpenLoop, .subject = joint.name};
    if (const Finding* urdf = report->InUrdf(mechanism, gap.joint); urdf != nullptr) {
      finding.severity = urdf->severity;
      finding.file = urdf->file;
      finding.line = urdf->line;
      finding.column = urdf->column;
      finding.hint += "; guesses of URDF joints stand in the model file under `urdf: {guess: …}`";
      if (has_hint) finding.hint.clear();
      report->AddOther(std::move(finding));
    } else {
      report->AtJoint(gap.joint, std::move(finding));
    }
  }
  for (const CouplingGap& missed : home.couplings) {
    const Coupling& coupling = mechanism.couplings[missed.coupling];
    report->At(report->places().signals.Of(coupling.name), Severity::kError,
               fmt::format("coupling '{}' of {} does not hold at home: it is missed by {:.3g} {}",
                           coupling.name, CoupledJoints(mechanism, coupling), missed.amount,
                           missed.angular ? "rad" : "m"),
               hint);
  }
  if (!report->has_errors()) {
    report->AtFile(Severity::kError, "the home pose was not found");
  }
}

// Guesses of coupled coordinates that have none, in order of who leads: stated guesses, what is
// driven, what follows nothing, the later terms of a coupling.
void GuessFollowers(const std::set<int>& guessed, Mechanism* mechanism) {
  if (mechanism->couplings.empty()) return;
  std::vector<std::array<double, 6>> q;
  for (const Joint& joint : mechanism->joints) q.push_back(joint.guess);
  CoordinateSet known;
  const auto lead = [&](int j) {
    for (int c = 0; c < DofsOf(mechanism->joints[j].kind); ++c) known.insert({j, c});
  };
  for (const int j : guessed) lead(j);
  SolveFollowers(*mechanism, &known, &q);
  for (const Drive& drive : mechanism->drives) {
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
      known.insert({on->joint, on->coordinate});
    }
  }
  for (const Prescribed& base : mechanism->prescribed) lead(base.joint);
  SolveFollowers(*mechanism, &known, &q);
  CoordinateSet followers;
  for (const Coupling& coupling : mechanism->couplings) {
    followers.insert({coupling.terms[0].joint, coupling.terms[0].coordinate});
  }
  for (const Coupling& coupling : mechanism->couplings) {
    for (const Coupling::Term& term : coupling.terms) {
      const std::pair<int, int> at(term.joint, term.coordinate);
      if (!followers.contains(at)) known.insert(at);
    }
  }
  SolveFollowers(*mechanism, &known, &q);
  for (const Coupling& coupling : mechanism->couplings) {
    for (size_t k = 1; k < coupling.terms.size(); ++k) {
      known.insert({coupling.terms[k].joint, coupling.terms[k].coordinate});
    }
    SolveFollowers(*mechanism, &known, &q);
  }
  for (size_t j = 0; j < q.size(); ++j) mechanism->joints[j].guess = q[j];
}

// The drives that home could not leave at their guesses: commands that count from home do so from
// elsewhere.
void WarnAboutMovedDrives(const Mechanism& mechanism, ModelReport* report) {
  const double length_m = CharacteristicLength(mechanism);
  std::string text;
  Place at;
  const auto add = [&](int j, const std::string& name) {
    const Joint& joint = mechanism.joints[j];
    const bool is_length = IsLength(joint.kind, 0);
    const double moved = std::abs(joint.home[0] - joint.guess[0]) / (is_length ? length_m : 1.0);
    if (DofsOf(joint.kind) != 1 || !(moved > kMovedDrive)) return;
    if (at.line == 0) at = report->places().joints[j];
    text += fmt::format("{}{} from {:.5g} to {:.5g} {}", text.empty() ? "" : ", ", name,
                        joint.guess[0], joint.home[0], is_length ? "m" : "rad");
  };
  for (const Drive& drive : mechanism.drives) {
    if (const auto* d = std::get_if<JointDrive>(&drive.kind)) add(d->joint, drive.name);
  }
  for (const Prescribed& p : mechanism.prescribed) add(p.joint, p.name);
  if (text.empty()) return;
  report->At(at, Severity::kWarning,
             "the loops do not close with the driven joints at their guesses: home has " + text,
             "if that is not the pose you mean, look for a wrong length, or give guesses that "
             "close the loops");
}

}  // namespace

// Only a search closed the loops: which assembly is meant is not known.
void WarnAboutAssembly(const Mechanism& mechanism, const HomeResult& home, ModelReport* report) {
  constexpr size_t kMostJoints = 4;
  std::vector<std::pair<double, int>> moved;  // by how much, tree joint
  const double length_m = CharacteristicLength(mechanism);
  for (const int j : mechanism.tree_joints) {
    const Joint& joint = mechanism.joints[j];
    double most = 0.0;
    for (int k = 0; k < DofsOf(joint.kind); ++k) {
      const double unit = IsLength(joint.kind, k) ? length_m : 1.0;
      most = std::max(most, std::abs(joint.home[k] - joint.guess[k]) / unit);
    }
    if (most > 0.0) moved.emplace_back(-most, j);
  }
  std::sort(moved.begin(), moved.end());
  std::string text;
  for (size_t i = 0; i < std::min(moved.size(), kMostJoints); ++i) {
    const Joint& joint = mechanism.joints[moved[i].second];
    text += fmt::format("{}{} from {:.4g} to {:.4g}", i == 0 ? "" : ", ", joint.name,
                        joint.guess[0], joint.home[0]);
  }
  for (const GroupAssemblies& group : home.searched) {
    if (!group.assemblies.empty()) text += "; " + AssemblyText(mechanism, group);
  }
  const Place at = moved.empty() ? Place{} : report->places().joints[moved.front().second];
  report->At(at, Severity::kWarning,
             fmt::format("the loops close only by a search (gap {:.2g} at the guesses): "
                         "this may be another assembly than meant; {}",
                         home.gap_at_guess, text),
             "look at a picture of the home pose, and guess nearer to the pose that is meant");
}

namespace {

void ReportUnmet(const Mechanism& mechanism, const HomeResult& home, ModelReport* report) {
  std::vector<std::string> closures;
  for (const Joint& joint : mechanism.joints) {
    if (joint.closure) closures.push_back(joint.name);
  }
  for (const UnmetChoice& unmet : home.unmet) {
    if (unmet.found < 0) {
      report->AtFile(Severity::kError,
                     fmt::format("assembly {}={}: there is no closure of this name", unmet.closure,
                                 unmet.wanted),
                     DidYouMean(unmet.closure, closures));
    } else {
      report->AtFile(Severity::kError,
                     fmt::format("assembly {}={}: {} to close the loops of '{}' {} found",
                                 unmet.closure, unmet.wanted,
                                 unmet.found == 1 ? "1 way" : fmt::format("{} ways", unmet.found),
                                 unmet.closure, unmet.found == 1 ? "was" : "were"),
                     "they are counted from 1, the nearest to the guesses");
    }
  }
}

}  // namespace

namespace {

// The gap [m] to which rounding of each joint's frames may add up along the longest loop.
double ExplainedGap(const PrintedRounding& printed, const Mechanism& mechanism) {
  std::vector<int> above(mechanism.bodies.size(), 0);  // the inboard body
  for (size_t i = 0; i < mechanism.tree_joints.size(); ++i) {
    const Joint& joint = mechanism.joints[static_cast<size_t>(mechanism.tree_joints[i])];
    const bool reversed = mechanism.tree_reversed[i];
    above[static_cast<size_t>(reversed ? joint.parent : joint.child)] =
        reversed ? joint.child : joint.parent;
  }
  const auto path = [&above](int body) {
    std::vector<int> bodies;
    for (; body != 0; body = above[static_cast<size_t>(body)]) bodies.push_back(body);
    return bodies;
  };
  size_t longest = 0;
  for (const Joint& joint : mechanism.joints) {
    if (!joint.closure) continue;
    std::vector<int> a = path(joint.parent), b = path(joint.child);
    while (!a.empty() && !b.empty() && a.back() == b.back()) {
      a.pop_back();
      b.pop_back();
    }
    longest = std::max(longest, a.size() + b.size() + 1);
  }
  // Three components of a position; a quaternion's error turns by twice as much.
  return static_cast<double>(longest) * (std::sqrt(3.0) * printed.length +
                                         2.0 * printed.direction * CharacteristicLength(mechanism));
}

// Home poses from which loops can go on in several ways: a stretched parallelogram, which may stay
// one or become a crossed one. Constraints that depend on each other there do not beside it.

// How a group of loops goes on from home.
struct WayOn {
  Mechanism there;
  int translating = 0;  // bodies that keep their orientation
  double moved = 0.0;   // root mean square of the group's coordinates [rad, characteristic lengths]
};

class SingularHome {
 public:
  SingularHome(const Mechanism& home, const LoopGroup& group)
      : home_(home), group_(group), length_m_(CharacteristicLength(home)), dofs_(CountDofs(home)) {}

  /// Ways on, the likeliest first: links that keep their orientation are what parallelograms are
  /// for; then what moves least. Empty where home is not singular.
  std::vector<WayOn> Find() {
    std::mt19937_64 random(20261128);
    std::vector<WayOn> ways;
    int closed = 0;
    for (int i = 0; i < kTries; ++i) {
      if (closed >= kEnoughToSee && ways.empty()) break;
      WayOn way{.there = home_};
      Kick(&random, &way.there);
      const HomeResult result = SolveHome(&way.there);
      if (!result.closed || result.drives_moved || result.guesses_moved) continue;
      if (!Measure(&way)) continue;
      ++closed;
      if (CountDofs(way.there) < dofs_ && IsNew(way, ways)) ways.push_back(std::move(way));
    }
    std::ranges::stable_sort(ways, [](const WayOn& a, const WayOn& b) {
      return std::pair(-a.translating, a.moved) < std::pair(-b.translating, b.moved);
    });
    return ways;
  }

  /// "B = -0.1, D = 0.1" of joints that move most.
  [[nodiscard]] std::string Text(const Mechanism& there) const {
    constexpr size_t kMost = 4;
    std::vector<std::pair<double, int>> moved;
    for (const int j : group_.joints) moved.emplace_back(-Distance(there, j), j);
    std::sort(moved.begin(), moved.end());
    std::vector<std::string> texts;
    for (size_t i = 0; i < std::min(moved.size(), kMost); ++i) {
      const Joint& joint = there.joints[moved[i].second];
      texts.push_back(fmt::format("{} = {:.4g}", joint.name, joint.home[0]));
    }
    return Joined(texts);
  }

 private:
  static constexpr int kTries = 24, kEnoughToSee = 2;
  static constexpr double kStep = 0.1;      // rad, characteristic lengths
  static constexpr double kFarthest = 1.0;  // beyond it another assembly is reached
  static constexpr double kSame = 0.02, kTurned = 1e-7;

  [[nodiscard]] double Unit(const Joint& joint, int c) const {
    return IsLength(joint.kind, c) ? length_m_ : 1.0;
  }

  // Driven joints by the step, to where there is room; others anywhere near.
  void Kick(std::mt19937_64* random, Mechanism* there) const {
    std::uniform_real_distribution<double> uniform(-1.5 * kStep, 1.5 * kStep);
    for (Joint& joint : there->joints) joint.guess = joint.home;
    for (const int j : group_.joints) {
      Joint& joint = there->joints[j];
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        const CoordinateRange& range = joint.range[c];
        double step = kStep * Unit(joint, c);
        if (HasDrivenCoordinate(home_, j)) {
          const double up = range.upper - joint.home[c], down = joint.home[c] - range.lower;
          if (up < 2.0 * step && down > up) step = -std::min(step, 0.5 * down);
        } else {
          step = uniform(*random) * Unit(joint, c);
        }
        joint.guess[c] = std::clamp(joint.home[c] + step, range.lower, range.upper);
      }
    }
  }

  [[nodiscard]] double Distance(const Mechanism& there, int j) const {
    const Joint& joint = there.joints[j];
    double sum = 0.0;
    for (int c = 0; c < DofsOf(joint.kind); ++c) {
      sum += std::pow((joint.home[c] - home_.joints[j].home[c]) / Unit(joint, c), 2);
    }
    return std::sqrt(sum);
  }

  // False where it is too far away to be the same assembly.
  bool Measure(WayOn* way) const {
    double sum = 0.0, most = 0.0;
    for (const int j : group_.joints) {
      const double distance = Distance(way->there, j);
      sum += distance * distance;
      most = std::max(most, distance);
    }
    way->moved = std::sqrt(sum / static_cast<double>(group_.joints.size()));
    for (size_t b = 1; b < home_.bodies.size(); ++b) {
      const Mat3 turned =
          home_.X_WB_home[b].linear().transpose() * way->there.X_WB_home[b].linear();
      way->translating += LogRotation(turned).norm() < kTurned ? 1 : 0;
    }
    return most < kFarthest;
  }

  [[nodiscard]] bool IsNew(const WayOn& way, const std::vector<WayOn>& ways) const {
    return std::ranges::none_of(ways, [&](const WayOn& known) {
      return std::ranges::all_of(group_.joints, [&](int j) {
        const Joint &a = way.there.joints[j], &b = known.there.joints[j];
        for (int c = 0; c < DofsOf(a.kind); ++c) {
          if (std::abs(a.home[c] - b.home[c]) > kSame * Unit(a, c)) return false;
        }
        return true;
      });
    });
  }

  const Mechanism& home_;
  const LoopGroup& group_;
  const double length_m_;
  const int dofs_;
};

// The joints in which a group of loops would move most if constraints up to `gap` did not hold it.
std::vector<std::string> SoftJoints(const Mechanism& part, double gap) {
  constexpr size_t kMost = 4;
  constexpr double kLeast = 0.1;  // of the largest
  const internal::SparseRows J = ScaledRows(part);
  const MatX free = internal::FindRank(J, internal::NullSpaces::kMotion).motion;
  MatX soft = internal::FindRank(J, internal::NullSpaces::kMotion, RankTolerance(gap)).motion;
  if (free.cols() > 0) soft -= free * free.completeOrthogonalDecomposition().solve(soft);
  Eigen::Index largest = 0;
  soft.colwise().norm().maxCoeff(&largest);
  const auto turning = [&](int body) -> Vec3 {
    return body == 0 ? Vec3(Vec3::Zero()) : Vec3(soft.col(largest).segment<3>(6 * (body - 1)));
  };
  std::vector<std::pair<double, std::string>> moves;
  for (const Joint& joint : part.joints) {
    moves.emplace_back(-(turning(joint.child) - turning(joint.parent)).norm(), joint.name);
  }
  std::sort(moves.begin(), moves.end());
  std::vector<std::string> names;
  for (size_t i = 0; i < std::min(moves.size(), kMost); ++i) {
    if (moves[i].first <= kLeast * moves[0].first) names.push_back(moves[i].second);
  }
  return names;
}

// Loops that rounding alone holds, as it does two cranks in one line: what they bear is noise.
void ReportDeadPoints(const Mechanism& mechanism, ModelReport* report) {
  constexpr double kGap = 4e-7;  // singular values below 1.2e-5 hold nothing to nine digits
  for (const LoopGroup& group : LoopGroups(mechanism)) {
    const Mechanism part = GroupAlone(mechanism, group);
    if (CountNearlyRedundant(part, kGap) == CountNearlyRedundant(part, 0.0)) continue;
    report->AtJoint(
        static_cast<size_t>(group.closures.front()),
        {.message = fmt::format("the loops at '{}' stand at a dead point at home: nothing but "
                                "rounded numbers keeps {} from turning, so that neither how they "
                                "go on nor what they bear is known",
                                mechanism.joints[group.closures.front()].name,
                                Joined(SoftJoints(part, kGap))),
         .hint = "a spring leaf is a joint with a spring; a keyframe, "
                 "or guesses in a model file, state another pose"});
  }
}

// Home is moved by a step in which the first motion goes on.
void LeaveSingularHome(Mechanism* mechanism, ModelReport* report) {
  for (const LoopGroup& group : LoopGroups(*mechanism)) {
    SingularHome home(*mechanism, group);
    std::vector<WayOn> ways = home.Find();
    if (ways.empty()) continue;
    std::string others;
    for (size_t w = 1; w < ways.size(); ++w) {
      others += fmt::format("{}{}", w == 1 ? "; also: " : " | ", home.Text(ways[w].there));
    }
    const Joint& closure = mechanism->joints[group.closures.front()];
    const std::string text = fmt::format(
        "the home pose is singular: there the loops at '{}' can go on in several ways, as a "
        "stretched parallelogram can, and have {} degrees of freedom instead of {}. It is left by "
        "a small step in the way in which most links keep their orientation, then in that which "
        "moves least: {}{}",
        closure.name, CountDofs(*mechanism), CountDofs(ways.front().there),
        home.Text(ways.front().there), others);
    *mechanism = std::move(ways.front().there);
    report->AtJoint(static_cast<size_t>(group.closures.front()), Severity::kWarning, text,
                    "a keyframe, or guesses in a model file, state another pose");
  }
}

}  // namespace

void CloseLoops(const ClosureRules& given, Mechanism* mechanism, ModelReport* report) {
  ClosureRules rules = given;
  const double explained_m = ExplainedGap(rules.printed, *mechanism);
  rules.tolerance_m = std::max(given.tolerance_m, explained_m);
  rules.farthest_m = std::max(kProjectionReach * given.tolerance_m, explained_m);
  GuessFollowers(rules.guessed, mechanism);
  const HomeResult home = SolveHome(mechanism, rules.assembly);
  if (!home.unmet.empty()) return ReportUnmet(*mechanism, home, report);
  if (home.closed) {
    if (!ProjectLoopsThatCannotMove(rules,
                                    "their data let them move except for rounding" + Licence(rules),
                                    mechanism, report)) {
      FreeStuckDrives(rules, mechanism, report);
    }
    if (home.guesses_moved) {
      WarnAboutAssembly(*mechanism, home, report);
    } else if (home.drives_moved) {
      WarnAboutMovedDrives(*mechanism, report);
    }
    if (rules.is_robot) {
      LeaveSingularHome(mechanism, report);
      ReportDeadPoints(*mechanism, report);
    }
    return;
  }
  const double gap_m = home.gap * CharacteristicLength(*mechanism);
  const int redundant = CountNearlyRedundant(*mechanism, home.gap);
  if (redundant > 0 && gap_m <= rules.tolerance_m &&
      Project(rules, home.gap,
              fmt::format("their data close them except for {:.2g} m", gap_m) + Licence(rules),
              mechanism, report)) {
    return;
  }
  if (rules.bare_urdf &&
      (TakeNamedBalls(mechanism, report) || TakeWeldsAsPoints(home, mechanism, report))) {
    return;
  }
  std::string hint = "improve the guesses of the loop's joints, or look for a wrong length or axis";
  if (rules.bare_urdf) hint += "; " + WhatWouldClose(*mechanism, home);
  if (redundant > 0) {
    hint = fmt::format(
        "the loops are overconstrained by {} and closed except for {:.2g} m: rounded data? More "
        "digits close them; {}{:.0e}{} moves the joint frames by as little as closes them",
        redundant, gap_m,
        rules.is_robot ? "--closure-tolerance " : "`closure_tolerance: ", 2 * gap_m,
        rules.is_robot ? "" : "` in the model");
  }
  CheckAxes(*mechanism, false, report);
  ReportGaps(rules, *mechanism, home, hint, report);
}

}  // namespace mbv::internal
