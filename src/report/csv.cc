#include <fmt/format.h>

#include <array>
#include <iterator>

#include "report/report.h"

namespace mbv {
namespace {

constexpr std::array<const char*, 4> kDriveSignals = {"position", "velocity", "acceleration",
                                                      "force"};

struct CsvColumn {
  const Trace* trace;
  int column;
};

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
  [[nodiscard]] const Trace* first() const { return traces_.empty() ? nullptr : traces_.front(); }

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
        for (const char* signal : kDriveSignals) {
          const int column = traces_[w]->Find(drive + "." + signal);
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
  const Columns columns(report);
  std::string text = columns.header() + "\n";
  if (columns.first() == nullptr) return text;
  const std::vector<double>& times = columns.first()->time_s;
  auto out = std::back_inserter(text);
  for (size_t i = 0; i < times.size(); ++i) {
    fmt::format_to(out, "{:.17g}", times[i]);
    for (const CsvColumn& c : columns.columns()) {
      // All witnesses sample the scenario's grid; a shorter trace ends early.
      const bool there = i < c.trace->time_s.size();
      fmt::format_to(out, ",{:.17g}",
                     there ? c.trace->values(static_cast<Eigen::Index>(i), c.column) : kNan);
    }
    text += '\n';
  }
  return text;
}

}  // namespace mbv
