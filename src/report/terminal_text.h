// The text of a result for a terminal: title with verdict, what is said about it, checks, tables.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "report/document.h"
#include "report/result.h"

namespace mbv {

class TerminalText {
 public:
  explicit TerminalText(const TableOptions& options) : options_(options) {}

  [[nodiscard]] bool verbose() const { return options_.verbose; }
  [[nodiscard]] bool sizing() const { return options_.sizing; }
  [[nodiscard]] const std::string& text() const { return text_; }

  /// Coloured where the terminal is.
  [[nodiscard]] std::string Painted(const std::string& text, Paint paint) const {
    return mbv::Painted(text, paint, options_.color);
  }
  [[nodiscard]] std::string Word(Verdict verdict) const;

  void Line(const std::string& text = "") { text_ += text + "\n"; }

  /// "title: VERDICT"; below it the description, `about`, reason, caveats, attribution and
  /// findings.
  void Head(const ResultView& view, const std::string& title,
            const std::vector<std::string>& about);
  /// All checks by subject; unless verbose, those that pass and are not key are counted only.
  void Checks(const ResultView& view);
  /// What could not be compared, and why.
  void Gaps(const ResultView& view);
  /// After a blank line.
  void Add(const Table& table) { text_ += "\n" + ToText(table, Style()); }
  void Add(const ReportSection& section) { text_ += ToText(section, Style()); }
  /// How long each part took, then `more`.
  void Times(const std::vector<std::pair<const char*, double>>& parts, double total_s,
             const std::string& more = "");

 private:
  [[nodiscard]] TextStyle Style() const {
    return {.color = options_.color, .columns = options_.columns};
  }
  [[nodiscard]] bool Shown(const ShownCheck& check) const;

  const TableOptions options_;
  std::string text_;
};

}  // namespace mbv
