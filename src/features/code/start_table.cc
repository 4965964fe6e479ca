#include "features/code/code.h"

#include <fmt/format.h>
#include <Eigen/LU>
#include <algorithm>
#include <boost/numeric/interval.hpp>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <optional>

namespace mbv {
namespace {

// An interval that holds the results of exact arithmetic: rounded outwards, library functions
// widened beyond their errors.
class Interval {
 public:
  // While a Guard lives, the processor rounds as these operations need it.
  using Protected =
      boost::numeric::interval<double,
                               boost::numeric::interval_lib::policies<
                                   boost::numeric::interval_lib::save_state<
                                       boost::numeric::interval_lib::rounded_transc_opp<double>>,
                                   boost::numeric::interval_lib::checking_base<double>>>;
  using Base = boost::numeric::interval_lib::unprotect<Protected>::type;
  using Guard = Protected::traits_type::rounding;
  Interval() = default;
  explicit Interval(double value) : in_(value) {}
  Interval(double low, double high) : in_(low, high) {}
  [[nodiscard]] double low() const { return in_.lower(); }
  [[nodiscard]] double high() const { return in_.upper(); }
  [[nodiscard]] double magnitude() const { return std::max(std::abs(low()), std::abs(high())); }
  friend Interval operator+(const Interval& a, const Interval& b) {
    return Interval(a.in_ + b.in_);
  }
  friend Interval operator-(const Interval& a, const Interval& b) {
    return Interval(a.in_ - b.in_);
  }
  friend Interval operator*(const Interval& a, const Interval& b) {
    return Interval(a.in_ * b.in_);
  }
  friend Interval operator/(const Interval& a, const Interval& b) {
    return Interval(a.in_ / b.in_);
  }
  friend Interval operator-(const Interval& a) { return Interval(-a.in_); }
  friend Interval sqrt(const Interval& a) {
    if (!(a.low() >= 0.0)) return All();
    return Interval(boost::numeric::sqrt(a.in_));
  }
  friend Interval sin(const Interval& a) {
    return Wave(a, std::sin(a.low()), std::sin(a.high()), 0.5);
  }
  friend Interval cos(const Interval& a) {
    return Wave(a, std::cos(a.low()), std::cos(a.high()), 0.0);
  }
  // No row of a loop has these.
  friend Interval exp(const Interval& /*a*/) { return All(); }
  friend Interval atan2(const Interval& /*a*/, const Interval& /*b*/) { return All(); }

 private:
  explicit Interval(const Base& in) : in_(in) {}
  static Interval All() { return Interval(Base::whole()); }
  // Sine or cosine, from its values at the ends; it has extremes at (k + shift) π, with the sign of
  // even and odd k.
  static Interval Wave(const Interval& a, double at_low, double at_high, double shift) {
    constexpr double kLibrary = 8.0 * kEps, kBeside = 1e-12;
    if (!(a.magnitude() < 1e3)) return {-1.0, 1.0};
    double low = std::min(at_low, at_high) - kLibrary, high = std::max(at_low, at_high) + kLibrary;
    const double first = std::ceil(a.low() / M_PI - shift - kBeside);
    const double last = std::floor(a.high() / M_PI - shift + kBeside);
    for (double k = first; k <= last; k += 1.0) {
      (std::fmod(std::abs(k), 2.0) == 0.0 ? high : low) =
          std::fmod(std::abs(k), 2.0) == 0.0 ? 1.0 : -1.0;
    }
    return {std::max(-1.0, low), std::min(1.0, high)};
  }
  Base in_;
};

constexpr size_t kLargestBlock = 8;  // second derivatives grow with its cube
constexpr double kConverged = 1e-12;
constexpr double kSameSolution = 1e-7;
constexpr int kLongWay = 64;      // steps of a walk
constexpr double kBound = 1e-12;  // of the error that is left

// Newton's method as the code does it.
class PoseFinder {
 public:
  explicit PoseFinder(const MechanismFormulas& formulas) : f_(formulas) {
    for (const ClosureBlock& block : f_.closure.blocks) {
      std::vector<Expr> rows = block.residual;
      rows.insert(rows.end(), block.columns.begin(), block.columns.end());
      tapes_.emplace_back(rows);
    }
    inputs_.resize(f_.graph.inputs(), 0.0);
  }

  void Place(const VecX& q, VecX* x) const {
    for (size_t k = 0; k < f_.size(); ++k) {
      if (f_.closure.direct[k] >= 0) {
        (*x)[f_.rates[static_cast<size_t>(f_.closure.direct[k])].x] =
            q[static_cast<Eigen::Index>(k)];
      }
    }
  }
  // From x to q.
  bool Find(const VecX& q, VecX* x) {
    Place(q, x);
    for (size_t b = 0; b < tapes_.size(); ++b) {
      double size = 1.0;
      for (int step = 0; step < 20 && size > kConverged; ++step) {
        size = Step(b, q, x);
        if (!(size < 0.5)) return false;
      }
      if (!(size <= kConverged * 1e3)) return false;
    }
    return true;
  }
  bool Walk(const VecX& from, const VecX& to, int parts, VecX* x) {
    for (int k = 1; k <= parts; ++k) {
      if (!Find(from + (to - from) * (static_cast<double>(k) / parts), x)) return false;
    }
    return true;
  }

 private:
  double Step(size_t b, const VecX& q, VecX* x) {
    const ClosureBlock& block = f_.closure.blocks[b];
    const auto m = static_cast<Eigen::Index>(block.rates.size());
    for (size_t i = 0; i < f_.x.size(); ++i)
      inputs_[f_.graph.InputOf(f_.x[i])] = (*x)[static_cast<Eigen::Index>(i)];
    for (size_t k = 0; k < f_.size(); ++k)
      inputs_[f_.graph.InputOf(f_.closure.q[k])] = q[static_cast<Eigen::Index>(k)];
    tapes_[b].Evaluate(inputs_, &work_, &values_);
    using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const Eigen::Map<const Rows> J(values_.data() + m, m, m);
    const VecX step = MatX(J).partialPivLu().solve(Eigen::Map<const VecX>(values_.data(), m));
    double size = 0.0;
    for (Eigen::Index i = 0; i < m; ++i) {
      const TreeRate& rate = f_.rates[static_cast<size_t>(block.rates[static_cast<size_t>(i)])];
      (*x)[rate.x] -= step[i];
      size = std::max(size, std::abs(step[i]) / (rate.length ? f_.length : 1.0));
      if (std::isnan(step[i])) return step[i];
    }
    return size;
  }

  const MechanismFormulas& f_;
  std::vector<FormulaTape> tapes_;
  std::vector<double> inputs_, work_, values_;
};

// Points of a grid over the box, the last coordinate fastest.
struct Grid {
  std::vector<int> counts;
  VecX low, step;
  Grid(const std::vector<int>& points, const VecX& from, const VecX& to)
      : counts(points), low(from), step(to - from) {
    for (size_t k = 0; k < counts.size(); ++k) step[static_cast<Eigen::Index>(k)] /= counts[k] - 1;
  }
  [[nodiscard]] int size() const {
    int all = 1;
    for (const int count : counts) all *= count;
    return all;
  }
  [[nodiscard]] std::vector<int> At(int index) const {
    std::vector<int> at(counts.size());
    for (size_t k = counts.size(); k-- > 0;) {
      at[k] = index % counts[k];
      index /= counts[k];
    }
    return at;
  }
  [[nodiscard]] int Index(const std::vector<int>& at) const {
    int index = 0;
    for (size_t k = 0; k < counts.size(); ++k) index = index * counts[k] + at[k];
    return index;
  }
  [[nodiscard]] VecX Point(const std::vector<int>& at) const {
    VecX point = low;
    for (size_t k = 0; k < at.size(); ++k)
      point[static_cast<Eigen::Index>(k)] += at[k] * step[static_cast<Eigen::Index>(k)];
    return point;
  }
  // Neighbours along one coordinate.
  [[nodiscard]] std::vector<int> Beside(int index) const {
    std::vector<int> beside;
    std::vector<int> at = At(index);
    for (size_t k = 0; k < at.size(); ++k) {
      for (const int by : {-1, 1}) {
        if (at[k] + by < 0 || at[k] + by >= counts[k]) continue;
        at[k] += by;
        beside.push_back(Index(at));
        at[k] -= by;
      }
    }
    return beside;
  }
};

// Rows of `values` at the corners of the cell from node `first` on, multilinear at q; and slopes.
VecX Multilinear(const Grid& grid, const MatX& values, const std::vector<int>& first, const VecX& q,
                 MatX* slopes) {
  const Eigen::Index n = q.size();
  const VecX part = (q - grid.Point(first)).cwiseQuotient(grid.step);
  VecX sum = VecX::Zero(values.cols());
  slopes->setZero(values.cols(), n);
  for (int corner = 0; corner < (1 << n); ++corner) {
    std::vector<int> at = first;
    VecX weight(n), sign(n);
    for (Eigen::Index k = 0; k < n; ++k) {
      const int upper = (corner >> k) & 1;
      at[static_cast<size_t>(k)] += upper;
      weight[k] = upper != 0 ? part[k] : 1.0 - part[k];
      sign[k] = upper != 0 ? 1.0 : -1.0;
    }
    const VecX node = values.row(grid.Index(at)).transpose();
    sum += weight.prod() * node;
    for (Eigen::Index k = 0; k < n; ++k) {
      double slope = sign[k] / grid.step[k];
      for (Eigen::Index j = 0; j < n; ++j) slope *= j == k ? 1.0 : weight[j];
      slopes->col(k) += slope * node;
    }
  }
  return sum;
}

// x at the nodes that are reached from home, from node to node; empty where not.
std::vector<std::optional<VecX>> PosesAt(const MechanismFormulas& f, PoseFinder* finder,
                                         const Grid& grid) {
  std::vector<std::optional<VecX>> poses(static_cast<size_t>(grid.size()));
  const VecX& home = f.closure.home;
  int nearest = 0;
  double distance = std::numeric_limits<double>::infinity();
  for (int i = 0; i < grid.size(); ++i) {
    const double to = (grid.Point(grid.At(i)) - home).norm();
    if (to < distance) distance = to, nearest = i;
  }
  VecX x = f.x_home;
  if (!finder->Walk(home, grid.Point(grid.At(nearest)), 64, &x)) return poses;
  poses[static_cast<size_t>(nearest)] = x;
  std::deque<int> next = {nearest};
  while (!next.empty()) {
    const int from = next.front();
    next.pop_front();
    for (const int to : grid.Beside(from)) {
      std::optional<VecX>& pose = poses[static_cast<size_t>(to)];
      if (pose) continue;
      x = *poses[static_cast<size_t>(from)];
      if (!finder->Walk(grid.Point(grid.At(from)), grid.Point(grid.At(to)), 16, &x)) continue;
      pose = x;
      next.push_back(to);
    }
  }
  return poses;
}

using IntervalMatrix = std::vector<Interval>;  // by rows

// Tapes of one block.
struct BlockTapes {
  FormulaTape residual, columns, others, by_q, second, bias;
  BlockTapes(const MechanismFormulas& f, const ClosureBlock& block)
      : residual(block.residual),
        columns(block.columns),
        others(block.others),
        by_q(ByQ(f, block)),
        second(Second(f, block)),
        bias(block.bias) {}
  static std::vector<Expr> ByQ(const MechanismFormulas& f, const ClosureBlock& block) {
    std::vector<Expr> all;
    for (size_t k = 0; k < f.size(); ++k) {
      const std::vector<Expr> column =
          FormulaGraph::Open().Derivatives(block.residual, {{f.closure.q[k], Expr(1.0)}});
      all.insert(all.end(), column.begin(), column.end());
    }
    return all;
  }
  // ∂(m × m columns)/∂y_k, k by k.
  static std::vector<Expr> Second(const MechanismFormulas& f, const ClosureBlock& block) {
    std::vector<Expr> all;
    for (const int k : block.rates) {
      const Expr y = f.x[static_cast<size_t>(f.rates[static_cast<size_t>(k)].x)];
      const std::vector<Expr> part =
          FormulaGraph::Open().Derivatives(block.columns, {{y, Expr(1.0)}});
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }
};

// What is proved of a cell.
struct ProvedCell {
  VecX centre;         // x at its centre
  MatX slopes;         // G: positions × coordinates, at the centre
  VecX radius;         // of x over the cell, beyond c + G (q − q_c)
  double error = 0.0;  // left after the steps
};

class CellProver {
 public:
  CellProver(const MechanismFormulas& formulas, PoseFinder* finder)
      : f_(formulas), finder_(*finder) {
    for (const ClosureBlock& block : f_.closure.blocks) tapes_.emplace_back(f_, block);
    std::vector<Expr> factors, bias;
    for (const ActuatorFormula& actuator : f_.actuators) {
      bias.push_back(actuator.bias);
      for (const auto& [rate, factor] : actuator.rates) factors.push_back(factor);
    }
    factors_.emplace(factors);
    actuator_bias_.emplace(bias);
  }

  // ∂_i ∂_j of the actuators' positions over the cell that was proved last, actuator by actuator.
  // Along w = ∂x/∂q_i or the sum of two of them, J s = −γ(x, w) gives the second derivative s.
  std::optional<std::vector<Interval>> Seconds() {
    const Interval::Guard rounding;
    const size_t n = f_.size(), positions = f_.x.size();
    std::vector<Solver> solvers(tapes_.size());
    std::vector<std::vector<Interval>> others;
    std::vector<Interval> slopes(positions * n, Interval(0.0));
    for (size_t k = 0; k < n; ++k) {
      if (f_.closure.direct[k] >= 0) slopes[PlaceOf(f_.closure.direct[k]) * n + k] = Interval(1.0);
    }
    const auto solve = [&](size_t b, const std::vector<Interval>& known_part, auto&& known_at,
                           auto&& store) {
      const ClosureBlock& block = f_.closure.blocks[b];
      const size_t m = block.rates.size(), known = block.known.size();
      std::vector<Interval> v(m);
      for (size_t i = 0; i < m; ++i) {
        v[i] = -known_part[i];
        for (size_t j = 0; j < known; ++j) {
          v[i] = v[i] - others[b][i * known + j] * known_at(PlaceOf(block.known[j]));
        }
      }
      const std::vector<Interval> y = solvers[b].Times(v);
      for (size_t i = 0; i < m; ++i) {
        store(PlaceOf(block.rates[i]), y[i] * Interval(ScaleOf(block.rates[i])));
      }
    };
    for (size_t b = 0; b < tapes_.size(); ++b) {
      const size_t m = f_.closure.blocks[b].rates.size();
      if (!solvers[b].Set(ScaledColumns(b), static_cast<Eigen::Index>(m))) return std::nullopt;
      others.push_back(Evaluate(tapes_[b].others));
      const std::vector<Interval> by_q = Evaluate(tapes_[b].by_q);
      for (size_t k = 0; k < n; ++k) {
        solve(
            b,
            {by_q.begin() + static_cast<std::ptrdiff_t>(k * m),
             by_q.begin() + static_cast<std::ptrdiff_t>((k + 1) * m)},
            [&](size_t x) { return slopes[x * n + k]; },
            [&](size_t x, const Interval& value) { slopes[x * n + k] = value; });
      }
    }
    const std::vector<Interval> factors = Evaluate(*factors_);
    const size_t actuators = f_.actuators.size();
    std::vector<Interval> all(actuators * n * n, Interval(0.0));
    const auto along = [&](size_t i, size_t j) {
      for (size_t k = 0; k < f_.rates.size(); ++k) {
        const size_t x = PlaceOf(static_cast<int>(k));
        const Interval w = i == j ? slopes[x * n + i] : slopes[x * n + i] + slopes[x * n + j];
        inputs_[f_.graph.InputOf(f_.u[k])] = w;
      }
      std::vector<Interval> second(positions, Interval(0.0));
      for (size_t b = 0; b < tapes_.size(); ++b) {
        solve(
            b, Evaluate(tapes_[b].bias), [&](size_t x) { return second[x]; },
            [&](size_t x, const Interval& value) { second[x] = value; });
      }
      std::vector<Interval> sums = Evaluate(*actuator_bias_);
      size_t at = 0;
      for (size_t a = 0; a < actuators; ++a) {
        for (const auto& [rate, factor] : f_.actuators[a].rates) {
          sums[a] = sums[a] + factors[at++] * second[PlaceOf(rate)];
        }
      }
      return sums;
    };
    for (size_t i = 0; i < n; ++i) {
      const std::vector<Interval> sums = along(i, i);
      for (size_t a = 0; a < actuators; ++a) all[(a * n + i) * n + i] = sums[a];
    }
    for (size_t i = 0; i < n; ++i) {
      for (size_t j = 0; j < i; ++j) {
        const std::vector<Interval> sums = along(i, j);
        for (size_t a = 0; a < actuators; ++a) {
          all[(a * n + i) * n + j] = all[(a * n + j) * n + i] =
              Interval(0.5) * (sums[a] - all[(a * n + i) * n + i] - all[(a * n + j) * n + j]);
        }
      }
    }
    return all;
  }

  // `start`: x by the table at the centre; `slope_low`, `slope_high`: of the table over the cell.
  std::optional<ProvedCell> Prove(const VecX& low, const VecX& high, const VecX& start,
                                  const MatX& slope_low, const MatX& slope_high, int steps) {
    const VecX middle = 0.5 * (low + high), half = 0.5 * (high - low);
    ProvedCell cell;
    cell.centre = start;
    if (!finder_.Find(middle, &cell.centre)) return std::nullopt;
    const auto x_size = static_cast<Eigen::Index>(f_.x.size());
    const Interval::Guard rounding;
    cell.slopes = MatX::Zero(x_size, static_cast<Eigen::Index>(f_.size()));
    cell.radius = VecX::Zero(x_size);
    inputs_.assign(f_.graph.inputs(), Interval(0.0));
    for (size_t i = 0; i < f_.x.size(); ++i) {
      Set(i, cell.centre[static_cast<Eigen::Index>(i)], 0.0);
    }
    for (size_t k = 0; k < f_.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      inputs_[f_.graph.InputOf(f_.closure.q[k])] = Interval(low[at], high[at]);
      if (f_.closure.direct[k] < 0) continue;
      const size_t x = PlaceOf(f_.closure.direct[k]);
      cell.slopes(static_cast<Eigen::Index>(x), at) = 1.0;
      SetAround(x, cell, half, 0.0);
    }
    double before = 0.0;  // error of the blocks before
    for (size_t b = 0; b < tapes_.size(); ++b) {
      if (!ProveBlock(b, middle, half, start, slope_low, slope_high, steps, &cell, &before))
        return std::nullopt;
    }
    cell.error = before;
    return cell;
  }

 private:
  void Set(size_t x, double centre, double radius) {
    inputs_[f_.graph.InputOf(f_.x[x])] = radius == 0.0
                                             ? Interval(centre)
                                             : Interval(std::nextafter(centre - radius, -1e300),
                                                        std::nextafter(centre + radius, 1e300));
  }
  [[nodiscard]] double ScaleOf(int rate) const {
    return f_.rates[static_cast<size_t>(rate)].length ? f_.length : 1.0;
  }
  [[nodiscard]] size_t PlaceOf(int rate) const {
    return static_cast<size_t>(f_.rates[static_cast<size_t>(rate)].x);
  }
  std::vector<Interval> Evaluate(const FormulaTape& tape) {
    std::vector<Interval> values;
    tape.Evaluate(inputs_, &work_, &values);
    return values;
  }

  // J⁻¹ v over a cell: A v widened by what 1 − A J leaves.
  struct Solver {
    MatX A;
    double widen = 0.0;
    bool Set(const IntervalMatrix& J, Eigen::Index m) {
      MatX middle(m, m);
      for (Eigen::Index i = 0; i < m * m; ++i) {
        const Interval& at = J[static_cast<size_t>(i)];
        middle(i / m, i % m) = 0.5 * (at.low() + at.high());
      }
      const Eigen::FullPivLU<MatX> lu(middle);
      if (!lu.isInvertible()) return false;
      A = lu.inverse();
      IntervalMatrix E;
      const double contraction = Contraction(A, J, &E);
      widen = contraction / (1.0 - contraction);
      return contraction < 0.9;
    }
    [[nodiscard]] std::vector<Interval> Times(const std::vector<Interval>& v) const {
      std::vector<Interval> y(v.size(), Interval(0.0));
      double most = 0.0;
      for (size_t i = 0; i < v.size(); ++i) {
        for (size_t j = 0; j < v.size(); ++j) {
          y[i] =
              y[i] + Interval(A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j))) * v[j];
        }
        most = std::max(most, y[i].magnitude());
      }
      for (Interval& part : y) part = part + Interval(-widen * most, widen * most);
      return y;
    }
  };

  // |1 − A J|, rows' sums; J scaled.
  static double Contraction(const MatX& A, const IntervalMatrix& J, IntervalMatrix* E) {
    const auto m = A.rows();
    double largest = 0.0;
    E->assign(static_cast<size_t>(m * m), Interval(0.0));
    for (Eigen::Index i = 0; i < m; ++i) {
      double sum = 0.0;
      for (Eigen::Index j = 0; j < m; ++j) {
        Interval e(i == j ? 1.0 : 0.0);
        for (Eigen::Index k = 0; k < m; ++k)
          e = e - Interval(A(i, k)) * J[static_cast<size_t>(k * m + j)];
        (*E)[static_cast<size_t>(i * m + j)] = e;
        sum += e.magnitude();
      }
      if (!(sum <= largest)) largest = sum;
    }
    return largest;
  }

  IntervalMatrix ScaledColumns(size_t b) {
    const ClosureBlock& block = f_.closure.blocks[b];
    IntervalMatrix J = Evaluate(tapes_[b].columns);
    const size_t m = block.rates.size();
    for (size_t i = 0; i < m; ++i) {
      for (size_t j = 0; j < m; ++j)
        J[i * m + j] = J[i * m + j] * Interval(ScaleOf(block.rates[j]));
    }
    return J;
  }

  // y over the cell: c + G (q − q_c) + e, |e_i| <= radius_i.
  void SetAround(size_t x, const ProvedCell& cell, const VecX& half, double more) {
    const auto at = static_cast<Eigen::Index>(x);
    Set(x, cell.centre[at], cell.slopes.row(at).cwiseAbs() * half + cell.radius[at] + more);
  }

  bool ProveBlock(size_t b, const VecX& middle, const VecX& half, const VecX& start,
                  const MatX& slope_low, const MatX& slope_high, int steps, ProvedCell* cell,
                  double* before) {
    const ClosureBlock& block = f_.closure.blocks[b];
    const size_t m = block.rates.size(), n = f_.size(), known = block.known.size();
    const auto M = static_cast<Eigen::Index>(m);
    const std::vector<Interval> box = inputs_;  // what is before this block, over the cell
    // All at the centre: A = J⁻¹, slopes, residual.
    for (size_t i = 0; i < f_.x.size(); ++i) {
      Set(i, cell->centre[static_cast<Eigen::Index>(i)], 0.0);
    }
    for (size_t k = 0; k < n; ++k) {
      inputs_[f_.graph.InputOf(f_.closure.q[k])] = Interval(middle[static_cast<Eigen::Index>(k)]);
    }
    const IntervalMatrix J_centre = ScaledColumns(b);
    const std::vector<Interval> residual = Evaluate(tapes_[b].residual);
    MatX J(M, M), right(M, static_cast<Eigen::Index>(n));
    for (Eigen::Index i = 0; i < M; ++i) {
      for (Eigen::Index j = 0; j < M; ++j) J(i, j) = J_centre[static_cast<size_t>(i * M + j)].low();
    }
    const Eigen::FullPivLU<MatX> lu(J);
    if (!lu.isInvertible()) return false;
    const MatX A = lu.inverse();
    // ∂r/∂q along what is known, by interval arithmetic at the inputs.
    const auto along = [&] {
      const std::vector<Interval> others = Evaluate(tapes_[b].others),
                                  by_q = Evaluate(tapes_[b].by_q);
      std::vector<Interval> sum(m * n);
      for (size_t i = 0; i < m; ++i) {
        for (size_t k = 0; k < n; ++k) {
          Interval& at = sum[i * n + k] = by_q[k * m + i];
          for (size_t j = 0; j < known; ++j) {
            const auto x = static_cast<Eigen::Index>(PlaceOf(block.known[j]));
            at = at +
                 others[i * known + j] * Interval(cell->slopes(x, static_cast<Eigen::Index>(k)));
          }
        }
      }
      return sum;
    };
    const std::vector<Interval> along_centre = along();
    for (size_t i = 0; i < m; ++i) {
      for (size_t k = 0; k < n; ++k) {
        right(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) =
            along_centre[i * n + k].low();
      }
    }
    const MatX G = -A * right;  // scaled
    const auto set_block = [&](const std::vector<double>& radius, double more) {
      for (size_t i = 0; i < m; ++i) {
        const size_t x = PlaceOf(block.rates[i]);
        const double unit = ScaleOf(block.rates[i]);
        cell->slopes.row(static_cast<Eigen::Index>(x)) = unit * G.row(static_cast<Eigen::Index>(i));
        cell->radius[static_cast<Eigen::Index>(x)] = unit * radius[i];
        SetAround(x, *cell, half, unit * more);
      }
    };
    // A r(c + G δ, q_c + δ) over the cell, by its mean value form.
    const auto times_A = [&](const std::vector<Interval>& v) {
      std::vector<Interval> Av(m, Interval(0.0));
      for (size_t i = 0; i < m; ++i) {
        for (size_t j = 0; j < m; ++j) {
          Av[i] = Av[i] +
                  Interval(A(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j))) * v[j];
        }
      }
      return Av;
    };
    const auto predicted = [&](const IntervalMatrix& columns) {
      const std::vector<Interval> others = Evaluate(tapes_[b].others), slopes = along();
      std::vector<Interval> r = residual;
      for (size_t i = 0; i < m; ++i) {
        for (size_t k = 0; k < n; ++k) {
          const auto at = static_cast<Eigen::Index>(k);
          Interval slope = slopes[i * n + k];
          for (size_t j = 0; j < m; ++j) {
            slope = slope + columns[i * m + j] * Interval(G(static_cast<Eigen::Index>(j), at));
          }
          r[i] = r[i] + slope * Interval(-half[at], half[at]);
        }
        for (size_t j = 0; j < known; ++j) {
          const double e = cell->radius[static_cast<Eigen::Index>(PlaceOf(block.known[j]))];
          r[i] = r[i] + others[i * known + j] * Interval(-e, e);
        }
      }
      return times_A(r);
    };
    std::vector<double> radius(m, 0.0);
    IntervalMatrix E;
    double contraction = 1.0;
    bool inside = false;
    for (int pass = 0; pass < 8 && !inside; ++pass) {
      inputs_ = box;
      set_block(radius, 0.0);
      const IntervalMatrix columns = ScaledColumns(b);
      contraction = Contraction(A, columns, &E);
      if (!(contraction < 0.9)) return false;
      const std::vector<Interval> Ar = predicted(columns);
      inside = pass > 0;
      std::vector<double> next(m);
      for (size_t i = 0; i < m; ++i) {
        Interval k = -Ar[i];
        for (size_t j = 0; j < m; ++j) k = k + E[i * m + j] * Interval(-radius[j], radius[j]);
        inside = inside && k.magnitude() < radius[i];
        next[i] = 1.3 * k.magnitude() + 1e-10;
        if (!(next[i] < 0.7)) return false;
      }
      if (!inside) radius = next;
    }
    if (!inside) return false;
    double D = 0.0;
    if (*before > 0.0) {
      const std::vector<Interval> others = Evaluate(tapes_[b].others);
      std::vector<Interval> v(m, Interval(0.0));
      for (size_t i = 0; i < m; ++i) {
        for (size_t j = 0; j < known; ++j) {
          if (std::ranges::find(f_.closure.direct, block.known[j]) != f_.closure.direct.end()) {
            continue;  // exact
          }
          const double most = others[i * known + j].magnitude() * ScaleOf(block.known[j]);
          v[i] = v[i] + Interval(-most, most);
        }
      }
      for (const Interval& part : times_A(v))
        D = std::max(D, part.magnitude() / (1.0 - contraction));
    }
    // (2)
    double error = 0.0;
    for (size_t i = 0; i < m; ++i) {
      const auto x = static_cast<Eigen::Index>(PlaceOf(block.rates[i]));
      double e = std::abs(start[x] - cell->centre[x]) + cell->radius[x];
      for (size_t k = 0; k < n; ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        e += half[at] * std::max(std::abs(slope_low(x, at) - cell->slopes(x, at)),
                                 std::abs(slope_high(x, at) - cell->slopes(x, at)));
      }
      error = std::max(error, e / ScaleOf(block.rates[i]));
    }
    // (3), on the box widened by the error.
    inputs_ = box;
    set_block(radius, error);
    const double wide = Contraction(A, ScaledColumns(b), &E);
    if (!(wide < 0.9)) return false;
    const std::vector<Interval> H = Evaluate(tapes_[b].second);
    double second = 0.0;
    for (size_t i = 0; i < m; ++i) {
      double sum = 0.0;
      for (size_t k = 0; k < m; ++k) {
        for (size_t j = 0; j < m; ++j) {
          sum += H[(k * m + i) * m + j].magnitude() * ScaleOf(block.rates[j]) *
                 ScaleOf(block.rates[k]);
        }
      }
      second = std::max(second, sum);
    }
    const double inverse = A.cwiseAbs().rowwise().sum().maxCoeff() / (1.0 - wide);
    const double C = 0.5 * inverse * second;
    for (int step = 0; step < steps; ++step) {
      const double from = error + D * *before;
      const double next = C * from * from + D * *before;
      if (!(next < 0.9 * error) && !(next <= kBound)) return false;
      error = next;
    }
    if (!(error <= kBound)) return false;
    *before = std::max(*before, error);
    inputs_ = box;
    set_block(radius, 0.0);
    return true;
  }

  const MechanismFormulas& f_;
  PoseFinder& finder_;
  std::vector<BlockTapes> tapes_;
  std::optional<FormulaTape> factors_, actuator_bias_;
  std::vector<Interval> inputs_, work_;
};

double Printed(double value) { return std::strtod(fmt::format("{:.7g}", value).c_str(), nullptr); }

// Fills a table's nodes, and finds where it is proved.
class TableMaker {
 public:
  TableMaker(const MechanismFormulas& formulas, const VecX& low, const VecX& high,
             const std::function<void(double)>& progress)
      : f_(formulas),
        low_(low),
        high_(high),
        finder_(formulas),
        prover_(formulas, &finder_),
        progress_(progress) {}

  // With `nodes` per coordinate, cells that they divide, and steps of Newton's method.
  StartTable Make(int nodes, int cells, int steps) {
    table_ = StartTable{.low = low_, .high = high_};
    table_.nodes.assign(f_.size(), nodes);
    table_.cells.assign(f_.size(), cells);
    table_.steps = steps;
    FillNodes();
    leaves_.clear();
    failed_.assign(static_cast<size_t>(CellGrid().size()), false);
    Grid roots(table_.nodes, low_, high_);
    for (int& count : roots.counts) --count;
    const int size = cells / (nodes - 1);
    for (int root = 0; root < roots.size(); ++root) {
      std::vector<int> from = roots.At(root);
      for (int& at : from) at *= size;
      Divide(from, size);
      if (progress_) progress_(static_cast<double>(root) / roots.size());
    }
    Connect();
    return std::move(table_);
  }

  // Its nodes are the corners of the cells of `start`.
  LookupTable Lookup(const StartTable& start) {
    table_ = start;
    const size_t n = f_.size();
    const auto N = static_cast<Eigen::Index>(n), M = static_cast<Eigen::Index>(f_.actuators.size());
    LookupTable lookup{.low = low_, .high = high_};
    for (const int cells : start.cells) lookup.nodes.push_back(cells + 1);
    const Grid nodes(lookup.nodes, low_, high_);
    const std::vector<std::optional<VecX>> poses = PosesAt(f_, &finder_, nodes);
    std::vector<Expr> values;
    for (const ActuatorFormula& actuator : f_.actuators) values.push_back(actuator.value);
    const FormulaTape tape(values);
    std::vector<double> inputs(f_.graph.inputs(), 0.0), work, found;
    lookup.values = MatX::Zero(nodes.size(), M);
    for (int i = 0; i < nodes.size(); ++i) {
      if (!poses[static_cast<size_t>(i)]) continue;
      for (size_t k = 0; k < f_.x.size(); ++k) {
        inputs[f_.graph.InputOf(f_.x[k])] =
            (*poses[static_cast<size_t>(i)])[static_cast<Eigen::Index>(k)];
      }
      tape.Evaluate(inputs, &work, &found);
      lookup.values.row(i) = Eigen::Map<VecX>(found.data(), M).transpose();
    }
    const Grid cells = CellGrid();
    lookup.proved.assign(start.proved.size(), false);
    lookup.bound = VecX::Zero(M);
    lookup.slope_bound = MatX::Zero(M, N);
    for (int c = 0; c < cells.size(); ++c) {
      if (!start.proved[static_cast<size_t>(c)]) continue;
      bool corners = true;  // the branch of home reaches them
      for (int corner = 0; corner < (1 << n); ++corner) {
        std::vector<int> at = cells.At(c);
        for (size_t k = 0; k < n; ++k) at[k] += (corner >> k) & 1;
        corners = corners && poses[static_cast<size_t>(nodes.Index(at))];
      }
      MatX seconds = MatX::Zero(M * N, N);  // magnitudes
      const VecX low = cells.Point(cells.At(c));
      if (!corners || !BoundSeconds(low, low + cells.step, 0, &seconds)) continue;
      lookup.proved[static_cast<size_t>(c)] = true;
      for (Eigen::Index a = 0; a < M; ++a) {
        double error = 0.0;
        for (Eigen::Index i = 0; i < N; ++i) {
          const double h = nodes.step[i];
          error += h * h / 8.0 * seconds(a * N + i, i);
          const double slope = 0.5 * seconds.row(a * N + i).dot(nodes.step);
          lookup.slope_bound(a, i) = std::max(lookup.slope_bound(a, i), slope);
        }
        lookup.bound[a] = std::max(lookup.bound[a], error);
      }
    }
    return lookup;
  }

 private:
  static constexpr int kSplits = 3;  // of a cell, where that is needed

  struct Leaf {
    VecX low, high;
    ProvedCell cell;
    std::vector<int> from;  // first of its cells
    int size = 1;           // cells along each coordinate; parts of one: 1
  };

  // Cells, as if their first corners were points.
  [[nodiscard]] Grid CellGrid() const {
    std::vector<int> points = table_.cells;
    for (int& count : points) ++count;
    Grid grid(points, low_, high_);
    grid.counts = table_.cells;
    return grid;
  }

  void FillNodes() {
    const Grid grid(table_.nodes, low_, high_);
    const std::vector<std::optional<VecX>> poses = PosesAt(f_, &finder_, grid);
    table_.x = MatX(grid.size(), f_.x_home.size());
    for (int i = 0; i < grid.size(); ++i) {
      // Out of reach: as the nearest node that is not.
      const VecX* pose = &f_.x_home;
      double distance = std::numeric_limits<double>::infinity();
      for (int j = 0; j < grid.size(); ++j) {
        if (!poses[static_cast<size_t>(j)]) continue;
        const VecX apart = grid.Point(grid.At(i)) - grid.Point(grid.At(j));
        const double to = apart.cwiseQuotient(grid.step).norm();
        if (to < distance) distance = to, pose = &*poses[static_cast<size_t>(j)];
      }
      table_.x.row(i) = pose->unaryExpr(&Printed).transpose();
    }
  }

  // x between the nodes around `inside`, and its slopes, at q.
  VecX Interpolate(const VecX& inside, const VecX& q, MatX* slopes) const {
    const Grid grid(table_.nodes, low_, high_);
    std::vector<int> first;
    first.reserve(f_.size());
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const double t = (inside[k] - low_[k]) / grid.step[k];
      first.push_back(std::clamp(static_cast<int>(t), 0, grid.counts[static_cast<size_t>(k)] - 2));
    }
    return Multilinear(grid, table_.x, first, q, slopes);
  }

  std::optional<ProvedCell> Prove(const VecX& low, const VecX& high) {
    const VecX middle = 0.5 * (low + high);
    MatX slopes, slope_low, slope_high;
    for (int corner = 0; corner < (1 << f_.size()); ++corner) {
      VecX q = low;
      for (Eigen::Index k = 0; k < q.size(); ++k) {
        if (((corner >> k) & 1) != 0) q[k] = high[k];
      }
      (void)Interpolate(middle, q, &slopes);
      slope_low = corner == 0 ? slopes : slope_low.cwiseMin(slopes).eval();
      slope_high = corner == 0 ? slopes : slope_high.cwiseMax(slopes).eval();
    }
    VecX start = Interpolate(middle, middle, &slopes);
    finder_.Place(middle, &start);
    return prover_.Prove(low, high, start, slope_low, slope_high, table_.steps);
  }

  // A block of cells at once, else its parts.
  void Divide(const std::vector<int>& from, int size) {
    const Grid cells = CellGrid();
    const VecX low = cells.Point(from), high = low + size * cells.step;
    if (size == 1) {
      if (!DivideCell(from, low, high, 0)) failed_[static_cast<size_t>(cells.Index(from))] = true;
      return;
    }
    if (auto cell = Prove(low, high)) {
      leaves_.push_back({low, high, *std::move(cell), from, size});
      return;
    }
    for (int part = 0; part < (1 << from.size()); ++part) {
      std::vector<int> at = from;
      for (size_t k = 0; k < at.size(); ++k) at[k] += ((part >> k) & 1) * size / 2;
      Divide(at, size / 2);
    }
  }
  bool DivideCell(const std::vector<int>& cell, const VecX& low, const VecX& high, int splits) {
    if (auto proved = Prove(low, high)) {
      leaves_.push_back({low, high, *std::move(proved), cell, 1});
      return true;
    }
    if (splits == kSplits) return false;
    const VecX half = 0.5 * (high - low);
    for (int part = 0; part < (1 << cell.size()); ++part) {
      VecX from = low;
      for (Eigen::Index k = 0; k < from.size(); ++k) from[k] += ((part >> k) & 1) * half[k];
      if (!DivideCell(cell, from, from + half, splits + 1)) return false;
    }
    return true;
  }

  // Largest magnitudes over a cell, by parts of it where that is needed.
  bool BoundSeconds(const VecX& low, const VecX& high, int splits, MatX* largest) {
    if (Prove(low, high)) {
      const auto found = prover_.Seconds();
      if (found) {
        const Eigen::Index n = largest->cols();
        for (Eigen::Index i = 0; i < largest->size(); ++i) {
          double& at = (*largest)(i / n, i % n);
          at = std::max(at, (*found)[static_cast<size_t>(i)].magnitude());
        }
        return true;
      }
    }
    if (splits == kSplits) return false;
    const VecX half = 0.5 * (high - low);
    for (int part = 0; part < (1 << low.size()); ++part) {
      VecX from = low;
      for (Eigen::Index k = 0; k < from.size(); ++k) from[k] += ((part >> k) & 1) * half[k];
      if (!BoundSeconds(from, from + half, splits + 1, largest)) return false;
    }
    return true;
  }

  [[nodiscard]] bool SameAt(const VecX& q, const Leaf& a, const Leaf& b) {
    VecX here = a.cell.centre, there = b.cell.centre;
    return finder_.Find(q, &here) && finder_.Find(q, &there) &&
           (here - there).cwiseAbs().maxCoeff() <= kSameSolution;
  }
  // The middle of a common face.
  static std::optional<VecX> FaceOf(const Leaf& a, const Leaf& b, const VecX& rounding) {
    const VecX low = a.low.cwiseMax(b.low), high = a.high.cwiseMin(b.high);
    int flat = 0;
    for (Eigen::Index k = 0; k < low.size(); ++k) {
      const double width = high[k] - low[k];
      if (width < -rounding[k]) return std::nullopt;
      flat += width <= rounding[k] ? 1 : 0;
    }
    if (flat != 1) return std::nullopt;
    return VecX(0.5 * (low + high));
  }

  // Cells of a leaf, and `around` more to each side.
  [[nodiscard]] std::vector<size_t> CellsOf(const Leaf& leaf, int around) const {
    std::vector<size_t> cells = {0};
    for (size_t k = 0; k < f_.size(); ++k) {
      const int from = std::max(0, leaf.from[k] - around);
      const int to = std::min(table_.cells[k], leaf.from[k] + leaf.size + around);
      std::vector<size_t> longer;
      for (const size_t cell : cells) {
        for (int at = from; at < to; ++at) {
          longer.push_back(cell * static_cast<size_t>(table_.cells[k]) + static_cast<size_t>(at));
        }
      }
      cells = std::move(longer);
    }
    return cells;
  }
  [[nodiscard]] std::vector<size_t> Around(const Leaf& leaf,
                                           const std::vector<std::vector<size_t>>& in_cell) const {
    std::vector<size_t> around;
    for (const size_t cell : CellsOf(leaf, 1)) {
      around.insert(around.end(), in_cell[cell].begin(), in_cell[cell].end());
    }
    std::ranges::sort(around);
    around.erase(std::unique(around.begin(), around.end()), around.end());
    return around;
  }

  // The branch of home: from the leaf nearest to it over common faces.
  void Connect() {
    const Grid cells = CellGrid();
    const VecX rounding = 1e-9 * cells.step;
    double distance = std::numeric_limits<double>::infinity();
    size_t first = leaves_.size();
    for (size_t i = 0; i < leaves_.size(); ++i) {
      const VecX middle = 0.5 * (leaves_[i].low + leaves_[i].high);
      const double to = (middle - f_.closure.home).cwiseQuotient(cells.step).norm();
      if (to >= distance) continue;
      VecX x = f_.x_home;
      if (!finder_.Walk(f_.closure.home, middle, kLongWay, &x)) continue;
      if ((x - leaves_[i].cell.centre).cwiseAbs().maxCoeff() > kSameSolution) continue;
      distance = to, first = i;
    }
    std::vector<std::vector<size_t>> in_cell(static_cast<size_t>(cells.size()));
    for (size_t i = 0; i < leaves_.size(); ++i) {
      for (const size_t cell : CellsOf(leaves_[i], 0)) in_cell[cell].push_back(i);
    }
    std::vector<bool> reached(leaves_.size(), false);
    std::vector<size_t> next;
    if (first < leaves_.size()) next.push_back(first), reached[first] = true;
    while (!next.empty()) {
      const size_t i = next.back();
      next.pop_back();
      for (const size_t j : Around(leaves_[i], in_cell)) {
        if (reached[j]) continue;
        const auto face = FaceOf(leaves_[i], leaves_[j], rounding);
        if (!face || !SameAt(*face, leaves_[i], leaves_[j])) continue;
        reached[j] = true;
        next.push_back(j);
      }
    }
    table_.proved.assign(static_cast<size_t>(cells.size()), false);
    std::vector<bool> lost = failed_;
    table_.bound = 0.0;
    for (size_t i = 0; i < leaves_.size(); ++i) {
      const Leaf& leaf = leaves_[i];
      for (const size_t cell : CellsOf(leaf, 0)) {
        table_.proved[cell] = true;
        if (!reached[i]) lost[cell] = true;
      }
      if (reached[i]) table_.bound = std::max(table_.bound, leaf.cell.error);
    }
    for (size_t c = 0; c < lost.size(); ++c) table_.proved[c] = table_.proved[c] && !lost[c];
  }

  const MechanismFormulas& f_;
  const VecX &low_, &high_;
  PoseFinder finder_;
  CellProver prover_;
  const std::function<void(double)>& progress_;
  StartTable table_;
  std::vector<Leaf> leaves_;
  std::vector<bool> failed_;  // per cell
};

}  // namespace

StartTable MakeStartTable(const MechanismFormulas& formulas, const VecX& low, const VecX& high,
                          int cells, std::string* why,
                          const std::function<void(double)>& progress) {
  const size_t n = formulas.size();
  StartTable best{.low = low, .high = high};
  if (n > 3) *why = fmt::format("one over {} coordinates would be large", n);
  for (const ClosureBlock& block : formulas.closure.blocks) {
    for (const int k : block.rates) {
      if (formulas.rates[static_cast<size_t>(k)].ball >= 0) {
        *why =
            "a spherical joint is searched whose rotation has no coordinates without singularity";
      }
    }
    if (block.rates.size() > kLargestBlock) {
      *why = fmt::format("{} joints' coordinates depend on each other in one block",
                         block.rates.size());
    }
  }
  if (!why->empty()) return best;
  // A finer table, then more steps are worth it where they prove clearly more.
  constexpr std::array<int, 3> kMostNodes = {65, 33, 9}, kCells = {512, 64, 16};
  constexpr int kLeastNodes = 5, kLeastSteps = 3, kMostSteps = 5;
  constexpr double kWorth = 1.02;
  TableMaker maker(formulas, low, high, progress);
  if (cells == 0) cells = kCells[n - 1];
  const auto better = [&](int nodes, int steps) {
    StartTable table = maker.Make(nodes, cells, steps);
    const auto count = [](const StartTable& of) {
      return static_cast<double>(std::ranges::count(of.proved, true));
    };
    if (!best.proved.empty() && count(table) <= kWorth * count(best)) return count(best) == 0.0;
    best = std::move(table);
    return true;
  };
  int nodes = kLeastNodes;
  while (better(nodes, kLeastSteps) && 2 * nodes - 1 <= kMostNodes[n - 1]) nodes = 2 * nodes - 1;
  for (int steps = kLeastSteps + 1; steps <= kMostSteps && better(best.nodes[0], steps);) ++steps;
  return best;
}

LookupTable MakeLookupTable(const MechanismFormulas& formulas, const StartTable& start) {
  return TableMaker(formulas, start.low, start.high, {}).Lookup(start);
}

bool LookupTable::At(const VecX& q, VecX* m, MatX* slopes) const {
  const Grid grid(nodes, low, high);
  std::vector<int> first;
  first.reserve(nodes.size());
  size_t cell = 0;
  for (Eigen::Index k = 0; k < q.size(); ++k) {
    const int last = nodes[static_cast<size_t>(k)] - 1;
    const double t = (q[k] - low[k]) / grid.step[k];
    if (!(t >= 0.0 && t <= last)) return false;
    first.push_back(std::min(static_cast<int>(t), last - 1));
    cell = cell * static_cast<size_t>(last) + static_cast<size_t>(first.back());
  }
  if (!proved[cell]) return false;
  *m = Multilinear(grid, values, first, q, slopes);
  return true;
}

}  // namespace mbv
