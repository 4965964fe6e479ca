// What the terminal is like, text that fits it, and progress on it.
#pragma once

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <set>
#include <string>
#include <string_view>

#include "base/diagnostics.h"
#include "base/worker_pool.h"

namespace mbv {

/// Columns of the terminal that `to` is: COLUMNS if it is set, else what the terminal says; 0 where
/// `to` is none.
[[nodiscard]] size_t TerminalColumns(std::FILE* to);

/// A terminal that obeys cursor movements: TERM is not dumb.
[[nodiscard]] bool ObeysEscapes(std::FILE* to);

/// Colour: such a terminal or FORCE_COLOR, and NO_COLOR is not set.
[[nodiscard]] bool WantsColor(std::FILE* to = stdout);

/// Prints text to read, broken into lines that fit the terminal. What was printed to stdout
/// before comes before.
void SayText(std::FILE* to, std::string_view text);

template <typename... T>
void Say(std::FILE* to, fmt::format_string<T...> format, T&&... values) {
  SayText(to, fmt::format(format, std::forward<T>(values)...));
}

/// Prints findings, each once while the program runs: scenarios of one model share its warnings.
class FindingPrinter {
 public:
  explicit FindingPrinter(std::FILE* to) : to_(to) {}
  void Print(const Diagnostics& diagnostics);
  /// `model` was made of files whose findings are printed: their warnings are not repeated for it.
  void AddMadeModel(const std::filesystem::path& model) { made_.insert(model.lexically_normal()); }

 private:
  std::FILE* to_;
  std::set<std::string> reported_, messages_;
  std::set<std::filesystem::path> made_;
};

/// One line on stderr that rewrites itself, with the time left; does nothing unless stderr is a
/// terminal that can.
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
  TimeLeft left_;
};

}  // namespace mbv
