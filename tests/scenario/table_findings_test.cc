// What is said about wrong tables: each finding with file, line and column.
#include "scenario/tables/table.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "scenario/load_scenario.h"
#include "tests/scenario/load_table.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// Rows of d1.position over time: `rows` of them, `h` apart, without those in `from` … `to`.
template <typename F>
std::string PositionTable(int rows, double h, const F& f, int from = -1, int to = -1,
                          const std::string& head = "t (s),d1.position (m)") {
  std::string text = head + "\n";
  for (int i = 0; i < rows; ++i) {
    if (i >= from && i <= to) continue;
    text += fmt::format("{:.9g},{:.9g}\n", i * h, f(i * h));
  }
  return text;
}

TEST(TableFindings, MissingRowsOfARegularGridAreNamedWithTheirLine) {
  const auto swing = [](double t) { return 0.1 * std::sin(5.0 * t); };
  const std::string text = LoadTable(PositionTable(101, 0.01, swing, 40, 69)).text;
  EXPECT_TRUE(Has(text,
                  "t.csv:42:1: warning: 30 rows are missing: the rows are 0.01 s apart, but none "
                  "lies between 0.39 and 0.7 s"))
      << text;
  // In the file's own unit, too.
  EXPECT_TRUE(Has(LoadTable(PositionTable(101, 10.0, swing, 40, 69, "t (ms),d1.position (m)")).text,
                  "none lies between 0.39 and 0.7 s"));
  // A row or two that a log lost, none at all, and stamps that were rounded.
  EXPECT_EQ(LoadTable(PositionTable(101, 0.01, swing, 40, 41)).text, "");
  EXPECT_EQ(LoadTable(PositionTable(101, 0.01, swing)).text, "");
  std::string rounded = "t (s),d1.position (m)\n", uneven = rounded;
  double t = 0.0;
  for (int i = 0; i < 200; ++i) {
    rounded += fmt::format("{:.3f},{:.9g}\n", i / 300.0, swing(i / 300.0));
    t += 0.002 * (1.0 + 0.9 * std::sin(0.7 * i)) * (i % 40 == 0 ? 8.0 : 1.0);
    uneven += fmt::format("{:.9g},{:.9g}\n", t, swing(t));
  }
  EXPECT_EQ(LoadTable(rounded).text, "");
  EXPECT_EQ(LoadTable(uneven).text, "");  // steps of a solver
}

TEST(TableFindings, TwoPositionsAtOneTimeAreNamedWithTheirLine) {
  const auto swing = [](double t) { return 0.1 * std::sin(5.0 * t); };
  std::string rows = PositionTable(101, 0.01, swing);
  const size_t at = rows.find("\n0.5,") + 1;
  const std::string twice = rows.substr(0, at) + "0.5,0.3\n" + rows.substr(at);
  const std::string text = LoadTable(twice).text;
  EXPECT_TRUE(Has(text,
                  "t.csv:53:1: warning: t (s) = 0.5 has two values of d1.position (m), 0.3 "
                  "and 0.0598472144: both rows are left out") ||
              Has(text,
                  "t.csv:53:1: warning: t (s) = 0.5 has two values of d1.position (m), 0.3 "
                  "and 0.0598472: both rows are left out"))
      << text;
  // An event writes its time twice; positions go on, forces may jump.
  const std::string event = rows.substr(0, at) + "0.5,0.0598472145\n" + rows.substr(at);
  EXPECT_EQ(LoadTable(event).text, "");
  std::string forces = "t (s),d1.force (N)\n";
  for (int i = 0; i <= 100; ++i) {
    if (i == 50) forces += "0.5,3\n";
    forces += fmt::format("{:.9g},{:.9g}\n", 0.01 * i, i < 50 ? 3.0 : -4.0);
  }
  EXPECT_EQ(LoadTable(forces).text, "");
}

TEST(TableFindings, NumbersThatFitAnotherUnitAreDoubtedWhereNoneIsStated) {
  const auto swing = [](double t) { return 0.1 * std::sin(5.0 * t); };
  // Milliseconds.
  const auto in_ms = [&](double t) { return swing(1e-3 * t); };
  const std::string ms =
      LoadTable(PositionTable(101, 10.0, in_ms, -1, -1, "t,d1.position (m)")).text;
  EXPECT_TRUE(Has(ms,
                  "t.csv:1:1: warning: t has no unit, and its whole numbers, 10 apart up to "
                  "1000, are taken as seconds"))
      << ms;
  EXPECT_TRUE(Has(ms, "time_unit: ms")) << ms;
  for (const char* head : {"t (ms),d1.position (m)", "t (s),d1.position (m)"}) {
    EXPECT_EQ(LoadTable(PositionTable(101, 10.0, in_ms, -1, -1, head)).text, "") << head;
  }
  EXPECT_EQ(LoadTable(PositionTable(11, 1.0, swing, -1, -1, "t,d1.position (m)")).text, "");
  EXPECT_EQ(LoadTable(PositionTable(101, 10.0, in_ms, -1, -1, "t,d1.position (m)"),
                      "{csv: t.csv, time_unit: s}")
                .text,
            "");
  // Millimetres.
  const auto in_mm = [&](double t) { return 1e4 * swing(t); };
  const std::string mm =
      LoadTable(PositionTable(101, 0.01, in_mm, -1, -1, "t (s),d1.position")).text;
  EXPECT_TRUE(Has(mm, "t.csv:1:7: warning: d1.position has no unit")) << mm;
  EXPECT_TRUE(Has(mm, "are they millimetres? state unit: mm (or m)")) << mm;
  EXPECT_EQ(LoadTable(PositionTable(101, 0.01, swing, -1, -1, "t (s),d1.position")).text, "");
}

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
  EXPECT_TRUE(Has(text, "t.csv:3:3: error: d1.force = 'two' is not a number")) << text;
  EXPECT_TRUE(Has(text, "t.csv:4:3: error: d1.force: the cell is empty")) << text;
}

TEST(TableFindings, ThousandsSeparatorsAreExplained) {
  const std::string text =
      LoadTable("t;d1.force\n0;1.5\n1;1,234.5\n2;3.5\n3;4.5\n4;5.5\n5;6.5\n").text;
  EXPECT_TRUE(Has(text, "t.csv:3:3: error: d1.force = '1,234.5' is not a number")) << text;
  EXPECT_TRUE(Has(text, "without thousands separators")) << text;
}

TEST(TableFindings, TimesThatGoBackOrRepeatAreRefused) {
  const std::string text = LoadTable("t,d1.force\n0,1\n2,2\n1,3\n3,4\n3,5\n4,6\n").text;
  EXPECT_TRUE(Has(text, "t.csv:4:1: error: t = 1 goes back from 2")) << text;
  EXPECT_TRUE(Has(text, "t.csv:6:1: error: t = 3 is repeated")) << text;
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
  EXPECT_TRUE(
      Has(heading, "t.csv:1:3: error: F (mm): 'mm' is not a unit of d1.force, which is in N"))
      << heading;
  const std::string stated =
      LoadTable(csv, "{csv: t.csv, columns: {d1.force: {column: F, unit: kNewton}}}").text;
  EXPECT_TRUE(Has(stated,
                  "s.yaml:1:52: error: reference.columns.d1.force.unit: 'kNewton' is not a "
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

TEST(TableFindings, WhatIsNotATableSaysSo) {
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

}  // namespace
}  // namespace mbv
