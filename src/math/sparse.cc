#include "math/sparse.h"

#include <suitesparse/klu.h>
#include <Eigen/OrderingMethods>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "base/demand.h"

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
  // The order of elimination of a pattern, which only reads it.
  struct Analysis {
    Analysis() = default;
    ~Analysis() {
      klu_common common{};
      klu_defaults(&common);
      if (symbolic != nullptr) klu_free_symbolic(&symbolic, &common);
    }
    Analysis(const Analysis&) = delete;
    Analysis& operator=(const Analysis&) = delete;

    [[nodiscard]] bool IsOf(std::span<const int> other_columns, std::span<const int> other_rows,
                            size_t other_ordering) const {
      return ordering == other_ordering && std::ranges::equal(columns, other_columns) &&
             std::ranges::equal(rows, other_rows);
    }

    std::vector<int> columns, rows;
    size_t ordering = 0;
    klu_symbolic* symbolic = nullptr;
  };

  explicit Factors(Pivots pivots) {
    klu_defaults(&common);
    const bool diagonal = pivots == Pivots::kDiagonal;
    common.tol = diagonal ? 0.0 : kPivotTolerance;
    // AMD of A + Aᵀ, or COLAMD: where pivots move, the former fills nets of loops ten times as
    // much.
    common.ordering = diagonal ? 0 : 1;
    common.scale = -1;  // rows and columns come in units that suit them
  }
  ~Factors() { Clear(); }
  Factors(const Factors&) = delete;
  Factors& operator=(const Factors&) = delete;

  void Clear() {
    if (numeric != nullptr) klu_free_numeric(&numeric, &common);
    analysis.reset();
  }
  // Each pose of a study has the patterns of the pose before.
  void Analyse(int* columns, int* rows) {
    thread_local std::array<std::shared_ptr<Analysis>, 4> known;
    thread_local size_t next = 0;
    const std::span<const int> starts(columns, static_cast<size_t>(n) + 1);
    const std::span<const int> places(rows, static_cast<size_t>(columns[n]));
    const auto ordering = static_cast<size_t>(common.ordering);
    for (const auto& one : known) {
      if (one != nullptr && one->IsOf(starts, places, ordering)) analysis = one;
    }
    if (analysis == nullptr) {
      analysis = std::make_shared<Analysis>();
      analysis->columns.assign(starts.begin(), starts.end());
      analysis->rows.assign(places.begin(), places.end());
      analysis->ordering = ordering;
      analysis->symbolic = klu_analyze(n, columns, rows, &common);
      known[next++ % known.size()] = analysis;
    }
  }
  [[nodiscard]] klu_symbolic* symbolic() const {
    return analysis == nullptr ? nullptr : analysis->symbolic;
  }
  [[nodiscard]] bool FactorAnew(int* columns, int* rows, double* values) {
    if (numeric != nullptr) klu_free_numeric(&numeric, &common);
    numeric = klu_factor(columns, rows, values, symbolic(), &common);
    if (numeric == nullptr) return false;
    sign = SignOf(numeric->Pnum, n, &seen) * SignOf(symbolic()->Q, n, &seen);
    chosen = Eigen::Map<const VecX>(pivots(), n).cwiseAbs();
    return true;
  }
  [[nodiscard]] bool FactorAgain(int* columns, int* rows, double* values) {
    if (numeric == nullptr) return false;
    if (klu_refactor(columns, rows, values, symbolic(), numeric, &common) == 0) return false;
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
  std::shared_ptr<Analysis> analysis;
  klu_numeric* numeric = nullptr;
  int n = 0, sign = 1;  // sign: of both permutations
  VecX chosen;          // sizes of the pivots when they were chosen
  std::vector<char> seen;
};

SparseLu::SparseLu(Pivots pivots) : factors_(std::make_unique<Factors>(pivots)) {}
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
  if (f.symbolic() == nullptr) {
    f.n = static_cast<int>(A.cols());
    if (f.n == 0) return true;
    f.Analyse(columns, rows);
    if (f.symbolic() == nullptr) return false;
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

double SparseLu::entries() const {
  const Factors& f = *factors_;
  if (f.numeric == nullptr) return 0.0;
  return static_cast<double>(f.numeric->lnz) + static_cast<double>(f.numeric->unz);
}

void SparseLu::Solve(VecX* b) const {
  Factors& f = *factors_;
  if (f.n == 0) return;
  MBV_DEMAND(f.numeric != nullptr && b->size() == f.n, b->size());
  klu_solve(f.symbolic(), f.numeric, f.n, 1, b->data(), &f.common);
}

void SparseLu::SolveTransposed(VecX* b) const {
  Factors& f = *factors_;
  if (f.n == 0) return;
  MBV_DEMAND(f.numeric != nullptr && b->size() == f.n, b->size());
  klu_tsolve(f.symbolic(), f.numeric, f.n, 1, b->data(), &f.common);
}

namespace {

// How far the estimated smallest singular value must be above the tolerance.
constexpr double kClear = 100.0;
// Inverse iterations that estimate a singular value.
constexpr int kIterations = 6;
// Of columns that are combinations of those chosen; and as many coefficients are looked at.
constexpr double kLargestCoefficient = 2.0;
constexpr Eigen::Index kMostCoefficients = 25'000'000;

// `solve` is x → (R Rᵀ)⁻¹x.
template <typename Solve>
double SmallestByInverse(Eigen::Index size, const Solve& solve) {
  VecX x(size);
  for (Eigen::Index i = 0; i < x.size(); ++i) {
    x[i] = 1.0 + 0.5 * std::sin(1.7 * static_cast<double>(i));  // a share in every direction
  }
  double sigma = 0.0;
  for (int i = 0; i < kIterations; ++i) {
    x.normalize();
    solve(&x);
    sigma = 1.0 / std::sqrt(x.norm());
  }
  return std::isfinite(sigma) ? sigma : 0.0;
}

// Twice the largest |A N x| / |N x|, by power iteration.
double LargestBeyond(const MatX& AN, const MatX& N) {
  constexpr int kPowerSteps = 20;
  MatX squares = MatX::Zero(N.cols(), N.cols());
  squares.selfadjointView<Eigen::Lower>().rankUpdate(N.transpose());
  const Eigen::LLT<MatX> factors(squares);
  VecX x(N.cols());
  for (Eigen::Index i = 0; i < x.size(); ++i) x[i] = std::cos(0.7 * static_cast<double>(i * i));
  double largest = 0.0;
  for (int i = 0; i < kPowerSteps; ++i) {
    const VecX image = AN * x;
    largest = image.norm() / VecX(N * x).norm();
    x = factors.solve(AN.transpose() * image);
    if (!(x.norm() > 0.0)) break;
    x.normalize();
  }
  return 2.0 * largest;
}

double LongestColumn(const SparseRank::Matrix& A) {
  double longest = 0.0;
  for (int c = 0; c < A.cols(); ++c) longest = std::max(longest, A.col(c).norm());
  return longest;
}

// Sums of two sparse rows, (c x + s y, −s x + c y).
template <typename Row>
std::pair<Row, Row> Rotated(const Row& x, const Row& y, double c, double s) {
  std::pair<Row, Row> out;
  out.first.reserve(x.size() + y.size());
  out.second.reserve(x.size() + y.size());
  auto a = x.begin();
  auto b = y.begin();
  while (a != x.end() || b != y.end()) {
    const bool in_x = a != x.end() && (b == y.end() || a->first <= b->first);
    const bool in_y = b != y.end() && (a == x.end() || b->first <= a->first);
    const int at = in_x ? a->first : b->first;
    const double from_x = in_x ? (a++)->second : 0.0, from_y = in_y ? (b++)->second : 0.0;
    out.first.emplace_back(at, c * from_x + s * from_y);
    out.second.emplace_back(at, c * from_y - s * from_x);
  }
  out.second.erase(out.second.begin());  // rotated away
  return out;
}

}  // namespace

SparseRank::SparseRank(const Matrix& A, double tolerance) {
  limit_ = tolerance * LongestColumn(A);
  Order(A);
  R_.resize(order_.size());
  std::vector<int> place(order_.size());
  for (size_t k = 0; k < order_.size(); ++k)
    place[static_cast<size_t>(order_[k])] = static_cast<int>(k);
  const Eigen::SparseMatrix<double, Eigen::RowMajor> by_rows = A;
  std::vector<Row> rows;
  for (int i = 0; i < by_rows.rows(); ++i) {
    Row row;
    for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator entry(by_rows, i); entry;
         ++entry) {
      row.emplace_back(place[static_cast<size_t>(entry.col())], entry.value());
    }
    std::sort(row.begin(), row.end());
    if (!row.empty()) rows.push_back(std::move(row));
  }
  // Rows that reach least far to the right first: what is rotated stays short.
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.back().first < b.back().first; });
  for (Row& row : rows) Eliminate(std::move(row));
  for (size_t place = 0; place < R_.size(); ++place) {
    (R_[place].empty() ? dropped_ : kept_).push_back(static_cast<int>(place));
  }
  Arrange();
  if (clear_ || !(smallest_kept_ > kClear * std::max(limit_, dropped_norm_))) return;
  // Many small entries have a large norm together, and may have no large singular value: what A
  // does to its null space bounds all of these beyond the rank.
  if (dropped_.empty()) {
    dropped_norm_ = 0.0;
    clear_ = true;
    return;
  }
  const MatX D = Coefficients();
  if (D.size() == 0) return;
  MatX N = MatX::Zero(A.cols(), D.cols());
  for (size_t k = 0; k < kept_.size(); ++k) {
    N.row(order_[static_cast<size_t>(kept_[k])]) = -D.row(static_cast<Eigen::Index>(k));
  }
  for (size_t k = 0; k < dropped_.size(); ++k) {
    N(order_[static_cast<size_t>(dropped_[k])], static_cast<Eigen::Index>(k)) = 1.0;
  }
  dropped_norm_ = std::min(dropped_norm_, LargestBeyond(A * N, N));
  clear_ = dropped_norm_ <= limit_;
}

void SparseRank::Order(const Matrix& A) {
  order_.resize(static_cast<size_t>(A.cols()));
  if (A.cols() == 0) return;
  const Matrix pattern = Matrix(A.transpose()) * A;
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> permutation;
  Eigen::AMDOrdering<int>()(pattern, permutation);
  for (Eigen::Index k = 0; k < A.cols(); ++k) {
    order_[static_cast<size_t>(k)] = permutation.indices()[k];
  }
}

// Rotates the row into R until nothing is left of it. Pivots only grow.
void SparseRank::Eliminate(Row row) {
  while (!row.empty()) {
    const auto [place, entry] = row.front();
    if (std::abs(entry) <= limit_) {
      dropped_norm_ = std::hypot(dropped_norm_, entry);
      row.erase(row.begin());
      continue;
    }
    Row& pivot = R_[static_cast<size_t>(place)];
    if (pivot.empty()) {
      pivot = std::move(row);
      return;
    }
    const double r = std::hypot(pivot.front().second, entry);
    auto [rotated, rest] = Rotated(pivot, row, pivot.front().second / r, entry / r);
    pivot = std::move(rotated);
    row = std::move(rest);
  }
}

void SparseRank::Arrange() {
  std::vector<int> within(R_.size(), -1);  // the place among those kept, or those dropped
  for (size_t k = 0; k < kept_.size(); ++k)
    within[static_cast<size_t>(kept_[k])] = static_cast<int>(k);
  for (size_t k = 0; k < dropped_.size(); ++k)
    within[static_cast<size_t>(dropped_[k])] = static_cast<int>(k);
  std::vector<Eigen::Triplet<double>> square, rest;
  for (size_t k = 0; k < kept_.size(); ++k) {
    const Row& row = R_[static_cast<size_t>(kept_[k])];
    for (const auto& [place, entry] : row) {
      const bool is_kept = !R_[static_cast<size_t>(place)].empty();
      (is_kept ? square : rest)
          .emplace_back(static_cast<int>(k), within[static_cast<size_t>(place)], entry);
    }
  }
  const auto n = static_cast<Eigen::Index>(kept_.size());
  R_kept_.resize(n, n);
  R_kept_.setFromTriplets(square.begin(), square.end());
  R_dropped_.resize(n, static_cast<Eigen::Index>(dropped_.size()));
  R_dropped_.setFromTriplets(rest.begin(), rest.end());
  R_.clear();
  const auto clear = [&] { return n == 0 || smallest_kept_ > kClear * limit_; };
  smallest_kept_ = SmallestSingularValue();
  if (!clear()) smallest_kept_ = std::max(smallest_kept_, SmallestOfAll());
  clear_ = dropped_norm_ <= limit_ && clear();
}

std::vector<int> SparseRank::ColumnsAt(const std::vector<int>& places) const {
  std::vector<int> columns;
  columns.reserve(places.size());
  for (const int place : places) columns.push_back(order_[static_cast<size_t>(place)]);
  std::sort(columns.begin(), columns.end());
  return columns;
}

std::vector<int> SparseRank::Independent() const { return ColumnsAt(kept_); }

// With K the columns kept and D = K⁻¹ (those dropped), exchanging column i of K for dropped column
// j multiplies the volume of K by |D_ij|: pivots of Gauss and Jordan on D.
std::vector<int> SparseRank::FirmlyIndependent() const {
  MatX D = Coefficients();
  if (D.size() == 0) return Independent();
  const Eigen::Index rank = D.rows(), rest = D.cols();
  std::vector<int> chosen = kept_, others = dropped_;
  for (Eigen::Index exchanges = 0; exchanges < rank + rest; ++exchanges) {
    Eigen::Index i = 0, j = 0;
    if (!(D.cwiseAbs().maxCoeff(&i, &j) > kLargestCoefficient)) break;
    std::swap(chosen[static_cast<size_t>(i)], others[static_cast<size_t>(j)]);
    const double pivot = D(i, j);
    const VecX column = D.col(j), row = D.row(i).transpose() / pivot;
    for (Eigen::Index k = 0; k < rest; ++k) {
      if (row[k] != 0.0) D.col(k) -= row[k] * column;
    }
    D.row(i) = row.transpose();
    D.col(j) = -column / pivot;
    D(i, j) = 1.0 / pivot;
  }
  return ColumnsAt(chosen);
}

double SparseRank::SmallestSingularValue() const {
  return SmallestByInverse(R_kept_.cols(), [this](VecX* x) {
    R_kept_.triangularView<Eigen::Upper>().solveInPlace(*x);
    R_kept_.transpose().triangularView<Eigen::Lower>().solveInPlace(*x);
  });
}

// Of R with what is dropped beside it, whichever columns those are: with K the columns kept and
// D = K⁻¹ (those dropped),  R Rᵀ = K (1 + D Dᵀ) Kᵀ. Zero where that is too large.
double SparseRank::SmallestOfAll() const {
  const MatX D = Coefficients();
  if (D.size() == 0) return 0.0;
  MatX small = MatX::Identity(D.cols(), D.cols());
  small.selfadjointView<Eigen::Lower>().rankUpdate(D.transpose());
  const Eigen::LLT<MatX> factors(small);
  return SmallestByInverse(R_kept_.cols(), [&](VecX* x) {
    R_kept_.triangularView<Eigen::Upper>().solveInPlace(*x);
    const VecX beside = factors.solve(D.transpose() * *x);
    x->noalias() -= D * beside;
    R_kept_.transpose().triangularView<Eigen::Lower>().solveInPlace(*x);
  });
}

MatX SparseRank::Coefficients() const {
  const auto rank = static_cast<Eigen::Index>(kept_.size());
  const auto rest = static_cast<Eigen::Index>(dropped_.size());
  if (rank == 0 || rest == 0 || rank > kMostCoefficients / rest) return {};
  MatX D(R_dropped_);
  R_kept_.triangularView<Eigen::Upper>().solveInPlace(D);
  return D;
}

MatX SparseRank::NullSpace() const {
  MatX N = MatX::Zero(static_cast<Eigen::Index>(order_.size()),
                      static_cast<Eigen::Index>(dropped_.size()));
  for (size_t k = 0; k < dropped_.size(); ++k) {
    const auto column = static_cast<Eigen::Index>(k);
    VecX balance = -VecX(R_dropped_.col(column));
    R_kept_.triangularView<Eigen::Upper>().solveInPlace(balance);
    for (size_t i = 0; i < kept_.size(); ++i) {
      N(order_[static_cast<size_t>(kept_[i])], column) = balance[static_cast<Eigen::Index>(i)];
    }
    N(order_[static_cast<size_t>(dropped_[k])], column) = 1.0;
    N.col(column).normalize();
  }
  return N;
}

VecX SparseRank::SolveNormal(const VecX& b) const {
  VecX kept(static_cast<Eigen::Index>(kept_.size()));
  const auto column = [this](Eigen::Index k) {
    return order_[static_cast<size_t>(kept_[static_cast<size_t>(k)])];
  };
  for (Eigen::Index k = 0; k < kept.size(); ++k) kept[k] = b[column(k)];
  R_kept_.transpose().triangularView<Eigen::Lower>().solveInPlace(kept);
  R_kept_.triangularView<Eigen::Upper>().solveInPlace(kept);
  VecX x = VecX::Zero(b.size());
  for (Eigen::Index k = 0; k < kept.size(); ++k) x[column(k)] = kept[k];
  return x;
}

namespace {

// Weight of the norm: about the smallest singular value of A, for which the condition of the whole
// is A's [Björck 1996, §2.5.2].
constexpr double kNormWeight = 0.05;

// Index of an entry of a compressed matrix that is there.
int PlaceOf(const SparseLu::Matrix& matrix, Eigen::Index row, Eigen::Index column) {
  const int* first = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column];
  const int* last = matrix.innerIndexPtr() + matrix.outerIndexPtr()[column + 1];
  return static_cast<int>(std::lower_bound(first, last, row) - matrix.innerIndexPtr());
}

template <typename Visit>
void ForEntries(const SparseLu::Matrix& matrix, const Visit& visit) {
  for (Eigen::Index c = 0; c < matrix.cols(); ++c) {
    for (SparseLu::Matrix::InnerIterator entry(matrix, c); entry; ++entry) visit(entry.row(), c);
  }
}

}  // namespace

void SparseSaddle::Reset() {
  K_.resize(0, 0);
  lu_.Reset();
}

void SparseSaddle::MakePattern(const Matrix& W, const Matrix& B_transposed) {
  const Eigen::Index n = W.cols(), size = n + B_transposed.cols();
  std::vector<Eigen::Triplet<double>> entries;
  ForEntries(W, [&](auto r, auto c) { entries.emplace_back(r, c, 0.0); });
  ForEntries(B_transposed, [&](auto r, auto c) {
    entries.emplace_back(r, n + c, 0.0);
    entries.emplace_back(n + c, r, 0.0);
  });
  K_.resize(size, size);
  K_.setFromTriplets(entries.begin(), entries.end());
  K_.makeCompressed();
  of_W_.clear();
  in_rows_.clear();
  in_columns_.clear();
  ForEntries(W, [&](auto r, auto c) { of_W_.push_back(PlaceOf(K_, r, c)); });
  ForEntries(B_transposed, [&](auto r, auto c) {
    in_columns_.push_back(PlaceOf(K_, n + c, r));
    in_rows_.push_back(PlaceOf(K_, r, n + c));
  });
}

bool SparseSaddle::Factor(const Matrix& W, const Matrix& B_transposed, double tolerance) {
  if (K_.cols() == 0) MakePattern(W, B_transposed);
  double* values = K_.valuePtr();
  for (size_t k = 0; k < of_W_.size(); ++k) values[of_W_[k]] = W.valuePtr()[k];
  for (size_t k = 0; k < in_rows_.size(); ++k) {
    values[in_columns_[k]] = B_transposed.valuePtr()[k];
    values[in_rows_[k]] = -B_transposed.valuePtr()[k];
  }
  return lu_.Factor(K_) && lu_.PivotRatio() > tolerance;
}

void SparseSaddle::Solve(const VecX& c, const VecX& b, VecX* x, VecX* y, int refinements) const {
  right_.resize(K_.cols());
  right_ << c, b;
  both_ = right_;
  lu_.Solve(&both_);
  for (int i = 0; i < refinements; ++i) {
    rest_ = right_;
    rest_.noalias() -= K_ * both_;
    lu_.Solve(&rest_);
    both_ += rest_;
  }
  *x = both_.head(c.size());
  *y = both_.tail(b.size());
}

namespace {

// A Aᵀ of fewer rows is not tried; it is taken where its factors are smaller by this.
constexpr Eigen::Index kFewRows = 50;
constexpr double kMuchSmaller = 2.0;
// Pivots of A Aᵀ: the rounding that its solutions have is their ratio's inverse, and squared by one
// refinement.
constexpr double kWellConditioned = 1e-8;

}  // namespace

void SparseLeastNorm::MakePattern(const SparseLu::Matrix& A) {
  weight_.resize(A.cols(), A.cols());
  weight_.setIdentity();
  weight_ *= kNormWeight;
  zero_cols_.setZero(A.cols());
  zero_rows_.setZero(A.rows());
  SparseLu::Matrix places = A;
  for (int k = 0; k < A.nonZeros(); ++k) places.valuePtr()[k] = k;
  A_ = places.transpose();
  from_.assign(A_.valuePtr(), A_.valuePtr() + A_.nonZeros());
  way_ = A.rows() > kFewRows ? Way::kUndecided : Way::kSaddle;
  normal_.Reset();
  if (way_ == Way::kSaddle) return;
  SparseLu::Matrix ones = A;  // nothing cancels
  std::fill_n(ones.valuePtr(), ones.nonZeros(), 1.0);
  squares_ = ones * SparseLu::Matrix(ones.transpose());
  squares_.makeCompressed();
  column_.setZero(A.rows());
}

bool SparseLeastNorm::FactorNormal(const SparseLu::Matrix& A) {
  double* out = squares_.valuePtr();
  for (Eigen::Index j = 0; j < squares_.cols(); ++j) {
    for (SparseLu::Matrix::InnerIterator along(A_, j); along; ++along) {
      for (SparseLu::Matrix::InnerIterator entry(A, along.row()); entry; ++entry) {
        column_[entry.row()] += entry.value() * along.value();
      }
    }
    for (SparseLu::Matrix::InnerIterator entry(squares_, j); entry; ++entry) {
      *out++ = column_[entry.row()];
      column_[entry.row()] = 0.0;
    }
  }
  return normal_.Factor(squares_) && normal_.PivotRatio() > kWellConditioned;
}

bool SparseLeastNorm::Factor(const SparseLu::Matrix& A, double tolerance) {
  if (weight_.cols() != A.cols() || A_.nonZeros() != A.nonZeros()) MakePattern(A);
  double* values = A_.valuePtr();
  for (const int from : from_) *values++ = A.valuePtr()[from];
  if (way_ == Way::kNormal && FactorNormal(A)) return true;
  const bool good = saddle_.Factor(weight_, A_, tolerance);
  if (way_ == Way::kSaddle) return good;
  const bool decide = way_ == Way::kUndecided;
  way_ = Way::kSaddle;
  if (decide && good && FactorNormal(A) && kMuchSmaller * normal_.entries() < saddle_.entries()) {
    way_ = Way::kNormal;
    saddle_.Reset();
  }
  return good;
}

// As SparseSaddle, with W = 1: y = (A Aᵀ)⁻¹(b − A c), x = c + Aᵀ y.
void SparseLeastNorm::SolveNormal(const VecX& c, const VecX& b, VecX* x, VecX* y,
                                  int refinements) const {
  rest_c_ = c;
  rest_b_ = b;
  x->setZero(c.size());
  y->setZero(b.size());
  const int most = std::max(refinements, 1);
  for (int i = 0;; ++i) {
    rest_b_.noalias() -= A_.transpose() * rest_c_;
    normal_.Solve(&rest_b_);
    *y += rest_b_;
    rest_c_.noalias() += A_ * rest_b_;
    *x += rest_c_;
    if (i == most) break;
    rest_c_ = c - *x;
    rest_c_.noalias() += A_ * *y;
    rest_b_ = b;
    rest_b_.noalias() -= A_.transpose() * *x;
  }
}

VecX SparseLeastNorm::LeastNorm(const VecX& b) const {
  VecX x;
  if (way_ == Way::kNormal) {
    SolveNormal(zero_cols_, b, &x, &y_, 1);
  } else {
    saddle_.Solve(zero_cols_, b, &x, &y_);
  }
  return x;
}

VecX SparseLeastNorm::LeastSquares(const VecX& c, int refinements) const {
  VecX y;
  if (way_ == Way::kNormal) {
    SolveNormal(c, zero_rows_, &x_, &y, refinements);
  } else {
    saddle_.Solve(c, zero_rows_, &x_, &y, refinements);
  }
  return -y;
}

SparseLu::Matrix SideBySide(const std::vector<const SparseLu::Matrix*>& parts) {
  Eigen::Index columns = 0, entries = 0;
  for (const SparseLu::Matrix* part : parts) {
    columns += part->cols();
    entries += part->nonZeros();
  }
  SparseLu::Matrix all(parts.front()->rows(), columns);
  all.reserve(entries);
  Eigen::Index at = 0;
  for (const SparseLu::Matrix* part : parts) {
    for (Eigen::Index c = 0; c < part->cols(); ++c, ++at) {
      all.startVec(at);
      for (SparseLu::Matrix::InnerIterator entry(*part, c); entry; ++entry) {
        all.insertBack(entry.row(), at) = entry.value();
      }
    }
  }
  all.finalize();
  return all;
}

namespace {

// Of the length of the longest row of C: what keeps the inverse finite where C loses a direction.
// Singular values change by its square only, and not those of the vectors found.
constexpr double kShift = 1e-5;
constexpr double kRitz = 1e-10;  // error of an eigenvalue, of itself
constexpr int kMostLanczos = 400;
constexpr int kOftenLanczos = 12;  // until then each step is judged, later each fourth

// With multipliers of (C x − s = 0, G x = 0):  min ½ |s|² + ½ μ² |x|² − bᵀx. (2)
class ShiftedInverse {
 public:
  ShiftedInverse(const SparseLu::Matrix& C_transposed, const SparseLu::Matrix& G_transposed)
      : n_(C_transposed.rows()), size_(n_ + C_transposed.cols()) {
    const double shift = kShift * LongestColumn(C_transposed);
    std::vector<Eigen::Triplet<double>> weights, rows;
    for (Eigen::Index i = 0; i < size_; ++i) {
      weights.emplace_back(i, i, i < n_ ? shift * shift : 1.0);
    }
    ForEntries(C_transposed, [&](auto r, auto c) {
      rows.emplace_back(r, c, C_transposed.valuePtr()[rows.size()]);
    });
    const auto entries = static_cast<Eigen::Index>(rows.size());
    ForEntries(G_transposed, [&](auto r, auto c) {
      const auto k = static_cast<Eigen::Index>(rows.size()) - entries;
      rows.emplace_back(r, C_transposed.cols() + c, G_transposed.valuePtr()[k]);
    });
    for (Eigen::Index c = 0; c < C_transposed.cols(); ++c) rows.emplace_back(n_ + c, c, -1.0);
    SparseLu::Matrix W(size_, size_), B(size_, C_transposed.cols() + G_transposed.cols());
    W.setFromTriplets(weights.begin(), weights.end());
    B.setFromTriplets(rows.begin(), rows.end());
    good_ = saddle_.Factor(W, B, 0.0);
    zero_.setZero(B.cols());
  }
  [[nodiscard]] bool good() const { return good_; }

  [[nodiscard]] VecX operator()(const VecX& b) const {
    VecX right = VecX::Zero(size_), x, y;
    right.head(n_) = b;
    saddle_.Solve(right, zero_, &x, &y);
    return x.head(n_);
  }

 private:
  Eigen::Index n_, size_;
  SparseSaddle saddle_;
  VecX zero_;
  bool good_ = false;
};

// A share in every direction.
VecX AnyVector(Eigen::Index size) {
  std::mt19937_64 random(20261130);
  VecX x(size);
  for (double& entry : x) entry = std::ldexp(static_cast<double>(random() >> 11), -52) - 1.0;
  return x;
}

}  // namespace

SingularPair LeastSingular(const SparseLu::Matrix& C_transposed,
                           const SparseLu::Matrix& G_transposed,
                           const std::function<void(VecX*)>& project) {
  SingularPair least;
  const ShiftedInverse inverse(C_transposed, G_transposed);
  if (!inverse.good()) return least;
  const auto apply = [&](const VecX& b) {
    VecX x = inverse(b);
    if (project) project(&x);
    return x;
  };
  std::vector<VecX> basis = {apply(apply(AnyVector(C_transposed.rows()))).normalized()};
  std::vector<double> diagonal, beside;
  VecX shares;  // of the basis in the vector of the largest eigenvalue
  for (int step = 0; step < kMostLanczos && !least.converged; ++step) {
    VecX next = apply(basis.back());
    if (!next.allFinite()) return least;
    diagonal.push_back(next.dot(basis.back()));
    for (int again = 0; again < 2; ++again) {
      for (const VecX& q : basis) next -= next.dot(q) * q;
    }
    beside.push_back(next.norm());
    const bool last = step + 1 == kMostLanczos || !(beside.back() > kEps * diagonal.front());
    if (last || step < kOftenLanczos || step % 4 == 0) {
      const auto size = static_cast<Eigen::Index>(diagonal.size());
      Eigen::SelfAdjointEigenSolver<MatX> ritz;
      ritz.computeFromTridiagonal(Eigen::Map<const VecX>(diagonal.data(), size),
                                  Eigen::Map<const VecX>(beside.data(), size - 1));
      shares = ritz.eigenvectors().col(size - 1);
      const double largest = ritz.eigenvalues()[size - 1];
      const double residual = beside.back() * std::abs(shares[size - 1]);
      const double gap = size < 2 ? 0.0 : largest - ritz.eigenvalues()[size - 2] - residual;
      const double error = gap > 0.0 ? std::min(residual, residual * residual / gap) : residual;
      least.converged = error <= kRitz * largest || !(beside.back() > kEps * largest);
    }
    if (last) break;
    if (!least.converged) basis.push_back(next / beside.back());
  }
  least.vector.setZero(C_transposed.rows());
  for (Eigen::Index k = 0; k < shares.size(); ++k) {
    least.vector += shares[k] * basis[static_cast<size_t>(k)];
  }
  // Once more: what the iteration leaves of large singular values counts most in the value.
  least.vector = apply(least.vector).normalized();
  least.value = (C_transposed.transpose() * least.vector).norm();
  return least;
}

}  // namespace mbv
