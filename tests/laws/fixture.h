// Runs a law on every mechanism and regime.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <tuple>

#include "tests/laws/budget.h"
#include "tests/laws/subject.h"

namespace mbv::laws {

/// Rounding of about a thousand operations, amplified by the pose (State::condition).
[[nodiscard]] inline double Rounding(double condition) { return 1e3 * kEps * (1 + condition); }

/// Loops and forward solutions stop at a residual of at most 1e-13 m; the pose, and with it the
/// forces, is uncertain by that, amplified by the pose's condition.
[[nodiscard]] inline double Closure(const Subject& subject, double condition) {
  return 1e-13 / subject.length_m * (1 + condition);
}

class EveryMechanism : public ::testing::TestWithParam<std::tuple<std::string, Regime>> {
 protected:
  [[nodiscard]] const Subject& subject() const { return SubjectOf(std::get<0>(GetParam())); }
  [[nodiscard]] Regime regime() const { return std::get<1>(GetParam()); }
  [[nodiscard]] const std::vector<State>& states() const {
    return StatesOf(subject().name, regime());
  }

  /// The law holds at every state, and fails there when the truth is perturbed by about twice the
  /// budget. `law(state, perturbation)` returns what it measured; perturbation 0 is the truth and
  /// perturbation b must change a compared quantity by about b of its size.
  template <typename Law>
  void Check(const Law& law) const {
    for (const State& state : states()) {
      SCOPED_TRACE(subject().name + ", " + state.name + ", condition " +
                   std::to_string(state.condition));
      const Residual truth = law(state, 0.0);
      EXPECT_TRUE(truth.Holds()) << truth;
      const Residual perturbed = law(state, 2.5 * truth.budget.Total());
      EXPECT_FALSE(perturbed.Holds()) << "perturbed truth passes: " << perturbed;
    }
  }
};

inline std::string RegimeName(
    const ::testing::TestParamInfo<std::tuple<std::string, Regime>>& info) {
  return std::get<0>(info.param) + "_" + NameOf(std::get<1>(info.param));
}

/// Largest difference relative to the largest value of `truth`; NaN-proof (NaN is a large error).
[[nodiscard]] inline double RelativeError(const VecX& value, const VecX& truth, double floor = 0) {
  if (value.size() != truth.size() || !value.allFinite() || !truth.allFinite()) {
    return std::numeric_limits<double>::infinity();
  }
  const double size = std::max(truth.lpNorm<Eigen::Infinity>(), floor);
  return size > 0 ? (value - truth).lpNorm<Eigen::Infinity>() / size : value.norm();
}

[[nodiscard]] inline std::string TroubleOf(const char* witness, const RunSummary& summary) {
  return summary.ok() ? "" : std::string(witness) + ": " + summary.message;
}

}  // namespace mbv::laws
