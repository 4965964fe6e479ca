// What is written below the pictures of a run.
#include "verify/pictures.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "features/run/run_scenario.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

Report With(std::map<Metric, Measured> metrics) {
  Report report;
  report.mechanism = "robot";
  report.scenario = "case";
  report.comparison.verdict = Verdict::kAgree;
  PairComparison pair;
  pair.measured = "simulated";
  pair.truth = "reference";
  pair.compared = true;
  pair.metrics = std::move(metrics);
  report.comparison.pairs.push_back(std::move(pair));
  return report;
}

TEST(Caption, ReportsTheForceErrorOrElseThatOfTheMotion) {
  Measured force, place;
  force.value = 1.5e-9;
  place.value = 8.2e-12;
  Caption caption = CaptionOf(With({{Metric::kForceNrmse, force}, {Metric::kPoseM, place}}));
  EXPECT_EQ(caption.title, "robot / case");
  EXPECT_EQ(caption.status, "agree");
  EXPECT_EQ(caption.detail, "drive forces: simulated against reference, NRMSE 1.5e-09");
  caption = CaptionOf(With({{Metric::kPoseM, place}}));
  EXPECT_EQ(caption.detail, "motion: simulated against reference, outputs within 8.2e-12 m");
  EXPECT_EQ(CaptionOf(With({})).detail, "");
}

// A run that ends on the way has no poses from there on: its path and pictures end, too.
TEST(Pictures, ARunThatBreaksOffIsDrawnAsFarAsItCame) {
  const LoadResult loaded = LoadModel(SourcePath("/models/slider_crank/model.yaml"));
  ASSERT_TRUE(loaded.mechanism);
  const Mechanism& m = *loaded.mechanism;
  SimulationRun run;
  run.trace.Reset({0.0, 1.0, 2.0, 3.0}, {});
  run.X_WB = {m.X_WB_home, m.X_WB_home, {}, {}};
  Scenario scenario;
  scenario.snapshots.times_s = {0.0, 3.0};
  scenario.snapshots.size_px = {64, 64};
  scenario.snapshots.path_output = 0;
  std::vector<PictureFile> files;
  const RunSummary drawn = DrawSnapshots(scenario, m, run, {}, {}, &files);
  ASSERT_TRUE(drawn.ok()) << drawn.message;
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].name, "t_0.000s.png");
  // Ended at its start, at steps that servos do not bear: nothing to draw.
  RunOptions options;
  options.out_dir = (std::filesystem::path(testing::TempDir()) / "mbv_broken_off").string();
  options.page = false;
  options.scenario.set = {{"simulation.step_s", "0.005"}, {"snapshots.size_px", "[64, 64]"}};
  const RunOutcome outcome = RunScenario(SourcePath("/scenarios/cabin_robot/servo.yaml"), options);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_LE(outcome.report->pictures.size(), 1U);
  std::filesystem::remove_all(options.out_dir);
}

}  // namespace
}  // namespace mbv
