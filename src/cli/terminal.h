// What the terminal is like, and progress on it.
#pragma once

#include <cstdio>
#include <set>
#include <string>

#include "core/diagnostics.h"

namespace mbv {

/// Prints findings, each once while the program runs: scenarios of one model share its warnings.
class FindingPrinter {
 public:
  explicit FindingPrinter(std::FILE* to) : to_(to) {}
  void Print(const Diagnostics& diagnostics);

 private:
  std::FILE* to_;
  std::set<std::string> told_;
};

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
