#include "reference/square_system.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/demand.h"
#include "math/sparse.h"

namespace mbv::internal {
namespace {

// Independent rows have pivots above this share of the largest; poses close to 1e-12.
constexpr double kRankTolerance = 1e-9;
// Equations of more bodies are factored sparse.
constexpr int kLargestDense = 300;

}  // namespace

SquareSystem::SquareSystem(size_t bodies, double length)
    : size_(6 * (static_cast<int>(bodies) - 1)), length_(length) {
  body_scale_.setOnes(size_);
  for (int i = 0; i < size_; i += 6) body_scale_.segment<3>(i).setConstant(1.0 / length_);
}

SparseLu::Matrix SquareSystem::ScaledColumns(const RowSet& rows,
                                             const std::vector<int>& among) const {
  SparseLu::Matrix columns(size_, static_cast<Eigen::Index>(among.size()));
  columns.reserve(6 * static_cast<Eigen::Index>(rows.body.size()));
  for (int k = 0; k < static_cast<int>(among.size()); ++k) {
    const int i = among[k];
    columns.startVec(k);
    for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
      const int at = 6 * (rows.body[p] - 1);
      for (int c = 0; c < 6; ++c) {
        const double x = RowScale(rows.angular[i]) * body_scale_[at + c] * rows.J[p][c];
        if (x != 0.0) columns.insertBack(at + c, k) = x;
      }
    }
  }
  columns.finalize();
  return columns;
}

namespace {

// The columns that span what all do; increasing.
std::vector<int> IndependentColumns(const SparseLu::Matrix& columns) {
  std::vector<int> chosen;
  if (columns.rows() > kLargestDense) {
    const SparseRank qr(columns, kRankTolerance);
    if (qr.clear()) return qr.FirmlyIndependent();
  }
  Eigen::ColPivHouseholderQR<MatX> qr{MatX(columns)};
  qr.setThreshold(kRankTolerance);
  chosen.reserve(static_cast<size_t>(qr.rank()));
  for (int k = 0; k < qr.rank(); ++k) chosen.push_back(qr.colsPermutation().indices()[k]);
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

bool IsSame(const SparseLu::Matrix& A, const SparseLu::Matrix& B) {
  const auto equal = [](const auto* a, const auto* b, Eigen::Index n) {
    return std::equal(a, a + n, b);
  };
  return A.rows() == B.rows() && A.cols() == B.cols() && A.nonZeros() == B.nonZeros() &&
         equal(A.outerIndexPtr(), B.outerIndexPtr(), A.cols() + 1) &&
         equal(A.innerIndexPtr(), B.innerIndexPtr(), A.nonZeros()) &&
         equal(A.valuePtr(), B.valuePtr(), A.nonZeros());
}

}  // namespace

std::vector<int> SquareSystem::IndependentRows(const RowSet& rows,
                                               const std::vector<int>& among) const {
  // Each pose of a study begins at the same home: what was asked last is remembered, of loop
  // closure and of forces.
  struct Answer {
    SparseLu::Matrix columns;
    std::vector<int> chosen;
  };
  thread_local std::array<Answer, 2> answers;
  thread_local size_t next = 0;
  SparseLu::Matrix columns = ScaledColumns(rows, among);
  if (columns.size() == 0) return {};
  const auto known = std::ranges::find_if(
      answers, [&](const Answer& answer) { return IsSame(answer.columns, columns); });
  Answer& answer = known != answers.end() ? *known : answers[next++ % answers.size()];
  if (known == answers.end()) {
    answer.chosen = IndependentColumns(columns);
    answer.columns = std::move(columns);
  }
  std::vector<int> chosen = answer.chosen;
  for (int& row : chosen) row = among[static_cast<size_t>(row)];
  return chosen;
}
void SquareSystem::MakeColumns(const RowSet& rows, const std::vector<int>& selection,
                               SparseLu::Matrix* columns) const {
  columns->resize(size_, static_cast<Eigen::Index>(selection.size()));
  columns->reserve(6 * static_cast<Eigen::Index>(rows.body.size()));
  for (int k = 0; k < static_cast<int>(selection.size()); ++k) {
    const int i = selection[k];
    columns->startVec(k);
    for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
      const int at = 6 * (rows.body[p] - 1);
      for (int c = 0; c < (rows.angular[i] ? 3 : 6); ++c) columns->insertBack(at + c, k) = 1.0;
    }
  }
  columns->finalize();
  FillColumns(rows, selection, columns);
}

void SquareSystem::FillColumns(const RowSet& rows, const std::vector<int>& selection,
                               SparseLu::Matrix* columns) const {
  double* out = columns->valuePtr();
  for (const int i : selection) {
    const bool angular = rows.angular[static_cast<size_t>(i)] != 0;
    const double translation = RowScale(angular), rotation = translation / length_;
    const int* first = rows.start.data() + i;
    for (int p = first[0]; p < first[1]; ++p) {
      const double* J = rows.J.data()[p].data();
      for (int c = 0; c < 3; ++c) *out++ = rotation * J[c];
      if (angular) continue;
      for (int c = 3; c < 6; ++c) *out++ = translation * J[c];
    }
  }
  MBV_DEMAND(out == columns->valuePtr() + columns->nonZeros(), columns->nonZeros());
}

bool SquareSystem::Factor(const RowSet& rows, const std::vector<int>& selection,
                          bool new_selection) {
  MBV_DEMAND(static_cast<int>(selection.size()) == size_, selection.size());
  determinant_sign_ = 0;
  if (new_selection) {
    MakeColumns(rows, selection, &matrix_);
    row_scale_.resize(size_);
    for (int k = 0; k < size_; ++k) row_scale_[k] = RowScale(rows.angular[selection[k]]);
    lu_.Reset();
    soft_force_.resize(0);
  } else {
    FillColumns(rows, selection, &matrix_);
  }
  if (!lu_.Factor(matrix_)) return false;
  determinant_sign_ = lu_.determinant_sign();
  return true;
}

void SquareSystem::Solve(const VecX& wrenches, VecX* x) const {
  *x = body_scale_.cwiseProduct(wrenches);
  lu_.Solve(x);
  *x = row_scale_.cwiseProduct(*x);
}

void SquareSystem::SolveTransposed(const VecX& rates, VecX* V) const {
  *V = row_scale_.cwiseProduct(rates);
  lu_.SolveTransposed(V);
  *V = body_scale_.cwiseProduct(*V);
}

double SquareSystem::SmallestSingularValue(int iterations) {
  if (size_ == 0) return 1.0;
  if (soft_force_.size() != size_) {
    // A start with a share in every direction.
    soft_force_.resize(size_);
    for (int i = 0; i < size_; ++i) soft_force_[i] = 1.0 + 0.5 * std::sin(1.7 * i);
    soft_force_.normalize();
    iterations += 4;
  }
  double sigma = 0.0;
  for (int i = 0; i < iterations; ++i) {
    soft_motion_ = soft_force_;
    lu_.SolveTransposed(&soft_motion_);
    soft_motion_.normalize();
    soft_force_ = soft_motion_;
    lu_.Solve(&soft_force_);
    const double norm = soft_force_.norm();
    if (!std::isfinite(norm) || norm == 0.0) return 0.0;
    sigma = 1.0 / norm;
    soft_force_ /= norm;
  }
  return sigma;
}

void Stack(const std::vector<Vec6>& per_body, VecX* stacked) {
  stacked->resize(6 * (static_cast<Eigen::Index>(per_body.size()) - 1));
  for (size_t b = 1; b < per_body.size(); ++b) {
    stacked->segment<6>(6 * (static_cast<Eigen::Index>(b) - 1)) = per_body[b];
  }
}

VecX Stack(const std::vector<Vec6>& per_body) {
  VecX stacked;
  Stack(per_body, &stacked);
  return stacked;
}

void Unstack(const VecX& stacked, std::vector<Vec6>* per_body) {
  for (size_t b = 1; b < per_body->size(); ++b) {
    (*per_body)[b] = stacked.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
  }
}

double SizeOf(const VecX& twists, double length) {
  double size = 0.0;
  for (Eigen::Index i = 0; i < twists.size(); i += 6) {
    size = std::max({size, twists.segment<3>(i).norm(), twists.segment<3>(i + 3).norm() / length});
  }
  return size;
}

}  // namespace mbv::internal
