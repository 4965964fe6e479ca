// mbverify standin as a user types it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "tests/support/json_schemas.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

using testing::HasSubstr;

class StandinCommand : public testing::Test {
 protected:
  [[nodiscard]] ProgramResult Call(const std::string& options) const {
    return mbverify("standin tests/mechanisms/parallel_ankle.yaml --out '" + mbverify.Out() + "' " +
                    options);
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(StandinCommand, WritesPageTableAndNumbers) {
  const ProgramResult result = Call(
      "--joints ankle.0,ankle.1 --range ankle.0_deg=-20:10 --range ankle.1=-0.2:0.2 --resolution 7 "
      "--json -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["schema"], "mbverify.standin/1");
  EXPECT_NEAR(json["joints"][0]["low"], -0.3490658503988659, 1e-15);
  EXPECT_EQ(json["joints"][1]["high"], 0.2);
  EXPECT_EQ(json["reach"]["poses"], 49);
  EXPECT_NEAR(json["drives"][1]["ratio"][1], -0.8, 1e-9);
  const std::filesystem::path folder = mbverify.folder() / "out/parallel_ankle/standin";
  EXPECT_EQ(ReadAll(folder / "standin.json"), result.out);
  const std::string csv = ReadAll(folder / "standin.csv");
  EXPECT_EQ(std::ranges::count(csv, '\n'), 50);
  const auto cells = [](const std::string& line) { return std::ranges::count(line, ','); };
  const size_t first = csv.find('\n'), second = csv.find('\n', first + 1);
  EXPECT_EQ(cells(csv.substr(0, first)), cells(csv.substr(first, second - first)));
  EXPECT_THAT(ReadAll(folder / "standin.html"), HasSubstr("Error of the serial model"));
  EXPECT_THAT(result.err, HasSubstr("torque map with the neutral ratio"));
  // The same again, to the last bit.
  const ProgramResult again = Call(
      "--joints ankle.0,ankle.1 --range ankle.0_deg=-20:10 --range ankle.1=-0.2:0.2 --resolution 7 "
      "--json -");
  EXPECT_EQ(again.out, result.out);
}

// Limits of motors are null without motors: with some their schema is held, too.
TEST_F(StandinCommand, NumbersOfMotorsFitTheSchema) {
  const std::string file = (mbverify.folder() / "ankle.yaml").string();
  std::ofstream(file) << ReadAll(SourcePath("/tests/mechanisms/parallel_ankle.yaml"))
                      << "motors:\n  left: {peak: 2, max_speed: 9, rotor_inertia: 1.0e-5}\n"
                         "  right: {peak: 2, max_speed: 9, rotor_inertia: 1.0e-5}\n";
  const ProgramResult result = mbverify("standin '" + file + "' --out '" + mbverify.Out() +
                                        "' --joints ankle.0,ankle.1 --resolution 3 --json -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const test::JsonSchemas schemas;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(schemas.Misfit(json), "");
  ASSERT_EQ(json["torque_limits"]["corners"].size(), 4u);
  for (const char* limits : {"torque_limits", "speed_limits"}) {
    for (const auto& [key, value] : json[limits].items()) {
      auto renamed = json, typed = json;
      renamed[limits].erase(key);
      typed[limits][key] = "text";
      EXPECT_NE(schemas.Misfit(renamed), "") << limits << " " << key;
      EXPECT_NE(schemas.Misfit(typed), "") << limits << " " << key;
    }
  }
}

// A scenario's motion and a table of the same: the built-in swing over ±30°, halved.
TEST_F(StandinCommand, ComparesAlongMotions) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(mbverify.folder() / name) << text;
    return "--motion '" + (mbverify.folder() / name).string() + "' ";
  };
  const std::string walk = "mechanism: " + SourcePath("/tests/mechanisms/parallel_ankle.yaml") + R"(
motion:
  duration_s: 0.9975
  sample_s: 0.0025
  commands:
    ankle.0: {sine: {amplitude_deg: 15, period_s: 1}}
    ankle.1: {sine: {amplitude_deg: 15, period_s: 1, phase_deg: 90}}
)";
  const auto table = [](double amplitude_deg) {
    std::string text = "time,ankle.1_deg,ankle.0 (rad)\n";
    for (int k = 0; k < 400; ++k) {
      const double phase = 2 * std::numbers::pi * k / 400;
      text += fmt::format("{:.4f},{:.12f},{:.14f}\n", k / 400.0, amplitude_deg * std::cos(phase),
                          amplitude_deg * std::numbers::pi / 180 * std::sin(phase));
    }
    return text;
  };
  const std::string joints = "--joints ankle.0,ankle.1 --resolution 3 --json - ";
  const ProgramResult result =
      Call(joints + write("walk.yaml", walk) + write("walk.csv", table(15)) +
           write("longer.csv", table(15.1)));
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(test::JsonSchemas().Misfit(json), "");
  ASSERT_EQ(json["scenes"].size(), 6u);
  const auto p95 = [&](size_t scene, size_t drive) {
    return json["scenes"][scene]["drives"][drive]["errors"][4]["p95"].get<double>();
  };
  EXPECT_EQ(json["scenes"][2]["name"], "along walk");
  EXPECT_EQ(json["scenes"][3]["name"], "along walk.csv");
  for (const size_t drive : {size_t{0}, size_t{1}}) {
    EXPECT_NEAR(p95(2, drive), p95(1, drive), 1e-9);
    EXPECT_NEAR(p95(3, drive), p95(1, drive), 1e-4 * p95(1, drive));
    EXPECT_GT(std::abs(p95(4, drive) - p95(1, drive)), 1e-3 * p95(1, drive));
  }
  EXPECT_THAT(json["verdict"].get<std::string>(), HasSubstr("along longer.csv"));
  EXPECT_THAT(result.err, HasSubstr("ankle.1 -30°); along longer.csv"));
  EXPECT_THAT(ReadAll(mbverify.folder() / "out/parallel_ankle/standin/standin.html"),
              HasSubstr("; along longer.csv"));

  const std::pair<std::string, std::string> cases[] = {
      {write("no.csv", "time,hip\n0,1\n1,2\n"), "has no column for the position of 'ankle.0'"},
      {write("few.csv", "time,ankle.0,ankle.1\n0,1,0\n1,2,0\n"), "has 2 rows"},
      {"--motion nowhere.csv", "cannot be read"},
      {"--motion four_bar/turn", "its model has no joint coordinate 'ankle.0'"}};
  for (const auto& [options, message] : cases) {
    const ProgramResult refused = Call(joints + options);
    EXPECT_EQ(refused.exit_code, 2) << options;
    EXPECT_THAT(refused.err, HasSubstr(message));
  }
}

TEST_F(StandinCommand, ReadsUrdfAndSdf) {
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(mbverify.folder() / name) << text;
    return (mbverify.folder() / name).string();
  };
  std::string sdf = ReadAll(SourcePath("/tests/fuzz/seeds/sdf/linkage.sdf"));
  const std::string end = "</model>";
  sdf.insert(
      sdf.find(end),
      "<plugin name='control' "
      "filename='gz-sim-joint-position-controller-system'><joint_name>A</joint_name></plugin>");
  const auto joint = [](const std::string& name, const std::string& links, const char* xyz) {
    return fmt::format(
        "<joint name='{}' type='continuous'>{}<origin xyz='{}'/><axis xyz='0 1 0'/></joint>", name,
        links, xyz);
  };
  std::string urdf = "<robot name='linkage'><link name='base'/>";
  for (const char* link : {"crank", "coupler", "rocker"}) {
    urdf += fmt::format(
        "<link name='{}'><inertial><origin xyz='0 0 0.1'/><mass value='1'/><inertia ixx='.01' "
        "iyy='.01' izz='.01' ixy='0' ixz='0' iyz='0'/></inertial></link>",
        link);
  }
  for (const auto& [frame, link, xyz] :
       {std::tuple("c1", "coupler", "0.5 0 0"), {"c2", "rocker", "0 0 0.3"}}) {
    urdf += fmt::format(
        "<link name='{}'/><joint name='to_{}' type='fixed'><parent link='{}'/><child link='{}'/>"
        "<origin xyz='{}'/></joint>",
        frame, frame, link, frame, xyz);
  }
  urdf += joint("A", "<parent link='base'/><child link='crank'/>", "0 0 0") +
          joint("B", "<parent link='crank'/><child link='coupler'/>", "0 0 0.3") +
          joint("D", "<parent link='base'/><child link='rocker'/>", "0.5 0 0") + "</robot>";
  write("linkage.yaml", "closed_loop: [[c1, c2]]\ntype: [3d]\nname_mot: [A]\n");
  for (const std::string& file : {write("linkage.sdf", sdf), write("linkage.urdf", urdf)}) {
    const ProgramResult result =
        mbverify("standin '" + file + "' --joints D --resolution 5 --out '" + mbverify.Out() +
                 "' --json - -q");
    ASSERT_EQ(result.exit_code, 0) << file << result.err;
    const auto json = nlohmann::json::parse(result.out);
    EXPECT_NEAR(json["drives"][0]["ratio"][0].get<double>(), 1.0, 1e-9) << file;
    EXPECT_EQ(json["branches"]["limbs"][0]["kind"], "crank and rod") << file;
    EXPECT_THAT(json["verdict"].get<std::string>(), HasSubstr("a constant gear does"));
  }
}

TEST_F(StandinCommand, RefusesBadInputWithAHint) {
  const std::pair<const char*, const char*> cases[] = {
      {"--joints ankle.0,ankle.2", "there is no joint coordinate 'ankle.2'"},
      {"--joints ankle.0", "2 drives move the 1 chosen joint"},
      {"--joints ankle.0,ankle.1,left_hinge", "depend on each other"},
      {"--joints ankle.0,ankle.1 --range ankle.0_deg=30:-50", "is empty"},
      {"--joints ankle.0,ankle.1 --range ankle.0_deg=30", "is not NAME=LOW:HIGH"},
      {"--joints ankle.0,ankle.1 --range ankle.0_deg=a:3", "two numbers are needed"},
      {"--joints ankle.0,ankle.1 --range ankle.0_mm=-3:3", "coordinate is in rad"},
      {"--joints ankle.0,ankle.1 --range ankle.0=-1:1 --range ankle.0=0:1", "stated twice"},
      {"--joints ankle.0,ankle.1 --range hip_deg=-3:3", "not chosen"},
      {"--joints ankle.0,ankle.1 --base foot", "robots"}};
  for (const auto& [options, message] : cases) {
    const ProgramResult result = Call(options);
    EXPECT_EQ(result.exit_code, 2) << options << result.err;
    EXPECT_THAT(result.err, testing::AllOf(HasSubstr(message), HasSubstr("hint: "))) << options;
    EXPECT_FALSE(std::filesystem::exists(mbverify.folder() / "out")) << options;
  }
}

}  // namespace
}  // namespace mbv
