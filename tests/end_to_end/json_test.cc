// --json of the commands that print a result.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

using Json = nlohmann::json;

class JsonOutput : public testing::Test {
 protected:
  // Standard output, which must be JSON and nothing else.
  [[nodiscard]] Json Of(const std::string& command, int exit_code = 0) const {
    const ProgramResult result = mbverify(command + " --json -");
    EXPECT_EQ(result.exit_code, exit_code) << command << "\n" << result.err;
    const Json json = Json::parse(result.out, nullptr, false);
    EXPECT_FALSE(json.is_discarded()) << command << "\n" << result.out.substr(0, 500);
    EXPECT_NE(result.err, "") << command << ": the text goes to standard error";
    return json;
  }
  [[nodiscard]] std::string WithOut(const std::string& command) const {
    return command + " --out " + mbverify.Out();
  }
  Program mbverify{std::string("json_") +
                   testing::UnitTest::GetInstance()->current_test_info()->name()};
};

TEST_F(JsonOutput, OfRunsIsASummaryForEachScenario) {
  const std::string bad = mbverify.folder() / "bad.yaml";
  std::ofstream(bad) << "mechanism: four_bar\nmotoin: {}\n";
  const Json json = Of(WithOut("run scenarios/four_bar/turn_inverse.yaml "
                               "scenarios/four_bar/must_fail/wrong_mass.yaml --no-pictures "
                               "--no-report " +
                               bad),
                       2);
  EXPECT_EQ(json["exit_code"], 2);
  const Json& first = json["results"][0];
  EXPECT_EQ(first["verdict"], "agree");
  EXPECT_EQ(first["schema"], "mbverify.summary/1");
  EXPECT_EQ(json["results"][1]["verdict"], "disagree");
  const Json& refused = json["results"][2];
  EXPECT_EQ(refused["exit_code"], 2);
  EXPECT_EQ(refused["findings"][0]["severity"], "error");
}

TEST_F(JsonOutput, OfCheckHoldsTheFindingsWithTheirPlaces) {
  const std::string file = mbverify.folder() / "bad.yaml";
  std::ofstream(file) << "mechanism: four_bar\nmotoin: {}\n";
  const Json json = Of("check scenarios/four_bar/turn.yaml " + file, 2);
  EXPECT_EQ(json["files"][0]["ok"], true);
  EXPECT_EQ(json["files"][1]["ok"], false);
  bool found = false;
  for (const Json& finding : json["files"][1]["findings"]) {
    found = found || (finding["message"].get<std::string>().find("motoin") != std::string::npos &&
                      finding["line"] == 2 && finding["file"] == file);
  }
  EXPECT_TRUE(found) << json["files"][1];
}

TEST_F(JsonOutput, OfListNamesModelsAndScenarios) {
  const Json json = Of("list");
  const auto named = [&](const Json& model) { return model["name"] == "spr_tripod"; };
  EXPECT_TRUE(std::any_of(json["models"].begin(), json["models"].end(), named));
  EXPECT_GT(json["scenarios"].size(), 20U);
}

TEST_F(JsonOutput, OfOtherCommandsHoldsTheirNumbers) {
  const Json audit = Of("audit spr_tripod");
  EXPECT_EQ(audit["audits"][0]["mechanism"], "spr_tripod");
  EXPECT_TRUE(audit["audits"][0]["rows"][0]["residual_corrected"].is_number());
  const Json orders =
      Of(WithOut("converge scenarios/slider_crank/turn.yaml --steps 0.004,0.002,0.001"));
  EXPECT_FALSE(orders.empty());
  const Json stiffness = Of("stiffness scara_robot --no-simulation");
  EXPECT_TRUE(stiffness.contains("verdict"));
  const Json space = Of(WithOut("workspace spr_tripod --no-pictures"));
  EXPECT_EQ(space["agree"], true);
  const Json& volume = space["measures"][0];
  EXPECT_EQ(volume["unit"], "m3");
  EXPECT_LT(volume["error"].get<double>(), 1e-9 * volume["value"].get<double>());
}

TEST_F(JsonOutput, OfRegressionRunsAndTheirHistory) {
  const std::string history = mbverify.folder() / "history.sqlite";
  for (int run = 0; run < 2; ++run) {
    const Json regression =
        Of(WithOut("regress scenarios/four_bar/turn_inverse.yaml --no-pictures "
                   "--no-reports --quiet --history " +
                   history));
    EXPECT_EQ(regression["cases"].size(), 1U);
  }
  const Json runs = Of("history list --history " + history);
  EXPECT_EQ(runs["runs"].size(), 2U);
  EXPECT_EQ(runs["runs"][1]["as_expected"], 1);
  const Json both = Of("history compare 1 2 --history " + history);
  EXPECT_EQ(both["scenarios"][0]["a"]["status"], both["scenarios"][0]["b"]["status"]);
  EXPECT_EQ(both["scenarios"][0]["moved"], "");
}

TEST_F(JsonOutput, GoesToAFileBesideTheTextButNotOverWhatWasRead) {
  const std::string file = mbverify.folder() / "out.json";
  const std::string command = "check scenarios/four_bar/turn.yaml";
  const ProgramResult result = mbverify(command + " --json " + file);
  EXPECT_EQ(result.out, mbverify(command).out);
  EXPECT_TRUE(Json::accept(ReadAll(file)));
  const std::string scenario = mbverify.folder() / "scenario.yaml";
  std::filesystem::copy_file(std::string(kSourceDir) + "/scenarios/four_bar/turn.yaml", scenario);
  const std::string before = ReadAll(scenario);
  const std::string run = "run --no-pictures --no-report --quiet --out " + mbverify.Out() + " ";
  for (const std::string& lost : {std::string("check "), run}) {
    EXPECT_EQ(mbverify(lost + scenario + " --json " + scenario).exit_code, 2) << lost;
    EXPECT_EQ(ReadAll(scenario), before) << lost;
  }
}

}  // namespace
}  // namespace mbv
