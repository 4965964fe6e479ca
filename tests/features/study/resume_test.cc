// --resume with the real program: what was computed from a file that has changed is computed again.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "tests/support/run_program.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

class ResumeTest : public testing::Test {
 protected:
  Program mbverify{testing::UnitTest::GetInstance()->current_test_info()->name()};

  void Put(const std::string& name, const std::string& content) const {
    const fs::path file = mbverify.folder() / "regression" / name;
    fs::create_directories(file.parent_path());
    std::ofstream(file, std::ios::binary) << content;
  }
  [[nodiscard]] std::string Get(const std::string& name) const {
    return ReadAll(mbverify.folder() / "regression" / name);
  }
  static std::string Replaced(std::string text, const std::string& from, const std::string& to) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  [[nodiscard]] std::string CallWith(const std::string& more) const {
    return "regress '" + (mbverify.folder() / "regression").string() + "' --out '" +
           mbverify.Out() +
           "' --quiet --no-history --no-pictures --no-reports --jobs 1 --worker '" +
           (mbverify.folder() / "regression/worker").string() + "' " + more;
  }
  // A regression that is interrupted by its last scenario.
  void Interrupted() const {
    Put("stop", "");
    const ProgramResult result = mbverify(CallWith(""));
    fs::remove(mbverify.folder() / "regression/stop");
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_NE(result.err.find("interrupted after 3 of 4"), std::string::npos) << result.err;
  }
  // Goes on with it: the scenarios that were computed again, but for the last one.
  [[nodiscard]] std::string ComputedAgain() const {
    const ProgramResult result = mbverify(CallWith("--resume"));
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    const auto report =
        nlohmann::json::parse(ReadAll(mbverify.folder() / "out/regress.json"), nullptr, false);
    std::string again;
    for (const auto& scenario : report["cases"]) {
      const std::string name = fs::path(scenario["file"].get<std::string>()).stem();
      if (!scenario["kept"].get<bool>() && name != "z_last") again += name + " ";
    }
    return again;
  }
  // The program; asked to, it stops the regression instead of running the last scenario.
  void PutWorker() const {
    Put("worker",
        "#!/bin/sh\ncase $2 in *z_last.yaml) if [ -e \"$(dirname \"$0\")/stop\" ]; then "
        "kill -INT $PPID; sleep 60; fi;; esac\nexec '" +
            std::string(kBinaryDir) + "/mbverify' \"$@\"\n");
    fs::permissions(mbverify.folder() / "regression/worker", fs::perms::owner_all);
  }
};

TEST_F(ResumeTest, EveryFileThatAScenarioIsComputedFromCounts) {
  PutWorker();
  const std::string motion =
      "description: d\nmotion:\n  duration_s: 0.2\n  sample_s: 0.05\n  commands:\n    motor: "
      "[home, "
      "{sine: {amplitude: 0.1, period_s: 1}}]\nanalytic: none\nsimulation: {mode: inverse}\n"
      "snapshots: {times_s: []}\nexpect: {verdict: agree}\n";
  // A URDF; parameters of another model; a table.
  const LoadResult four_bar = LoadModel(SourcePath("/models/four_bar/model.yaml"));
  ASSERT_TRUE(four_bar.mechanism);
  Put("robot.urdf", WriteUrdf(*four_bar.mechanism));
  Put("from_urdf.yaml", WriteUrdfCompanion(*four_bar.mechanism, "robot.urdf"));
  Put("a_urdf.yaml", "mechanism: ./from_urdf.yaml\n" + motion);
  const std::string crank = ReadAll(SourcePath("/models/slider_crank/model.yaml"));
  const std::string line = "  m_rod: {value: 1.2, unit: kg}\n";
  Put("base/model.yaml", crank);
  Put("own.yaml", Replaced(Replaced(crank, line, ""), "parameters:\n",
                           "parameters_from: ./base/model.yaml\nparameters:\n"));
  Put("b_parameters.yaml", "mechanism: ./own.yaml\n" + motion);
  Put("tables/matlab.csv", ReadAll(SourcePath("/scenarios/four_bar/tables/matlab.csv")));
  Put("c_table.yaml", ReadAll(SourcePath("/scenarios/four_bar/table_matlab.yaml")));
  Put("z_last.yaml", "mechanism: four_bar\n" + motion);

  Interrupted();
  EXPECT_EQ(ComputedAgain(), "") << "nothing has changed";
  const std::pair<const char*, const char*> cases[] = {
      {"robot.urdf", "a_urdf "},         {"from_urdf.yaml", "a_urdf "},
      {"a_urdf.yaml", "a_urdf "},        {"base/model.yaml", "b_parameters "},
      {"own.yaml", "b_parameters "},     {"b_parameters.yaml", "b_parameters "},
      {"tables/matlab.csv", "c_table "}, {"c_table.yaml", "c_table "}};
  for (const auto& [file, again] : cases) {
    Interrupted();
    const std::string ending = fs::path(file).extension();
    Put(file, Get(file) + (ending == ".urdf"  ? "<!-- touched -->\n"
                           : ending == ".csv" ? "\n"
                                              : "# touched\n"));
    EXPECT_EQ(ComputedAgain(), again) << file;
  }
}

}  // namespace
}  // namespace mbv
