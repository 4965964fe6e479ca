#include "features/regress/summaries.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <algorithm>
#include <array>
#include <map>
#include <string_view>
#include <vector>

#include "base/markup.h"
#include "base/text.h"
#include "features/regress/trouble_text.h"

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

namespace {

// Job pages take 1 MiB in all (GitHub's limit of a step's summary): every part has its share.
constexpr size_t kFailedBytes = 400'000, kDriftBytes = 130'000, kMissingBytes = 60'000,
                 kCaveatBytes = 30'000, kNoteBytes = 30'000, kGapBytes = 90'000,
                 kTableBytes = 240'000;
constexpr size_t kLineBytes = 2'000;

// Lines up to a number of bytes; then how many are left out.
class Lines {
 public:
  Lines(size_t most, std::string rest) : most_(most), rest_(std::move(rest)) {}

  void Add(std::string line) {
    if (line.size() > kLineBytes) {
      size_t end = kLineBytes;
      while ((static_cast<unsigned char>(line[end]) & 0xC0) == 0x80) --end;  // whole characters
      line = line.substr(0, end) + " …\n";
    }
    if (left_out_ > 0 || text_.size() + line.size() > most_) {
      ++left_out_;
    } else {
      text_ += line;
    }
  }

  [[nodiscard]] std::string Text() const {
    if (left_out_ == 0) return text_;
    return text_ + fmt::format(fmt::runtime(rest_), left_out_);
  }

 private:
  size_t most_, left_out_ = 0;
  std::string rest_, text_;
};

constexpr size_t kChecksOfALine = 3;

constexpr const char* kMore = "* … and {} more: see index.html\n";

std::string Row(const CaseResult& result) {
  return fmt::format("| {} | {}{} | {} | {:.1f} | {:.1f} | {:.0f} |\n", MarkdownText(result.key),
                     result.failed()         ? "❌ "
                     : result.drifts.empty() ? ""
                                             : "⚠️ ",
                     MarkdownText(WordOf(result)), MarkdownText(KeyText(result)),
                     result.cost.wall_s, result.cost.cpu_s, result.cost.peak_mib());
}

std::string Failed(const RegressReport& report) {
  Lines lines(kFailedBytes, kMore);
  for (const CaseResult* result : BySeverity(report)) {
    if (!result->failed()) continue;
    std::string item = fmt::format("* **{}**: {}: {}\n", MarkdownText(result->key),
                                   MarkdownText(WordOf(*result)), MarkdownText(result->reason));
    for (const std::string& text : FailureTexts(*result, kChecksOfALine)) {
      item += "  * " + MarkdownText(text) + "\n";
    }
    lines.Add(item);
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Not as expected\n\n" + text;
}

std::string Drifted(const RegressReport& report) {
  Lines lines(kDriftBytes, kMore);
  for (const CaseResult* result : BySeverity(report)) {
    if (result->drifts.empty()) continue;
    lines.Add(
        fmt::format("* **{}**: {}\n", MarkdownText(result->key), MarkdownText(DriftLine(*result))));
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Drift\n\n" + text;
}

std::string Missing(const RegressReport& report) {
  Lines lines(kMissingBytes, kMore);
  for (const MissingCase& missing : report.missing) {
    lines.Add(fmt::format("* {}**{}**: {}\n", report.fail_on_missing ? "❌ " : "",
                          MarkdownText(missing.key), MarkdownText(MissingText(missing))));
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Missing\n\n" + text;
}

std::string Caveats(const RegressReport& report) {
  Lines lines(kCaveatBytes, kMore);
  for (const CaseResult& result : report.cases) {
    for (const std::string& caveat : result.caveats) {
      lines.Add(fmt::format("* **{}**: {}\n", MarkdownText(result.key), MarkdownText(caveat)));
    }
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Caveats\n\n" + text;
}

std::string NotComparedText(const RegressReport& report) {
  Lines lines(kGapBytes, kMore);
  for (const CaseResult& result : report.cases) {
    if (result.compared || result.not_compared.empty()) continue;
    const Unmeasured& first = result.not_compared.front();
    lines.Add(fmt::format("* {}: {}: {}\n", MarkdownText(result.key), MarkdownText(first.what),
                          MarkdownText(first.why)));
  }
  const std::string text = lines.Text();
  if (text.empty()) return "";
  return "\n<details><summary>Not compared, and why</summary>\n\n" + text + "\n</details>\n";
}

}  // namespace

std::string ToMarkdown(const RegressReport& report) {
  const bool good = ExitCodeOf(report) == 0;
  std::string text =
      fmt::format("{}: {}\n\n{}.\n\n", kMarkdownTitle,
                  good ? "all as expected" : "❌ not as expected", CountsText(CountCases(report)));
  text +=
      fmt::format("Started {}, {:.1f} s with {} worker{}; {}{}{}{}.\n",
                  MarkdownText(report.run.started_utc), report.run.wall_s, report.run.jobs,
                  report.run.jobs == 1 ? "" : "s", MarkdownText(report.run.program),
                  report.run.label.empty() ? "" : ", " + MarkdownText(report.run.label),
                  report.run.shard.empty() ? "" : ", shard " + MarkdownText(report.run.shard),
                  report.run.id == 0 ? "" : fmt::format(", run {} of the history", report.run.id));
  text += Failed(report) + Missing(report) + Drifted(report) + Caveats(report);
  Lines notes(kNoteBytes, "\nNote: and {} more\n");
  for (const std::string& note : report.notes) notes.Add("\nNote: " + MarkdownText(note) + "\n");
  text += notes.Text() + NotComparedText(report);
  text +=
      "\n<details><summary>All scenarios</summary>\n\n"
      "| scenario | result | drive force error, RMS (or stiffness) | wall [s] | CPU [s] | memory "
      "[MiB] |\n"
      "|---|---|---|---:|---:|---:|\n";
  Lines rows(kTableBytes, "| … and {} more: see index.html | | | | | |\n");
  for (const CaseResult& result : report.cases) rows.Add(Row(result));
  return text + rows.Text() + "\n</details>\n";
}

// What all summaries share, and the one for terminals.

namespace {

constexpr size_t kChecksOnTerminal = 3;

struct KeyWords {
  std::string_view ending, title, prefix;  // of the metric's name; of the text
};

const KeyWords& WordsOf(const std::string& metric) {
  static constexpr std::array<KeyWords, 4> kWords = {
      {{".force_nrmse", "drive force error, RMS", ""},
       {".stiffness_entry", "stiffness error, worst entry", "stiffness, "},
       {".pose_m", "error of an output's place, largest [m]", "output's place [m], "},
       {".velocity_nrmse", "velocity error, RMS", "velocity, "}}};
  return *std::ranges::find_if(
      kWords, [&](const KeyWords& words) { return metric.ends_with(words.ending); });
}

}  // namespace

std::string CountsText(const Counts& counts) {
  std::string text = fmt::format("{} scenario{}: {} as expected", counts.total,
                                 counts.total == 1 ? "" : "s", counts.as_expected);
  if (counts.must_fail > 0) text += fmt::format(" ({} of them must fail)", counts.must_fail);
  text += fmt::format(", {} ran, {} compared, {} verified", counts.ran, counts.compared,
                      counts.verified);
  if (counts.drifted > 0) text += fmt::format(", {} drifted", counts.drifted);
  if (counts.missing > 0) text += fmt::format(", {} missing", counts.missing);
  return text;
}

std::string WordOf(const CaseResult& result) {
  if (result.failed()) {
    std::string word = ToText(result.status);
    std::replace(word.begin(), word.end(), '_', ' ');
    return word;
  }
  if (!result.drifts.empty()) return "drift";
  if (result.verified) return "agree";
  // A study that asks nothing of its points is neither.
  return result.expected.verdict == "agree" ? "computed" : "fails as it must";
}

std::string KeyTitle(const CaseResult& result) {
  const auto* key = KeyMetric(result);
  if (key == nullptr) return "";
  return std::string(WordsOf(key->first).title);
}

std::string KeyText(const CaseResult& result) {
  const auto* key = KeyMetric(result);
  if (key == nullptr) return "";
  std::string pair = key->first.substr(0, key->first.find('.'));
  std::replace(pair.begin(), pair.end(), '_', ' ');
  std::string text = fmt::format("{:.1e}", key->second.value);
  if (key->second.limit) text += fmt::format(" of {:.1e}", *key->second.limit);
  return text + fmt::format(" ({}{})", WordsOf(key->first).prefix, pair);
}

std::string ToSummaryText(const RegressReport& report) {
  std::string text;
  const std::vector<const CaseResult*> cases = BySeverity(report);
  for (const CaseResult* result : cases) {
    if (!result->failed()) continue;
    text += fmt::format("{}: {}\n    {}\n", OneLine(result->key), WordOf(*result),
                        OneLine(result->reason));
    for (const std::string& line : FailureTexts(*result, kChecksOnTerminal)) {
      text += "    " + OneLine(line) + "\n";
    }
  }
  for (const MissingCase& missing : report.missing) {
    text +=
        fmt::format("{}: missing\n    {}\n", OneLine(missing.key), OneLine(MissingText(missing)));
  }
  for (const CaseResult* result : cases) {
    if (result->drifts.empty()) continue;
    text += fmt::format("{}: drift\n    {}\n", OneLine(result->key), OneLine(DriftLine(*result)));
  }
  for (const std::string& note : report.notes) text += "note: " + OneLine(note) + "\n";
  double peak_mib = 0.0, cpu_s = 0.0;
  for (const CaseResult& result : report.cases) {
    peak_mib = std::max(peak_mib, result.cost.peak_mib());
    cpu_s += result.cost.cpu_s;
  }
  text += CountsText(CountCases(report)) + "\n";
  text += fmt::format("{:.1f} s wall with {} worker{}, {:.1f} s CPU, largest worker {:.0f} MiB\n",
                      report.run.wall_s, report.run.jobs, report.run.jobs == 1 ? "" : "s", cpu_s,
                      peak_mib);
  return text;
}

}  // namespace mbv
