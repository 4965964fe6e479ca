// Helpers of the regression's tests: a folder of its own, made-up results, fake workers.
#pragma once

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "base/files.h"
#include "features/regress/case_result.h"

namespace mbv {

/// A new folder that is the current one while the test runs.
class FolderTest : public testing::Test {
 protected:
  void SetUp() override {
    before_ = std::filesystem::current_path();
    const auto* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::temp_directory_path() /
              ("mbv_regress_" + std::string(info->name()) + "_" + std::to_string(getpid()));
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
    std::filesystem::current_path(folder_);
  }
  void TearDown() override {
    std::filesystem::current_path(before_);
    std::filesystem::remove_all(folder_);
  }
  static void Write(const std::string& path, const std::string& text) {
    ASSERT_EQ(WriteFile(path, text), "");
  }
  static std::string Read(const std::string& path) { return ReadWholeFile(path).value_or(""); }

  std::filesystem::path before_, folder_;
};

/// A scenario that agrees, with a drive force error of `nrmse` of 1e-6.
inline CaseResult AgreeingCase(const std::string& key, double nrmse) {
  CaseResult result;
  result.key = key;
  result.file = "scenarios/" + key + ".yaml";
  result.description = "A made-up scenario";
  result.inputs = "1111";
  result.status = CaseStatus::kAsExpected;
  result.reason = "all checks are within their limits";
  result.verdict = "agree";
  result.exit_code = 0;
  result.ran = result.compared = result.verified = true;
  result.has_folder = result.has_report = true;
  result.metrics["simulated_vs_analytic.force_nrmse"] = {nrmse, 1e-6, nrmse <= 1e-6};
  result.versions["mbverify"] = "0.1.0";
  result.cost = {1.5, 1.25, 51200};
  return result;
}

inline RegressReport OneRun(std::vector<CaseResult> cases, const std::string& label = "") {
  RegressReport report;
  report.run.started_utc = "2026-01-31T02:00:00Z";
  report.run.finished_utc = "2026-01-31T02:01:00Z";
  report.run.host = "machine";
  report.run.program = "mbverify 0.1.0 build 0123abcd";
  report.run.label = label;
  report.run.wall_s = 60.0;
  report.run.jobs = 2;
  report.cases = std::move(cases);
  return report;
}

}  // namespace mbv
