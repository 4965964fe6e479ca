// What all summaries share, and the one for terminals.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>

#include "core/markup.h"
#include "core/text.h"
#include "regress/summaries.h"
#include "regress/trouble_text.h"

namespace mbv {
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

std::string XmlText(std::string_view text) {
  std::string kept;
  size_t from = 0;
  for (size_t bad = FindNonText(text); bad < text.size(); bad = FindNonText(text, from)) {
    kept += text.substr(from, bad - from);
    from = bad + 1;
  }
  kept += text.substr(from);
  std::erase(kept, '\r');
  return kept;
}

std::string EscapeXml(std::string_view text) { return EscapeMarkup(XmlText(text)); }

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
    text += fmt::format("{}: {}\n    {}\n", result->key, WordOf(*result), result->reason);
    for (const std::string& line : FailureTexts(*result, kChecksOnTerminal)) {
      text += "    " + line + "\n";
    }
  }
  for (const MissingCase& missing : report.missing) {
    text += fmt::format("{}: missing\n    {}\n", missing.key, MissingText(missing));
  }
  for (const CaseResult* result : cases) {
    if (result->drifts.empty()) continue;
    text += fmt::format("{}: drift\n    {}\n", result->key, DriftLine(*result));
  }
  for (const std::string& note : report.notes) text += "note: " + note + "\n";
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
