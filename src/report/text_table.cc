#include "report/text_table.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>

#include "base/text.h"
#include "report/page.h"

namespace mbv {
namespace {

// A row stays one line, whatever its cells hold; cells may be painted.
std::string Padded(std::string text, int width) {
  std::ranges::replace_if(
      text, [](char c) { return c == '\n' || c == '\r' || c == '\t'; }, ' ');
  return width < 0 ? fmt::format("{:<{}}", text, -width) : fmt::format("{:>{}}", text, width);
}

}  // namespace

TextTable::TextTable(std::string indent, std::vector<TextColumn> columns)
    : indent_(std::move(indent)), columns_(std::move(columns)) {}

std::string TextTable::Head() const {
  std::string line = indent_;
  for (const TextColumn& column : columns_) line += Padded(column.heading, column.width);
  return line;
}

std::string TextTable::Row(const std::vector<std::string>& cells) const {
  std::string line = indent_;
  for (size_t i = 0; i < std::min(cells.size(), columns_.size()); ++i) {
    line += Padded(cells[i], columns_[i].width);
  }
  return line;
}

namespace {

std::string ExponentOrOff(const std::optional<double>& limit) {
  return limit ? fmt::format("{:.1e}", *limit) : "off";
}

}  // namespace

std::string TerminalText::Painted(const std::string& text, Paint paint) const {
  if (!options_.color || paint == Paint::kPlain) return text;
  static constexpr const char* kCodes[] = {"0", "1;32", "1;31", "1;33", "1", "2"};
  return fmt::format("\x1b[{}m{}\x1b[0m", kCodes[static_cast<int>(paint)], text);
}

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

void TerminalText::Checks(const ResultView& view) {
  if (view.checks.empty()) return;
  int width = 28;  // and as much as the longest title needs
  for (const ShownCheck& check : view.checks) {
    width = std::max(width, static_cast<int>(PrintedWidth(check.title)) + 2);
  }
  const TextTable table(
      "  ", {{"check", -width}, {"value", 12}, {"limit", 11}, {"         worst at", 0}});
  TableHead(table);
  for (size_t first = 0; first < view.checks.size();) {
    size_t last = first;
    while (last < view.checks.size() && view.checks[last].subject == view.checks[first].subject) {
      ++last;
    }
    const auto begin = view.checks.begin();
    Subject({begin + static_cast<std::ptrdiff_t>(first), begin + static_cast<std::ptrdiff_t>(last)},
            table);
    first = last;
  }
}

void TerminalText::Subject(const std::vector<ShownCheck>& checks, const TextTable& table) {
  Line("  " + Spaced(checks.front().subject));
  size_t folded = 0;
  for (const ShownCheck& check : checks) {
    const CheckEnd end = EndOf(check);
    const bool passed = end == CheckEnd::kOk || end == CheckEnd::kHeld;
    if (!options_.verbose && passed && !check.key) {
      ++folded;
    } else {
      Line(CheckLine(check, table));
    }
  }
  if (folded > 0) {
    Line(Painted(fmt::format("    {} {}within limits", folded,
                             folded == checks.size() ? "checks " : "more "),
                 Paint::kFaint));
  }
}

std::string TerminalText::CheckLine(const ShownCheck& check, const TextTable& table) const {
  static constexpr std::pair<const char*, Paint> kWords[] = {{"-   ", Paint::kFaint},
                                                             {"FAIL", Paint::kBad},
                                                             {"void", Paint::kWarning},
                                                             {"held", Paint::kFaint},
                                                             {"ok  ", Paint::kGood}};
  const auto& [word, paint] = kWords[static_cast<int>(EndOf(check))];
  std::string line =
      table.Row({"  " + check.title, fmt::format("{:.2e}", check.value), ExponentOrOff(check.limit),
                 fmt::format("   {}  {}", Painted(word, paint), WhereOf(check))});
  if (check.floored) line += " (floored)";
  if (!check.blind.empty()) line += " (" + check.blind + ")";
  if (check.stated_limit) {
    line += fmt::format(" (limit by {}, stated {:.1e})", check.limit_by, *check.stated_limit);
  }
  while (line.back() == ' ') line.pop_back();
  return line;
}

void TerminalText::Gaps(const ResultView& view) {
  if (view.not_compared.empty()) return;
  Line();
  Line("  not compared");
  for (const NotCompared& item : view.not_compared) {
    Line(fmt::format("    {}: {}", item.what, item.why));
  }
}

void TerminalText::Add(const std::vector<Block>& blocks) {
  for (const Block& block : blocks) {
    if (!block.folded.empty()) continue;
    if (!block.text.empty()) {
      Line();
      Line("  " + block.text);
    }
    const Table& table = block.table;
    if (table.rows.empty()) continue;
    std::vector<TextColumn> columns;
    for (size_t i = 0; i < table.head.size(); ++i) {
      size_t width = PrintedWidth(table.head[i].text);
      for (const auto& row : table.rows) width = std::max(width, PrintedWidth(row[i].text));
      const bool last = i + 1 == table.head.size(), left = !table.head[i].number;
      const int padded = static_cast<int>(width) + 2;
      columns.push_back({"  " + table.head[i].text, left ? (last ? 0 : -padded) : padded});
    }
    const TextTable text("", columns);
    Line();
    Line("  " + table.caption);
    Line(Painted(text.Head(), Paint::kFaint));
    for (const auto& row : table.rows) {
      std::vector<std::string> cells;
      for (const Cell& cell : row) cells.push_back("  " + cell.text);
      Line(text.Row(cells));
    }
  }
}

void TerminalText::TableHead(const TextTable& table) {
  Line();
  Line(Painted(table.Head(), Paint::kFaint));
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
