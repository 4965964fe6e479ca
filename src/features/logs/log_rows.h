// A robot's log: rows in order of time, its columns in SI.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "features/logs/log_columns.h"

namespace mbv {

/// A column with its numbers.
struct LogSeries {
  LogColumn column;
  std::vector<double> values;      ///< SI, one per row; NaN where the log has none
  std::vector<std::string> cells;  ///< positions and velocities: as printed, with a decimal point
};

struct RobotLog {
  std::string file, name;           ///< path; without folder
  std::vector<double> time_s;       ///< from the first row used, increasing
  std::vector<std::string> stamps;  ///< as time_s, with the digits of the file
  double begin_s = 0.0;             ///< of the first row used, from the first row of the file
  double step_s = kNan;             ///< between rows, median
  bool even = false;                ///< rows lie step_s apart, up to the digits of their stamps
  std::vector<LogSeries> series;
  std::vector<std::string> notes;

  [[nodiscard]] const LogSeries* Find(size_t axis, LogQuantity quantity) const;
};

/// Reads a log; every fault of its columns and rows is a finding about the file. Empty after
/// errors.
[[nodiscard]] std::optional<RobotLog> ReadLog(const std::string& file, const LogSettings& settings,
                                              const std::vector<LogAxis>& axes,
                                              Diagnostics* diagnostics);

/// Positions that leave the ranges of the model: an error each. After an error false.
[[nodiscard]] bool CheckLogRanges(const RobotLog& log, const std::vector<LogAxis>& axes,
                                  Diagnostics* diagnostics);

}  // namespace mbv
