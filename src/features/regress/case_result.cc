#include "features/regress/case_result.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/json_document.h"
#include "base/json_text.h"

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

// regress.json and the state files: CaseResult and RegressReport ↔ JSON.

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kSchema = "mbverify.regress/1";

Json MetricsJson(const CaseResult& result) {
  Json metrics = Json::object();
  for (const auto& [name, metric] : result.metrics) {
    Json json = {{"value", Number(metric.value)}};
    if (metric.limit) {
      json["limit"] = *metric.limit;
      json["pass"] = metric.pass;
    }
    if (!metric.channel.empty()) json["channel"] = metric.channel;
    if (std::isfinite(metric.time_s)) json["time_s"] = metric.time_s;
    metrics[name] = std::move(json);
  }
  return metrics;
}

Json DriftsJson(const CaseResult& result) {
  Json drifts = Json::array();
  for (const Drift& drift : result.drifts) {
    drifts.push_back({{"metric", drift.metric},
                      {"text", drift.text},
                      {"value", Number(drift.value)},
                      {"baseline", Number(drift.baseline)},
                      {"since_run", drift.since_run},
                      {"since", drift.since}});
  }
  return drifts;
}

Json PastJson(const PastOfFailure& past) {
  Json values = Json::object();
  for (const auto& [name, value] : past.values) values[name] = Number(value);
  return {{"runs", past.runs},
          {"good_run", past.good_run},
          {"when", past.when},
          {"values", std::move(values)}};
}

PastOfFailure PastOf(const JsonValue& json) {
  PastOfFailure past;
  past.runs = json.at("runs");
  past.good_run = json.at("good_run");
  past.when = json.at("when");
  for (const auto& [name, value] : json.at("values").items()) {
    past.values[name] = value.NumberOrNan();
  }
  return past;
}

Json MissingJson(const RegressReport& report) {
  Json missing = Json::array();
  for (const MissingCase& item : report.missing) {
    missing.push_back({{"key", item.key}, {"last_run", item.last_run}, {"when", item.when}});
  }
  return missing;
}

Json CaseJson(const CaseResult& result) {
  Json json = {{"key", result.key},
               {"file", result.file},
               {"description", result.description},
               {"inputs", result.inputs},
               {"fingerprint", result.fingerprint},
               {"status", ToText(result.status)},
               {"reason", result.reason},
               {"verdict", result.verdict},
               {"exit_code", result.exit_code},
               {"signal", result.signal},
               {"expected",
                {{"verdict", result.expected.verdict},
                 {"exit_code", result.expected.exit_code},
                 {"mentions", result.expected.mentions}}},
               {"ran", result.ran},
               {"compared", result.compared},
               {"verified", result.verified},
               {"metrics", MetricsJson(result)}};
  json["not_compared"] = Json::array();
  for (const Unmeasured& item : result.not_compared) {
    json["not_compared"].push_back({{"what", item.what}, {"why", item.why}});
  }
  json["caveats"] = result.caveats;
  json["versions"] = result.versions;
  json["input_files"] = Json::array();
  for (const InputFile& input : result.input_files) {
    json["input_files"].push_back({{"file", input.file}, {"fingerprint", input.fingerprint}});
  }
  json["has_folder"] = result.has_folder;
  json["has_report"] = result.has_report;
  json["cost"] = {{"wall_s", result.cost.wall_s},
                  {"cpu_s", result.cost.cpu_s},
                  {"peak_kib", result.cost.peak_kib}};
  json["log_tail"] = result.log_tail;
  json["kept"] = result.kept;
  json["drifts"] = DriftsJson(result);
  if (result.past.runs > 0) json["past"] = PastJson(result.past);
  if (!result.changes.empty()) json["changes"] = result.changes;
  json["course"] = Json::array();
  for (double value : result.course) json["course"].push_back(Number(value));
  return json;
}

CaseResult CaseOf(const JsonValue& json) {
  CaseResult result;
  result.key = json.at("key");
  result.file = json.at("file");
  result.description = json.at("description");
  result.inputs = json.at("inputs");
  result.fingerprint = json.at("fingerprint");
  result.status = CaseStatusOf(json.at("status"));
  result.reason = json.at("reason");
  result.verdict = json.at("verdict");
  result.exit_code = json.at("exit_code");
  result.signal = json.at("signal");
  result.expected.verdict = json.at("expected").at("verdict");
  result.expected.exit_code = json.at("expected").at("exit_code");
  result.expected.mentions = json.at("expected").at("mentions");
  result.ran = json.at("ran");
  result.compared = json.at("compared");
  result.verified = json.at("verified");
  for (const auto& [name, metric] : json.at("metrics").items()) {
    MetricValue& value = result.metrics[name];
    value.value = metric.at("value").NumberOrNan();
    value.channel = metric.value("channel", "");
    value.time_s = metric.contains("time_s") ? metric.at("time_s").NumberOrNan() : kNan;
    if (!metric.contains("limit")) continue;
    value.limit = metric.at("limit").get<double>();
    value.pass = metric.at("pass");
  }
  for (const JsonValue& item : json.at("not_compared").list()) {
    result.not_compared.push_back({item.at("what"), item.at("why")});
  }
  if (json.contains("caveats")) {
    result.caveats = json.at("caveats").get<std::vector<std::string>>();
  }
  result.versions = json.at("versions").get<std::map<std::string, std::string>>();
  if (json.contains("input_files")) {
    for (const JsonValue& input : json.at("input_files").list()) {
      result.input_files.push_back({input.at("file"), input.at("fingerprint")});
    }
  }
  result.has_folder = json.at("has_folder");
  result.has_report = json.value("has_report", result.has_folder);
  result.cost.wall_s = json.at("cost").at("wall_s");
  result.cost.cpu_s = json.at("cost").at("cpu_s");
  result.cost.peak_kib = json.at("cost").at("peak_kib");
  result.log_tail = json.at("log_tail");
  result.kept = json.at("kept");
  for (const JsonValue& drift : json.at("drifts").list()) {
    result.drifts.push_back({drift.at("metric"), drift.at("text"), drift.at("value").NumberOrNan(),
                             drift.at("baseline").NumberOrNan(), drift.at("since_run"),
                             drift.at("since")});
  }
  if (json.contains("past")) result.past = PastOf(json.at("past"));
  if (json.contains("changes")) {
    result.changes = json.at("changes").get<std::vector<std::string>>();
  }
  for (const JsonValue& value : json.at("course").list()) {
    result.course.push_back(value.NumberOrNan());
  }
  return result;
}

}  // namespace

std::string ToJson(const CaseResult& result) { return Dump(CaseJson(result), 1); }

std::string ToJson(const RegressReport& report) {
  const Counts counts = CountCases(report);
  Json json = {{"schema", kSchema},
               {"run",
                {{"uid", report.run.uid},
                 {"id", report.run.id},
                 {"started_utc", report.run.started_utc},
                 {"finished_utc", report.run.finished_utc},
                 {"label", report.run.label},
                 {"host", report.run.host},
                 {"program", report.run.program},
                 {"shard", report.run.shard},
                 {"covers", report.run.covers},
                 {"found", report.run.found},
                 {"partial", report.run.partial},
                 {"wall_s", report.run.wall_s},
                 {"jobs", report.run.jobs}}},
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
               {"missing", MissingJson(report)},
               {"cases", Json::array()}};
  for (const CaseResult& result : report.cases) json["cases"].push_back(CaseJson(result));
  return Dump(json, 1);
}

std::optional<CaseResult> CaseFromJson(const std::string& text) {
  return ReadJson(text, CaseOf).value;
}

std::optional<RegressReport> ReportFromJson(const std::string& text, const std::string& file,
                                            std::optional<Finding>* damage) {
  const auto read = [](const JsonValue& json) {
    RegressReport report;
    const JsonValue run = json.at("run");
    report.run.uid = run.value("uid", "");
    report.run.id = run.at("id");
    report.run.started_utc = run.at("started_utc");
    report.run.finished_utc = run.at("finished_utc");
    report.run.label = run.at("label");
    report.run.host = run.at("host");
    report.run.program = run.at("program");
    report.run.shard = run.at("shard");
    report.run.covers = run.value("covers", std::vector<std::string>{});
    report.run.found = run.value("found", size_t{0});
    report.run.partial = run.value("partial", false);
    report.run.wall_s = run.at("wall_s");
    report.run.jobs = run.at("jobs");
    report.notes = json.at("notes").get<std::vector<std::string>>();
    report.fail_on_missing = json.value("fail_on_missing", false);
    if (json.contains("missing")) {
      for (const JsonValue& item : json.at("missing").list()) {
        report.missing.push_back({item.at("key"), item.at("last_run"), item.at("when")});
      }
    }
    for (const JsonValue& item : json.at("cases").list()) report.cases.push_back(CaseOf(item));
    return report;
  };
  auto report = ReadJson(text, read, kSchema);
  if (!report && damage != nullptr) *damage = report.refusal.FindingIn(file);
  return std::move(report.value);
}

}  // namespace mbv
