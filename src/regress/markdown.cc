#include <fmt/format.h>

#include "regress/summaries.h"

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

std::string Row(const CaseResult& result) {
  return fmt::format("| {} | {}{} | {} | {:.1f} | {:.1f} | {:.0f} |\n", Plain(result.key),
                     result.failed()         ? "❌ "
                     : result.drifts.empty() ? ""
                                             : "⚠️ ",
                     Plain(WordOf(result)), Plain(KeyText(result)), result.cost.wall_s,
                     result.cost.cpu_s, static_cast<double>(result.cost.peak_kib) / 1024.0);
}

std::string Failed(const RegressReport& report) {
  std::string text;
  for (const CaseResult& result : report.cases) {
    if (!result.failed()) continue;
    text += fmt::format("* **{}**: {}: {}\n", Plain(result.key), Plain(WordOf(result)),
                        Plain(result.reason));
  }
  return text.empty() ? "" : "\n### Not as expected\n\n" + text;
}

std::string Drifted(const RegressReport& report) {
  std::string text;
  for (const CaseResult& result : report.cases) {
    for (const Drift& drift : result.drifts) {
      text += fmt::format("* **{}**: {}", Plain(result.key), Plain(drift.text));
      if (!drift.since.empty()) text += fmt::format("; since {}", Plain(drift.since));
      text += "\n";
    }
  }
  return text.empty() ? "" : "\n### Drift\n\n" + text;
}

std::string NotCompared(const RegressReport& report) {
  std::string text;
  for (const CaseResult& result : report.cases) {
    if (result.compared || result.not_compared.empty()) continue;
    const Unmeasured& first = result.not_compared.front();
    text += fmt::format("* {}: {}: {}\n", Plain(result.key), Plain(first.what), Plain(first.why));
  }
  if (text.empty()) return "";
  return "\n<details><summary>Not compared, and why</summary>\n\n" + text + "\n</details>\n";
}

}  // namespace

std::string ToMarkdown(const RegressReport& report) {
  const bool good = ExitCodeOf(report) == 0;
  std::string text =
      fmt::format("## mbverify regression: {}\n\n{}.\n\n",
                  good ? "all as expected" : "❌ not as expected", CountsText(CountCases(report)));
  text += fmt::format(
      "Started {}, {:.1f} s with {} worker{}; {}{}{}{}.\n", report.run.started_utc,
      report.run.wall_s, report.run.jobs, report.run.jobs == 1 ? "" : "s",
      Plain(report.run.program), report.run.label.empty() ? "" : ", " + Plain(report.run.label),
      report.run.shard.empty() ? "" : ", shard " + report.run.shard,
      report.run.id == 0 ? "" : fmt::format(", run {} of the history", report.run.id));
  text += Failed(report) + Drifted(report);
  for (const std::string& note : report.notes) text += "\nNote: " + Plain(note) + "\n";
  text += NotCompared(report);
  text +=
      "\n<details><summary>All scenarios</summary>\n\n"
      "| scenario | result | drive force error, RMS (or stiffness) | wall [s] | CPU [s] | memory "
      "[MiB] |\n"
      "|---|---|---|---:|---:|---:|\n";
  for (const CaseResult& result : report.cases) text += Row(result);
  return text + "\n</details>\n";
}

}  // namespace mbv
