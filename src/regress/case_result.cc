#include "regress/case_result.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mbv {
namespace {

constexpr std::array<const char*, 8> kStatusWords = {"not_run",   "as_expected",   "unexpected",
                                                     "bad_input", "could_not_run", "crashed",
                                                     "timed_out", "internal_error"};

}  // namespace

const char* ToText(CaseStatus status) { return kStatusWords[static_cast<size_t>(status)]; }

CaseStatus CaseStatusOf(const std::string& text) {
  for (size_t i = 0; i < kStatusWords.size(); ++i) {
    if (text == kStatusWords[i]) return static_cast<CaseStatus>(i);
  }
  return CaseStatus::kNotRun;
}

int ExitCodeOf(CaseStatus status) {
  switch (status) {
    case CaseStatus::kAsExpected:
      return 0;
    case CaseStatus::kUnexpected:
      return 1;
    case CaseStatus::kBadInput:
      return 2;
    case CaseStatus::kNotRun:
    case CaseStatus::kCouldNotRun:
    case CaseStatus::kCrashed:
    case CaseStatus::kTimedOut:
    case CaseStatus::kInternalError:
      return 3;
  }
  return 4;
}

std::span<const std::string_view> KeyMetricNames() {
  static constexpr std::array<std::string_view, 10> kNames = {
      "simulated_vs_analytic.force_nrmse",      "simulated_vs_reference.force_nrmse",
      "reference_vs_analytic.force_nrmse",      "simulated_vs_analytic.stiffness_entry",
      "simulated_vs_reference.stiffness_entry", "reference_vs_analytic.stiffness_entry",
      "simulated_vs_analytic.pose_m",           "simulated_vs_reference.pose_m",
      "simulated_vs_analytic.velocity_nrmse",   "simulated_vs_reference.velocity_nrmse"};
  return kNames;
}

const std::pair<const std::string, MetricValue>* KeyMetric(const CaseResult& result) {
  for (const std::string_view name : KeyMetricNames()) {
    const auto found = result.metrics.find(std::string(name));
    if (found != result.metrics.end()) return &*found;
  }
  return nullptr;
}

std::vector<const std::pair<const std::string, MetricValue>*> FailedChecks(
    const CaseResult& result) {
  std::vector<const std::pair<const std::string, MetricValue>*> failed;
  for (const auto& check : result.metrics) {
    if (check.second.limit && !check.second.pass) failed.push_back(&check);
  }
  const auto excess = [](const auto* check) {
    const double ratio = check->second.value / *check->second.limit;
    return std::isfinite(ratio) ? ratio : HUGE_VAL;
  };
  std::stable_sort(failed.begin(), failed.end(),
                   [&](const auto* a, const auto* b) { return excess(a) > excess(b); });
  return failed;
}

Counts CountCases(const RegressReport& report) {
  Counts counts;
  for (const CaseResult& result : report.cases) {
    const bool fine = !result.failed();
    ++counts.total;
    counts.as_expected += fine ? 1 : 0;
    counts.ran += result.ran ? 1 : 0;
    counts.compared += result.compared ? 1 : 0;
    counts.verified += result.verified ? 1 : 0;
    counts.must_fail += fine && result.expected.verdict != "agree" ? 1 : 0;
    counts.drifted += result.drifts.empty() ? 0 : 1;
  }
  counts.missing = static_cast<int>(report.missing.size());
  return counts;
}

int ExitCodeOf(const RegressReport& report) {
  static constexpr std::array<int, 4> kBadness = {0, 1, 3, 2};  // of exit codes 0 … 3
  int worst = report.fail_on_missing && !report.missing.empty() ? 1 : 0;
  for (const CaseResult& result : report.cases) {
    const int code = ExitCodeOf(result.status);
    if (kBadness[static_cast<size_t>(code)] > kBadness[static_cast<size_t>(worst)]) worst = code;
  }
  return worst;
}

}  // namespace mbv
