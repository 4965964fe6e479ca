// Rank analysis of the scaled constraint Jacobian.

#include "kinematics/mobility.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <random>
#include <set>

#include "base/demand.h"
#include "base/text.h"
#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "kinematics/row_stack.h"
#include "math/spatial.h"
#include "math/trace.h"
#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv {
namespace {

using internal::FindRank;
using internal::kReactionTolerance;
using internal::kStressTolerance;
using internal::NullSpaces;
using internal::RankFinding;
using internal::RankOf;
using internal::RowStack;

bool ActsOn(const MatX& self_stress, int first_row, int rows, double tolerance) {
  return rows > 0 && self_stress.cols() > 0 &&
         self_stress.middleRows(first_row, rows).cwiseAbs().maxCoeff() > tolerance;
}

// The rows that transmit reactions (isostatic rule applied), then those of everything driven.
struct ReactionStack {
  RowStack stack;
  std::vector<ConstraintRows> rows;  // per joint
  std::vector<int> first_row;        // per joint, then behind the last one
  int first_drive = 0;

  ReactionStack(const Mechanism& mechanism, const BodyStates& states, double length)
      : stack(mechanism.bodies.size(), length) {
    for (const Joint& joint : mechanism.joints) {
      first_row.push_back(stack.size());
      rows.push_back(RowsOf(joint, states, true));
      stack.Add(rows.back());
    }
    first_row.push_back(stack.size());
    for (const CouplingRow& row : CouplingRows(mechanism, states)) stack.Add(row);
    first_drive = stack.size();
  }
};

// The components of a joint's reaction that self-stresses can change. A row that is scaled by s
// acts with s times its Jacobian.
UndeterminedReaction OpenComponents(const Joint& joint, const ConstraintRows& rows,
                                    const BodyStates& states, double length,
                                    const MatX& self_stress, int first_row) {
  const Mat3 R_FW = (states.X_WB[joint.parent].linear() * joint.X_PF.linear()).transpose();
  const Vec3 r_M = states.X_WB[joint.child].linear() * joint.X_CM.translation();
  Vec6 most = Vec6::Zero();  // [f; m / L]
  for (Eigen::Index k = 0; k < self_stress.cols(); ++k) {
    Vec6 F = Vec6::Zero();  // [m about Co; f] on the child
    for (int i = 0; i < rows.rows; ++i) {
      const double scale = i < rows.translation_rows ? 1.0 : length;
      F += self_stress(first_row + i, k) * scale * rows.J_child.row(i).transpose();
    }
    const Vec3 f = R_FW * F.tail<3>();
    const Vec3 m = R_FW * (F.head<3>() - r_M.cross(F.tail<3>()));
    most.head<3>() = most.head<3>().cwiseMax(f.cwiseAbs());
    most.tail<3>() = most.tail<3>().cwiseMax(m.cwiseAbs() / length);
  }
  UndeterminedReaction reaction{joint.name, {}};
  for (size_t c = 0; c < kReactionComponents.size(); ++c) {
    const bool open = most[static_cast<Eigen::Index>(c)] > kReactionTolerance;
    if (open) reaction.components.emplace_back(kReactionComponents[c]);
  }
  return reaction;
}

// Which forces a self-stress of the locked mechanism can change.
void FindForcesNotUnique(const Mechanism& mechanism, const BodyStates& states, double length,
                         Mobility* mobility) {
  ReactionStack reactions(mechanism, states, length);
  mobility->isostatic_rule_sound = RankOf(reactions.stack.Matrix()) == mobility->constraint_rank;
  reactions.stack.AddDriven(mechanism, states);
  const MatX self_stress = FindRank(reactions.stack.Matrix(), NullSpaces::kSelfStress).self_stress;
  const std::vector<int>& first_row = reactions.first_row;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (!ActsOn(self_stress, first_row[j], first_row[j + 1] - first_row[j], kReactionTolerance)) {
      continue;
    }
    mobility->joints_not_unique.push_back(mechanism.joints[j].name);
    mobility->reactions_not_unique.push_back(OpenComponents(
        mechanism.joints[j], reactions.rows[j], states, length, self_stress, first_row[j]));
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (ActsOn(self_stress, reactions.first_drive + static_cast<int>(d), 1, kStressTolerance)) {
      mobility->drives_not_unique.push_back(mechanism.drives[d].name);
    }
  }
}

BodyStates PosesAtHome(const Mechanism& mechanism) {
  MBV_DEMAND(mechanism.X_WB_home.size() == mechanism.bodies.size(), mechanism.name);
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  return states;
}

}  // namespace

Mobility AnalyseMobility(const Mechanism& mechanism, const BodyStates& states) {
  MBV_DEMAND(states.X_WB.size() == mechanism.bodies.size(), mechanism.name);
  const double length = CharacteristicLength(mechanism);
  Mobility mobility;
  mobility.body_coordinates = 6 * (static_cast<int>(mechanism.bodies.size()) - 1);
  mobility.drives = static_cast<int>(mechanism.drives.size());
  mobility.prescribed = static_cast<int>(mechanism.prescribed.size());

  RowStack stack(mechanism.bodies.size(), length);
  stack.AddJoints(mechanism, states, false);
  const RankFinding joints = FindRank(stack.Matrix(), NullSpaces::kNone);
  mobility.constraint_rows = stack.size();
  mobility.constraint_rank = joints.rank;
  for (const Spin& spin : IdleSpins(mechanism)) mobility.idle_spins.push_back(spin.name);
  const int idle = static_cast<int>(mobility.idle_spins.size());
  mobility.dofs = mobility.body_coordinates - joints.rank - idle;
  mobility.redundant = stack.size() - joints.rank;
  mobility.kutzbach = mobility.body_coordinates - stack.size() - idle;
  mobility.smallest_kept = joints.smallest_kept;
  mobility.largest_dropped = joints.largest_dropped;

  stack.AddIdle(mechanism, states);
  stack.AddDriven(mechanism, states);
  mobility.undriven = mobility.body_coordinates - RankOf(stack.Matrix());
  FindForcesNotUnique(mechanism, states, length, &mobility);
  return mobility;
}

int CountDofs(const Mechanism& mechanism) {
  return CountAllDofs(mechanism) - static_cast<int>(IdleSpins(mechanism).size());
}

int CountAllDofs(const Mechanism& mechanism) {
  const BodyStates states = PosesAtHome(mechanism);
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  return 6 * (static_cast<int>(mechanism.bodies.size()) - 1) - RankOf(stack.Matrix());
}

IsostaticDofs CountIsostaticDofs(const Mechanism& mechanism) {
  const BodyStates states = PosesAtHome(mechanism);
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, true);
  const int reactions = stack.size();
  for (const Joint& joint : mechanism.joints) {
    if (!joint.transmits_force_only) continue;
    const ConstraintRows rows = RowsOf(joint, states, false);
    for (int i = rows.translation_rows; i < rows.rows; ++i) {
      stack.Add(rows.parent, rows.J_parent.row(i), rows.child, rows.J_child.row(i), false);
    }
  }
  const internal::NestedRanks ranks = internal::RanksInTree(stack, mechanism, states, reactions);
  const int columns = 6 * (static_cast<int>(mechanism.bodies.size()) - 1);
  return {.dofs = columns - ranks.all, .as_balls = columns - ranks.first};
}

Mobility AnalyseMobility(const Mechanism& mechanism) {
  return AnalyseMobility(mechanism, PosesAtHome(mechanism));
}

std::vector<std::string> ReactionsNotUnique(const Mechanism& mechanism,
                                            const std::vector<std::vector<Pose>>& X_WB) {
  constexpr size_t kPoses = 5;
  std::set<std::string> open;
  const auto add = [&](const Mobility& mobility) {
    for (const UndeterminedReaction& reaction : mobility.reactions_not_unique) {
      for (int c = 0; c < 6; ++c) {
        if (!Contains(reaction.components, kReactionComponents[static_cast<size_t>(c)])) continue;
        open.insert(ChannelName(Quantity::kReaction, reaction.joint, c));
      }
    }
  };
  add(AnalyseMobility(mechanism));
  const size_t count = open.empty() ? 0 : std::min(kPoses, X_WB.size());
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  for (size_t k = 0; k < count; ++k) {
    states.X_WB = X_WB[(2 * k + 1) * X_WB.size() / (2 * count)];
    const auto finite = [](const Pose& X) { return X.matrix().allFinite(); };
    if (states.X_WB.size() != mechanism.bodies.size() ||
        !std::all_of(states.X_WB.begin(), states.X_WB.end(), finite)) {
      continue;  // the simulation broke down before
    }
    add(AnalyseMobility(mechanism, states));
  }
  return {open.begin(), open.end()};
}

namespace {

using internal::FindRank;
using internal::kStressTolerance;
using internal::NullSpaces;
using internal::RowStack;

BodyStates StatesOfPoses(const std::vector<Pose>& X_WB) {
  BodyStates states;
  states.Resize(X_WB.size());
  states.X_WB = X_WB;
  return states;
}

// Rows of the stack by owner: joints and couplings first, then (with drives) drives and prescribed
// joints.
struct Owner {
  enum class Kind { kJoint, kCoupling, kDrive, kPrescribed } kind;
  int index = 0;
  int first_row = 0, rows = 0;
};

struct Stresses {
  std::vector<Owner> owners;
  MatX self_stress;
};

Stresses FindStresses(const Mechanism& mechanism, const BodyStates& states, bool with_drives) {
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  Stresses out;
  int row = 0;
  const auto own = [&](Owner::Kind kind, size_t index, int rows) {
    out.owners.push_back({kind, static_cast<int>(index), row, rows});
    row += rows;
  };
  stack.AddJoints(mechanism, states, with_drives);
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    own(Owner::Kind::kJoint, j, RowsOf(mechanism.joints[j], states, with_drives).rows);
  }
  for (size_t c = 0; c < mechanism.couplings.size(); ++c) own(Owner::Kind::kCoupling, c, 1);
  if (with_drives) {
    stack.AddDriven(mechanism, states);
    for (size_t d = 0; d < mechanism.drives.size(); ++d) own(Owner::Kind::kDrive, d, 1);
    for (size_t p = 0; p < mechanism.prescribed.size(); ++p) own(Owner::Kind::kPrescribed, p, 1);
  }
  out.self_stress = FindRank(stack.Matrix(), NullSpaces::kSelfStress).self_stress;
  return out;
}

// The projector on the self-stresses has no entries between parts that do not share one, whatever
// the basis; its trace over a part counts that part's self-stresses.
std::vector<StressGroup> GroupsOf(const Mechanism& mechanism, const Stresses& stresses) {
  if (stresses.self_stress.cols() == 0) return {};
  const MatX basis = internal::Orthonormal(stresses.self_stress);
  const MatX P = basis * basis.transpose();
  const std::vector<Owner>& owners = stresses.owners;
  std::vector<size_t> group(owners.size());
  std::iota(group.begin(), group.end(), size_t{0});
  for (size_t a = 0; a < owners.size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      const auto block =
          P.block(owners[a].first_row, owners[b].first_row, owners[a].rows, owners[b].rows);
      if (block.size() == 0 || block.cwiseAbs().maxCoeff() <= kStressTolerance) continue;
      const size_t from = group[a], to = group[b];
      std::replace(group.begin(), group.end(), from, to);
    }
  }
  std::vector<StressGroup> groups;
  for (size_t g = 0; g < owners.size(); ++g) {
    StressGroup part;
    double trace = 0.0;
    for (size_t a = 0; a < owners.size(); ++a) {
      if (group[a] != g) continue;
      const double share =
          P.diagonal().segment(owners[a].first_row, owners[a].rows).cwiseAbs().sum();
      if (share <= kStressTolerance) continue;
      trace += share;
      switch (owners[a].kind) {
        case Owner::Kind::kJoint:
          part.joints.push_back(mechanism.joints[owners[a].index].name);
          break;
        case Owner::Kind::kCoupling:
          part.couplings.push_back(mechanism.couplings[owners[a].index].name);
          break;
        case Owner::Kind::kDrive:
          part.drives.push_back(mechanism.drives[owners[a].index].name);
          break;
        case Owner::Kind::kPrescribed:
          part.prescribed.push_back(mechanism.prescribed[owners[a].index].name);
          break;
      }
    }
    part.count = static_cast<int>(std::lround(trace));
    if (part.count > 0) groups.push_back(part);
  }
  return groups;
}

std::vector<std::string> FreeBodies(const Mechanism& mechanism, const BodyStates& states) {
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  stack.AddIdle(mechanism, states);
  stack.AddDriven(mechanism, states);
  const MatX motion = FindRank(stack.Matrix(), NullSpaces::kMotion).motion;
  std::vector<std::string> names;
  for (size_t b = 1; b < mechanism.bodies.size() && motion.cols() > 0; ++b) {
    const auto twist = motion.middleRows<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    if (twist.cwiseAbs().maxCoeff() > kStressTolerance) names.push_back(mechanism.bodies[b].name);
  }
  return names;
}

// A pose that closes the loops, a random step along the DOFs away from home.
std::optional<BodyStates> RandomPose(const Mechanism& mechanism, double step,
                                     std::mt19937_64* random) {
  const double length = CharacteristicLength(mechanism);
  const BodyStates home = StatesOfPoses(mechanism.X_WB_home);
  RowStack stack(mechanism.bodies.size(), length);
  stack.AddJoints(mechanism, home, false);
  const MatX motion = FindRank(stack.Matrix(), NullSpaces::kMotion).motion;
  if (motion.cols() == 0) return std::nullopt;
  std::normal_distribution<double> normal;
  VecX direction(motion.cols());
  for (int i = 0; i < direction.size(); ++i) direction[i] = normal(*random);
  VecX dx = motion * direction;
  dx *= step / dx.cwiseAbs().maxCoeff();

  std::vector<Pose> X_WB = mechanism.X_WB_home;
  for (size_t b = 1; b < X_WB.size(); ++b) {
    const Vec6 twist = dx.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
    X_WB[b].linear() = ExpRotation(twist.head<3>()) * X_WB[b].linear();
    X_WB[b].translation() += length * twist.tail<3>();
  }
  Mechanism moved = mechanism;
  std::vector<std::array<double, 6>> near;
  for (const Joint& joint : mechanism.joints) near.push_back(joint.home);
  const auto guess = JointCoordinatesAt(mechanism, X_WB, near);
  for (size_t j = 0; j < guess.size(); ++j) moved.joints[j].guess = guess[j];
  if (!SolveHome(&moved).closed) return std::nullopt;
  return StatesOfPoses(moved.X_WB_home);
}

int Least(const MobilityReport& report, int Mobility::*count) {
  int least = report.home.*count;
  for (const Mobility& mobility : report.nearby) least = std::min(least, mobility.*count);
  return least;
}

}  // namespace

int MobilityReport::dofs() const { return Least(*this, &Mobility::dofs); }
int MobilityReport::undriven() const { return Least(*this, &Mobility::undriven); }
int MobilityReport::redundant_count() const { return Least(*this, &Mobility::redundant); }

MobilityReport ReportMobility(const Mechanism& mechanism, int poses) {
  MobilityReport report;
  report.home = AnalyseMobility(mechanism);
  const BodyStates home = StatesOfPoses(mechanism.X_WB_home);

  // Small enough to stay in reach, large against the tolerance of a rank.
  report.nearby_step = 0.02;
  std::mt19937_64 random(20260801);
  for (int i = 0; i < poses; ++i) {
    if (const auto states = RandomPose(mechanism, report.nearby_step, &random)) {
      report.nearby.push_back(AnalyseMobility(mechanism, *states));
    }
  }

  report.loops = CountLoops(mechanism);
  report.redundant = GroupsOf(mechanism, FindStresses(mechanism, home, false));
  report.undetermined = GroupsOf(mechanism, FindStresses(mechanism, home, true));
  for (const Spin& spin : FindSpins(mechanism)) {
    if (!spin.why_not.empty()) report.spins_not_idle.push_back(spin.name + ": " + spin.why_not);
  }
  if (report.home.undriven > 0) report.free_bodies = FreeBodies(mechanism, home);
  return report;
}

namespace {

// Tree joints from the world to a body, outermost first.
std::vector<int> PathToWorld(const Mechanism& mechanism, int body) {
  std::vector<int> path;
  while (body != 0) {
    for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
      if (OutboardBody(mechanism, t) != body) continue;
      path.push_back(mechanism.tree_joints[t]);
      body = InboardBody(mechanism, t);
      break;
    }
  }
  return path;
}

// Around the loop: from the closure's parent inwards, then outwards to its child, then the closure.
std::vector<int> JointsAround(const Mechanism& mechanism, int closure) {
  std::vector<int> inward = PathToWorld(mechanism, mechanism.joints[closure].parent);
  std::vector<int> outward = PathToWorld(mechanism, mechanism.joints[closure].child);
  while (!inward.empty() && !outward.empty() && inward.back() == outward.back()) {
    inward.pop_back();
    outward.pop_back();
  }
  inward.insert(inward.end(), outward.rbegin(), outward.rend());
  inward.push_back(closure);
  return inward;
}

// Twists [ω; v/L at the world's origin] that a joint allows its child against its parent.
MatX ScrewsOf(const Joint& joint, const BodyStates& states, double length) {
  const ConstraintRows rows = RowsOf(joint, states, false);
  MatX J = rows.J_child.topRows(rows.rows);  // v of the child's origin p is v − p × ω
  J.leftCols<3>() -= J.rightCols<3>() * Skew(states.X_WB[joint.child].translation());
  J.rightCols<3>() *= length;
  for (int i = 0; i < rows.translation_rows; ++i) J.row(i) /= length;
  return internal::FindRank(J, internal::NullSpaces::kMotion).motion;
}

}  // namespace

std::vector<LoopCount> CountLoops(const Mechanism& mechanism) {
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  const double length = CharacteristicLength(mechanism);
  std::vector<LoopCount> loops;
  for (size_t c = 0; c < mechanism.joints.size(); ++c) {
    if (!mechanism.joints[c].closure) continue;
    LoopCount loop{.closure = mechanism.joints[c].name, .joints = {}};
    MatX screws(6, 0);
    for (const int j : JointsAround(mechanism, static_cast<int>(c))) {
      const Joint& joint = mechanism.joints[j];
      loop.joints.push_back(joint.name);
      loop.joint_dofs += DofsOf(joint.kind);
      const MatX more = ScrewsOf(joint, states, length);
      screws.conservativeResize(6, screws.cols() + more.cols());
      screws.rightCols(more.cols()) = more;
    }
    loop.screw_rank = internal::RankOf(screws);
    loops.push_back(loop);
  }
  return loops;
}

std::vector<LoopGroup> LoopGroups(const Mechanism& mechanism) {
  const size_t n = mechanism.joints.size();
  // Tree joint that carries each body.
  std::vector<int> carrier(mechanism.bodies.size(), -1), inboard(mechanism.bodies.size(), 0);
  std::vector<int> depth(mechanism.bodies.size(), 0);
  for (size_t t = 0; t < mechanism.tree_joints.size(); ++t) {
    const int out = OutboardBody(mechanism, t), in = InboardBody(mechanism, t);
    carrier[out] = mechanism.tree_joints[t];
    inboard[out] = in;
    depth[out] = depth[in] + 1;
  }
  // Union-find over tree joints and closures.
  std::vector<size_t> root(n);
  std::iota(root.begin(), root.end(), size_t{0});
  const auto find = [&](size_t j) {
    while (root[j] != j) j = root[j] = root[root[j]];
    return j;
  };
  std::vector<bool> in_loop(n, false);
  for (size_t c = 0; c < n; ++c) {
    if (!mechanism.joints[c].closure) continue;
    in_loop[c] = true;
    int a = mechanism.joints[c].parent, b = mechanism.joints[c].child;
    while (a != b) {
      int& deeper = depth[a] >= depth[b] ? a : b;
      const auto j = static_cast<size_t>(carrier[deeper]);
      in_loop[j] = true;
      root[find(j)] = find(c);
      deeper = inboard[deeper];
    }
  }
  std::vector<LoopGroup> groups;
  std::map<size_t, size_t> group_of;
  for (size_t c = 0; c < n; ++c) {
    if (!mechanism.joints[c].closure) continue;
    const auto [at, fresh] = group_of.emplace(find(c), groups.size());
    if (fresh) groups.emplace_back();
    groups[at->second].closures.push_back(static_cast<int>(c));
  }
  for (const int j : mechanism.tree_joints) {
    if (in_loop[j]) groups[group_of.at(find(static_cast<size_t>(j)))].joints.push_back(j);
  }
  return groups;
}

}  // namespace mbv
