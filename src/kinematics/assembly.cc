#include "kinematics/assembly.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "core/spatial.h"
#include "kinematics/assembly_residual.h"
#include "kinematics/damped_search.h"
#include "kinematics/home.h"
#include "kinematics/tree_motion.h"
#include "mechanism/joint_pose.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv {
namespace {

using internal::TreeMotion;

// A group as a mechanism of its own, its innermost body as the world.
struct PartOfTree {
  Mechanism mechanism;
  double length = 1.0;
};

PartOfTree Extract(const Mechanism& whole, const LoopGroup& group) {
  PartOfTree part;
  Mechanism& m = part.mechanism;
  std::map<int, int> index;  // of bodies
  const auto add = [&](int body) {
    if (!index.emplace(body, static_cast<int>(m.bodies.size())).second) return;
    m.bodies.push_back(whole.bodies[body]);
  };
  std::vector<bool> reversed;
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
  part.length = CharacteristicLength(m);
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
    unit_.resize(tree_.freedoms());
    for (int c = 0; c < tree_.freedoms(); ++c) unit_[c] = tree_.angular()[c] ? 1.0 : length_;
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
    int stalled = 0;
    const auto enough = [&](const internal::DampedStepMade& step) {
      constexpr double kStalls = 1e-4;  // share of the residual that a step must win
      const double now = step.r.norm();
      if (step.better) stalled = now > (1.0 - kStalls) * step.before ? stalled + 1 : 0;
      return now < kDone || stalled > 12;
    };
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
    J->resize(rows, tree_.freedoms());
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
      for (int c = 0; c < FreedomsOf(joint.kind); ++c) {
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

GroupAssemblies FindAssemblies(const Mechanism& mechanism, const LoopGroup& group,
                               const std::vector<bool>& driven, const JointCoordinates& guess) {
  if (group.joints.empty()) return {.group = group, .assemblies = {}, .best = {}};
  return AssemblySearch(mechanism, group, driven, guess).Run();
}

}  // namespace mbv
