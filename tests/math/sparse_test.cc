// Factors, ranks and least-norm solutions of sparse matrices against Eigen's dense ones.
#include <gtest/gtest.h>
#include <malloc.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <random>

#include "math/sparse.h"

namespace mbv {
namespace {

// Entries of the order one at a fifth of the places, and on the diagonal.
class RandomMatrices {
 public:
  RandomMatrices(int rows, int cols) : rows_(rows), cols_(cols) {
    for (int r = 0; r < rows; ++r) {
      for (int c = 0; c < cols; ++c) {
        if (r == c || uniform_(random_) > 0.6) places_.emplace_back(r, c);
      }
    }
  }
  // Another matrix of the same pattern.
  SparseLu::Matrix Next() {
    std::vector<Eigen::Triplet<double>> entries;
    for (const auto& [r, c] : places_) entries.emplace_back(r, c, uniform_(random_));
    SparseLu::Matrix A(rows_, cols_);
    A.setFromTriplets(entries.begin(), entries.end());
    return A;
  }
  VecX Vector(Eigen::Index size) {
    VecX v(size);
    for (double& x : v) x = uniform_(random_);
    return v;
  }

 private:
  std::mt19937_64 random_{7};
  std::uniform_real_distribution<double> uniform_{-1.0, 1.0};
  int rows_, cols_;
  std::vector<std::pair<int, int>> places_;
};

TEST(SparseLuFactors, SolveMatricesOfOnePatternAndKnowTheSignOfTheirDeterminants) {
  RandomMatrices matrices(30, 30);
  SparseLu lu;
  int negative = 0;
  for (int k = 0; k < 40; ++k) {
    const SparseLu::Matrix A = matrices.Next();
    ASSERT_TRUE(lu.Factor(A));
    const MatX dense(A);
    const double sign = dense.determinant() < 0 ? -1 : 1;
    negative += sign < 0 ? 1 : 0;
    EXPECT_EQ(lu.determinant_sign(), sign) << k;
    const double condition = 1.0 / dense.partialPivLu().rcond();
    const VecX b = matrices.Vector(30);
    VecX x = b, y = b;
    lu.Solve(&x);
    lu.SolveTransposed(&y);
    EXPECT_LT((A * x - b).norm(), 1e-14 * condition) << k;
    EXPECT_LT((A.transpose() * y - b).norm(), 1e-14 * condition) << k;
  }
  EXPECT_GT(negative, 5);
  EXPECT_LT(negative, 35);
}

TEST(SparseLuFactors, ChooseNewPivotsWhereTheOldOnesVanish) {
  // [ε 1; 1 0]: the pivot of ε = 1 does not serve for ε = 1e-18.
  const auto matrix = [](double corner) {
    SparseLu::Matrix A(2, 2);
    A.insert(0, 0) = corner;
    A.insert(0, 1) = 1.0;
    A.insert(1, 0) = 1.0;
    A.insert(1, 1) = 1e-3;
    A.makeCompressed();
    return A;
  };
  SparseLu lu;
  for (const double corner : {1.0, 1e-18, -1.0, 0.0}) {
    const SparseLu::Matrix A = matrix(corner);
    ASSERT_TRUE(lu.Factor(A)) << corner;
    VecX x(2);
    x << 1.0, 2.0;
    lu.Solve(&x);
    VecX b(2);
    b << 1.0, 2.0;
    EXPECT_LT((A * x - b).norm(), 1e-15) << corner;
    EXPECT_EQ(lu.determinant_sign(), corner * 1e-3 - 1.0 < 0 ? -1 : 1) << corner;
  }
}

TEST(SparseLuFactors, ASingularMatrixIsRefusedAndTheNextOneServed) {
  SparseLu lu;
  SparseLu::Matrix A(3, 3);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) A.insert(i, j) = 1.0;
  }
  A.makeCompressed();
  EXPECT_FALSE(lu.Factor(A));
  for (int i = 0; i < 3; ++i) A.coeffRef(i, i) = 3.0;
  ASSERT_TRUE(lu.Factor(A));
  EXPECT_EQ(lu.determinant_sign(), 1);
  EXPECT_NEAR(lu.PivotRatio(), (20.0 / 8.0) / 3.0, 1e-12);
  A.coeffRef(1, 1) = NAN;
  EXPECT_FALSE(lu.Factor(A));
}

// Rank r by r columns mixed.
MatX OfRank(int rows, int cols, int rank, unsigned seed) {
  std::srand(seed);
  return MatX::Random(rows, rank) * MatX::Random(rank, cols);
}

TEST(SparseRanks, FindRankAndNullSpaceAsSingularValuesDo) {
  for (const int rank : {0, 1, 7, 12, 20}) {
    const MatX dense = OfRank(20, 25, rank, static_cast<unsigned>(rank));
    const SparseRank qr(dense.sparseView(), 1e-9);
    EXPECT_EQ(qr.rank(), rank);
    EXPECT_TRUE(qr.clear()) << rank;
    const MatX N = qr.NullSpace();
    ASSERT_EQ(N.cols(), 25 - rank);
    EXPECT_LT((dense * N).norm(), 1e-12);
    EXPECT_EQ(N.colPivHouseholderQr().rank(), 25 - rank);
    // The columns kept span all.
    const std::vector<int> kept = qr.Independent();
    ASSERT_EQ(static_cast<int>(kept.size()), rank);
    if (rank == 0) continue;
    const Eigen::BDCSVD<MatX> svd(MatX(dense(Eigen::all, kept)));
    EXPECT_GT(svd.singularValues()[rank - 1], 1e-6);
    EXPECT_LT(qr.smallest_kept(), 1.5 * svd.singularValues()[rank - 1]);
    EXPECT_GT(qr.smallest_kept(), 0.5 * svd.singularValues()[rank - 1]);
  }
}

// The first columns come in pairs that nearly are the same: they span all, others do it well.
TEST(SparseRanks, ExchangeColumnsThatHardlySpanWhatOthersSpanWell) {
  std::srand(5);
  const MatX first = MatX::Random(20, 10), others = MatX::Random(20, 10);
  MatX dense(20, 30);
  dense << first, first + 1e-6 * MatX::Random(20, 10), others;
  const SparseRank qr(dense.sparseView(), 1e-9);
  ASSERT_EQ(qr.rank(), 20);
  const std::vector<int> firm = qr.FirmlyIndependent();
  const MatX kept = dense(Eigen::all, qr.Independent()), chosen = dense(Eigen::all, firm);
  ASSERT_EQ(chosen.cols(), 20);
  EXPECT_TRUE(std::ranges::is_sorted(firm));
  const auto smallest = [](const MatX& A) {
    return Eigen::BDCSVD<MatX>(A).singularValues().tail<1>()[0];
  };
  const auto largest_coefficient = [&](const MatX& A) {
    return MatX(A.partialPivLu().solve(dense)).cwiseAbs().maxCoeff();
  };
  EXPECT_LT(largest_coefficient(chosen), 2.0 + 1e-8);
  EXPECT_GT(smallest(chosen), 1e-2);
  EXPECT_GT(largest_coefficient(kept), 1e3);
  EXPECT_LT(smallest(kept), 1e-4);
  // Where those kept do it well they stay.
  const SparseRank good(MatX(MatX::Identity(8, 8)).sparseView(), 1e-9);
  EXPECT_EQ(good.FirmlyIndependent(), good.Independent());
}

TEST(SparseRanks, AreNotClearNearTheTolerance) {
  std::srand(3);
  const MatX dense = MatX::Random(12, 12);
  const Eigen::BDCSVD<MatX> svd(dense, Eigen::ComputeFullU | Eigen::ComputeFullV);
  for (const auto& [smallest, clear] :
       {std::pair{1e-3, true}, {1e-8, false}, {1e-9, false}, {1e-14, true}}) {
    VecX values = VecX::Ones(12);
    values[11] = smallest;
    const MatX J = svd.matrixU() * values.asDiagonal() * svd.matrixV().transpose();
    const SparseRank qr(J.sparseView(), 1e-9);
    EXPECT_EQ(qr.clear(), clear) << smallest;
    if (clear) {
      EXPECT_EQ(qr.rank(), smallest > 1e-9 ? 12 : 11);
    }
  }
}

// Thirty columns of 0.9e-9 each: every one counts as zero, a singular value of all of them does
// not.
TEST(SparseRanks, AreNotClearWhereManySmallEntriesAddUp) {
  MatX dense = MatX::Zero(40, 31);
  dense(0, 0) = 1.0;
  for (int c = 1; c < 31; ++c) dense(5, c) = 0.9e-9;
  const SparseRank qr(dense.sparseView(), 1e-9);
  EXPECT_EQ(qr.rank(), 1);
  EXPECT_FALSE(qr.clear());
  dense *= 0.1;
  dense(0, 0) = 1.0;
  EXPECT_TRUE(SparseRank(dense.sparseView(), 1e-9).clear());
  // As many in as many directions do not.
  MatX apart = MatX::Zero(40, 31);
  apart(0, 0) = 1.0;
  for (int c = 1; c < 31; ++c) apart(c + 5, c) = 0.4e-9;
  EXPECT_TRUE(SparseRank(apart.sparseView(), 1e-9).clear());
  apart(7, 2) = 0.9e-9;
  EXPECT_FALSE(SparseRank(apart.sparseView(), 1e-9).clear());
  // Nor do any where no column is left.
  MatX tall = MatX::Zero(40, 2);
  tall(0, 0) = tall(1, 1) = 1.0;
  tall.bottomRows(20).setConstant(0.9e-9);
  EXPECT_TRUE(SparseRank(tall.sparseView(), 1e-9).clear());
}

TEST(SparseLeastNorms, AreThoseOfTheDensePseudoInverse) {
  RandomMatrices matrices(18, 30);
  SparseLeastNorm solver;
  for (int k = 0; k < 10; ++k) {
    const SparseLu::Matrix A = matrices.Next();
    ASSERT_TRUE(solver.Factor(A, 1e-9));
    const Eigen::CompleteOrthogonalDecomposition<MatX> dense{MatX(A)};
    const Eigen::CompleteOrthogonalDecomposition<MatX> transposed{MatX(A).transpose()};
    const VecX b = matrices.Vector(18), c = matrices.Vector(30);
    EXPECT_LT((solver.LeastNorm(b) - dense.solve(b)).norm(), 1e-12) << k;
    EXPECT_LT((solver.LeastSquares(c) - transposed.solve(c)).norm(), 1e-12) << k;
  }
}

TEST(SparseLeastNorms, NeedRowsThatAreIndependent) {
  RandomMatrices matrices(6, 9);
  SparseLu::Matrix A = matrices.Next();
  MatX dense(A);
  dense.row(5) = dense.row(2) - 2.0 * dense.row(4);
  SparseLeastNorm solver;
  EXPECT_FALSE(solver.Factor(dense.sparseView(), 1e-9));
}

// Rows that are nearly dependent are so by one tolerance and not by another.
TEST(SparseLeastNorms, NeedRowsThatAreIndependentToTheTolerance) {
  RandomMatrices matrices(6, 9);
  MatX dense(matrices.Next());
  dense.row(5) = dense.row(2) - 2.0 * dense.row(4) + 1e-4 * MatX(matrices.Next()).row(5);
  SparseLeastNorm strict, loose;
  EXPECT_FALSE(strict.Factor(dense.sparseView(), 1e-3));
  EXPECT_TRUE(loose.Factor(dense.sparseView(), 1e-14));
}

// Forces between neighbours of a net of bodies, more than what holds them: three equations a body,
// five forces a joint.
SparseLu::Matrix ForcesOfNet(int width) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Eigen::Triplet<double>> entries;
  int force = 0;
  const auto join = [&](int a, int b) {
    for (const int end = force + 5; force < end; ++force) {
      for (int c = 0; c < 3; ++c) {
        entries.emplace_back(3 * a + c, force, uniform(random));
        entries.emplace_back(3 * b + c, force, uniform(random));
      }
    }
  };
  for (int i = 0; i < width; ++i) {
    for (int j = 0; j < width; ++j) {
      if (i + 1 < width) join(width * i + j, width * (i + 1) + j);
      if (j + 1 < width) join(width * i + j, width * i + j + 1);
    }
  }
  SparseLu::Matrix A(3 * width * width, force);
  A.setFromTriplets(entries.begin(), entries.end());
  return A;
}

// Bytes that work() leaves allocated: factors above all.
template <typename Work>
double BytesOf(const Work& work) {
  const auto in_use = [] {
    const struct mallinfo2 now = mallinfo2();
    return static_cast<double>(now.uordblks + now.hblkhd);
  };
  const double before = in_use();
  work();
  return in_use() - before;
}

// By columns alone, or by the pattern of the matrix and its transpose, they are several times as
// large.
TEST(SparseFactors, OfNetsAreSmall) {
  const SparseLu::Matrix A = ForcesOfNet(20);
  SparseLeastNorm least;
  EXPECT_LT(BytesOf([&] { ASSERT_TRUE(least.Factor(A, 0.0)); }), 16e6);
}

TEST(SparseFactors, OfNetsSolveAsDenseOnes) {
  const SparseLu::Matrix A = ForcesOfNet(6);
  SparseLeastNorm least;
  ASSERT_TRUE(least.Factor(A, 0.0));
  VecX b(A.rows());
  for (Eigen::Index k = 0; k < b.size(); ++k) b[k] = std::sin(1.7 * static_cast<double>(k));
  const VecX dense = MatX(A).completeOrthogonalDecomposition().solve(b);
  EXPECT_LT((least.LeastNorm(b) - dense).norm(), 1e-11 * dense.norm());
}

// Columns that depend on each other in a row: whichever is dropped, from the one end or the other
// the rest is nearly singular, and the matrix is not.
TEST(SparseRanks, AreClearWhateverColumnIsDropped) {
  constexpr int kRows = 60;
  for (const double ratio : {1.5, 1.0 / 1.5}) {
    std::vector<Eigen::Triplet<double>> entries;
    for (int i = 0; i < kRows; ++i) {
      entries.emplace_back(i, i, 1.0);
      entries.emplace_back(i, i + 1, -ratio);
    }
    SparseRank::Matrix A(kRows, kRows + 1);
    A.setFromTriplets(entries.begin(), entries.end());
    const SparseRank ranks(A, 1e-9);
    EXPECT_EQ(ranks.rank(), kRows);
    EXPECT_TRUE(ranks.clear()) << ratio;
    const double least = Eigen::JacobiSVD<MatX>(MatX(A)).singularValues()[kRows - 1];
    EXPECT_LT(ranks.smallest_kept(), 1.5 * least) << ratio;
  }
}

// Wide ones by A Aᵀ, whose condition is the square of A's.
TEST(SparseFactors, OfWideNetsSolveAsDenseOnes) {
  SparseLu::Matrix A = ForcesOfNet(9);
  VecX b(A.rows()), c(A.cols());
  for (Eigen::Index k = 0; k < b.size(); ++k) b[k] = std::sin(1.7 * static_cast<double>(k));
  for (Eigen::Index k = 0; k < c.size(); ++k) c[k] = std::cos(0.9 * static_cast<double>(k));
  SparseLeastNorm least;
  double weakest = 1.0;  // of an equation, against the others
  for (const double weaker : {1.0, 1e-3, 1e-2}) {
    weakest *= weaker;
    for (Eigen::Index k = 0; k < A.cols(); ++k) {
      for (SparseLu::Matrix::InnerIterator entry(A, k); entry; ++entry) {
        if (entry.row() == 7) entry.valueRef() *= weaker;
      }
    }
    const double rounding = 1e-12 + 100 * kEps / weakest;
    ASSERT_TRUE(least.Factor(A, 0.0));
    const MatX dense(A);
    const VecX x = dense.completeOrthogonalDecomposition().solve(b);
    EXPECT_LT((least.LeastNorm(b) - x).norm(), rounding * x.norm()) << weakest;
    const VecX y = MatX(dense.transpose()).completeOrthogonalDecomposition().solve(c);
    for (const int refinements : {0, 1}) {
      EXPECT_LT((least.LeastSquares(c, refinements) - y).norm(), rounding * y.norm()) << weakest;
    }
  }
}

// Of C where G x = 0, dense: all of them, and the vectors.
Eigen::JacobiSVD<MatX> DenseUnder(const MatX& C, const MatX& G) {
  const Eigen::FullPivLU<MatX> lu(G);
  const MatX N = MatX(lu.kernel()).householderQr().householderQ() *
                 MatX::Identity(G.cols(), G.cols() - G.rows());
  return Eigen::JacobiSVD<MatX>(MatX(C * N), Eigen::ComputeThinV);
}

TEST(LeastSingularValue, IsThatOfTheDenseMatrix) {
  RandomMatrices of_C(40, 60), of_G(25, 60);
  for (int k = 0; k < 20; ++k) {
    SparseLu::Matrix C = of_C.Next();
    const SparseLu::Matrix G = of_G.Next();
    const double expected = DenseUnder(C, G).singularValues()[34];
    const auto least = [&] {
      return LeastSingular(SparseLu::Matrix(C.transpose()), SparseLu::Matrix(G.transpose()));
    };
    const SingularPair found = least();
    ASSERT_TRUE(found.converged) << k;
    EXPECT_NEAR(found.value, expected, 1e-9 * expected) << k;
    EXPECT_NEAR(found.vector.norm(), 1.0, 1e-12);
    EXPECT_LT((G * found.vector).norm(), 1e-11) << k;
    EXPECT_NEAR((C * found.vector).norm(), expected, 1e-9 * expected) << k;
    // Another matrix has another one.
    C *= 1.0 + 1e-7;
    EXPECT_GT(std::abs(least().value - expected), 5e-8 * expected) << k;
  }
}

TEST(LeastSingularValue, IsFoundWhereItIsZeroOrOneOfMany) {
  // Zero: the last row repeats the first.
  MatX dense = MatX(RandomMatrices(12, 12).Next());
  dense.row(11) = dense.row(0);
  const SparseLu::Matrix none(12, 0);
  const SingularPair zero = LeastSingular(SparseLu::Matrix(dense.transpose().sparseView()), none);
  EXPECT_TRUE(zero.converged);
  EXPECT_LT(zero.value, 1e-12);
  EXPECT_LT((dense * zero.vector).norm(), 1e-12);
  // Many: half of the 400 singular values are 0.3, the others lie close above.
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < 400; ++i) {
    const double beyond = i % 2 == 0 ? 0.0 : 1e-6 * i;
    entries.emplace_back(i, (7 * i + 3) % 400, 0.3 * (1.0 + beyond));
  }
  SparseLu::Matrix C(400, 400);
  C.setFromTriplets(entries.begin(), entries.end());
  const SingularPair many = LeastSingular(C, SparseLu::Matrix(400, 0));
  EXPECT_TRUE(many.converged);
  EXPECT_NEAR(many.value, 0.3, 1e-10);
}

TEST(LeastSingularValue, LeavesOutWhatIsProjectedAway) {
  const MatX dense = MatX(RandomMatrices(30, 30).Next());
  const Eigen::JacobiSVD<MatX> svd(dense, Eigen::ComputeThinV);
  const MatX away = svd.matrixV().rightCols(3);
  const SingularPair found =
      LeastSingular(SparseLu::Matrix(dense.transpose().sparseView()), SparseLu::Matrix(30, 0),
                    [&](VecX* x) { *x -= away * (away.transpose() * *x).eval(); });
  EXPECT_NEAR(found.value, svd.singularValues()[26], 1e-10);
}

}  // namespace
}  // namespace mbv
