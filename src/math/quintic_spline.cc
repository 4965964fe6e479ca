#include "math/quintic_spline.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>

#include "base/demand.h"

namespace mbv {
namespace {

constexpr int kDegree = Piecewise::kDegree;
constexpr size_t kOrder = kDegree + 1;  // B-splines that are not zero on an interval
using Row = std::array<double, kOrder>;

// The B-splines on one interval as polynomials of x = (t − left)/width: basis[j][k] x^k.
struct Interval {
  double left = 0.0, width = 0.0;
  size_t first = 0;  // index of the first B-spline
  std::array<Row, kOrder> basis{};

  // Their derivatives of an order at t.
  [[nodiscard]] Row At(double t, int order) const {
    const double x = (t - left) / width;
    Row values{};
    for (size_t j = 0; j < kOrder; ++j) {
      for (int k = kDegree; k >= order; --k) {
        double factor = 1.0;
        for (int d = 0; d < order; ++d) factor *= k - d;
        values[j] = values[j] * x + factor * basis[j][static_cast<size_t>(k)];
      }
      values[j] /= std::pow(width, order);
    }
    return values;
  }
};

// sum += (a + b x) · p
void AddProduct(double a, double b, const Row& p, Row* sum) {
  for (size_t k = 0; k < kOrder; ++k) (*sum)[k] += a * p[k] + (k > 0 ? b * p[k - 1] : 0.0);
}

// The recursion of Cox and de Boor between the knots τ[m] and τ[m+1], on whole polynomials.
Interval MakeInterval(const std::vector<double>& tau, size_t m) {
  Interval interval{.left = tau[m], .width = tau[m + 1] - tau[m], .first = m - kDegree};
  std::array<Row, kOrder> lower{};
  lower[0][0] = 1.0;  // of degree 0: only B_m
  for (size_t degree = 1; degree <= kDegree; ++degree) {
    std::array<Row, kOrder> next{};
    for (size_t j = 0; j < degree; ++j) {  // lower[j] is B_i, i = m − degree + 1 + j
      const size_t i = m + 1 + j - degree;
      const double span = tau[i + degree] - tau[i];
      const double a = (tau[m] - tau[i]) / span, b = interval.width / span;
      AddProduct(a, b, lower[j], &next[j + 1]);
      AddProduct(1.0 - a, -b, lower[j], &next[j]);
    }
    lower = next;
  }
  interval.basis = lower;
  return interval;
}

// A banded triangle R and its right side, fed with rows in the order of their first column.
class BandTriangle {
 public:
  explicit BandTriangle(size_t columns) : rows_(columns + kOrder), right_(columns + kOrder) {}

  void Add(size_t first, Row row, double right) {
    for (size_t k = first; k + kOrder < rows_.size(); ++k) {
      const double r = std::hypot(rows_[k][0], row[0]);
      if (r != 0.0) Rotate(k, r, &row, &right);
      for (size_t c = 0; c + 1 < kOrder; ++c) row[c] = row[c + 1];
      row[kOrder - 1] = 0.0;
      if (std::all_of(row.begin(), row.end(), [](double x) { return x == 0.0; })) return;
    }
  }

  [[nodiscard]] std::vector<double> Solve() const {
    std::vector<double> x(rows_.size(), 0.0);
    for (size_t k = rows_.size() - kOrder; k-- > 0;) {
      double sum = right_[k];
      for (size_t c = 1; c < kOrder; ++c) sum -= rows_[k][c] * x[k + c];
      // A B-spline that no datum sees, in times without any scale, has no share.
      x[k] = rows_[k][0] == 0.0 ? 0.0 : sum / rows_[k][0];
    }
    return x;
  }

  // The band of (RᵀR)⁻¹, row by row from the diagonal on. R (RᵀR)⁻¹ = R⁻ᵀ is a lower triangle with
  // 1/r_kk on its diagonal, which gives each row of the band from those below [Erisman 1975].
  [[nodiscard]] std::vector<Row> InverseBand() const {
    std::vector<Row> inverse(rows_.size(), Row{});
    for (size_t k = rows_.size() - kOrder; k-- > 0;) {
      const double diagonal = rows_[k][0];
      if (diagonal == 0.0) continue;
      for (size_t c = kOrder; c-- > 0;) {
        double sum = c == 0 ? 1.0 / diagonal : 0.0;
        for (size_t m = 1; m < kOrder; ++m) {
          const size_t low = std::min(m, c), high = std::max(m, c);
          sum -= rows_[k][m] * inverse[k + low][high - low];
        }
        inverse[k][c] = sum / diagonal;
      }
    }
    return inverse;
  }

 private:
  // Turns the row into the triangle's row k so that its first element vanishes.
  void Rotate(size_t k, double r, Row* row, double* right) {
    const double co = rows_[k][0] / r, si = (*row)[0] / r;
    for (size_t c = 0; c < kOrder; ++c) {
      const double upper = rows_[k][c];
      rows_[k][c] = co * upper + si * (*row)[c];
      (*row)[c] = co * (*row)[c] - si * upper;
    }
    const double upper = right_[k];
    right_[k] = co * upper + si * *right;
    *right = co * *right - si * upper;
  }

  std::vector<Row> rows_;
  std::vector<double> right_;
};

// Nodes and weights of Gauss on [0, 1], exact for the square of a third derivative.
constexpr double kGauss = 0.7745966692414834;
constexpr std::array<double, 3> kNodes{0.5 - 0.5 * kGauss, 0.5, 0.5 + 0.5 * kGauss};
constexpr std::array<double, 3> kWeights{5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

void AddRoughness(const Interval& interval, double lambda, BandTriangle* triangle) {
  for (size_t g = 0; g < kNodes.size(); ++g) {
    Row row = interval.At(interval.left + kNodes[g] * interval.width, 3);
    const double factor = std::sqrt(lambda * kWeights[g] * interval.width);
    for (double& element : row) element *= factor;
    triangle->Add(interval.first, row, 0.0);
  }
}

Row WeightedRow(const Interval& interval, const SplineDatum& datum) {
  Row row = interval.At(datum.time_s, datum.order);
  for (double& element : row) element *= datum.weight;
  return row;
}

// a (RᵀR)⁻¹ aᵀ: what a datum counts in its own value.
double Leverage(const Interval& interval, const Row& a, const std::vector<Row>& inverse) {
  double sum = 0.0;
  for (size_t i = 0; i < kOrder; ++i) {
    const Row& band = inverse[interval.first + i];
    sum += a[i] * a[i] * band[0];
    for (size_t j = i + 1; j < kOrder; ++j) sum += 2.0 * a[i] * a[j] * band[j - i];
  }
  return sum;
}

// The first and the last knot six times.
std::vector<double> WithEnds(const std::vector<double>& knots) {
  std::vector<double> tau(kDegree, knots.front());
  tau.insert(tau.end(), knots.begin(), knots.end());
  tau.insert(tau.end(), kDegree, knots.back());
  return tau;
}

Piecewise PiecesOf(const std::vector<Interval>& intervals, const std::vector<double>& c,
                   double end_s) {
  Piecewise pieces;
  pieces.outside = Piecewise::Outside::kExtend;
  for (const Interval& interval : intervals) {
    Piecewise::Polynomial polynomial{};
    double scale = 1.0;
    for (size_t k = 0; k < kOrder; ++k, scale /= interval.width) {
      for (size_t j = 0; j < kOrder; ++j) {
        polynomial[k] += scale * c[interval.first + j] * interval.basis[j][k];
      }
    }
    pieces.knots.push_back(interval.left);
    pieces.coefficients.push_back(polynomial);
  }
  pieces.knots.push_back(end_s);
  return pieces;
}

// Rows of (1) and what they give.
class Fitter {
 public:
  Fitter(const std::vector<double>& knots, const std::vector<SplineDatum>& data, double lambda)
      : tau_(WithEnds(knots)), data_(data), triangle_(tau_.size() - kOrder) {
    size_t datum = 0;
    for (size_t m = kDegree; m + kOrder < tau_.size(); ++m) {
      if (tau_[m + 1] == tau_[m]) continue;
      intervals_.push_back(MakeInterval(tau_, m));
      const Interval& interval = intervals_.back();
      const bool last = m + kOrder + 1 == tau_.size();
      for (; datum < data.size() && (last || data[datum].time_s < tau_[m + 1]); ++datum) {
        triangle_.Add(interval.first, WeightedRow(interval, data[datum]),
                      data[datum].weight * data[datum].value);
      }
      ends_.push_back(datum);
      if (lambda > 0.0) AddRoughness(interval, lambda, &triangle_);
    }
    coefficients_ = triangle_.Solve();
  }

  [[nodiscard]] Piecewise spline() const {
    return PiecesOf(intervals_, coefficients_, tau_.back());
  }

  [[nodiscard]] SplineFit Measured() const {
    SplineFit fit{.spline = spline()};
    const std::vector<Row> inverse = triangle_.InverseBand();
    size_t datum = 0;
    for (size_t k = 0; k < intervals_.size(); ++k) {
      const Interval& interval = intervals_[k];
      for (; datum < ends_[k]; ++datum) {
        const Row a = WeightedRow(interval, data_[datum]);
        double error = -data_[datum].weight * data_[datum].value;
        for (size_t j = 0; j < kOrder; ++j) error += a[j] * coefficients_[interval.first + j];
        fit.misfit += error * error;
        fit.parameters += Leverage(interval, a, inverse);
      }
    }
    return fit;
  }

 private:
  const std::vector<double> tau_;
  const std::vector<SplineDatum>& data_;
  BandTriangle triangle_;
  std::vector<Interval> intervals_;
  std::vector<size_t> ends_;  // of each interval's data
  std::vector<double> coefficients_;
};

}  // namespace

std::vector<double> FreeKnots(const std::vector<double>& time_s, bool with_rates) {
  const size_t n = time_s.size();
  MBV_DEMAND(n >= (with_rates ? 3 : kOrder), n);
  std::vector<double> knots = {time_s.front()};
  for (size_t i = 1; i + 1 < n; ++i) {
    const bool beside = i == 1 || i + 2 == n;
    const bool next = i == 2 || i + 3 == n;
    if (with_rates) {
      // Of three rows, the only inner knot is beside both ends.
      if (n > 3) knots.insert(knots.end(), beside ? 1 : 2, time_s[i]);
    } else if (!beside && !next) {
      knots.push_back(time_s[i]);
    }
  }
  knots.push_back(time_s.back());
  return knots;
}

Piecewise FitSpline(const std::vector<double>& knots, const std::vector<SplineDatum>& data,
                    double lambda) {
  return Fitter(knots, data, lambda).spline();
}

SplineFit FitSmooth(const std::vector<double>& knots, const std::vector<SplineDatum>& data,
                    double lambda) {
  return Fitter(knots, data, lambda).Measured();
}

namespace {

// Straights between the points.
struct Straights {
  std::vector<VecX> direction;        // unit
  std::vector<double> length, start;  // start: σ of the first point of each, and of the end

  explicit Straights(const std::vector<VecX>& points) : start{0.0} {
    for (size_t i = 0; i + 1 < points.size(); ++i) {
      const VecX step = points[i + 1] - points[i];
      length.push_back(step.norm());
      direction.push_back(step / length.back());
      start.push_back(start.back() + length.back());
    }
  }
  [[nodiscard]] size_t count() const { return length.size(); }
};

// σ until the speed is reached.
double RampLength(const PolylinePlan& plan) {
  const MotionLimits& l = plan.limits;
  if (!plan.s_curve) return l.v_max * l.v_max / (2.0 * l.a_max);
  const double jerk_s = std::min(l.a_max / l.j_max, std::sqrt(l.v_max / l.j_max));
  return 0.5 * l.v_max * (jerk_s + l.v_max / (l.j_max * jerk_s));
}

PolylineTrouble Overlap(const PolylinePlan& plan, const Straights& straights) {
  for (size_t i = 0; i < straights.count(); ++i) {
    const bool ends = i == 0 || i + 1 == straights.count();
    const double needed = straights.count() == 1 ? 0.0 : (ends ? 1.0 : 2.0) * plan.blend;
    if (needed <= straights.length[i]) continue;
    return {fmt::format("segment {} is {:g} m long, its blends need {:g} m", i, straights.length[i],
                        needed),
            fmt::format("blend: {:g} or less", straights.length[i] * plan.blend / needed)};
  }
  return {};
}

PolylineTrouble Sharp(const PolylinePlan& plan, const Straights& straights) {
  for (size_t i = 0; i + 1 < straights.count(); ++i) {
    const double turn = (straights.direction[i + 1] - straights.direction[i]).norm();
    const double v = plan.limits.v_max;
    const double a = 0.75 * v * v * turn / plan.blend;
    if (a <= plan.limits.a_max) continue;
    return {fmt::format("the corner at point {} takes {:.4g} m/s², which violates a_max = {:g}",
                        i + 1, a, plan.limits.a_max),
            fmt::format("v_max: {:.4g} or less, or blend: {:.4g} or more",
                        v * std::sqrt(plan.limits.a_max / a), plan.blend * a / plan.limits.a_max)};
  }
  return {};
}

PolylineTrouble LongRamps(const PolylinePlan& plan, const Straights& straights) {
  const double ramp = RampLength(plan), r = straights.count() == 1 ? 0.0 : plan.blend;
  const double shortest = straights.count() == 1
                              ? 0.5 * straights.length[0]
                              : std::min(straights.length.front(), straights.length.back()) - r;
  constexpr double kRounding = 1e-9;
  if (ramp <= (1.0 - kRounding) * shortest) return {};
  return {fmt::format("speeding up to v_max = {:g} takes {:.4g} m, the first and the last straight "
                      "have {:.4g} m",
                      plan.limits.v_max, ramp, shortest),
          "a lower v_max, a larger a_max or j_max, or a run-up before the first corner"};
}

// A piece of σ(t) along straight i: x = p_i + d_i (σ − σ_i).
Piecewise::Polynomial OnStraight(const Piecewise::Polynomial& sigma, double p, double d,
                                 double start) {
  Piecewise::Polynomial x;
  for (size_t k = 0; k < x.size(); ++k) x[k] = d * sigma[k];
  x[0] = p + d * (sigma[0] - start);
  return x;
}

class Builder {
 public:
  explicit Builder(const PolylinePlan& plan)
      : plan_(plan),
        straights_(plan.points),
        axes_(static_cast<size_t>(plan.points.front().size())) {}

  std::vector<Piecewise> Build() {
    const double total = straights_.start.back();
    const Piecewise sigma = plan_.s_curve ? SCurve(plan_.start_s, total, plan_.limits)
                                          : Trapezoid(plan_.start_s, total, plan_.limits);
    for (size_t i = 0; i < sigma.coefficients.size(); ++i) {
      AddPiece(sigma.coefficients[i], sigma.knots[i], sigma.knots[i + 1]);
    }
    for (Piecewise& axis : axes_) {
      axis.breaks = axis.knots;
      axis.knots.push_back(sigma.knots.back());
    }
    return std::move(axes_);
  }

 private:
  // Only the part at constant speed goes round corners.
  void AddPiece(Piecewise::Polynomial sigma, double from_s, double to_s) {
    const double v = sigma[1];
    while (IsCruise(sigma) && corner_ + 1 < straights_.count()) {
      const double begin = straights_.start[corner_ + 1] - plan_.blend;
      const double at_s = from_s + (begin - sigma[0]) / v;
      if (at_s >= to_s) break;
      if (at_s > from_s) AddStraight(sigma, from_s);
      AddCorner(at_s, v);
      from_s = at_s + 2.0 * plan_.blend / v;
      sigma[0] = begin + 2.0 * plan_.blend;
      ++corner_;
      if (from_s >= to_s) return;
    }
    AddStraight(sigma, from_s);
  }

  static bool IsCruise(const Piecewise::Polynomial& sigma) {
    return sigma[1] > 0.0 && sigma[2] == 0.0 && sigma[3] == 0.0;
  }

  void AddStraight(const Piecewise::Polynomial& sigma, double from_s) {
    for (size_t k = 0; k < axes_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      axes_[k].knots.push_back(from_s);
      axes_[k].coefficients.push_back(OnStraight(sigma, plan_.points[corner_][row],
                                                 straights_.direction[corner_][row],
                                                 straights_.start[corner_]));
    }
  }

  // (2) in the time since σ_0.
  void AddCorner(double from_s, double v) {
    const double r = plan_.blend, rate = v / (2.0 * r);
    const VecX& d_1 = straights_.direction[corner_];
    const VecX turn = straights_.direction[corner_ + 1] - d_1;
    const VecX x_0 = plan_.points[corner_ + 1] - r * d_1;
    for (size_t k = 0; k < axes_.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double cubic = 2.0 * r * turn[row] * rate * rate * rate;
      axes_[k].knots.push_back(from_s);
      axes_[k].coefficients.push_back(
          {x_0[row], d_1[row] * v, 0.0, cubic, -0.5 * cubic * rate, 0.0});
    }
  }

  const PolylinePlan& plan_;
  const Straights straights_;
  std::vector<Piecewise> axes_;
  size_t corner_ = 0;  // passed; also the straight that is being run
};

}  // namespace

PolylineTrouble TroubleOf(const PolylinePlan& plan) {
  const Straights straights(plan.points);
  for (const auto& find : {Overlap, Sharp, LongRamps}) {
    PolylineTrouble trouble = find(plan, straights);
    if (!trouble.text.empty()) return trouble;
  }
  return {};
}

std::vector<Piecewise> BlendedPolyline(const PolylinePlan& plan) { return Builder(plan).Build(); }

}  // namespace mbv
