#include <fmt/format.h>
#include <tinyxml2.h>

#include <map>
#include <vector>

#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {
namespace {

constexpr size_t kChecksOfATest = 20;  // named in a failure's text

// "stabilizing_platform/must_fail/stroke" → suite and test.
std::pair<std::string, std::string> SplitKey(const std::string& key) {
  const size_t slash = key.find('/');
  if (slash == std::string::npos) return {"scenarios", key};
  return {key.substr(0, slash), key.substr(slash + 1)};
}

bool IsError(CaseStatus status) {
  return status != CaseStatus::kUnexpected && status != CaseStatus::kAsExpected;
}

std::string SecondsText(double time_s) { return fmt::format("{:.3f}", time_s); }

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
};

struct Suite {
  Totals totals;
  std::vector<const CaseResult*> cases;
  std::vector<const MissingCase*> missing;
};

std::string OutputOf(const CaseResult& result) {
  std::string text =
      fmt::format("{}\nverdict {}, exit code {} (expected {}, {})\n", result.file, result.verdict,
                  result.exit_code, result.expected.verdict, result.expected.exit_code);
  if (const std::string key = KeyText(result); !key.empty()) {
    text += KeyTitle(result) + ": " + key + "\n";
  }
  if (!result.drifts.empty()) text += "drift: " + DriftLine(result) + "\n";
  for (const std::string& caveat : result.caveats) text += "caveat: " + caveat + "\n";
  for (const Unmeasured& item : result.not_compared) {
    text += fmt::format("not compared: {}: {}\n", item.what, item.why);
  }
  text += fmt::format("cost: {:.2f} s wall, {:.2f} s CPU, {:.1f} MiB\n", result.cost.wall_s,
                      result.cost.cpu_s, result.cost.peak_mib());
  return text;
}

class JUnitWriter {
 public:
  explicit JUnitWriter(const RegressReport& report) : report_(report) {
    for (const CaseResult& result : report.cases) {
      Suite& suite = suites_[SplitKey(result.key).first];
      suite.cases.push_back(&result);
      suite.totals.Add(result);
      all_.Add(result);
    }
    for (const MissingCase& missing : report.missing) {
      Suite& suite = suites_[SplitKey(missing.key).first];
      suite.missing.push_back(&missing);
      suite.totals.AddMissing(report.fail_on_missing);
      all_.AddMissing(report.fail_on_missing);
    }
  }

  std::string Write() {
    printer_.PushDeclaration("xml version=\"1.0\" encoding=\"UTF-8\"");
    printer_.OpenElement("testsuites");
    Set("name", kJUnitName);
    SetTotals(all_);
    for (const auto& [name, suite] : suites_) WriteSuite(name, suite);
    printer_.CloseElement();
    return printer_.CStr();
  }

 private:
  void Set(const char* attribute, const std::string& text) {
    printer_.PushAttribute(attribute, XmlText(text).c_str());
  }

  void SetTotals(const Totals& totals) {
    printer_.PushAttribute("tests", totals.tests);
    printer_.PushAttribute("failures", totals.failures);
    printer_.PushAttribute("errors", totals.errors);
    Set("time", SecondsText(totals.time_s));
  }

  void WriteSuite(const std::string& name, const Suite& suite) {
    std::string timestamp = report_.run.started_utc;  // ISO 8601 without zone, as the schema asks
    if (timestamp.ends_with('Z')) timestamp.pop_back();
    printer_.OpenElement("testsuite");
    Set("name", name);
    SetTotals(suite.totals);
    Set("timestamp", timestamp);
    Set("hostname", report_.run.host);
    for (const CaseResult* result : suite.cases) WriteCase(*result);
    for (const MissingCase* missing : suite.missing) WriteMissing(*missing);
    printer_.CloseElement();
  }

  void OpenTest(const std::string& key, double time_s) {
    const auto [suite, test] = SplitKey(key);
    printer_.OpenElement("testcase");
    Set("name", test);
    Set("classname", suite);
    Set("time", SecondsText(time_s));
  }

  void WriteCase(const CaseResult& result) {
    OpenTest(result.key, result.cost.wall_s);
    if (result.failed()) {
      std::string body = result.reason + "\n";
      for (const std::string& line : FailureTexts(result, kChecksOfATest)) body += line + "\n";
      printer_.OpenElement(IsError(result.status) ? "error" : "failure");
      Set("message", FailureLine(result));
      Set("type", ToText(result.status));
      printer_.PushText(XmlText(body + result.log_tail).c_str());
      printer_.CloseElement();
    }
    printer_.OpenElement("system-out");
    printer_.PushText(XmlText(OutputOf(result)).c_str());
    printer_.CloseElement();
    printer_.CloseElement();
  }

  // Skipped, or a failure if the run was asked to fail then.
  void WriteMissing(const MissingCase& missing) {
    OpenTest(missing.key, 0.0);
    printer_.OpenElement(report_.fail_on_missing ? "failure" : "skipped");
    Set("message", MissingText(missing));
    Set("type", "missing");
    printer_.CloseElement();
    printer_.CloseElement();
  }

  const RegressReport& report_;
  std::map<std::string, Suite> suites_;
  Totals all_;
  tinyxml2::XMLPrinter printer_;
};

}  // namespace

std::string ToJUnit(const RegressReport& report) { return JUnitWriter(report).Write(); }

}  // namespace mbv
