// Polynomials through values and derivatives. Internal to reference/.
#pragma once

#include <vector>

#include "core/types.h"

namespace mbv::internal {

/// The polynomial of degree 2n − 1 that has given values and derivatives at n times.
class Hermite {
 public:
  /// Times distinct; one value and one derivative per time, all of one size.
  Hermite(const std::vector<double>& times, const std::vector<VecX>& values,
          const std::vector<VecX>& derivatives);

  /// Value and derivative at t.
  void Evaluate(double t, VecX* value, VecX* derivative) const;

 private:
  std::vector<double> nodes_;       ///< each time twice
  std::vector<VecX> coefficients_;  ///< of Newton's form
};

}  // namespace mbv::internal
