// Unknown are the small motions ξ of all frames F and M in their bodies (lengths in characteristic
// lengths L) and the tree's coordinates q_k at K poses, home among them:
//   r(ξ, q_k) = 0,  k = 1 … K
// solved from ξ = 0 by Levenberg–Marquardt, whose steps are of least norm. The poses lie some way
// along the freedoms that the mechanism has but for the gap, closed as well as the frames as given
// allow.
#include "kinematics/data_projection.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "core/spatial.h"
#include "kinematics/closure_residual.h"
#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "kinematics/row_stack.h"
#include "mechanism/body_states.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::ClosureResidual;
using internal::DampedStep;
using internal::TreeMotion;

// Singular values of redundant rows are as small as the gap that closes them, within this factor.
constexpr double kGapFactor = 30.0;
// Larger gaps [L, rad] are no rounding.
constexpr double kLargestGap = 3e-3;
constexpr double kLeastDamping = 1e-12;  // over the residual
// A paradoxical loop that closes in too few poses, or in a short arc, is open by a ten thousandth
// of the rounding elsewhere, and its reactions are then noise.
constexpr Eigen::Index kPoses = 24, kFewestPoses = 12;
constexpr double kReach = 2.4;  // of the poses from home [rad, L]
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
  explicit Projector(const Mechanism& mechanism, double gap)
      : mechanism_(mechanism),
        length_(CharacteristicLength(mechanism)),
        tree_(mechanism_, std::vector<bool>(mechanism.joints.size(), false)),
        frames_(static_cast<Eigen::Index>(12 * mechanism.joints.size())),
        xi_(VecX::Zero(frames_)) {
    unit_.setOnes(tree_.freedoms());
    for (int c = 0; c < tree_.freedoms(); ++c) {
      if (!tree_.angular()[c]) unit_[c] = length_;
    }
    MakePoses(gap);
  }

  [[nodiscard]] Eigen::Index unknowns() const {
    return frames_ + static_cast<Eigen::Index>(poses_.size()) * tree_.freedoms();
  }

  /// True if all poses close.
  bool Solve() {
    MatX J;
    VecX r = Evaluate(poses_, &J);
    // Damping that vanishes with the residual keeps the convergence quadratic. Rows that only this
    // residual makes independent have singular values of the gap's size: more damping than their
    // squares would hold the steps along them back for good, so each iteration begins far below.
    double mu = kLeastDamping;
    for (int i = 0; i < 60 && r.lpNorm<Eigen::Infinity>() > 1e-15; ++i) {
      mu = std::max(0.01 * mu, kLeastDamping * r.norm());
      bool better = false;
      for (int attempt = 0; attempt < 16 && !better; ++attempt, mu *= better ? 1 : 30) {
        const VecX s = DampedStep(J, r, mu);
        const std::vector<std::vector<Pose>> old_poses = poses_;
        const VecX old_xi = xi_;
        Apply(s);
        const VecX next = Evaluate(poses_, nullptr);
        better = next.norm() < r.norm();
        if (!better) {
          poses_ = old_poses;
          SetFrames(old_xi);
        }
      }
      if (!better) break;
      r = Evaluate(poses_, &J);
    }
    return r.lpNorm<Eigen::Infinity>() < 1e-12;
  }

  [[nodiscard]] const Mechanism& mechanism() const { return mechanism_; }
  [[nodiscard]] std::vector<Pose> HomePoses() const { return tree_.States(poses_[0]).X_WB; }
  [[nodiscard]] double moved_m() const { return length_ * Largest(3); }
  [[nodiscard]] double turned_rad() const { return Largest(0); }

 private:
  [[nodiscard]] double Largest(Eigen::Index first) const {
    double largest = 0.0;
    for (Eigen::Index i = first; i < frames_; i += 6) {
      largest = std::max(largest, xi_.segment<3>(i).norm());
    }
    return largest;
  }

  // As many as the number of unknowns allows.
  [[nodiscard]] Eigen::Index Poses() const {
    const Eigen::Index room = (kMostUnknowns - frames_) / std::max(1, tree_.freedoms());
    return std::clamp(room, kFewestPoses, kPoses);
  }

  void MakePoses(double gap) {
    for (const Joint& joint : mechanism_.joints) {
      given_.push_back(joint.X_PF);
      given_.push_back(joint.X_CM);
    }
    const MatX motion = internal::FindRank(ScaledRows(mechanism_), internal::NullSpaces::kMotion,
                                           RankTolerance(gap))
                            .motion;
    std::mt19937_64 random(20260922);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    std::vector<std::array<double, 6>> near;
    for (const Joint& joint : mechanism_.joints) near.push_back(joint.home);
    const Eigen::Index poses = motion.cols() == 0 ? 1 : Poses();
    for (Eigen::Index k = 0; k < poses; ++k) {
      VecX dx = VecX::Zero(motion.rows());
      for (Eigen::Index c = 0; c < motion.cols() && k > 0; ++c) {
        dx += uniform(random) * motion.col(c);
      }
      // Spread over both directions of a single freedom, too.
      const double amplitude =
          kReach * (2.0 * static_cast<double>(k) / static_cast<double>(poses) - 1.0);
      if (const double size = dx.lpNorm<Eigen::Infinity>(); size > 0.0) dx *= amplitude / size;
      std::vector<Pose> X_WB = mechanism_.X_WB_home;
      for (size_t b = 1; b < X_WB.size(); ++b) {
        const Vec6 twist = dx.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
        X_WB[b].linear() = ExpRotation(twist.head<3>()) * X_WB[b].linear();
        X_WB[b].translation() += length_ * twist.tail<3>();
      }
      const auto q = JointCoordinatesAt(mechanism_, X_WB, near);
      std::vector<Pose>& X_FM = poses_.emplace_back();
      for (size_t j = 0; j < q.size(); ++j) {
        X_FM.push_back(JointPose(mechanism_.joints[j], q[j]));
      }
      CloseAsGiven(&X_FM);
      // Beyond the range of the motion: no rounding.
      if (k > 0 && At(X_FM, nullptr).lpNorm<Eigen::Infinity>() > kGapFactor * gap) {
        poses_.pop_back();
      }
    }
  }

  // As well as the frames as given allow: what is left then is the rounding.
  void CloseAsGiven(std::vector<Pose>* X_FM) const {
    MatX J;
    VecX r = At(*X_FM, &J);
    for (int i = 0; i < 50; ++i) {
      const double before = r.norm();
      double mu = std::max(r.squaredNorm(), 1e-26);
      for (int attempt = 0; attempt < 12 && !(r.norm() < before); ++attempt, mu *= 30) {
        const VecX s = DampedStep(J * unit_.asDiagonal(), r, mu);
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
          s.segment(frames_ + static_cast<Eigen::Index>(k) * tree_.freedoms(), tree_.freedoms());
      tree_.Step(unit_.cwiseProduct(dq), &poses_[k]);
    }
  }

  VecX At(const std::vector<Pose>& X_FM, MatX* J) const {
    return ClosureResidual(mechanism_, tree_, tree_.States(X_FM), length_, J);
  }

  // Residuals of all poses; derivatives by the frames from central differences.
  VecX Evaluate(const std::vector<std::vector<Pose>>& poses, MatX* J) {
    constexpr double kStep = 1e-6;
    const Eigen::Index rows = At(poses[0], nullptr).size(), n = tree_.freedoms();
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
      for (const double step : {kStep, -kStep}) {
        Vec6 bent = xi;
        bent[c % 6] += step;
        MoveFrame(static_cast<size_t>(c / 6), bent);
        for (Eigen::Index k = 0; k < count; ++k) {
          J->block(k * rows, c, rows, 1) += At(poses[k], nullptr) / (2 * step);
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
  VecX xi_, unit_;
  std::vector<Pose> given_;               // X_PF, X_CM of each joint
  std::vector<std::vector<Pose>> poses_;  // X_FM per joint
};

}  // namespace

int CountNearlyRedundant(const Mechanism& mechanism, double gap) {
  if (!(gap < kLargestGap)) return 0;
  const internal::SparseRows J = ScaledRows(mechanism);
  const int rank = internal::FindRank(J, internal::NullSpaces::kNone, RankTolerance(gap)).rank;
  return static_cast<int>(J.rows()) - rank;
}

DataProjection ProjectData(Mechanism* mechanism, double gap) {
  DataProjection projection;
  projection.redundant = CountNearlyRedundant(*mechanism, gap);
  if (projection.redundant == 0) return projection;
  Projector projector(*mechanism, gap);
  if (projector.unknowns() > kMostUnknowns || !projector.Solve()) return projection;
  Mechanism projected = projector.mechanism();
  // Home is where it closes now; the guesses stay as they are.
  std::vector<std::array<double, 6>> near;
  for (const Joint& joint : mechanism->joints) near.push_back(joint.guess);
  const auto home = JointCoordinatesAt(projected, projector.HomePoses(), near);
  for (size_t j = 0; j < home.size(); ++j) projected.joints[j].guess = home[j];
  const bool closed = SolveHome(&projected).closed;
  for (size_t j = 0; j < home.size(); ++j) projected.joints[j].guess = near[j];
  if (!closed) return projection;
  // What was redundant but for the gap must be so now.
  if (AnalyseMobility(projected).redundant != projection.redundant) return projection;
  *mechanism = std::move(projected);
  projection.closed = true;
  projection.moved_m = projector.moved_m();
  projection.turned_rad = projector.turned_rad();
  return projection;
}

}  // namespace mbv
