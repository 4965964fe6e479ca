#include "report/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>

#include "comparison/metrics.h"

namespace mbv {
namespace {

constexpr std::array<Quantity, 4> kDriveSignals = {Quantity::kPosition, Quantity::kVelocity,
                                                   Quantity::kAcceleration, Quantity::kForce};

struct CsvColumn {
  const Trace* trace;
  int column;
};

// For each sample of the grid the row of a trace; -1 where it has none.
std::vector<Eigen::Index> RowsOf(const Trace& grid, const Trace& trace) {
  std::vector<Eigen::Index> rows(grid.time_s.size(), -1);
  for (const auto& [i, j] : AlignSamples(grid, trace)) rows[static_cast<size_t>(i)] = j;
  return rows;
}

class Columns {
 public:
  explicit Columns(const Report& report) {
    for (const WitnessRecord& witness : report.witnesses) {
      if (!witness.trace.time_s.empty()) traces_.push_back(&witness.trace);
    }
    used_.resize(traces_.size());
    for (size_t w = 0; w < traces_.size(); ++w) used_[w].resize(traces_[w]->channels.size());
    AddDrives(report);
    AddRest();
  }

  [[nodiscard]] const std::string& header() const { return header_; }
  [[nodiscard]] const std::vector<CsvColumn>& columns() const { return columns_; }
  // The longest: a table has fewer rows, a witness that broke down ends early.
  [[nodiscard]] const Trace* grid() const {
    const auto longest = std::max_element(
        traces_.begin(), traces_.end(),
        [](const Trace* a, const Trace* b) { return a->time_s.size() < b->time_s.size(); });
    return longest == traces_.end() ? nullptr : *longest;
  }

 private:
  void Add(size_t w, int column) {
    used_[w][static_cast<size_t>(column)] = true;
    const Channel& channel = traces_[w]->channels[static_cast<size_t>(column)];
    header_ += "," + channel.name + "." + traces_[w]->witness;
    columns_.push_back({traces_[w], column});
  }

  void AddDrives(const Report& report) {
    for (const std::string& drive : report.drives) {
      for (size_t w = 0; w < traces_.size(); ++w) {
        for (const Quantity signal : kDriveSignals) {
          const int column = traces_[w]->Find(signal, drive);
          if (column >= 0) Add(w, column);
        }
      }
    }
  }

  void AddRest() {
    for (size_t w = 0; w < traces_.size(); ++w) {
      for (size_t c = 0; c < traces_[w]->channels.size(); ++c) {
        if (!used_[w][c]) Add(w, static_cast<int>(c));
      }
    }
  }

  std::vector<const Trace*> traces_;
  std::vector<std::vector<bool>> used_;
  std::string header_ = "time_s";
  std::vector<CsvColumn> columns_;
};

}  // namespace

std::string ToCsv(const Report& report) {
  std::string text;
  WriteCsv(report, [&](std::string_view piece) { text += piece; });
  return text;
}

void WriteCsv(const Report& report, const std::function<void(std::string_view)>& write) {
  constexpr size_t kPiece = 1 << 16;
  const Columns columns(report);
  std::string text = columns.header() + "\n";
  const Trace* grid = columns.grid();
  if (grid == nullptr) return write(text);
  std::map<const Trace*, std::vector<Eigen::Index>> rows;
  for (const CsvColumn& c : columns.columns()) {
    if (!rows.contains(c.trace)) rows[c.trace] = RowsOf(*grid, *c.trace);
  }
  auto out = std::back_inserter(text);
  for (size_t i = 0; i < grid->time_s.size(); ++i) {
    fmt::format_to(out, "{:.17g}", grid->time_s[i]);
    for (const CsvColumn& c : columns.columns()) {
      const Eigen::Index row = rows[c.trace][i];
      fmt::format_to(out, ",{:.17g}", row >= 0 ? c.trace->values(row, c.column) : kNan);
    }
    text += '\n';
    if (text.size() < kPiece) continue;
    write(text);
    text.clear();
  }
  write(text);
}

}  // namespace mbv
