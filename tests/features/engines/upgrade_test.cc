// What another version changes: the text and the JSON of it.
#include "features/engines/crosscheck.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace mbv {
namespace {

UpgradeReport ExampleUpgrade() {
  return {.mechanism = "bar",
          .scenario = "turn",
          .version_old = "2.2.2",
          .version_new = "3.14.0",
          .unavailable = {},
          .messages = {},
          .states = 25,
          .rows = {{.kind = "weld",
                    .rows = 6,
                    .softness_least = 1.0,
                    .softness_most = 18.08,
                    .velocity_term = 6.9,
                    .left_out_old = 6.9,
                    .left_out_new = 3e-15,
                    .why = "3.7.0"}},
          .forces = {{.how = "recipe",
                      .nrmse_old = 3e-4,
                      .nrmse_new = kNan,
                      .gap_old_m = 1e-5,
                      .gap_new_m = kNan,
                      .why_old = {},
                      .why_new = "diverged"}}};
}

TEST(UpgradeReport, IsPlainText) {
  EXPECT_EQ(
      ToText(ExampleUpgrade()),
      "bar/turn: the generated model in MuJoCo 2.2.2 and 3.14.0\n"
      "  loads without a message\n"
      "  rows at 25 states  rows  softness, new/old  |dJ/dt qdot|  left out, old    new  why\n"
      "  weld                  6          1 … 18.08           6.9            6.9  3e-15  3.7.0\n"
      "  RMS error of all drive forces    2.2.2  3.14.0  loop gap, old  new  why not\n"
      "  recipe                         3.0e-04       –      1.0e-05 m    –  diverged\n");
}

TEST(UpgradeReport, ReportsMessagesAndThatNoAnswerCame) {
  UpgradeReport report = ExampleUpgrade();
  report.messages = {"a word"};
  EXPECT_NE(ToText(report).find("  says while loading:\n    a word\n"), std::string::npos);
  report.unavailable = "is not installed";
  EXPECT_EQ(ToText(report),
            "bar/turn: the generated model in MuJoCo 2.2.2, and another version that did not "
            "answer: is not installed\n");
}

TEST(UpgradeReport, IsReadByPrograms) {
  const auto json = nlohmann::json::parse(ToJson({ExampleUpgrade()}));
  EXPECT_EQ(json["schema"], "mbverify.upgrade/1");
  const auto& result = json["results"].at(0);
  EXPECT_EQ(result["versions"], nlohmann::json({"2.2.2", "3.14.0"}));
  EXPECT_EQ(result["rows"][0]["softness_ratio"][1], 18.08);
  EXPECT_EQ(result["rows"][0]["left_out"][0], 6.9);
  EXPECT_EQ(result["forces"][0]["force_nrmse"][0], 3e-4);
  EXPECT_TRUE(result["forces"][0]["force_nrmse"][1].is_null());
  EXPECT_EQ(result["forces"][0]["why"][1], "diverged");
}

}  // namespace
}  // namespace mbv
