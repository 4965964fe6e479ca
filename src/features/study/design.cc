#include "features/study/design.h"

#include <Eigen/Dense>
#include <algorithm>
#include <bit>
#include <boost/math/special_functions/erf.hpp>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/demand.h"

namespace mbv {
namespace {

struct QuantileOf {
  double u;

  double operator()(const Normal& normal) const {
    return normal.mean - normal.sigma * std::numbers::sqrt2 * boost::math::erfc_inv(2.0 * u);
  }
  double operator()(const Uniform& uniform) const {
    return uniform.lower + u * (uniform.upper - uniform.lower);
  }
  double operator()(const Levels& levels) const {
    const auto count = static_cast<double>(levels.values.size());
    return levels.values[static_cast<size_t>(std::min(std::floor(u * count), count - 1.0))];
  }
};

struct ExcursionsOf {
  std::vector<double> operator()(const Normal& normal) const {
    return {normal.mean - normal.sigma, normal.mean + normal.sigma};
  }
  std::vector<double> operator()(const Uniform& uniform) const {
    return {uniform.lower, uniform.upper};
  }
  std::vector<double> operator()(const Levels& levels) const { return levels.values; }
};

}  // namespace

double Quantile(const Distribution& distribution, double u) {
  return std::visit(QuantileOf{u}, distribution);
}

std::vector<double> Excursions(const Distribution& distribution) {
  return std::visit(ExcursionsOf{}, distribution);
}

namespace {

constexpr std::uint64_t kMostPoints = std::numeric_limits<std::uint64_t>::max();

std::uint64_t SaturatedProduct(std::uint64_t a, std::uint64_t b) {
  return b != 0 && a > kMostPoints / b ? kMostPoints : a * b;
}

}  // namespace

// Sobol's sequence by number, its first point (zero) included: without it, 2^m points would not be
// a net [Owen 2020, "On dropping the first Sobol' point"].
struct DesignPoints::Sequence {
  explicit Sequence(size_t dimensions) : engine(dimensions), size(dimensions) {}

  std::vector<std::uint64_t> At(std::uint64_t number) {
    std::vector<std::uint64_t> bits(size, 0);
    if (number == 0) return bits;
    engine.seed(number - 1);  // Boost leaves zero out
    for (std::uint64_t& coordinate : bits) coordinate = engine();
    return bits;
  }

  boost::random::sobol engine;
  size_t size;
};

Eigen::MatrixXd CorrelationMatrix(const Design& design, size_t axes) {
  const auto size = static_cast<Eigen::Index>(axes);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Identity(size, size);
  for (const Correlation& c : design.correlations) {
    const auto i = static_cast<Eigen::Index>(c.first), j = static_cast<Eigen::Index>(c.second);
    matrix(i, j) = matrix(j, i) = c.coefficient;
  }
  return matrix;
}

double SmallestEigenvalue(const Eigen::MatrixXd& correlation) {
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(correlation, Eigen::EigenvaluesOnly)
      .eigenvalues()[0];
}

DesignPoints::DesignPoints(std::vector<Axis> axes, Design design)
    : axes_(std::move(axes)), design_(std::move(design)) {
  MBV_DEMAND(!axes_.empty() && axes_.size() <= kMostAxes, axes_.size());
  if (design_.kind == DesignKind::kSobol) sequence_ = std::make_unique<Sequence>(axes_.size());
  if (design_.kind == DesignKind::kSaltelli) {
    sequence_ = std::make_unique<Sequence>(2 * axes_.size());
  }
  if (design_.correlations.empty()) return;
  const Eigen::LLT<Eigen::MatrixXd> llt(CorrelationMatrix(design_, axes_.size()));
  MBV_DEMAND(llt.info() == Eigen::Success, axes_.size());
  root_ = llt.matrixL();
}

DesignPoints::~DesignPoints() = default;
DesignPoints::DesignPoints(DesignPoints&&) noexcept = default;

std::uint64_t DesignPoints::count() const {
  std::uint64_t count = 1;
  switch (design_.kind) {
    case DesignKind::kSobol:
    case DesignKind::kLatinHypercube:
      return design_.count;
    case DesignKind::kSaltelli:
      return SaturatedProduct(design_.count, axes_.size() + 2);
    case DesignKind::kGrid:
      for (const Axis& axis : axes_) {
        count = SaturatedProduct(count, Excursions(axis.distribution).size());
      }
      return count;
    case DesignKind::kOneAtATime:
      for (const Axis& axis : axes_) count += Excursions(axis.distribution).size();
      return count;
    case DesignKind::kList:
      return design_.list.size();
  }
  return 0;
}

std::vector<double> DesignPoints::At(std::uint64_t number) const {
  MBV_DEMAND(number < count(), number);
  switch (design_.kind) {
    case DesignKind::kGrid:
      return GridPoint(number);
    case DesignKind::kOneAtATime:
      return Excursion(number);
    case DesignKind::kList:
      return design_.list[number];
    case DesignKind::kSobol:
    case DesignKind::kSaltelli:
    case DesignKind::kLatinHypercube:
      break;
  }
  const std::vector<double> shares = Shares(number);
  std::vector<double> values;
  for (size_t d = 0; d < axes_.size(); ++d) {
    values.push_back(Quantile(axes_[d].distribution, shares[d]));
  }
  if (root_.size() > 0) Correlate(shares, &values);
  return values;
}

// Deviations of normal numbers, each in its sigma, times L: they have the stated correlations.
// Other numbers have a row and a column of the unit matrix.
void DesignPoints::Correlate(const std::vector<double>& shares, std::vector<double>* values) const {
  Eigen::VectorXd z = Eigen::VectorXd::Zero(root_.rows());
  for (size_t d = 0; d < axes_.size(); ++d) {
    z[static_cast<Eigen::Index>(d)] = Quantile(Normal{}, shares[d]);
  }
  for (size_t d = 0; d < axes_.size(); ++d) {
    const auto* normal = std::get_if<Normal>(&axes_[d].distribution);
    if (normal == nullptr) continue;
    const auto row = static_cast<Eigen::Index>(d);
    (*values)[d] = normal->mean + normal->sigma * root_.row(row).head(row + 1).dot(z.head(row + 1));
  }
}

// Where the point lies in the unit cube. Blocks are dealt to the replicates in turn, each of which
// is Sobol's sequence from its beginning with shifts of its own.
std::vector<double> DesignPoints::Shares(std::uint64_t number) const {
  const size_t axes = axes_.size();
  std::vector<double> shares(axes);
  if (design_.kind == DesignKind::kLatinHypercube) {
    for (size_t d = 0; d < axes; ++d) {
      const std::uint64_t layer = Permuted(number, design_.count, MixBits(design_.seed, d));
      const double inside = ShareOf(MixBits(design_.seed ^ 0x5851f42dULL, d, number));
      shares[d] = (static_cast<double>(layer) + inside) / static_cast<double>(design_.count);
    }
    return shares;
  }
  const bool blocks = design_.kind == DesignKind::kSaltelli;
  if (!blocks) {
    const std::vector<std::uint64_t> bits = sequence_->At(number);
    for (size_t d = 0; d < axes; ++d) shares[d] = ShareOf(bits[d] ^ MixBits(design_.seed, d));
    return shares;
  }
  const std::uint64_t block = number / (axes + 2), place = number % (axes + 2);
  const std::uint64_t replicate = block % kReplicates;
  const std::vector<std::uint64_t> bits = sequence_->At(block / kReplicates);
  for (size_t d = 0; d < axes; ++d) {
    const size_t column = place == 1 || place == d + 2 ? axes + d : d;  // of A, or of B
    shares[d] = ShareOf(bits[column] ^ MixBits(design_.seed, replicate, column));
  }
  return shares;
}

std::vector<double> DesignPoints::GridPoint(std::uint64_t number) const {
  std::vector<double> values(axes_.size());
  for (size_t d = axes_.size(); d-- > 0;) {
    const std::vector<double> levels = Excursions(axes_[d].distribution);
    values[d] = levels[number % levels.size()];
    number /= levels.size();
  }
  return values;
}

std::vector<double> DesignPoints::Excursion(std::uint64_t number) const {
  std::vector<double> values;
  for (const Axis& axis : axes_) values.push_back(axis.nominal);
  std::uint64_t first = 1;  // number of this axis' first excursion
  for (size_t d = 0; d < axes_.size(); ++d) {
    const std::vector<double> excursions = Excursions(axes_[d].distribution);
    if (number >= first && number < first + excursions.size()) {
      values[d] = excursions[number - first];
    }
    first += excursions.size();
  }
  return values;
}

std::uint64_t Permuted(std::uint64_t index, std::uint64_t count, std::uint64_t key) {
  constexpr std::uint64_t kRounds = 6;
  const int half = (std::bit_width(count - 1) + 1) / 2;
  const std::uint64_t mask = (std::uint64_t{1} << half) - 1;
  do {
    std::uint64_t left = index >> half, right = index & mask;
    for (std::uint64_t round = 0; round < kRounds; ++round) {
      const std::uint64_t next = left ^ (MixBits(key, round, right) & mask);
      left = right;
      right = next;
    }
    index = (left << half) | right;
  } while (index >= count);
  return index;
}

}  // namespace mbv
