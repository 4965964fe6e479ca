#include "pipeline/figures.h"

#include <gmock/gmock.h>

#include "tests/source_dir.h"

namespace mbv {
namespace {

using testing::HasSubstr;

std::string FigureScenario(const std::string& name) {
  return std::string(kSourceDir) + "/scenarios/" + name + ".yaml";
}

TEST(MakeFigures, DrawsWhatAMotionAndItsRunGave) {
  FigureOptions options;
  options.formats = {"svg", "pdf"};
  options.only = {"drive_torques"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("four_bar/turn_inverse"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.mechanism + "/" + outcome.scenario, "four_bar/turn_inverse");
  EXPECT_EQ(outcome.verdict, "agree");
  ASSERT_EQ(outcome.files.size(), 2u);
  EXPECT_EQ(outcome.files[0].first, "drive_torques.pdf");
  EXPECT_EQ(outcome.files[1].first, "drive_torques.svg");
  EXPECT_EQ(outcome.figures[0].files.size(), 2u);
}

TEST(MakeFigures, AnUnknownNameIsRefusedWithTheNearest) {
  FigureOptions options;
  options.only = {"drive_torque"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("four_bar/turn_inverse"), options);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_TRUE(outcome.files.empty());
  EXPECT_THAT(outcome.diagnostics.Text(), HasSubstr("did you mean 'drive_torques'?"));
}

TEST(MakeFigures, OfAStiffnessAreTheUsualMaps) {
  FigureOptions options;
  options.formats = {"svg"};
  const FigureOutcome outcome = MakeFigures(FigureScenario("scara_robot/stiffness"), options);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.diagnostics.Text();
  ASSERT_FALSE(outcome.figures.empty());
  EXPECT_THAT(outcome.figures[0].figure.name, HasSubstr("map_x_y_"));
  EXPECT_EQ(outcome.figures.size(), outcome.files.size());
}

}  // namespace
}  // namespace mbv
