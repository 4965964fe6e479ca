// A robot's log against the model: what was measured of each drive beside what the model needs.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "features/logs/log_fit.h"
#include "features/logs/log_rows.h"
#include "report/report.h"

namespace mbv {

/// One drive.
struct LogDrive {
  std::string name, unit, heading;
  LogFit fit = {};
  std::vector<double> time_s = {}, log = {}, model = {}, velocity = {};  ///< at the log's rows
};

/// A rate or acceleration of the log against that of the motion.
struct LogRate {
  std::string signal, unit;
  double rms = kNan;             ///< of the log's
  double rms_difference = kNan;  ///< of both
  bool shapes = false;           ///< it is one of the data that the motion's spline follows
};

struct LogComparison {
  std::string file, name;
  size_t rows = 0;
  double begin_s = 0.0, duration_s = 0.0, step_s = kNan;
  bool even = false;
  std::string witness;  ///< whose forces "model" is; "" where none ran
  std::vector<LogDrive> drives;
  std::vector<LogRate> rates;
  std::vector<MotionTable> tables;  ///< how positions were smoothed
  std::vector<SmoothedForce> smoothed_forces;
  /// Signal, heading, unit of the numbers: every column that is used.
  std::vector<std::array<std::string, 3>> columns;
  std::vector<std::string> notes;
};

/// RMS of the noise that smoothing leaves in the second derivative [unit/s²]: white noise of
/// deviation σ in rows a time h apart, passed by 1/(1 + (f/f₀)⁶) and differentiated twice, is
///   σ √(2 h K) (2π)² f₀^(5/2),  K = ∫₀^∞ x⁴/(1 + x⁶)² dx = π/18.
/// NaN where rates shape the spline, or nothing is smoothed.
[[nodiscard]] double AccelerationNoise(const MotionTable& table);

/// `names`: what the run's model calls the axes.
[[nodiscard]] LogComparison CompareLog(const RobotLog& log, const std::vector<LogAxis>& axes,
                                       const std::vector<std::string>& names,
                                       const std::vector<bool>& shaping, const Report& report,
                                       double most_delay_s);

/// The largest share of a drive; infinite where a log is zero and the model is not, and without
/// one.
[[nodiscard]] double LargestShare(const LogComparison& comparison);

/// For a terminal.
[[nodiscard]] std::string ToText(const LogComparison& comparison, const TextStyle& style);
/// log.json: schema mbverify.log_comparison/1.
[[nodiscard]] nlohmann::ordered_json ToJson(const LogComparison& comparison);
/// log.html, log.csv and log.json.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> LogFiles(
    const LogComparison& comparison, const Report& report);

}  // namespace mbv
