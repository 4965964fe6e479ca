#include "scenario/tables/table.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "base/inputs.h"
#include "mechanism/reach.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

std::vector<std::string> WithSourceKeys(std::vector<std::string> keys) {
  keys.insert(keys.end(), kTableSourceKeys.begin(), kTableSourceKeys.end());
  return keys;
}

TableTolerance ReadTolerance(ValueReader* values, const YamlMap& map) {
  TableTolerance tolerance;
  const auto read = [&](const char* key, double* target) {
    const YamlNode* node = map.Find(key);
    if (node == nullptr) return;
    const auto number = values->Number(*node, map.PathOf(key));
    if (number && *number < 0.0) {
      values->yaml().Error(*node, fmt::format("{} = {} violates >= 0", map.PathOf(key), *number));
    } else if (number) {
      *target = *number;
    }
  };
  read("absolute", &tolerance.absolute);
  read("relative", &tolerance.relative);
  return tolerance;
}

bool StatesTolerance(const YamlMap& map) { return map.Has("absolute") || map.Has("relative"); }

// A heading, or a number counted from 1.
void ReadColumnName(ValueReader* values, const YamlNode& node, const std::string& path,
                    TableColumnSettings* column) {
  const auto text = values->yaml().Text(node, path);
  if (!text) return;
  const auto number = node.quoted ? std::nullopt : PlainNumber(*text);
  if (!number) {
    column->column = *text;
    return;
  }
  if (*number < 1 || *number > double{kMaxTableColumns} || *number != std::floor(*number)) {
    values->yaml().Error(node, fmt::format("{} = {} is not a column number", path, *text),
                         "columns are counted from 1; put a heading that is a number in quotes");
    return;
  }
  column->number = static_cast<int>(*number);
}

TableColumnSettings ReadColumn(ValueReader* values, const YamlEntry& entry) {
  TableColumnSettings column;
  column.place = entry;
  column.path = JoinPath("reference.columns", entry.key);
  column.signal = entry.key;
  const YamlNode& node = *entry.value;
  if (node.is_null() ||
      (node.is_scalar() && !node.quoted && (node.text == "off" || node.text == "none"))) {
    column.off = true;
  } else {
    ReadTableColumn(values, node, &column);
  }
  return column;
}

void ReadFormat(ValueReader* values, const YamlMap& map, TableFormat* format) {
  YamlReader& yaml = values->yaml();
  if (const YamlNode* node = map.Find("delimiter")) {
    const auto choice =
        yaml.Choice(*node, map.PathOf("delimiter"), {"tab", "comma", "semicolon", "space"});
    if (choice) format->delimiter = "\t,; "[*choice];
  }
  if (const YamlNode* node = map.Find("decimal")) {
    const auto choice = yaml.Choice(*node, map.PathOf("decimal"), {"point", "comma"});
    if (choice) format->decimal_comma = *choice == 1;
    if (choice == 1 && format->delimiter == ',') {
      yaml.Error(*node,
                 map.PathOf("decimal") + ": a comma cannot be both decimal sign and delimiter");
    }
  }
  if (const YamlNode* node = map.Find("heading_rows")) {
    const auto rows = yaml.Integer(*node, map.PathOf("heading_rows"));
    if (rows && *rows < 0) {
      yaml.Error(*node, fmt::format("{} = {} violates >= 0", map.PathOf("heading_rows"), *rows));
    } else {
      format->heading_rows = rows;
    }
  }
}

void ReadTolerances(ValueReader* values, const YamlMap& map, TableSettings* settings) {
  const YamlNode* node = map.Find("tolerance");
  if (node == nullptr) return;
  const YamlMap tolerance(&values->yaml(), node, "reference.tolerance",
                          {"absolute", "relative", "coverage", "coarsest"});
  if (StatesTolerance(tolerance)) settings->tolerance = ReadTolerance(values, tolerance);
  if (const YamlNode* coverage = tolerance.Find("coverage")) {
    settings->coverage =
        values->Positive(*coverage, "reference.tolerance.coverage").value_or(settings->coverage);
  }
  if (const YamlNode* coarsest = tolerance.Find("coarsest")) {
    settings->coarsest =
        values->Positive(*coarsest, "reference.tolerance.coarsest").value_or(settings->coarsest);
  }
}

}  // namespace

const std::vector<std::string> kTableSourceKeys = {"csv",          "delimiter", "decimal",
                                                   "heading_rows", "time_unit", "time_offset_s"};

void ReadTableColumnKeys(ValueReader* values, const YamlMap& map, TableColumnSettings* column) {
  if (const YamlNode* name = map.Find("column")) {
    ReadColumnName(values, *name, map.PathOf("column"), column);
  }
  if (const YamlNode* unit = map.Find("unit")) {
    column->unit = values->yaml().Text(*unit, map.PathOf("unit")).value_or("");
    column->unit_line = unit->line;
    column->unit_character = unit->column;
  }
  if (const YamlNode* sign = map.Find("sign")) {
    column->sign = values->Number(*sign, map.PathOf("sign")).value_or(1.0);
    if (column->sign != 1.0 && column->sign != -1.0) {
      values->yaml().Error(
          *sign, fmt::format("{} = {} is neither 1 nor -1", map.PathOf("sign"), column->sign),
          "a factor is given by scale");
    }
  }
  if (const YamlNode* scale = map.Find("scale")) {
    column->scale = values->Number(*scale, map.PathOf("scale")).value_or(1.0);
    if (column->scale == 0.0) {
      values->yaml().Error(*scale, map.PathOf("scale") + " = 0 would make the column zero");
    }
  }
  if (const YamlNode* offset = map.Find("offset")) {
    column->offset = values->Number(*offset, map.PathOf("offset")).value_or(0.0);
  }
}

void ReadTableColumn(ValueReader* values, const YamlNode& node, TableColumnSettings* column) {
  if (!node.is_map()) {
    ReadColumnName(values, node, column->path, column);
    return;
  }
  YamlMap map(&values->yaml(), &node, column->path,
              {"column", "unit", "sign", "scale", "offset", "tolerance"});
  ReadTableColumnKeys(values, map, column);
  if (const YamlNode* tolerance = map.Find("tolerance")) {
    const YamlMap limits(&values->yaml(), tolerance, map.PathOf("tolerance"),
                         {"absolute", "relative"});
    column->tolerance = ReadTolerance(values, limits);
  }
}

void ReadTableSource(ValueReader* values, const YamlMap& map, TableSettings* settings) {
  YamlReader& yaml = values->yaml();
  const YamlNode* csv = map.Required("csv");
  if (csv == nullptr) return;
  settings->csv = yaml.Text(*csv, map.PathOf("csv")).value_or("");
  settings->place = {"csv", csv->line, csv->column, nullptr};
  const std::filesystem::path folder = std::filesystem::path(yaml.file()).parent_path();
  settings->file = (folder / settings->csv).lexically_normal().string();
  ReadFormat(values, map, &settings->format);
  if (const YamlNode* unit = map.Find("time_unit")) {
    settings->time_unit = yaml.Text(*unit, map.PathOf("time_unit")).value_or("");
    settings->time_unit_line = unit->line;
    settings->time_unit_character = unit->column;
  }
  if (const YamlNode* offset = map.Find("time_offset_s")) {
    settings->time_offset_s = values->Number(*offset, map.PathOf("time_offset_s")).value_or(0.0);
  }
}

TableSettings ReadTableSettings(ValueReader* values, const YamlNode* node) {
  TableSettings settings;
  YamlReader& yaml = values->yaml();
  YamlMap map(&yaml, node, settings.path, WithSourceKeys({"columns", "tolerance", "witness"}));
  ReadTableSource(values, map, &settings);
  if (settings.file.empty()) return settings;
  ReadTolerances(values, map, &settings);
  if (const YamlNode* witness = map.Find("witness")) {
    std::vector<std::string> words = {role::kReference.name};
    for (const Role* role : kRoles) {
      if (role == &role::kReference || !role->judged_alone() || !IsCompared(*role)) continue;
      words.emplace_back(role->name);
    }
    const auto choice = yaml.Choice(*witness, "reference.witness", words);
    if (choice) settings.witness = words[static_cast<size_t>(*choice)];
  }
  if (const YamlNode* columns = map.Find("columns")) {
    for (const YamlEntry& entry : yaml.Entries(*columns, "reference.columns")) {
      settings.columns.push_back(ReadColumn(values, entry));
    }
  }
  return settings;
}

// File → ReferenceTable.

namespace {

constexpr size_t kMostFindings = 20;  // of one table
constexpr size_t kFewestRows = 4;
// Events write a time twice; where more than one row in this many is such a time, the printed times
// have too few digits.
constexpr size_t kRowsPerEvent = 20;

// The numbers of the mapped columns, as printed.
class RowReader {
 public:
  RowReader(const TableText& text, const TableSettings& settings, const TableMapping& mapping,
            Diagnostics* diagnostics)
      : text_(text), settings_(settings), mapping_(mapping), diagnostics_(diagnostics) {
    indices_.push_back(mapping.time_index);
    for (const MappedColumn& mapped : mapping.columns) indices_.push_back(mapped.index);
    numbers.resize(indices_.size());
    digits.resize(indices_.size());
  }

  void Read() {
    CutLine cut;
    for (std::vector<double>& column : numbers) column.reserve(text_.rows.size());
    for (const TableLine& line : text_.rows) {
      CutCells(line.text, text_.delimiter, &cut);
      if (CheckRow(line, cut)) ReadRow(line, cut);
    }
    LeaveOutEvents();
    if (text_.rows.size() < kFewestRows) {
      Add(0, 0,
          fmt::format("has {} rows of numbers, at least {} are needed", text_.rows.size(),
                      kFewestRows),
          "");
    }
    if (found_ > kMostFindings) {
      Finding finding;
      finding.file = settings_.file;
      finding.message = fmt::format("{} more findings", found_ - kMostFindings);
      diagnostics_->Add(std::move(finding));
    }
  }

  [[nodiscard]] bool ok() const { return found_ == 0; }

  std::vector<std::vector<double>> numbers;  // time first, then the mapped columns
  std::vector<DigitStatistics> digits;
  std::vector<int> lines;          // of the rows
  std::vector<std::string> notes;  // about rows that are left out

 private:
  // A time that is written more than once.
  struct Repeat {
    size_t row;      // of numbers, its first
    bool different;  // with other values
    int line, column;
    std::string text;
    std::vector<double> last = {};  // the values that differ
  };

  void Add(int line, int column, const std::string& message, const std::string& hint) {
    if (++found_ > kMostFindings) return;
    Finding finding;
    finding.file = settings_.file;
    finding.line = line;
    finding.column = column;
    finding.message = message;
    finding.hint = hint;
    diagnostics_->Add(std::move(finding));
  }

  bool CheckRow(const TableLine& line, const CutLine& cut) {
    if (!cut.closed) {
      Add(line.number, 1, "a quote is not closed in this line", "");
      return false;
    }
    size_t count = cut.cells.size();
    while (count > text_.columns && cut.cells[count - 1].text.empty()) --count;
    if (count == text_.columns) return true;
    Add(line.number, count > text_.columns ? cut.cells[text_.columns].column : 1,
        fmt::format("row of {} cells in a table of {} columns", count, text_.columns),
        text_.delimiter == ',' && count > text_.columns
            ? "are commas decimal signs? then separate columns by ';' or tabs"
            : fmt::format("cells are separated by {}", DelimiterName(text_.delimiter)));
    return false;
  }

  [[nodiscard]] std::string NameOf(size_t k) const {
    if (k > 0) return mapping_.columns[k - 1].column.heading;
    const std::string& name = text_.headings[mapping_.time_index].full;
    return name.empty() ? fmt::format("column {}", mapping_.time_index + 1) : name;
  }

  void ReadRow(const TableLine& line, const CutLine& cut) {
    bool complete = true;
    row_.resize(indices_.size());
    for (size_t k = 0; k < indices_.size(); ++k) {
      const TableCell& cell = cut.cells[indices_[k]];
      row_[k] = ReadCell(cell.text, text_.decimal_comma);
      if (row_[k].kind == CellNumber::Kind::kNumber) continue;
      complete = false;
      Report(line, cell, k, row_[k].kind);
    }
    if (!complete || !CheckTime(line, cut.cells[indices_[0]]) || IsRepeat(line, cut)) return;
    lines.push_back(line.number);
    for (size_t k = 0; k < indices_.size(); ++k) {
      numbers[k].push_back(row_[k].value);
      digits[k].Add(row_[k]);
    }
  }

  void Report(const TableLine& line, const TableCell& cell, size_t k, CellNumber::Kind kind) {
    switch (kind) {
      case CellNumber::Kind::kNumber:
        return;
      case CellNumber::Kind::kEmpty:
        Add(line.number, cell.column, fmt::format("{}: the cell is empty", NameOf(k)),
            "leave out the row, or the column");
        return;
      case CellNumber::Kind::kNotFinite:
        Add(line.number, cell.column,
            fmt::format("{} = {} violates: a finite number", NameOf(k), Shown(cell.text)),
            "leave out the row, or the column");
        return;
      case CellNumber::Kind::kText:
        Add(line.number, cell.column,
            fmt::format("{} = '{}' is not a number", NameOf(k), Shown(cell.text)),
            TextHint(cell.text));
        return;
    }
  }

  static std::string Shown(std::string_view text) {
    std::string shown;
    for (const char c : text.substr(0, 30)) {
      shown += static_cast<unsigned char>(c) < 0x20 ? '?' : c;
    }
    return text.size() > 30 ? shown + "…" : shown;
  }

  [[nodiscard]] std::string TextHint(std::string_view text) const {
    const bool comma = text.find(',') != std::string_view::npos;
    const bool point = text.find('.') != std::string_view::npos;
    if (comma && point) return "numbers are written without thousands separators";
    if (comma && !text_.decimal_comma) return "state decimal: comma";
    if (point && text_.decimal_comma) return "state decimal: point";
    return "";
  }

  bool CheckTime(const TableLine& line, const TableCell& cell) {
    const double t = row_[0].value;
    if (numbers[0].empty() || t >= numbers[0].back()) return true;
    Add(line.number, cell.column,
        fmt::format("{} = {} goes back from {:g}", NameOf(0), Shown(cell.text), numbers[0].back()),
        "times must increase; is this the time column?");
    return false;
  }

  // Dymola and OpenModelica write the last time twice, and every event once before and once after.
  bool IsRepeat(const TableLine& line, const CutLine& cut) {
    if (numbers[0].empty() || row_[0].value != numbers[0].back()) return false;
    bool different = false;
    for (size_t k = 1; k < indices_.size(); ++k) {
      different = different || row_[k].value != numbers[k].back();
    }
    const size_t row = numbers[0].size() - 1;
    const TableCell& cell = cut.cells[indices_[0]];
    if (!repeats_.empty() && repeats_.back().row == row) {
      repeats_.back().different = repeats_.back().different || different;
    } else {
      repeats_.push_back({row, different, line.number, cell.column, Shown(cell.text)});
    }
    if (different) {
      repeats_.back().last.clear();
      for (const CellNumber& number : row_) repeats_.back().last.push_back(number.value);
    }
    return true;
  }

  // At an event a signal may have two values, and its time need not lie on the table's grid: rows
  // with two values, and rows beside the grid, are left out.
  void LeaveOutEvents() {
    const auto events = static_cast<size_t>(std::count_if(
        repeats_.begin(), repeats_.end(), [](const Repeat& repeat) { return repeat.different; }));
    if (events * kRowsPerEvent > numbers[0].size()) {
      for (const Repeat& repeat : repeats_) {
        if (!repeat.different) continue;
        Add(repeat.line, repeat.column, fmt::format("{} = {} is repeated", NameOf(0), repeat.text),
            "keep one row per time; print more digits of the time");
      }
      return;
    }
    for (const Repeat& repeat : repeats_) ReportTwoValues(repeat);
    const double spacing = UsualStep();
    size_t left_out = 0;
    for (auto repeat = repeats_.rbegin(); repeat != repeats_.rend(); ++repeat) {
      const double steps = (numbers[0][repeat->row] - numbers[0][0]) / spacing;
      if (!repeat->different && std::abs(steps - std::round(steps)) <= 1e-3) continue;
      ++left_out;
      for (std::vector<double>& column : numbers) {
        column.erase(column.begin() + static_cast<std::ptrdiff_t>(repeat->row));
      }
      lines.erase(lines.begin() + static_cast<std::ptrdiff_t>(repeat->row));
    }
    if (left_out > 0) {
      notes.push_back(fmt::format(
          "{} times are left out: they are written twice, as at events, where a signal may jump",
          left_out));
    }
    if (repeats_.size() > left_out) {
      notes.push_back(fmt::format("{} rows that repeat the row before are left out",
                                  repeats_.size() - left_out));
    }
  }

  // A force may jump at an event. A position cannot, and a spline through a motion's rows does not:
  // there two values far apart, for how the column changes around, are two rows of one time.
  void ReportTwoValues(const Repeat& repeat) {
    constexpr double kApart = 3.0;  // times the changes beside it
    if (!repeat.different) return;
    for (size_t k = 1; k < numbers.size(); ++k) {
      const std::string& unit = mapping_.columns[k - 1].column.channel.unit;
      if (settings_.signals.empty() && unit != "m" && unit != "rad") continue;
      const std::vector<double>& values = numbers[k];
      const double first = values[repeat.row], last = repeat.last[k];
      double beside = 0.0;
      if (repeat.row > 0) {
        const double before = values[repeat.row - 1];
        beside = std::min(std::abs(first - before), std::abs(last - before));
      }
      if (repeat.row + 1 < values.size()) {
        const double after = values[repeat.row + 1];
        beside = std::max(beside, std::min(std::abs(after - first), std::abs(after - last)));
      }
      const double apart = std::abs(last - first);
      if (apart <= kApart * beside || apart <= 1e-6 * std::max(std::abs(first), std::abs(last))) {
        continue;
      }
      Finding finding;
      finding.severity = Severity::kWarning;
      finding.file = settings_.file;
      finding.line = repeat.line;
      finding.column = repeat.column;
      finding.message =
          fmt::format("{} = {} has two values of {}, {:g} and {:g}: both rows are left out",
                      NameOf(0), repeat.text, NameOf(k), first, last);
      finding.hint = "keep the row that is right";
      diagnostics_->Add(std::move(finding));
    }
  }

  // Median step of the times that are written once.
  [[nodiscard]] double UsualStep() const {
    std::vector<double> steps;
    auto repeat = repeats_.begin();
    double before = kNan;
    for (size_t i = 0; i < numbers[0].size(); ++i) {
      if (repeat != repeats_.end() && repeat->row == i) {
        ++repeat;
        continue;
      }
      if (!std::isnan(before)) steps.push_back(numbers[0][i] - before);
      before = numbers[0][i];
    }
    if (steps.empty()) return kNan;
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return *middle;
  }

  const TableText& text_;
  const TableSettings& settings_;
  const TableMapping& mapping_;
  Diagnostics* diagnostics_;
  std::vector<size_t> indices_;
  std::vector<CellNumber> row_;
  std::vector<Repeat> repeats_;
  size_t found_ = 0;
};

// What can be read and is hardly meant: one warning each, at its line.
class Plausibility {
 public:
  Plausibility(const TableText& text, const TableSettings& settings, const TableMapping& mapping,
               const RowReader& rows, const Mechanism& mechanism, Diagnostics* diagnostics)
      : text_(text),
        settings_(settings),
        mapping_(mapping),
        rows_(rows),
        mechanism_(mechanism),
        diagnostics_(*diagnostics) {}

  void Check() {
    if (rows_.numbers[0].size() < kFewestRows) return;
    FindStep();
    CheckHoles();
    if (mapping_.time_unit_assumed) CheckTimeUnit();
    for (size_t k = 0; k < mapping_.columns.size(); ++k) {
      const TableColumn& column = mapping_.columns[k].column;
      if (!mapping_.columns[k].unit_assumed || std::abs(column.factor) != 1.0) continue;
      if (column.channel.unit == "rad") CheckAngles(k);
      if (column.channel.unit == "m") CheckLengths(k);
    }
  }

 private:
  void Warn(int line, int character, std::string message, std::string hint) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.file = settings_.file;
    finding.line = line;
    finding.column = character;
    finding.message = std::move(message);
    finding.hint = std::move(hint);
    diagnostics_.Add(std::move(finding));
  }

  // The median step, and whether nearly all are like it.
  void FindStep() {
    const std::vector<double>& times = rows_.numbers[0];
    std::vector<double> steps;
    for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
    std::vector<double> sorted = steps;
    std::sort(sorted.begin(), sorted.end());
    step_ = sorted[sorted.size() / 2];
    // Printed times are off by half a unit each.
    const std::vector<double> printed = PrintedSteps(times, rows_.digits[0], 0);
    const double unit = *std::max_element(printed.begin(), printed.end());
    const auto others = std::count_if(steps.begin(), steps.end(), [&](double step) {
      return std::abs(step - step_) > kSameStep * step_ + 1.01 * std::min(unit, 0.5 * step_);
    });
    regular_ = step_ > 0.0 && static_cast<size_t>(others) * kStepsPerHole <= steps.size();
  }

  // A row or two may be lost in any log; a spline goes through such gaps.
  void CheckHoles() {
    if (!regular_) return;
    const std::vector<double>& times = rows_.numbers[0];
    for (size_t i = 1; i < times.size(); ++i) {
      const double missing = std::round((times[i] - times[i - 1]) / step_) - 1.0;
      if (missing < kMissing) continue;
      const double f = mapping_.time_factor;
      Warn(rows_.lines[i], 1,
           fmt::format("{:g} rows are missing: the rows are {:g} s apart, but none lies between "
                       "{:g} and {:g} s",
                       missing, f * step_, f * times[i - 1], f * times[i]),
           "what happens there is interpolated; export the whole recording");
    }
  }

  [[nodiscard]] std::string TimeName() const {
    const std::string& name = text_.headings[mapping_.time_index].full;
    return name.empty() ? fmt::format("column {}", mapping_.time_index + 1) : name;
  }

  // Seconds of a mechanism's motion are sampled more finely than whole ones.
  void CheckTimeUnit() {
    const std::vector<double>& times = rows_.numbers[0];
    const bool whole =
        std::all_of(times.begin(), times.end(), [](double t) { return t == std::round(t); });
    if (!whole || step_ < kWholeSteps) return;
    const TableHeading& heading = text_.headings[mapping_.time_index];
    Warn(heading.line > 0 ? heading.line : rows_.lines.front(), std::max(1, heading.character),
         fmt::format("{} has no unit, and its whole numbers, {:g} apart up to {:g}, are taken as "
                     "seconds",
                     TimeName(), step_, times.back()),
         "are they milliseconds? state time_unit: ms (or s)");
  }

  struct Extent {
    double low = 0.0, high = 0.0;
    bool returns = false;  // goes much further than from one end to the other
    [[nodiscard]] double span() const { return high - low; }
  };
  [[nodiscard]] Extent ExtentOf(size_t k) const {
    const std::vector<double>& values = rows_.numbers[k + 1];
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    double path = 0.0;
    for (size_t i = 1; i < values.size(); ++i) path += std::abs(values[i] - values[i - 1]);
    return {*low, *high, path > 1.5 * (*high - *low)};
  }

  void WarnUnit(size_t k, const Extent& extent, const char* taken, const std::string& reason,
                const char* hint) {
    const MappedColumn& mapped = mapping_.columns[k];
    const TableHeading& heading = text_.headings[mapped.index];
    Warn(heading.line > 0 ? heading.line : rows_.lines.front(), std::max(1, heading.character),
         fmt::format("{} has no unit, and its numbers from {:g} to {:g} are taken as {}: {}",
                     mapped.column.heading, extent.low, extent.high, taken, reason),
         hint);
  }

  void CheckAngles(size_t k) {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    const Extent extent = ExtentOf(k);
    const auto multiple = [](double x, double of) {
      return std::abs(x - of * std::round(x / of)) <= 1e-6 * of;
    };
    // Round numbers of degrees that are far from round in radians.
    const bool round = extent.span() >= 30.0 && multiple(extent.low, 15.0) &&
                       multiple(extent.high, 15.0) &&
                       (extent.returns || multiple(extent.span(), 90.0));
    const bool back = extent.returns && extent.span() > 4.0 * kTurn;
    if (!round && !back) return;
    WarnUnit(
        k, extent, "radians",
        fmt::format("{:.3g} turns{}", extent.span() / kTurn, extent.returns ? " to and fro" : ""),
        "are they degrees? state unit: deg (or rad)");
  }

  void CheckLengths(size_t k) {
    constexpr double kTimes = 50.0;
    const Extent extent = ExtentOf(k);
    const double size = CharacteristicLength(mechanism_);
    if (!(extent.span() > kTimes * size)) return;
    WarnUnit(k, extent, "metres",
             fmt::format("{:.3g} times the size of {}, {:.2g} m", extent.span() / size,
                         mechanism_.name, size),
             "are they millimetres? state unit: mm (or m)");
  }

  static constexpr double kSameStep = 0.05;  // of the median step
  static constexpr size_t kStepsPerHole = 20;
  static constexpr double kMissing = 3.0;     // rows
  static constexpr double kWholeSteps = 2.0;  // seconds

  const TableText& text_;
  const TableSettings& settings_;
  const TableMapping& mapping_;
  const RowReader& rows_;
  const Mechanism& mechanism_;
  Diagnostics& diagnostics_;
  double step_ = kNan;
  bool regular_ = false;
};

// The largest digit count that a column with enough values shows; columns of constants borrow it.
int TableDigits(const std::vector<DigitStatistics>& digits) {
  int significant = 0;
  for (size_t k = 1; k < digits.size(); ++k) {
    if (!digits[k].says_little()) significant = std::max(significant, digits[k].significant());
  }
  return significant;
}

std::shared_ptr<ReferenceTable> MakeTable(const TableSettings& settings, TableMapping mapping,
                                          const RowReader& rows) {
  auto table = std::make_shared<ReferenceTable>();
  table->file = settings.file;
  table->name = std::filesystem::path(settings.file).filename().string();
  table->coverage = settings.coverage;
  table->coarsest = settings.coarsest;
  table->notes = std::move(mapping.notes);
  table->notes.insert(table->notes.end(), rows.notes.begin(), rows.notes.end());
  for (const double t : rows.numbers[0]) {
    table->time_s.push_back(mapping.time_factor * t + settings.time_offset_s);
  }
  const auto n = static_cast<Eigen::Index>(table->time_s.size());
  const auto m = static_cast<Eigen::Index>(mapping.columns.size());
  table->values.resize(n, m);
  table->steps.resize(n, m);
  const int significant = TableDigits(rows.digits);
  for (Eigen::Index c = 0; c < m; ++c) {
    const auto k = static_cast<size_t>(c);
    const TableColumn& column = mapping.columns[k].column;
    const std::vector<double>& numbers = rows.numbers[k + 1];
    const std::vector<double> steps = PrintedSteps(numbers, rows.digits[k + 1], significant);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto row = static_cast<size_t>(i);
      table->values(i, c) = column.factor * numbers[row] + column.shift;
      table->steps(i, c) = std::abs(column.factor) * steps[row];
    }
    table->columns.push_back(column);
  }
  DescribeTimes(table.get());
  const std::vector<double> noise = EstimateNoise(table->time_s, table->values);
  for (size_t k = 0; k < noise.size(); ++k) table->columns[k].noise = noise[k];
  if (table->time_s.size() < kFewestForNoise) {
    table->notes.push_back(
        fmt::format("{} rows are too few to estimate noise", table->time_s.size()));
  }
  return table;
}

}  // namespace

std::shared_ptr<const ReferenceTable> LoadTableText(const std::string& text,
                                                    const TableSettings& settings,
                                                    const Mechanism& mechanism, YamlReader* yaml,
                                                    Diagnostics* diagnostics) {
  const auto cut = CutTable(text, settings.file, settings.format, diagnostics);
  if (!cut) return nullptr;
  TableMapping mapping = MapColumns(*cut, settings, mechanism, yaml, diagnostics);
  RowReader rows(*cut, settings, mapping, diagnostics);
  rows.Read();
  if (!rows.ok() || mapping.columns.empty() || yaml->has_errors() || diagnostics->has_errors()) {
    return nullptr;
  }
  Plausibility(*cut, settings, mapping, rows, mechanism, diagnostics).Check();
  return MakeTable(settings, std::move(mapping), rows);
}

std::shared_ptr<const ReferenceTable> LoadTable(const TableSettings& settings,
                                                const Mechanism& mechanism, YamlReader* yaml,
                                                Diagnostics* diagnostics) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(settings.file, error);
  if (error || !std::filesystem::is_regular_file(settings.file, error)) {
    yaml->Error(settings.place,
                fmt::format("{}.csv = '{}' cannot be read", settings.path, settings.csv),
                "the path is taken from the scenario's folder: " + settings.file);
    return nullptr;
  }
  if (bytes > kMaxTableBytes) {
    yaml->Error(settings.place,
                fmt::format("{}.csv = '{}' has {} bytes, at most {} are read", settings.path,
                            settings.csv, bytes, kMaxTableBytes),
                "export fewer samples or columns");
    return nullptr;
  }
  std::ifstream stream(settings.file, std::ios::binary);
  std::string text(bytes, '\0');
  stream.read(text.data(), static_cast<std::streamsize>(bytes));
  text.resize(static_cast<size_t>(stream.gcount()));
  NoteInput(settings.file, text);
  return LoadTableText(text, settings, mechanism, yaml, diagnostics);
}

}  // namespace mbv
