// mbverify stiffness as a user calls it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

size_t Lines(const std::string& text) {
  return static_cast<size_t>(std::count(text.begin(), text.end(), '\n'));
}

TEST(StiffnessCommand, APoseOfTheScaraIsComputedThreeTimes) {
  const Program mbverify("stiffness_pose");
  const ProgramResult result = mbverify(
      "stiffness scara_robot --at platform.x_mm=-60 platform.yaw_deg=10 --format json --out " +
      mbverify.Out());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["verdict"], "agree");
  EXPECT_EQ(json["pose"].size(), 4u);
  EXPECT_LT(json["metrics"]["simulated_vs_analytic"]["stiffness_entry"].get<double>(), 1e-4);
  // Every entry of K is reported with its difference.
  EXPECT_EQ(json["metrics"]["simulated_vs_analytic"]["K_difference"].size(), 6u);
  EXPECT_EQ(json["metrics"]["simulated_vs_analytic"]["K_difference"][5].size(), 6u);
  const fs::path folder = mbverify.Out() + "/scara_robot/stiffness_at_pose";
  for (const char* file :
       {"stiffness.csv", "contributions.csv", "summary.json", "report.html", "model.xml"}) {
    EXPECT_GT(fs::file_size(folder / file), 100u) << file;
  }
  // K and C of three witnesses, a line per entry.
  EXPECT_EQ(Lines(ReadAll(folder / "stiffness.csv")), 1u + 3 * 2 * 36);
}

TEST(StiffnessCommand, TextNamesTheWeakestDirectionAndTheCausesOfCompliance) {
  const Program mbverify("stiffness_text");
  const ProgramResult result = mbverify("stiffness scara_robot --no-simulation");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  for (const char* part :
       {"a force", "2246.6 N/m", "a screw", "limb2.arm", "\n  kappa_m", "10463.3"}) {
    EXPECT_NE(result.out.find(part), std::string::npos) << part << result.out;
  }
}

TEST(StiffnessCommand, MapsAreDrawnByShortNamesOverTheUsualDisc) {
  const Program mbverify("stiffness_map");
  const ProgramResult result = mbverify(
      "stiffness scara_robot --no-simulation --map z=-0.1 phi=0 --map z_mm=-190 phi_deg=45 "
      "x=-0.05:0.05:11 y=-0.05:0.05:9 --index kappa_f --out " +
      mbverify.Out());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const fs::path maps = mbverify.Out() + "/scara_robot/stiffness_at_pose/maps";
  EXPECT_GT(fs::file_size(maps / "x_y_z-100mm_yaw0deg_kappa_f.svg"), 10000u);
  EXPECT_TRUE(fs::exists(maps / "x_y_z-190mm_yaw45deg_kappa_f.svg"));
  EXPECT_EQ(Lines(ReadAll(maps / "x_y_z-190mm_yaw45deg.csv")), 1u + 11 * 9);
  EXPECT_EQ(Lines(ReadAll(maps / "x_y_z-100mm_yaw0deg.csv")), 1u + 101 * 101);
  EXPECT_NE(result.out.find("z = -100 mm, yaw = 0 deg: 7845 of 7845 poses reached"),
            std::string::npos)
      << result.out;
}

TEST(StiffnessCommand, SeededLoadsAreInTheTable) {
  const Program mbverify("stiffness_loads");
  const ProgramResult result =
      mbverify("stiffness cabin_robot --loads 50 --seed 20250201 --out " + mbverify.Out());
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string csv = ReadAll(mbverify.Out() + "/cabin_robot/stiffness_at_pose/loads.csv");
  EXPECT_EQ(Lines(csv), 51u);
  EXPECT_NE(csv.find("\n1,0.24526"), std::string::npos) << csv.substr(0, 800);
  EXPECT_NE(result.out.find("50 random wrenches, seed 20250201"), std::string::npos);
}

struct BadInput {
  const char *name, *arguments, *said;
};
void PrintTo(const BadInput& bad, std::ostream* out) { *out << bad.name; }

class BadStiffnessInput : public testing::TestWithParam<BadInput> {};

TEST_P(BadStiffnessInput, IsRefusedAndNothingIsWritten) {
  const Program mbverify(std::string("stiffness_bad_") + GetParam().name);
  const ProgramResult result =
      mbverify(std::string("stiffness ") + GetParam().arguments + " --out " + mbverify.Out());
  EXPECT_EQ(result.exit_code, 2) << result.out;
  EXPECT_NE(result.err.find(GetParam().said), std::string::npos) << result.err;
  EXPECT_FALSE(fs::exists(mbverify.Out()));
}

INSTANTIATE_TEST_SUITE_P(
    All, BadStiffnessInput,
    testing::ValuesIn(std::vector<BadInput>{
        {"model", "scara_robo", "did you mean 'scara_robot'?"},
        {"rigid_model", "spr_tripod", "has no elastic.yaml"},
        {"coordinate", "scara_robot --at platform.hight=1", "platform.hight"},
        {"misspelt_model", "scara_robo", "scara_robo: error: there is no such model"},
        {"no_number", "scara_robot --at platform.x=soon", "--at platform.x=soon: error: "},
        {"parameter", "scara_robot --set K_akt=1", "--set K_akt=1: error: "},
        // Values are shown as given, though they look like another option.
        {"output", "scara_robot --output 'a --set pose.b'", "--output a --set pose.b: error: "},
        {"negative_seed", "scara_robot --loads 3 --seed -3", "from 0 to 2^64 - 1"},
        {"large_seed", "scara_robot --loads 3 --seed 18446744073709551616", "from 0 to 2^64 - 1"},
        {"no_loads", "scara_robot --loads 3 --force-max 0 --moment-max 0", "are no loads"},
        {"closed_form", "scara_robot --closed-form best",
         "analytic.model = 'best' is not one of: corrected"},
        {"map_coordinate", "scara_robot --no-simulation --map z=-0.1 hight=1",
         "'hight' is not a coordinate of the pose"},
        {"map_range", "scara_robot --no-simulation --map x=0.1:-0.1:5", "violates LOW < HIGH"},
        {"map_one_range", "scara_robot --no-simulation --map x=0:0.1:5",
         "1 ranges are given, two are needed"},
        {"map_twice", "scara_robot --no-simulation --map x=0.01", "platform.x is given twice"},
        {"index", "scara_robot --no-simulation --map z=-0.1 --index kapa_f",
         "did you mean 'kappa_f'?"}}),
    [](const auto& info) { return std::string(info.param.name); });

TEST(StiffnessCommand, APoseOutOfReachCouldNotRun) {
  const Program mbverify("stiffness_reach");
  const ProgramResult result = mbverify("stiffness scara_robot --at platform.z=-0.4");
  EXPECT_EQ(result.exit_code, 3) << result.out;
  EXPECT_NE(result.out.find("NOT RUN"), std::string::npos);
}

}  // namespace
}  // namespace mbv
