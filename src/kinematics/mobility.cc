// Rank analysis of the scaled constraint Jacobian.
#include "kinematics/mobility.h"

#include <algorithm>
#include <set>

#include "core/channel.h"
#include "core/demand.h"
#include "core/text.h"
#include "kinematics/row_stack.h"
#include "mechanism/idle_spins.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::FindRank;
using internal::kStressTolerance;
using internal::NullSpaces;
using internal::RankFinding;
using internal::RankOf;
using internal::RowStack;

bool ActsOn(const MatX& self_stress, int first_row, int rows) {
  return rows > 0 && self_stress.cols() > 0 &&
         self_stress.middleRows(first_row, rows).cwiseAbs().maxCoeff() > kStressTolerance;
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
    const bool open = most[static_cast<Eigen::Index>(c)] > kStressTolerance;
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
    if (!ActsOn(self_stress, first_row[j], first_row[j + 1] - first_row[j])) continue;
    mobility->joints_not_unique.push_back(mechanism.joints[j].name);
    mobility->reactions_not_unique.push_back(OpenComponents(
        mechanism.joints[j], reactions.rows[j], states, length, self_stress, first_row[j]));
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (ActsOn(self_stress, reactions.first_drive + static_cast<int>(d), 1)) {
      mobility->drives_not_unique.push_back(mechanism.drives[d].name);
    }
  }
  mobility->drive_forces_unique = mobility->drives_not_unique.empty();
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
  mobility.freedoms = mobility.body_coordinates - joints.rank - idle;
  mobility.redundant = stack.size() - joints.rank;
  mobility.kutzbach = mobility.body_coordinates - stack.size() - idle;
  mobility.smallest_kept = joints.smallest_kept;
  mobility.largest_dropped = joints.largest_dropped;

  stack.AddIdle(mechanism, states);
  stack.AddDriven(mechanism, states);
  mobility.undriven = mobility.body_coordinates - RankOf(stack.Matrix());
  mobility.drives_determine_motion = mobility.undriven == 0;
  FindForcesNotUnique(mechanism, states, length, &mobility);
  return mobility;
}

int CountFreedoms(const Mechanism& mechanism) {
  return CountAllFreedoms(mechanism) - static_cast<int>(IdleSpins(mechanism).size());
}

int CountAllFreedoms(const Mechanism& mechanism) {
  const BodyStates states = PosesAtHome(mechanism);
  RowStack stack(mechanism.bodies.size(), CharacteristicLength(mechanism));
  stack.AddJoints(mechanism, states, false);
  return 6 * (static_cast<int>(mechanism.bodies.size()) - 1) - RankOf(stack.Matrix());
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

}  // namespace mbv
