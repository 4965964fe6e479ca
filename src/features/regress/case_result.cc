#include "features/regress/case_result.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/json_fields.h"

namespace mbv {
namespace {

constexpr std::array<const char*, 8> kStatusWords = {"not_run",   "as_expected",   "unexpected",
                                                     "bad_input", "could_not_run", "crashed",
                                                     "timed_out", "internal_error"};

}  // namespace

const char* ToText(CaseStatus status) { return kStatusWords[static_cast<size_t>(status)]; }

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

// regress.json and the state files: CaseResult and RegressReport ↔ JSON.

constexpr const char* kSchema = "mbverify.regress/1";

template <typename F, Is<MetricValue> T>
void Describe(F& field, T& metric) {
  field("value", metric.value);
  const bool judged = metric.limit.has_value();
  field.Optional("limit", metric.limit, judged);
  field.Optional("pass", metric.pass, judged);
  field.Optional("channel", metric.channel, !metric.channel.empty());
  field.Optional("time_s", metric.time_s, std::isfinite(metric.time_s));
}

template <typename F, Is<Unmeasured> T>
void Describe(F& field, T& item) {
  field("what", item.what);
  field("why", item.why);
}

template <typename F, Is<Drift> T>
void Describe(F& field, T& drift) {
  field("metric", drift.metric);
  field("text", drift.text);
  field("value", drift.value);
  field("baseline", drift.baseline);
  field("since_run", drift.since_run);
  field("since", drift.since);
}

template <typename F, Is<PastOfFailure> T>
void Describe(F& field, T& past) {
  field("runs", past.runs);
  field("good_run", past.good_run);
  field("when", past.when);
  field("values", past.values);
}

template <typename F, Is<Expectation> T>
void Describe(F& field, T& expected) {
  field("verdict", expected.verdict);
  field("exit_code", expected.exit_code);
  field("mentions", expected.mentions);
}

template <typename F, Is<InputFile> T>
void Describe(F& field, T& input) {
  field("file", input.file);
  field("fingerprint", input.fingerprint);
}

template <typename F, Is<Cost> T>
void Describe(F& field, T& cost) {
  field("wall_s", cost.wall_s);
  field("cpu_s", cost.cpu_s);
  field("peak_kib", cost.peak_kib);
}

template <typename F, Is<MissingCase> T>
void Describe(F& field, T& missing) {
  field("key", missing.key);
  field("last_run", missing.last_run);
  field("when", missing.when);
}

template <typename F, Is<CaseResult> T>
void Describe(F& field, T& result) {
  field("key", result.key);
  field("file", result.file);
  field("description", result.description);
  field("inputs", result.inputs);
  field("fingerprint", result.fingerprint);
  field.Word("status", result.status, kStatusWords);
  field("reason", result.reason);
  field("verdict", result.verdict);
  field("exit_code", result.exit_code);
  field("signal", result.signal);
  field("expected", result.expected);
  field("ran", result.ran);
  field("compared", result.compared);
  field("verified", result.verified);
  field("metrics", result.metrics);
  field("not_compared", result.not_compared);
  field.Optional("caveats", result.caveats);
  field("versions", result.versions);
  field.Optional("input_files", result.input_files);
  field("has_folder", result.has_folder);
  field.Optional("has_report", result.has_report);
  field("cost", result.cost);
  field("log_tail", result.log_tail);
  field("kept", result.kept);
  field("drifts", result.drifts);
  field.Optional("past", result.past, result.past.runs > 0);
  field.Optional("changes", result.changes, !result.changes.empty());
  field("course", result.course);
}

template <typename F, Is<RunInfo> T>
void Describe(F& field, T& run) {
  field.Optional("uid", run.uid);
  field("id", run.id);
  field("started_utc", run.started_utc);
  field("finished_utc", run.finished_utc);
  field("label", run.label);
  field("host", run.host);
  field("program", run.program);
  field("shard", run.shard);
  field.Optional("covers", run.covers);
  field.Optional("found", run.found);
  field.Optional("partial", run.partial);
  field("wall_s", run.wall_s);
  field("jobs", run.jobs);
}

std::string ToJson(const CaseResult& result) { return Dump(JsonOf(result), 1); }

std::string ToJson(const RegressReport& report) {
  const Counts counts = CountCases(report);
  return Dump({{"schema", kSchema},
               {"run", JsonOf(report.run)},
               {"exit_code", ExitCodeOf(report)},
               {"counts",
                {{"total", counts.total},
                 {"as_expected", counts.as_expected},
                 {"ran", counts.ran},
                 {"compared", counts.compared},
                 {"verified", counts.verified},
                 {"must_fail_as_expected", counts.must_fail},
                 {"drifted", counts.drifted},
                 {"missing", counts.missing}}},
               {"notes", report.notes},
               {"fail_on_missing", report.fail_on_missing},
               {"missing", JsonOf(report.missing)},
               {"cases", JsonOf(report.cases)}},
              1);
}

std::optional<CaseResult> CaseFromJson(const std::string& text) {
  return ReadJson(text, FromJson<CaseResult>).value;
}

std::optional<RegressReport> ReportFromJson(const std::string& text, const std::string& file,
                                            std::optional<Finding>* damage) {
  const auto read = [](const JsonValue& json) {
    return RegressReport{.run = FromJson<RunInfo>(json.at("run")),
                         .cases = FromJson<std::vector<CaseResult>>(json.at("cases")),
                         .notes = json.at("notes"),
                         .missing = json.contains("missing")
                                        ? FromJson<std::vector<MissingCase>>(json.at("missing"))
                                        : std::vector<MissingCase>(),
                         .fail_on_missing = json.value("fail_on_missing", false)};
  };
  auto report = ReadJson(text, read, kSchema);
  if (!report && damage != nullptr) *damage = report.refusal.FindingIn(file);
  return std::move(report.value);
}

}  // namespace mbv
