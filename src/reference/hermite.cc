#include "reference/hermite.h"

#include "core/demand.h"

namespace mbv::internal {

Hermite::Hermite(const std::vector<double>& times, const std::vector<VecX>& values,
                 const std::vector<VecX>& derivatives) {
  MBV_DEMAND(!times.empty() && values.size() == times.size(), times.size());
  MBV_DEMAND(derivatives.size() == times.size(), derivatives.size());
  const size_t n = 2 * times.size();
  for (size_t i = 0; i < times.size(); ++i) {
    for (int twice = 0; twice < 2; ++twice) {
      nodes_.push_back(times[i]);
      coefficients_.push_back(values[i]);
    }
  }
  // Divided differences in place; where both nodes are one, the derivative.
  for (size_t order = 1; order < n; ++order) {
    for (size_t i = n - 1; i >= order; --i) {
      if (order == 1 && i % 2 == 1) {
        coefficients_[i] = derivatives[i / 2];
      } else {
        coefficients_[i] =
            (coefficients_[i] - coefficients_[i - 1]) / (nodes_[i] - nodes_[i - order]);
      }
    }
  }
}

void Hermite::Evaluate(double t, VecX* value, VecX* derivative) const {
  *value = coefficients_.back();
  derivative->setZero(value->size());
  for (size_t i = coefficients_.size() - 1; i-- > 0;) {
    *derivative = *value + (t - nodes_[i]) * *derivative;
    *value = coefficients_[i] + (t - nodes_[i]) * *value;
  }
}

}  // namespace mbv::internal
