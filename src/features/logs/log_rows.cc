#include "features/logs/log_rows.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>

#include "base/files.h"
#include "base/text.h"

namespace mbv {
namespace {

constexpr size_t kFewestRows = 12;           // fewer show neither motion nor noise
constexpr size_t kShownPlaces = 3;           // of one kind of fault
constexpr double kManyMissing = 0.2;         // of the rows
constexpr double kManyRepeated = 0.01;       // of the rows
constexpr double kGap = 10.0, kSlack = 1.5;  // of the median step
constexpr double kSlowest_s = 0.5;           // between rows, where nothing says that it is seconds
constexpr int kMostDecimals = 12;

// One row as it is read.
struct LogRow {
  int line = 0;
  double time_s = 0.0;
};

// Several faults of one kind: the first places, and how many there are.
struct Faults {
  size_t count = 0;
  int line = 0, column = 0;
  std::string text;

  void Add(int at_line, int at_column, const std::string& what) {
    if (count++ == 0) {
      line = at_line;
      column = at_column;
      text = what;
    }
  }
};

class LogReader {
 public:
  LogReader(const std::string& file, const LogSettings& settings, const std::vector<LogAxis>& axes,
            Diagnostics* diagnostics)
      : settings_(settings), axes_(axes), diagnostics_(*diagnostics) {
    log_.file = file;
    log_.name = std::filesystem::path(file).filename().string();
  }

  std::optional<RobotLog> Read() {
    const auto content = ReadWholeFile(log_.file);
    if (!content) {
      Error(0, 0, "cannot be read", DidYouMeanPath(log_.file));
      return {};
    }
    if (content->size() > kMaxTableBytes) {
      Error(0, 0, fmt::format("has {} bytes, at most {} are read", content->size(), kMaxTableBytes),
            "export fewer columns or a shorter part");
      return {};
    }
    const auto text = CutTable(*content, log_.file, settings_.format, &diagnostics_);
    if (!text) return {};
    LogMapping mapping = MapLog(*text, log_.file, settings_, axes_, &diagnostics_);
    log_.notes = std::move(mapping.notes);
    if (mapping.clock) clock_ = *mapping.clock;
    for (LogColumn& column : mapping.columns) log_.series.push_back({std::move(column), {}, {}});
    if (!mapping.clock || diagnostics_.has_errors()) return {};
    ReadRows(*text);
    if (diagnostics_.has_errors()) return {};
    LeaveEmptyColumns();
    LeaveIncompleteRows();
    if (!CheckOrder()) return {};
    CutPart();
    if (diagnostics_.has_errors() || !CheckSteps()) return {};
    UnwrapAngles();
    StampRows();
    return std::move(log_);
  }

 private:
  void Add(Severity severity, int line, int column, std::string message, std::string hint) {
    Finding finding;
    finding.severity = severity;
    finding.file = log_.file;
    finding.line = line;
    finding.column = line > 0 ? std::max(column, 1) : 0;
    finding.message = std::move(message);
    finding.hint = std::move(hint);
    diagnostics_.Add(std::move(finding));
  }
  void Error(int line, int column, std::string message, std::string hint) {
    Add(Severity::kError, line, column, std::move(message), std::move(hint));
  }
  void Warn(int line, std::string message, std::string hint) {
    Add(Severity::kWarning, line, 1, std::move(message), std::move(hint));
  }

  static std::string More(size_t count) {
    return count > 1 ? fmt::format(" (and {} more like it)", count - 1) : "";
  }

  // Whole numbers are subtracted as such: a double cannot hold nanoseconds since 1970.
  struct Stamp {
    int64_t whole = 0;
    double rest = 0.0;
    bool valid = false;
  };
  Stamp ReadStamp(const TableCell& cell, bool decimal_comma) {
    Stamp stamp;
    const auto [end, error] =
        std::from_chars(cell.text.data(), cell.text.data() + cell.text.size(), stamp.whole);
    if (error == std::errc() && end == cell.text.data() + cell.text.size()) {
      stamp.valid = true;
      return stamp;
    }
    const CellNumber number = ReadCell(cell.text, decimal_comma);
    if (number.kind != CellNumber::Kind::kNumber || std::abs(number.value) > 1e18) return stamp;
    decimals_ = std::max(decimals_, number.decimals);
    stamp.whole = static_cast<int64_t>(std::trunc(number.value));
    stamp.rest = number.value - static_cast<double>(stamp.whole);
    stamp.valid = true;
    return stamp;
  }

  void ReadRows(const TableText& text) {
    Faults clock, words, overflow;
    std::optional<Stamp> first, first_nano;
    CutLine cut;
    size_t needed = clock_.index;
    if (clock_.nanoseconds) needed = std::max(needed, *clock_.nanoseconds);
    for (const LogSeries& series : log_.series) needed = std::max(needed, series.column.index);
    Faults cut_off;
    for (size_t r = 0; r < text.rows.size(); ++r) {
      const TableLine& line = text.rows[r];
      CutCells(line.text, text.delimiter, &cut);
      if (cut.cells.size() <= needed || !cut.closed) {
        if (r + 1 == text.rows.size()) {
          Warn(line.number, "the last line is cut off and left out", "");
        } else {
          cut_off.Add(line.number, 1,
                      fmt::format("has {} of {} cells", cut.cells.size(), needed + 1));
        }
        continue;
      }
      const TableCell& cell = cut.cells[clock_.index];
      const Stamp stamp = ReadStamp(cell, text.decimal_comma);
      Stamp nano;
      if (clock_.nanoseconds) nano = ReadStamp(cut.cells[*clock_.nanoseconds], text.decimal_comma);
      if (!stamp.valid || (clock_.nanoseconds && !nano.valid)) {
        clock.Add(line.number, cell.column,
                  fmt::format("'{}' is no time", QuotedValue(cell.text, 40)));
        continue;
      }
      if (!first) {
        first = stamp;
        first_nano = nano;
      }
      double time_s = clock_.unit_s * (static_cast<double>(stamp.whole - first->whole) +
                                       (stamp.rest - first->rest));
      if (clock_.nanoseconds) time_s += 1e-9 * static_cast<double>(nano.whole - first_nano->whole);
      rows_.push_back({line.number, time_s});
      for (LogSeries& series : log_.series) {
        const TableCell& number = cut.cells[series.column.index];
        const CellNumber read = ReadCell(number.text, text.decimal_comma);
        double value = kNan;
        if (read.kind == CellNumber::Kind::kText) {
          words.Add(line.number, number.column,
                    fmt::format("'{}' in column '{}' is not a number", QuotedValue(number.text, 40),
                                series.column.heading));
        } else if (read.kind == CellNumber::Kind::kNumber) {
          value = series.column.factor * read.value + series.column.shift;
        }
        series.values.push_back(value);
        if (!Shapes(series.column.quantity)) continue;
        std::string cells(number.text);
        if (text.decimal_comma) std::ranges::replace(cells, ',', '.');
        series.cells.push_back(std::move(cells));
      }
    }
    for (const Faults* faults : {&cut_off, &clock, &words}) {
      if (faults->count > 0) {
        Error(faults->line, faults->column, faults->text + More(faults->count),
              faults == &cut_off ? "is another delimiter meant? --map: delimiter"
              : faults == &clock ? "--time HEADING names another column"
                                 : "--ignore HEADING passes a column over");
      }
    }
    if (!first && clock.count == 0) Error(0, 0, "holds no rows", "");
    if (clock_.unit_s < 1.0) {
      decimals_ += static_cast<int>(std::lround(-std::log10(clock_.unit_s)));
    }
    if (clock_.nanoseconds) decimals_ = 9;
    decimals_ = std::clamp(decimals_, 0, kMostDecimals);
  }

  static bool Shapes(LogQuantity quantity) {
    return quantity == LogQuantity::kPosition || quantity == LogQuantity::kVelocity;
  }

  // Arrays without velocities or torques, and sensors that are not there.
  void LeaveEmptyColumns() {
    std::erase_if(log_.series, [&](const LogSeries& series) {
      const LogColumn& column = series.column;
      const bool position = column.quantity == LogQuantity::kPosition;
      const bool none =
          std::ranges::none_of(series.values, [](double v) { return !std::isnan(v); });
      const bool zero = std::ranges::all_of(
          series.values, [&](double v) { return std::isnan(v) || v == column.shift; });
      if (none) {
        log_.notes.push_back(fmt::format("'{}' holds no numbers and is not used", column.heading));
        return true;
      }
      if (!zero || position) return false;
      if (column.quantity == LogQuantity::kVelocity) {
        const LogSeries* moves = log_.Find(column.axis, LogQuantity::kPosition);
        const bool rests = moves != nullptr && std::ranges::all_of(moves->values, [&](double v) {
                             return std::isnan(v) || v == moves->values.front();
                           });
        if (rests) return false;
      }
      log_.notes.push_back(fmt::format("'{}' is zero throughout and is not used", column.heading));
      return true;
    });
  }

  // The rows that `keep` holds, of everything.
  void KeepRows(const std::vector<bool>& keep) {
    const auto filter = [&](auto* items) {
      size_t to = 0;
      for (size_t i = 0; i < keep.size(); ++i) {
        if (!keep[i]) continue;
        if (to != i) (*items)[to] = std::move((*items)[i]);
        ++to;
      }
      items->resize(to);
    };
    filter(&rows_);
    for (LogSeries& series : log_.series) {
      filter(&series.values);
      if (!series.cells.empty()) filter(&series.cells);
    }
  }

  // Rows without all positions (and velocities that shape the motion).
  void LeaveIncompleteRows() {
    std::vector<bool> keep(rows_.size(), true);
    for (const LogSeries& series : log_.series) {
      const LogQuantity quantity = series.column.quantity;
      if (!Shapes(quantity)) continue;
      if (quantity == LogQuantity::kVelocity && settings_.positions_only) continue;
      for (size_t i = 0; i < keep.size(); ++i) keep[i] = keep[i] && !std::isnan(series.values[i]);
    }
    const size_t missing = static_cast<size_t>(std::ranges::count(keep, false));
    if (missing == 0) return;
    const size_t first = static_cast<size_t>(std::ranges::find(keep, false) - keep.begin());
    const double share = static_cast<double>(missing) / static_cast<double>(keep.size());
    const std::string text = fmt::format(
        "{} of {} rows lack a position or a velocity (empty or not "
        "finite)",
        missing, keep.size());
    if (share > kManyMissing) {
      Error(rows_[first].line, 1, text,
            "topics of several rates in one table? resample them to one time, or --ignore what is "
            "not needed");
      return;
    }
    Warn(rows_[first].line, text + " and are left out", "");
    KeepRows(keep);
  }

  bool CheckOrder() {
    Faults back;
    for (size_t i = 1; i < rows_.size() && settings_.rate_hz == 0.0; ++i) {
      if (rows_[i].time_s >= rows_[i - 1].time_s) continue;
      back.Add(
          rows_[i].line, 1,
          fmt::format("the time goes back by {:.6g} s", rows_[i - 1].time_s - rows_[i].time_s));
    }
    if (back.count > 0) {
      Error(back.line, back.column, back.text + More(back.count),
            "two logs in one file, or a clock that was set? cut it there, or sort the rows");
    }
    if (!diagnostics_.has_errors() && settings_.rate_hz == 0.0) LeaveRepeatedRows();
    if (settings_.rate_hz > 0.0) {
      for (size_t i = 0; i < rows_.size(); ++i) {
        rows_[i].time_s = static_cast<double>(i) / settings_.rate_hz;
      }
      decimals_ = kMostDecimals;
    }
    return !diagnostics_.has_errors();
  }

  // Rows with the stamp of the one before: the same message twice, or a clock that is too coarse.
  void LeaveRepeatedRows() {
    std::vector<bool> keep(rows_.size(), true);
    size_t repeated = 0, different = 0, first = 0;
    for (size_t i = 1; i < rows_.size(); ++i) {
      if (rows_[i].time_s > rows_[i - 1].time_s) continue;
      keep[i] = false;
      if (repeated++ == 0) first = i;
      for (const LogSeries& series : log_.series) {
        if (!Shapes(series.column.quantity) || series.values[i] == series.values[i - 1]) continue;
        ++different;
        break;
      }
    }
    if (repeated == 0) return;
    if (static_cast<double>(different) > kManyRepeated * static_cast<double>(rows_.size())) {
      Error(rows_[first].line, 1,
            fmt::format("{} rows have the time of the row before and other positions", different),
            "the stamps are too coarse: --rate HZ spaces the rows evenly");
      return;
    }
    Warn(rows_[first].line,
         fmt::format("{} row{} the time of the row before and {} left out{}", repeated,
                     repeated == 1 ? " has" : "s have", repeated == 1 ? "is" : "are",
                     different > 0 ? fmt::format(", {} with other positions", different) : ""),
         "");
    KeepRows(keep);
  }

  // --from and --to count from the first row of the file.
  void CutPart() {
    const double from_s = std::isnan(settings_.from_s) ? rows_.front().time_s : settings_.from_s;
    const double to_s = std::isnan(settings_.to_s) ? rows_.back().time_s : settings_.to_s;
    std::vector<bool> keep(rows_.size());
    for (size_t i = 0; i < rows_.size(); ++i) {
      keep[i] = rows_[i].time_s >= from_s - 1e-9 && rows_[i].time_s <= to_s + 1e-9;
    }
    const size_t left = static_cast<size_t>(std::ranges::count(keep, true));
    if (left < kFewestRows) {
      const double whole_s = rows_.empty() ? 0.0 : rows_.back().time_s;
      Error(
          0, 0,
          fmt::format("has {} rows{}, at least {} are needed", left,
                      left == rows_.size() ? "" : fmt::format(" from {:g} to {:g} s", from_s, to_s),
                      kFewestRows),
          fmt::format("the log lasts {:.6g} s", whole_s));
      return;
    }
    KeepRows(keep);
    log_.begin_s = rows_.front().time_s;
    for (LogRow& row : rows_) row.time_s -= log_.begin_s;
  }

  // Gaps, an unknown unit of time, uneven rows.
  bool CheckSteps() {
    std::vector<double> steps;
    for (size_t i = 1; i < rows_.size(); ++i) {
      steps.push_back(rows_[i].time_s - rows_[i - 1].time_s);
    }
    std::vector<double> sorted = steps;
    std::ranges::nth_element(sorted,
                             sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2));
    const double median = sorted[sorted.size() / 2];
    log_.step_s = median;
    if (clock_.assumed && median > kSlowest_s) {
      Error(rows_.front().line, 1,
            fmt::format("rows are {:g} s apart, if the time '{}' is in seconds", median,
                        clock_.heading),
            "--time-unit ms, us or ns");
      return false;
    }
    Faults gaps, uneven;
    size_t part = 0, best = 0, best_length = 0;
    for (size_t i = 0; i < steps.size(); ++i) {
      if (steps[i] > kGap * median) {
        gaps.Add(rows_[i + 1].line, 1,
                 fmt::format("no row for {:.4g} s after {:.6g} s, where rows are {:.3g} s apart",
                             steps[i], log_.begin_s + rows_[i].time_s, median));
        if (i - part > best_length) {
          best = part;
          best_length = i - part;
        }
        part = i + 1;
      } else if (std::abs(steps[i] - median) > (kSlack - 1.0) * median) {
        uneven.Add(rows_[i + 1].line, 1,
                   fmt::format("a row is {:.4g} s after the one before", steps[i]));
      }
    }
    if (gaps.count > 0) {
      if (rows_.size() - 1 - part > best_length) {
        best = part;
        best_length = rows_.size() - 1 - part;
      }
      Error(gaps.line, gaps.column, gaps.text + More(gaps.count),
            fmt::format("nothing says how the robot moved there; the longest part without a gap: "
                        "--from {:.6g} --to {:.6g}",
                        log_.begin_s + rows_[best].time_s,
                        log_.begin_s + rows_[best + best_length].time_s));
      return false;
    }
    if (uneven.count > 0) {
      Warn(uneven.line,
           fmt::format("{} of {} steps differ by more than half from the usual {:.4g} s: {}",
                       uneven.count, steps.size(), median, uneven.text),
           "the stamps are taken as they are; --rate HZ spaces the rows evenly instead");
    }
    return true;
  }

  // Encoders that begin again after a turn.
  void UnwrapAngles() {
    constexpr double kTurn = 2.0 * std::numbers::pi;
    for (LogSeries& series : log_.series) {
      const LogColumn& column = series.column;
      if (column.quantity != LogQuantity::kPosition || axes_[column.axis].unit != "rad") continue;
      double turns = 0.0;
      size_t jumps = 0, first = 0;
      double before = series.values[0];
      for (size_t i = 1; i < series.values.size(); ++i) {
        const double raw = series.values[i];
        const double jump = std::round((raw - before) / kTurn);
        before = raw;
        if (jump != 0.0) {
          if (jumps++ == 0) first = i;
          turns -= jump;
        }
        if (turns == 0.0) continue;
        series.values[i] = raw + turns * kTurn;
        series.cells[i] = fmt::format("{:.12f}", (series.values[i] - column.shift) / column.factor);
      }
      if (jumps == 0) continue;
      Warn(rows_[first].line,
           fmt::format("'{}' jumps by whole turns {} time{}: they are taken out", column.heading,
                       jumps, jumps == 1 ? "" : "s"),
           "");
    }
  }

  void StampRows() {
    const auto last = static_cast<double>(rows_.size() - 1);
    const double mean = rows_.back().time_s / last;
    const double rounding = 0.75 * std::pow(10.0, -decimals_);
    log_.even = true;
    for (size_t i = 0; i < rows_.size(); ++i) {
      const double off = std::abs(rows_[i].time_s - mean * static_cast<double>(i));
      log_.even = log_.even && off <= rounding + 1e-6 * mean;
    }
    for (size_t i = 0; i < rows_.size(); ++i) {
      log_.stamps.push_back(fmt::format("{:.{}f}", rows_[i].time_s, decimals_));
      log_.time_s.push_back(log_.even ? mean * static_cast<double>(i) : rows_[i].time_s);
    }
    if (log_.even) log_.step_s = mean;
  }

  const LogSettings& settings_;
  const std::vector<LogAxis>& axes_;
  Diagnostics& diagnostics_;
  LogClock clock_;
  int decimals_ = 0;  // of the stamps in seconds
  std::vector<LogRow> rows_;
  RobotLog log_;
};

}  // namespace

const LogSeries* RobotLog::Find(size_t axis, LogQuantity quantity) const {
  for (const LogSeries& one : series) {
    if (one.column.axis == axis && one.column.quantity == quantity) return &one;
  }
  return nullptr;
}

std::optional<RobotLog> ReadLog(const std::string& file, const LogSettings& settings,
                                const std::vector<LogAxis>& axes, Diagnostics* diagnostics) {
  return LogReader(file, settings, axes, diagnostics).Read();
}

bool CheckLogRanges(const RobotLog& log, const std::vector<LogAxis>& axes,
                    Diagnostics* diagnostics) {
  bool good = true;
  for (const LogSeries& series : log.series) {
    const LogColumn& column = series.column;
    if (column.quantity != LogQuantity::kPosition) continue;
    const LogAxis& axis = axes[column.axis];
    const auto [low, high] = std::ranges::minmax(series.values);
    const double room = 1e-9 * (1.0 + std::abs(low) + std::abs(high));
    if (low >= axis.range.lower - room && high <= axis.range.upper + room) continue;
    constexpr double kDegree = std::numbers::pi / 180.0;
    const bool degrees = axis.unit == "rad" && column.unit == "rad" &&
                         kDegree * low >= axis.range.lower && kDegree * high <= axis.range.upper;
    Finding finding;
    finding.file = log.file;
    finding.line = column.line;
    finding.column = column.character;
    finding.message = fmt::format(
        "'{}' runs from {:.5g} to {:.5g} {}, the range of {} is {:.5g} … "
        "{:.5g} {}",
        column.heading, low, high, axis.unit, axis.name(), axis.range.lower, axis.range.upper,
        axis.unit);
    finding.hint = degrees ? "as degrees all of it lies in the range: --degrees"
                           : "sign, unit or zero of the column? a map file states them (sign, "
                             "unit, offset); --ignore-ranges takes it as it is";
    diagnostics->Add(std::move(finding));
    good = false;
  }
  return good;
}

}  // namespace mbv
