#include "regress/judge.h"

#include <fmt/format.h>

#include <cstring>
#include <filesystem>

#include "core/files.h"
#include "core/json_text.h"
#include "regress/log_text.h"

namespace mbv {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kTailLines = 12;       // of a log that a failure shows
constexpr int kSearchedLines = 200;  // of a log, from its end: what went wrong is said there

std::string Word(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : "";
}

double Number(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_number() ? found->get<double>() : kNan;
}

Json Part(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() ? *found : Json();
}

struct SummaryText {
  std::string reason;
  std::string culprits;  ///< failed checks and where witnesses broke down, one per line
  bool judged = true;    ///< anything was asked; a study may ask nothing
};

// What a summary.json says; throws where it is none of ours.
SummaryText ReadSummaryJson(const Json& json, CaseResult* result) {
  SummaryText words;
  words.reason = Word(json, "reason");
  words.judged = json.value("judged", true);
  if (const std::string verdict = Word(json, "verdict"); !verdict.empty()) {
    result->verdict = verdict;
  }
  if (result->description.empty()) result->description = Word(json, "description");
  for (const Json& witness : Part(json, "witnesses")) {
    result->ran = result->ran || witness.value("ran", false);
    words.culprits += "\n" + Word(witness, "where");
  }
  result->compared = Number(Part(json, "counts"), "pairs_compared") > 0.0;
  for (const char* list : {"checks", "checks_off"}) {
    for (const Json& check : Part(json, list)) {
      MetricValue& metric = result->metrics[Word(check, "name")];
      metric.value = Number(check, "value");
      metric.channel = Word(check, "channel");
      metric.time_s = Number(check, "time_s");
      if (!check.contains("limit")) continue;
      metric.limit = Number(check, "limit");
      metric.pass = check.value("pass", false);
      if (!metric.pass) words.culprits += "\n" + Word(check, "name");
    }
  }
  for (const Json& item : Part(json, "not_compared")) {
    result->not_compared.push_back({Word(item, "what"), Word(item, "why")});
  }
  for (const Json& caveat : Part(json, "caveats")) result->caveats.push_back(Word(caveat, "text"));
  const Json versions = Part(json, "versions");
  for (const auto& [name, version] : versions.items()) {
    if (version.is_string()) result->versions[name] = version;
  }
  return words;
}

// The same from text; nothing if it is no summary.
SummaryText ReadSummary(const std::string& text, CaseResult* result) {
  const Json json = ParseIfJson<Json>(text);
  if (!json.is_object()) return {};
  try {
    return ReadSummaryJson(json, result);
  } catch (const Json::exception&) {
    return {};
  }
}

// The line that tells what went wrong: the last one with "error:", else the last one.
std::string TellingLine(const std::string& output) {
  const std::string tail = LastLines(output, kSearchedLines);
  const size_t error = tail.rfind("error:");
  const size_t at = error == std::string::npos ? tail.size() : error;
  const size_t newline = tail.rfind('\n', at == 0 ? 0 : at - 1);
  const size_t begin = newline == std::string::npos ? 0 : newline + 1;
  return tail.substr(begin, tail.find('\n', begin) - begin);
}

// What is not as expected, "" if nothing; `text` must have what the file says is mentioned.
std::string Offence(const CaseResult& result, const std::string& text) {
  const Expectation& expected = result.expected;
  if (result.exit_code != expected.exit_code) {
    return fmt::format("exit code {}, expected {}", result.exit_code, expected.exit_code);
  }
  if (result.verdict != expected.verdict) {
    return fmt::format("verdict {}, expected {}", result.verdict, expected.verdict);
  }
  if (WithoutControls(text).find(expected.mentions) == std::string::npos) {
    return fmt::format("the result does not mention '{}'", expected.mentions);
  }
  return "";
}

CaseStatus StatusOf(const CaseResult& result) {
  if (result.exit_code == result.expected.exit_code) return CaseStatus::kUnexpected;
  if (result.exit_code == 2) return CaseStatus::kBadInput;
  if (result.exit_code == 3) return CaseStatus::kCouldNotRun;
  return CaseStatus::kUnexpected;
}

// Ends that no `expect:` can ask for; false if the worker ended properly.
bool EndedBadly(const WorkerEnd& end, double timeout_s, const std::string& output,
                CaseResult* result) {
  const auto is = [&](CaseStatus status, std::string reason) {
    result->status = status;
    result->reason = std::move(reason);
    return true;
  };
  if (end.timed_out) {
    return is(CaseStatus::kTimedOut, fmt::format("no end after {:g} s: killed", timeout_s));
  }
  if (end.signal != 0) {
    return is(CaseStatus::kCrashed,
              fmt::format("killed by signal {} ({})", end.signal, strsignal(end.signal)));
  }
  if (!end.trouble.empty()) {
    return is(CaseStatus::kCrashed, end.trouble + ": " + TellingLine(output));
  }
  if (end.exit_code < 0 || end.exit_code > 3) {
    return is(CaseStatus::kInternalError,
              fmt::format("exit code {}: {}", end.exit_code, TellingLine(output)));
  }
  return false;
}

}  // namespace

CaseResult JudgeCase(const CaseFile& file, const WorkerEnd& end, double timeout_s,
                     const std::string& output, const std::optional<std::string>& summary) {
  CaseResult result;
  result.key = file.key;
  result.file = file.file;
  result.description = file.head.description;
  result.expected = file.head.expect;
  result.inputs = file.inputs;
  result.exit_code = end.exit_code;
  result.signal = end.signal;
  result.cost = end.cost;
  const SummaryText words = summary ? ReadSummary(*summary, &result) : SummaryText{};
  std::string reason = words.reason;
  if (!EndedBadly(end, timeout_s, output, &result)) {
    const std::string offence = Offence(result, output + words.culprits);
    if (reason.empty()) reason = TellingLine(output);
    if (!summary && end.exit_code == 3) {
      // Results that could not be written are never what was expected.
      result.status = CaseStatus::kCouldNotRun;
      result.reason = (offence.empty() ? "no results" : offence) + ": " + reason;
    } else if (!summary && end.exit_code != 2) {
      result.status = CaseStatus::kInternalError;
      result.reason = fmt::format("exit code {} but no summary.json", end.exit_code);
    } else if (offence.empty()) {
      result.status = CaseStatus::kAsExpected;
      result.reason = reason;
      result.verified = result.verdict == "agree" && words.judged;
    } else {
      result.status = StatusOf(result);
      result.reason = offence + (reason.empty() ? "" : ": " + reason);
    }
  }
  if (!result.ran && result.not_compared.empty()) {
    result.not_compared.push_back({"everything", result.reason});
  }
  if (result.failed()) result.log_tail = LastLines(output, kTailLines);
  return result;
}

void AddInputs(const std::string& inputs, CaseResult* result) {
  const Json json = ParseIfJson<Json>(inputs);
  if (!json.is_object()) return;
  Fingerprint fingerprint;
  for (const Json& input : Part(json, "inputs")) {
    if (!input.is_object()) continue;
    result->input_files.push_back({Word(input, "file"), Word(input, "fingerprint")});
    fingerprint.Add(std::filesystem::path(result->input_files.back().file).filename().string());
    fingerprint.Add(result->input_files.back().fingerprint);
  }
  if (!result->input_files.empty()) result->inputs = fingerprint.Text();
}

}  // namespace mbv
