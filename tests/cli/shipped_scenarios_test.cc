// Every scenario file in the project does what its `expect:` says.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "regress/accuracy.h"
#include "scenario/load_scenario.h"
#include "tests/cli/program.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> ShippedScenarios() {
  std::vector<std::string> files;
  const fs::path root = kSourceDir;
  for (const auto& entry : fs::recursive_directory_iterator(root / "scenarios")) {
    if (entry.path().extension() == ".yaml" && ReadScenarioHead(entry.path()).is_scenario) {
      files.push_back(entry.path().lexically_relative(root));
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string NameOf(std::string file) {
  file = file.substr(0, file.size() - 5).substr(std::string("scenarios/").size());
  for (char& c : file) c = std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
  return file;
}

// The result lies in <model>/<case>/, where the case may lie in must_fail/.
fs::path FindSummary(const fs::path& out) {
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(out, error)) {
    if (entry.path().filename() == "summary.json") return entry.path();
  }
  return {};
}

// Names of the failed checks, and where the witnesses broke down.
std::string Culprits(const nlohmann::json& summary) {
  std::string text;
  for (const auto& check : summary["checks"]) {
    if (!check["pass"].get<bool>()) text += check["name"].get<std::string>() + "\n";
  }
  for (const auto& witness : summary["witnesses"]) text += witness.value("where", "") + "\n";
  return text;
}

// What the documents quote of a scenario is what it gives.
void CheckDocuments(const std::string& scenario, const std::string& summary) {
  for (const char* document : {"README.md", "docs/simulation.md"}) {
    const std::string text = ReadAll(fs::path(kSourceDir) / document);
    for (const AccuracyCell& cell : AccuracyCells(text)) {
      if (cell.scenario != scenario) continue;
      const auto measured = AccuracyText(cell.heading, summary);
      ASSERT_TRUE(measured) << document << ": no such heading: " << cell.heading;
      EXPECT_TRUE(SameAccuracy(cell.text, *measured))
          << document << ", " << scenario << ", " << cell.heading << ": " << cell.text
          << ", measured " << *measured << "; renew it with mbverify regress --tables";
    }
  }
}

class ShippedScenario : public testing::TestWithParam<std::string> {};

TEST_P(ShippedScenario, GivesWhatItExpects) {
  const Expectation expect = ReadScenarioHead(std::string(kSourceDir) + "/" + GetParam()).expect;
  const Program mbverify(NameOf(GetParam()));
  const ProgramResult result =
      mbverify("run " + GetParam() + " --no-pictures --out " + mbverify.Out());
  const std::string printed = result.out + result.err;
  EXPECT_EQ(result.exit_code, expect.exit_code) << printed;
  if (expect.exit_code == 2) {
    EXPECT_NE(printed.find(expect.mentions), std::string::npos) << printed;
    EXPECT_TRUE(result.out.empty()) << result.out;
    EXPECT_FALSE(fs::exists(mbverify.Out()));
    return;
  }
  const fs::path summary = FindSummary(mbverify.Out());
  ASSERT_FALSE(summary.empty()) << printed;
  const auto json = nlohmann::json::parse(ReadAll(summary));
  EXPECT_EQ(json["verdict"], expect.verdict);
  EXPECT_EQ(json["exit_code"], expect.exit_code);
  CheckDocuments(fs::path(GetParam()).lexically_relative("scenarios").replace_extension(),
                 ReadAll(summary));
  const std::string text = printed + Culprits(json);
  EXPECT_NE(text.find(expect.mentions), std::string::npos)
      << "'" << expect.mentions << "' is missing in\n"
      << text;
}

INSTANTIATE_TEST_SUITE_P(Shipped, ShippedScenario, testing::ValuesIn(ShippedScenarios()),
                         [](const auto& info) { return NameOf(info.param); });

TEST(ShippedScenarios, DocumentsQuoteScenariosThatExist) {
  const fs::path root = kSourceDir;
  size_t quoted = 0;
  for (const char* document : {"README.md", "docs/simulation.md"}) {
    for (const AccuracyCell& cell : AccuracyCells(ReadAll(root / document))) {
      EXPECT_TRUE(fs::exists(root / "scenarios" / (cell.scenario + ".yaml"))) << cell.scenario;
      ++quoted;
    }
  }
  EXPECT_GE(quoted, 100U);
}

TEST(ShippedScenarios, EachFileBelowMustFailExpectsAFailure) {
  for (const std::string& file : ShippedScenarios()) {
    const Expectation expect = ReadScenarioHead(std::string(kSourceDir) + "/" + file).expect;
    if (file.find("/must_fail/") == std::string::npos) continue;
    EXPECT_NE(expect.exit_code, 0) << file;
    EXPECT_FALSE(expect.mentions.empty()) << file << " does not say what must be found";
  }
}

}  // namespace
}  // namespace mbv
