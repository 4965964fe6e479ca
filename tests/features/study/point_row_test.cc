// Rows of points.csv: to the last bit, and nothing that is none is taken for one.
#include "features/study/summary.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <random>

namespace mbv {
namespace {

Study TwoNumbers() {
  Study study;
  study.factors = {{.name = "m_p", .key = "parameters.m_p", .axis = {}},
                   {.name = "a,b", .key = "a,b", .axis = {}}};
  study.quantities = {{.name = "x.force.max", .channel = "x.force"}};
  study.design.seed = 9;
  return study;
}

TEST(PointRow, ReadsBackWhatItWrote) {
  const Study study = TwoNumbers();
  const PointRow row{.point = 12,
                     .exit_code = 3,
                     .reason = "no \"way\",\nsaid it",
                     .varied = {0.1, -1e300},
                     .values = {std::nan("")}};
  const std::string line = PointLine(row, study);
  EXPECT_EQ(line,
            "12,9,3,\"no \"\"way\"\", said it\",0.10000000000000001,-1.0000000000000001e+300,\n");
  const auto read = ReadPointLine(line.substr(0, line.size() - 1), study);
  ASSERT_TRUE(read);
  EXPECT_EQ(read->point, 12u);
  EXPECT_EQ(read->exit_code, 3);
  EXPECT_EQ(read->reason, "no \"way\", said it");
  EXPECT_EQ(read->varied, row.varied);
  EXPECT_TRUE(std::isnan(read->values[0]));
  EXPECT_EQ(PointHeader(study), "point,seed,exit,reason,m_p,\"a,b\",x.force.max\n");
}

TEST(PointRow, RefusesWhatIsNotARowOfTheStudy) {
  const Study study = TwoNumbers();
  const std::string good = "1,9,0,,0.5,1,2";
  ASSERT_TRUE(ReadPointLine(good, study));
  for (const char* bad :
       {"", "1", "1,9,0,,0.5,1", "1,9,0,,0.5,1,2,3", "1,8,0,,0.5,1,2", "1,9,0,,0.5,x,2",
        "-1,9,0,,0.5,1,2", "1,9,0,\"open,0.5,1,2", "1,9,0,,0.5,1,2x"}) {
    EXPECT_FALSE(ReadPointLine(bad, study)) << bad;
  }
}

TEST(PointRow, NumbersHaveSeventeenDigitsAsPrinted) {
  Study study;
  study.factors = {{.name = "x", .key = "x", .axis = {}}};
  std::mt19937_64 random(20261129);
  for (int k = 0; k < 20000; ++k) {
    const double value = k < 100 ? 0.5 * k - 3.0 : std::bit_cast<double>(random());
    const std::string digits = std::isfinite(value) ? fmt::format("{:.17g}", value) : "";
    EXPECT_EQ(PointLine({.reason = {}, .varied = {value}}, study), "0,1,0,," + digits + "\n");
  }
}

TEST(StudyLimit, KeepsWhatLiesWithinAndNoMissingValue) {
  const StudyLimit limit{.below = 2.0, .above = 1.0};
  EXPECT_TRUE(limit.Keeps(1.5));
  EXPECT_FALSE(limit.Keeps(2.0));
  EXPECT_FALSE(limit.Keeps(1.0));
  EXPECT_FALSE(limit.Keeps(std::nan("")));
}

}  // namespace
}  // namespace mbv
