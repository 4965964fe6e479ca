// `mbverify init`: what it writes runs at once, and nothing is overwritten or half-written.
#include "features/robots/init.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "features/run/run_scenario.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string WrittenText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

class InitModelTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::temp_directory_path() / (std::string("mbv_init_") + info->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  [[nodiscard]] InitResult Init(const std::string& name, const std::string& from = "four_bar") {
    return InitModel({.name = name, .from = from, .into = folder_.string()});
  }
  [[nodiscard]] size_t Entries() const {
    return static_cast<size_t>(std::distance(fs::recursive_directory_iterator(folder_),
                                             fs::recursive_directory_iterator()));
  }

  fs::path folder_;
};

TEST_F(InitModelTest, EveryStarterRunsAtOnceAndAgrees) {
  for (const Starter& starter : Starters()) {
    const std::string name = std::string("my_") + starter.name;
    const InitResult result = Init(name, starter.name);
    ASSERT_EQ(result.files.size(), 2u) << result.diagnostics.Text();
    EXPECT_EQ(result.files[0], (folder_ / "models" / name / "model.yaml").string());
    EXPECT_EQ(result.files[1], (folder_ / "scenarios" / name / "first.yaml").string());
    RunOptions options;
    options.pictures = false;
    const RunOutcome outcome = RunScenario(result.files[1], options);
    EXPECT_EQ(outcome.exit_code, 0) << starter.name << outcome.diagnostics.Text();
    EXPECT_TRUE(outcome.diagnostics.empty()) << outcome.diagnostics.Text();
    ASSERT_TRUE(outcome.report);
    EXPECT_EQ(outcome.report->mechanism, name);
  }
}

TEST_F(InitModelTest, AStarterIsTheShippedModelWithComments) {
  for (const Starter& starter : Starters()) {
    std::istringstream lines(starter.model);
    std::string plain;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("name:")) line = std::string("name: ") + starter.name;
      if (!line.starts_with("#")) plain += line + "\n";
    }
    EXPECT_EQ(plain,
              WrittenText(std::string(kSourceDir) + "/models/" + starter.name + "/model.yaml"));
  }
}

TEST_F(InitModelTest, WhatIsCommentedOutInAScenarioLoadsToo) {
  for (const Starter& starter : Starters()) {
    const InitResult result = Init("mine_" + std::string(starter.name), starter.name);
    ASSERT_EQ(result.files.size(), 2u);
    const std::string first = WrittenText(result.files[1]);
    // Loads and the table; a command that stands instead of the drive's.
    std::string text = std::regex_replace(first, std::regex("# (loads|reference): "), "$1: ");
    EXPECT_NE(text, first);
    std::ofstream(fs::path(result.files[1]).parent_path() / "forces.csv")
        << "t,F\n0,1\n0.5,2\n1,3\n1.5,4\n";
    const ScenarioResult loaded = LoadScenarioText(text, result.files[1]);
    EXPECT_TRUE(loaded.scenario) << loaded.diagnostics.Text();
    const std::regex instead("\n    motor: [^\n]*\n    # instead of the drive: ");
    if (!std::regex_search(first, instead)) continue;
    const ScenarioResult other =
        LoadScenarioText(std::regex_replace(first, instead, "\n    "), result.files[1]);
    EXPECT_TRUE(other.scenario) << other.diagnostics.Text();
  }
}

TEST_F(InitModelTest, NothingIsOverwritten) {
  ASSERT_EQ(Init("mine").files.size(), 2u);
  const fs::path model = folder_ / "models/mine/model.yaml";
  std::ofstream(model) << "my work\n";
  const InitResult again = Init("mine");
  EXPECT_TRUE(again.files.empty());
  EXPECT_EQ(again.diagnostics.findings().size(), 2u) << again.diagnostics.Text();
  EXPECT_NE(again.diagnostics.Text().find("already there"), std::string::npos);
  EXPECT_EQ(WrittenText(model), "my work\n");
}

TEST_F(InitModelTest, WithOneOfTheTwoInTheWayNeitherIsWritten) {
  fs::create_directories(folder_ / "scenarios/mine");  // empty, but the user's
  EXPECT_TRUE(Init("mine").files.empty());
  EXPECT_FALSE(fs::exists(folder_ / "models"));
  EXPECT_EQ(Entries(), 2u);
}

TEST_F(InitModelTest, AFailureOnTheWayLeavesNothing) {
  std::ofstream(folder_ / "scenarios") << "a file where a folder is needed\n";
  const InitResult result = Init("mine");
  EXPECT_TRUE(result.files.empty());
  EXPECT_TRUE(result.diagnostics.has_errors());
  EXPECT_EQ(Entries(), 1u) << "models/ was left behind";
}

TEST_F(InitModelTest, BadNamesAreRefusedWithRuleAndHint) {
  const std::pair<std::string, const char*> names[] = {
      {"", "for example my_linkage"},   {"2arm", "for example arm"},
      {"my arm", "for example my_arm"}, {"../up", "for example up"},
      {"a/b", "for example a_b"},       {".hidden", "for example hidden"},
      {"täter", "for example t"},       {std::string(65, 'a'), "for example aaaa"},
      {"a\nb", "for example a_b"},      {"-x", "for example x"}};
  for (const auto& [name, hint] : names) {
    const InitResult result = Init(name);
    EXPECT_TRUE(result.files.empty()) << name;
    EXPECT_NE(result.diagnostics.Text().find("violates: a letter, then letters, digits and '_'"),
              std::string::npos)
        << name;
    EXPECT_NE(result.diagnostics.Text().find(hint), std::string::npos) << result.diagnostics.Text();
  }
  EXPECT_EQ(Entries(), 0u);
}

TEST_F(InitModelTest, AllFindingsAreGivenAtOnce) {
  const std::string text = Init("1", "four_ber").diagnostics.Text();
  EXPECT_NE(text.find("name = '1'"), std::string::npos) << text;
  EXPECT_NE(text.find("did you mean 'four_bar'?"), std::string::npos) << text;
}

TEST_F(InitModelTest, ANameWithAClosedFormOfItsOwnIsRefused) {
  EXPECT_NE(Init("spr_tripod").diagnostics.Text().find("for example my_spr_tripod"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
