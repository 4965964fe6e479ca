// Forces known within a band: how far two are apart, and that each end is judged.
#include "comparison/force_band.h"

#include <gtest/gtest.h>

#include "comparison/motor_load.h"
#include "comparison/table_tube.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

TEST(ForceBand, TwoBandsDifferByTheirEnds) {
  EXPECT_EQ(Difference({3.0, 0.0}, {2.5, 0.0}), 0.5);  // numbers
  EXPECT_NEAR(Difference({3.0, 1.0}, {2.5, 1.2}), 0.7, 1e-15);
  EXPECT_NEAR(Difference({2.0, 1.0}, {2.5, 1.2}), -0.7, 1e-15);
  EXPECT_EQ(Difference({2.5, 1.0}, {2.5, 1.0}), 0.0);
}

TEST(ForceBand, ANumberDiffersByWhatItLiesOutside) {
  EXPECT_EQ(Difference({3.0, 0.0}, {2.5, 0.5}), 0.0);
  EXPECT_NEAR(Difference({3.2, 0.0}, {2.5, 0.5}), 0.2, 1e-15);
  EXPECT_NEAR(Difference({1.8, 0.0}, {2.5, 0.5}), -0.2, 1e-15);
  EXPECT_NEAR(Difference({2.5, 0.5}, {3.2, 0.0}), -0.2, 1e-15);
  EXPECT_TRUE(std::isnan(Difference({kNan, 0.0}, {2.5, 0.5})));
}

TEST(ForceBand, TheWorstEndIsFartherFromZero) {
  EXPECT_EQ((ForceBand{3.0, 1.0}.worst()), 4.0);
  EXPECT_EQ((ForceBand{-3.0, 1.0}.worst()), -4.0);
  EXPECT_EQ((ForceBand{-3.0, 0.0}.worst()), -3.0);
}

constexpr size_t kFrom = 30, kTo = 41;  // samples at rest
constexpr double kHalf = 7.0;

void Rest(Trace* trace, double half) {
  const Eigen::Index columns = trace->values.cols();
  trace->channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d1"));
  trace->values.conservativeResize(Eigen::NoChange, columns + 1);
  trace->values.col(columns).setZero();
  for (size_t i = kFrom; i < kTo; ++i) trace->values(static_cast<Eigen::Index>(i), columns) = half;
}

// One trace says only that something rests; the other contains the friction that holds.
TEST(ForceBand, ReactionsAreNotComparedWhereOnlyOneSideKnowsOfRest) {
  const auto check = [](bool simulated_too, size_t perturbed) {
    synthetic::Case c;
    Rest(&c.reference, kHalf);
    Rest(&c.analytic, kHalf);
    if (simulated_too) Rest(&c.simulated, kHalf);
    c.simulated.values(static_cast<Eigen::Index>(perturbed),
                       c.simulated.Find("slide1.reaction.fx")) += 0.1;
    return c.Run().FindCheck("simulated_vs_reference.reaction_nrmse")->pass;
  };
  EXPECT_TRUE(check(false, kFrom + 3));
  EXPECT_FALSE(check(true, kFrom + 3));
  EXPECT_FALSE(check(false, kTo));
}

TEST(ForceBand, FilesGiveItsEndsAndNoNumber) {
  synthetic::Case c;
  const VecX force = c.reference.values.col(c.reference.Find("d1.force"));
  Rest(&c.reference, kHalf);
  const Trace shown = AsShown(c.reference);
  EXPECT_EQ(shown.Find("d1.force.band"), -1);
  const auto at = [&](const std::string& name, size_t i) {
    return shown.values(static_cast<Eigen::Index>(i), shown.Find(name));
  };
  for (size_t i = 0; i < shown.time_s.size(); ++i) {
    const bool open = kFrom <= i && i < kTo;
    const double middle = force[static_cast<Eigen::Index>(i)], half = open ? kHalf : 0.0;
    EXPECT_EQ(std::isnan(at("d1.force", i)), open) << i;
    EXPECT_EQ(at("d1.force.lower", i), middle - half) << i;
    EXPECT_EQ(at("d1.force.upper", i), middle + half) << i;
  }
  EXPECT_EQ(shown.channels.size(), c.reference.channels.size() + 1);
}

// All three witnesses rest.
synthetic::Case Resting() {
  synthetic::Case c;
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) Rest(trace, kHalf);
  return c;
}

double ForceError(const synthetic::Case& c) {
  return c.Run().FindPair("simulated_vs_reference")->metrics.at(Metric::kForceNrmse).value;
}

TEST(ForceBand, EqualBandsAgreeAndAreCounted) {
  const Comparison comparison = Resting().Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  EXPECT_EQ(comparison.FindPair("simulated_vs_reference")->samples_at_rest, kTo - kFrom);
}

// RMS of a shift x at n of the samples, over the RMS of both drives' forces.
double ShiftError(const synthetic::Case& c, double x) {
  const VecX a = c.reference.values.col(c.reference.Find("d1.force"));
  const VecX b = c.reference.values.col(c.reference.Find("d2.force"));
  return x * std::sqrt(static_cast<double>(kTo - kFrom) / (a.squaredNorm() + b.squaredNorm()));
}

TEST(ForceBand, AWrongHalfWidthOrMiddleFails) {
  const double limit = *CheckLimits()[Metric::kForceNrmse].Of(LimitColumn::kInverse);
  synthetic::Case wide = Resting();
  const double x = 2.0 * limit / ShiftError(wide, 1.0);
  for (size_t i = kFrom; i < kTo; ++i) {
    wide.simulated.values(static_cast<Eigen::Index>(i), wide.simulated.Find("d1.force.band")) += x;
  }
  EXPECT_NEAR(ForceError(wide), 2.0 * limit, 1e-3 * limit);
  EXPECT_EQ(wide.Run().verdict, Verdict::kDisagree);
  synthetic::Case shifted = Resting();
  for (size_t i = kFrom; i < kTo; ++i) {
    shifted.simulated.values(static_cast<Eigen::Index>(i), shifted.simulated.Find("d1.force")) -= x;
  }
  EXPECT_NEAR(ForceError(shifted), 2.0 * limit, 1e-3 * limit);
  EXPECT_EQ(shifted.Run().verdict, Verdict::kDisagree);
}

// Only one of the two rests: the other's number must lie in its band.
TEST(ForceBand, ANumberAnywhereInTheBandPassesAndJustOutsideFails) {
  synthetic::Case c;
  Rest(&c.reference, kHalf);
  c.analytic_summary = {.message = "off", .where = {}, .unit = {}};
  const auto shifted = [&](double by) {
    synthetic::Case moved = c;
    for (size_t i = kFrom; i < kTo; ++i) {
      moved.simulated.values(static_cast<Eigen::Index>(i), moved.simulated.Find("d1.force")) += by;
    }
    return moved;
  };
  EXPECT_EQ(ForceError(shifted(0.99 * kHalf)), 0.0);
  EXPECT_EQ(ForceError(shifted(-0.99 * kHalf)), 0.0);
  EXPECT_NEAR(ForceError(shifted(kHalf + 2.0)), ShiftError(c, 2.0), 1e-12);
  EXPECT_EQ(shifted(kHalf + 2.0).Run().verdict, Verdict::kDisagree);
}

// A table knows no bands: each of its values must lie in the witness' band.
TEST(ForceBand, AForeignValueIsJudgedByTheBand) {
  synthetic::Case c = Resting();
  AlignedTable table;
  table.trace.witness = "reference";
  table.trace.Reset(c.simulated.time_s, {MakeChannel(Quantity::kForce, "N", "d1")});
  table.trace.values.col(0) = c.simulated.values.col(c.simulated.Find("d1.force"));
  table.standard = table.bound = MatX::Zero(table.trace.values.rows(), 1);
  table.coverage = 2.0;
  ComparisonInput input = c.Input();
  input.table = &table;
  const auto worst = [&](double by) {
    AlignedTable moved = table;
    for (size_t i = kFrom; i < kTo; ++i) moved.trace.values(static_cast<Eigen::Index>(i), 0) += by;
    input.table = &moved;
    return JudgeColumns(input, c.simulated, LimitColumn::kInverse).at(0).error_max;
  };
  EXPECT_EQ(worst(0.9 * kHalf), 0.0);
  EXPECT_EQ(worst(-0.9 * kHalf), 0.0);
  EXPECT_NEAR(worst(kHalf + 0.5), 0.5, 1e-12);
}

// 100 N at most in motion; the band asks for more at rest.
TEST(ForceBand, AMotorBearsTheWorseEnd) {
  synthetic::Case c;
  Rest(&c.reference, 300.0);
  Motor motor;
  motor.drive = 0;
  motor.turns = false;
  motor.peak = 500.0;
  const MotorLoad load = MotorLoadOf("d1", motor, c.reference);
  const VecX force = c.reference.values.col(c.reference.Find("d1.force"));
  EXPECT_NEAR(std::abs(load.peak_torque),
              300.0 + force.segment(kFrom, kTo - kFrom).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_EQ(load.samples_at_rest, kTo - kFrom);
}

}  // namespace
}  // namespace mbv
