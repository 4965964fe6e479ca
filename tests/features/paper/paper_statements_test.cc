#include "features/paper/paper_figures.h"

#include <gmock/gmock.h>

#include "tests/support/read_back.h"

namespace mbv {
namespace {

using testing::HasSubstr;

PaperStatement Saying(PaperMeasure measure, const std::string& signals) {
  PaperStatement statement;
  statement.says = "agree";
  statement.where = "section 4";
  statement.measure = measure;
  statement.signals = {{.text = signals, .path = "signals", .line = 7}};
  statement.of = {.text = "simulated", .path = "of"};
  statement.to = {.text = "analytic", .path = "to"};
  return statement;
}

// In a run whose simulation is `off` newtons off at one sample of d2.
StatedResult MeasuredSignals(const PaperStatement& statement, double off) {
  synthetic::Case c;
  c.simulated.values(40, c.simulated.Find("d2.force")) += off;
  Diagnostics diagnostics;
  const StatedResult said =
      MeasureSignals(statement, test::SampledReport(c), "paper.yaml", &diagnostics);
  EXPECT_FALSE(diagnostics.has_errors()) << diagnostics.Text();
  return said;
}

TEST(PaperStatements, ADifferenceIsTheLargestOneInItsUnit) {
  PaperStatement statement = Saying(PaperMeasure::kDifference, "d*.force");
  statement.unit = {.text = "kN"};
  statement.printed = 1e-4;
  EXPECT_NEAR(MeasuredSignals(statement, 0.0).measured, 0.0, 1e-15);
  const StatedResult said = MeasuredSignals(statement, 0.5);
  EXPECT_NEAR(said.measured, 5e-4, 1e-15);
  EXPECT_NEAR(said.deviation(), 4e-4, 1e-15);
  EXPECT_EQ(ResultText(said),
            "“agree” (section 4): printed 0.0001 kN, computed 0.0005 kN, deviation +0.0004 kN");
}

TEST(PaperStatements, AShareIsOfTheLargestValue) {
  const Trace trace = synthetic::ExactTrace("analytic");
  const double largest = trace.values.col(trace.Find("d2.force")).cwiseAbs().maxCoeff();
  const StatedResult said = MeasuredSignals(Saying(PaperMeasure::kShare, "d2.force"), 0.5);
  EXPECT_NEAR(said.measured, 50.0 / largest, 1e-9);
  EXPECT_EQ(said.unit, "%");
}

TEST(PaperStatements, SamplesBeyondAreCounted) {
  PaperStatement statement = Saying(PaperMeasure::kBeyond, "d2.force");
  statement.beyond = 15;
  const double samples = static_cast<double>(synthetic::ExactTrace("analytic").time_s.size());
  EXPECT_EQ(MeasuredSignals(statement, 0.0).measured, 0.0);
  EXPECT_NEAR(MeasuredSignals(statement, 1e6).measured, 100.0 / samples, 1e-12);
}

TEST(PaperStatements, RangesAndValuesAtTimes) {
  const Trace trace = synthetic::ExactTrace("simulated");
  const auto column = trace.values.col(trace.Find("d1.position"));
  const StatedResult range = MeasuredSignals(Saying(PaperMeasure::kRange, "d1.position"), 0.0);
  EXPECT_EQ(range.low, column.minCoeff());
  EXPECT_EQ(range.measured, column.maxCoeff());
  PaperStatement statement = Saying(PaperMeasure::kLargest, "d1.position");
  statement.at_s = {0.5 * (trace.time_s[7] + trace.time_s[8])};
  EXPECT_NEAR(MeasuredSignals(statement, 0.0).measured, std::abs(column[7] + column[8]) / 2, 1e-12);
  statement.at_s = {1e9};  // behind the end: unknown, not small
  EXPECT_TRUE(std::isnan(MeasuredSignals(statement, 0.0).measured));
}

TEST(PaperStatements, WhatTheRunDoesNotHaveIsAFinding) {
  const Report report = test::SampledReport(synthetic::Case());
  Diagnostics diagnostics;
  (void)MeasureSignals(Saying(PaperMeasure::kRange, "d9.force"), report, "p.yaml", &diagnostics);
  PaperStatement statement = Saying(PaperMeasure::kDifference, "d1.force");
  statement.to.text = "adams";
  (void)MeasureSignals(statement, report, "p.yaml", &diagnostics);
  statement = Saying(PaperMeasure::kLargest, "d1.force");
  statement.unit = {.text = "mm", .path = "unit"};
  (void)MeasureSignals(statement, report, "p.yaml", &diagnostics);
  const std::string text = diagnostics.Text();
  EXPECT_THAT(text, HasSubstr("p.yaml:7"));
  EXPECT_THAT(text, HasSubstr("signals = 'd9.force': not recorded by simulated"));
  EXPECT_THAT(text, HasSubstr("to = 'adams': no such witness ran"));
  EXPECT_THAT(text, HasSubstr("unit = 'mm': no unit of what is recorded in N"));
}

// κ = x + y, and one cell off.
MapPlot MapOf(double off) {
  MapPlot map;
  map.columns = map.rows = 3;
  map.values = {0, 1, 2, 1, 2, 3, 2, 3, 4};
  map.values[1] += off;
  return map;
}

StatedResult MeasuredMaps(PaperMeasure measure, const std::vector<MapPlot>& maps) {
  PaperStatement statement = Saying(measure, "");
  statement.other = 1;
  Diagnostics diagnostics;
  const StatedResult said = MeasureMaps(statement, maps, "p.yaml", &diagnostics);
  EXPECT_FALSE(diagnostics.has_errors()) << diagnostics.Text();
  return said;
}

TEST(PaperStatements, MapsAreMirroredAtTheDiagonal) {
  EXPECT_EQ(MeasuredMaps(PaperMeasure::kMirror, {MapOf(0)}).measured, 0.0);
  EXPECT_EQ(MeasuredMaps(PaperMeasure::kMirror, {MapOf(1)}).measured, 25.0);
  EXPECT_EQ(MeasuredMaps(PaperMeasure::kMirrorPair, {MapOf(0), MapOf(0)}).measured, 0.0);
  EXPECT_EQ(MeasuredMaps(PaperMeasure::kMirrorPair, {MapOf(0), MapOf(2)}).measured, 50.0);
  MapPlot twice = MapOf(0);
  for (double& v : twice.values) v *= 2;
  EXPECT_EQ(MeasuredMaps(PaperMeasure::kMedianRatio, {twice, MapOf(0)}).measured, 2.0);
}

TEST(PaperStatements, AMapThatIsNotThereIsAFinding) {
  Diagnostics diagnostics;
  PaperStatement statement = Saying(PaperMeasure::kMirrorPair, "");
  statement.other = 1;
  (void)MeasureMaps(statement, {MapOf(0)}, "p.yaml", &diagnostics);
  EXPECT_THAT(diagnostics.Text(), HasSubstr("there are 1 maps, counted from 0"));
}

}  // namespace
}  // namespace mbv
