#include <fmt/format.h>

#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {
namespace {

// Text for a table cell or a list: no markup, no line ends.
std::string Plain(const std::string& text) {
  std::string plain;
  for (char c : text) {
    if (c == '|' || c == '*' || c == '_' || c == '`' || c == '<' || c == '[' || c == '\\') {
      plain += '\\';
    }
    plain += c == '\n' ? ' ' : c;
  }
  return plain;
}

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
  return fmt::format("| {} | {}{} | {} | {:.1f} | {:.1f} | {:.0f} |\n", Plain(result.key),
                     result.failed()         ? "❌ "
                     : result.drifts.empty() ? ""
                                             : "⚠️ ",
                     Plain(WordOf(result)), Plain(KeyText(result)), result.cost.wall_s,
                     result.cost.cpu_s, result.cost.peak_mib());
}

std::string Failed(const RegressReport& report) {
  Lines lines(kFailedBytes, kMore);
  for (const CaseResult* result : BySeverity(report)) {
    if (!result->failed()) continue;
    std::string item = fmt::format("* **{}**: {}: {}\n", Plain(result->key), Plain(WordOf(*result)),
                                   Plain(result->reason));
    for (const std::string& text : FailureTexts(*result, kChecksOfALine)) {
      item += "  * " + Plain(text) + "\n";
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
    lines.Add(fmt::format("* **{}**: {}\n", Plain(result->key), Plain(DriftLine(*result))));
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Drift\n\n" + text;
}

std::string Missing(const RegressReport& report) {
  Lines lines(kMissingBytes, kMore);
  for (const MissingCase& missing : report.missing) {
    lines.Add(fmt::format("* {}**{}**: {}\n", report.fail_on_missing ? "❌ " : "",
                          Plain(missing.key), Plain(MissingText(missing))));
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Missing\n\n" + text;
}

std::string Caveats(const RegressReport& report) {
  Lines lines(kCaveatBytes, kMore);
  for (const CaseResult& result : report.cases) {
    for (const std::string& caveat : result.caveats) {
      lines.Add(fmt::format("* **{}**: {}\n", Plain(result.key), Plain(caveat)));
    }
  }
  const std::string text = lines.Text();
  return text.empty() ? "" : "\n### Caveats\n\n" + text;
}

std::string NotCompared(const RegressReport& report) {
  Lines lines(kGapBytes, kMore);
  for (const CaseResult& result : report.cases) {
    if (result.compared || result.not_compared.empty()) continue;
    const Unmeasured& first = result.not_compared.front();
    lines.Add(
        fmt::format("* {}: {}: {}\n", Plain(result.key), Plain(first.what), Plain(first.why)));
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
  text += fmt::format(
      "Started {}, {:.1f} s with {} worker{}; {}{}{}{}.\n", report.run.started_utc,
      report.run.wall_s, report.run.jobs, report.run.jobs == 1 ? "" : "s",
      Plain(report.run.program), report.run.label.empty() ? "" : ", " + Plain(report.run.label),
      report.run.shard.empty() ? "" : ", shard " + report.run.shard,
      report.run.id == 0 ? "" : fmt::format(", run {} of the history", report.run.id));
  text += Failed(report) + Missing(report) + Drifted(report) + Caveats(report);
  Lines notes(kNoteBytes, "\nNote: and {} more\n");
  for (const std::string& note : report.notes) notes.Add("\nNote: " + Plain(note) + "\n");
  text += notes.Text() + NotCompared(report);
  text +=
      "\n<details><summary>All scenarios</summary>\n\n"
      "| scenario | result | drive force error, RMS (or stiffness) | wall [s] | CPU [s] | memory "
      "[MiB] |\n"
      "|---|---|---|---:|---:|---:|\n";
  Lines rows(kTableBytes, "| … and {} more: see index.html | | | | | |\n");
  for (const CaseResult& result : report.cases) rows.Add(Row(result));
  return text + rows.Text() + "\n</details>\n";
}

}  // namespace mbv
