// Engines side by side: the rows, and the texts that are made of them.
#include "features/engines/crosscheck.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace mbv {
namespace {

Trace TwoSamples(const std::string& witness) {
  Trace trace;
  trace.witness = witness;
  trace.Reset({0.0, 0.1}, {});
  return trace;
}

WitnessRecord Record(const std::string& name, double cpu_s) {
  WitnessRecord record{.name = name, .summary = RunSummary::Done(), .trace = TwoSamples(name)};
  record.summary.cpu_s = cpu_s;
  return record;
}

PairComparison Pair(const std::string& measured, const std::string& truth, double force) {
  PairComparison pair;
  pair.measured = measured;
  pair.truth = truth;
  pair.compared = true;
  pair.metrics[Metric::kForceNrmse] = Measured{.value = force, .channel = {}};
  return pair;
}

Report FourEngines() {
  Report report;
  report.mechanism = "bar";
  report.scenario = "turn";
  report.witnesses = {Record("analytic", 2e-6), Record("reference", 1.0), Record("simulated", 4e-6),
                      Record("mine", 6e-6)};
  report.witnesses[3].foreign = Witness::Foreign{};
  report.witnesses[3].foreign->program = "Mine 2";
  report.witnesses[3].foreign->compute_s = 4e-6;  // without its start
  WitnessRecord gone = Record("gone", 0.0);
  gone.summary = RunSummary{};
  gone.summary.message = "could \"not\" be started";
  gone.foreign = Witness::Foreign{};
  report.witnesses.push_back(gone);
  report.comparison.pairs = {Pair("reference", "analytic", 1e-15),
                             Pair("simulated", "reference", 2e-10),
                             Pair("mine", "reference", 3e-5)};
  report.comparison.pairs[1].metrics[Metric::kPoseM] = Measured{.value = 7e-9, .channel = {}};
  report.comparison.witnesses = {
      {.witness = "simulated", .metrics = {{Metric::kClosureM, {.value = 5e-12, .channel = {}}}}}};
  report.engine_comparison = EngineComparison{.truth = "analytic", .engines = {}};
  report.engine_comparison->engines = {
      {.engine = "defaults", .force_nrmse = 0.5, .closure_max_m = 1e-2},
      {.engine = "corrected", .force_nrmse = 2e-10}};
  return report;
}

TEST(Crosscheck, HasARowPerEngineButTheReference) {
  const auto rows = CrosscheckRows(FourEngines());
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[0].engine, "closed form");
  EXPECT_EQ(rows[0].force_nrmse, 1e-15);  // whichever is held against the other
  EXPECT_TRUE(std::isnan(rows[0].loop_gap_m));
  EXPECT_DOUBLE_EQ(rows[0].sample_us, 1.0);
  EXPECT_EQ(rows[1].engine, "MuJoCo");
  EXPECT_EQ(rows[1].force_nrmse, 2e-10);
  EXPECT_EQ(rows[1].pose_m, 7e-9);
  EXPECT_TRUE(std::isnan(rows[0].pose_m));
  EXPECT_EQ(rows[1].loop_gap_m, 5e-12);
  EXPECT_EQ(rows[2].engine, "mine");
  EXPECT_EQ(rows[2].program, "Mine 2");
  EXPECT_EQ(rows[2].force_nrmse, 3e-5);
  EXPECT_DOUBLE_EQ(rows[1].sample_us, 2.0);
  EXPECT_DOUBLE_EQ(rows[2].sample_us, 2.0);
  EXPECT_EQ(rows[3].engine, "gone");
  EXPECT_EQ(rows[3].why, "could \"not\" be started");
  EXPECT_TRUE(std::isnan(rows[3].force_nrmse));
  EXPECT_EQ(rows[4].engine, "MuJoCo, default softness, position targets");
  EXPECT_EQ(rows[4].loop_gap_m, 1e-2);
}

TEST(Crosscheck, WritesTables) {
  const auto rows = CrosscheckRows(FourEngines());
  const std::string head =
      "| scenario | closed form | MuJoCo | mine | gone | MuJoCo, default softness, "
      "position targets |\n|---|---|---|---|---|---|\n";
  EXPECT_EQ(ToMarkdown(rows), "## Drive forces, RMS difference of all\n\n" + head +
                                  "| `bar/turn` | 1.0e-15 | 2.0e-10 | 3.0e-05 | – | 5.0e-01 |\n\n"
                                  "## Outputs' origins, largest distance [m]\n\n" +
                                  head + "| `bar/turn` | – | 7.0e-09 | – | – | – |\n\n" +
                                  "## Loops, largest gap [m]\n\n" + head +
                                  "| `bar/turn` | – | 5.0e-12 | – | – | 1.0e-02 |\n\n" +
                                  "## Cost of a sample [us]\n\n" + head +
                                  "| `bar/turn` | 1 | 2 | 2 | – | – |\n");
  EXPECT_NE(ToCsv(rows).find("bar,turn,gone,,nan,nan,nan,nan,\"could \"\"not\"\" be started\"\n"),
            std::string::npos)
      << ToCsv(rows);
  EXPECT_NE(ToText(rows).find("mine (Mine 2)"), std::string::npos) << ToText(rows);
  const auto json = nlohmann::json::parse(ToJson(rows));
  EXPECT_EQ(json["schema"], "mbverify.crosscheck/1");
  EXPECT_EQ(json["rows"][2]["force_nrmse"], 3e-5);
  EXPECT_TRUE(json["rows"][3]["force_nrmse"].is_null());
}

}  // namespace
}  // namespace mbv
