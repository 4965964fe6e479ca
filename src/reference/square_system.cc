#include "reference/square_system.h"

#include <algorithm>
#include <cmath>

#include "core/demand.h"

namespace mbv::internal {
namespace {

// Below this size a dense factorisation is faster.
constexpr int kDenseSize = 36;
// Independent rows have pivots above this share of the largest; poses close to 1e-12.
constexpr double kRankTolerance = 1e-9;

}  // namespace

SquareSystem::SquareSystem(size_t bodies, double length)
    : size_(6 * (static_cast<int>(bodies) - 1)), length_(length), dense_(size_ <= kDenseSize) {
  body_scale_.setOnes(size_);
  for (int i = 0; i < size_; i += 6) body_scale_.segment<3>(i).setConstant(1.0 / length_);
}

std::vector<int> SquareSystem::IndependentRows(const RowSet& rows, int first, int last) const {
  MatX columns = MatX::Zero(size_, last - first);
  for (int i = first; i < last; ++i) {
    for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
      const int at = 6 * (rows.body[p] - 1);
      columns.col(i - first).segment<6>(at) =
          RowScale(rows.angular[i]) * body_scale_.segment<6>(at).cwiseProduct(rows.J[p]);
    }
  }
  std::vector<int> chosen;
  if (columns.cols() == 0 || size_ == 0) return chosen;
  Eigen::ColPivHouseholderQR<MatX> qr(columns);
  qr.setThreshold(kRankTolerance);
  for (int k = 0; k < qr.rank(); ++k) {
    chosen.push_back(first + qr.colsPermutation().indices()[k]);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void SquareSystem::BuildPattern(const RowSet& rows, const std::vector<int>& selection) {
  std::vector<Eigen::Triplet<double>> entries;
  row_scale_.resize(size_);
  for (int k = 0; k < size_; ++k) {
    const int i = selection[k];
    row_scale_[k] = RowScale(rows.angular[i]);
    for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
      const int at = 6 * (rows.body[p] - 1);
      for (int c = 0; c < (rows.angular[i] ? 3 : 6); ++c) entries.emplace_back(at + c, k, 1.0);
    }
  }
  matrix_.resize(size_, size_);
  matrix_.setFromTriplets(entries.begin(), entries.end());
  matrix_.makeCompressed();
  if (!dense_) sparse_lu_.analyzePattern(matrix_);
  soft_force_.resize(0);
}

bool SquareSystem::Factor(const RowSet& rows, const std::vector<int>& selection,
                          bool new_selection) {
  MBV_DEMAND(static_cast<int>(selection.size()) == size_, selection.size());
  if (new_selection) BuildPattern(rows, selection);
  double* out = matrix_.valuePtr();
  for (int k = 0; k < size_; ++k) {
    const int i = selection[k];
    for (int p = rows.start[i]; p < rows.start[i + 1]; ++p) {
      const int at = 6 * (rows.body[p] - 1);
      for (int c = 0; c < (rows.angular[i] ? 3 : 6); ++c) {
        *out++ = row_scale_[k] * body_scale_[at + c] * rows.J[p][c];
      }
    }
  }
  MBV_DEMAND(out == matrix_.valuePtr() + matrix_.nonZeros(), matrix_.nonZeros());
  if (dense_) {
    dense_lu_.compute(MatX(matrix_));
    const auto& pivots = dense_lu_.matrixLU().diagonal();
    determinant_sign_ = static_cast<int>(dense_lu_.permutationP().determinant());
    for (Eigen::Index k = 0; k < pivots.size(); ++k) {
      if (pivots[k] == 0.0 || !std::isfinite(pivots[k])) return false;
      if (pivots[k] < 0) determinant_sign_ = -determinant_sign_;
    }
    return true;
  }
  sparse_lu_.factorize(matrix_);
  if (sparse_lu_.info() != Eigen::Success) return false;
  determinant_sign_ = static_cast<int>(sparse_lu_.signDeterminant());
  return true;
}

VecX SquareSystem::SolveScaled(const VecX& b) {
  if (dense_) return dense_lu_.solve(b);
  return sparse_lu_.solve(b);
}

VecX SquareSystem::SolveScaledTransposed(const VecX& c) {
  if (dense_) return dense_lu_.transpose().solve(c);
  return sparse_lu_.transpose().solve(c);
}

VecX SquareSystem::Solve(const VecX& wrenches) {
  return row_scale_.cwiseProduct(SolveScaled(body_scale_.cwiseProduct(wrenches)));
}

VecX SquareSystem::SolveTransposed(const VecX& rates) {
  return body_scale_.cwiseProduct(SolveScaledTransposed(row_scale_.cwiseProduct(rates)));
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
    soft_motion_ = SolveScaledTransposed(soft_force_);
    soft_motion_.normalize();
    soft_force_ = SolveScaled(soft_motion_);
    const double norm = soft_force_.norm();
    if (!std::isfinite(norm) || norm == 0.0) return 0.0;
    sigma = 1.0 / norm;
    soft_force_ /= norm;
  }
  return sigma;
}

VecX Stack(const std::vector<Vec6>& per_body) {
  VecX stacked(6 * (static_cast<Eigen::Index>(per_body.size()) - 1));
  for (size_t b = 1; b < per_body.size(); ++b) {
    stacked.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1)) = per_body[b];
  }
  return stacked;
}

void Unstack(const VecX& stacked, std::vector<Vec6>* per_body) {
  for (size_t b = 1; b < per_body->size(); ++b) {
    (*per_body)[b] = stacked.segment<6>(6 * (static_cast<Eigen::Index>(b) - 1));
  }
}

}  // namespace mbv::internal
