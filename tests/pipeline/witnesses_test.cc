#include "pipeline/simulate_scenario.h"

#include <gtest/gtest.h>

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

TEST(Extrapolate, ForcesLinearInTheParameterAreHitExactly) {
  // F(k) = F(0) + k·G: from k = 1 and 0.5 to 0 this is 2F(0.5) − F(1).
  Trace at_1 = synthetic::ExactTrace("simulated"), at_half = at_1;
  synthetic::Bend(&at_1, "d1.force", 8.0);
  synthetic::Bend(&at_half, "d1.force", 4.0);
  const Trace at_0 = Extrapolate(at_1, 1.0, at_half, 0.5, 0.0);
  const Trace exact = synthetic::ExactTrace("simulated");
  EXPECT_LT((at_0.values - exact.values).cwiseAbs().maxCoeff(), 16 * kEps * 108.0);
}

TEST(Extrapolate, MotionIsNotExtrapolatedAndTheWorseClosureCounts) {
  Trace a = synthetic::ExactTrace("simulated"), b = a;
  synthetic::Bend(&b, "d1.position", 1.0);
  synthetic::Bend(&b, "closure.position", 3e-9);
  synthetic::Bend(&a, "closure.position", 1e-9);
  const Trace result = Extrapolate(a, 1.0, b, 0.5, 0.0);
  EXPECT_EQ(result.values.col(result.Find("d1.position")), a.values.col(a.Find("d1.position")));
  EXPECT_EQ(result.values(5, result.Find("closure.position")), 3e-9);
  b.values(5, b.Find("closure.position")) = kNan;
  const Trace broken = Extrapolate(a, 1.0, b, 0.5, 0.0);
  EXPECT_TRUE(std::isnan(broken.values(5, broken.Find("closure.position"))));
}

}  // namespace
}  // namespace mbv
