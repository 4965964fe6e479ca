#include "features/workspace/trace.h"

#include <fmt/format.h>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <atomic>
#include <boost/math/quadrature/gauss_kronrod.hpp>
#include <boost/math/tools/minima.hpp>
#include <chrono>
#include <cmath>
#include <map>
#include <numbers>
#include <optional>
#include <thread>
#include <utility>

namespace mbv {
namespace {

using Vec2 = Eigen::Vector2d;
using std::numbers::pi;

constexpr int kDegree = 8;               // of the polynomials along a step
constexpr double kTail = 1e-9;           // last coefficients by the size of the set
constexpr double kOnBound = 1e-2;        // of the margins before and behind it
constexpr double kRoundings = 10.0;      // by which a margin at a crossing is off, from what it is
constexpr double kBeyond = 1e-9;         // margins below −this are outside
constexpr double kDip = 1e-8;            // the same between two nodes, by their polynomial
constexpr double kBeside = 1e-6;         // of a difference quotient beside a curve
constexpr double kSlopeOver = 1e-9;      // of one by two values on the way to it, the least
constexpr double kNearlyStraight = 4.0;  // least value on a way by its second difference
constexpr double kSmooth = 0.02;         // of a polynomial on a way, its last coefficient
constexpr int kMostHalvings = 10;        // of such a way
constexpr double kLow = 0.5;         // of a node's value, the least one about it that is looked at
constexpr double kTouch = 1e-10;     // of its values, where it is zero
constexpr double kFlat = 1e-4;       // of a margin's rates where it vanishes twice, the lesser one
constexpr double kOffValley = 1e-6;  // of its slope's rate, the slope there
constexpr double kLeastStep = 1e-7;  // [rad, characteristic lengths]
constexpr double kSmallStep = 5e-5;  // below, rounding may hide the curvature
constexpr double kCurvedStep = 1e-3;
constexpr double kFirstStep = 0.05, kLargestStep = 0.4, kLongerStep = 1.6;
constexpr double kFar = 200.0;                          // a ray that goes on for so long has no end
constexpr int kMostSteps = 20000, kMostArcSteps = 800;  // of a path, of a loop
constexpr double kTip = 1e-4;  // of a solid's height, by which another part's end is farther
constexpr double kUsualStep = 0.05, kMostRounds = 20.0;  // of a loop beyond; by its size
constexpr int kSpreadRows = 6;
constexpr int kRays = 8, kChords = 12;  // from home; from each loop
// Of a solid's section: loops with which it is lost (near an end, where it is only to get farther),
// and steps of one. Where boundaries are all but noise, many sections are lost, one after the
// other.
constexpr size_t kMostLost = 2, kMostLostAtEnd = 1;
constexpr int kMostStepsOfSection = 400;
constexpr size_t kMostSections = 1200;
// Beyond, a volume has the error that it has; a rough one goes on for longer.
constexpr double kRough = 1e-3;
constexpr long kMostClosings = 6000000;
constexpr double kEndsShare = 0.1;            // of the progress
constexpr double kSliver = 1e-3;              // of a part, within which its ends are known
constexpr double kMoved = 0.02;               // of a solid's height, by which its ends have moved
constexpr double kSlab = 1e-6, kWider = 4.0;  // of a solid's height, about a section that is lost
constexpr double kMostSlabs = 0.01, kMostOfSlab = 1e3;
constexpr size_t kNearSections = 2;  // on each side, whose poses begin another one

// Root of a continuous function with different signs at both ends (Illinois), to rounding.
template <typename F>
double Root(const F& f, double a, double fa, double b, double fb, double tolerance) {
  if (fa == 0.0) return a;
  double before = std::abs(b - a);
  for (int i = 0; i < 200 && std::abs(b - a) > tolerance; ++i) {
    double c = b - fb * (b - a) / (fb - fa);
    // Halves where it is slow: at roots of higher order.
    const bool slow = i % 4 == 3 && std::abs(b - a) > 0.25 * before;
    if (i % 4 == 3) before = std::abs(b - a);
    if (!std::isfinite(c) || slow) c = 0.5 * (a + b);
    const double fc = f(c);
    if (!std::isfinite(fc) || fc == 0.0) return c;
    if ((fc < 0.0) != (fb < 0.0)) {
      a = b;
      fa = fb;
    } else {
      fa *= 0.5;
    }
    b = c;
    fb = fc;
  }
  return b;
}

// Interpolation in Chebyshev–Lobatto nodes on [0, 1].
struct Chebyshev {
  std::array<double, kDegree + 1> node{};
  Eigen::MatrixXd area;                 // ∫ l_a l_b′
  Eigen::MatrixXd dense;                // values at these nodes and between any two
  Eigen::RowVectorXd last, one_before;  // coefficients of T_n and T_{n−1}

  Chebyshev() {
    constexpr int n = kDegree, fine = 2 * kDegree;
    Eigen::VectorXd x(n + 1);
    for (int k = 0; k <= n; ++k) {
      x[k] = -std::cos(pi * k / n);
      node.at(static_cast<size_t>(k)) = 0.5 * (1.0 + x[k]);
    }
    // Values and derivatives of the Lagrange polynomials at the fine nodes, by T_j.
    Eigen::MatrixXd V(n + 1, n + 1);
    for (int k = 0; k <= n; ++k) {
      for (int j = 0; j <= n; ++j) V(k, j) = std::cos(j * std::acos(std::clamp(x[k], -1.0, 1.0)));
    }
    const Eigen::MatrixXd coefficients = V.inverse();
    last = coefficients.row(n);
    one_before = coefficients.row(n - 1);
    Eigen::MatrixXd P(fine + 1, n + 1), Q(fine + 1, n + 1);
    Eigen::VectorXd weight(fine + 1);
    for (int k = 0; k <= fine; ++k) {
      const double theta = pi * k / fine;
      for (int j = 0; j <= n; ++j) {
        P(k, j) = std::cos(j * theta);
        const bool end = k == 0 || k == fine;
        Q(k, j) = end ? j * j * (k == 0 || j % 2 == 1 ? 1.0 : -1.0)
                      : j * std::sin(j * theta) / std::sin(theta);
      }
      double sum = 1.0;
      for (int j = 1; j <= fine / 2; ++j) {
        const double b = j == fine / 2 ? 1.0 : 2.0;
        sum -= b / (4.0 * j * j - 1.0) * std::cos(2.0 * j * theta);
      }
      weight[k] = (k == 0 || k == fine ? 1.0 : 2.0) * sum / fine;
    }
    dense = P * coefficients;
    area = dense.transpose() * weight.asDiagonal() * (Q * coefficients);
  }

  // A value at node k of a function that begins with the square, by those at three nodes before.
  [[nodiscard]] double Ahead(const std::array<double, kDegree + 1>& value, size_t k) const {
    double sum = 0.0;
    const size_t first = k > 3 ? k - 3 : 1;
    for (size_t i = first; i < k; ++i) {
      double weight = node.at(k) / node.at(i);
      weight *= weight;
      for (size_t j = first; j < k; ++j) {
        if (j != i) weight *= (node.at(k) - node.at(j)) / (node.at(i) - node.at(j));
      }
      sum += weight * value.at(i);
    }
    return sum;
  }
};
const Chebyshev& Nodes() {
  static const Chebyshev nodes;
  return nodes;
}

struct Hit {
  PlacedPose at;
  int bound = -1;
  VecX way;  // where a margin vanishes twice: the motion that came there; else empty

  [[nodiscard]] bool twice() const { return way.size() > 0; }
};

// Where branches of type 2 cross, parts of a set touch in one pose, and near it the determinant has
// roots close together. The first place between a and b, by polynomials of degree 4 in Chebyshev
// nodes on a way that they follow, where it is negative, or least and zero. NaN of what does not
// close.
constexpr int kOfWay = 4, kOnWay = 32;
struct Gap {
  double at;
  enum class Kind { kNegative, kZero, kLost } kind;  // lost: no polynomial follows the way there
};
template <typename Margin>
std::pair<double, double> LeastOf(const Margin& margin, double a, double b) {
  return boost::math::tools::brent_find_minima(
      [&](double at) {
        const double value = margin(at);
        return std::isfinite(value) ? value : std::numeric_limits<double>::max();
      },
      a, b, 30);
}
template <typename Margin>
std::optional<Gap> FirstGap(const Margin& margin, double a, double m_a, double b, double m_b,
                            int halvings = kMostHalvings) {
  Eigen::Matrix<double, kOfWay + 1, 1> value, c;
  value[0] = m_a;
  value[kOfWay] = m_b;
  const double middle = 0.5 * (a + b), m = value[kOfWay / 2] = margin(middle);
  if (std::min({m_a, m, m_b}) > kNearlyStraight * std::abs(m_a - 2.0 * m + m_b)) {
    return std::nullopt;
  }
  for (const int k : {1, 3}) {
    value[k] = margin(a + (b - a) * 0.5 * (1.0 - std::cos(pi * k / kOfWay)));
  }
  for (int j = 0; j <= kOfWay; ++j) {
    c[j] = 0.0;
    for (int k = 0; k <= kOfWay; ++k) {
      const double weight = k == 0 || k == kOfWay ? 0.5 : 1.0;
      c[j] += weight * value[k] * std::cos(pi * j * (kOfWay - k) / kOfWay) *
              (j == 0 || j == kOfWay ? 1.0 : 2.0) / kOfWay;
    }
  }
  const double off = std::abs(c[kOfWay]);
  if (!value.allFinite() || off > kSmooth * value.cwiseAbs().maxCoeff()) {
    if (halvings == 0) return Gap{a, Gap::Kind::kLost};
    const auto first = FirstGap(margin, a, m_a, middle, m, halvings - 1);
    return first ? first : FirstGap(margin, middle, m, b, m_b, halvings - 1);
  }
  const double zero = kTouch * value.cwiseAbs().maxCoeff();
  const auto place = [&](int i) { return a + (b - a) * i / kOnWay; };
  Eigen::Matrix<double, kOnWay + 1, 1> on;
  for (int i = 0; i <= kOnWay; ++i) {
    const double x = 2.0 * i / kOnWay - 1.0;
    on[i] = c[0] + x * c[1] + (2 * x * x - 1) * c[2] + x * (4 * x * x - 3) * c[3] +
            (8 * x * x * (x * x - 1) + 1) * c[4];
  }
  for (int i = 1; i <= kOnWay; ++i) {
    if (on[i] < -zero && margin(place(i)) < -zero) return Gap{place(i), Gap::Kind::kNegative};
    if (i == kOnWay || on[i] > on[i - 1] || on[i] > on[i + 1]) continue;
    const double curvature = on[i - 1] - 2.0 * on[i] + on[i + 1],
                 slope = 0.5 * (on[i + 1] - on[i - 1]);
    if (on[i] - (curvature > 0.0 ? slope * slope / (2.0 * curvature) : 0.0) >
        2.0 * off + kLow * on[i]) {
      continue;
    }
    const auto [s, least] = LeastOf(margin, place(i - 1), place(i + 1));
    if (least < -zero) return Gap{s, Gap::Kind::kNegative};
    if (least <= zero) return Gap{s, Gap::Kind::kZero};
  }
  return std::nullopt;
}

// Where a margin is least near s, by Newton's method, to rounding: values alone tell it to 1e-8.
template <typename Margin>
double Bottom(const Margin& margin, double s) {
  constexpr double step = 1e-3;
  for (int i = 0; i < 3; ++i) {
    const double a = margin(s - 2 * step), b = margin(s - step), m = margin(s),
                 c = margin(s + step), d = margin(s + 2 * step);
    const double move = step * (a - 8 * b + 8 * c - d) / (-a + 16 * b - 30 * m + 16 * c - d);
    if (!(std::abs(move) < step)) break;
    s -= move;
  }
  return s;
}

Vec2 Turned(const VecX& v) { return {v[1], -v[0]}; }

class Tracer {
 public:
  explicit Tracer(PoseSpace space) : space_(std::move(space)), type2_(space_.type2_bound()) {}

  [[nodiscard]] PoseSpace& space() { return space_; }
  void LoseAfter(size_t loops, int steps) {
    most_lost_ = loops;
    most_steps_ = steps;
  }
  [[nodiscard]] const std::string& trouble() const { return trouble_; }

  [[nodiscard]] Vec2 ScaledAt(const PlacedPose& placed) const {
    return {placed.pose.at[0] / space_.UnitOf(0), placed.pose.at[1] / space_.UnitOf(1)};
  }

  // Along a straight line of the free coordinates to the first bound.
  std::optional<Hit> Walk(const PlacedPose& from, const VecX& ray, double first = 0.0,
                          const VecX& first_along = {}) {
    PlacedPose at = from;
    double h = kFirstStep, length = 0.0;
    const bool in_box = std::ranges::all_of(
        space_.settings().box,
        [](const CoordinateRange& range) { return std::isfinite(range.upper - range.lower); });
    if (first > 0.0) {
      PlacedPose next;
      if (!space_.Step(from, first * first_along, &next)) return std::nullopt;
      if (next.pose.margin.minCoeff() < 0.0) return std::nullopt;
      at = std::move(next);
    }
    for (int i = 0; i < kMostSteps; ++i) {
      const Eigen::PartialPivLU<MatX> lu(at.C_free);
      VecX along = lu.solve(ray);
      if (!along.allFinite()) {
        trouble_ = "poses are lost where the coordinates do not determine them (type 1)";
        return std::nullopt;
      }
      along.normalize();
      PlacedPose next;
      while (!space_.Step(at, h * along, &next)) {
        h *= 0.5;
        if (h < kLeastStep) {
          trouble_ = "poses are lost near a singularity of the constraints";
          return std::nullopt;
        }
      }
      bool leaves = next.pose.margin.minCoeff() < 0.0;
      auto hit = ExitByTypeTwo(at, along, h, next, &leaves);
      if (!hit && leaves) hit = Exit(at, along, h, next);
      if (hit) return hit;
      if (leaves) {
        h *= 0.5;  // it left the branch between both
        if (h >= kLeastStep) continue;
        trouble_ = "poses are lost where a path leaves the set";
        return std::nullopt;
      }
      length += h;
      if (length > kFar && !in_box) {
        unbounded_ = true;
        return std::nullopt;
      }
      at = std::move(next);
      h = std::min(1.5 * h, 0.5 * kLargestStep);
    }
    trouble_ = "a path does not leave the set";
    return std::nullopt;
  }
  [[nodiscard]] bool unbounded() const { return unbounded_; }

  // The boundary's loop through a hit; with `open` (1, −1) only its curve in one direction, to
  // where another margin vanishes.
  TracedLoop Trace(const Hit& start, int open = 0);

  // A way into the set from a pose on the boundary: tangent along the margin's slope.
  [[nodiscard]] VecX Inwards(const Hit& hit) const {
    VecX slope =
        hit.twice() ? VecX(-hit.at.N_free.transpose() * hit.way) : space_.Slope(hit.at, hit.bound);
    return slope.norm() > 0.0 ? VecX(slope.normalized()) : slope;
  }
  [[nodiscard]] bool Knows(const std::vector<TracedLoop>& loops, const Hit& hit) const;
  /// Points that loops have inside, but the set has not, are in holes: their loops. False where
  /// one is lost. Other points become poses.
  bool Probe(const std::vector<Vec2>& points, TracedSection* section,
             std::vector<SpacePose>* inside);
  /// All loops that rays and chords from these poses find.
  bool TraceAll(const std::vector<PlacedPose>& seeds, TracedSection* section,
                std::vector<SpacePose>* inside);

 private:
  // The first bound between a pose inside and one that is not. Margins may vanish several times on
  // the way: again up to where the first root is, until no other one is negative there.
  std::optional<Hit> Exit(const PlacedPose& at, const VecX& along, double h, PlacedPose next) {
    for (size_t i = 0; i <= 2 * space_.bounds().size(); ++i) {
      Hit hit;
      double first = h;
      for (Eigen::Index j = 0; j < next.pose.margin.size(); ++j) {
        if (next.pose.margin[j] >= 0.0) continue;
        const auto margin = [&](double s) {
          PlacedPose there;
          return space_.Step(at, s * along, &there) ? there.pose.margin[j] : kNan;
        };
        const double s =
            Root(margin, 0.0, std::max(at.pose.margin[j], 0.0), h, next.pose.margin[j], 1e-14);
        if (hit.bound >= 0 && s >= first) continue;
        first = s;
        hit.bound = static_cast<int>(j);
      }
      if (hit.bound < 0 || !space_.Step(at, first * along, &hit.at)) return std::nullopt;
      const VecX& margin = hit.at.pose.margin;
      const double size =
          std::max(std::abs(at.pose.margin[hit.bound]), std::abs(next.pose.margin[hit.bound]));
      if (!(std::abs(margin[hit.bound]) < kOnBound * size)) return std::nullopt;
      bool inside = true;
      for (Eigen::Index j = 0; j < margin.size(); ++j) {
        inside = inside && (j == hit.bound || margin[j] >= -kBeyond);
      }
      if (inside) return hit;
      h = first;
      next = std::move(hit.at);
    }
    return std::nullopt;
  }

  // The same where type 2 is reached before; `leaves`: there is such a place, found or not.
  std::optional<Hit> ExitByTypeTwo(const PlacedPose& at, const VecX& along, double h,
                                   const PlacedPose& next, bool* leaves) {
    if (type2_ < 0) return std::nullopt;
    PlacedPose there;
    const auto margin = [&](double s) {
      return space_.Step(at, s * along, &there) ? there.pose.margin[type2_] : kNan;
    };
    const auto gap = FirstGap(margin, 0.0, at.pose.margin[type2_], h, next.pose.margin[type2_]);
    if (!gap || gap->kind == Gap::Kind::kLost) return std::nullopt;
    *leaves = true;
    if (gap->kind == Gap::Kind::kNegative) {
      if (!space_.Step(at, gap->at * along, &there)) return std::nullopt;
      return Exit(at, along, gap->at, std::move(there));
    }
    if (!space_.Step(at, Bottom(margin, gap->at) * along, &there)) return std::nullopt;
    there.pose.margin[type2_] = 0.0;
    if (there.pose.margin.minCoeff() < 0.0) return std::nullopt;  // another bound is before
    Vec2 slope;
    const bool twice = VanishesTwice(there, &slope);
    return Hit{std::move(there), type2_, twice ? VecX(at.N_free * along) : VecX()};
  }

  // The pose on the bound's curve at τ along the tangent t.
  struct Curve {
    const PlacedPose* base;
    int bound;
    VecX t, n;           // n into the set
    double slope, rate;  // of the margin along n: slope + rate τ, about
    bool twice;          // where the margin is least along n: its slope, by its rate along n
  };
  // Of the margin, by five values: it is least within 1e-12 where this is zero.
  bool SlopeAcross(const Curve& curve, double tau, double eta, double* slope) const {
    constexpr double step = 1e-3;
    std::array<double, 5> m{};
    for (const size_t i : {0U, 1U, 3U, 4U}) {
      PlacedPose there;
      const double at = eta + (static_cast<double>(i) - 2.0) * step;
      if (!space_.Step(*curve.base, tau * curve.t + at * curve.n, &there)) return false;
      m.at(i) = there.pose.margin[curve.bound];
    }
    *slope = (m[0] - 8.0 * m[1] + 8.0 * m[3] - m[4]) / (12.0 * step);
    return true;
  }
  // Whether a type-2 margin's slope vanishes with it.
  bool VanishesTwice(const PlacedPose& at, Vec2* slope) const {
    Eigen::Matrix2d H;
    return Curvature(at, Vec2::Zero(), type2_, &H, slope) &&
           slope->norm() < kOffValley * H.cwiseAbs().maxCoeff();
  }
  // Across a curve on which a margin vanishes twice: the direction, to the side of `inside`, and
  // the rate of its slope. False where it does not: where two branches cross, for one.
  bool Valley(const PlacedPose& at, int bound, const VecX& inside, VecX* n, double* rate) const {
    Eigen::Matrix2d H;
    Vec2 slope;
    if (!Curvature(at, Vec2::Zero(), bound, &H, &slope)) return false;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(H);
    *rate = axes.eigenvalues()[1];
    *n = axes.eigenvectors().col(1);
    if (n->dot(at.N_free.transpose() * inside) < 0.0) *n = -*n;
    return std::abs(axes.eigenvalues()[0]) < kFlat * *rate && slope.norm() < kOffValley * *rate;
  }
  // `steep`: about the margin's slope along n there; a better one then.
  bool OnCurve(const Curve& curve, double tau, double* eta, PlacedPose* to,
               double* steep = nullptr) const {
    if (HasRate(space_.bounds()[static_cast<size_t>(curve.bound)].kind)) {
      return space_.StepOn(curve.bound, *curve.base, tau, curve.t, to);
    }
    double x0 = *eta, f0 = 0.0, x1 = *eta;
    // Margins have the rounding of numbers about 1, or of what a determinant is made of.
    const double made_of =
        curve.bound == type2_ ? space_.MarginOfTypeTwo(curve.base->type2_size) : 1.0;
    const double within =
        curve.twice ? 1e-12
                    : std::max(1e-13, 4 * kEps * made_of / (curve.slope + curve.rate * tau));
    for (int i = 0; i < 12; ++i) {
      double f1 = kNan;
      if (curve.twice) {
        if (!SlopeAcross(curve, tau, x1, &f1)) return false;
      }
      if (!space_.Step(*curve.base, tau * curve.t + x1 * curve.n, to)) return false;
      if (!curve.twice) f1 = to->pose.margin[curve.bound];
      double slope = steep != nullptr ? *steep : curve.slope + curve.rate * tau;
      if (i > 0 && f1 != f0) slope = (f1 - f0) / (x1 - x0);
      if (steep != nullptr && std::abs(x1 - x0) > kSlopeOver) *steep = slope;
      const double step = -f1 / slope;
      if (!std::isfinite(step) || std::abs(step) > 0.5) return false;
      if (std::abs(step) < within || f1 == 0.0) {
        *eta = x1;
        return true;
      }
      x0 = x1;
      f0 = f1;
      x1 += step;
      if (std::abs(step) < 1e-9 && i > 0) {  // one more, and that is it
        *eta = x1;
        return space_.Step(*curve.base, tau * curve.t + x1 * curve.n, to);
      }
    }
    return false;
  }

  // Whether another margin is negative within a step, also between two nodes.
  [[nodiscard]] bool Dips(const std::array<PlacedPose, kDegree + 1>& at, int bound) const {
    Eigen::VectorXd margin(kDegree + 1);
    for (Eigen::Index j = 0; j < at[0].pose.margin.size(); ++j) {
      const bool smooth =
          space_.bounds()[static_cast<size_t>(j)].kind != SetBound::Kind::kConstraint;
      if (j == bound || !smooth) continue;
      for (size_t k = 0; k <= kDegree; ++k) {
        margin[static_cast<Eigen::Index>(k)] = at.at(k).pose.margin[j];
      }
      if ((Nodes().dense * margin).minCoeff() < -kDip) return true;
    }
    return false;
  }
  // Where on a step along another bound's curve type 2 is touched, and whether it vanishes twice
  // there. A curve that is touched from the set's side is passed by.
  struct Touch {
    double tau;
    bool twice;
  };
  [[nodiscard]] std::optional<Touch> Touches(const std::array<PlacedPose, kDegree + 1>& at,
                                             const Curve& curve, double h, double eta_end) const {
    Eigen::VectorXd value(kDegree + 1);
    for (size_t k = 0; k <= kDegree; ++k) {
      value[static_cast<Eigen::Index>(k)] = at.at(k).pose.margin[type2_];
    }
    PlacedPose there;
    const auto margin = [&](double tau) {
      double guess = eta_end * std::pow(tau / h, 2);
      return OnCurve(curve, tau, &guess, &there) ? there.pose.margin[type2_] : kNan;
    };
    const Eigen::VectorXd on = Nodes().dense * value;
    const auto place = [&](Eigen::Index i) {
      return 0.5 * h * (1.0 + std::cos(pi * static_cast<double>(i) / (2.0 * kDegree)));
    };
    for (Eigen::Index i = on.size() - 2; i > 0; --i) {
      if (on[i] > on[i - 1] || on[i] > on[i + 1] || on[i] > kLow * std::max(on[i - 1], on[i + 1])) {
        continue;
      }
      auto [tau, least] = LeastOf(margin, place(i + 1), place(i - 1));
      if (std::abs(least) > kTouch * value.cwiseAbs().maxCoeff()) continue;
      tau = Bottom(margin, tau);
      Vec2 slope;
      if (!std::isfinite(margin(tau))) continue;
      const bool twice = VanishesTwice(there, &slope);
      const VecX into = there.N_free.transpose() * (curve.base->N_free * curve.n);
      if (twice || slope.dot(into) < 0.0) return Touch{tau, twice};
    }
    return std::nullopt;
  }
  // Of a margin that is a determinant, by the size of its rows.
  [[nodiscard]] double Rounding(const PlacedPose& at, int bound) const {
    return kEps * std::max(1.0, bound == type2_ ? space_.MarginOfTypeTwo(at.type2_size) : 0.0);
  }
  // Along a bound's curve, as `before` goes.
  [[nodiscard]] static VecX DirectionAt(const PlacedPose& at, const VecX& slope,
                                        const VecX& before) {
    const VecX t = Turned(slope.normalized());
    return (at.N_free * t).dot(before) < 0.0 ? VecX(-t) : t;
  }
  // At a crossing, from one branch to the other one: that ray of it which bounds the set, whose
  // margin ½ xᵀHx is positive between it and the way back. Returns the rate at which the margin's
  // slope along n grows.
  static double BranchOff(const Eigen::Matrix2d& H, const VecX& along, VecX* t, VecX* n) {
    // Directions y with yᵀ H y = 0, by H's axes.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(H);
    const double angle = std::atan(std::sqrt(-axes.eigenvalues()[0] / axes.eigenvalues()[1]));
    const Vec2 a = axes.eigenvectors().col(0), b = axes.eigenvectors().col(1);
    Vec2 w1 = std::cos(angle) * a + std::sin(angle) * b;
    Vec2 w2 = std::cos(angle) * a - std::sin(angle) * b;
    const Vec2 way = along.normalized();
    if (std::abs(w1.dot(way)) > std::abs(w2.dot(way))) std::swap(w1, w2);
    if (way.dot(H * w1) > 0.0) w1 = -w1;
    Vec2 normal(-w1[1], w1[0]);
    if (normal.dot(way) > 0.0) normal = -normal;
    *t = w1;
    *n = normal;
    return std::abs(normal.dot(H * w1));
  }
  // Slope of the bound's margin along n beside the curve.
  [[nodiscard]] double Across(const Curve& curve, double tau, double eta,
                              const PlacedPose& node) const {
    PlacedPose beside;
    if (!space_.Step(*curve.base, tau * curve.t + (eta + kBeside) * curve.n, &beside)) return kNan;
    return (beside.pose.margin[curve.bound] - node.pose.margin[curve.bound]) / kBeside;
  }
  // Second derivatives of a margin beyond a step x from a pose, and its slope there.
  bool Curvature(const PlacedPose& base, const Vec2& x, int bound, Eigen::Matrix2d* H,
                 Vec2* slope) const {
    const auto margins = [&](double h, std::array<std::array<double, 3>, 3>* f, bool corners) {
      for (size_t i = 0; i < 3; ++i) {
        for (size_t j = 0; j < 3; ++j) {
          if (!corners && (i == 1) == (j == 1)) continue;
          PlacedPose there;
          const Vec2 step(h * (static_cast<double>(i) - 1.0), h * (static_cast<double>(j) - 1.0));
          if (!space_.Step(base, x + step, &there)) return false;
          f->at(i).at(j) = there.pose.margin[bound];
        }
      }
      return true;
    };
    constexpr double h = 1e-3, small = 1e-5;
    std::array<std::array<double, 3>, 3> f{}, near{};
    if (!margins(h, &f, true) || !margins(small, &near, false)) return false;
    (*H)(0, 0) = (f[2][1] - 2 * f[1][1] + f[0][1]) / (h * h);
    (*H)(1, 1) = (f[1][2] - 2 * f[1][1] + f[1][0]) / (h * h);
    (*H)(0, 1) = (*H)(1, 0) = (f[2][2] - f[2][0] - f[0][2] + f[0][0]) / (4 * h * h);
    *slope = Vec2(near[2][1] - near[0][1], near[1][2] - near[1][0]) / (2 * small);
    return true;
  }
  // Where two branches of {margin = 0} cross, its slope vanishes: from a point of a curve nearby,
  // at which τ of this curve; second derivatives by steps from the pose found.
  bool Crossing(const Curve& curve, double* tau, double eta, PlacedPose* at,
                Eigen::Matrix2d* H) const {
    Vec2 x = *tau * curve.t + eta * curve.n, slope;
    for (int i = 0; i < 12; ++i) {
      if (!Curvature(*curve.base, x, curve.bound, H, &slope)) return false;
      const Vec2 step = -H->inverse() * slope;
      if (!step.allFinite() || step.norm() > kLargestStep) return false;
      x += step;
      if (step.norm() >= 1e-10) continue;
      *tau = x.dot(Vec2(curve.t));
      return space_.Step(*curve.base, x, at) &&
             Curvature(*at, Vec2::Zero(), curve.bound, H, &slope) && H->determinant() < 0.0;
    }
    return false;
  }

  PoseSpace space_;
  int type2_;  // of its bounds
  size_t most_lost_ = kMostLost;
  int most_steps_ = kMostArcSteps;
  std::string trouble_;
  bool unbounded_ = false;
};

// All nodes of a step; the first one is the base.
TracedLoop Tracer::Trace(const Hit& start, int open) {
  TracedLoop loop;
  Hit here = start;
  const Chebyshev& nodes = Nodes();
  VecX slope = space_.Slope(here.at, here.bound);
  bool twice = false;       // the margin vanishes twice on this curve
  double curvature = kNan;  // rate of its slope across
  if (here.twice()) {
    twice = Valley(here.at, here.bound, -here.way, &slope, &curvature);
    if (!twice) slope.setZero();
  }
  if (!(slope.norm() > 1e-12)) {
    trouble_ =
        "a bound's margin has no slope: " + space_.bounds()[static_cast<size_t>(here.bound)].name;
    return loop;
  }
  VecX t = Turned(slope.normalized());
  if (open < 0) t = -t;
  const Vec2 x_start = ScaledAt(here.at);
  Vec2 along_start = here.at.C_free * t;
  along_start = {along_start[0] / space_.UnitOf(0), along_start[1] / space_.UnitOf(1)};
  along_start.normalize();
  // Is the set to the left? Folds look the same way from both sides, along the motion that rests
  // the coordinates there: another one goes along the boundary, too, and may leave a curved one.
  double left = 0.0;
  {
    VecX into = slope.normalized();
    if (space_.bounds()[static_cast<size_t>(here.bound)].kind == SetBound::Kind::kType1) {
      into = Eigen::JacobiSVD<MatX>(here.at.C_free, Eigen::ComputeFullV).matrixV().rightCols<1>();
      if (into.dot(slope) < 0.0) into = -into;
    }
    PlacedPose in;
    if (!space_.Step(here.at, 1e-3 * into, &in)) return loop;
    const Vec2 d = ScaledAt(in) - x_start;
    left = along_start[0] * d[1] - along_start[1] * d[0] > 0.0 ? 1.0 : -1.0;
  }
  double h = kFirstStep, size = 1e-3;
  double area = 0.0, error = 0.0;
  VecX n = slope.normalized();
  double s0 = twice ? curvature : slope.norm(), rate = 0.0;
  loop.arcs.push_back({here.bound, {here.at.pose.at.head<2>()}});
  // Bounds whose margins vanish all along an arc; it has the first one's name.
  std::vector<bool> same(space_.bounds().size(), true);
  const auto end_arc = [&] {
    const auto least = std::ranges::find(same, true) - same.begin();
    if (loop.arcs.back().points.size() > 1) loop.arcs.back().bound = static_cast<int>(least);
    same.assign(same.size(), true);
  };
  enum class Event { kNone, kCorner, kCloses, kCrossing };
  int idle = 0;                      // corners at the same point
  double turned = 0.0, moved = 0.0;  // by the joints, by the coordinates
  // Longer where joints turn fast, as screws do: no steps are lost, and it goes round once.
  const auto goes_on = [&](int step) {
    return step < most_steps_ ||
           (step < kMostSteps && turned > kUsualStep * step && moved < kMostRounds * size);
  };
  for (int step = 0; goes_on(step); ++step) {
    const Curve curve{&here.at, here.bound, t, n, s0, rate, twice};
    const bool singular =
        !twice && IsSingularity(space_.bounds()[static_cast<size_t>(here.bound)].kind);
    std::array<PlacedPose, kDegree + 1> at;
    at[0] = here.at;
    std::array<double, kDegree + 1> eta{}, steep{s0};
    PlacedPose crossing;
    Eigen::Matrix2d H;
    Event event = Event::kNone;
    int corner = -1;
    bool touches = false;                                       // where a margin vanishes twice
    double flattest = std::numeric_limits<double>::infinity();  // slope of the margin along n
    bool failed = false;
    const char* why = "no pose is near";
    double fits = kLongerStep;  // a step by this one, by the curvature
    // First to find what ends the step, then to its end.
    for (int attempt = 0; attempt < 2; ++attempt) {
      double end = h;
      for (size_t k = 1; k <= kDegree && !failed; ++k) {
        if (attempt > 0 && event == Event::kCrossing && k == kDegree) {
          at.at(k) = crossing;
          break;
        }
        const double tau = h * nodes.node.at(k);
        double e = nodes.Ahead(eta, k);
        steep.at(k) = k == 1 ? s0 + rate * tau
                             : steep.at(k - 1) + (steep.at(k - 1) - steep.at(k - 2)) *
                                                     (nodes.node.at(k) - nodes.node.at(k - 1)) /
                                                     (nodes.node.at(k - 1) - nodes.node.at(k - 2));
        failed = !OnCurve(curve, tau, &e, &at.at(k), &steep.at(k));
        eta.at(k) = e;
        if (failed || attempt > 0) continue;
        const double before = h * nodes.node.at(k - 1);
        double first = std::numeric_limits<double>::infinity();
        const auto find = [&](const auto& value, double f0, double f1) {
          const auto f = [&](double s) {
            double guess = e * std::pow(s / tau, 2);
            PlacedPose there;
            return OnCurve(curve, s, &guess, &there) ? value(there) : kNan;
          };
          return f0 > 0.0 ? Root(f, before, f0, tau, f1, 1e-14) : before;
        };
        for (Eigen::Index j = 0; j < at.at(k).pose.margin.size(); ++j) {
          if (j == here.bound || at.at(k).pose.margin[j] >= -kBeyond) continue;
          const double s = find([&](const PlacedPose& p) { return p.pose.margin[j]; },
                                at.at(k - 1).pose.margin[j], at.at(k).pose.margin[j]);
          if (s >= first) continue;
          first = s;
          corner = static_cast<int>(j);
          event = Event::kCorner;
        }
        const double steep = singular ? Across(curve, tau, e, at.at(k)) : kNan;
        if (steep > 0.0) flattest = std::min(flattest, steep);
        if (steep < 0.0) {
          // Another branch of the same singularity crosses.
          double s = tau;
          if (!Crossing(curve, &s, e, &crossing, &H)) {
            failed = true;
            why = "branches of the singularity that cross are not found";
            break;
          }
          if (s < 0.0 || s > tau + 0.1 * h) {
            failed = true;
            why = "the set is on the other side";
            break;
          }
          if (s < first) {
            first = s;
            event = Event::kCrossing;
          }
        }
        const auto passed = [&](const PlacedPose& p) {
          return -(ScaledAt(p) - x_start).dot(along_start);
        };
        // On another bound, too, that is the same here.
        const Vec2 x_before = ScaledAt(at.at(k - 1)), x = ScaledAt(at.at(k));
        if ((step > 0 || k > 3) && passed(at.at(k - 1)) > 0.0 && passed(at.at(k)) <= 0.0 &&
            (x_start - x_before).norm() < 2.0 * (x - x_before).norm()) {
          const double s = find(passed, passed(at.at(k - 1)), passed(at.at(k)));
          double guess = e * std::pow(s / tau, 2);
          PlacedPose there;
          if (s < first && OnCurve(curve, s, &guess, &there) &&
              (ScaledAt(there) - x_start).norm() < 1e-6 &&
              (here.bound == start.bound || there.pose.margin[start.bound] < kBeyond)) {
            first = s;
            event = Event::kCloses;
          }
        }
        if (event != Event::kNone) {
          end = first;
          break;
        }
      }
      if (!failed && type2_ >= 0 && here.bound != type2_) {
        const bool whole = attempt > 0 || event == Event::kNone;
        const auto touch = whole ? Touches(at, curve, h, eta.back()) : std::nullopt;
        if (touch && attempt == 0) {
          end = touch->tau;
          event = Event::kCorner;
          corner = type2_;
          touches = touch->twice;
        } else if (touch && touch->tau < (1.0 - kBeside) * h) {
          failed = true;
          why = "type 2 is touched";
        }
      }
      if (failed || event == Event::kNone) break;
      if (attempt == 0) h = end;
      if (h < 1e-13) break;
    }
    if (!failed && h >= 1e-13) {
      Eigen::Matrix<double, 2, kDegree + 1> x;
      for (size_t k = 0; k <= kDegree; ++k) {
        x.col(static_cast<Eigen::Index>(k)) = ScaledAt(at.at(k));
      }
      size = std::max(size, (x.colwise() - x_start).colwise().norm().maxCoeff());
      const Vec2 tail =
          (x * nodes.last.transpose()).cwiseAbs() + (x * nodes.one_before.transpose()).cwiseAbs();
      // Near a crossing, where its slope vanishes, the margin's rounding moves the curve.
      const double blur =
          s0 > 0.0
              ? (singular && h < kSmallStep ? kRoundings * Rounding(at[0], here.bound) / flattest
                                            : 0.0)
              : kRoundings * std::abs(here.at.pose.margin[here.bound]) / (rate * h * nodes.node[1]);
      const double curves = tail.maxCoeff() / (kTail * size + blur);
      // Of short steps rounding is more than curvature.
      if (h > kCurvedStep) fits = 0.9 * std::pow(curves, -1.0 / kDegree);
      failed = curves > 1.0 && h > kLeastStep;
      if (failed) why = "it curves too much";
      if (!failed && Dips(at, here.bound)) {
        failed = true;
        why = "another bound is touched";
      }
      if (!failed) {
        const Vec2 span = x.rowwise().maxCoeff() - x.rowwise().minCoeff();
        // From the start: less rounding.
        const Eigen::Matrix<double, 2, kDegree + 1> y = x.colwise() - x_start;
        turned += h;
        moved += (x.col(kDegree) - x.col(0)).norm();
        area += 0.5 * (y.row(0) * nodes.area * y.row(1).transpose() -
                       y.row(1) * nodes.area * y.row(0).transpose())
                          .value();
        error += tail[0] * span[1] + tail[1] * span[0] + 1e-12 * span.norm() * size;
        for (size_t k = 1; k <= kDegree; ++k) {
          loop.arcs.back().points.emplace_back(at.at(k).pose.at.head<2>());
          for (size_t j = 0; j < same.size(); ++j) {
            const double margin = at.at(k).pose.margin[static_cast<Eigen::Index>(j)];
            if (std::abs(margin) > kBeyond) same[j] = static_cast<int>(j) == here.bound;
          }
        }
      }
    }
    if (failed) {
      h *= std::clamp(fits, 0.2, fits < 0.9 ? 0.7 : 0.5);
      if (h < kLeastStep) {
        trouble_ = fmt::format("the boundary on {} is lost at {:.6g}, {:.6g}: {}",
                               space_.bounds()[static_cast<size_t>(here.bound)].name,
                               here.at.pose.at[0], here.at.pose.at[1], why);
        return loop;
      }
      continue;
    }
    idle = h < 1e-13 ? idle + 1 : 0;
    if (idle > static_cast<int>(space_.bounds().size())) {
      trouble_ = fmt::format("the boundary turns round at {:.6g}, {:.6g}", here.at.pose.at[0],
                             here.at.pose.at[1]);
      return loop;
    }
    const VecX carried = here.at.N_free * t, across = here.at.N_free * n;
    VecX along = carried;  // at the last node before a crossing
    if (event == Event::kCrossing && h >= 1e-13) {
      const PlacedPose& last = at[kDegree - 1];
      along = last.N_free * DirectionAt(last, space_.Slope(last, here.bound), carried);
    }
    if (h >= 1e-13) here.at = std::move(at[kDegree]);
    if (event == Event::kCloses) {
      loop.closed = true;
      break;
    }
    if (open != 0 && event != Event::kNone) break;
    s0 = rate = 0.0;
    if (event == Event::kCrossing) {
      rate = BranchOff(H, here.at.N_free.transpose() * along, &t, &n);
      end_arc();
      loop.arcs.push_back({here.bound, {here.at.pose.at.head<2>()}});
      h = kFirstStep;
      continue;
    }
    if (event == Event::kCorner) {
      const VecX old =
          twice ? VecX(here.at.N_free.transpose() * across) : space_.Slope(here.at, here.bound);
      here.bound = corner;
      twice = touches;
      slope = space_.Slope(here.at, corner);
      if (twice && !Valley(here.at, corner, -carried, &slope, &curvature)) {
        trouble_ = fmt::format("branches of {} cross at {:.6g}, {:.6g} on another bound",
                               space_.bounds()[static_cast<size_t>(corner)].name,
                               here.at.pose.at[0], here.at.pose.at[1]);
        return loop;
      }
      t = Turned(slope.normalized());
      if (t.dot(old) < 0.0) t = -t;
      end_arc();
      loop.arcs.push_back({corner, {here.at.pose.at.head<2>()}});
      h = kFirstStep;
    } else if (twice) {
      if (!Valley(here.at, here.bound, across, &slope, &curvature)) {
        trouble_ = fmt::format("branches of {} part at {:.6g}, {:.6g}",
                               space_.bounds()[static_cast<size_t>(here.bound)].name,
                               here.at.pose.at[0], here.at.pose.at[1]);
        return loop;
      }
      t = Turned(slope);
      if ((here.at.N_free * t).dot(carried) < 0.0) t = -t;
      h = std::min(std::min(fits, kLongerStep) * h, kLargestStep);
    } else {
      slope = space_.Slope(here.at, here.bound);
      t = DirectionAt(here.at, slope, carried);
      h = std::min(std::min(fits, kLongerStep) * h, kLargestStep);
    }
    s0 = twice ? curvature : slope.norm();
    n = slope.normalized();
    if (!(s0 > 1e-12)) break;
  }
  end_arc();
  const double unit = space_.UnitOf(0) * space_.UnitOf(1);
  loop.area = left * area * unit;
  loop.error = error * unit;
  if (!loop.closed && open == 0 && trouble_.empty()) {
    trouble_ = fmt::format(
        "the boundary from {:.6g}, {:.6g} on does not come back: singular curves "
        "that cross, or nearly so",
        start.at.pose.at[0], start.at.pose.at[1]);
  }
  return loop;
}

bool Tracer::Knows(const std::vector<TracedLoop>& loops, const Hit& hit) const {
  const Vec2 unit(space_.UnitOf(0), space_.UnitOf(1));
  const Vec2 p = hit.at.pose.at.head<2>().cwiseQuotient(unit);
  for (const TracedLoop& loop : loops) {
    for (const TracedArc& arc : loop.arcs) {
      for (size_t k = 1; k < arc.points.size(); ++k) {
        const Vec2 a = arc.points[k - 1].cwiseQuotient(unit), b = arc.points[k].cwiseQuotient(unit);
        const double length = (b - a).norm();
        const double s =
            length > 0.0 ? std::clamp((p - a).dot(b - a) / (length * length), 0.0, 1.0) : 0.0;
        if ((a + s * (b - a) - p).norm() < 0.1 * length + 1e-9) return true;
      }
    }
  }
  return false;
}

// Even and odd crossings of a line to the right.
bool IsInside(const std::vector<TracedLoop>& loops, const Vec2& p) {
  bool inside = false;
  for (const TracedLoop& loop : loops) {
    for (const TracedArc& arc : loop.arcs) {
      for (size_t k = 1; k < arc.points.size(); ++k) {
        const Vec2 &a = arc.points[k - 1], &b = arc.points[k];
        if ((a[1] > p[1]) == (b[1] > p[1])) continue;
        if (p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])) inside = !inside;
      }
    }
  }
  return inside;
}

// All over a section; another one may lose the neck between two parts, or a hole.
std::vector<Vec2> PointsIn(const TracedSection& section) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  const auto for_each_edge = [&](const auto& f) {
    for (const TracedLoop& loop : section.loops) {
      for (const TracedArc& arc : loop.arcs) {
        for (size_t k = 1; k < arc.points.size(); ++k) f(arc.points[k - 1], arc.points[k]);
      }
    }
  };
  for_each_edge([&](const Vec2& a, const Vec2&) {
    low = std::min(low, a[1]);
    high = std::max(high, a[1]);
  });
  std::vector<Vec2> points;
  for (int row = 0; row < kSpreadRows; ++row) {
    const double y = low + (high - low) * (row + 0.5) / kSpreadRows;
    std::vector<double> crossings;
    for_each_edge([&](const Vec2& a, const Vec2& b) {
      if ((a[1] > y) != (b[1] > y)) {
        crossings.push_back(a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0]));
      }
    });
    std::ranges::sort(crossings);
    for (size_t k = 0; k + 1 < crossings.size(); k += 2) {
      for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
        points.emplace_back(crossings[k] + share * (crossings[k + 1] - crossings[k]), y);
      }
    }
  }
  return points;
}
std::vector<Vec2> MiddlesOfHoles(const TracedSection& section) {
  std::vector<Vec2> middles;
  for (const TracedLoop& loop : section.loops) {
    if (loop.area >= 0.0) continue;
    Vec2 sum = Vec2::Zero();
    double count = 0.0;
    for (const TracedArc& arc : loop.arcs) {
      for (const Vec2& p : arc.points) sum += p;
      count += static_cast<double>(arc.points.size());
    }
    middles.emplace_back(sum / count);
  }
  return middles;
}

bool Tracer::Probe(const std::vector<Vec2>& points, TracedSection* section,
                   std::vector<SpacePose>* inside) {
  const std::vector<SpacePose> known = *inside;
  for (const Vec2& p : points) {
    if (known.empty() || !IsInside(section->loops, p)) continue;
    const auto nearest = std::ranges::min_element(
        known, {}, [&](const SpacePose& pose) { return (pose.at.head<2>() - p).squaredNorm(); });
    PlacedPose from, to;
    VecX target = nearest->at;
    target.head<2>() = p;
    if (!space_.Place(*nearest, &from)) continue;
    if (space_.Close(from, target, &to) && to.pose.margin.minCoeff() > 0.0) {
      inside->push_back(to.pose);
      continue;
    }
    const auto hit = Walk(from, p - Vec2(from.pose.at.head<2>()));
    if (!hit || Knows(section->loops, *hit)) continue;
    trouble_.clear();
    TracedLoop loop = Trace(*hit);
    if (!loop.closed) return false;
    section->area += loop.area;
    section->error += loop.error;
    section->loops.push_back(std::move(loop));
  }
  return true;
}

bool Tracer::TraceAll(const std::vector<PlacedPose>& seeds, TracedSection* section,
                      std::vector<SpacePose>* inside) {
  const bool is_flat = !std::isfinite(section->height);
  std::vector<Hit> chords;  // a pose of each loop
  std::vector<std::pair<Hit, std::string>> lost;
  const auto offer = [&](const Hit& hit) {
    if (Knows(section->loops, hit)) return true;
    trouble_.clear();
    TracedLoop loop = Trace(hit);
    if (!loop.closed) {
      lost.emplace_back(hit, trouble_);
      return false;
    }
    section->loops.push_back(std::move(loop));
    chords.push_back(hit);
    std::erase_if(lost, [&](const auto& other) { return Knows(section->loops, other.first); });
    return true;
  };
  const auto is_lost = [&] { return !is_flat && lost.size() >= most_lost_; };
  for (const PlacedPose& seed : seeds) {
    if (is_lost()) break;
    if (IsInside(section->loops, seed.pose.at.head<2>())) continue;
    inside->push_back(seed.pose);
    // Of a section of a solid one ray is enough; a loop that is lost from here is not from there.
    bool found = false;
    for (int k = 0; k < kRays && (is_flat || !found) && !is_lost(); ++k) {
      const double angle = 0.3 + 2 * pi * k / kRays;
      const VecX ray = Vec2(std::cos(angle) * space_.UnitOf(0), std::sin(angle) * space_.UnitOf(1));
      const auto hit = Walk(seed, ray);
      found = hit && offer(*hit);
    }
  }
  // Chords from points of each loop, found by rays from its first one.
  for (size_t c = 0; c < chords.size() && !is_lost(); ++c) {
    const Hit from = chords[c];
    const VecX in = Inwards(from);
    PlacedPose near;
    double first = 1e-3;
    while (first > 1e-9 &&
           !(space_.Step(from.at, first * in, &near) && near.pose.margin.minCoeff() > 0.0)) {
      first *= 0.1;
    }
    if (first <= 1e-9) continue;
    const int count = is_flat ? kChords : 3;
    for (int k = 0; k < count; ++k) {
      const double angle = 0.1 + 2 * pi * k / count;
      const VecX ray = Vec2(std::cos(angle) * space_.UnitOf(0), std::sin(angle) * space_.UnitOf(1));
      const auto hit = Walk(near, ray);
      if (!hit || !offer(*hit)) continue;
      // Halfway between the two ends.
      PlacedPose half;
      VecX target = near.pose.at;
      target.head<2>() = 0.5 * (near.pose.at.head<2>() + hit->at.pose.at.head<2>());
      if (space_.Close(near, target, &half) && half.pose.margin.minCoeff() > 0.0) {
        inside->push_back(half.pose);
        if (is_flat && k < 4) {
          const VecX across = Vec2(-ray[1] / space_.UnitOf(1) * space_.UnitOf(0),
                                   ray[0] / space_.UnitOf(0) * space_.UnitOf(1));
          for (const double sign : {1.0, -1.0}) {
            const auto other = Walk(half, sign * across);
            if (other) (void)offer(*other);
          }
        }
      }
    }
  }
  section->area = section->error = 0.0;
  for (const TracedLoop& loop : section->loops) {
    section->area += loop.area;
    section->error += loop.error;
  }
  if (!lost.empty()) {
    trouble_ = lost.front().second;
    return false;
  }
  if (section->loops.empty()) return false;
  trouble_.clear();
  return true;
}

// A section of a solid.
struct Found {
  TracedSection section;
  std::vector<SpacePose> inside;
  std::string lost;
  bool unbounded = false;
  long closings = 0;
};
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<Found>& found) {
  visit(found.section), visit(found.inside), visit(found.lost), visit(found.unbounded);
  visit(found.closings);
}

// Sections of a solid and their integral.
class SolidTracer {
 public:
  SolidTracer(const PoseSpace& space, const PlacedPose& home,
              const std::function<void(double)>& progress, double share, int threads, ResultLog log)
      : solid_(space),
        flat_(space.Section(2)),
        progress_(progress),
        share_(share),
        threads_(threads),
        log_(std::move(log)) {
    seeds_.emplace(home.pose.at[2], std::vector<SpacePose>{home.pose});
  }

  TracedSet Trace(const PlacedPose& home) {
    TracedSet set;
    set.low = Climb(home, -1.0);
    Report(0.02);
    set.high = Climb(home, 1.0);
    Report(0.04);
    if (!(set.high > set.low)) {
      set.summary.stop = solid_.unbounded() ? Stop::kUnreachable : Stop::kNoConvergence;
      set.summary.message = Trouble();
      return set;
    }
    (void)Rule({set.low, set.high});
    // Sections anew where an end has moved; a tip more changes them little.
    double low = set.low, high = set.high;
    for (int i = 0; Widen(&set); ++i) {
      Report(kEndsShare * (1.0 - 0.5 / (i + 1)));
      if (std::max(low - set.low, set.high - high) < kMoved * (set.high - set.low)) break;
      PrepareNodes({Part{set.low, set.high}});
      low = set.low;
      high = set.high;
    }
    Integrate(&set);
    if (!lost_.empty()) {
      set.summary.stop = Stop::kNoConvergence;
      set.summary.message = lost_;
    } else {
      set.summary = RunSummary::Done();
      for (const auto& [height, why] : gone_) {
        if (height > set.low && height < set.high) set.gone.push_back(why);
      }
    }
    for (auto& [height, section] : sections_) set.sections.push_back(std::move(section));
    for (const auto& [height, poses] : seeds_) {
      if (!poses.empty()) set.inside.push_back(poses.back());
    }
    set.closings = closings_ + solid_.space().closings();
    return set;
  }
  [[nodiscard]] bool unbounded() const { return solid_.unbounded() || unbounded_; }

 private:
  // Gauss–Kronrod 7, 15, its error as QUADPACK has it [Piessens et al. 1983].
  using Kronrod = boost::math::quadrature::gauss_kronrod<double, 15>;
  // Of the heights. Where an arc begins or ends, the area has a root of the height: nodes by the
  // square of a variable from such an end, or 3u² − 2u³ between two.
  struct Part {
    double a = kNan, b = kNan;
    bool ends_a = false, ends_b = false;
    double slab = kNan;  // left out about a height whose section is lost
    double value = kNan, error = kNan;

    [[nodiscard]] double length() const { return b - a; }
    // Whether a height is one of the rule's nodes.
    [[nodiscard]] bool Has(double height) const {
      for (size_t k = 0; k < Kronrod::abscissa().size(); ++k) {
        if (NodeOf(k, -1.0).first == height || NodeOf(k, 1.0).first == height) return true;
      }
      return false;
    }
    // A height and its rate by the rule's variable, −1 … 1.
    [[nodiscard]] std::pair<double, double> NodeOf(size_t k, double sign) const {
      const double u = 0.5 * (1.0 + sign * Kronrod::abscissa()[k]), v = 1.0 - u;
      if (ends_a && ends_b) return {a + length() * u * u * (1.0 + 2.0 * v), 3 * length() * u * v};
      if (ends_a) return {a + length() * u * u, length() * u};
      if (ends_b) return {b - length() * v * v, length() * v};
      return {a + length() * u, 0.5 * length()};
    }
  };

  void Report(double fraction) const {
    if (progress_) progress_(fraction);
  }
  [[nodiscard]] std::string Trouble() const { return !lost_.empty() ? lost_ : solid_.trouble(); }

  // Up (or down) to the last section that there is.
  double Climb(const PlacedPose& home, double sign) {
    PlacedPose at = home;
    double best = at.pose.at[2], first = 0.0;
    for (int i = 0; i < 60; ++i) {
      const VecX up = sign * solid_.space().UnitOf(2) * VecX::Unit(3, 2);
      const auto hit = solid_.Walk(at, up);
      if (!hit) return kNan;
      const double gain = sign * (hit->at.pose.at[2] - best);
      if (i > 0 && !(gain > 0.0)) break;
      best = hit->at.pose.at[2];
      first = std::max(first, gain);
      if (i > 0 && gain < 1e-7 * first) break;
      // A little below, where there is room, from the pose that gets highest.
      const double below = best - sign * std::max(1e-3 * gain, 1e-9 * first);
      PlacedPose low;
      VecX target = at.pose.at;
      target[2] = below;
      if (!solid_.space().Close(at, target, &low) || low.pose.margin.minCoeff() < 0.0) break;
      seeds_[below].push_back(low.pose);
      (void)AreaAt(below, true);
      at = low;
      double highest = -std::numeric_limits<double>::infinity();
      for (const SpacePose& pose : seeds_[below]) {
        PlacedPose from;
        if (!solid_.space().Place(pose, &from)) continue;
        const auto top = solid_.Walk(from, up);
        if (!top || sign * top->at.pose.at[2] <= highest) continue;
        highest = sign * top->at.pose.at[2];
        at = from;
      }
    }
    return best;
  }

  // Up and down from all poses that are known: other parts may reach farther.
  bool Widen(TracedSet* set) {
    bool wider = false;
    for (const double sign : {-1.0, 1.0}) {
      double& end = sign < 0.0 ? set->low : set->high;
      // From poses from which none was sought before, each by itself.
      std::vector<const SpacePose*> fresh;
      for (const auto& [height, poses] : seeds_) {
        size_t& walked = walked_.at(sign < 0.0 ? 0 : 1)[height];
        for (; walked < poses.size(); ++walked) fresh.push_back(&poses[walked]);
      }
      std::vector<double> tops(fresh.size(), kNan);
      std::atomic<long> closed = 0;
      std::atomic<bool> endless = false;
      OnThreads(fresh.size(), threads_, [&](size_t i) {
        Tracer tracer = solid_;
        const long before = tracer.space().closings();
        PlacedPose from;
        if (tracer.space().Place(*fresh[i], &from)) {
          const auto top = tracer.Walk(from, sign * tracer.space().UnitOf(2) * VecX::Unit(3, 2));
          if (top) tops[i] = top->at.pose.at[2];
        }
        closed += tracer.space().closings() - before;
        if (tracer.unbounded()) endless = true;
      });
      closings_ += closed;
      unbounded_ = unbounded_ || endless;
      PlacedPose best;
      double farthest = end + sign * kTip * (set->high - set->low);
      for (size_t i = 0; i < fresh.size(); ++i) {
        PlacedPose from;
        if (!(sign * (tops[i] - farthest) > 0.0) || !solid_.space().Place(*fresh[i], &from)) {
          continue;
        }
        farthest = tops[i];
        best = from;
      }
      if (best.N.size() == 0) continue;
      const double other = Climb(best, sign);
      if (std::isfinite(other) && sign * (other - end) > 0.0) {
        end = other;
        wider = true;
      }
    }
    return wider;
  }

  // To a pose of another section, not across type 2 by way of a pose where its branches cross.
  [[nodiscard]] static bool Rises(const PoseSpace& flat, const PlacedPose& from, const VecX& target,
                                  PlacedPose* to) {
    if (!flat.Close(from, target, to) || !(to->pose.margin.minCoeff() > 0.0)) return false;
    const int type2 = flat.type2_bound();
    if (type2 < 0) return true;
    const auto margin = [&](double s) {
      PlacedPose there;
      const VecX at = from.pose.at + s * (target - from.pose.at);
      return flat.Close(from, at, &there) ? there.pose.margin[type2] : kNan;
    };
    return !FirstGap(margin, 0.0, from.pose.margin[type2], 1.0, to->pose.margin[type2]);
  }

  // Poses of the nearest sections on both sides, carried over to a height.
  [[nodiscard]] std::vector<PlacedPose> SeedsAt(double height, const PoseSpace& flat) const {
    std::vector<PlacedPose> seeds;
    const auto offer = [&](const std::vector<SpacePose>& poses) {
      for (const SpacePose& pose : poses) {
        PlacedPose from, to;
        VecX target = pose.at;
        target[2] = height;
        if (flat.Place(pose, &from) && Rises(flat, from, target, &to)) {
          seeds.push_back(std::move(to));
        }
      }
    };
    auto above = seeds_.lower_bound(height), below = above;
    for (size_t k = 0; above != seeds_.end() && (k < kNearSections || seeds.empty()); ++k) {
      offer((above++)->second);
    }
    const size_t found = seeds.size();
    for (size_t k = 0; below != seeds_.begin() && (k < kNearSections || seeds.size() == found);
         ++k) {
      offer((--below)->second);
    }
    return seeds;
  }

  // Margins count from a pose of the section: by those at home their size may be anything.
  static void CountFromFirst(Tracer* tracer, std::vector<PlacedPose>* seeds) {
    if (seeds->empty()) return;
    tracer->space().CountFrom(&seeds->front());
    for (PlacedPose& seed : *seeds) {
      const SpacePose pose = seed.pose;
      (void)tracer->space().Place(pose, &seed);
    }
  }
  // Traces what a section does not have yet around these poses.
  static void Extend(Tracer* tracer, const std::vector<PlacedPose>& seeds,
                     const std::vector<Vec2>& holes, Found* found) {
    if (!seeds.empty() || !holes.empty()) {
      const bool traced =
          (seeds.empty() || tracer->TraceAll(seeds, &found->section, &found->inside)) &&
          tracer->Probe(holes, &found->section, &found->inside);
      if (!traced && found->lost.empty()) {
        found->lost =
            fmt::format("section at {:.6g}: {}", found->section.height, tracer->trouble());
      }
      found->unbounded = tracer->unbounded();
    }
  }
  static void Append(const std::vector<Vec2>& more, std::vector<Vec2>* points) {
    points->insert(points->end(), more.begin(), more.end());
  }
  [[nodiscard]] Found TraceAt(double height, bool at_end = false) const {
    Tracer tracer = flat_;
    tracer.LoseAfter(at_end ? kMostLostAtEnd : kMostLost, kMostStepsOfSection);
    const long before = tracer.space().closings();
    tracer.space().Hold(2, height);
    Found found;
    found.section.height = height;
    std::vector<PlacedPose> seeds = SeedsAt(height, tracer.space());
    CountFromFirst(&tracer, &seeds);
    Extend(&tracer, seeds, {}, &found);
    std::vector<Vec2> points = PointsIn(found.section);
    const auto above = sections_.lower_bound(height);
    if (above != sections_.end()) Append(MiddlesOfHoles(above->second), &points);
    if (above != sections_.begin()) Append(MiddlesOfHoles(std::prev(above)->second), &points);
    Extend(&tracer, {}, points, &found);
    found.closings = tracer.space().closings() - before;
    return found;
  }
  void Keep(Found found) {
    const double height = found.section.height;
    closings_ += found.closings;
    unbounded_ = unbounded_ || found.unbounded;
    if (!found.lost.empty()) {
      gone_[height] = found.lost;
      return;
    }
    auto& poses = seeds_[height];
    poses.insert(poses.end(), found.inside.begin(), found.inside.end());
    sections_[height] = std::move(found.section);
    // What is near and has no such part has it now.
    std::vector<double> changed = {height};
    while (!changed.empty()) {
      const auto at = sections_.find(changed.back());
      changed.pop_back();
      if (at == sections_.end()) continue;
      std::vector<std::map<double, TracedSection>::iterator> beside;
      if (at != sections_.begin()) beside.push_back(std::prev(at));
      if (std::next(at) != sections_.end()) beside.push_back(std::next(at));
      auto extended = log_.Get<std::vector<Found>>([&] {
        std::vector<Found> more(beside.size());
        OnThreads(more.size(), threads_,
                  [&](size_t i) { more[i] = Extended(at->second, beside[i]->second); });
        return more;
      });
      for (size_t i = 0; i < extended.size(); ++i) {
        Found& more = extended[i];
        const auto other = beside[i];
        closings_ += more.closings;
        if (!more.lost.empty()) {  // a part of it is not known: it is gone
          gone_[other->first] = more.lost;
          seeds_.erase(other->first);
          sections_.erase(other);
          completed_ = true;
          continue;
        }
        if (more.section.loops.size() > other->second.loops.size()) {
          other->second = std::move(more.section);
          seeds_[other->first] = std::move(more.inside);
          changed.push_back(other->first);
          completed_ = true;
        }
      }
    }
  }
  // A section with those parts and holes of its neighbour that it does not have yet.
  [[nodiscard]] Found Extended(const TracedSection& neighbour, const TracedSection& section) const {
    Tracer tracer = flat_;
    tracer.LoseAfter(kMostLost, kMostStepsOfSection);
    const long before = tracer.space().closings();
    tracer.space().Hold(2, section.height);
    std::vector<PlacedPose> seeds;
    for (const SpacePose& pose : seeds_.at(neighbour.height)) {
      PlacedPose from, to;
      VecX target = pose.at;
      target[2] = section.height;
      if (tracer.space().Place(pose, &from) && Rises(tracer.space(), from, target, &to) &&
          !IsInside(section.loops, to.pose.at.head<2>())) {
        seeds.push_back(std::move(to));
      }
    }
    CountFromFirst(&tracer, &seeds);
    Found more{section, seeds_.at(section.height), {}};
    Extend(&tracer, seeds, MiddlesOfHoles(neighbour), &more);
    more.closings = tracer.space().closings() - before;
    return more;
  }

  double AreaAt(double height, bool at_end = false) {
    if (!lost_.empty()) return 0.0;
    if (!sections_.contains(height) && !gone_.contains(height)) {
      Keep(log_.Get<Found>([&] { return TraceAt(height, at_end); }));
    }
    const auto at = sections_.find(height);
    return at == sections_.end() ? kNan : at->second.area;
  }
  // All of the nodes of these parts at once.
  void PrepareNodes(const std::vector<Part>& parts) {
    std::vector<double> heights;
    for (const Part& part : parts) {
      for (size_t k = 0; k < Kronrod::abscissa().size(); ++k) {
        for (const double sign : {-1.0, 1.0}) {
          if (k == 0 && sign > 0.0) continue;
          heights.push_back(part.NodeOf(k, sign).first);
        }
      }
    }
    Prepare(heights);
  }
  // Sections at once, from what is known before.
  void Prepare(std::vector<double> heights) {
    std::erase_if(heights, [&](double h) { return sections_.contains(h) || gone_.contains(h); });
    if (!lost_.empty() || heights.empty()) return;
    auto found = log_.Get<std::vector<Found>>([&] {
      std::vector<Found> traced(heights.size());
      OnThreads(heights.size(), threads_, [&](size_t i) { traced[i] = TraceAt(heights[i]); });
      return traced;
    });
    for (Found& one : found) Keep(std::move(one));
  }

  Part Rule(Part part) {
    using Gauss = boost::math::quadrature::gauss<double, 7>;
    double kronrod = 0.0, gauss = 0.0, spread = 0.0;
    std::vector<std::pair<double, double>> values;
    // From the middle on; every other node is Gauss's.
    for (size_t k = 0; k < Kronrod::abscissa().size(); ++k) {
      const double weight = Kronrod::weights()[k];
      for (const double sign : {-1.0, 1.0}) {
        if (k == 0 && sign > 0.0) continue;
        const auto [height, rate] = part.NodeOf(k, sign);
        const double y = AreaAt(height) * rate;
        values.emplace_back(weight, y);
        kronrod += weight * y;
        if (k % 2 == 0) gauss += Gauss::weights()[k / 2] * y;
      }
    }
    for (const auto& [weight, y] : values) spread += weight * std::abs(y - 0.5 * kronrod);
    double error = std::abs(kronrod - gauss);
    if (spread > 0.0 && !GapOf(part))
      error = spread * std::min(1.0, std::pow(200.0 * error / spread, 1.5));
    part.value = kronrod;
    part.error = error;
    return part;
  }

  // Rules of parts whose sections are all there. About a height whose section is lost a slab is
  // left out, wider where the next one is lost, too: such sections lie where the boundary changes,
  // and areas have roots of the height there.
  std::vector<Part> Settle(std::vector<Part> parts, const TracedSet& set) {
    std::vector<Part> settled;
    while (!parts.empty() && lost_.empty()) {
      PrepareNodes(parts);
      std::vector<Part> rest;
      for (const Part& part : parts) {
        const Part ruled = Rule(part);
        if (std::isfinite(ruled.value)) {
          settled.push_back(ruled);
          continue;
        }
        const auto first = gone_.lower_bound(part.a);
        const auto at = std::find_if(first, gone_.end(),
                                     [&](const auto& gone) { return part.Has(gone.first); });
        if (at == gone_.end()) {
          lost_ = fmt::format("sections between {:.6g} and {:.6g} have no area", part.a, part.b);
          break;
        }
        const double h = at->first;
        // As much volume wherever it is: wide where sections are small.
        const double near = LargestArea(h, h), largest = LargestArea(set.low, set.high);
        const double share = near > 0.0 ? std::clamp(largest / near, 1.0, kMostOfSlab) : 1.0;
        const double slab = std::max(kSlab * share * (set.high - set.low),
                                     std::isfinite(part.slab) ? kWider * part.slab : 0.0);
        const double low = h - slab, high = h + slab;
        slabs_.emplace_back(std::max(part.a, low), std::min(part.b, high));
        double width = 0.0;
        for (const auto& [a, b] : slabs_) width += b - a;
        if (width > kMostSlabs * (set.high - set.low) || closings_ >= kMostClosings) {
          lost_ = at->second;
        }
        if (low > part.a) rest.push_back({part.a, low, part.ends_a, true, slab});
        if (high < part.b) rest.push_back({high, part.b, true, part.ends_b, slab});
      }
      parts = std::move(rest);
    }
    return settled;
  }
  // Of the sections from a to b, and of those next to them.
  [[nodiscard]] double LargestArea(double a, double b) const {
    double area = 0.0;
    auto at = sections_.lower_bound(a);
    if (at != sections_.begin()) --at;
    for (; at != sections_.end(); ++at) {
      area = std::max(area, at->second.area);
      if (at->first >= b) break;
    }
    return area;
  }
  // Volume of what was left out, and all of it as its error.
  [[nodiscard]] double VolumeOfSlabs() const {
    double sum = 0.0;
    for (const auto& [a, b] : slabs_) sum += (b - a) * LargestArea(a, b);
    return sum;
  }

  // Which bounds follow each other around a section.
  [[nodiscard]] static std::vector<std::pair<int, int>> CornersOf(const TracedSection& section) {
    std::vector<std::pair<int, int>> corners;
    for (const TracedLoop& loop : section.loops) {
      corners.emplace_back(-2, -2);
      for (size_t k = 0; k < loop.arcs.size(); ++k) {
        const int a = loop.arcs[k].bound, b = loop.arcs[(k + 1) % loop.arcs.size()].bound;
        if (a != b) corners.emplace_back(std::min(a, b), std::max(a, b));
      }
    }
    std::ranges::sort(corners);
    return corners;
  }
  // The widest gap of a part's sections where they have other corners from one height on.
  [[nodiscard]] std::optional<std::pair<double, double>> GapOf(const Part& part) const {
    std::optional<std::pair<double, double>> widest;
    for (auto below = sections_.lower_bound(part.a); below != sections_.end(); ++below) {
      const auto above = std::next(below);
      if (above == sections_.end() || above->first > part.b) break;
      const double low = below->first, high = above->first, middle = 0.5 * (low + high);
      if (std::min(middle - part.a, part.b - middle) < kSliver * part.length() ||
          (widest && high - low <= widest->second - widest->first) ||
          CornersOf(below->second) == CornersOf(above->second)) {
        continue;
      }
      widest = {low, high};
    }
    return widest;
  }
  // Halves of a part, or two parts where its sections change.
  std::pair<Part, Part> Split(const Part& part) {
    auto gap = GapOf(part);
    if (!gap) {
      const double middle = 0.5 * (part.a + part.b);
      return {{part.a, middle, part.ends_a, false, part.slab},
              {middle, part.b, false, part.ends_b, part.slab}};
    }
    while (gap->second - gap->first > 0.1 * kSliver * part.length()) {
      const auto [low, high] = *gap;
      const std::vector<double> heights = {0.75 * low + 0.25 * high, 0.5 * (low + high),
                                           0.25 * low + 0.75 * high};
      Prepare(heights);
      if (!lost_.empty()) break;
      const auto from = CornersOf(sections_.at(low));
      for (const double height : heights) {
        // One that is lost is where they change.
        const auto section = sections_.find(height);
        if (section == sections_.end() || CornersOf(section->second) != from) {
          gap->second = height;
          break;
        }
        gap->first = height;
      }
    }
    const double at = 0.5 * (gap->first + gap->second);
    return {{part.a, at, part.ends_a, true, part.slab}, {at, part.b, true, part.ends_b, part.slab}};
  }

  void Integrate(TracedSet* set) {
    std::vector<Part> parts = Settle({Part{set->low, set->high}}, *set);
    while (std::exchange(completed_, false)) parts = Settle(std::move(parts), *set);
    const auto sum = [&](double Part::*member) {
      double total = 0.0;
      for (const Part& part : parts) total += part.*member;
      return total;
    };
    const double start = sum(&Part::error);
    const auto enough = [&] {
      const double error = sum(&Part::error), value = sum(&Part::value);
      return error <= share_ * value ||
             closings_ >= (error > kRough * value ? kMostClosings : kEnoughClosings);
    };
    while (!enough() && !parts.empty() && sections_.size() < kMostSections && lost_.empty()) {
      const auto worst = std::ranges::max_element(parts, {}, &Part::error);
      const auto [lower, upper] = Split(*worst);
      const std::vector<Part> halves = Settle({lower, upper}, *set);
      parts.erase(worst);
      parts.insert(parts.end(), halves.begin(), halves.end());
      while (std::exchange(completed_, false)) parts = Settle(std::move(parts), *set);
      if (progress_ && start > 0.0) {
        const double done = std::log(start / std::max(sum(&Part::error), 1e-300)) /
                            std::log(start / (share_ * sum(&Part::value)));
        const double closed =
            static_cast<double>(closings_) /
            (sum(&Part::error) > kRough * sum(&Part::value) ? kMostClosings : kEnoughClosings);
        Report(kEndsShare + (1.0 - kEndsShare) * std::clamp(std::max(done, closed), 0.0, 1.0));
      }
    }
    const double slabs = VolumeOfSlabs();
    set->measure = sum(&Part::value) + slabs;
    set->error = sum(&Part::error) + slabs;
    double largest = 0.0;
    for (const auto& [height, section] : sections_) largest = std::max(largest, section.error);
    set->error += largest * (set->high - set->low);
  }

  Tracer solid_, flat_;
  std::function<void(double)> progress_;
  const double share_;
  const int threads_;
  ResultLog log_;
  std::map<double, std::vector<SpacePose>> seeds_;
  std::array<std::map<double, size_t>, 2> walked_;  // of them, down and up
  std::map<double, TracedSection> sections_;
  std::map<double, std::string> gone_;            // heights without a section, and why
  std::vector<std::pair<double, double>> slabs_;  // left out
  std::string lost_;                              // all of it, and why
  long closings_ = 0;
  bool completed_ = false, unbounded_ = false;
};

}  // namespace

std::vector<TracedArc> TraceInside(const PoseSpace& space, int bound,
                                   const std::vector<std::pair<SpacePose, SpacePose>>& across) {
  Tracer tracer(space);
  std::vector<TracedLoop> found;
  std::vector<TracedArc> arcs;
  for (const auto& [in, out] : across) {
    PlacedPose from;
    if (!space.Place(in, &from)) continue;
    const VecX ray = (out.at - in.at).head(2);
    const auto hit = tracer.Walk(from, ray);
    if (!hit || hit->bound != bound || tracer.Knows(found, *hit)) continue;
    for (const int open : {1, -1}) {
      TracedLoop part = tracer.Trace(*hit, open);
      if (part.arcs.empty()) continue;
      arcs.push_back(part.arcs.front());
      found.push_back(std::move(part));
      if (found.back().closed) break;
    }
  }
  return arcs;
}

namespace {

TracedSet Unbounded(TracedSet set) {
  set.summary.stop = Stop::kUnreachable;
  set.summary.message = "the set has no end: no range, box or singularity bounds it";
  return set;
}

TracedSet TraceLine(const PoseSpace& space, const PlacedPose& home) {
  TracedSet set;
  Tracer tracer(space);
  set.inside.push_back(home.pose);
  for (const double sign : {-1.0, 1.0}) {
    const auto hit = tracer.Walk(home, VecX::Constant(1, sign));
    if (tracer.unbounded()) return Unbounded(set);
    if (!hit) {
      set.summary.stop = Stop::kNoConvergence;
      set.summary.message = tracer.trouble();
      return set;
    }
    set.ends.emplace_back(hit->at.pose.at[0], hit->bound);
  }
  set.measure = set.ends[1].first - set.ends[0].first;
  set.error = 1e-12 * space.UnitOf(0);
  set.closings = tracer.space().closings();
  set.summary = RunSummary::Done();
  return set;
}

TracedSet TraceArea(const PoseSpace& space, const std::vector<PlacedPose>& seeds, double height) {
  TracedSet set;
  Tracer tracer(space);
  TracedSection section;
  section.height = height;
  const bool found = tracer.TraceAll(seeds, &section, &set.inside) &&
                     tracer.Probe(PointsIn(section), &section, &set.inside);
  if (tracer.unbounded()) return Unbounded(set);
  set.closings = tracer.space().closings();
  if (!found) {
    set.summary.stop = Stop::kNoConvergence;
    set.summary.message = tracer.trouble();
    return set;
  }
  set.measure = section.area;
  set.error = section.error;
  set.sections.push_back(std::move(section));
  set.summary = RunSummary::Done();
  return set;
}

}  // namespace

void OnThreads(size_t count, int threads, const std::function<void(size_t)>& work) {
  std::atomic<size_t> next = 0;
  const auto run = [&] {
    for (size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::thread> others;
  for (int t = 1; t < threads && static_cast<size_t>(t) < count; ++t) others.emplace_back(run);
  run();
  for (std::thread& other : others) other.join();
}

TracedSet TraceFrom(const PoseSpace& space, const std::vector<PlacedPose>& inside, double height) {
  return space.over() == 1 ? TraceLine(space, inside.front()) : TraceArea(space, inside, height);
}

std::optional<SpacePose> EndOfWay(const PoseSpace& space, const PlacedPose& from, const VecX& ray) {
  const auto hit = Tracer(space).Walk(from, ray);
  return hit ? std::optional(hit->at.pose) : std::nullopt;
}

TracedArc Resampled(const TracedArc& arc, int finer) {
  TracedArc fine{arc.bound, {}};
  if (arc.points.empty()) return fine;
  // Barycentric weights of Chebyshev–Lobatto nodes.
  const auto& node = Nodes().node;
  Eigen::MatrixXd weight(kDegree * finer, kDegree + 1);
  for (int i = 0; i < kDegree * finer; ++i) {
    const double s = 0.5 * (1.0 - std::cos(pi * (i + 1) / (kDegree * finer)));
    for (int k = 0; k <= kDegree; ++k) {
      const double w = (k % 2 == 0 ? 1.0 : -1.0) * (k == 0 || k == kDegree ? 0.5 : 1.0);
      const double off = s - node.at(static_cast<size_t>(k));
      if (std::abs(off) < 1e-14) {
        weight.row(i).setZero();
        weight(i, k) = 1.0;
        break;
      }
      weight(i, k) = w / off;
    }
    weight.row(i) /= weight.row(i).sum();
  }
  fine.points.push_back(arc.points[0]);
  for (size_t first = 0; first + kDegree < arc.points.size(); first += kDegree) {
    Eigen::Matrix<double, kDegree + 1, 2> x;
    for (size_t k = 0; k <= kDegree; ++k) {
      x.row(static_cast<Eigen::Index>(k)) = arc.points[first + k].transpose();
    }
    const Eigen::MatrixXd y = weight * x;
    for (Eigen::Index i = 0; i < y.rows(); ++i) fine.points.emplace_back(y.row(i).transpose());
  }
  return fine;
}

TracedSet TraceSet(const PoseSpace& space, const PlacedPose& home,
                   const std::function<void(double)>& progress, double share, int threads,
                   ResultLog log) {
  const auto start = std::chrono::steady_clock::now();
  TracedSet set;
  if (space.over() < 3) {
    set = log.Get<TracedSet>([&] { return TraceFrom(space, {home}); });
  } else {
    SolidTracer tracer(space, home, progress, share, threads, std::move(log));
    set = tracer.Trace(home);
    if (tracer.unbounded()) set = Unbounded(std::move(set));
  }
  set.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return set;
}

}  // namespace mbv
