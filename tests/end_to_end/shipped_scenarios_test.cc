// Every scenario file in the project does what its `expect:` says.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "features/regress/accuracy.h"
#include "scenario/load_scenario.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// Studies among them.
std::vector<std::string> ShippedScenarios() {
  std::vector<std::string> files;
  const fs::path root = kSourceDir;
  for (const auto& entry : fs::recursive_directory_iterator(root / "scenarios")) {
    if (entry.path().extension() != ".yaml") continue;
    const ScenarioHead head = ReadScenarioHead(entry.path());
    if (head.is_scenario || head.HasKey("study")) {
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

// Every document with an accuracy table.
std::vector<std::string> AccuracyDocuments() {
  return {"README.md", "docs/for_paper_authors.md", "docs/results/accuracy.md"};
}

// What the documents quote of a scenario is what it gives.
void CheckDocuments(const std::string& scenario, const std::string& summary) {
  for (const std::string& document : AccuracyDocuments()) {
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
  const ScenarioHead head = ReadScenarioHead(std::string(kSourceDir) + "/" + GetParam());
  const Expectation& expect = head.expect;
  const Program mbverify(NameOf(GetParam()));
  const ProgramResult result =
      head.HasKey("study")
          ? mbverify("study " + GetParam() + " --jobs 1 --out " + mbverify.Out())
          : mbverify("run " + GetParam() + " --no-pictures --out " + mbverify.Out());
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

// The cells of a Markdown table's row, without blanks and backticks.
std::vector<std::string> CellsOf(const std::string& row) {
  std::vector<std::string> cells;
  std::istringstream line(row.substr(1));
  for (std::string cell; std::getline(line, cell, '|');) {
    std::erase(cell, '`');
    const size_t first = cell.find_first_not_of(' ');
    cells.push_back(first == std::string::npos
                        ? ""
                        : cell.substr(first, cell.find_last_not_of(' ') + 1 - first));
  }
  return cells;
}

// Drive force error of a scenario with another step; "–" where the step is refused.
std::string ErrorAtStep(const Program& mbverify, const std::string& scenario, double step_s) {
  const ProgramResult result =
      mbverify(fmt::format("run scenarios/{}.yaml -q --no-pictures --no-report --out '{}' --set "
                           "simulation.step_s={:g} --set simulation.stock_too=false",
                           scenario, mbverify.Out(), step_s));
  if (result.exit_code == 2) return "–";
  const auto json = nlohmann::json::parse(ReadAll(FindSummary(mbverify.Out())));
  fs::remove_all(mbverify.Out());
  return fmt::format("{:.1e}",
                     json["metrics"]["simulated_vs_analytic"]["force_nrmse"].get<double>());
}

TEST(ShippedScenarios, TheStepStudyIsWhatTheyGive) {
  const std::string text = ReadAll(fs::path(kSourceDir) / "docs/results/accuracy.md");
  const std::string mark = "<!-- step study: held by a test -->\n";
  const size_t begin = text.find(mark), end = text.find("<!-- step study: end -->");
  ASSERT_TRUE(begin != std::string::npos && end != std::string::npos);
  std::istringstream table(text.substr(begin + mark.size(), end - begin - mark.size()));
  std::string line;
  std::getline(table, line);
  const std::vector<std::string> headings = CellsOf(line);
  std::getline(table, line);
  const Program mbverify("step_study");
  size_t rows = 0;
  for (; std::getline(table, line); ++rows) {
    const std::vector<std::string> cells = CellsOf(line);
    ASSERT_EQ(cells.size(), headings.size()) << line;
    std::map<double, double> errors;  // by step in ms
    for (size_t c = 1; c < cells.size(); ++c) {
      if (!headings[c].ends_with(" ms") || headings[c].starts_with("order")) continue;
      const double step_ms = std::stod(headings[c]);
      const std::string measured = ErrorAtStep(mbverify, cells[0], 1e-3 * step_ms);
      EXPECT_TRUE(SameAccuracy(cells[c], measured))
          << cells[0] << ", " << headings[c] << ": " << cells[c] << ", measured " << measured;
      if (cells[c] != "–") errors[step_ms] = std::stod(cells[c]);
    }
    // The order follows from two cells, where both are above round-off.
    if (cells.back() == "–") {
      EXPECT_LT(errors[0.5], 1e-12) << line;
    } else {
      EXPECT_NEAR(std::stod(cells.back()), std::log2(errors[1.0] / errors[0.5]), 0.1) << line;
    }
  }
  EXPECT_EQ(rows, 5U);
}

TEST(ShippedScenarios, DocumentsQuoteScenariosThatExist) {
  const fs::path root = kSourceDir;
  size_t quoted = 0;
  for (const std::string& document : AccuracyDocuments()) {
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
