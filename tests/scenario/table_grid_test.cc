// Times, printed steps, noise, and the way of a table onto the grid of a motion.
#include "scenario/tables/table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <random>
#include <string>

#include "tests/scenario/load_table.h"

namespace mbv {
namespace {

// Every 0.1 s; what `more` adds is written after the row of its time.
std::string ModelicaTable(const std::map<int, std::string>& more) {
  std::string csv = "time,d1.force,d2.force\n";
  for (int i = 0; i <= 40; ++i) {
    csv += fmt::format("{:.2f},{:.3f},{:.3f}\n", 0.1 * i, std::sin(0.1 * i), std::cos(0.1 * i));
    if (const auto found = more.find(i); found != more.end()) csv += found->second;
  }
  return csv;
}

TEST(TableTimes, TheLastTimeMayBeWrittenTwice) {
  const std::string last = fmt::format("4.00,{:.3f},{:.3f}\n", std::sin(4.0), std::cos(4.0));
  const Loaded loaded = LoadTable(ModelicaTable({{40, last}}));
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  EXPECT_EQ(loaded.table->time_s.size(), 41u);
  EXPECT_TRUE(loaded.table->uniform);
  EXPECT_EQ(SuggestSample(*loaded.table), 0.1);
}

TEST(TableTimes, EventsAreLeftOutAndTheRestStaysOnItsGrid) {
  const Loaded loaded = LoadTable(ModelicaTable({{12, "1.23,0.9,0.3\n1.23,0.5,0.3\n"},
                                                 {20, "2.00,0.1,0.2\n"},
                                                 {31, "3.17,0,-1\n3.17,0,-1\n3.17,0,-1\n"}}));
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  EXPECT_EQ(loaded.table->time_s.size(), 40u);
  EXPECT_EQ(SuggestSample(*loaded.table), 0.1);
  Motion motion;
  motion.duration_s = 4.0;
  motion.sample_s = 0.1;
  EXPECT_FALSE(AlignTable(*loaded.table, motion).interpolated);
  bool said = false;
  for (const std::string& note : loaded.table->notes) said = said || Has(note, "as at events");
  EXPECT_TRUE(said);
}

TEST(TableTimes, ALateStartIsReportedWithTheOffsetThatCorrectsIt) {
  const Loaded loaded = LoadTable("t,d1.force\n3.5,1\n3.6,2\n3.7,3\n3.8,5\n3.9,4\n");
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  Motion motion;
  motion.duration_s = 0.4;
  motion.sample_s = 0.1;
  EXPECT_TRUE(Has(AlignTable(*loaded.table, motion).grid, "add time_offset_s: -3.5"));
  motion.duration_s = 3.9;
  const AlignedTable partly = AlignTable(*loaded.table, motion);
  EXPECT_FALSE(partly.trace.time_s.empty());
  bool said = false;
  for (const std::string& note : partly.notes) said = said || Has(note, "add time_offset_s: -3.5");
  EXPECT_TRUE(said);
}

ReferenceTable Sampled(int rows, double step_s, const std::string& format_digits,
                       const std::function<double(double)>& f) {
  std::string csv = "t,d1.force\n";
  for (int i = 0; i < rows; ++i) {
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), ("%.9g," + format_digits + "\n").c_str(), i * step_s,
                  f(i * step_s));
    csv += line.data();
  }
  const Loaded loaded = LoadTable(csv);
  EXPECT_NE(loaded.table, nullptr) << loaded.text;
  return *loaded.table;
}

double Sine(double t) { return 100.0 * std::sin(2.0 * std::numbers::pi * t); }

TEST(TableUncertainty, ThePrintedStepIsThatOfTheLastDigit) {
  const ReferenceTable fixed = Sampled(101, 0.01, "%.3f", Sine);
  EXPECT_NEAR(fixed.steps.maxCoeff(), 1e-3, kTiny);
  EXPECT_NEAR(fixed.steps.minCoeff(), 1e-3, kTiny);
  const ReferenceTable digits = Sampled(101, 0.01, "%.4e", Sine);
  EXPECT_NEAR(digits.steps(25, 0), 1e-2, kTiny);  // 1.0000e+02
  EXPECT_NEAR(digits.steps(1, 0), 1e-4, kTiny);   // 6.2791e+00
}

TEST(TableUncertainty, NoiseIsFoundToAFifthOfItself) {
  std::mt19937_64 random(20);
  std::normal_distribution<double> normal(0.0, 0.05);
  const ReferenceTable noisy =
      Sampled(401, 0.0025, "%.9f", [&](double t) { return Sine(t) + normal(random); });
  EXPECT_NEAR(noisy.columns[0].noise, 0.05, 0.01);  // median of 400: 5 % standard deviation
  const ReferenceTable clean = Sampled(401, 0.0025, "%.9f", Sine);
  EXPECT_LT(clean.columns[0].noise, 1e-8);
}

Motion Seconds(double duration_s, double sample_s) {
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = sample_s;
  return motion;
}

TEST(TableGrid, RowsOnTheGridAreTakenAsTheyAre) {
  const ReferenceTable table = Sampled(51, 0.02, "%.6f", Sine);
  EXPECT_TRUE(table.uniform);
  EXPECT_NEAR(SuggestSample(table), 0.02, kTiny);
  const AlignedTable aligned = AlignTable(table, Seconds(1.0, 0.01));
  EXPECT_FALSE(aligned.interpolated);
  ASSERT_EQ(aligned.trace.time_s.size(), 51u);
  EXPECT_EQ(aligned.trace.values, table.values);
  // Half a printed unit at most, and a twelfth of its square on average.
  EXPECT_NEAR(aligned.uncertainty[0].digits, 1e-6 / std::sqrt(12.0), 1e-9);
}

TEST(TableGrid, RowsOffTheGridAreInterpolatedAndOwnUpToIt) {
  const ReferenceTable table = Sampled(101, 0.0101, "%.9f", Sine);
  const AlignedTable aligned = AlignTable(table, Seconds(1.0, 0.01));
  EXPECT_TRUE(aligned.interpolated);
  ASSERT_EQ(aligned.trace.time_s.size(), 101u);
  double worst = 0.0;
  for (size_t i = 0; i < aligned.trace.time_s.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    const double error = std::abs(aligned.trace.values(row, 0) - Sine(aligned.trace.time_s[i]));
    worst = std::max(worst, error);
    // Three times the stated standard uncertainty bounds what cubic interpolation does to a sine.
    EXPECT_LE(error, 3.0 * aligned.standard(row, 0) + 1e-8) << aligned.trace.time_s[i];
  }
  EXPECT_GT(worst, 1e-6);  // there is something to own up to
  EXPECT_GT(aligned.uncertainty[0].interpolation, 0.0);
}

// A cubic through two rows on each side is off by at most 3/128 h⁴ f''''; through four rows on one
// side by much more.
TEST(TableGrid, RowsOffTheGridAreInterpolatedFromBothSides) {
  const double h = 0.0101, w = 2.0 * std::numbers::pi;
  const ReferenceTable table = Sampled(101, h, "%.12f", Sine);
  const AlignedTable aligned = AlignTable(table, Seconds(1.0, 0.01));
  ASSERT_TRUE(aligned.interpolated);
  const double most = 1.01 * 3.0 / 128.0 * std::pow(w * h, 4) * 100.0;
  int inside = 0;
  for (size_t i = 0; i < aligned.trace.time_s.size(); ++i) {
    const double t = aligned.trace.time_s[i];
    if (t < h || t > 1.0 - h) continue;
    ++inside;
    EXPECT_LT(std::abs(aligned.trace.values(static_cast<Eigen::Index>(i), 0) - Sine(t)), most) << t;
  }
  EXPECT_GT(inside, 90);
}

// 9.500, 10.50, 11.50 … with four digits: a sample has the last digit of the row next to it.
TEST(TableGrid, ASampleOffTheGridHasTheStepOfTheNearestRow) {
  const double h = 0.0101;
  const ReferenceTable table =
      Sampled(11, h, "%.3e", [&](double t) { return 9.5 + std::round(t / h); });
  const AlignedTable aligned = AlignTable(table, Seconds(0.1, 0.01));
  ASSERT_TRUE(aligned.interpolated);
  EXPECT_NEAR(aligned.standard(0, 0), 1e-3 / std::sqrt(12.0), 1e-9);
  EXPECT_NEAR(aligned.standard(1, 0), 1e-2 / std::sqrt(12.0), 1e-9);
}

TEST(TableGrid, RowsOutsideTheMotionAreLeftOutAndNamed) {
  const AlignedTable aligned = AlignTable(Sampled(101, 0.01, "%.6f", Sine), Seconds(0.5, 0.01));
  EXPECT_EQ(aligned.trace.time_s.size(), 51u);
  bool named = false;
  for (const std::string& note : aligned.notes) named = named || Has(note, "50 of 101 rows");
  EXPECT_TRUE(named);
  const Loaded late = LoadTable("5,1\n6,2\n7,3\n8,4\n", "{csv: t.csv, columns: {d1.force: 2}}");
  ASSERT_NE(late.table, nullptr) << late.text;
  EXPECT_TRUE(AlignTable(*late.table, Seconds(1.0, 0.01)).trace.time_s.empty());
}

TEST(TableGrid, RoundedTimeStampsCountAsUncertainty) {
  // 3 samples in 10 ms, times printed to 1 ms: equal steps, off by a third of a digit.
  std::string csv = "t,d1.force\n";
  for (int i = 0; i < 100; ++i) {
    std::array<char, 80> line{};
    std::snprintf(line.data(), line.size(), "%.3f,%.9f\n", i / 300.0, Sine(i / 300.0));
    csv += line.data();
  }
  const Loaded loaded = LoadTable(csv);
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  EXPECT_TRUE(loaded.table->uniform);
  EXPECT_GT(loaded.table->stamp_error_s, 3e-4);
  EXPECT_LT(loaded.table->stamp_error_s, 1.1e-3);
}

TEST(TableGrid, AStatedToleranceReplacesTheEstimate) {
  const Loaded loaded = LoadTable("t,d1.force\n0,1\n1,2\n2,3\n3,-4\n",
                                  "{csv: t.csv, tolerance: {relative: 0.01, "
                                  "absolute: 0.02}, coverage: 2}");
  // `coverage` belongs below `tolerance`.
  EXPECT_TRUE(Has(loaded.text, "coverage")) << loaded.text;
  const Loaded stated = LoadTable("t,d1.force\n0,1\n1,2\n2,3\n3,-4\n",
                                  "{csv: t.csv, tolerance: {relative: 0.01, absolute: 0.02}}");
  ASSERT_NE(stated.table, nullptr) << stated.text;
  const AlignedTable aligned = AlignTable(*stated.table, Seconds(3.0, 1.0));
  ASSERT_TRUE(aligned.uncertainty[0].stated);
  // coverage · bound = 0.02 + 1 % of 4.
  EXPECT_NEAR(aligned.coverage * aligned.bound(0, 0), 0.06, kTiny);
}

}  // namespace
}  // namespace mbv
