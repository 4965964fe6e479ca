// mbverify code as a user types it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

using testing::HasSubstr;

class CodeCommand : public testing::Test {
 protected:
  [[nodiscard]] ProgramResult Call(const std::string& options) const {
    return mbverify("code tests/mechanisms/parallel_ankle.yaml --states 50 --out '" +
                    mbverify.Out() + "' " + options);
  }

  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(CodeCommand, WritesJudgedFiles) {
  const ProgramResult result = Call(
      "--coordinates ankle.0,ankle.1 --range ankle.0_deg=-3:3 --range ankle.1=-0.05:0.05 --json -");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["schema"], "mbverify.code/1");
  EXPECT_EQ(json["judgements"].size(), 3U);
  EXPECT_TRUE(json["agrees"]);
  EXPECT_EQ(json["table"]["proved"], 1.0);
  const std::filesystem::path folder = mbverify.folder() / "out/parallel_ankle/code";
  for (const std::string name : json["files"]) {
    EXPECT_GT(ReadAll(folder / name).size(), 500U) << name;
  }
  EXPECT_EQ(ReadAll(folder / "code.json"), result.out);
  EXPECT_THAT(result.err, HasSubstr("C, from the table: agrees"));
  EXPECT_THAT(ReadAll(folder / "parallel_ankle.h"), HasSubstr("sha256 of its file: "));
}

TEST_F(CodeCommand, AHeaderThatDiffersEndsWithOne) {
  ASSERT_EQ(Call("--coordinates ankle.0,ankle.1 --no-test").exit_code, 0);
  const std::filesystem::path made = mbverify.folder() / "out/parallel_ankle/code/parallel_ankle.h";
  EXPECT_EQ(Call("--coordinates ankle.0,ankle.1 --check '" + made.string() + "'").exit_code, 0);
  const std::string file = (mbverify.folder() / "wrong.h").string();
  std::string text = ReadAll(made);
  const size_t at = text.rfind("#endif");
  text.insert(at,
              "static inline void wrong(const parallel_ankle_pose* p, double d[]) {\n"
              "  parallel_ankle_actuators(p, d);\n  d[0] = -d[0];\n}\n"
              "#define parallel_ankle_actuators wrong\n");
  std::ofstream(file) << text;
  const ProgramResult result = Call("--coordinates ankle.0,ankle.1 --check '" + file + "'");
  EXPECT_EQ(result.exit_code, 1) << result.err;
  EXPECT_THAT(result.out, HasSubstr("the position of 'left' has the other sign"));
}

TEST_F(CodeCommand, RefusesWrongInput) {
  const std::vector<std::pair<std::string, std::string>> wrong = {
      {"--coordinates ankle.0", "2 degrees of freedom"},
      {"--coordinates ankle.0,ankel.1", "did you mean 'ankle.1'"},
      {"--coordinates ankle.0,ankle.1 --range ankle.0_deg=-3:3", "ranges of 1 of 2 coordinates"},
      {"--coordinates ankle.0,ankle.1 --range ankle.0_mm=-3:3", "in rad"},
      {"--coordinates ankle.0,ankle.1 --range ankle.0=3", "is not NAME=LOW:HIGH"},
      {"--coordinates ankle.0,ankle.1 --range ankle.0=1:2 --range ankle.0=1:2", "stated twice"},
      {"--coordinates ankle.0,ankle.1 --range ankle.0=2:1 --range ankle.1=0:1", "is empty"},
      {"--coordinates ankle.0,ankle.1 --range left=0:1 --range ankle.1=0:1", "no coordinate"},
      {"--coordinates ankle.0,ankle.1 --check nothing.h", "cannot be read"}};
  for (const auto& [options, message] : wrong) {
    const ProgramResult result = Call(options);
    EXPECT_EQ(result.exit_code, 2) << options;
    EXPECT_THAT(result.err, HasSubstr(message)) << options;
    EXPECT_FALSE(std::filesystem::exists(mbverify.folder() / "out/parallel_ankle")) << options;
  }
}

// Nothing is compiled or run without a compiler, and that is said.
TEST_F(CodeCommand, SaysThatNothingWasJudged) {
  const ProgramResult result = mbverify.WithPath(
      "/nowhere", "code tests/mechanisms/parallel_ankle.yaml --states 20 --out '" + mbverify.Out() +
                      "' --coordinates ankle.0,ankle.1");
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("C: not judged: there is no C compiler 'cc'"));
  EXPECT_THAT(result.out, HasSubstr("Python: not judged: there is no python3"));
}

}  // namespace
}  // namespace mbv
