// docs/reference/scenario_file.md says what the program does.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>

#include "scenario/load_scenario.h"
#include "tests/support/document_text.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

std::string Document() {
  std::ifstream stream(std::string(kSourceDir) + "/docs/reference/scenario_file.md");
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

TEST(ScenarioDocument, ItsExampleLoads) {
  std::filesystem::current_path(kSourceDir);
  const std::string document = Document();
  const size_t start = document.find("```yaml\n") + 8;
  const std::string example = document.substr(start, document.find("```", start) - start);
  const ScenarioResult result = LoadScenarioText(example, "scenarios/example.yaml");
  EXPECT_TRUE(result.diagnostics.empty()) << result.diagnostics.Text();
  EXPECT_TRUE(result.scenario);
}

TEST(ScenarioDocument, ItsTableHoldsEveryCheckWithItsDefaults) {
  const std::string document = Document();
  for (const MetricRow& row : MetricRows()) {
    const std::string unit = *row.unit == '\0' ? "" : fmt::format(" [{}]", row.unit);
    if (!row.limits.forward) {
      EXPECT_NE(document.find(fmt::format("| `{}` | {} | none |\n", row.key, row.title)),
                std::string::npos)
          << row.key;
      continue;
    }
    const std::string line =
        fmt::format("| `{}` | {}{} | {:.0e}, {:.0e}, {:.0e} |\n", row.key, row.title, unit,
                    *row.limits.forward, *row.limits.inverse, *row.limits.reference);
    const std::string plain = test::AsPlainText(line);
    EXPECT_NE(document.find(plain), std::string::npos) << plain;
  }
}

}  // namespace
}  // namespace mbv
