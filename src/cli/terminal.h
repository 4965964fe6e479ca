// What the terminal is like, and progress on it.
#pragma once

#include <string>

namespace mbv {

/// Colour on stdout: a terminal, and NO_COLOR is not set.
[[nodiscard]] bool WantsColor();

/// One line on stderr that rewrites itself; does nothing unless stderr is a terminal.
class ProgressLine {
 public:
  explicit ProgressLine(bool wanted);
  ~ProgressLine() { Clear(); }
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  [[nodiscard]] bool active() const { return active_; }
  void Show(const std::string& what, double fraction);
  void Clear();

 private:
  bool active_ = false, shown_ = false;
  int last_percent_ = -1;
  std::string last_what_;
};

}  // namespace mbv
