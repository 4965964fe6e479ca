#include "reference/least_forces.h"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

namespace mbv::internal {
namespace {

// A self-stress with a smaller share than this in the driven forces does not act there.
constexpr double kShare = 1e-7;
// a of (1): about the smallest singular value of A, for which the condition of the whole is A's
// [Björck 1996, §2.5.2].
constexpr double kDiagonal = 0.05;

}  // namespace

void TakeLeastForces(const MatX& self_stress, Eigen::Index first_driven, VecX* force) {
  const Eigen::Index k = self_stress.cols(), driven = force->size() - first_driven;
  if (k == 0) return;
  const Eigen::HouseholderQR<MatX> qr(self_stress);
  const MatX Q = qr.householderQ() * MatX::Identity(self_stress.rows(), k);
  MatX rest = Q;  // self-stresses that leave the driven forces alone
  if (driven > 0) {
    const Eigen::JacobiSVD<MatX> svd(Q.bottomRows(driven),
                                     Eigen::ComputeThinU | Eigen::ComputeFullV);
    const VecX& share = svd.singularValues();
    Eigen::Index acting = 0;
    while (acting < share.size() && share[acting] > kShare) ++acting;
    const VecX along = svd.matrixU().leftCols(acting).transpose() * force->tail(driven);
    *force -= Q * (svd.matrixV().leftCols(acting) * along.cwiseQuotient(share.head(acting)));
    rest = Q * svd.matrixV().rightCols(k - acting);
  }
  *force -= rest * (rest.transpose() * *force);
}

void SparseLeastForces::MakePattern(const SparseLu::Matrix& A) {
  const auto forces = static_cast<int>(A.cols());
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < forces; ++i) {
    entries.emplace_back(i, i, kDiagonal);
    for (SparseLu::Matrix::InnerIterator entry(A, i); entry; ++entry) {
      const auto equation = static_cast<int>(forces + entry.row());
      entries.emplace_back(equation, i, 0.0);
      entries.emplace_back(i, equation, 0.0);
    }
  }
  K_.resize(A.cols() + A.rows(), A.cols() + A.rows());
  K_.setFromTriplets(entries.begin(), entries.end());
  K_.makeCompressed();
  const auto place = [&](int row, int column) {
    const int* first = K_.innerIndexPtr() + K_.outerIndexPtr()[column];
    const int* last = K_.innerIndexPtr() + K_.outerIndexPtr()[column + 1];
    return static_cast<int>(std::lower_bound(first, last, row) - K_.innerIndexPtr());
  };
  in_rows_.clear();
  in_columns_.clear();
  for (int i = 0; i < forces; ++i) {
    for (SparseLu::Matrix::InnerIterator entry(A, i); entry; ++entry) {
      const auto equation = static_cast<int>(forces + entry.row());
      in_columns_.push_back(place(equation, i));
      in_rows_.push_back(place(i, equation));
    }
  }
  lu_.Reset();
}

bool SparseLeastForces::Factor(const SparseLu::Matrix& A) {
  A_ = &A;
  if (static_cast<Eigen::Index>(in_rows_.size()) != A.nonZeros() ||
      K_.rows() != A.rows() + A.cols()) {
    MakePattern(A);
  }
  for (Eigen::Index k = 0; k < A.nonZeros(); ++k) {
    K_.valuePtr()[in_columns_[static_cast<size_t>(k)]] = A.valuePtr()[k];
    K_.valuePtr()[in_rows_[static_cast<size_t>(k)]] = -A.valuePtr()[k];
  }
  return lu_.Factor(K_);
}

VecX SparseLeastForces::Solve(const VecX& b) const {
  VecX x = VecX::Zero(A_->cols()), rest = b, both(K_.rows());
  // The second pass is iterative refinement.
  for (int pass = 0; pass < 2; ++pass) {
    both.setZero();
    both.tail(b.size()) = rest;
    lu_.Solve(&both);
    x += both.head(x.size());
    rest = b - *A_ * x;
  }
  return x;
}

bool SparseLeastForces::SelfStressReaches(Eigen::Index first) const {
  VecX random(A_->cols());
  for (Eigen::Index i = 0; i < random.size(); ++i) {
    random[i] = std::sin(1.0 + 1.7 * static_cast<double>(i) + std::cos(static_cast<double>(i)));
  }
  const VecX stress = random - Solve(*A_ * random);
  return stress.tail(random.size() - first).norm() > kShare * stress.norm();
}

}  // namespace mbv::internal
