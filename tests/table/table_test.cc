// Tables of forces: what is read from the many ways to write one, and what is said about wrong
// ones.
#include "table/table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <map>
#include <numbers>
#include <random>

#include "scenario/load_scenario.h"
#include "table/noise.h"
#include "table/settings.h"
#include "table/units.h"
#include "tests/source_dir.h"
#include "tests/two_sliders.h"

namespace mbv {
namespace {

// Numbers of these tests are written with few digits; conversion to double and one factor.
constexpr double kTiny = 4 * kEps;

struct Loaded {
  std::shared_ptr<const ReferenceTable> table;
  std::string text;  // all findings
};

// `yaml` is what stands below `reference:`.
Loaded LoadTable(const std::string& csv, const std::string& yaml = "{csv: t.csv}") {
  YamlReader reader("s.yaml");
  const YamlNodePtr root = reader.Parse(yaml);
  EXPECT_NE(root, nullptr) << yaml;
  if (root == nullptr) return {};
  Scope scope;
  ValueReader values(&reader, &scope);
  TableSettings settings = ReadTableSettings(&values, root.get());
  settings.file = "t.csv";
  Diagnostics findings;
  Loaded loaded;
  loaded.table = LoadTableText(csv, settings, test::DrivenSliders(), &reader, &findings);
  Diagnostics all = reader.diagnostics();
  all.Append(findings);
  loaded.text = all.Text();
  return loaded;
}

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// The hand-checkable table of these tests: t = 0, 0.5, 1, 1.5; d1 = 1, 2.5, -3, 4; d2 = 10 … 13.
void ExpectTheTable(const Loaded& loaded) {
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  const ReferenceTable& table = *loaded.table;
  ASSERT_EQ(table.columns.size(), 2u);
  EXPECT_EQ(table.columns[0].channel.name, "d1.force");
  EXPECT_EQ(table.columns[1].channel.name, "d2.force");
  ASSERT_EQ(table.time_s.size(), 4u);
  const double d1[] = {1.0, 2.5, -3.0, 4.0};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(table.time_s[static_cast<size_t>(i)], 0.5 * i, kTiny);
    EXPECT_NEAR(table.values(i, 0), d1[i], kTiny * 4) << i;
    EXPECT_NEAR(table.values(i, 1), 10.0 + i, kTiny * 13) << i;
  }
}

TEST(Table, CommasAreFound) {
  ExpectTheTable(LoadTable("t,d1.force,d2.force\n0,1,10\n0.5,2.5,11\n1,-3,12\n1.5,4,13\n"));
}

TEST(Table, TabsAreFound) {
  ExpectTheTable(
      LoadTable("t\td1.force\td2.force\n0\t1\t10\n0.5\t2.5\t11\n1\t-3\t12\n1.5\t4\t13\n"));
}

TEST(Table, SemicolonsAndDecimalCommasAreFound) {
  ExpectTheTable(LoadTable("t;d1.force;d2.force\n0;1;10\n0,5;2,5;11\n1;-3;12\n1,5;4;13\n"));
}

TEST(Table, BlanksAreFound) {
  ExpectTheTable(
      LoadTable("  t  d1.force d2.force\n 0 1 10\n 0.5  2.5  11\n 1 -3 12 \n 1.5 4 13\n"));
}

TEST(Table, TabsMayCarryDecimalCommas) {
  ExpectTheTable(
      LoadTable("t\td1.force\td2.force\n0\t1\t10\n0,5\t2,5\t11\n1\t-3\t12\n1,5\t4\t13\n"));
}

TEST(Table, AByteOrderMarkAndWindowsLineEndsAreNoContent) {
  ExpectTheTable(LoadTable(
      "\xEF\xBB\xBFt,d1.force,d2.force\r\n0,1,10\r\n0.5,2.5,11\r\n1,-3,12\r\n1.5,4,13\r\n"));
}

TEST(Table, ALastLineWithoutEndCountsAndBlankLinesDoNot) {
  ExpectTheTable(LoadTable("t,d1.force,d2.force\n\n0,1,10\n0.5,2.5,11\n\n1,-3,12\n1.5,4,13"));
}

TEST(Table, QuotedHeadingsMayHoldTheDelimiter) {
  ExpectTheTable(
      LoadTable("\"time, s\",\"d1, F\",\"d2, F\"\n0,1,10\n0.5,2.5,11\n1,-3,12\n1.5,4,13\n",
                "{csv: t.csv, columns: {time: 'time, s', d1.force: 'd1, F', "
                "d2.force: 'd2, F'}}"));
}

TEST(Table, CommentsAndTitleLinesAreSkipped) {
  ExpectTheTable(LoadTable(
      "# made by hand\nA title\nt,d1.force,d2.force\n0,1,10\n0.5,2.5,11\n1,-3,12\n1.5,4,13\n"));
}

TEST(Table, FortranAndExponentFormsAreNumbers) {
  ExpectTheTable(
      LoadTable("t,d1.force,d2.force\n0,1.D0,1e1\n5.0E-1,2.5d+00,1.1E+1\n1,-3.,12\n+1.5,4,13\n"));
}

TEST(Table, AUnitRowScales) {
  ExpectTheTable(
      LoadTable("Time\tF1\tF2\n(msec)\t(kN)\t(mN)\n0\t0.001\t10000\n500\t0.0025\t11000\n"
                "1000\t-0.003\t12000\n1500\t0.004\t13000\n",
                "{csv: t.csv, columns: {d1.force: F1, d2.force: F2}}"));
}

TEST(Table, UnitsInHeadingsScale) {
  for (const char* heading : {"t (ms),F1 (kN),F2 [daN]", "t/ms,F1/kN,F2/daN"}) {
    ExpectTheTable(LoadTable(std::string(heading) + "\n0,0.001,1\n500,0.0025,1.1\n1000,-0.003,1.2\n"
                                                    "1500,0.004,1.3\n",
                             "{csv: t.csv, columns: {time: t, d1.force: F1, d2.force: F2}}"));
  }
}

TEST(Table, ColumnsMayBeNumberedShiftedScaledAndTurnedRound) {
  // value = sign · scale · number + offset, all in the unit, then SI; time by its offset.
  ExpectTheTable(
      LoadTable("3,5,-0.5\n3.5,5.5,-1.25\n4,6,1.5\n4.5,6.5,-2\n",
                "{csv: t.csv, time_offset_s: -3, columns: {time: 1, d1.force: {column: 3, "
                "sign: -1, scale: 2}, d2.force: {column: 2, scale: 2, offset: 0}}}"));
  const Loaded shifted =
      LoadTable("0,1\n1,2\n2,3\n3,4\n",
                "{csv: t.csv, columns: {d1.force: {column: 2, unit: kN, sign: -1, "
                "offset: 0.5}}}");
  ASSERT_NE(shifted.table, nullptr) << shifted.text;
  EXPECT_NEAR(shifted.table->values(0, 0), -500.0, kTiny * 1000);
}

TEST(Table, OurOwnTracesAreReadByWitness) {
  const std::string csv =
      "time_s,d1.force.analytic,d1.force.simulated\n0,1,5\n1,2,6\n2,3,7\n3,4,8\n";
  const Loaded analytic = LoadTable(csv, "{csv: t.csv, witness: analytic}");
  ASSERT_NE(analytic.table, nullptr) << analytic.text;
  EXPECT_EQ(analytic.table->values(3, 0), 4.0);
  const Loaded simulated = LoadTable(csv, "{csv: t.csv, witness: simulated}");
  ASSERT_NE(simulated.table, nullptr) << simulated.text;
  EXPECT_EQ(simulated.table->values(3, 0), 8.0);
  EXPECT_TRUE(Has(LoadTable(csv).text, "or state witness: analytic | simulated"))
      << LoadTable(csv).text;
}

TEST(Table, OffLeavesAColumnOutThatHasASignalsName) {
  const Loaded loaded = LoadTable("t,d1.force,d2.force\n0,1,10\n1,2,11\n2,3,12\n3,4,13\n",
                                  "{csv: t.csv, columns: {d2.force: off}}");
  ASSERT_NE(loaded.table, nullptr) << loaded.text;
  ASSERT_EQ(loaded.table->columns.size(), 1u);
  EXPECT_EQ(loaded.table->columns[0].channel.name, "d1.force");
}

// Findings: each with file, line and column.

TEST(TableFindings, AMissingColumnIsNamedAtItsKeyWithTheNearestHeading) {
  const std::string text = LoadTable("t,F_one,F2\n0,1,10\n1,2,11\n2,3,12\n3,4,13\n",
                                     "{csv: t.csv, columns: {d1.force: F_ome}}")
                               .text;
  EXPECT_TRUE(Has(text,
                  "s.yaml:1:24: error: reference.columns.d1.force: t.csv has no column "
                  "'F_ome'"))
      << text;
  EXPECT_TRUE(Has(text, "did you mean 'F_one'?")) << text;
}

TEST(TableFindings, AnUnknownSignalIsNamedWithTheNearestOne) {
  const std::string text =
      LoadTable("t,F\n0,1\n1,2\n2,3\n3,4\n", "{csv: t.csv, columns: {d1.forse: F}}").text;
  EXPECT_TRUE(Has(text, "two_sliders has no signal 'd1.forse'")) << text;
  EXPECT_TRUE(Has(text, "did you mean 'd1.force'?")) << text;
}

TEST(TableFindings, AShortRowHasLineAndCounts) {
  const std::string text =
      LoadTable("t,d1.force,d2.force\n0,1,10\n1,2\n2,3,12\n3,4,13\n4,5,14\n").text;
  EXPECT_TRUE(Has(text, "t.csv:3:1: error: row of 2 cells in a table of 3 columns")) << text;
}

TEST(TableFindings, ALongRowPointsAtTheFirstCellTooMany) {
  const std::string text = LoadTable("t,d1.force\n0,1\n1,2,9\n2,3\n3,4\n4,5\n5,6\n").text;
  EXPECT_TRUE(Has(text, "t.csv:3:5: error: row of 3 cells in a table of 2 columns")) << text;
  EXPECT_TRUE(Has(text, "are commas decimal signs?")) << text;
}

TEST(TableFindings, NotANumberIsRefusedWithLineAndColumn) {
  for (const char* cell : {"NaN", "-inf", "#N/A", "1.#QNAN", "1e999"}) {
    const std::string text =
        LoadTable(std::string("t,d1.force\n0,1\n1,") + cell + "\n2,3\n3,4\n4,5\n").text;
    EXPECT_TRUE(Has(text, "t.csv:3:3: error: d1.force = ")) << cell << "\n" << text;
    EXPECT_TRUE(Has(text, "violates: a finite number")) << cell << "\n" << text;
  }
}

TEST(TableFindings, TextAndEmptyCellsAreRefusedWithLineAndColumn) {
  const std::string text =
      LoadTable("t,d1.force,d2.force\n0,1,10\n1,two,11\n2,,12\n3,4,13\n4,5,14\n").text;
  EXPECT_TRUE(Has(text, "t.csv:3:3: error: d1.force = 'two' is no number")) << text;
  EXPECT_TRUE(Has(text, "t.csv:4:3: error: d1.force: the cell is empty")) << text;
}

TEST(TableFindings, ThousandsSeparatorsAreExplained) {
  const std::string text =
      LoadTable("t;d1.force\n0;1.5\n1;1,234.5\n2;3.5\n3;4.5\n4;5.5\n5;6.5\n").text;
  EXPECT_TRUE(Has(text, "t.csv:3:3: error: d1.force = '1,234.5' is no number")) << text;
  EXPECT_TRUE(Has(text, "without thousands separators")) << text;
}

TEST(TableFindings, TimesThatGoBackOrRepeatAreRefused) {
  const std::string text = LoadTable("t,d1.force\n0,1\n2,2\n1,3\n3,4\n3,5\n4,6\n").text;
  EXPECT_TRUE(Has(text, "t.csv:4:1: error: t = 1 goes back from 2")) << text;
  EXPECT_TRUE(Has(text, "t.csv:6:1: error: t = 3 is repeated")) << text;
}

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

TEST(TableTimes, ALateStartIsToldWithTheOffsetThatMendsIt) {
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

TEST(TableFindings, AllOfThemAreGivenAtOnceUpToALimit) {
  std::string csv = "t,d1.force\n";
  for (int i = 0; i < 60; ++i) csv += std::to_string(i) + (i >= 20 && i < 50 ? ",x\n" : ",1\n");
  const std::string text = LoadTable(csv).text;
  EXPECT_TRUE(Has(text, "t.csv:22:4: error")) << text;
  EXPECT_TRUE(Has(text, "t.csv:41:4: error")) << text;
  EXPECT_TRUE(Has(text, "10 more findings")) << text;
}

TEST(TableFindings, AUnitOfAnotherKindIsRefusedInHeadingAndScenario) {
  const std::string csv = "t,F (mm)\n0,1\n1,2\n2,3\n3,4\n";
  const std::string heading = LoadTable(csv, "{csv: t.csv, columns: {d1.force: F}}").text;
  EXPECT_TRUE(Has(heading, "t.csv:1:3: error: F (mm): 'mm' is no unit of d1.force, which is in N"))
      << heading;
  const std::string stated =
      LoadTable(csv, "{csv: t.csv, columns: {d1.force: {column: F, unit: kNewton}}}").text;
  EXPECT_TRUE(Has(stated,
                  "s.yaml:1:52: error: reference.columns.d1.force.unit: 'kNewton' is no "
                  "known unit"))
      << stated;
}

TEST(TableFindings, AStatedUnitThatContradictsTheHeadingIsAWarning) {
  const Loaded loaded = LoadTable("t,F (N)\n0,1\n1,2\n2,3\n3,4\n",
                                  "{csv: t.csv, columns: {d1.force: {column: F, unit: kN}}}");
  ASSERT_NE(loaded.table, nullptr);
  EXPECT_EQ(loaded.table->values(0, 0), 1000.0);
  EXPECT_TRUE(Has(loaded.text,
                  "warning: reference.columns.d1.force.unit = 'kN', but the heading "
                  "of t.csv says 'N'"))
      << loaded.text;
}

TEST(TableFindings, ASettingThatIsNoneIsNamed) {
  const std::string csv = "t,d1.force\n0,1\n1,2\n2,3\n3,4\n";
  EXPECT_TRUE(Has(LoadTable(csv, "{csv: t.csv, delimeter: tab}").text, "delimeter"));
  EXPECT_TRUE(Has(LoadTable(csv, "{csv: t.csv, columns: {d1.force: {column: 2, sign: 2}}}").text,
                  "sign = 2 is neither 1 nor -1"));
  EXPECT_TRUE(Has(LoadTable(csv, "{csv: t.csv, columns: {d1.force: {column: 2, scale: 0}}}").text,
                  "scale = 0 would make the column zero"));
  EXPECT_TRUE(Has(LoadTable(csv, "{csv: t.csv, columns: {d1.force: 7}}").text,
                  "column 7 of t.csv violates 1 … 2"));
  EXPECT_TRUE(Has(LoadTable(csv, "{csv: t.csv, tolerance: {relative: -1}}").text, "violates >= 0"));
}

TEST(TableFindings, WhatIsNoTableSaysSo) {
  EXPECT_TRUE(Has(LoadTable("").text, "t.csv: error: holds no numbers"));
  EXPECT_TRUE(Has(LoadTable("just\nsome\nwords\n").text, "no table of numbers was found"));
  EXPECT_TRUE(Has(LoadTable(std::string("\xFF\xFE t", 4)).text, "is UTF-16 text"));
  EXPECT_TRUE(Has(LoadTable(std::string("1\0,2", 4)).text, "holds zero bytes"));
  EXPECT_TRUE(Has(LoadTable("t,d1.force\n0,1\n1,2\n").text, "has 2 rows of numbers, at least 4"));
  EXPECT_TRUE(
      Has(LoadTable("t,d1.force\n0,1\n1,\"2\n2,3\n3,4\n4,5\n").text, "a quote is not closed"));
}

TEST(TableFindings, AMissingFileIsNamedAtItsKey) {
  std::filesystem::current_path(kSourceDir);
  const ScenarioResult result = LoadScenarioText(
      "mechanism: four_bar\nmotion: {duration_s: 1, commands: {motor: home}}\nanalytic: none\n"
      "reference: {csv: tables/none.csv}\n",
      "scenarios/four_bar/t.yaml");
  EXPECT_FALSE(result.scenario);
  const std::string text = result.diagnostics.Text();
  EXPECT_TRUE(Has(text, "t.yaml:4:")) << text;
  EXPECT_TRUE(Has(text, "'tables/none.csv' cannot be read")) << text;
}

TEST(TableUnits, CommonSpellingsAreConverted) {
  const double degree = std::numbers::pi / 180.0;
  const std::tuple<const char*, const char*, double> units[] = {{"kN", "N", 1e3},
                                                                {"(newton)", "N", 1.0},
                                                                {"[N*mm]", "N m", 1e-3},
                                                                {"newton-mm", "N m", 1e-3},
                                                                {"mm/s^2", "m/s^2", 1e-3},
                                                                {"deg/sec**2", "rad/s^2", degree},
                                                                {"lbf", "N", 4.4482216152605},
                                                                {"Degrees", "rad", degree},
                                                                {"kgf", "N", 9.80665}};
  for (const auto& [text, si, factor] : units) {
    const auto unit = FindUnit(text);
    ASSERT_TRUE(unit) << text;
    EXPECT_EQ(unit->si, si) << text;
    EXPECT_NEAR(unit->factor, factor, kTiny * factor) << text;
  }
  EXPECT_FALSE(FindUnit("furlong"));
  EXPECT_FALSE(FindUnit("mN or MN"));
}

// Uncertainty.

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
