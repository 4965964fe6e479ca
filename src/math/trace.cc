#include "math/trace.h"

#include <cmath>

namespace mbv {

int Trace::Find(const std::string& name) const {
  for (size_t i = 0; i < channels.size(); ++i) {
    if (channels[i].name == name) return static_cast<int>(i);
  }
  return -1;
}

void Trace::Reset(std::vector<double> times_s, std::vector<Channel> new_channels) {
  time_s = std::move(times_s);
  channels = std::move(new_channels);
  values.setConstant(static_cast<Eigen::Index>(time_s.size()),
                     static_cast<Eigen::Index>(channels.size()), kNan);
}

std::vector<double> SampleTimes(double duration_s, double sample_s) {
  const auto intervals = static_cast<size_t>(std::floor(duration_s / sample_s + 1e-9));
  std::vector<double> times(intervals + 1);
  for (size_t i = 0; i < times.size(); ++i) times[i] = static_cast<double>(i) * sample_s;
  return times;
}

}  // namespace mbv
