// Rank analysis of the constraint Jacobian, scaled so that its entries are pure numbers: lengths
// are measured in characteristic lengths, so a translation row is r/L with ṙ/L = J_ω ω/L + J_v v/L.
#include "mechanism/mobility.h"

#include <Eigen/SVD>
#include <algorithm>

#include "core/demand.h"
#include "mechanism/frame_pair.h"

namespace mbv {
namespace {

// A singular value below this times the largest counts as zero. Home poses close to 1e-12.
constexpr double kRankTolerance = 1e-9;
// A self-stress with a smaller share than this in a row does not act there.
constexpr double kStressTolerance = 1e-7;

// Scaled rows over the moving bodies.
class RowStack {
 public:
  RowStack(size_t bodies, double length)
      : columns_(6 * (static_cast<Eigen::Index>(bodies) - 1)), length_(length) {}

  void Add(int parent, const Vec6& J_parent, int child, const Vec6& J_child, bool translation) {
    VecX row = VecX::Zero(columns_);
    const double scale = translation ? 1.0 / length_ : 1.0;
    const auto put = [&](int body, const Vec6& J) {
      if (body == 0) return;
      row.segment<3>(6 * (body - 1)) += scale * J.head<3>();
      row.segment<3>(6 * (body - 1) + 3) += scale * length_ * J.tail<3>();
    };
    put(parent, J_parent);
    put(child, J_child);
    rows_.push_back(row);
  }
  void Add(const ConstraintRows& rows) {
    for (int i = 0; i < rows.rows; ++i) {
      Add(rows.parent, rows.J_parent.row(i), rows.child, rows.J_child.row(i),
          i < rows.translation_rows);
    }
  }
  void Add(const ScalarRow& row, bool translation) {
    Add(row.parent, row.J_parent, row.child, row.J_child, translation);
  }
  [[nodiscard]] int size() const { return static_cast<int>(rows_.size()); }
  [[nodiscard]] MatX Matrix() const {
    MatX J(size(), columns_);
    for (int i = 0; i < size(); ++i) J.row(i) = rows_[i].transpose();
    return J;
  }

 private:
  Eigen::Index columns_;
  double length_;
  std::vector<VecX> rows_;
};

struct RankFinding {
  int rank = 0;
  double smallest_kept = 0.0, largest_dropped = 0.0;
  MatX self_stress;  ///< rows × (rows − rank): null space of the transpose
};

RankFinding FindRank(const MatX& J, bool with_self_stress) {
  RankFinding out;
  if (J.rows() == 0 || J.cols() == 0) {
    if (with_self_stress) out.self_stress = MatX::Identity(J.rows(), J.rows());
    return out;
  }
  const Eigen::BDCSVD<MatX> svd(J, with_self_stress ? Eigen::ComputeFullU : 0);
  const VecX& s = svd.singularValues();
  while (out.rank < s.size() && s[out.rank] > kRankTolerance * s[0]) ++out.rank;
  if (out.rank > 0) out.smallest_kept = s[out.rank - 1];
  if (out.rank < s.size()) out.largest_dropped = s[out.rank];
  if (with_self_stress) out.self_stress = svd.matrixU().rightCols(J.rows() - out.rank);
  return out;
}

bool ActsOn(const MatX& self_stress, int first_row, int rows) {
  return rows > 0 && self_stress.cols() > 0 &&
         self_stress.middleRows(first_row, rows).cwiseAbs().maxCoeff() > kStressTolerance;
}

void AddDriven(const Mechanism& mechanism, const BodyStates& states, RowStack* stack) {
  for (const Drive& drive : mechanism.drives) {
    stack->Add(DriveRow(mechanism, drive, states), PositionUnit(mechanism, drive) == "m");
  }
  for (const Prescribed& prescribed : mechanism.prescribed) {
    const Joint& joint = mechanism.joints[prescribed.joint];
    stack->Add(JointCoordinateRow(joint, 0, states), !internal::IsAngle(joint.kind, 0));
  }
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
      FindRank(stack.Matrix(), false).rank == mobility->constraint_rank;

  AddDriven(mechanism, states, &stack);
  const MatX self_stress = FindRank(stack.Matrix(), true).self_stress;
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
  for (const Joint& joint : mechanism.joints) stack.Add(RowsOf(joint, states, false));
  const RankFinding joints = FindRank(stack.Matrix(), false);
  mobility.constraint_rows = stack.size();
  mobility.constraint_rank = joints.rank;
  mobility.freedoms = mobility.body_coordinates - joints.rank;
  mobility.redundant = stack.size() - joints.rank;
  mobility.kutzbach = mobility.body_coordinates - stack.size();
  mobility.smallest_kept = joints.smallest_kept;
  mobility.largest_dropped = joints.largest_dropped;

  AddDriven(mechanism, states, &stack);
  mobility.undriven = mobility.body_coordinates - FindRank(stack.Matrix(), false).rank;
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
