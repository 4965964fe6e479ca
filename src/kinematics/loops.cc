#include "kinematics/loops.h"

#include "core/spatial.h"
#include "kinematics/constraints.h"
#include "kinematics/row_stack.h"
#include "mechanism/reach.h"
#include "mechanism/spanning_tree.h"

namespace mbv {
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
      loop.joint_freedoms += FreedomsOf(joint.kind);
      const MatX more = ScrewsOf(joint, states, length);
      screws.conservativeResize(6, screws.cols() + more.cols());
      screws.rightCols(more.cols()) = more;
    }
    loop.screw_rank = internal::RankOf(screws);
    loops.push_back(loop);
  }
  return loops;
}

}  // namespace mbv
