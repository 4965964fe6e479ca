#include "features/convergence/converge.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/support/golden_file.h"

namespace mbv {
namespace {

// Corrected engine, order 2 instead of 4; the finest run failed.
ConvergenceReport WrongOrder() {
  ConvergenceReport report{.scenario = "case", .mechanism = "robot", .samples = 3};
  report.extrapolation.pass = true;
  ConvergenceSeries series{.name = "corrected_both", .title = "corrected engine", .extent_m = 1.0};
  for (const double h : {4e-3, 2e-3, 1e-3, 5e-4}) {
    ConvergencePoint point{.step_s = h, .time_constant_s = 50.0 * h, .steps = 10, .cpu_s = 1 / h};
    point.error = {.smooth = h * h, .breaks = h * h};
    if (h < 1e-3) point = {.step_s = h, .time_constant_s = 50.0 * h, .failure = "diverged"};
    series.points.push_back(point);
  }
  Judge(SampleClasses({0.0, 1.0, 2.0}, {}, 0.05), &series);
  report.series = {series};
  return report;
}

// Each number is another one.
ConvergenceReport WithEverything() {
  ConvergenceReport report = WrongOrder();
  report.sample_s = 0.01;
  report.duration_s = 2.5;
  report.window_s = 0.05;
  report.breaks = 4;
  report.samples = 251;
  report.smooth_samples = 243;
  ConvergenceSeries stock{.name = "stock_step",
                          .title = "stock engine",
                          .stock = true,
                          .knob = Knob::kStep,
                          .extent_m = 1.5};
  for (const double h : {4e-3, 2e-3, 1e-3}) {
    ConvergencePoint point{.step_s = h,
                           .time_constant_s = 0.02,
                           .steps = std::lround(2.5 / h),
                           .cpu_s = 0.5 / h,
                           .closure_m = 3e-6,
                           .pose_m = 5e-6};
    point.error = {.smooth = 7 * h, .breaks = 11 * h};
    point.change = {.smooth = 13 * h, .breaks = 17 * h};
    stock.points.push_back(point);
  }
  Judge(SampleClasses({0.0, 1.0, 2.0}, {}, 0.05), &stock);
  stock.notes = {"the first step is coarse"};
  report.series.push_back(stock);
  report.extrapolation = {.coarse_s = 2e-3,
                          .fine_s = 1e-3,
                          .richardson = {.order = 3.75, .factor = 0.125, .safety = 1.25},
                          .index = 2.5e-9,
                          .error = 3.5e-9,
                          .allowed = 4.5e-9,
                          .pass = true,
                          .drives = {{"d1", "N", 123.456789, 6.5e-8, 7.5e-8}}};
  return report;
}

TEST(ConvergenceReport, TextTableAndJsonAreAsWritten) {
  const ConvergenceReport report = WithEverything();
  ExpectGolden("converge.txt", ToText(report));
  ExpectGolden("converge.csv", ToCsv(report));
  const auto json = nlohmann::ordered_json::parse(ToJson(report));
  ExpectGolden("converge.json", Rounded(json).dump(2) + "\n");
}

TEST(ConvergenceReport, ForcesThatCannotBeExtrapolatedAreReported) {
  ConvergenceReport report = WithEverything();
  report.extrapolation.fine_s = kNan;
  report.extrapolation.pass = false;
  const std::string text = ToText(report);
  EXPECT_NE(text.find("forces at step zero: nothing to extrapolate, the finest run is taken\n"
                      "  inverse mode: 3.5e-09 off (allowed 4.5e-09): FINDING\n"),
            std::string::npos)
      << text;
}

TEST(ConvergenceReport, TheTableNamesTheFindingTheOrdersAndTheRunThatFailed) {
  const std::string text = ToText(WrongOrder());
  for (const char* part : {"robot / case: FINDING", "order 2.00 ± 0.00, expected 4 to 6: too low",
                           "no result at step 0.0005 s", "diverged", "1.60e-05"}) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  }
}

TEST(ConvergenceReport, TheCsvHasOneRowPerRunAndOneCellPerColumn) {
  const std::string csv = ToCsv(WrongOrder());
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 5);
  const auto header = csv.substr(0, csv.find('\n'));
  EXPECT_EQ(std::count(csv.begin(), csv.end(), ','),
            5 * std::count(header.begin(), header.end(), ','));
  EXPECT_NE(csv.find("corrected_both,corrected,0.0040000000000000001,"), std::string::npos) << csv;
}

TEST(ConvergenceReport, TheJsonIsCompleteAndHasNullForWhatIsMissing) {
  const auto json = nlohmann::json::parse(ToJson(WrongOrder()));
  EXPECT_EQ(json["schema"], "mbverify.convergence/1");
  EXPECT_EQ(json["verdict"], "finding");
  const auto& series = json["series"][0];
  EXPECT_TRUE(series["finding"].get<bool>());
  EXPECT_NEAR(series["fit"]["order"].get<double>(), 2.0, 1e-12);
  EXPECT_EQ(series["points"].size(), 4u);
  EXPECT_EQ(series["points"][1]["error"]["smooth"].get<double>(), 4e-6);
  EXPECT_TRUE(series["points"][3]["error"]["smooth"].is_null());
  EXPECT_EQ(series["points"][3]["failure"], "diverged");
  EXPECT_TRUE(json["extrapolation"]["fine_step_s"].is_null());
}

TEST(ConvergenceReport, ThePlotsShowErrorsFittedAndExpectedSlope) {
  const auto plots = ConvergencePlots(WrongOrder());
  ASSERT_EQ(plots.size(), 3u);
  for (const auto& [name, svg] : plots) {
    EXPECT_EQ(svg.find("nan"), std::string::npos) << name;
    EXPECT_EQ(svg.find("inf"), std::string::npos) << name;
  }
  EXPECT_EQ(plots[0].first, "error_step.svg");
  EXPECT_EQ(plots[2].first, "error_cpu.svg");
  for (const size_t k : {0u, 2u}) {
    EXPECT_NE(plots[k].second.find("fitted 2.00"), std::string::npos) << plots[k].first;
    EXPECT_NE(plots[k].second.find("expected 4"), std::string::npos) << plots[k].first;
  }
}

TEST(ConvergenceReport, ASeriesOfTimeConstantsHasItsOwnPlot) {
  ConvergenceReport report = WrongOrder();
  ConvergenceSeries softer = report.series[0];
  softer.title = "softer constraints";
  softer.knob = Knob::kTimeConstant;
  report.series.push_back(softer);
  const auto plots = ConvergencePlots(report);
  ASSERT_EQ(plots[1].first, "error_time_constant.svg");
  for (const auto& [name, svg] : plots) {
    EXPECT_EQ(svg.find("softer constraints") != std::string::npos, name == plots[1].first) << name;
  }
  EXPECT_NE(plots[1].second.find("fitted 2.00"), std::string::npos);
  EXPECT_NE(plots[1].second.find("time constant [s]"), std::string::npos);
  // From 0.05 to 0.2 s, what was reached; the run that failed has no point.
  EXPECT_NE(plots[1].second.find(">0.1</text>"), std::string::npos);
}

}  // namespace
}  // namespace mbv
