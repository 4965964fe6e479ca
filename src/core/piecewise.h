// Polynomials on consecutive intervals of time, with their two exact derivatives.
#pragma once

#include <array>
#include <vector>

namespace mbv {

/// A value with its first and second time derivative.
struct Jet {
  double value = 0.0, rate = 0.0, acceleration = 0.0;
};

/// On [knots[i], knots[i+1]]: Σ_k coefficients[i][k] (t − knots[i])^k.
struct Piecewise {
  static constexpr int kDegree = 5;
  using Polynomial = std::array<double, kDegree + 1>;
  enum class Outside {
    kHold,    ///< rests at its first and its last value
    kExtend,  ///< the first and the last polynomial go on
    kRepeat,  ///< begins again; each round adds `advance`
  };

  std::vector<double> knots;             ///< increasing, one more than polynomials [s]
  std::vector<Polynomial> coefficients;  ///< at least one
  Outside outside = Outside::kHold;
  double advance = 0.0;        ///< kRepeat: a crank's turns
  std::vector<double> breaks;  ///< where acceleration or jerk jump, increasing [s]

  [[nodiscard]] double start_s() const { return knots.front(); }
  [[nodiscard]] double end_s() const { return knots.back(); }
};

[[nodiscard]] Jet Evaluate(const Piecewise& pieces, double t_s);

/// The polynomial Σ_k c[k] x^k.
[[nodiscard]] Jet Evaluate(const Piecewise::Polynomial& c, double x);

}  // namespace mbv
