// Rank analysis of the scaled constraint Jacobian.
#include "mechanism/mobility.h"

#include "core/demand.h"
#include "mechanism/row_stack.h"

namespace mbv {
namespace {

using internal::FindRank;
using internal::kStressTolerance;
using internal::NullSpaces;
using internal::RankFinding;
using internal::RowStack;

bool ActsOn(const MatX& self_stress, int first_row, int rows) {
  return rows > 0 && self_stress.cols() > 0 &&
         self_stress.middleRows(first_row, rows).cwiseAbs().maxCoeff() > kStressTolerance;
}

// Which forces a self-stress of the locked mechanism can change, isostatic rule applied.
void FindForcesNotUnique(const Mechanism& mechanism, const BodyStates& states, double length,
                         Mobility* mobility) {
  RowStack stack(mechanism.bodies.size(), length);
  std::vector<int> first_row;
  for (const Joint& joint : mechanism.joints) {
    first_row.push_back(stack.size());
    stack.Add(RowsOf(joint, states, true));
  }
  first_row.push_back(stack.size());
  mobility->isostatic_rule_sound =
      FindRank(stack.Matrix(), NullSpaces::kNone).rank == mobility->constraint_rank;

  stack.AddDriven(mechanism, states);
  const MatX self_stress = FindRank(stack.Matrix(), NullSpaces::kSelfStress).self_stress;
  for (size_t j = 0; j < mechanism.joints.size(); ++j) {
    if (ActsOn(self_stress, first_row[j], first_row[j + 1] - first_row[j])) {
      mobility->joints_not_unique.push_back(mechanism.joints[j].name);
    }
  }
  for (size_t d = 0; d < mechanism.drives.size(); ++d) {
    if (ActsOn(self_stress, first_row.back() + static_cast<int>(d), 1)) {
      mobility->drives_not_unique.push_back(mechanism.drives[d].name);
    }
  }
  mobility->drive_forces_unique = mobility->drives_not_unique.empty();
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
  mobility.freedoms = mobility.body_coordinates - joints.rank;
  mobility.redundant = stack.size() - joints.rank;
  mobility.kutzbach = mobility.body_coordinates - stack.size();
  mobility.smallest_kept = joints.smallest_kept;
  mobility.largest_dropped = joints.largest_dropped;

  stack.AddDriven(mechanism, states);
  mobility.undriven = mobility.body_coordinates - FindRank(stack.Matrix(), NullSpaces::kNone).rank;
  mobility.drives_determine_motion = mobility.undriven == 0;
  FindForcesNotUnique(mechanism, states, length, &mobility);
  return mobility;
}

Mobility AnalyseMobility(const Mechanism& mechanism) {
  MBV_DEMAND(mechanism.X_WB_home.size() == mechanism.bodies.size(), mechanism.name);
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  return AnalyseMobility(mechanism, states);
}

}  // namespace mbv
