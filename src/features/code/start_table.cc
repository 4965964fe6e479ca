#include "features/code/start_table.h"

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
  using Base =
      boost::numeric::interval<double,
                               boost::numeric::interval_lib::policies<
                                   boost::numeric::interval_lib::save_state<
                                       boost::numeric::interval_lib::rounded_transc_std<double>>,
                                   boost::numeric::interval_lib::checking_base<double>>>;
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
  friend Interval sin(const Interval& a) { return Within(boost::numeric::sin(a.in_), a); }
  friend Interval cos(const Interval& a) { return Within(boost::numeric::cos(a.in_), a); }
  // No row of a loop has these.
  friend Interval exp(const Interval& /*a*/) { return All(); }
  friend Interval atan2(const Interval& /*a*/, const Interval& /*b*/) { return All(); }

 private:
  explicit Interval(const Base& in) : in_(in) {}
  static Interval All() { return Interval(Base::whole()); }
  static Interval Within(const Base& in, const Interval& of) {
    constexpr double kLibrary = 8.0 * kEps;
    if (!(of.magnitude() < 1e3)) return {-1.0, 1.0};
    return {std::max(-1.0, in.lower() - kLibrary), std::min(1.0, in.upper() + kLibrary)};
  }
  Base in_;
};

constexpr size_t kLargestBlock = 8;  // second derivatives grow with its cube
constexpr double kConverged = 1e-12;
constexpr int kMostSteps = 5;
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
  FormulaTape residual, columns, others, by_q, second;
  BlockTapes(const MechanismFormulas& f, const ClosureBlock& block)
      : residual(block.residual),
        columns(block.columns),
        others(block.others),
        by_q(ByQ(f, block)),
        second(Second(f, block)) {}
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
  VecX centre;                   // x at its centre
  VecX low, high;                // of x
  std::vector<Interval> slopes;  // ∂x/∂q, positions × coordinates
  double error = 0.0;            // left after the steps
};

class CellProver {
 public:
  CellProver(const MechanismFormulas& formulas, PoseFinder* finder)
      : f_(formulas), finder_(*finder) {
    for (const ClosureBlock& block : f_.closure.blocks) tapes_.emplace_back(f_, block);
  }

  // `start`: x by the table at the centre; `slope_low`, `slope_high`: of the table over the cell.
  std::optional<ProvedCell> Prove(const VecX& low, const VecX& high, const VecX& start,
                                  const MatX& slope_low, const MatX& slope_high, int steps) {
    const VecX middle = 0.5 * (low + high), half = 0.5 * (high - low);
    const auto n = static_cast<Eigen::Index>(f_.size());
    ProvedCell cell;
    cell.centre = start;
    if (!finder_.Find(middle, &cell.centre)) return std::nullopt;
    cell.low = cell.high = cell.centre;
    cell.slopes.assign(f_.x.size() * f_.size(), Interval(0.0));
    inputs_.assign(f_.graph.inputs(), Interval(0.0));
    for (size_t i = 0; i < f_.x.size(); ++i) Set(i, cell.centre[static_cast<Eigen::Index>(i)], 0.0);
    for (size_t k = 0; k < f_.size(); ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      q_[k] = Interval(middle[at] - half[at], middle[at] + half[at]);
      inputs_[f_.graph.InputOf(f_.closure.q[k])] = q_[k];
      if (f_.closure.direct[k] < 0) continue;
      const int x = f_.rates[static_cast<size_t>(f_.closure.direct[k])].x;
      inputs_[f_.graph.InputOf(f_.x[static_cast<size_t>(x)])] = q_[k];
      cell.low[x] = low[at];
      cell.high[x] = high[at];
      cell.slopes[static_cast<size_t>(x) * f_.size() + k] = Interval(1.0);
    }
    double before = 0.0;  // error of the blocks before
    for (size_t b = 0; b < tapes_.size(); ++b) {
      if (!ProveBlock(b, middle, half, start, slope_low, slope_high, steps, &cell, &before))
        return std::nullopt;
    }
    (void)n;
    cell.error = before;
    return cell;
  }

  // Bounds of ∂²x/∂q_i∂q_j on the last cell's box, by differentiating r twice:
  // J y_ij = −γ_ij.
  [[nodiscard]] const std::vector<Interval>& inputs() const { return inputs_; }

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

  bool ProveBlock(size_t b, const VecX& middle, const VecX& half, const VecX& start,
                  const MatX& slope_low, const MatX& slope_high, int steps, ProvedCell* cell,
                  double* before) {
    const ClosureBlock& block = f_.closure.blocks[b];
    const size_t m = block.rates.size(), n = f_.size(), known = block.known.size();
    const auto M = static_cast<Eigen::Index>(m);
    const std::vector<Interval> box = inputs_;  // what is before this block, over the cell
    // A: inverse at the centre.
    for (size_t i = 0; i < f_.x.size(); ++i)
      Set(i, cell->centre[static_cast<Eigen::Index>(i)], 0.0);
    for (size_t k = 0; k < n; ++k)
      inputs_[f_.graph.InputOf(f_.closure.q[k])] = Interval(middle[static_cast<Eigen::Index>(k)]);
    const IntervalMatrix at_centre = ScaledColumns(b);
    const std::vector<Interval> residual = Evaluate(tapes_[b].residual);
    MatX J(M, M);
    for (Eigen::Index i = 0; i < M; ++i) {
      for (Eigen::Index j = 0; j < M; ++j)
        J(i, j) = at_centre[static_cast<size_t>(i * M + j)].low();
    }
    const Eigen::FullPivLU<MatX> lu(J);
    if (!lu.isInvertible()) return false;
    const MatX A = lu.inverse();
    // How much y moves over the cell, about: twice what the slopes at the centre say.
    inputs_ = box;
    const std::vector<Interval> others = Evaluate(tapes_[b].others),
                                by_q = Evaluate(tapes_[b].by_q);
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
    // r at the centre of y over the cell, by its mean value form.
    const auto r_over = [&](const std::vector<Interval>& with_others,
                            const std::vector<Interval>& with_q) {
      std::vector<Interval> r = residual;
      for (size_t i = 0; i < m; ++i) {
        for (size_t j = 0; j < known; ++j) {
          const size_t x = PlaceOf(block.known[j]);
          const Interval& U = box[f_.graph.InputOf(f_.x[x])];
          r[i] = r[i] + with_others[i * known + j] *
                            (U - Interval(cell->centre[static_cast<Eigen::Index>(x)]));
        }
        for (size_t k = 0; k < n; ++k) {
          const auto at = static_cast<Eigen::Index>(k);
          r[i] = r[i] + with_q[k * m + i] * Interval(-half[at], half[at]);
        }
      }
      return r;
    };
    std::vector<double> radius(m);
    {
      const std::vector<Interval> Ar = times_A(r_over(others, by_q));
      for (size_t i = 0; i < m; ++i) radius[i] = 1.5 * Ar[i].magnitude() + 1e-10;
    }
    IntervalMatrix E;
    double contraction = 1.0;
    bool inside = false;
    for (int pass = 0; pass < 6 && !inside; ++pass) {
      inputs_ = box;
      for (size_t i = 0; i < m; ++i) {
        const size_t x = PlaceOf(block.rates[i]);
        Set(x, cell->centre[static_cast<Eigen::Index>(x)], radius[i] * ScaleOf(block.rates[i]));
        if (!(radius[i] < 0.7)) return false;
      }
      contraction = Contraction(A, ScaledColumns(b), &E);
      if (!(contraction < 0.9)) return false;
      const std::vector<Interval> r = r_over(Evaluate(tapes_[b].others), Evaluate(tapes_[b].by_q));
      const std::vector<Interval> Ar = times_A(r);
      inside = true;
      std::vector<double> next(m);
      for (size_t i = 0; i < m; ++i) {
        Interval k = -Ar[i];
        for (size_t j = 0; j < m; ++j) k = k + E[i * m + j] * Interval(-radius[j], radius[j]);
        inside = inside && k.magnitude() < radius[i];
        next[i] = 1.2 * k.magnitude() + 1e-10;
      }
      if (!inside) radius = next;
    }
    if (!inside) return false;
    // Slopes of y* over the cell: J G = −(others G_known + by_q).
    std::vector<Interval> slopes(m * n, Interval(0.0));
    const std::vector<Interval> others_in = Evaluate(tapes_[b].others),
                                q_in = Evaluate(tapes_[b].by_q);
    const double widen = contraction / (1.0 - contraction);
    double D = 0.0;
    const auto inverse_times = [&](const std::vector<Interval>& v) {
      std::vector<Interval> w = times_A(v);
      double most = 0.0;
      for (const Interval& part : w) most = std::max(most, part.magnitude());
      for (Interval& part : w) part = part + Interval(-widen * most, widen * most);
      return w;
    };
    for (size_t k = 0; k < n; ++k) {
      std::vector<Interval> v(m);
      for (size_t i = 0; i < m; ++i) {
        v[i] = -q_in[k * m + i];
        for (size_t j = 0; j < known; ++j) {
          v[i] = v[i] - others_in[i * known + j] * cell->slopes[PlaceOf(block.known[j]) * n + k];
        }
      }
      const std::vector<Interval> w = inverse_times(v);
      for (size_t i = 0; i < m; ++i) slopes[i * n + k] = w[i] * Interval(ScaleOf(block.rates[i]));
    }
    if (*before > 0.0) {
      std::vector<Interval> v(m, Interval(0.0));
      for (size_t i = 0; i < m; ++i) {
        for (size_t j = 0; j < known; ++j) {
          const bool direct =
              std::ranges::find(f_.closure.direct, block.known[j]) != f_.closure.direct.end();
          if (direct) continue;  // exact
          const double most = others_in[i * known + j].magnitude() * ScaleOf(block.known[j]);
          v[i] = v[i] + Interval(-most, most);
        }
      }
      for (const Interval& part : inverse_times(v)) D = std::max(D, part.magnitude());
    }
    // (2)
    double error = 0.0;
    for (size_t i = 0; i < m; ++i) {
      const auto x = static_cast<Eigen::Index>(PlaceOf(block.rates[i]));
      double e = std::abs(start[x] - cell->centre[x]);
      for (size_t k = 0; k < n; ++k) {
        const auto at = static_cast<Eigen::Index>(k);
        const Interval off = Interval(slope_low(x, at), slope_high(x, at)) - slopes[i * n + k];
        e += off.magnitude() * half[at];
      }
      error = std::max(error, e / ScaleOf(block.rates[i]));
    }
    // (3), on the box widened by the error.
    for (size_t i = 0; i < m; ++i) {
      const size_t x = PlaceOf(block.rates[i]);
      const double at = cell->centre[static_cast<Eigen::Index>(x)], unit = ScaleOf(block.rates[i]);
      cell->low[static_cast<Eigen::Index>(x)] = at - radius[i] * unit;
      cell->high[static_cast<Eigen::Index>(x)] = at + radius[i] * unit;
      for (size_t k = 0; k < n; ++k) cell->slopes[x * n + k] = slopes[i * n + k];
      Set(x, at, (radius[i] + error) * unit);
    }
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
      if (!(next < 0.9 * error) && next > kBound) return false;
      error = next;
    }
    if (!(error <= kBound)) return false;
    *before = std::max(*before, error);
    // What later blocks see of y: over the cell, as computed.
    inputs_ = box;
    for (size_t i = 0; i < m; ++i) {
      const size_t x = PlaceOf(block.rates[i]);
      Set(x, cell->centre[static_cast<Eigen::Index>(x)], radius[i] * ScaleOf(block.rates[i]));
    }
    return true;
  }

  const MechanismFormulas& f_;
  PoseFinder& finder_;
  std::vector<BlockTapes> tapes_;
  std::vector<Interval> inputs_, work_;
  std::array<Interval, 3> q_;
};

double Printed(double value) { return std::strtod(fmt::format("{:.7g}", value).c_str(), nullptr); }

}  // namespace

StartTable MakeStartTable(const MechanismFormulas& formulas, const VecX& low, const VecX& high,
                          std::string* why, const std::function<void(double)>& progress) {
  const size_t n = formulas.size();
  StartTable table{.low = low, .high = high};
  if (n > 3) {
    *why = fmt::format("a table over {} coordinates would be large", n);
    return table;
  }
  for (const ClosureBlock& block : formulas.closure.blocks) {
    for (const int k : block.rates) {
      if (formulas.rates[static_cast<size_t>(k)].ball >= 0) {
        *why = "a ball is searched whose turn has no coordinates without singularity";
      }
    }
    if (block.rates.size() > kLargestBlock) {
      *why = fmt::format("{} joints' coordinates depend on each other in one block",
                         block.rates.size());
    }
  }
  if (!why->empty()) return table;
  PoseFinder finder(formulas);
  CellProver prover(formulas, &finder);
  const std::array<int, 3> most_nodes = {33, 17, 9}, all_cells = {512, 64, 16};
  StartTable best = table;
  size_t best_count = 0;
  for (int nodes = 5; nodes <= most_nodes[n - 1]; nodes = 2 * nodes - 1) {
    table.nodes.assign(n, nodes);
    table.cells.assign(n, all_cells[n - 1]);
    table.steps = 3;
    const Grid grid(table.nodes, low, high);
    const std::vector<std::optional<VecX>> poses = PosesAt(formulas, &finder, grid);
    table.x = MatX(grid.size(), formulas.x_home.size());
    for (int i = 0; i < grid.size(); ++i) {
      // Out of reach: as the nearest node that is not.
      const VecX* pose = &formulas.x_home;
      if (poses[static_cast<size_t>(i)]) {
        pose = &*poses[static_cast<size_t>(i)];
      } else {
        double distance = std::numeric_limits<double>::infinity();
        for (int j = 0; j < grid.size(); ++j) {
          if (!poses[static_cast<size_t>(j)]) continue;
          const double to =
              (grid.Point(grid.At(i)) - grid.Point(grid.At(j))).cwiseQuotient(grid.step).norm();
          if (to < distance) distance = to, pose = &*poses[static_cast<size_t>(j)];
        }
      }
      table.x.row(i) = pose->unaryExpr(&Printed).transpose();
    }
    const VecX width = (high - low) / all_cells[n - 1];
    std::vector<int> points(n, all_cells[n - 1] + 1);
    std::vector<int> counts(n, all_cells[n - 1]);
    Grid cells(points, low, high);
    cells.counts = counts;
    std::vector<std::optional<ProvedCell>> proved(static_cast<size_t>(cells.size()));
    for (int c = 0; c < cells.size(); ++c) {
      const VecX from = cells.Point(cells.At(c)), to = from + width;
      // The table at the centre and its slopes at the corners of the cell.
      const auto interpolate = [&](const VecX& q, MatX* slopes) {
        std::vector<int> first(n);
        VecX part(static_cast<Eigen::Index>(n));
        for (size_t k = 0; k < n; ++k) {
          const auto at = static_cast<Eigen::Index>(k);
          const double t = (0.5 * (from[at] + to[at]) - low[at]) / grid.step[at];
          first[k] = std::clamp(static_cast<int>(t), 0, nodes - 2);
          part[at] = (q[at] - low[at]) / grid.step[at] - first[k];
        }
        VecX x = VecX::Zero(table.x.cols());
        if (slopes != nullptr) *slopes = MatX::Zero(table.x.cols(), static_cast<Eigen::Index>(n));
        for (int corner = 0; corner < (1 << n); ++corner) {
          std::vector<int> at = first;
          for (size_t k = 0; k < n; ++k) at[k] += (corner >> k) & 1;
          const VecX node = table.x.row(grid.Index(at)).transpose();
          const auto weight = [&](size_t k) {
            const double p = part[static_cast<Eigen::Index>(k)];
            return ((corner >> k) & 1) != 0 ? p : 1.0 - p;
          };
          double all = 1.0;
          for (size_t k = 0; k < n; ++k) all *= weight(k);
          x += all * node;
          for (size_t k = 0; k < n && slopes != nullptr; ++k) {
            double others = ((corner >> k) & 1) != 0 ? 1.0 : -1.0;
            for (size_t j = 0; j < n; ++j) others *= j == k ? 1.0 : weight(j);
            slopes->col(static_cast<Eigen::Index>(k)) +=
                others / grid.step[static_cast<Eigen::Index>(k)] * node;
          }
        }
        return x;
      };
      MatX slope_low, slope_high;
      for (int corner = 0; corner < (1 << n); ++corner) {
        VecX q = from;
        for (size_t k = 0; k < n; ++k) {
          if (((corner >> k) & 1) != 0)
            q[static_cast<Eigen::Index>(k)] = to[static_cast<Eigen::Index>(k)];
        }
        MatX slopes;
        (void)interpolate(q, &slopes);
        slope_low = corner == 0 ? slopes : slope_low.cwiseMin(slopes).eval();
        slope_high = corner == 0 ? slopes : slope_high.cwiseMax(slopes).eval();
      }
      VecX start = interpolate(0.5 * (from + to), nullptr);
      finder.Place(0.5 * (from + to), &start);
      proved[static_cast<size_t>(c)] =
          prover.Prove(from, to, start, slope_low, slope_high, table.steps);
      if (progress && c % 64 == 0) progress(static_cast<double>(c) / cells.size());
    }
    // The branch of home: from the cell nearest to it over common faces.
    std::vector<bool> connected(proved.size(), false);
    double distance = std::numeric_limits<double>::infinity();
    int first = -1;
    for (int c = 0; c < cells.size(); ++c) {
      if (!proved[static_cast<size_t>(c)]) continue;
      const VecX middle = cells.Point(cells.At(c)) + 0.5 * width;
      const double to = (middle - formulas.closure.home).cwiseQuotient(width).norm();
      if (to >= distance) continue;
      VecX x = formulas.x_home;
      if (!finder.Walk(formulas.closure.home, middle, 64, &x)) continue;
      if ((x - proved[static_cast<size_t>(c)]->centre).cwiseAbs().maxCoeff() > 1e-7) continue;
      distance = to, first = c;
    }
    table.bound = 0.0;
    size_t count = 0;
    if (first >= 0) {
      std::deque<int> next = {first};
      connected[static_cast<size_t>(first)] = true;
      while (!next.empty()) {
        const int from = next.front();
        next.pop_front();
        const ProvedCell& cell = *proved[static_cast<size_t>(from)];
        table.bound = std::max(table.bound, cell.error);
        ++count;
        for (const int to : cells.Beside(from)) {
          const auto t = static_cast<size_t>(to);
          if (connected[t] || !proved[t]) continue;
          const VecX face =
              0.5 * (cells.Point(cells.At(from)) + cells.Point(cells.At(to))) + 0.5 * width;
          VecX here = cell.centre, there = proved[t]->centre;
          if (!finder.Find(face, &here) || !finder.Find(face, &there)) continue;
          if ((here - there).cwiseAbs().maxCoeff() > 1e-7) continue;
          connected[t] = true;
          next.push_back(to);
        }
      }
    }
    table.proved = connected;
    // A finer table is worth it where it proves clearly more.
    if (count > best_count + best_count / 100 || best.proved.empty()) {
      best = table;
      best_count = count;
    } else {
      break;
    }
  }
  return best;
}

}  // namespace mbv
