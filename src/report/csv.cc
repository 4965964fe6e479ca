#include "report/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>
#include <map>

#include "base/json_text.h"
#include "base/text.h"
#include "comparison/force_band.h"
#include "comparison/metrics.h"

namespace mbv {
namespace {

constexpr std::array<Quantity, 4> kDriveSignals = {Quantity::kPosition, Quantity::kVelocity,
                                                   Quantity::kAcceleration, Quantity::kForce};

struct CsvColumn {
  const Trace* trace;
  ShownColumn shown;
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
    for (const Trace* trace : traces_) waiting_.push_back(ShownColumns(*trace));
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
  void AddDrives(const Report& report) {
    for (const std::string& drive : report.drives) {
      for (size_t w = 0; w < traces_.size(); ++w) {
        for (const Quantity signal : kDriveSignals) {
          const int source = traces_[w]->Find(signal, drive);
          Add(w, [source](const ShownColumn& shown) { return shown.source == source; });
        }
      }
    }
  }

  void AddRest() {
    for (size_t w = 0; w < traces_.size(); ++w) {
      Add(w, [](const ShownColumn&) { return true; });
    }
  }

  // Those that wait and are wanted.
  template <typename Wanted>
  void Add(size_t w, const Wanted& wanted) {
    for (const ShownColumn& shown : waiting_[w]) {
      if (!wanted(shown)) continue;
      header_ += "," + CsvCell(fmt::format("{}.{}", shown.channel.name, traces_[w]->witness));
      columns_.push_back({traces_[w], shown});
    }
    std::erase_if(waiting_[w], wanted);
  }

  std::vector<const Trace*> traces_;
  std::vector<std::vector<ShownColumn>> waiting_;
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
      fmt::format_to(out, ",{:.17g}", row >= 0 ? c.shown.At(row) : kNan);
    }
    text += '\n';
    if (text.size() < kPiece) continue;
    write(text);
    text.clear();
  }
  write(text);
}

std::string CsvMetadata(const Report& report) {
  using Json = nlohmann::ordered_json;
  Json list = {{{"name", "time_s"}, {"datatype", "double"}, {"schema:unitText", "s"}}};
  const Columns columns(report);
  for (const CsvColumn& c : columns.columns()) {
    const Channel& channel = c.shown.channel;
    list.push_back({{"name", channel.name + "." + c.trace->witness},
                    {"datatype", "double"},
                    {"schema:unitText", channel.unit},
                    {"urn:mbverify:quantity", SignalWord(channel)},
                    {"urn:mbverify:subject", channel.subject},
                    {"urn:mbverify:frame", channel.frame},
                    {"urn:mbverify:witness", c.trace->witness}});
  }
  return Dump({{"@context", "http://www.w3.org/ns/csvw"},
               {"url", "traces.csv"},
               {"dc:title", report.mechanism + " / " + report.scenario},
               {"null", "nan"},
               {"tableSchema", {{"columns", std::move(list)}}}});
}

}  // namespace mbv
