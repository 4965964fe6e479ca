// A result against its repetition: round-off passes, a perturbed number is reported.
#include "features/paper/rerun_report.h"

#include <gtest/gtest.h>

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

struct RerunCase {
  synthetic::Case base;
  Trace packed = synthetic::ExactTrace("simulated");
  Trace rerun = packed;

  [[nodiscard]] ComparisonInput Input() const {
    ComparisonInput input;
    input.mechanism = &base.mechanism;
    input.motion = &base.motion;
    input.limits = base.limits;
    return input;
  }
  [[nodiscard]] std::vector<RerunSignal> Compare(LimitColumn column) const {
    return CompareReruns(Input(), packed, rerun, column);
  }
  [[nodiscard]] RerunSignal Of(const std::string& signal, LimitColumn column) const {
    for (const RerunSignal& found : Compare(column)) {
      if (found.signal == signal + ".simulated") return found;
    }
    return {};
  }
  void Perturb(const std::string& signal, int row, double factor) {
    rerun.values(row, rerun.Find(signal)) *= factor;
  }
};

bool AllInside(const std::vector<RerunSignal>& signals) {
  return std::all_of(signals.begin(), signals.end(),
                     [](const RerunSignal& signal) { return signal.inside(); });
}

TEST(Rerun, RoundOffIsWithinTheTubes) {
  RerunCase c;
  c.rerun.values.array() *= 1.0 + 4e-15;
  for (const LimitColumn column : {LimitColumn::kForward, LimitColumn::kReference}) {
    const auto signals = c.Compare(column);
    EXPECT_EQ(signals.size(), c.packed.channels.size());
    EXPECT_TRUE(AllInside(signals));
  }
}

TEST(Rerun, OneNumberPerturbedByAThousandthIsOutside) {
  for (const LimitColumn column :
       {LimitColumn::kForward, LimitColumn::kInverse, LimitColumn::kReference}) {
    RerunCase c;
    c.Perturb("d1.force", 30, 1.001);
    EXPECT_FALSE(c.Of("d1.force", column).inside());
    EXPECT_NEAR(c.Of("d1.force", column).time_s, c.packed.time_s[30], 1e-12);
    EXPECT_TRUE(c.Of("d2.force", column).inside());
  }
}

// Of force_nrmse, 1e-6 of the RMS force (53.9 N of both), a repetition may use a hundredth; one
// sample of 101 may then be 5.4e-6 N off, 5.4e-8 of the largest force.
TEST(Rerun, ASimulationMayUseAHundredthOfItsLimit) {
  RerunCase c;
  const double largest = c.packed.values.col(c.packed.Find("d1.force")).cwiseAbs().maxCoeff();
  c.rerun.values(30, c.rerun.Find("d1.force")) += 0.53e-7 * largest;
  EXPECT_TRUE(c.Of("d1.force", LimitColumn::kForward).inside());
  EXPECT_FALSE(c.Of("d1.force", LimitColumn::kReference).inside());
  c.rerun.values(30, c.rerun.Find("d1.force")) += 0.02e-7 * largest;
  EXPECT_FALSE(c.Of("d1.force", LimitColumn::kForward).inside());
  EXPECT_NEAR(c.Of("d1.force", LimitColumn::kForward).relative, 0.55e-7, 1e-10);
}

TEST(Rerun, LimitsThatAreSwitchedOffAreTheDefaultOnes) {
  CheckLimits limits;
  limits[Metric::kForceNrmse] = {};
  EXPECT_EQ(RerunLimits(limits)[Metric::kForceNrmse].reference, 1e-10);
  EXPECT_EQ(RerunLimits(limits)[Metric::kForceNrmse].forward, kRerunShare * 1e-6);
  EXPECT_EQ(RerunLimits(limits)[Metric::kForceNrmse].servo, kRerunShare * 1e-6);
  limits[Metric::kStiffnessEntry] = {};
  EXPECT_EQ(RerunLimits(limits)[Metric::kStiffnessEntry].forward, kRerunShare * 1e-4);
  EXPECT_EQ(RerunLimits(limits)[Metric::kStiffnessEntry].reference, 1e-9);
}

TEST(Rerun, WhatBothDoNotKnowIsTheSameAndWhatOneKnowsIsNot) {
  RerunCase c;
  c.packed.values(10, c.packed.Find("d1.force")) = kNan;
  EXPECT_FALSE(c.Of("d1.force", LimitColumn::kForward).inside());
  c.rerun.values(10, c.rerun.Find("d1.force")) = kNan;
  EXPECT_TRUE(c.Of("d1.force", LimitColumn::kForward).inside());
}

TEST(Rerun, ColumnsAreHeldToTheirLargestValue) {
  EXPECT_TRUE(CompareColumns("a", {1, -100, 0}, {1 + 0.9e-8, -100, 0}, 1e-10).inside());
  EXPECT_FALSE(CompareColumns("a", {1, -100, 0}, {1 + 1.1e-8, -100, 0}, 1e-10).inside());
  EXPECT_FALSE(CompareColumns("a", {1, 2}, {1}, 1e-10).inside());
  EXPECT_FALSE(CompareColumns("a", {1, kNan}, {1, 2}, 1e-10).inside());
  EXPECT_TRUE(CompareColumns("a", {0, kNan}, {0, kNan}, 1e-10).inside());
  // As it is: a gap of 1e-16 m that becomes 2e-16 m is no difference.
  EXPECT_TRUE(CompareColumns("closure_m", {1e-16}, {2e-16}, 1e-12, true).inside());
  EXPECT_FALSE(CompareColumns("closure_m", {1e-16}, {2e-12}, 1e-12, true).inside());
}

}  // namespace
}  // namespace mbv
