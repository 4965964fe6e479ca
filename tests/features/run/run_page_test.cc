// The page of a run: what the runs of one regression share.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>

#include "base/files.h"
#include "features/run/run_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// The section of the paper's equations in the report of a short run.
std::string EquationsSection(const fs::path& out, const std::string& kept) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = {{"simulation", "off"}};
  options.out_dir = out.string();
  options.kept_audits = kept;
  const RunOutcome outcome = RunScenario(SourcePath("/scenarios/spr_tripod/static.yaml"), options);
  EXPECT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const std::string page = ReadWholeFile(fs::path(outcome.folder) / "report.html").value_or("");
  const size_t begin = page.find("<section id=\"equations\">");
  EXPECT_NE(begin, std::string::npos);
  return page.substr(begin, page.find("</section>", begin) - begin);
}

TEST(RunPage, WhatStoppedARunIsSaidOnce) {
  const fs::path out = fs::temp_directory_path() / ("mbv_run_page_" + std::to_string(getpid()));
  RunOptions options;
  options.pictures = false;
  options.out_dir = out.string();
  const RunOutcome outcome =
      RunScenario(SourcePath("/scenarios/four_bar/must_fail/out_of_reach.yaml"), options);
  const std::string page = ReadWholeFile(fs::path(outcome.folder) / "report.html").value_or("");
  const std::string why = "the commanded pose cannot be reached";
  const size_t said = page.find(why);
  ASSERT_NE(said, std::string::npos);
  EXPECT_EQ(page.find(why, said + 1), std::string::npos);
  EXPECT_NE(page.find("reference failed"), std::string::npos);
  fs::remove_all(out);
}

TEST(RunPage, TheAuditOfARegressionIsComputedOnceAndReadByTheOthers) {
  const fs::path out = fs::temp_directory_path() / ("mbv_run_page_" + std::to_string(getpid()));
  const fs::path kept = out / "kept", file = kept / "spr_tripod.json";
  const std::string alone = EquationsSection(out, "");
  EXPECT_EQ(EquationsSection(out, kept.string()), alone);
  const std::string text = ReadWholeFile(file).value_or("");
  ASSERT_FALSE(text.empty());
  EXPECT_EQ(EquationsSection(out, kept.string()), alone);
  // It is read, not computed anew; and a damaged file is.
  std::string perturbed = text;
  const size_t at = perturbed.find("(1)");
  ASSERT_NE(at, std::string::npos);
  perturbed.replace(at, 3, "(X)");
  ASSERT_EQ(WriteFile(file, perturbed), "");
  EXPECT_NE(EquationsSection(out, kept.string()).find("(X)"), std::string::npos);
  ASSERT_EQ(WriteFile(file, text.substr(0, text.size() / 2)), "");
  EXPECT_EQ(EquationsSection(out, kept.string()), alone);
  fs::remove_all(out);
}

}  // namespace
}  // namespace mbv
