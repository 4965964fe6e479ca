#include "study/distribution.h"

#include <algorithm>
#include <boost/math/special_functions/erf.hpp>
#include <cmath>
#include <numbers>

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

}  // namespace mbv
