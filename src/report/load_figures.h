// What drives and joints bear over a run: the figures by which motors, bearings and links are
// chosen.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/report.h"

namespace mbv {

/// Over the samples that are numbers; NaN without any. Mean and RMS are over time, by the
/// trapezoidal rule.
struct Figures {
  std::string unit;
  double peak = kNan;    ///< the value of largest magnitude, with its sign
  double time_s = kNan;  ///< of the peak
  double rms = kNan, mean = kNan;
};

/// One drive by one witness; where friction at rest leaves the force open, by the end of its band
/// that is farther from zero.
struct DriveLoad {
  std::string drive, witness;
  Figures force = {}, power = {},
          speed = {};    ///< power: force · velocity, positive into the mechanism [W]
  double stroke = kNan;  ///< largest − smallest position
  std::string stroke_unit = {};
};

/// Magnitudes of one joint's reaction by one witness, see ReactionChannels().
struct JointLoad {
  std::string joint, witness;
  Figures force, moment;    ///< NaN where the witness does not record all three components
  bool not_unique = false;  ///< statics leaves some component open: this is one choice of many
};

struct LoadFigures {
  std::vector<DriveLoad> drives;  ///< by drive in model order, then by witness
  std::vector<JointLoad> joints;  ///< by joint in the order of the traces, then by witness
  /// Witnesses whose samples do not resolve what they bear, and why: the figures are those of the
  /// samples alone.
  std::vector<std::pair<std::string, std::string>> unresolved = {};
};
/// Of all witnesses that ran.
[[nodiscard]] LoadFigures LoadFiguresOf(const Report& report);

/// A signal and its unit; empty when the trace has none.
struct LoadSignal {
  VecX values;
  std::string unit;
};
/// Magnitude of three components of a joint's reaction: the force (`first` = 0) or the moment (3);
/// empty unless all are there.
[[nodiscard]] LoadSignal ReactionMagnitude(const Trace& trace, const std::string& joint, int first);

/// Of one signal; `values` as long as `time_s`.
[[nodiscard]] Figures FiguresOf(const std::vector<double>& time_s, const VecX& values,
                                const std::string& unit);

}  // namespace mbv
