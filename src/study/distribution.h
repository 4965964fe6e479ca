// What a varied number may be: a distribution, or levels.
#pragma once

#include <variant>
#include <vector>

namespace mbv {

struct Normal {
  double mean = 0.0, sigma = 1.0;  ///< sigma > 0
};
struct Uniform {
  double lower = 0.0, upper = 1.0;  ///< lower < upper
};
/// Each is as likely as the others.
struct Levels {
  std::vector<double> values;  ///< not empty
};
using Distribution = std::variant<Normal, Uniform, Levels>;

/// The value below which a share `u` of all lies, 0 < u < 1.
[[nodiscard]] double Quantile(const Distribution& distribution, double u);

/// What a number is set to when it alone is varied: mean ∓ sigma, both ends, or each level.
[[nodiscard]] std::vector<double> Excursions(const Distribution& distribution);

}  // namespace mbv
