// The command figures.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(FiguresCommand, WritesAFolderAndNothingElse) {
  const Program mbverify("figures");
  const std::string folder = mbverify.Out() + "/four_bar/turn_inverse/";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "notes.txt") << "mine";
  const ProgramResult run = mbverify(
      "figures scenarios/four_bar/turn_inverse.yaml --formats svg,png --only drive_torques "
      "--json - --out " +
      mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("\"files\": [\n            \"drive_torques.svg\","), std::string::npos)
      << run.out;
  EXPECT_TRUE(std::filesystem::exists(folder + "drive_torques.svg"));
  EXPECT_TRUE(std::filesystem::exists(folder + "drive_torques.png"));
  EXPECT_FALSE(std::filesystem::exists(folder + "drive_angles.svg"));
  EXPECT_TRUE(std::filesystem::exists(folder + "notes.txt"));
}

TEST(FiguresCommand, AForeignFileOfThatNameIsNotTouched) {
  const Program mbverify("figures_foreign");
  const std::string folder = mbverify.Out() + "/four_bar/turn_inverse/";
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "drive_torques.svg") << "mine";
  const ProgramResult run = mbverify(
      "figures scenarios/four_bar/turn_inverse.yaml --formats svg --only drive_torques --out " +
      mbverify.Out());
  EXPECT_EQ(run.exit_code, 3);
  std::string text;
  std::ifstream(folder + "drive_torques.svg") >> text;
  EXPECT_EQ(text, "mine");
}

TEST(FiguresCommand, AFigureOfAPaperIsDrawnWithWhatThePaperSays) {
  const Program mbverify("figures_paper");
  const ProgramResult run =
      mbverify("figures --paper scara_robot fig9 --formats svg --json - --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_TRUE(std::filesystem::exists(mbverify.Out() + "/scara_robot/paper/fig9.svg"));
  EXPECT_NE(run.out.find("\"deviation\": "), std::string::npos) << run.out;
  EXPECT_NE(run.err.find("“symmetric about y = x"), std::string::npos) << run.err;
  const ProgramResult list = mbverify("figures --paper list");
  EXPECT_EQ(list.exit_code, 0) << list.err;
  EXPECT_NE(list.out.find("  table2 "), std::string::npos) << list.out;
}

TEST(FiguresCommand, ConvergenceAndWorkspaceAreDrawnWhereAskedFor) {
  const Program mbverify("figures_also");
  const std::string out = " --formats svg --out " + mbverify.Out();
  const ProgramResult steps = mbverify(
      "figures scenarios/slider_crank/press.yaml --also convergence --only convergence_step" + out);
  EXPECT_EQ(steps.exit_code, 0) << steps.err;
  EXPECT_TRUE(std::filesystem::exists(mbverify.Out() + "/slider_crank/press/convergence_step.svg"));
  const ProgramResult reach =
      mbverify("figures scenarios/spr_tripod/static.yaml --also workspace" + out);
  EXPECT_EQ(reach.exit_code, 0) << reach.err;
  EXPECT_NE(reach.out.find("\nworkspace_"), std::string::npos) << reach.out;
  const ProgramResult none =
      mbverify("figures scenarios/four_bar/turn_inverse.yaml --also workspace" + out);
  EXPECT_EQ(none.exit_code, 0) << none.err;
  EXPECT_NE(none.out.find("left out: workspace: no workspace is computed for 'four_bar'"),
            std::string::npos)
      << none.out;
  EXPECT_EQ(mbverify("figures four_bar/turn_inverse --also everything").exit_code, 2);
}

TEST(FiguresCommand, AStudysLinesAreDrawn) {
  const Program mbverify("figures_study");
  const std::string study = "figures scenarios/four_bar/study_validation.yaml --formats svg,pgf ";
  const ProgramResult run = mbverify(study + "--out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string folder = mbverify.Out() + "/studies/four_bar_validation/";
  for (const char* name : {"band_motor.svg", "validation_motor.tex", "validation_motor.dat"}) {
    EXPECT_TRUE(std::filesystem::exists(folder + name)) << name << "\n" << run.out;
  }
  EXPECT_NE(run.out.find("left out: scatter_matrix"), std::string::npos) << run.out;
  EXPECT_FALSE(std::filesystem::exists(mbverify.Out() + "/four_bar_validation"));
  const ProgramResult violated = mbverify(
      "figures scenarios/four_bar/must_fail/study_not_validated.yaml --only validation_motor "
      "--out " +
      mbverify.Out());
  EXPECT_EQ(violated.exit_code, 1) << violated.err;
  EXPECT_EQ(mbverify(study + "--set motion.duration_s=1 --out " + mbverify.Out()).exit_code, 2);
}

TEST(FiguresCommand, BadPapersAreRefused) {
  const Program mbverify("figures_paper_bad");
  for (const char* options :
       {"--paper scara fig9", "--paper scara_robot fig99", "--paper all fig9", "--paper four_bar",
        "--paper scara_robot fig9 --set a=1", "--page page.md", ""}) {
    const ProgramResult run = mbverify("figures --out " + mbverify.Out() + " " + options);
    EXPECT_EQ(run.exit_code, 2) << options;
    EXPECT_FALSE(run.err.empty()) << options;
  }
}

TEST(FiguresCommand, BadOptionsAreRefused) {
  const Program mbverify("figures_bad");
  for (const char* options : {"--style iee", "--lang fr", "--formats pdf,doc", "--width-mm 2",
                              "--font-pt -1", "--only drive_torque"}) {
    const ProgramResult run = mbverify("figures scenarios/four_bar/turn_inverse.yaml --out " +
                                       mbverify.Out() + " " + options);
    EXPECT_EQ(run.exit_code, 2) << options;
    EXPECT_FALSE(run.err.empty()) << options;
  }
}

}  // namespace
}  // namespace mbv
