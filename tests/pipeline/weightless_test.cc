// Statics without weight: every force is zero, and no witness may make something of it.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>

#include "pipeline/run_scenario.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

RunOutcome RunWeightless(const std::string& scenario, std::vector<SetValue> set) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  return RunScenario(SourcePath("/scenarios/" + scenario + ".yaml"), options);
}

std::string ReadText(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

// At rest without weight MuJoCo has the solution from the start, and must be made to refine it.
TEST(Weightless, NoStaticScenarioDisagrees) {
  const fs::path source = kSourceDir;
  const fs::path folder = fs::path(testing::TempDir()) / "weightless";
  size_t ran = 0;
  for (const auto& entry : fs::directory_iterator(source / "scenarios")) {
    const std::string name = entry.path().filename();
    if (!fs::exists(entry.path() / "static.yaml")) continue;
    // The same model with its gravity taken away.
    fs::create_directories(folder / name);
    const std::string text = ReadText(source / "models" / name / "model.yaml");
    const std::regex gravity(R"(\ngravity: *\[[^\]]*\])");
    const fs::path model = folder / name / "model.yaml";
    std::ofstream(model) << std::regex_replace(text, gravity, "\n") << "\ngravity: [0, 0, 0]\n";
    const RunOutcome outcome = RunWeightless(name + "/static", {{"mechanism", model.string()}});
    ASSERT_TRUE(outcome.report) << name << ": " << outcome.diagnostics.Text();
    // Where nothing pushes either, nothing is verified; nothing may be found wrong.
    const Comparison& comparison = outcome.report->comparison;
    EXPECT_EQ(comparison.failed(), 0U) << name << ": " << comparison.reason << "\n"
                                       << comparison.attribution.text;
    EXPECT_NE(outcome.exit_code, 1) << name;
    ++ran;
  }
  EXPECT_GE(ran, 7U);
  EXPECT_NE(RunWeightless("cabin_robot/static", {{"parameters", "{g: 0}"}}).exit_code, 1);
}

}  // namespace
}  // namespace mbv
