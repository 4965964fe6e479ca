#include "kinematics/assembly.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/tree_motion.h"
#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "mechanism/motion.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv {
namespace {

using internal::TreeMotion;

struct PartOfTree {
  Mechanism mechanism;
  double length = 1.0;
};

PartOfTree Extract(const Mechanism& whole, const LoopGroup& group) {
  PartOfTree part{.mechanism = GroupAlone(whole, group)};
  part.length = CharacteristicLength(part.mechanism);
  return part;
}

struct Closed {
  JointCoordinates q;
  double gap = std::numeric_limits<double>::infinity();  // norm of the residual
};

class GroupSolver {
 public:
  GroupSolver(const PartOfTree& part, const std::vector<bool>& locked)
      : m_(part.mechanism), length_(part.length), tree_(m_, locked) {
    unit_.resize(tree_.dofs());
    for (int c = 0; c < tree_.dofs(); ++c) unit_[c] = tree_.angular()[c] ? 1.0 : length_;
  }

  [[nodiscard]] Closed Run(const JointCoordinates& start) const {
    std::vector<Pose> X_FM;
    for (size_t j = 0; j < m_.joints.size(); ++j) {
      X_FM.push_back(JointPose(m_.joints[j], start[j]));
    }
    const auto evaluate = [&](std::vector<Pose>* at, MatX* J) {
      VecX r = Residual(tree_.States(*at), J);
      *J = *J * unit_.asDiagonal();
      return r;
    };
    const auto move = [&](const VecX& s, std::vector<Pose>* at) {
      tree_.Step(unit_.cwiseProduct(s), at);
    };
    internal::StallRule enough{.done = kDone, .share = 1e-4, .most = 12};
    const VecX r = internal::DampedSearch(kDamping, &X_FM, evaluate, move, enough);
    Closed closed{.q = start, .gap = r.norm()};
    const std::vector<Pose> X_WB = tree_.States(X_FM).X_WB;
    closed.q = JointCoordinatesAt(m_, X_WB, start);
    return closed;
  }

  // Steps in rad, or characteristic lengths.
  static constexpr internal::DampingRule kDamping{.most_steps = 150,
                                                  .largest_step = 0.7,
                                                  .first = 1e-2,
                                                  .least = 1e-14,
                                                  .most = 8e8,
                                                  .easier = 0.2,
                                                  .stronger = 8.0};
  /// Below this norm of the residual loops count as closed; the caller refines them.
  static constexpr double kDone = 1e-9;

 private:
  VecX Residual(const BodyStates& states, MatX* J) const {
    const MatX J_bodies = tree_.Jacobian(states);
    std::vector<internal::ClosureGap> gaps;
    std::vector<const Joint*> joints;
    Eigen::Index rows = 0;
    for (const Joint& joint : m_.joints) {
      if (!joint.closure) continue;
      gaps.push_back(internal::AssemblyResidual(
          joint, {states.X_WB[joint.parent], states.X_WB[joint.child]}, length_));
      joints.push_back(&joint);
      rows += gaps.back().residual.size();
    }
    VecX r(rows);
    J->resize(rows, tree_.dofs());
    Eigen::Index at = 0;
    for (size_t k = 0; k < gaps.size(); ++k) {
      const Eigen::Index n = gaps[k].residual.size();
      r.segment(at, n) = gaps[k].residual;
      J->middleRows(at, n) = gaps[k].J_parent * J_bodies.middleRows<6>(6 * joints[k]->parent) +
                             gaps[k].J_child * J_bodies.middleRows<6>(6 * joints[k]->child);
      at += n;
    }
    return r;
  }

  const Mechanism& m_;
  double length_;
  TreeMotion tree_;
  VecX unit_;
};

// Distance [rad, characteristic lengths] of two positions of a joint.
double JointDistance(const Joint& joint, const std::array<double, 6>& a,
                     const std::array<double, 6>& b, double length) {
  const Pose X_a = JointPose(joint, a), X_b = JointPose(joint, b);
  const Vec3 shift = X_a.translation() - X_b.translation();
  const Vec3 turn = LogRotation(X_a.linear().transpose() * X_b.linear());
  return std::hypot(shift.norm() / length, turn.norm());
}

class AssemblySearch {
 public:
  AssemblySearch(const Mechanism& whole, const LoopGroup& group, const std::vector<bool>& driven,
                 const JointCoordinates& guess)
      : part_(Extract(whole, group)) {
    for (const int j : group.joints) {
      guess_.push_back(guess[j]);
      driven_.push_back(driven[j]);
    }
    for (const int j : group.closures) {
      guess_.push_back(guess[j]);
      driven_.push_back(false);
    }
    found_.group = group;
  }

  GroupAssemblies Run() {
    const bool any_driven = std::find(driven_.begin(), driven_.end(), true) != driven_.end();
    Search(driven_);
    if (found_.assemblies.empty() && any_driven) {
      found_.drives_moved = true;
      Search(std::vector<bool>(driven_.size(), false));
    }
    std::stable_sort(found_.assemblies.begin(), found_.assemblies.end(),
                     [](const Assembly& a, const Assembly& b) { return a.distance < b.distance; });
    if (!found_.assemblies.empty()) {
      found_.from_guess = SameWay(found_.assemblies.front().q, first_);
    }
    return std::move(found_);
  }

 private:
  static constexpr int kStarts = 48;
  static constexpr size_t kMostAssemblies = 8;
  // Closed once, the ways that are near enough to be meant are looked for, not all.
  static constexpr int kStartsOnceClosed = 16;

  void Search(const std::vector<bool>& locked) {
    const GroupSolver solver(part_, locked);
    std::mt19937_64 random(20220101);
    for (int i = 0; i < kStarts; ++i) {
      if (!found_.assemblies.empty() && i >= kStartsOnceClosed) break;
      const double amplitude = std::min(0.15 * i, std::numbers::pi);
      const Closed closed = solver.Run(Start(locked, amplitude, &random));
      ++found_.starts;
      if (closed.gap < best_gap_) {
        best_gap_ = closed.gap;
        found_.best = OfTheTree(closed.q);
      }
      if (closed.gap >= GroupSolver::kDone) continue;
      if (i == 0) first_ = OfTheTree(closed.q);
      Add(OfTheTree(closed.q));
      if (found_.assemblies.size() >= kMostAssemblies) break;
    }
  }

  // Around the guesses, within the ranges.
  JointCoordinates Start(const std::vector<bool>& locked, double amplitude,
                         std::mt19937_64* random) const {
    std::uniform_real_distribution<double> uniform(-amplitude, amplitude);
    JointCoordinates q = guess_;
    if (amplitude == 0.0) return q;
    for (const int j : part_.mechanism.tree_joints) {
      if (locked[j]) continue;
      const Joint& joint = part_.mechanism.joints[j];
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        const double step = uniform(*random) * (IsLength(joint.kind, c) ? 0.5 * part_.length : 1.0);
        q[j][c] = std::clamp(q[j][c] + step, joint.range[c].lower, joint.range[c].upper);
      }
    }
    return q;
  }

  [[nodiscard]] JointCoordinates OfTheTree(const JointCoordinates& q) const {
    const auto n = static_cast<std::ptrdiff_t>(part_.mechanism.tree_joints.size());
    return {q.begin(), q.begin() + n};
  }

  // Where the joints lie; what only spins about an axis of its own stays where it is.
  [[nodiscard]] std::vector<Vec3> Anchors(const JointCoordinates& q) const {
    JointCoordinates all = q;
    all.resize(part_.mechanism.joints.size());
    const std::vector<Pose> X_WB = TreePoses(part_.mechanism, all);
    std::vector<Vec3> anchors;
    for (const Joint& joint : part_.mechanism.joints) {
      anchors.push_back(X_WB[joint.parent] * joint.X_PF.translation());
      anchors.push_back(X_WB[joint.child] * joint.X_CM.translation());
    }
    return anchors;
  }

  [[nodiscard]] bool SameWay(const JointCoordinates& a, const JointCoordinates& b) const {
    if (a.size() != b.size()) return false;
    const std::vector<Vec3> at_a = Anchors(a), at_b = Anchors(b);
    double most = 0.0;
    for (size_t i = 0; i < at_a.size(); ++i) most = std::max(most, (at_a[i] - at_b[i]).norm());
    // Free drives leave a continuum of poses.
    return most < (found_.drives_moved ? 0.5 : 0.02) * part_.length;
  }

  void Add(const JointCoordinates& q) {
    double sum = 0.0;
    for (size_t j = 0; j < q.size(); ++j) {
      const double d = JointDistance(part_.mechanism.joints[j], q[j], guess_[j], part_.length);
      sum += d * d;
    }
    const Assembly next{.q = q, .distance = std::sqrt(sum / static_cast<double>(q.size()))};
    for (Assembly& known : found_.assemblies) {
      if (!SameWay(known.q, q)) continue;
      if (next.distance < known.distance) known = next;
      return;
    }
    found_.assemblies.push_back(next);
  }

  const PartOfTree part_;
  JointCoordinates guess_;
  std::vector<bool> driven_;
  GroupAssemblies found_;
  JointCoordinates first_;  // reached from the guesses themselves; empty: nothing was
  double best_gap_ = std::numeric_limits<double>::infinity();
};

}  // namespace

Mechanism GroupAlone(const Mechanism& whole, const LoopGroup& group) {
  Mechanism m;
  std::map<int, int> index;  // of bodies
  const bool at_home = !whole.X_WB_home.empty();
  Pose X_OW = Pose::Identity();  // of the world in the innermost body
  const auto add = [&](int body) {
    if (!index.emplace(body, static_cast<int>(m.bodies.size())).second) return;
    if (at_home && m.bodies.empty()) X_OW = whole.X_WB_home[body].inverse();
    m.bodies.push_back(whole.bodies[body]);
    if (at_home) m.X_WB_home.push_back(X_OW * whole.X_WB_home[body]);
  };
  for (const int j : group.joints) {
    const auto at = std::find(whole.tree_joints.begin(), whole.tree_joints.end(), j);
    const auto t = static_cast<size_t>(at - whole.tree_joints.begin());
    add(InboardBody(whole, t));  // the first one becomes the world
    add(OutboardBody(whole, t));
    m.tree_joints.push_back(static_cast<int>(m.joints.size()));
    m.tree_reversed.push_back(whole.tree_reversed[t]);
    m.joints.push_back(whole.joints[j]);
  }
  for (const int j : group.closures) m.joints.push_back(whole.joints[j]);
  for (Joint& joint : m.joints) {
    joint.parent = index.at(joint.parent);
    joint.child = index.at(joint.child);
  }
  return m;
}

GroupAssemblies FindAssemblies(const Mechanism& mechanism, const LoopGroup& group,
                               const std::vector<bool>& driven, const JointCoordinates& guess) {
  if (group.joints.empty()) return {.group = group, .best = {}};
  return AssemblySearch(mechanism, group, driven, guess).Run();
}

}  // namespace mbv

// What is open at a closure, as rotation vectors that vanish nowhere else.

namespace mbv::internal {
namespace {

// d log(R)/dt = L ω for Ṙ = [ω]× R, the inverse left Jacobian of SO(3).
Mat3 LogDerivative(const Vec3& r) {
  const double angle = r.norm();
  const Mat3 S = Skew(r);
  double k = 1.0 / 12.0;
  if (angle > 1e-3) k = (1.0 - 0.5 * angle / std::tan(0.5 * angle)) / (angle * angle);
  return Mat3::Identity() - 0.5 * S + k * S * S;
}

// Rotation vector that turns the unit vector a onto m by the shortest way, and its derivative by
// the angular velocity of m.
void Alignment(const Vec3& a, const Vec3& m, Vec3* r, Mat3* J) {
  const Vec3 cross = a.cross(m);
  const double sine = cross.norm(), angle = std::atan2(sine, a.dot(m));
  if (sine < 1e-12 && angle < 1.0) {
    r->setZero();
    *J = Mat3::Identity() - a * a.transpose();
    return;
  }
  // Against each other any way is as short: some perpendicular axis.
  const Vec3 n = sine < 1e-12 ? Vec3(a.unitOrthogonal()) : Vec3(cross / sine);
  constexpr double kSteepest = 10.0;  // where the shortest way jumps from one side to the other
  const double k = sine < angle / kSteepest ? kSteepest : angle / sine;
  *r = angle * n;
  *J = n * n.transpose() + k * a.cross(n) * m.cross(n).transpose();
}

// Rows of the rotation, in F, and their derivative by the angular velocity of M against F.
void RotationRows(const Joint& joint, const Mat3& R_FM, VecX* r, MatX* J) {
  switch (joint.kind) {
    case JointKind::kSpherical:
    case JointKind::kPointOnLine:
    case JointKind::kPointOnPlane:
    case JointKind::kFree:
      r->resize(0);
      J->resize(0, 3);
      return;
    case JointKind::kFixed:
    case JointKind::kPrismatic: {
      const Vec3 log = LogRotation(R_FM);
      *r = log;
      *J = LogDerivative(log);
      return;
    }
    case JointKind::kRevolute:
    case JointKind::kCylindrical:
    case JointKind::kPlanar: {
      Vec3 v;
      Mat3 D;
      Alignment(joint.axis, R_FM * joint.axis, &v, &D);
      *r = v;
      *J = D;
      return;
    }
    case JointKind::kUniversal: {
      const Vec3 m = R_FM * joint.axis2;
      const Vec3 cross = joint.axis.cross(m);
      const double sine = cross.norm();
      const Vec3 n = sine < 1e-12 ? Vec3(joint.axis.unitOrthogonal()) : Vec3(cross / sine);
      r->resize(1);
      (*r)[0] = std::atan2(sine, joint.axis.dot(m)) -
                std::atan2(joint.axis.cross(joint.axis2).norm(), joint.axis.dot(joint.axis2));
      *J = n.transpose();
      return;
    }
  }
}

}  // namespace

ClosureGap AssemblyResidual(const Joint& joint, const ClosureFrames& frames, double length) {
  BodyStates states;
  states.Resize(2);
  states.X_WB = {frames.X_WP, frames.X_WC};
  Joint alone = joint;
  alone.parent = 0;
  alone.child = 1;
  const ConstraintRows rows = RowsOf(alone, states, false);
  const int n = rows.translation_rows;

  const Mat3 R_WF = frames.X_WP.linear() * joint.X_PF.linear();
  VecX r;
  MatX D;
  RotationRows(joint, R_WF.transpose() * frames.X_WC.linear() * joint.X_CM.linear(), &r, &D);
  ClosureGap gap;
  gap.residual.resize(n + r.size());
  gap.residual << rows.residual.head(n) / length, r;
  gap.J_parent = gap.J_child = MatX::Zero(n + r.size(), 6);
  gap.J_parent.topRows(n) = rows.J_parent.topRows(n) / length;
  gap.J_child.topRows(n) = rows.J_child.topRows(n) / length;
  if (r.size() == 0) return gap;
  gap.J_child.bottomLeftCorner(r.size(), 3) = D * R_WF.transpose();
  gap.J_parent.bottomLeftCorner(r.size(), 3) = -D * R_WF.transpose();
  return gap;
}

}  // namespace mbv::internal

namespace mbv {

std::string AssemblyText(const Mechanism& mechanism, const GroupAssemblies& found) {
  constexpr size_t kMostJoints = 4, kMostWays = 4;
  // The joints in which the ways differ most, or which moved most.
  std::vector<std::pair<double, size_t>> moved;
  for (size_t k = 0; k < found.group.joints.size(); ++k) {
    const Joint& joint = mechanism.joints[found.group.joints[k]];
    if (DofsOf(joint.kind) == 0) continue;
    double most = std::abs(found.assemblies.front().q[k][0] - joint.guess[0]);
    for (const Assembly& way : found.assemblies) {
      most = std::max(most, std::abs(way.q[k][0] - found.assemblies.front().q[k][0]));
    }
    moved.emplace_back(-most, k);
  }
  std::stable_sort(moved.begin(), moved.end());
  moved.resize(std::min(moved.size(), kMostJoints));
  const auto angles = [&](const Assembly& way) {
    std::string text;
    for (const auto& [change, k] : moved) {
      const Joint& joint = mechanism.joints[found.group.joints[k]];
      std::string values;
      for (int c = 0; c < DofsOf(joint.kind); ++c) {
        values += fmt::format("{}{:.4g}", c == 0 ? "" : " ", way.q[k][c]);
      }
      text += fmt::format("{}{} = {}", text.empty() ? "" : ", ", joint.name, values);
    }
    return text;
  };
  std::string text;
  for (size_t i = 0; i < std::min<size_t>(found.group.closures.size(), 3); ++i) {
    text += (i == 0 ? "" : ", ") + mechanism.joints[found.group.closures[i]].name;
  }
  if (found.group.closures.size() > 3) text += ", …";
  text += fmt::format(
      ": {} found, taken is {}",
      found.assemblies.size() == 1 ? "1 way to close"
                                   : fmt::format("{} ways to close", found.assemblies.size()),
      (found.assemblies.size() == 1 ? "" : "1: ") + angles(found.assemblies.front()));
  for (size_t i = 1; i < std::min(found.assemblies.size(), kMostWays); ++i) {
    text +=
        fmt::format("{}{}: {}", i == 1 ? "; others: " : " / ", i + 1, angles(found.assemblies[i]));
  }
  if (found.assemblies.size() > kMostWays) text += " / …";
  return text;
}

}  // namespace mbv
