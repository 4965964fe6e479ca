// What is known of a robot's log beside the file itself: columns, clock, units, joints.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "scenario/tables/table.h"

namespace mbv {

/// A column that the user names.
struct LogRequest {
  TableColumnSettings column;  ///< `signal`: "left_knee.position"
  Finding place;               ///< where it is stated
};

struct LogSettings {
  TableFormat format;
  std::vector<LogRequest> columns;
  std::vector<std::string> joints;    ///< of arrays: position[0], position[1], …
  std::vector<std::string> ignore;    ///< headings that are passed over
  std::vector<std::string> hold;      ///< drives and joints without a column that rest at home
  std::string time, time_unit;        ///< heading; unit; "": found out
  bool degrees = false;               ///< angles without a unit are in degrees
  bool positions_only = false;        ///< velocities do not shape the motion
  double rate_hz = 0.0;               ///< > 0: rows are so evenly spaced, whatever their stamps
  double from_s = kNan, to_s = kNan;  ///< part of the log, from its first row on
  std::string smoothing = "auto";     ///< as a scenario states it
};

/// Reads a map file (docs/reference/log_files.md) over `settings`.
void ReadLogMap(const std::string& file, LogSettings* settings, Diagnostics* diagnostics);

/// "left_knee.position=HEADING" of --column; false where it is none.
[[nodiscard]] bool AddLogColumn(const std::string& text, LogSettings* settings);

}  // namespace mbv
