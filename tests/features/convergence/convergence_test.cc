#include "features/convergence/order.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

// 100 samples every 10 ms; the first five follow the start within 50 ms.
SampleClasses Classes() { return {SampleTimes(0.99, 0.01), {}, 0.05}; }

// A series whose forces are wrong by size · step^order in all samples.
struct Manufactured {
  ConvergenceSeries series;
  std::vector<MatX> forces;
  MatX truth;
};

Manufactured Make(double order, Knob knob = Knob::kBoth, bool stock = false) {
  const Mechanism mechanism = synthetic::TwoSliders();
  const SampleClasses classes = Classes();
  Manufactured m;
  m.series.name = "series";
  m.series.stock = stock;
  m.series.knob = knob;
  m.series.extent_m = 1.0;
  m.truth.resize(100, 2);
  for (int i = 0; i < 100; ++i) m.truth.row(i) << 100.0 * std::sin(0.1 * i), 40.0;
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4}) {
    const MatX difference = std::pow(h / 4e-3, order) * 1e-5 * m.truth.array().cos().matrix();
    m.forces.push_back(m.truth + difference);
    ConvergencePoint point;
    point.step_s = h;
    point.time_constant_s = knob == Knob::kStep ? 0.2 : 50.0 * h;
    point.error = RelativeError(mechanism, difference, m.truth, classes);
    if (m.forces.size() > 1) {
      point.change =
          RelativeError(mechanism, m.forces.back() - *(m.forces.end() - 2), m.truth, classes);
    }
    point.pose_m = 1e-3 * std::pow(h / 4e-3, stock ? 2.0 : 5.0);
    m.series.points.push_back(point);
  }
  Judge(classes, &m.series);
  return m;
}

TEST(SampleClasses, NearABreakIsFromTheBreakOnForTheWindow) {
  const SampleClasses classes({0.0, 0.1, 0.2, 0.3, 0.4, 0.5}, {0.3}, 0.2);
  EXPECT_EQ(classes.near_break, (std::vector<bool>{true, true, false, true, true, false}));
  EXPECT_EQ(classes.smooth(), 2u);
}

TEST(SampleClasses, WhatABreakLeavesIsDampedWithTheTimeConstant) {
  const SampleClasses classes = Classes();
  // Guidance much slower than the window damps nothing, much faster guidance everything.
  EXPECT_GT(classes.Remains(1.0), 1.0);
  EXPECT_LT(classes.Remains(0.005), 1e-3);
  EXPECT_LT(classes.Remains(0.01), classes.Remains(0.02));
  // By hand at tc = window: ∫ from 1 to ∞ is 3.25 e⁻², the whole 1.25; 5 samples near, 95 smooth.
  const double after = 3.25 * std::exp(-2.0);
  EXPECT_NEAR(classes.Remains(0.05), std::sqrt(after / (1.25 - after) * 5.0 / 95.0), 1e-12);
}

TEST(RelativeError, IsTheRmsOverTheRmsOfAllTrueForces) {
  const Mechanism mechanism = synthetic::TwoSliders();
  const SampleClasses classes({0.0, 1.0, 2.0}, {}, 0.5);
  const MatX truth = MatX::Constant(3, 2, 10.0);
  MatX difference = MatX::Zero(3, 2);
  difference.row(0).setConstant(2.0);
  difference(2, 1) = 4.0;
  const ErrorPair error = RelativeError(mechanism, difference, truth, classes);
  EXPECT_NEAR(error.breaks, 0.2, 1e-15);
  EXPECT_NEAR(error.smooth, 0.2, 1e-15);  // √(4² / 4 values) / 10
  EXPECT_EQ(RelativeError(mechanism, MatX::Zero(3, 2), MatX::Zero(3, 2), classes).smooth, 0.0);
  difference(1, 0) = kNan;
  EXPECT_TRUE(std::isnan(RelativeError(mechanism, difference, truth, classes).smooth));
}

TEST(RelativeError, ANumberOfOneUnitDoesNotHideThatAnotherHasNone) {
  Mechanism mechanism = synthetic::TwoSliders();
  const SampleClasses classes({0.0, 1.0}, {}, 0.5);
  const MatX truth = MatX::Constant(2, 2, 10.0);
  mechanism.joints[0].kind = JointKind::kRevolute;  // N m beside N
  for (const int none : {0, 1}) {
    MatX difference = MatX::Ones(2, 2);
    difference(1, none) = kNan;
    EXPECT_TRUE(std::isnan(RelativeError(mechanism, difference, truth, classes).smooth)) << none;
  }
}

TEST(Judge, EachSchemeHasItsOwnOrder) {
  EXPECT_FALSE(Make(4.0).series.verdict.finding);
  EXPECT_FALSE(Make(6.0).series.verdict.finding);
  EXPECT_TRUE(Make(3.0).series.verdict.finding);
  EXPECT_TRUE(Make(7.0).series.verdict.finding);
  EXPECT_FALSE(Make(4.0, Knob::kStep).series.verdict.finding);
  EXPECT_TRUE(Make(3.0, Knob::kStep).series.verdict.finding);
  EXPECT_TRUE(Make(5.0, Knob::kStep).series.verdict.finding);
  EXPECT_FALSE(Make(1.5, Knob::kBoth, true).series.verdict.finding);
  EXPECT_TRUE(Make(4.0, Knob::kBoth, true).series.verdict.finding);
  EXPECT_FALSE(Make(1.0, Knob::kStep, true).series.verdict.finding);
  EXPECT_TRUE(Make(2.0, Knob::kStep, true).series.verdict.finding);
}

TEST(Judge, OrdersOfTheStockEngineWithOneKnobFixedAreThoseOfChanges) {
  EXPECT_TRUE(Make(1.0, Knob::kStep, true).series.by_changes);
  EXPECT_FALSE(Make(1.0, Knob::kBoth, true).series.by_changes);
  EXPECT_FALSE(Make(4.0, Knob::kStep).series.by_changes);
}

TEST(Judge, APoseOfWrongOrderIsAFindingThoughTheForcesAreRight) {
  Manufactured m = Make(4.0);
  EXPECT_FALSE(m.series.pose_verdict.finding);
  for (ConvergencePoint& point : m.series.points) point.pose_m = std::pow(point.step_s, 3.0);
  Judge(Classes(), &m.series);
  EXPECT_TRUE(m.series.pose_verdict.finding);
  ConvergenceReport report;
  report.extrapolation.pass = true;
  report.series = {m.series};
  EXPECT_TRUE(report.finding());
}

TEST(Judge, SamplesNearBreaksAreJudgedOnlyWhereNoneIsSmooth) {
  Manufactured m = Make(4.0);
  for (ConvergencePoint& point : m.series.points) {
    point.error.breaks = 1e-3 * point.step_s;
  }
  const SampleClasses none(SampleTimes(0.04, 0.01), {}, 0.05);
  Judge(none, &m.series);
  EXPECT_FALSE(m.series.smooth);
  EXPECT_NEAR(m.series.fit.order, 1.0, 1e-9);
  EXPECT_TRUE(m.series.verdict.finding);
}

TEST(ExtrapolateForces, FindsTheTruthWithinTheGridConvergenceIndex) {
  const Manufactured m = Make(4.0);
  const ForceExtrapolation e =
      ExtrapolateForces(synthetic::TwoSliders(), m.series, m.forces, m.truth, Classes());
  EXPECT_EQ(e.fine_s, 2.5e-4);
  EXPECT_EQ(e.coarse_s, 5e-4);
  EXPECT_TRUE(e.pass);
  // A pure power is removed to round-off (forces of 100 N), while the finest run is 1.25 times
  // less wrong than the index says.
  const double roundoff = 64 * 1e-16 * 100.0;
  ASSERT_EQ(e.drives.size(), 2u);
  for (const ExtrapolatedDrive& drive : e.drives) {
    EXPECT_LT(drive.error, roundoff);
    EXPECT_GT(drive.uncertainty, 100.0 * drive.error);
  }
  EXPECT_NEAR(e.index, 1.25 * m.series.points.back().error.smooth, 1e-3 * e.index);
}

TEST(ExtrapolateForces, ForcesThatConvergeToSomethingElseFail) {
  Manufactured m = Make(4.0);
  const double twice =
      2.0 *
      ExtrapolateForces(synthetic::TwoSliders(), m.series, m.forces, m.truth, Classes()).allowed;
  const MatX elsewhere = m.truth * (1.0 + twice);
  const ForceExtrapolation e =
      ExtrapolateForces(synthetic::TwoSliders(), m.series, m.forces, elsewhere, Classes());
  EXPECT_FALSE(e.pass);
  EXPECT_GT(e.error, e.allowed);
}

TEST(ExtrapolateForces, AtTheFloorTheFinestRunIsTaken) {
  Manufactured m = Make(1.0);
  const double finest = m.series.points.back().error.smooth;
  for (ConvergencePoint& point : m.series.points) point.error = {.smooth = 1e-13, .breaks = 1e-13};
  Judge(Classes(), &m.series);
  const ForceExtrapolation e =
      ExtrapolateForces(synthetic::TwoSliders(), m.series, m.forces, m.truth, Classes());
  EXPECT_TRUE(std::isnan(e.fine_s));
  EXPECT_TRUE(e.drives.empty());
  // The forces as they were made, not what the points claim: no round-off.
  EXPECT_NEAR(e.error, finest, 1e-6 * finest);  // forces of 100 N lose 1e-16 of 1e-8
  EXPECT_FALSE(e.pass);
}

TEST(ConvergenceReport, StartsPessimistic) { EXPECT_TRUE(ConvergenceReport{}.finding()); }

}  // namespace
}  // namespace mbv
