#include "report/csv.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>

#include "comparison/force_band.h"
#include "comparison/metrics.h"

namespace mbv {
namespace {

constexpr std::array<Quantity, 4> kDriveSignals = {Quantity::kPosition, Quantity::kVelocity,
                                                   Quantity::kAcceleration, Quantity::kForce};

// What of a force that friction at rest may leave open.
enum class End { kNumber, kLower, kUpper };

struct CsvColumn {
  const Trace* trace;
  ForceSignal signal;  // any channel: only forces have bands
  End end = End::kNumber;

  // The number where there is one, or an end of the band.
  [[nodiscard]] double At(Eigen::Index row) const {
    const ForceBand force = signal.At(row);
    if (end == End::kNumber) return force.open() ? kNan : force.middle;
    return end == End::kLower ? force.lower() : force.upper();
  }
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
    columns_.push_back({traces_[w], ForceSignal(*traces_[w], column)});
    AddBand(w, channel);
  }

  // Lower and upper ends beside the force, in place of the half-width.
  void AddBand(size_t w, const Channel& force) {
    const Quantity quantity = BandOf(force.quantity);
    const int band = quantity == Quantity::kOwn ? -1 : traces_[w]->Find(quantity, force.subject);
    if (band < 0) return;
    used_[w][static_cast<size_t>(band)] = true;
    for (const auto& [word, end] : {std::pair{"lower", End::kLower}, {"upper", End::kUpper}}) {
      header_ += fmt::format(",{}.{}.{}", force.name, word, traces_[w]->witness);
      columns_.push_back({traces_[w], columns_.back().signal, end});
    }
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
      fmt::format_to(out, ",{:.17g}", row >= 0 ? c.At(row) : kNan);
    }
    text += '\n';
    if (text.size() < kPiece) continue;
    write(text);
    text.clear();
  }
  write(text);
}

}  // namespace mbv
