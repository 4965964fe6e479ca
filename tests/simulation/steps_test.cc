#include "simulation/engine/session.h"

#include <gtest/gtest.h>

namespace mbv::simulation {
namespace {

Motion WithBreaks(std::vector<double> starts, double duration_s) {
  Motion motion{.duration_s = 1.0, .sample_s = 0.1, .commands = {}, .loads = {}};
  Command command{.name = "drive", .terms = {}, .profile = {}};
  for (double start : starts) {
    command.profile.terms.push_back(PolyStepTerm{start, duration_s, 1.0});
  }
  motion.commands.push_back(command);
  return motion;
}

TEST(Steps, SamplesFallOnWholeSteps) {
  const std::vector<Step> steps = MakeSteps(WithBreaks({}, 1.0), 0.03);
  ASSERT_EQ(steps.size(), 40u);  // 0.03 s does not divide 0.1 s: 0.025 s does
  EXPECT_DOUBLE_EQ(AdjustedStep(WithBreaks({}, 1.0), 0.03), 0.025);
  EXPECT_EQ(steps[3].sample, 1);
  EXPECT_EQ(steps[2].sample, -1);
  EXPECT_EQ(steps.back().sample, 10);
  EXPECT_DOUBLE_EQ(steps.back().to_s, 1.0);
}

TEST(Steps, HistoryGrowsFromTheStart) {
  const std::vector<Step> steps = MakeSteps(WithBreaks({}, 1.0), 0.1);
  for (int i = 0; i < 10; ++i) EXPECT_EQ(steps[i].uniform, std::min(i + 1, 4)) << i;
}

TEST(Steps, AStepIsDividedAtABreakAndTheHistoryStartsAnew) {
  const std::vector<Step> steps = MakeSteps(WithBreaks({0.53}, 10.0), 0.1);
  ASSERT_EQ(steps.size(), 11u);
  EXPECT_DOUBLE_EQ(steps[5].to_s, 0.53);
  EXPECT_EQ(steps[5].sample, -1);
  EXPECT_DOUBLE_EQ(steps[6].from_s, 0.53);
  EXPECT_EQ(steps[6].sample, 6);
  EXPECT_EQ(steps[5].uniform, 0);
  EXPECT_EQ(steps[6].uniform, 0);
  EXPECT_EQ(steps[7].uniform, 1);
  EXPECT_EQ(steps[10].uniform, 4);
}

TEST(Steps, ABreakOnANodeOnlyRestartsTheHistory) {
  // 0.3 is not exactly the third multiple of 0.1.
  const std::vector<Step> steps = MakeSteps(WithBreaks({0.3}, 10.0), 0.1);
  ASSERT_EQ(steps.size(), 10u);
  EXPECT_EQ(steps[2].uniform, 3);
  EXPECT_EQ(steps[3].uniform, 1);
  EXPECT_EQ(steps[6].uniform, 4);
}

TEST(Steps, TwoBreaksInOneStepDivideItTwice) {
  const std::vector<Step> steps = MakeSteps(WithBreaks({0.52, 0.57}, 10.0), 0.1);
  ASSERT_EQ(steps.size(), 12u);
  EXPECT_DOUBLE_EQ(steps[6].to_s, 0.57);
  EXPECT_DOUBLE_EQ(steps[7].to_s, 0.6);
}

}  // namespace
}  // namespace mbv::simulation
