#include "report/result_tables.h"

#include <gmock/gmock.h>

#include "tests/support/reports.h"

namespace mbv {
namespace {

using testing::Contains;
using testing::ElementsAre;

std::vector<Parameter> FourParameters() {
  return {{"q_min", 0.5, "m", Source::kPrinted, "shortest leg"},
          {"phi", 0.17802358370342161, "rad", Source::kAssumed, ""},
          {"l_0", 3.277197735871, "m", Source::kUnstated, "neutral"},
          {"scale", 0.1, "1", Source::kAssumed, ""},
          {"I_x", 4.76e5, "kg m^2", Source::kCorrected, ""}};
}

TEST(ParameterTable, KeepsTheDigitsThatAreStated) {
  const Table table = ParameterTable(
      FourParameters(), {{"q_min", {"0.500", "m", 0.5}},
                         {"phi", {"10.2", "deg", 0.17802358370342161}},
                         {"I_x", {"4.76e5", "kg m^2", 4.76e5}},
                         {"scale", {"1", "1", 1.0}}});  // the scenario set another value
  ASSERT_EQ(table.rows.size(), 5u);
  EXPECT_THAT(table.rows[0], ElementsAre("q_min", "0.500", "m", "printed", "shortest leg"));
  EXPECT_THAT(table.rows[1], ElementsAre("phi", "10.2", "deg", "assumed", ""));
  EXPECT_THAT(table.rows[2], ElementsAre("l_0", "3.2772", "m", "–", "neutral"));
  EXPECT_THAT(table.rows[3], ElementsAre("scale", "0.1", "", "set", ""));
  EXPECT_THAT(table.rows[4], ElementsAre("I_x", "4.76e5", "kg m²", "corrected", ""));
}

TEST(ParameterTable, APerturbedValueIsNotWrittenAsStated) {
  std::vector<Parameter> parameters = FourParameters();
  parameters[0].value = 0.51;
  const Table table = ParameterTable(parameters, {{"q_min", {"0.500", "m", 0.5}}});
  EXPECT_THAT(table.rows[0], ElementsAre("q_min", "0.51", "m", "set", "shortest leg"));
}

TEST(CheckTable, HasEveryCheckWithALimitAndHowItEnded) {
  synthetic::Case c;
  const Table agree = CheckTable(ViewOf(test::MakeReport(c)));
  c.simulated.values(40, c.simulated.Find("d2.force")) += 0.5;
  const Report perturbed = test::MakeReport(c);
  const Table differs = CheckTable(ViewOf(perturbed));
  EXPECT_EQ(agree.rows.size(), ViewOf(perturbed).limits());
  EXPECT_THAT(agree.caption, testing::EndsWith(": agree"));
  EXPECT_THAT(differs.caption, testing::EndsWith(": disagree"));
  const auto fails = [](const Table& table) {
    return std::ranges::count_if(table.rows, [](const auto& row) { return row[4].text == "FAIL"; });
  };
  EXPECT_EQ(fails(agree), 0);
  EXPECT_GT(fails(differs), 0);
}

TEST(MobilityTable, ReportsRanksAndWhatStaticsLeavesOpen) {
  MobilityReport report;
  report.home.constraint_rows = 22;
  report.home.constraint_rank = 21;
  report.home.redundant = 1;
  report.home.dofs = 3;
  report.home.joints_not_unique = {"A", "B"};
  const Table table = MobilityTable(synthetic::TwoSliders(), report);
  EXPECT_THAT(table.rows, Contains(ElementsAre("constraints, rank", "22, 21")));
  EXPECT_THAT(table.rows, Contains(ElementsAre("degrees of freedom", "3")));
  EXPECT_THAT(table.rows, Contains(ElementsAre("redundant constraints", "1")));
  EXPECT_THAT(table.rows, Contains(ElementsAre("joints with reactions left open", "A, B")));
}

TEST(SizingTable, HasNoRowsWithoutMotors) {
  EXPECT_TRUE(SizingTable(test::MakeReport(synthetic::Case())).rows.empty());
}

}  // namespace
}  // namespace mbv
