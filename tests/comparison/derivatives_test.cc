// "Rates are derivatives" on motions whose jerk jumps, wherever the jumps fall between samples.
#include <gtest/gtest.h>

#include "comparison/comparison.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

// Both sliders run to a stop at `start_s` + 0.43 s and on to another place, 3-4-5 ramps.
double WorstRate(double start_s, double bend) {
  const Mechanism mechanism = synthetic::TwoSliders();
  const RampCruiseTerm there{start_s, 0.24, 0.75, 10.0, 0.24};
  const RampCruiseTerm back{start_s + Duration(there), 0.06, 0.75, 10.0, -0.06};
  const Profile profile{{there, back}};
  Trace trace;
  trace.witness = "analytic";
  trace.Reset(SampleTimes(0.8, 1e-3), DriveChannels(mechanism));
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const Jet jet = Evaluate(profile, trace.time_s[i]);
    for (int drive = 0; drive < 2; ++drive) {
      trace.values.row(static_cast<Eigen::Index>(i)).segment<4>(4 * drive) << jet.value, jet.rate,
          jet.acceleration * (1.0 + bend), 0.0;
    }
  }
  ComparisonInput input;
  const Motion motion;  // commands nothing
  input.mechanism = &mechanism;
  input.motion = &motion;
  return MeasureWitness(input, trace).metrics[Metric::kDerivatives].value;
}

TEST(Derivatives, JumpsOfTheJerkDoNotCount) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  for (int k = 0; k <= 10; ++k) {
    EXPECT_LT(WorstRate(0.05 + 1e-4 * k, 0.0), limit) << k;
  }
}

TEST(Derivatives, WrongAccelerationsAreStillSeenBetweenTheJumps) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  EXPECT_GT(WorstRate(0.05037, 2 * limit), limit);
}

}  // namespace
}  // namespace mbv
