#include "core/sparse_lu.h"

#include <suitesparse/klu.h>

#include <cmath>
#include <vector>

#include "core/demand.h"

namespace mbv {
namespace {

// A pivot may be this much smaller than the largest entry of its column.
constexpr double kPivotTolerance = 0.1;
// Pivots chosen for another matrix serve while none is smaller by this than it was there: with 1e-3
// the inverse dynamics of a SCARA robot's pick and place loses two digits.
constexpr double kSmaller = 0.1;

// Sign of a permutation, by its cycles.
int SignOf(const int* to, int n, std::vector<char>* seen) {
  seen->assign(static_cast<size_t>(n), 0);
  int sign = 1;
  for (int i = 0; i < n; ++i) {
    for (int j = i; !(*seen)[static_cast<size_t>(j)]; j = to[j]) {
      (*seen)[static_cast<size_t>(j)] = 1;
      if (to[j] != i) sign = -sign;
    }
  }
  return sign;
}

}  // namespace

// KLU takes pointers to what it does not change without const.
struct SparseLu::Factors {
  Factors() {
    klu_defaults(&common);
    common.tol = kPivotTolerance;
    common.scale = -1;  // rows and columns come in units that suit them
  }
  ~Factors() { Clear(); }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;

  void Clear() {
    if (numeric != nullptr) klu_free_numeric(&numeric, &common);
    if (symbolic != nullptr) klu_free_symbolic(&symbolic, &common);
  }
  [[nodiscard]] bool FactorAnew(int* columns, int* rows, double* values) {
    if (numeric != nullptr) klu_free_numeric(&numeric, &common);
    numeric = klu_factor(columns, rows, values, symbolic, &common);
    if (numeric == nullptr) return false;
    sign = SignOf(numeric->Pnum, n, &seen) * SignOf(symbolic->Q, n, &seen);
    chosen = Eigen::Map<const VecX>(pivots(), n).cwiseAbs();
    return true;
  }
  [[nodiscard]] bool FactorAgain(int* columns, int* rows, double* values) {
    if (numeric == nullptr) return false;
    if (klu_refactor(columns, rows, values, symbolic, numeric, &common) == 0) return false;
    for (int k = 0; k < n; ++k) {
      if (!(std::abs(pivots()[k]) > kSmaller * chosen[k])) return false;
    }
    return true;
  }
  [[nodiscard]] bool IsRegular() const {
    for (int k = 0; k < n; ++k) {
      if (pivots()[k] == 0.0 || !std::isfinite(pivots()[k])) return false;
    }
    return true;
  }
  [[nodiscard]] const double* pivots() const { return static_cast<double*>(numeric->Udiag); }

  klu_common common{};
  klu_symbolic* symbolic = nullptr;
  klu_numeric* numeric = nullptr;
  int n = 0, sign = 1;  // sign: of both permutations
  VecX chosen;          // sizes of the pivots when they were chosen
  std::vector<char> seen;
};

SparseLu::SparseLu() : factors_(std::make_unique<Factors>()) {}
SparseLu::~SparseLu() = default;
SparseLu::SparseLu(SparseLu&&) noexcept = default;
SparseLu& SparseLu::operator=(SparseLu&&) noexcept = default;

void SparseLu::Reset() { factors_->Clear(); }

bool SparseLu::Factor(const Matrix& A) {
  MBV_DEMAND(A.rows() == A.cols() && A.isCompressed(), A.rows());
  Factors& f = *factors_;
  auto* columns = const_cast<int*>(A.outerIndexPtr());
  auto* rows = const_cast<int*>(A.innerIndexPtr());
  auto* values = const_cast<double*>(A.valuePtr());
  if (f.symbolic == nullptr) {
    f.n = static_cast<int>(A.cols());
    if (f.n == 0) return true;
    f.symbolic = klu_analyze(f.n, columns, rows, &f.common);
    if (f.symbolic == nullptr) return false;
  }
  MBV_DEMAND(f.n == A.cols(), A.cols());
  if (f.FactorAgain(columns, rows, values)) return f.IsRegular();
  return f.FactorAnew(columns, rows, values) && f.IsRegular();
}

int SparseLu::determinant_sign() const {
  int sign = factors_->sign;
  if (factors_->numeric == nullptr) return sign;
  for (int k = 0; k < factors_->n; ++k) {
    if (factors_->pivots()[k] < 0.0) sign = -sign;
  }
  return sign;
}

double SparseLu::PivotRatio() const {
  if (factors_->n == 0) return 1.0;
  MBV_DEMAND(factors_->numeric != nullptr, factors_->n);
  const auto sizes = Eigen::Map<const VecX>(factors_->pivots(), factors_->n).cwiseAbs();
  return sizes.minCoeff() / sizes.maxCoeff();
}

void SparseLu::Solve(VecX* b) const {
  Factors& f = *factors_;
  if (f.n == 0) return;
  MBV_DEMAND(f.numeric != nullptr && b->size() == f.n, b->size());
  klu_solve(f.symbolic, f.numeric, f.n, 1, b->data(), &f.common);
}

void SparseLu::SolveTransposed(VecX* b) const {
  Factors& f = *factors_;
  if (f.n == 0) return;
  MBV_DEMAND(f.numeric != nullptr && b->size() == f.n, b->size());
  klu_tsolve(f.symbolic, f.numeric, f.n, 1, b->data(), &f.common);
}

}  // namespace mbv
