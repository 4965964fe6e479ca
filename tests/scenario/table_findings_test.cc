// What is said about wrong tables: each finding with file, line and column.
#include "scenario/tables/table.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "scenario/load_scenario.h"
#include "tests/scenario/load_table.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

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

}  // namespace
}  // namespace mbv
