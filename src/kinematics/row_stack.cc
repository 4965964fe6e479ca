#include "kinematics/row_stack.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <numeric>
#include <utility>

#include "base/demand.h"
#include "kinematics/constraints.h"
#include "kinematics/tree_motion.h"
#include "math/sparse.h"

namespace mbv::internal {

void RowStack::AddTo(Row* row, int body, const Vec6& J, double scale) const {
  if (body == 0) return;
  Vec6 scaled;
  scaled << scale * J.head<3>(), scale * length_ * J.tail<3>();
  const auto at = std::ranges::find(*row, body, &Row::value_type::first);
  if (at != row->end()) {
    at->second += scaled;
  } else {
    row->emplace_back(body, scaled);
  }
}

void RowStack::Add(int parent, const Vec6& J_parent, int child, const Vec6& J_child,
                   bool translation) {
  const double scale = translation ? 1.0 / length_ : 1.0;
  Row row;
  AddTo(&row, parent, J_parent, scale);
  AddTo(&row, child, J_child, scale);
  rows_.push_back(std::move(row));
}

void RowStack::AddSum(const std::vector<ScalarRow>& pieces, bool translation) {
  const double scale = translation ? 1.0 / length_ : 1.0;
  Row row;
  for (const ScalarRow& piece : pieces) {
    AddTo(&row, piece.parent, piece.J_parent, scale);
    AddTo(&row, piece.child, piece.J_child, scale);
  }
  rows_.push_back(std::move(row));
}

void RowStack::Add(const ConstraintRows& rows) {
  for (int i = 0; i < rows.rows; ++i) {
    Add(rows.parent, rows.J_parent.row(i), rows.child, rows.J_child.row(i),
        i < rows.translation_rows);
  }
}

void RowStack::Add(const CouplingRow& row) { AddSum(row.pieces, !row.angular); }

void RowStack::AddJoints(const Mechanism& mechanism, const BodyStates& states, bool reactions) {
  for (const Joint& joint : mechanism.joints) {
    const int before = size();
    Add(RowsOf(joint, states, reactions));
    const bool whole = !reactions || !joint.transmits_force_only;
    for (int row = before; row < size() && whole && !joint.closure; ++row) {
      tree_rows_.push_back(row);
    }
  }
  for (const CouplingRow& row : CouplingRows(mechanism, states)) Add(row);
}

void RowStack::AddIdle(const Mechanism& mechanism, const BodyStates& states) {
  for (const Spin& spin : IdleSpins(mechanism)) Add(IdleRow(spin, states), false);
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

SparseRows RowStack::Matrix() const {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < size(); ++i) {
    for (const auto& [body, J] : rows_[static_cast<size_t>(i)]) {
      for (int c = 0; c < 6; ++c) {
        if (J[c] != 0.0) entries.emplace_back(i, 6 * (body - 1) + c, J[c]);
      }
    }
  }
  SparseRows matrix(size(), columns_);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

namespace {

constexpr double kClearGap = 1e3;  // of a gap, on both sides of the tolerance

using Places = std::vector<Eigen::Index>;

// Rows and columns that entries connect: a matrix of mechanisms side by side falls into one part
// per mechanism.
struct Part {
  Places rows, columns = {};
  [[nodiscard]] bool empty() const { return rows.empty() || columns.empty(); }
  [[nodiscard]] auto smaller() const {
    return static_cast<Eigen::Index>(std::min(rows.size(), columns.size()));
  }
};

std::vector<Part> PartsOf(const SparseRows& J) {
  // Union-find over the columns.
  std::vector<Eigen::Index> root(static_cast<size_t>(J.cols()));
  std::iota(root.begin(), root.end(), Eigen::Index{0});
  const auto find = [&](Eigen::Index c) {
    while (root[c] != c) c = root[c] = root[root[c]];
    return c;
  };
  std::vector<Eigen::Index> first(static_cast<size_t>(J.rows()), -1);  // per row
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    for (SparseRows::InnerIterator entry(J, i); entry; ++entry) {
      if (first[i] < 0) first[i] = entry.col();
      root[find(entry.col())] = find(first[i]);
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
      parts.push_back({.rows = {i}});  // constrains nothing
    }
  }
  return parts;
}

// Where each row or column lies within its part.
std::vector<Eigen::Index> PlacesWithin(const Places& places, Eigen::Index size) {
  std::vector<Eigen::Index> within(static_cast<size_t>(size), -1);
  for (size_t k = 0; k < places.size(); ++k) within[places[k]] = static_cast<Eigen::Index>(k);
  return within;
}

std::vector<Eigen::Triplet<double>> EntriesOf(const SparseRows& J, const Part& part) {
  const std::vector<Eigen::Index> column = PlacesWithin(part.columns, J.cols());
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t i = 0; i < part.rows.size(); ++i) {
    for (SparseRows::InnerIterator entry(J, part.rows[i]); entry; ++entry) {
      entries.emplace_back(i, column[entry.col()], entry.value());
    }
  }
  return entries;
}

MatX DensePart(const SparseRows& J, const Part& part) {
  MatX dense = MatX::Zero(static_cast<Eigen::Index>(part.rows.size()),
                          static_cast<Eigen::Index>(part.columns.size()));
  for (const auto& entry : EntriesOf(J, part)) dense(entry.row(), entry.col()) = entry.value();
  return dense;
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

SparseRows SparseOf(const MatX& J) { return J.sparseView(); }

// Rank and vectors of one part.
struct PartRank {
  Eigen::Index rank = 0;
  double largest = 0.0, smallest_kept = 0.0, largest_dropped = 0.0;
  MatX vectors;      // of the null space wanted
  VecX singular;     // dense parts: all of them,
  MatX all_vectors;  // with theirs
};

// Empty where the decomposition failed.
template <typename Svd>
std::optional<PartRank> PartOf(const Svd& svd, NullSpaces wanted) {
  PartRank part;
  part.singular = svd.singularValues();
  part.largest = part.singular.size() == 0 ? 0.0 : part.singular[0];
  if (wanted == NullSpaces::kSelfStress) part.all_vectors = svd.matrixU();
  if (wanted == NullSpaces::kMotion) part.all_vectors = svd.matrixV();
  const bool good =
      svd.info() == Eigen::Success && part.singular.allFinite() && part.all_vectors.allFinite();
  return good ? std::optional(std::move(part)) : std::nullopt;
}

PartRank SingularValuesOf(const MatX& J, NullSpaces wanted) {
  MBV_DEMAND(J.allFinite(), "rows of constraints");
  const unsigned options = wanted == NullSpaces::kSelfStress ? Eigen::ComputeFullU
                           : wanted == NullSpaces::kMotion   ? Eigen::ComputeFullV
                                                             : 0;
  if (auto part = PartOf(Eigen::BDCSVD<MatX>(J, options), wanted)) return *std::move(part);
  // Eigen's divide and conquer makes NaN of some matrices; this is slower by far.
  auto part =
      PartOf(Eigen::JacobiSVD<MatX, Eigen::FullPivHouseholderQRPreconditioner>(J, options), wanted);
  MBV_DEMAND(part.has_value(), "singular values");
  return *std::move(part);
}

// With singular values, what lies above `limit` counts.
void Count(double limit, PartRank* part) {
  const VecX& s = part->singular;
  while (part->rank < s.size() && s[part->rank] > limit) ++part->rank;
  if (part->rank > 0) part->smallest_kept = s[part->rank - 1];
  if (part->rank < s.size()) part->largest_dropped = s[part->rank];
  if (part->all_vectors.size() > 0) {
    part->vectors = part->all_vectors.rightCols(part->all_vectors.cols() - part->rank);
  }
}

// By sparse QR; empty where that is not clear.
std::optional<PartRank> SparsePart(const SparseRows& J, const Part& part, NullSpaces wanted,
                                   double tolerance) {
  SparseRank::Matrix A(static_cast<Eigen::Index>(part.rows.size()),
                       static_cast<Eigen::Index>(part.columns.size()));
  const auto entries = EntriesOf(J, part);
  A.setFromTriplets(entries.begin(), entries.end());
  if (wanted == NullSpaces::kSelfStress) A = SparseRank::Matrix(A.transpose());
  const SparseRank qr(A, tolerance);
  if (!qr.clear()) return {};
  MatX vectors = wanted == NullSpaces::kNone ? MatX() : qr.NullSpace();
  const bool leave = wanted == NullSpaces::kSelfStress && vectors.cols() > kMostOrthogonal;
  return PartRank{.rank = qr.rank(),
                  .largest = 0.0,
                  .smallest_kept = qr.smallest_kept(),
                  .largest_dropped = qr.dropped_norm(),
                  .vectors = leave ? std::move(vectors) : Orthonormal(vectors),
                  .singular = {},
                  .all_vectors = {}};
}

}  // namespace

std::optional<NestedRanks> ClearRanks(const SparseRows& J, Eigen::Index first, double tolerance,
                                      double largest) {
  double largest_row = 0.0, largest_first = 0.0;
  for (Eigen::Index i = 0; i < J.rows(); ++i) {
    largest_row = std::max(largest_row, J.row(i).norm());
    if (i < first) largest_first = largest_row;
  }
  const double least_kept = kClearGap * tolerance * std::max(largest, largest_row);
  const double most_dropped = tolerance * (first > 0 ? largest_first : largest_row) / kClearGap;
  NestedRanks ranks;
  for (const Part& part : PartsOf(J)) {
    if (part.empty()) continue;
    const auto size = static_cast<double>(part.rows.size() + part.columns.size());
    // The diagonal of R: singular values within a factor of the part's size, but for matrices made
    // to spoil that (Kahan's), which the gap that is asked for keeps away.
    const auto rank_of = [&](const Eigen::ColPivHouseholderQR<MatX>& qr) {
      Eigen::Index rank = 0;
      for (const double pivot : qr.matrixQR().diagonal().cwiseAbs().eval()) {
        const bool kept = pivot > size * least_kept;
        if (!kept && !(pivot <= most_dropped)) return Eigen::Index{-1};
        rank += kept ? 1 : 0;
      }
      return rank;
    };
    MatX rows = DensePart(J, part).transpose();  // as columns
    const Eigen::Index count = std::ranges::lower_bound(part.rows, first) - part.rows.begin();
    if (count > 0) {
      const Eigen::ColPivHouseholderQR<MatX> qr(rows.leftCols(count));
      const Eigen::Index rank = rank_of(qr);
      if (rank < 0) return {};
      ranks.first += static_cast<int>(rank);
      ranks.all += static_cast<int>(rank);
      // Of the other rows: what the first ones do not span.
      MatX others = rows.rightCols(rows.cols() - count);
      others.applyOnTheLeft(qr.householderQ().setLength(rank).adjoint());
      rows = others.bottomRows(others.rows() - rank);
    }
    if (rows.size() == 0) continue;
    const Eigen::Index rank = rank_of(Eigen::ColPivHouseholderQR<MatX>(rows));
    if (rank < 0) return {};
    ranks.all += static_cast<int>(rank);
  }
  return ranks;
}

NestedRanks RanksOf(const SparseRows& J, Eigen::Index first) {
  if (std::min(J.rows(), J.cols()) <= kLargestDense) {
    if (const std::optional<NestedRanks> clear = ClearRanks(J, first)) return *clear;
  }
  const SparseRows top = J.topRows(first);
  return {.first = FindRank(top, NullSpaces::kNone).rank,
          .all = FindRank(J, NullSpaces::kNone).rank};
}

namespace {

// A basis of unit length of the motions that the tree's joints leave free; empty where the rows of
// the tree in J and the tree's coordinates are not just what there is, or poses do not fit.
std::optional<MatX> FreeInTree(const RowStack& rows, const Mechanism& mechanism,
                               const BodyStates& states, const SparseRows& tree_rows,
                               double largest) {
  constexpr double kLeastPivot = 1e-4;  // of the largest
  const TreeMotion tree(mechanism, std::vector<bool>(mechanism.joints.size(), false));
  if (tree.dofs() == 0 || tree_rows.rows() + tree.dofs() != tree_rows.cols()) return {};
  MatX motion = tree.Jacobian(states).bottomRows(tree_rows.cols());
  for (Eigen::Index b = 3; b < motion.rows(); b += 6) motion.middleRows<3>(b) /= rows.length();
  const Eigen::HouseholderQR<MatX> qr(motion);
  const VecX pivots = qr.matrixQR().diagonal().cwiseAbs();
  if (!(pivots.minCoeff() > kLeastPivot * pivots.maxCoeff())) return {};
  MatX free = qr.householderQ() * MatX::Identity(motion.rows(), motion.cols());
  const double held = tree_rows.rows() == 0 ? 0.0 : (tree_rows * free).cwiseAbs().maxCoeff();
  return held <= kRankTolerance * largest / kClearGap ? std::optional(std::move(free))
                                                      : std::nullopt;
}

SparseRows Chosen(const SparseRows& J, const std::vector<int>& which) {
  std::vector<Eigen::Triplet<double>> entries;
  for (size_t i = 0; i < which.size(); ++i) {
    for (SparseRows::InnerIterator entry(J, which[i]); entry; ++entry) {
      entries.emplace_back(static_cast<int>(i), entry.col(), entry.value());
    }
  }
  SparseRows some(static_cast<Eigen::Index>(which.size()), J.cols());
  some.setFromTriplets(entries.begin(), entries.end());
  return some;
}

}  // namespace

NestedRanks RanksInTree(const RowStack& rows, const Mechanism& mechanism, const BodyStates& states,
                        Eigen::Index first) {
  constexpr Eigen::Index kSmall = 48;  // columns: a dense matrix is as fast
  const SparseRows J = rows.Matrix();
  if (J.cols() <= kSmall || J.cols() > kLargestDense) return RanksOf(J, first);
  double largest = 0.0;
  for (Eigen::Index i = 0; i < J.rows(); ++i) largest = std::max(largest, J.row(i).norm());
  const std::vector<int>& of_tree = rows.tree_rows();
  const auto free = FreeInTree(rows, mechanism, states, Chosen(J, of_tree), largest);
  if (!free) return RanksOf(J, first);
  std::vector<int> others;
  int others_first = 0, tree_first = 0;
  for (int row = 0, at = 0; row < rows.size(); ++row) {
    const bool tree = at < static_cast<int>(of_tree.size()) && of_tree[at] == row;
    at += tree ? 1 : 0;
    if (!tree) others.push_back(row);
    if (row < first) (tree ? tree_first : others_first) += 1;
  }
  const SparseRows left = SparseOf(Chosen(J, others) * *free);
  const auto clear = ClearRanks(left, others_first, kRankTolerance, largest);
  // The first rows must have all of the tree.
  if (!clear || tree_first != static_cast<int>(of_tree.size())) return RanksOf(J, first);
  return {.first = tree_first + clear->first, .all = tree_first + clear->all};
}

int RankOf(const SparseRows& J, double tolerance) {
  if (std::min(J.rows(), J.cols()) <= kLargestDense) {
    if (const auto clear = ClearRanks(J, 0, tolerance)) return clear->all;
  }
  return FindRank(J, NullSpaces::kNone, tolerance).rank;
}

int RankOf(const MatX& J, double tolerance) { return RankOf(SparseOf(J), tolerance); }

RankFinding FindRank(const SparseRows& J, NullSpaces wanted, double tolerance, Eigen::Index dense) {
  const std::vector<Part> parts = PartsOf(J);
  std::vector<PartRank> ranks(parts.size());
  double largest = 0.0;
  for (size_t p = 0; p < parts.size(); ++p) {
    if (parts[p].empty()) continue;
    if (parts[p].smaller() > dense) {
      if (auto sparse = SparsePart(J, parts[p], wanted, tolerance)) {
        ranks[p] = *std::move(sparse);
        continue;
      }
    }
    ranks[p] = SingularValuesOf(DensePart(J, parts[p]), wanted);
    largest = std::max(largest, ranks[p].largest);
  }
  RankFinding out;
  for (PartRank& part : ranks) {
    if (part.singular.size() > 0) Count(tolerance * largest, &part);
    out.rank += static_cast<int>(part.rank);
    out.largest_dropped = std::max(out.largest_dropped, part.largest_dropped);
    if (part.rank == 0) continue;
    out.smallest_kept = out.smallest_kept == 0.0 ? part.smallest_kept
                                                 : std::min(out.smallest_kept, part.smallest_kept);
  }
  const bool stress = wanted == NullSpaces::kSelfStress;
  if (wanted == NullSpaces::kNone) return out;
  MatX& vectors = stress ? out.self_stress : out.motion;
  const Eigen::Index size = stress ? J.rows() : J.cols();
  vectors.setZero(size, size - out.rank);
  Eigen::Index next = 0;
  for (size_t p = 0; p < parts.size(); ++p) {
    const Places& places = stress ? parts[p].rows : parts[p].columns;
    const auto n = static_cast<Eigen::Index>(places.size());
    AddVectors(parts[p].empty() ? MatX(MatX::Identity(n, n)) : ranks[p].vectors, places, &next,
               &vectors);
  }
  return out;
}

RankFinding FindRank(const MatX& J, NullSpaces wanted, double tolerance) {
  return FindRank(SparseOf(J), wanted, tolerance);
}

MatX Orthonormal(const MatX& vectors) {
  if (vectors.size() == 0) return vectors;
  const Eigen::HouseholderQR<MatX> qr(vectors);
  return qr.householderQ() * MatX::Identity(vectors.rows(), vectors.cols());
}

}  // namespace mbv::internal
