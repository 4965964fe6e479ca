#include "core/time_left.h"

#include <fmt/format.h>

namespace mbv {

std::string TimeText(double seconds) {
  if (seconds < 100.0) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000.0) return fmt::format("{:.0f} min", seconds / 60.0);
  return fmt::format("{:.1f} h", seconds / 3600.0);
}

std::string TimeLeft::Text(double fraction, double now_s) {
  constexpr double kTooEarly_s = 2.0, kTooLate_s = 1.0;
  if (first_ < 0.0 || fraction < last_) {
    first_ = fraction;
    start_s_ = now_s;
  }
  last_ = fraction;
  const double elapsed_s = now_s - start_s_;
  if (elapsed_s < kTooEarly_s || fraction <= first_) return "";
  const double left_s = elapsed_s * (1.0 - fraction) / (fraction - first_);
  return left_s < kTooLate_s ? "" : "about " + TimeText(left_s) + " left";
}

}  // namespace mbv
