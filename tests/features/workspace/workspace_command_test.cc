// mbverify workspace of any model, as a user types it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

using testing::HasSubstr;

class WorkspaceCommand : public testing::Test {
 protected:
  [[nodiscard]] ProgramResult Call(const std::string& arguments) const {
    return mbverify("workspace " + arguments + " --out '" + mbverify.Out() + "'");
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(WorkspaceCommand, WritesPageBoundaryPosesAndNumbers) {
  const ProgramResult result =
      Call("friction_five_bar --over x_mm=-200:200,y_mm=150:500 --resolution 40 --json -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  const auto& set = json["set"];
  EXPECT_EQ(set["agree"], true);
  EXPECT_EQ(set["over"][0]["low"], -0.2);
  EXPECT_LT(std::abs(set["traced"]["value"].get<double>() - set["flooded"]["value"].get<double>()),
            set["flooded"]["error"].get<double>());
  EXPECT_FALSE(set["quality"].empty());
  EXPECT_THAT(result.err, HasSubstr("AGREE"));
  const std::filesystem::path folder = mbverify.folder() / "out/friction_five_bar/workspace";
  const std::string boundary = ReadAll(folder / "reachable_boundary.csv");
  EXPECT_THAT(boundary, HasSubstr("section,loop,arc,tool.x_m,tool.y_m,bound,kind"));
  EXPECT_THAT(boundary, HasSubstr("box tool.x = -0.2,box"));
  EXPECT_THAT(ReadAll(folder / "reachable_poses.csv"), HasSubstr("type2_distance"));
  EXPECT_THAT(ReadAll(folder / "reachable.html"), HasSubstr("What ends it"));
  EXPECT_THAT(ReadAll(folder / "quality_condition.svg"), HasSubstr("<svg"));
}

TEST_F(WorkspaceCommand, ClosedFormsStandBesideAndASurfaceIsWritten) {
  // Of a closed form's set; a strip of it is none.
  const ProgramResult strip =
      Call("spr_tripod --over x_mm=-20:20,y_mm=-20:20,z_mm=560:600 --resolution 12 --no-pictures");
  ASSERT_EQ(strip.exit_code, 0) << strip.err;
  EXPECT_EQ(strip.out.find("closed form"), std::string::npos);
  EXPECT_THAT(strip.out, HasSubstr("0.00006400"));  // a box
  const std::filesystem::path folder = mbverify.folder() / "out/spr_tripod/workspace";
  EXPECT_THAT(ReadAll(folder / "reachable.ply"), HasSubstr("property uchar red"));
  EXPECT_GT(ReadAll(folder / "reachable.stl").size(), 84u + 50u * 100u);
}

TEST_F(WorkspaceCommand, WaysToCloseAndTypeTwoCurvesAreListed) {
  const ProgramResult ways = Call("friction_five_bar --modes all --at x=0.1 --json -");
  ASSERT_EQ(ways.exit_code, 0) << ways.err;
  const auto modes = nlohmann::json::parse(ways.out)["modes"];
  EXPECT_EQ(modes[0]["count"], 2);  // the tool above and below its forearms' feet
  EXPECT_EQ(modes[1]["count"], 4);  // two elbows of two limbs
  EXPECT_THAT(ways.err, HasSubstr("2 ways to close"));
  const std::filesystem::path folder = mbverify.folder() / "out/friction_five_bar/workspace";
  EXPECT_THAT(ReadAll(folder / "modes.csv"), HasSubstr("drives,2,1,"));
  EXPECT_THAT(ReadAll(folder / "modes.html"), HasSubstr("Ways to close"));
  const ProgramResult curves =
      Call("friction_five_bar --joint-space --over motor1,motor2 --json -");
  ASSERT_EQ(curves.exit_code, 0) << curves.err;
  // Forearms in one line: two limbs cannot meet in three ways. Where the elbows meet, the equal
  // forearms turn about them while the motors rest.
  const auto json = nlohmann::json::parse(curves.out)["joint_space"];
  EXPECT_FALSE(json["curves"].empty());
  EXPECT_TRUE(json["cusps"].empty());
  EXPECT_THAT(curves.err, HasSubstr("self-motion"));
  EXPECT_THAT(ReadAll(folder / "joint_space.csv"), HasSubstr("curve,motor1_rad,motor2_rad"));
}

TEST_F(WorkspaceCommand, AnotherWayToCloseAndFiguresForPrint) {
  const std::string asked =
      "friction_five_bar --over x,y --resolution 30 --formats pdf,png --json - ";
  const ProgramResult home = Call(asked), other = Call(asked + "--way output=2");
  ASSERT_EQ(other.exit_code, 0) << other.err;
  const auto set = nlohmann::json::parse(other.out)["set"];
  EXPECT_EQ(set["notes"].dump().find("home is way 2 of 4 for the same output") == std::string::npos,
            false);
  // The elbows are on other sides: type 2 ends it elsewhere.
  EXPECT_GT(std::abs(set["traced"]["value"].get<double>() -
                     nlohmann::json::parse(home.out)["set"]["traced"]["value"].get<double>()),
            0.01);
  const std::filesystem::path folder = mbverify.folder() / "out/friction_five_bar/workspace";
  EXPECT_TRUE(ReadAll(folder / "quality_condition.pdf").starts_with("%PDF"));
  EXPECT_TRUE(ReadAll(folder / "reachable_boundary.png").starts_with("\x89PNG"));
}

TEST_F(WorkspaceCommand, ARangeOfOrientationsIsAskedForAllOrForSome) {
  const std::string asked = "spr_tripod --over x --at y=0 --resolution 100 --json - ";
  std::vector<double> lengths;
  for (const char* range : {"--for-all z_mm=560:580", "--for-some z_mm=560:580"}) {
    const ProgramResult result = Call(asked + range);
    ASSERT_EQ(result.exit_code, 0) << result.err;
    const auto set = nlohmann::json::parse(result.out)["set"];
    lengths.push_back(set["traced"]["value"]);
    const auto& ranged = set[lengths.size() == 1 ? "for_all" : "for_some"][0];
    EXPECT_EQ(ranged["name"], "platform.z");
    EXPECT_EQ(ranged["low"], 0.56);
    EXPECT_THAT(result.err, HasSubstr(lengths.size() == 1 ? "for all platform.z 560 … 580 mm"
                                                          : "for some platform.z"));
  }
  EXPECT_LT(lengths[0], lengths[1]);
}

TEST_F(WorkspaceCommand, BadInputIsRefusedWithExitCode2) {
  for (const auto& [arguments, message] : std::vector<std::pair<std::string, std::string>>{
           {"four_bar --over x,qq", "there is no coordinate 'qq'"},
           {"four_bar --over x --at y=0", "'coupler.y' is no coordinate of its own at home"},
           {"floating_loop", "has no end"},
           {"flyball_governor --over x,y", "the model has no output, whose 'x' could be asked"},
           {"friction_five_bar --resolution 90000", "takes about"},
           {"friction_five_bar --joint-space --over x,y", "two drives are needed"},
           {"stewart --modes drives --resolution 40", "another thing than a set"},
           {"friction_five_bar --over x,y --way output=9", "4 ways are found"},
           {"friction_five_bar --over x,y --way elbow", "a way to close is needed"},
           {"spring_cart --modes drives", "1 drives do not determine 2 degrees of freedom"},
           {"four_bar --base crank", "robot"}}) {
    const ProgramResult result = Call(arguments);
    EXPECT_EQ(result.exit_code, 2) << arguments << result.err;
    EXPECT_THAT(result.err, HasSubstr(message)) << arguments;
  }
}

}  // namespace
}  // namespace mbv
