// Constraint rows of a whole mechanism as one scaled matrix, and its rank. Internal to kinematics/.
//
// Scaled so that the entries are pure numbers: lengths are measured in characteristic lengths L, so
// a translation row is r/L with ṙ/L = J_ω ω/L + J_v v/L.
#pragma once

#include <Eigen/SparseCore>
#include <optional>
#include <utility>
#include <vector>

#include "kinematics/constraints.h"

namespace mbv::internal {

/// A singular value below this times the largest counts as zero. Home poses close to 1e-12.
inline constexpr double kRankTolerance = 1e-9;
/// A self-stress with a smaller share than this in a row does not act there. An order below what
/// reactions that statics determines may differ by.
inline constexpr double kStressTolerance = 1e-8;
/// The same of a component of a reaction, which is compared on its own scale: a thousandth of all.
/// Frames that fit but for their eighth digit let a self-stress reach it by as much.
inline constexpr double kReactionTolerance = 1e-10;

using SparseRows = Eigen::SparseMatrix<double, Eigen::RowMajor>;

/// Matrices with fewer rows or columns are dense.
inline constexpr Eigen::Index kLargestDense = 300;
/// More self-stresses of a large part are left as sparse as they are found.
inline constexpr Eigen::Index kMostOrthogonal = 100;

/// Scaled rows over the moving bodies.
class RowStack {
 public:
  RowStack(size_t bodies, double length)
      : columns_(6 * (static_cast<Eigen::Index>(bodies) - 1)), length_(length) {}

  void Add(int parent, const Vec6& J_parent, int child, const Vec6& J_child, bool translation);
  void Add(const ConstraintRows& rows);
  void Add(const ScalarRow& row, bool translation) {
    Add(row.parent, row.J_parent, row.child, row.J_child, translation);
  }
  void Add(const CouplingRow& row);
  /// One row, the sum of all.
  void AddSum(const std::vector<ScalarRow>& pieces, bool translation);
  /// The true rows of all joints, then of all couplings; with `reactions`, the isostatic rule is
  /// applied.
  void AddJoints(const Mechanism& mechanism, const BodyStates& states, bool reactions);
  /// n·ω of every idle spin: held, as the commands need not do it.
  void AddIdle(const Mechanism& mechanism, const BodyStates& states);
  /// Every drive and prescribed joint, locked.
  void AddDriven(const Mechanism& mechanism, const BodyStates& states);

  [[nodiscard]] int size() const { return static_cast<int>(rows_.size()); }
  [[nodiscard]] double length() const { return length_; }
  /// Which rows are all those of a joint of the spanning tree.
  [[nodiscard]] const std::vector<int>& tree_rows() const { return tree_rows_; }
  /// Without the entries that are zero.
  [[nodiscard]] SparseRows Matrix() const;

 private:
  using Row = std::vector<std::pair<int, Vec6>>;  ///< per body that it touches
  void AddTo(Row* row, int body, const Vec6& J, double scale) const;

  Eigen::Index columns_;
  double length_;
  std::vector<Row> rows_;
  std::vector<int> tree_rows_;
};

struct RankFinding {
  int rank = 0;
  /// Singular values; of large parts an estimate and a bound.
  double smallest_kept = 0.0, largest_dropped = 0.0;
  /// Columns of unit length, orthogonal to each other but for many self-stresses of a large part.
  MatX self_stress;  ///< rows × (rows − rank): null space of the transpose
  MatX motion;       ///< columns × (columns − rank): null space
};
/// A basis of what the columns span.
[[nodiscard]] MatX Orthonormal(const MatX& vectors);
enum class NullSpaces { kNone, kSelfStress, kMotion };
/// By singular values, each part of J that shares no row and column with the others by itself;
/// parts with more than `dense` rows and columns by sparse QR, where that is clear.
[[nodiscard]] RankFinding FindRank(const SparseRows& J, NullSpaces wanted,
                                   double tolerance = kRankTolerance,
                                   Eigen::Index dense = kLargestDense);
[[nodiscard]] RankFinding FindRank(const MatX& J, NullSpaces wanted,
                                   double tolerance = kRankTolerance);
/// The same rank for an eighth of the time: by QR with column pivoting, whose diagonal shows it
/// where there is a clear gap; else by singular values.
[[nodiscard]] int RankOf(const SparseRows& J, double tolerance = kRankTolerance);
[[nodiscard]] int RankOf(const MatX& J, double tolerance = kRankTolerance);
/// Of the first rows of a matrix, and of all.
struct NestedRanks {
  int first = 0, all = 0;
};
/// Both for the time of one.
[[nodiscard]] NestedRanks RanksOf(const SparseRows& J, Eigen::Index first);
/// By QR alone; empty where a gap is not clear. What counts is compared with the largest row, or
/// with `largest`.
[[nodiscard]] std::optional<NestedRanks> ClearRanks(const SparseRows& J, Eigen::Index first,
                                                    double tolerance = kRankTolerance,
                                                    double largest = 0.0);
/// RanksOf() of rows at poses that the spanning tree's joints fit. In what these leave free the
/// other rows make a small matrix, whose rank counts beside theirs where it is clear.
[[nodiscard]] NestedRanks RanksInTree(const RowStack& rows, const Mechanism& mechanism,
                                      const BodyStates& states, Eigen::Index first);

}  // namespace mbv::internal
