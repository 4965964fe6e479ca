#include <fmt/format.h>

#include <map>

#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {
namespace {

// "stabilizing_platform/must_fail/stroke" → suite and test.
std::pair<std::string, std::string> SplitKey(const std::string& key) {
  const size_t slash = key.find('/');
  if (slash == std::string::npos) return {"scenarios", key};
  return {key.substr(0, slash), key.substr(slash + 1)};
}

bool IsError(CaseStatus status) {
  return status != CaseStatus::kUnexpected && status != CaseStatus::kAsExpected;
}

constexpr size_t kChecksOfATest = 20;  // named in a failure's text

struct Totals {
  int tests = 0, failures = 0, errors = 0;
  double time_s = 0.0;

  void Add(const CaseResult& result) {
    ++tests;
    failures += result.status == CaseStatus::kUnexpected ? 1 : 0;
    errors += IsError(result.status) ? 1 : 0;
    time_s += result.cost.wall_s;
  }
  void AddMissing(bool fails) {
    ++tests;
    failures += fails ? 1 : 0;
  }
  [[nodiscard]] std::string Attributes() const {
    return fmt::format("tests=\"{}\" failures=\"{}\" errors=\"{}\" time=\"{:.3f}\"", tests,
                       failures, errors, time_s);
  }
};

std::string OutputOf(const CaseResult& result) {
  std::string text =
      fmt::format("{}\nverdict {}, exit code {} (expected {}, {})\n", result.file, result.verdict,
                  result.exit_code, result.expected.verdict, result.expected.exit_code);
  if (const std::string key = KeyText(result); !key.empty()) {
    text += KeyTitle(result) + ": " + key + "\n";
  }
  if (!result.drifts.empty()) text += "drift: " + DriftLine(result) + "\n";
  for (const Unmeasured& item : result.not_compared) {
    text += fmt::format("not compared: {}: {}\n", item.what, item.why);
  }
  text += fmt::format("cost: {:.2f} s wall, {:.2f} s CPU, {:.1f} MiB\n", result.cost.wall_s,
                      result.cost.cpu_s, static_cast<double>(result.cost.peak_kib) / 1024.0);
  return text;
}

std::string TestCase(const CaseResult& result, const std::string& suite, const std::string& test) {
  std::string text = fmt::format("    <testcase name=\"{}\" classname=\"{}\" time=\"{:.3f}\">\n",
                                 EscapeXml(test), EscapeXml(suite), result.cost.wall_s);
  if (result.failed()) {
    const char* element = IsError(result.status) ? "error" : "failure";
    std::string body = result.reason + "\n";
    for (const std::string& line : FailureTexts(result, kChecksOfATest)) body += line + "\n";
    text += fmt::format("      <{0} message=\"{1}\" type=\"{2}\">{3}{4}</{0}>\n", element,
                        EscapeXml(FailureLine(result)), ToText(result.status), EscapeXml(body),
                        EscapeXml(result.log_tail));
  }
  text += fmt::format("      <system-out>{}</system-out>\n", EscapeXml(OutputOf(result)));
  return text + "    </testcase>\n";
}

// Skipped, or a failure if the run was asked to fail then.
std::string MissingTest(const MissingCase& missing, bool fails, const std::string& suite,
                        const std::string& test) {
  const std::string text = EscapeXml(MissingText(missing));
  return fmt::format(
      "    <testcase name=\"{}\" classname=\"{}\" time=\"0.000\">\n      <{} message=\"{}\" "
      "type=\"missing\"/>\n    </testcase>\n",
      EscapeXml(test), EscapeXml(suite), fails ? "failure" : "skipped", text);
}

}  // namespace

std::string ToJUnit(const RegressReport& report) {
  std::map<std::string, std::pair<Totals, std::string>> suites;
  Totals all;
  for (const CaseResult& result : report.cases) {
    const auto [suite, test] = SplitKey(result.key);
    auto& [totals, text] = suites[suite];
    totals.Add(result);
    all.Add(result);
    text += TestCase(result, suite, test);
  }
  for (const MissingCase& missing : report.missing) {
    const auto [suite, test] = SplitKey(missing.key);
    auto& [totals, text] = suites[suite];
    totals.AddMissing(report.fail_on_missing);
    all.AddMissing(report.fail_on_missing);
    text += MissingTest(missing, report.fail_on_missing, suite, test);
  }
  std::string xml = fmt::format("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{} {}>\n", kJUnitRoot,
                                all.Attributes());
  std::string timestamp = report.run.started_utc;  // ISO 8601 without zone, as the schema asks
  if (timestamp.ends_with('Z')) timestamp.pop_back();
  for (const auto& [name, suite] : suites) {
    xml += fmt::format("  <testsuite name=\"{}\" {} timestamp=\"{}\" hostname=\"{}\">\n",
                       EscapeXml(name), suite.first.Attributes(), EscapeXml(timestamp),
                       EscapeXml(report.run.host));
    xml += suite.second + "  </testsuite>\n";
  }
  return xml + "</testsuites>\n";
}

}  // namespace mbv
