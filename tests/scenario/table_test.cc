// Tables of forces: the many ways to write one.
#include "scenario/tables/table.h"

#include <gtest/gtest.h>

#include <numbers>
#include <string>
#include <tuple>

#include "scenario/tables/text.h"
#include "tests/scenario/load_table.h"

namespace mbv {
namespace {

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

// The slash of "mm/s" is not that of "v/s".
TEST(Table, ASlashInBracketsBelongsToTheUnit) {
  for (const char* heading : {"v (mm/s)", "v [mm/s]", "v/(mm/s)", "v/mm/s"}) {
    const Loaded loaded = LoadTable(std::string("t,") + heading + "\n0,1\n1,2\n2,3\n3,5\n",
                                    "{csv: t.csv, columns: {d1.velocity: v}}");
    ASSERT_TRUE(loaded.table) << heading << loaded.text;
    EXPECT_NEAR(loaded.table->values(3, 0), 5e-3, kTiny) << heading;
  }
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

}  // namespace
}  // namespace mbv
