// "Rates are derivatives" on motions whose jerk jumps, wherever the jumps fall between samples.
#include <gtest/gtest.h>

#include <memory>

#include "comparison/comparison.h"
#include "scenario/tables/table_spline.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

// Both sliders run to a stop at `start_s` + 0.43 s and on to another place, 3-4-5 ramps.
double WorstRate(double start_s, double error) {
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
          jet.acceleration * (1.0 + error), 0.0;
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

// d1 follows a sine with this many samples per period, d2 stands still but for what its
// acceleration claims.
struct Fast {
  Mechanism mechanism = synthetic::TwoSliders();
  Motion motion;
  Trace trace;

  explicit Fast(double samples, double claimed = 0.0, double amplitude = 0.1) {
    motion.duration_s = 0.4;
    motion.sample_s = 0.01;
    const Profile sine{{SineTerm{amplitude, 1.0 / (samples * motion.sample_s), 0.4}}};
    motion.commands = {{"d1", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, sine}};
    trace.witness = "analytic";
    trace.Reset(SampleTimes(motion.duration_s, motion.sample_s), DriveChannels(mechanism));
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const Jet jet = Evaluate(sine, trace.time_s[i]);
      trace.values.row(static_cast<Eigen::Index>(i)) << jet.value, jet.rate, jet.acceleration, 0.0,
          0.7, 0.0, claimed, 0.0;
    }
  }
  [[nodiscard]] WitnessMetrics Measure() const {
    ComparisonInput input;
    input.mechanism = &mechanism;
    input.motion = &motion;
    return MeasureWitness(input, trace);
  }
  [[nodiscard]] double Worst() const {
    const WitnessMetrics metrics = Measure();
    const auto found = metrics.metrics.find(Metric::kDerivatives);
    return found == metrics.metrics.end() ? 0.0 : found->second.value;
  }
};

TEST(Derivatives, SamplesThatDoNotResolveAFastMotionAreNotJudgedAndSaySo) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  for (const double samples : {1.0, 1.3, 2.0, 2.2, 2.5, 3.0, 4.0, 5.0}) {
    const Fast fast(samples);
    EXPECT_LT(fast.Worst(), limit) << samples;
    EXPECT_FALSE(fast.Measure().derivatives_gap.empty()) << samples;
  }
  EXPECT_TRUE(Fast(10.0).Measure().derivatives_gap.empty());
  EXPECT_LT(Fast(10.0).Worst(), limit);
  Fast wrong(10.0);
  synthetic::Stretch(&wrong.trace, "d1.acceleration", 1.2);
  EXPECT_GT(wrong.Worst(), limit);
}

// A drive that turns by more than 2 rad between two samples hides what happens within a turn.
TEST(Derivatives, DrivesThatTurnTooFarBetweenSamplesAreNotJudgedAndSaySo) {
  const auto turning = [](double per_sample_rad) {
    Fast fast(20.0);
    fast.motion.commands.clear();
    const int position = fast.trace.Find("d1.position");
    fast.trace.channels[static_cast<size_t>(position)].unit = "rad";
    for (size_t i = 0; i < fast.trace.time_s.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      fast.trace.values(row, position) += per_sample_rad * static_cast<double>(i);
      fast.trace.values(row, fast.trace.Find("d1.velocity")) +=
          per_sample_rad / fast.motion.sample_s;
    }
    synthetic::Stretch(&fast.trace, "d1.acceleration", 1.2);
    return fast;
  };
  EXPECT_GT(turning(1.0).Worst(), *RowOf(Metric::kDerivatives).limits.reference);
  EXPECT_TRUE(turning(1.0).Measure().derivatives_gap.empty());
  EXPECT_EQ(turning(3.0).Worst(), 0.0);
  EXPECT_NE(turning(3.0).Measure().derivatives_gap.find("d1"), std::string::npos);
}

// Dry friction stops d1 at 0.204 s: its acceleration jumps. Beside the jump nothing is judged if
// the witness says where it is; everywhere else all is.
TEST(Derivatives, AccelerationsMayJumpWhereAWitnessSaysThatFrictionStopped) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference, stop = 0.204;
  Fast slides(20.0);
  const Trace& trace = slides.trace;
  for (size_t i = 0; i < trace.time_s.size(); ++i) {
    const double left = std::max(0.0, stop - trace.time_s[i]);
    slides.trace.values.row(static_cast<Eigen::Index>(i)) << -left * left, 2.0 * left,
        left > 0.0 ? -2.0 : 0.0, 0.0, 0.7, 0.0, 0.0, 0.0;
  }
  EXPECT_GT(slides.Worst(), limit);
  slides.trace.events = {{.time_s = stop, .element = "dry", .what = Happening::kFree}};
  EXPECT_GT(slides.Worst(), limit);
  slides.trace.events[0].what = Happening::kRests;
  EXPECT_LT(slides.Worst(), limit);
  EXPECT_TRUE(slides.Measure().derivatives_gap.empty());
  synthetic::Stretch(&slides.trace, "d1.acceleration", 1.0 + 4.0 * limit);
  EXPECT_GT(slides.Worst(), limit);
}

// d1 follows a spline through rows `row_s` apart, rounded to `decimals` of a degree (or, with
// rates, through those, too); d2 follows from it as a driven member of a linkage does.
struct Rounded {
  static constexpr double kDegree = std::numbers::pi / 180.0;
  Mechanism mechanism = synthetic::TwoSliders();
  Motion motion;
  Trace trace;

  Rounded(int decimals, double row_s, double sample_s, bool rates, double phase) {
    motion.duration_s = 2.0;
    motion.sample_s = sample_s;
    const double unit = std::pow(10.0, decimals);
    const auto rounded = [&](double x) { return std::round(x / kDegree * unit) / unit * kDegree; };
    SplineRows rows;
    for (int i = 0; i <= std::lround(motion.duration_s / row_s); ++i) {
      const Jet jet = Evaluate(SineTerm{0.7, 1.3, phase}, row_s * i);
      rows.time_s.push_back(row_s * i);
      rows.values.push_back(rounded(jet.value));
      if (rates) rows.rates.push_back(rounded(jet.rate));
    }
    const Profile profile{{PiecewiseTerm{std::make_shared<const Piecewise>(Interpolated(rows))}}};
    motion.commands = {{"d1", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, profile}};
    trace.witness = "analytic";
    trace.Reset(SampleTimes(motion.duration_s, sample_s), DriveChannels(mechanism));
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const auto [x, v, a] = Evaluate(profile, trace.time_s[i]);
      const double s = std::sin(1.5 * x + 0.3), c = std::cos(1.5 * x + 0.3);
      trace.values.row(static_cast<Eigen::Index>(i)) << x, v, a, 0.0, 0.2 * s, 0.3 * c * v,
          0.3 * c * a - 0.45 * s * v * v, 0.0;
    }
  }
  [[nodiscard]] WitnessMetrics Measure() const {
    ComparisonInput input;
    input.mechanism = &mechanism;
    input.motion = &motion;
    return MeasureWitness(input, trace);
  }
};

// Check and caveat are one decision: rates are judged right, or said not to have been checked.
TEST(Derivatives, RoundingOfTablesIsNotTakenForWrongRates) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  for (int decimals = 2; decimals <= 6; ++decimals) {
    for (const auto& [row_s, sample_s] :
         {std::pair{0.01, 0.01}, {0.002, 0.01}, {0.02, 0.005}, {0.005, 0.005}, {0.001, 0.004}}) {
      for (const bool rates : {false, true}) {
        for (const double phase : {0.0, 0.37, 0.81}) {
          const WitnessMetrics metrics = Rounded(decimals, row_s, sample_s, rates, phase).Measure();
          const auto found = metrics.metrics.find(Metric::kDerivatives);
          const bool judged = found != metrics.metrics.end();
          EXPECT_LE(judged ? found->second.value : 0.0, limit) << decimals << " " << row_s;
          EXPECT_TRUE(judged || !metrics.derivatives_gap.empty()) << decimals << " " << row_s;
        }
      }
    }
  }
}

TEST(Derivatives, WrongRatesAreSeenThroughTheRoundingOfATable) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  struct Fault {
    const char* signal;
    double factor;
    int decimals;  // from which on the table lets it be seen
  };
  for (const Fault& fault : {Fault{"d2.velocity", -1.0, 3},
                             {"d2.acceleration", -1.0, 4},
                             {"d2.velocity", 1.01, 4},
                             {"d2.acceleration", 1.01, 6},
                             {"d1.velocity", 1.01, 4},
                             {"d1.acceleration", 1.01, 6}}) {
    for (const double phase : {0.0, 0.37, 0.81}) {
      Rounded wrong(fault.decimals, 0.01, 0.01, false, phase);
      synthetic::Stretch(&wrong.trace, fault.signal, fault.factor);
      const WitnessMetrics metrics = wrong.Measure();
      const auto found = metrics.metrics.find(Metric::kDerivatives);
      ASSERT_NE(found, metrics.metrics.end()) << fault.signal << fault.factor;
      EXPECT_GT(found->second.value, limit) << fault.signal << fault.factor;
    }
  }
}

// A drive of which most samples resolve nothing is not judged by the others either.
TEST(Derivatives, WhatIsReportedNotToBeCheckedFailsNoCheck) {
  Fast fast(3.0);
  synthetic::Stretch(&fast.trace, "d1.acceleration", 1.5);
  const WitnessMetrics metrics = fast.Measure();
  EXPECT_FALSE(metrics.derivatives_gap.empty());
  EXPECT_LT(fast.Worst(), *RowOf(Metric::kDerivatives).limits.reference);
}

TEST(Derivatives, ADriveHeldStillIsMeasuredByTheOnesThatMove) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  // 70 m/s² RMS beside it: the floor is 7 cm/s².
  const double amplitude = 100.0 * std::pow(0.2 / (2.0 * std::numbers::pi), 2);
  EXPECT_LT(Fast(20.0, 5e-7, amplitude).Worst(), limit);
  EXPECT_GT(Fast(20.0, 2.0 * limit * 0.0707, amplitude).Worst(), limit);
}

TEST(Derivatives, AWrongAccelerationOfADriveHeldStillIsMeasuredByGravityWhereNothingMoves) {
  const double limit = *RowOf(Metric::kDerivatives).limits.reference;
  EXPECT_GT(Fast(20.0, 0.01, 0.0).Worst(), limit);
}

TEST(DriveMotion, ADriveHeldStillIsComparedOnTheScaleOfOtherUnitsToo) {
  synthetic::Case c;
  c.mechanism.joints[0].kind = JointKind::kRevolute;  // d1 in rad, 14 rad/s² RMS
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    for (const char* signal : {"d2.position", "d2.velocity", "d2.acceleration"}) {
      synthetic::Stretch(trace, signal, 0.0);
    }
    synthetic::Stretch(trace, "d1.acceleration", 10.0);
  }
  c.mechanism.gravity_W.setZero();
  const auto value = [&](double perturbation) {
    Trace perturbed = c.simulated;
    synthetic::Perturb(&perturbed, "d2.acceleration", perturbation);
    const PairComparison pair = ComparePair(c.Input(), perturbed, c.analytic);
    return pair.metrics.at(Metric::kAcceleration).value;
  };
  EXPECT_NEAR(value(1e-10), 1e-10 / 0.13889, 1e-12);
  EXPECT_NEAR(value(1e-3), 1e-3 / 0.13889, 1e-5);
}

}  // namespace
}  // namespace mbv
