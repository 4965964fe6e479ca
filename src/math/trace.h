// Trace: a time grid with named channels, the one currency between the stages.
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "math/channel.h"

namespace mbv {

/// Samples of channels on a common time grid. Witnesses sample at the same times, so traces are
/// compared without interpolation.
struct Trace {
  std::string witness;            ///< name of its role (base/roles.h)
  std::vector<double> time_s;     ///< n sample times [s], increasing
  std::vector<Channel> channels;  ///< m channels
  MatX values;                    ///< n × m
  /// Times [s] at which accelerations jump because dry friction stops or starts, increasing.
  std::vector<double> breaks_s = {};

  /// Column of the channel with this name, or -1.
  [[nodiscard]] int Find(const std::string& name) const;
  [[nodiscard]] int Find(Quantity quantity, const std::string& subject = "",
                         int component = -1) const {
    return Find(ChannelName(quantity, subject, component));
  }
  /// Sets channels and times and fills the values with NaN.
  void Reset(std::vector<double> times_s, std::vector<Channel> new_channels);
};

/// 0, dt, 2dt, … up to and including `duration_s` (n = round(duration/sample) + 1 samples; the
/// grid is i·sample_s, computed without accumulating).
[[nodiscard]] std::vector<double> SampleTimes(double duration_s, double sample_s);

}  // namespace mbv
