#include "report/terminal_text.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "report/page.h"

namespace mbv {
namespace {

std::string ExponentOrOff(const std::optional<double>& limit) {
  return limit ? fmt::format("{:.1e}", *limit) : "off";
}

}  // namespace

std::string TerminalText::Word(Verdict verdict) const {
  switch (verdict) {
    case Verdict::kAgree:
      return Painted("AGREE", Paint::kGood);
    case Verdict::kDisagree:
      return Painted("DISAGREE", Paint::kBad);
    case Verdict::kNotRun:
      return Painted("NOT RUN", Paint::kWarning);
  }
  return "?";
}

void TerminalText::Head(const ResultView& view, const std::string& title,
                        const std::vector<std::string>& about) {
  Line(fmt::format("{}: {}", Painted(title, Paint::kTitle), Word(view.verdict)));
  if (!view.frame->description.empty()) Line("  " + view.frame->description);
  for (const std::string& line : about) {
    if (!line.empty()) Line("  " + line);
  }
  Line("  " + view.reason);
  for (const Caveat& caveat : view.caveats) {
    Line("  " + Painted("caveat", Paint::kWarning) + ": " + caveat.text);
  }
  if (!view.attribution.text.empty()) Line("  " + view.attribution.text);
  for (const Finding& finding : view.frame->findings.findings()) Line("  " + ToText(finding));
}

bool TerminalText::Shown(const ShownCheck& check) const {
  const CheckEnd end = EndOf(check);
  return options_.verbose || check.key ||
         (end != CheckEnd::kOk && end != CheckEnd::kByConstruction);
}

namespace {

std::string AboutText(const ShownCheck& check) {
  std::string text = WhereOf(check);
  if (check.floored) text += " (floored)";
  if (!check.insensitive.empty()) text += " (" + check.insensitive + ")";
  if (check.stated_limit) {
    text += fmt::format(" (limit by {}, stated {:.1e})", check.limit_by, *check.stated_limit);
  }
  return text;
}

}  // namespace

void TerminalText::Checks(const ResultView& view) {
  if (view.checks.empty()) return;
  Table table{.columns = {Text("check"), Digits("value"), Spare(Digits("limit")), Text(""),
                          Text("worst at")}};
  for (const ShownCheck& check : view.checks) {
    if (!Shown(check)) continue;
    table.rows.push_back({"  " + check.title, fmt::format("{:.2e}", check.value),
                          ExponentOrOff(check.limit), EndCell(check), AboutText(check)});
  }
  const std::vector<std::string> lines = TextLines(table, Style());
  Line();
  Line(lines[0]);
  size_t next = 1;  // line
  for (size_t first = 0; first < view.checks.size();) {
    const std::string& subject = view.checks[first].subject;
    Line("  " + Spaced(subject));
    size_t folded = 0, last = first;
    for (; last < view.checks.size() && view.checks[last].subject == subject; ++last) {
      if (Shown(view.checks[last])) {
        Line(lines[next++]);
      } else {
        ++folded;
      }
    }
    if (folded > 0) {
      Line(Painted(fmt::format("    {} {}within limits", folded,
                               folded == last - first ? "checks " : "more "),
                   Paint::kFaint));
    }
    first = last;
  }
}

void TerminalText::Gaps(const ResultView& view) {
  if (view.not_compared.empty()) return;
  Line();
  Line("  not compared");
  for (const NotCompared& item : view.not_compared) {
    Line(fmt::format("    {}: {}", item.what, item.why));
  }
}

void TerminalText::Times(const std::vector<std::pair<const char*, double>>& parts, double total_s,
                         const std::string& more) {
  Line();
  std::string line = "  time:";
  for (const auto& [what, seconds] : parts) line += fmt::format(" {} {:.3f} s,", what, seconds);
  Line(line + fmt::format(" all {:.3f} s", total_s) + more);
}

namespace {

// The failed check farthest beyond its limit; null without one.
const ShownCheck* WorstFailed(const ResultView& view) {
  const ShownCheck* worst = nullptr;
  const auto use = [](const ShownCheck& check) {
    return std::isnan(check.value) ? HUGE_VAL : check.value / *check.limit;
  };
  for (const ShownCheck& check : view.checks) {
    if (!check.limit || check.pass) continue;
    if (worst == nullptr || use(check) > use(*worst)) worst = &check;
  }
  return worst;
}

}  // namespace

std::string VerdictLine(const ResultView& view, const TableOptions& options) {
  std::string line =
      fmt::format("{}: {}", view.frame->title(), TerminalText(options).Word(view.verdict));
  const ShownCheck* check = view.FindCheck(view.main_check);
  std::string about = view.main_pair;
  // A number that passes says nothing of a disagreement.
  const bool passes = check == nullptr || !check->limit || check->pass;
  if (view.verdict == Verdict::kDisagree && passes) {
    check = WorstFailed(view);
    if (check != nullptr) about = check->name;
  }
  if (check != nullptr && view.verdict != Verdict::kNotRun) {
    line += fmt::format("  {} {:.1e}", about, check->value);
    if (check->limit) line += fmt::format(" (limit {:.1e})", *check->limit);
  }
  if (check != nullptr && check->floored) line += " floored";
  if (view.verdict != Verdict::kAgree) line += "  " + view.reason;
  for (const Caveat& caveat : view.caveats) {
    line += "; caveat: " + caveat.text;
  }
  std::ranges::replace(line, '\n', ' ');
  return line + "\n";
}

}  // namespace mbv
