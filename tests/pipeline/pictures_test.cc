// What is written below the pictures of a run.
#include "pipeline/pictures.h"

#include <gtest/gtest.h>

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

TEST(Caption, TellsTheForceErrorOrElseThatOfTheMotion) {
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

}  // namespace
}  // namespace mbv
