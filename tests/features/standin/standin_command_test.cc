// mbverify standin as a user types it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

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

TEST_F(StandinCommand, RefusesBadInputWithAHint) {
  const std::pair<const char*, const char*> cases[] = {
      {"--joints ankle.0,ankle.2", "there is no joint coordinate 'ankle.2'"},
      {"--joints ankle.0", "2 drives move the 1 chosen joint"},
      {"--joints ankle.0,ankle.1,left_hinge", "depend on each other"},
      {"--joints ankle.0,ankle.1 --range ankle.0_deg=30:-50", "is empty"},
      {"--joints ankle.0,ankle.1 --range ankle.0_deg=30", "is not JOINT=LOW:HIGH"},
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
