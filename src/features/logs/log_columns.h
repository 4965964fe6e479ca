// What is known of a robot's log beside the file itself, and which column is what of which joint.
//
// Headings are cut into words. What is left when the words of a drive or joint are taken out says
// what is measured: left_knee_pos, /joint_states/left_knee/effort, tau_left_knee (N*m),
// field.velocity3 (by the names in field.name3, or by `joints`).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/motion.h"
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

enum class LogQuantity { kPosition, kVelocity, kAcceleration, kEffort };
inline constexpr std::array<const char*, 4> kLogQuantities = {"position", "velocity",
                                                              "acceleration", "effort"};

/// What a log may measure: a drive, a prescribed joint or a coordinate of a joint.
struct LogAxis {
  Coordinate coordinate;
  std::vector<std::string> names;  ///< the first one is shown
  std::string unit;                ///< "m" or "rad"
  std::string force_unit;          ///< "N" or "N m"
  CoordinateRange range;
  double size = 1.0;  ///< of its way: 1 rad, or the robot's characteristic length [m]

  [[nodiscard]] const std::string& name() const { return names.front(); }
  [[nodiscard]] bool driven() const { return coordinate.kind != Coordinate::Kind::kJoint; }
  [[nodiscard]] std::string UnitOf(LogQuantity quantity) const;
};
[[nodiscard]] std::vector<LogAxis> LogAxes(const Mechanism& mechanism);

/// A column that is used: value [SI] = factor · number + shift.
struct LogColumn {
  size_t index = 0;     ///< 0-based
  std::string heading;  ///< as in the file
  int line = 0, character = 0;
  size_t axis = 0;  ///< of LogAxes()
  LogQuantity quantity = LogQuantity::kPosition;
  std::string unit;  ///< of the numbers
  double factor = 1.0, shift = 0.0;
  TableColumnSettings stated;  ///< sign, scale and offset
};

/// Where the time of a row stands.
struct LogClock {
  size_t index = 0;
  std::optional<size_t> nanoseconds;  ///< a column with the fraction of the seconds in the first
  std::string heading;
  double unit_s = 1.0;
  bool assumed = false;  ///< nothing says that it is seconds
};

struct LogMapping {
  std::optional<LogClock> clock;   ///< empty after errors
  std::vector<LogColumn> columns;  ///< in the order of the file
  std::vector<std::string> notes;  ///< what was taken for granted, and what is not used
};
/// Unknown, doubled and ambiguous columns are findings about `file`.
[[nodiscard]] LogMapping MapLog(const TableText& text, const std::string& file,
                                const LogSettings& settings, const std::vector<LogAxis>& axes,
                                Diagnostics* diagnostics);

}  // namespace mbv
