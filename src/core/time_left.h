// How long something will take, in words.
#pragma once

#include <string>

namespace mbv {

/// "12 s", "3 min", "2.5 h".
[[nodiscard]] std::string TimeText(double seconds);

/// How long the rest of something takes if it goes on as fast as so far.
class TimeLeft {
 public:
  /// "about 2 min left", of the fraction that is done at the time `now_s`; "" in the first seconds
  /// and in the last one. A fraction that falls is another thing's.
  [[nodiscard]] std::string Text(double fraction, double now_s);

 private:
  double start_s_ = 0.0, first_ = -1.0, last_ = -1.0;
};

}  // namespace mbv
