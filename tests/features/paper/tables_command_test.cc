// The command tables.
#include <gtest/gtest.h>

#include <filesystem>

#include "tests/support/run_program.h"

namespace mbv {
namespace {

TEST(TablesCommand, WritesLatexAndMarkdownAndReportsIt) {
  const Program mbverify("tables");
  const ProgramResult run = mbverify(
      "tables scenarios/four_bar/turn_inverse.yaml --only checks --json - --out " + mbverify.Out());
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_NE(run.out.find("\"name\": \"checks\""), std::string::npos) << run.out;
  const std::string folder = mbverify.Out() + "/four_bar/turn_inverse/";
  EXPECT_NE(ReadAll(folder + "checks.tex").find("\\toprule"), std::string::npos);
  EXPECT_NE(ReadAll(folder + "checks.md").find("|---|"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder + "parameters.md"));
}

TEST(TablesCommand, ADisagreementIsWrittenAndReported) {
  const Program mbverify("tables_disagree");
  const ProgramResult run = mbverify(
      "tables scenarios/four_bar/turn_inverse.yaml --only checks --set checks.force_nrmse=1e-30 "
      "--formats md --out " +
      mbverify.Out());
  EXPECT_EQ(run.exit_code, 1) << run.err;
  EXPECT_NE(ReadAll(mbverify.Out() + "/four_bar/turn_inverse/checks.md").find("| FAIL |"),
            std::string::npos);
}

TEST(TablesCommand, BadOptionsAreRefused) {
  const Program mbverify("tables_bad");
  for (const char* options : {"--formats doc", "--only parameter", "--set a"}) {
    const ProgramResult run = mbverify("tables scenarios/four_bar/turn_inverse.yaml --out " +
                                       mbverify.Out() + " " + std::string(options));
    EXPECT_EQ(run.exit_code, 2) << options;
    EXPECT_FALSE(run.err.empty()) << options;
  }
  EXPECT_EQ(mbverify("tables four_bar/turn_inverse --out /dev/null/tables").exit_code, 3);
}

}  // namespace
}  // namespace mbv
