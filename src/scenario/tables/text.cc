#include "scenario/tables/text.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace mbv {
namespace {

constexpr size_t kLongestNumber = 60;
constexpr int kDoubleDigits = 17;

bool IsDigit(char c) { return c >= '0' && c <= '9'; }

// "NaN", "-inf", "#N/A", "1.#QNAN", "-nan(ind)".
bool IsNotFinite(std::string_view text) {
  if (!text.empty() && (text[0] == '-' || text[0] == '+')) text.remove_prefix(1);
  if (text.empty() || text.size() > 12) return false;
  if (text[0] == '#' || text.find('#') != std::string_view::npos) return true;
  std::string lower;
  for (const char c : text) lower += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return lower == "nan" || lower == "inf" || lower == "infinity" || lower == "na" ||
         lower == "n/a" || lower == "null" || lower.starts_with("nan(");
}

// Digits of a number that is known to be well-formed.
void CountDigits(std::string_view text, CellNumber* cell) {
  bool behind = false, started = false;
  int behind_count = 0, exponent = 0;
  char last = '1';
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '.') {
      behind = true;
    } else if (c == 'e') {
      const size_t skip = text[i + 1] == '+' ? 2 : 1;
      std::from_chars(text.data() + i + skip, text.data() + text.size(), exponent);
      break;
    } else if (IsDigit(c)) {
      started = started || c != '0';
      cell->significant += started ? 1 : 0;
      behind_count += behind ? 1 : 0;
      last = c;
    }
  }
  cell->decimals = behind_count - exponent;
  cell->trailing_zero = behind && last == '0';
}

}  // namespace

CellNumber ReadCell(std::string_view text, bool decimal_comma) {
  CellNumber cell;
  if (text.empty()) {
    cell.kind = CellNumber::Kind::kEmpty;
    return cell;
  }
  const bool plus = text[0] == '+' && text.size() > 1 && text[1] != '-';
  const std::string_view digits = plus ? text.substr(1) : text;
  std::array<char, kLongestNumber> buffer{};
  if (digits.size() > buffer.size()) return cell;
  for (size_t i = 0; i < digits.size(); ++i) {
    char c = digits[i];
    if (decimal_comma && c == '.') return cell;  // a thousands point
    if (decimal_comma && c == ',') c = '.';
    if (c == 'E' || c == 'D' || c == 'd') c = 'e';
    buffer[i] = c;
  }
  const std::string_view plain(buffer.data(), digits.size());
  const auto [end, error] = std::from_chars(plain.data(), plain.data() + plain.size(), cell.value);
  if (end != plain.data() + plain.size() || error == std::errc::invalid_argument) {
    cell.kind = IsNotFinite(text) ? CellNumber::Kind::kNotFinite : CellNumber::Kind::kText;
    return cell;
  }
  if (error != std::errc() || !std::isfinite(cell.value)) {
    cell.kind = CellNumber::Kind::kNotFinite;
    return cell;
  }
  cell.kind = CellNumber::Kind::kNumber;
  CountDigits(plain, &cell);
  return cell;
}

void DigitStatistics::Add(const CellNumber& cell) {
  // Digits beyond a double's are none; a step of zero stays possible for them.
  decimals_ = count_ == 0 ? cell.decimals : std::max(decimals_, cell.decimals);
  significant_ = std::max(significant_, std::min(cell.significant, kDoubleDigits));
  if (count_ == 1) step_ = cell.value - last_;
  if (count_ >= 2) {
    const double tolerance = 1e-9 * std::abs(step_) + 4e-16 * std::abs(cell.value);
    equal_steps_ = equal_steps_ && std::abs(cell.value - last_ - step_) <= tolerance;
  }
  last_ = cell.value;
  ++count_;
  if (distinct_.size() < kEnoughValues &&
      std::find(distinct_.begin(), distinct_.end(), cell.value) == distinct_.end()) {
    distinct_.push_back(cell.value);
  }
}

std::vector<double> PrintedSteps(std::span<const double> values, const DigitStatistics& digits,
                                 int table_significant) {
  const bool borrow = digits.says_little() && table_significant > digits.significant();
  const int significant = borrow ? table_significant : digits.significant();
  const double fixed = borrow ? 0.0 : std::pow(10.0, -digits.decimals());
  std::vector<double> steps;
  steps.reserve(values.size());
  for (const double value : values) {
    double step = fixed;
    if (value != 0.0 && significant > 0) {
      const double power = std::floor(std::log10(std::abs(value)));
      step = std::max(step, std::pow(10.0, power - significant + 1));
    }
    steps.push_back(step);
  }
  return steps;
}

namespace {

constexpr size_t kLooked = 400;  // lines by which format and heading are found
constexpr std::string_view kCommentSigns = "#%!";

bool IsBlank(char c) { return c == ' ' || c == '\t'; }

std::string_view Trim(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// All lines, and the last comment before the first other line (numpy writes its heading there).
struct Lines {
  std::vector<TableLine> lines;
  TableLine last_comment;
};

Lines CutLines(std::string_view text) {
  Lines result;
  int number = 0;
  for (size_t start = 0; start < text.size();) {
    // LF, CRLF or a lone CR.
    const size_t end = std::min(text.find_first_of("\r\n", start), text.size());
    const TableLine line{text.substr(start, end - start), ++number};
    const std::string_view plain = Trim(line.text);
    if (!plain.empty() && kCommentSigns.find(plain[0]) != std::string_view::npos) {
      const bool heading = plain.size() > 2 && result.lines.empty();
      if (heading) result.last_comment = {plain.substr(1), number};
    } else if (!plain.empty() && plain.find_first_not_of(",;\t ") != std::string_view::npos) {
      result.lines.push_back(line);
    }
    const bool pair = end + 1 < text.size() && text[end] == '\r' && text[end + 1] == '\n';
    start = end + (pair ? 2 : 1);
  }
  return result;
}

// How well a delimiter and a decimal sign explain the lines.
struct Fit {
  double numbers = 0.0;  // share of cells that are numbers, of lines with the usual count
  size_t fields = 0;     // usual count
};

// Cells of a line without the empty ones that a delimiter at its end makes.
size_t CountCells(const CutLine& cut) {
  size_t count = cut.cells.size();
  while (count > 0 && cut.cells[count - 1].text.empty()) --count;
  return count;
}

Fit FitOf(const std::vector<TableLine>& lines, char delimiter, bool decimal_comma) {
  std::vector<std::pair<size_t, size_t>> counts;  // cells, numbers
  CutLine cut;
  const size_t last = std::min(lines.size(), kLooked);
  for (size_t i = last > kLooked / 8 ? last - kLooked / 8 : 0; i < last; ++i) {
    CutCells(lines[i].text, delimiter, &cut);
    size_t numbers = 0;
    for (const TableCell& cell : cut.cells) {
      const auto kind = ReadCell(cell.text, decimal_comma).kind;
      numbers += kind == CellNumber::Kind::kNumber || kind == CellNumber::Kind::kNotFinite ? 1 : 0;
    }
    counts.emplace_back(CountCells(cut), numbers);
  }
  Fit fit;
  for (const auto& [cells, numbers] : counts) {
    const auto same = static_cast<size_t>(
        std::count_if(counts.begin(), counts.end(),
                      [cells = cells](const auto& other) { return other.first == cells; }));
    double sum = 0.0;
    for (const auto& [other_cells, other_numbers] : counts) {
      if (other_cells != cells || cells == 0) continue;
      sum += static_cast<double>(other_numbers) / static_cast<double>(cells);
    }
    const double score = sum / static_cast<double>(counts.size());
    if (same > 0 && score > fit.numbers) fit = {score, cells};
  }
  return fit;
}

// Sets delimiter and decimal sign; the number of columns, or 0 when none fits.
size_t FindFormat(const std::vector<TableLine>& lines, const TableFormat& format,
                  TableText* table) {
  double best = 0.0;
  size_t columns = 0;
  for (const char delimiter : {'\t', ';', ',', ' '}) {
    if (format.delimiter && *format.delimiter != delimiter) continue;
    for (const bool comma : {false, true}) {
      if (format.decimal_comma && *format.decimal_comma != comma) continue;
      if (comma && delimiter == ',') continue;
      const Fit fit = FitOf(lines, delimiter, comma);
      const bool stated = format.delimiter && fit.fields >= 1;
      if ((fit.fields < 2 && !stated) || fit.numbers <= best + 1e-9) continue;
      best = fit.numbers;
      columns = fit.fields;
      table->delimiter = delimiter;
      table->decimal_comma = comma;
    }
  }
  return columns;
}

// A line with numbers in at least half of its cells, two of them at least (one in a single column).
bool LooksLikeNumbers(const CutLine& cut, const TableText& table) {
  size_t numbers = 0, filled = 0;
  for (const TableCell& cell : cut.cells) {
    const auto kind = ReadCell(cell.text, table.decimal_comma).kind;
    filled += kind == CellNumber::Kind::kEmpty ? 0 : 1;
    numbers += kind == CellNumber::Kind::kNumber || kind == CellNumber::Kind::kNotFinite ? 1 : 0;
  }
  return numbers >= std::min<size_t>(table.columns, 2) && 2 * numbers >= filled;
}

bool IsBracketed(std::string_view text) {
  return text.size() >= 2 && (text[0] == '(' || text[0] == '[' || text[0] == '{') &&
         StripUnit(text).size() + 2 <= text.size();
}

bool IsUnitLike(std::string_view text) {
  return IsBracketed(text) || text == "-" || text == "1" || FindUnit(text).has_value();
}

// A row of units: at least half of its cells are units, brackets or dashes.
bool IsUnitRow(const CutLine& cut) {
  size_t filled = 0, units = 0;
  for (const TableCell& cell : cut.cells) {
    if (cell.text.empty()) continue;
    ++filled;
    units += IsUnitLike(cell.text) ? 1 : 0;
  }
  return filled > 0 && 2 * units >= filled;
}

// "F1 (kN)", "v (m/s)", "F1/kN" or "a/(m/s^2)" → name, unit; what is not a unit stays in the name.
void SplitHeading(TableHeading* heading) {
  const std::string_view full = Trim(heading->full);
  heading->name = full;
  if (full.empty() || FindUnit(full)) return;
  const bool bracket = full.back() == ')' || full.back() == ']';
  const size_t open =
      bracket ? full.find_last_of(full.back() == ')' ? '(' : '[') : std::string_view::npos;
  const size_t slash = full.find('/');
  // A slash in the brackets belongs to the unit: "v (m/s)".
  if (slash != std::string_view::npos && slash > 0 && slash < open &&
      FindUnit(full.substr(slash + 1))) {
    heading->name = Trim(full.substr(0, slash));
    heading->unit = StripUnit(full.substr(slash + 1));
    return;
  }
  if (open == std::string_view::npos || open == 0) return;
  const std::string_view inside = full.substr(open);
  if (!FindUnit(inside)) return;
  heading->name = Trim(full.substr(0, open));
  heading->unit = StripUnit(inside);
}

// White space also separates "Time" from "(sec)": bracketed cells join the one before.
void JoinBrackets(std::string_view line, std::vector<TableCell>* cells) {
  std::vector<TableCell> joined;
  for (const TableCell& cell : *cells) {
    if (!joined.empty() && IsBracketed(cell.text)) {
      const auto start = static_cast<size_t>(joined.back().text.data() - line.data());
      const auto end = static_cast<size_t>(cell.text.data() - line.data()) + cell.text.size();
      joined.back().text = line.substr(start, end - start);
    } else {
      joined.push_back(cell);
    }
  }
  *cells = std::move(joined);
}

class Heading {
 public:
  Heading(TableText* table, const std::string& file, Diagnostics* diagnostics)
      : table_(table), file_(file), diagnostics_(diagnostics) {
    table_->headings.resize(table_->columns);
  }

  // `lines` come before the numbers; the last may hold units, the last of the others names.
  void Read(std::vector<TableLine> lines, const TableLine& comment) {
    CutLine cut;
    const auto last = [&]() -> const TableLine& {
      CutCells(lines.back().text, table_->delimiter, &cut);
      return lines.back();
    };
    TableLine unit_line;
    std::vector<TableCell> units;
    if (!lines.empty()) {
      unit_line = last();
      if (IsUnitRow(cut)) {
        units = cut.cells;
        lines.pop_back();
      }
    }
    if (lines.empty() && comment.number > 0) lines.push_back(comment);
    if (!lines.empty()) ReadNames(lines.back(), comment.number == lines.back().number);
    for (size_t i = 0; i < std::min(units.size(), table_->columns); ++i) {
      const std::string_view unit = StripUnit(units[i].text);
      if (unit.empty() || unit == "-" || unit == "1") continue;
      TableHeading& heading = table_->headings[i];
      heading.unit = unit;
      heading.line = unit_line.number;
      heading.character = units[i].column;
    }
  }

 private:
  void ReadNames(const TableLine& line, bool comment) {
    CutLine cut;
    CutCells(line.text, table_->delimiter, &cut);
    if (table_->delimiter == ' ') JoinBrackets(line.text, &cut.cells);
    const size_t count = CountCells(cut);
    if (count != table_->columns) {
      if (!comment) ReportCount(line, count);
      return;
    }
    for (size_t i = 0; i < count; ++i) {
      TableHeading& heading = table_->headings[i];
      heading.full = cut.cells[i].text;
      heading.line = line.number;
      heading.character = cut.cells[i].column;
      SplitHeading(&heading);
    }
    table_->has_names = true;
  }

  void ReportCount(const TableLine& line, size_t count) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.file = file_;
    finding.line = line.number;
    finding.column = 1;
    finding.message =
        fmt::format("the heading has {} names for {} columns of numbers, so it is not used", count,
                    table_->columns);
    finding.hint = table_->delimiter == ' ' ? "put names with blanks in quotes, or give the "
                                              "columns by number"
                                            : "give the columns by number, or correct the heading";
    diagnostics_->Add(std::move(finding));
  }

  TableText* table_;
  const std::string& file_;
  Diagnostics* diagnostics_;
};

void AddError(const std::string& file, int line, std::string message, std::string hint,
              Diagnostics* diagnostics) {
  Finding finding;
  finding.file = file;
  finding.line = line;
  finding.column = line > 0 ? 1 : 0;
  finding.message = std::move(message);
  finding.hint = std::move(hint);
  diagnostics->Add(std::move(finding));
}

// The first line with numbers.
size_t FindFirstRow(const std::vector<TableLine>& lines, const TableFormat& format,
                    const TableText& table) {
  if (format.heading_rows) {
    return std::min(static_cast<size_t>(*format.heading_rows), lines.size());
  }
  CutLine cut;
  for (size_t i = 0; i < lines.size(); ++i) {
    CutCells(lines[i].text, table.delimiter, &cut);
    if (LooksLikeNumbers(cut, table)) return i;
  }
  return lines.size();
}

bool IsReadable(std::string_view text, const std::string& file, Diagnostics* diagnostics) {
  const bool utf16 = text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF");
  if (utf16 || text.find('\0') != std::string_view::npos) {
    AddError(file, 0, utf16 ? "is UTF-16 text" : "holds zero bytes, so it is not text",
             "save it as CSV or as UTF-8 text", diagnostics);
    return false;
  }
  return true;
}

}  // namespace

std::string DelimiterName(char delimiter) {
  if (delimiter == '\t') return "a tab";
  return delimiter == ' ' ? "white space" : fmt::format("'{}'", delimiter);
}

void CutCells(std::string_view line, char delimiter, CutLine* cut) {
  cut->cells.clear();
  cut->closed = true;
  const bool white = delimiter == ' ';
  size_t at = 0;
  while (true) {
    while (at < line.size() && IsBlank(line[at]) && line[at] != delimiter) ++at;
    while (white && at < line.size() && IsBlank(line[at])) ++at;
    if (white && at >= line.size()) return;
    size_t start = at, end = 0;
    if (at < line.size() && line[at] == '"') {
      // A doubled quote inside stays as it is written.
      size_t close = line.find('"', at + 1);
      while (close != std::string_view::npos && close + 1 < line.size() && line[close + 1] == '"') {
        close = line.find('"', close + 2);
      }
      cut->closed = cut->closed && close != std::string_view::npos;
      end = std::min(close, line.size());
      ++start;
      at = end;
    }
    while (at < line.size() && (white ? !IsBlank(line[at]) : line[at] != delimiter)) ++at;
    if (end == 0) end = at;
    cut->cells.push_back({Trim(line.substr(start, end - start)), static_cast<int>(start) + 1});
    if (at >= line.size()) return;
    ++at;
  }
}

std::optional<TableText> CutTable(std::string_view text, const std::string& file,
                                  const TableFormat& format, Diagnostics* diagnostics) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (!IsReadable(text, file, diagnostics)) return {};
  Lines cut = CutLines(text);
  if (cut.lines.size() > kMaxTableRows) {
    AddError(file, 0,
             fmt::format("has {} lines, at most {} are read", cut.lines.size(), kMaxTableRows),
             "export fewer samples", diagnostics);
    return {};
  }
  TableText table;
  table.columns = FindFormat(cut.lines, format, &table);
  if (table.columns == 0 || table.columns > kMaxTableColumns) {
    AddError(file, 0,
             cut.lines.empty()
                 ? "holds no numbers"
                 : fmt::format("no table of numbers was found: at least two columns are needed{}",
                               format.delimiter ? " between " + DelimiterName(*format.delimiter)
                                                : ", separated by tabs, ';', ',' or blanks"),
             "state delimiter: tab | comma | semicolon | space and decimal: point | comma",
             diagnostics);
    return {};
  }
  const size_t first = FindFirstRow(cut.lines, format, table);
  Heading(&table, file, diagnostics)
      .Read({cut.lines.begin(), cut.lines.begin() + static_cast<std::ptrdiff_t>(first)},
            cut.last_comment);
  table.rows.assign(cut.lines.begin() + static_cast<std::ptrdiff_t>(first), cut.lines.end());
  return table;
}

}  // namespace mbv
