#include "kinematics/row_stack.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <numeric>

#include "kinematics/frame_pair.h"

namespace mbv::internal {

void RowStack::Add(int parent, const Vec6& J_parent, int child, const Vec6& J_child,
                   bool translation) {
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

void RowStack::Add(const ConstraintRows& rows) {
  for (int i = 0; i < rows.rows; ++i) {
    Add(rows.parent, rows.J_parent.row(i), rows.child, rows.J_child.row(i),
        i < rows.translation_rows);
  }
}

void RowStack::Add(const CouplingRow& row) {
  const size_t first = rows_.size();
  for (const ScalarRow& piece : row.pieces) Add(piece, !row.angular);
  for (size_t i = first + 1; i < rows_.size(); ++i) rows_[first] += rows_[i];
  rows_.resize(first + 1, VecX::Zero(columns_));
}

void RowStack::AddJoints(const Mechanism& mechanism, const BodyStates& states, bool reactions) {
  for (const Joint& joint : mechanism.joints) Add(RowsOf(joint, states, reactions));
  for (const CouplingRow& row : CouplingRows(mechanism, states)) Add(row);
}

void RowStack::AddDriven(const Mechanism& mechanism, const BodyStates& states) {
  for (const Drive& drive : mechanism.drives) {
    Add(DriveRow(mechanism, drive, states), PositionUnit(mechanism, drive) == "m");
  }
  for (const Prescribed& prescribed : mechanism.prescribed) {
    const Joint& joint = mechanism.joints[prescribed.joint];
    Add(JointCoordinateRow(joint, 0, states), IsLength(joint.kind, 0));
  }
}

MatX RowStack::Matrix() const {
  MatX J(size(), columns_);
  for (int i = 0; i < size(); ++i) J.row(i) = rows_[i].transpose();
  return J;
}

namespace {

// Rows and columns that entries connect: a matrix of mechanisms side by side falls into one part
// per mechanism.
struct Part {
  std::vector<Eigen::Index> rows, columns;
  Eigen::BDCSVD<MatX> svd;
  [[nodiscard]] double largest() const {
    return svd.singularValues().size() == 0 ? 0.0 : svd.singularValues()[0];
  }
};

std::vector<Part> PartsOf(const MatX& J) {
  // Union-find over the columns.
  std::vector<Eigen::Index> root(static_cast<size_t>(J.cols()));
  std::iota(root.begin(), root.end(), Eigen::Index{0});
  const auto find = [&](Eigen::Index c) {
    while (root[c] != c) c = root[c] = root[root[c]];
    return c;
  };
  std::vector<Eigen::Index> first(static_cast<size_t>(J.rows()), -1);  // per row
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    for (Eigen::Index c = 0; c < J.cols(); ++c) {
      if (J(i, c) == 0.0) continue;
      if (first[i] < 0) first[i] = c;
      root[find(c)] = find(first[i]);
    }
  }
  std::vector<Part> parts;
  std::vector<size_t> part_of(root.size());
  for (Eigen::Index c = 0; c < J.cols(); ++c) {
    if (find(c) != c) continue;
    part_of[c] = parts.size();
    parts.emplace_back();
  }
  for (Eigen::Index c = 0; c < J.cols(); ++c) parts[part_of[find(c)]].columns.push_back(c);
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    if (first[i] >= 0) {
      parts[part_of[find(first[i])]].rows.push_back(i);
    } else {
      parts.push_back({.rows = {i}, .columns = {}, .svd = {}});  // constrains nothing
    }
  }
  return parts;
}

// `to` gets the vectors of a part, at their places of the whole.
void AddVectors(const MatX& vectors, const std::vector<Eigen::Index>& places, Eigen::Index* next,
                MatX* to) {
  for (Eigen::Index k = 0; k < vectors.cols(); ++k, ++*next) {
    for (size_t i = 0; i < places.size(); ++i) {
      (*to)(places[i], *next) = vectors(static_cast<Eigen::Index>(i), k);
    }
  }
}

// The diagonal of R: a part's singular values within a factor of its size, but for matrices made to
// spoil that (Kahan's), which the gap that is asked for keeps away.
struct PivotedPart {
  VecX diagonal;
  double size = 0.0;
};

std::vector<PivotedPart> PivotsOf(const MatX& J) {
  std::vector<PivotedPart> pivots;
  for (const Part& part : PartsOf(J)) {
    if (part.rows.empty() || part.columns.empty()) continue;
    const Eigen::ColPivHouseholderQR<MatX> qr(J(part.rows, part.columns));
    pivots.push_back({qr.matrixQR().diagonal().cwiseAbs(),
                      static_cast<double>(part.rows.size() + part.columns.size())});
  }
  return pivots;
}

}  // namespace

std::optional<int> ClearRank(const MatX& J, double tolerance) {
  constexpr double kClear = 1e3;  // on both sides of the tolerance
  const std::vector<PivotedPart> parts = PivotsOf(J);
  double largest = 0.0;
  for (const PivotedPart& part : parts) largest = std::max(largest, part.diagonal[0]);
  const double limit = tolerance * largest;
  int rank = 0;
  for (const PivotedPart& part : parts) {
    for (const double pivot : part.diagonal) {
      const bool kept = pivot > kClear * part.size * limit;
      if (!kept && !(pivot <= limit / kClear)) return {};
      rank += kept ? 1 : 0;
    }
  }
  return rank;
}

int RankOf(const MatX& J, double tolerance) {
  const std::optional<int> clear = ClearRank(J, tolerance);
  return clear ? *clear : FindRank(J, NullSpaces::kNone, tolerance).rank;
}

RankFinding FindRank(const MatX& J, NullSpaces wanted, double tolerance) {
  const unsigned options = wanted == NullSpaces::kSelfStress ? Eigen::ComputeFullU
                           : wanted == NullSpaces::kMotion   ? Eigen::ComputeFullV
                                                             : 0;
  std::vector<Part> parts = PartsOf(J);
  double largest = 0.0;
  for (Part& part : parts) {
    if (part.rows.empty() || part.columns.empty()) continue;
    part.svd.compute(J(part.rows, part.columns), options);
    largest = std::max(largest, part.largest());
  }
  RankFinding out;
  std::vector<Eigen::Index> ranks;
  for (const Part& part : parts) {
    const auto n = static_cast<Eigen::Index>(std::min(part.rows.size(), part.columns.size()));
    Eigen::Index rank = 0;
    for (; rank < n && part.svd.singularValues()[rank] > tolerance * largest; ++rank) {
      const double s = part.svd.singularValues()[rank];
      out.smallest_kept = out.smallest_kept == 0.0 ? s : std::min(out.smallest_kept, s);
    }
    if (rank < n)
      out.largest_dropped = std::max(out.largest_dropped, part.svd.singularValues()[rank]);
    out.rank += static_cast<int>(rank);
    ranks.push_back(rank);
  }
  if (wanted == NullSpaces::kSelfStress) out.self_stress.setZero(J.rows(), J.rows() - out.rank);
  if (wanted == NullSpaces::kMotion) out.motion.setZero(J.cols(), J.cols() - out.rank);
  Eigen::Index next = 0;
  for (size_t p = 0; p < parts.size(); ++p) {
    const Part& part = parts[p];
    const bool empty = part.rows.empty() || part.columns.empty();
    if (wanted == NullSpaces::kSelfStress) {
      const auto rows = static_cast<Eigen::Index>(part.rows.size());
      const MatX U = empty ? MatX(MatX::Identity(rows, rows)) : part.svd.matrixU();
      AddVectors(U.rightCols(rows - ranks[p]), part.rows, &next, &out.self_stress);
    } else if (wanted == NullSpaces::kMotion) {
      const auto columns = static_cast<Eigen::Index>(part.columns.size());
      const MatX V = empty ? MatX(MatX::Identity(columns, columns)) : part.svd.matrixV();
      AddVectors(V.rightCols(columns - ranks[p]), part.columns, &next, &out.motion);
    }
  }
  return out;
}

}  // namespace mbv::internal
