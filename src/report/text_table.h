// A table of plain text: its columns are given once, for the headings and for every row.
#pragma once

#include <fmt/format.h>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "report/result.h"

// Numbers in tables of text.

namespace mbv {

/// "-" for NaN.
[[nodiscard]] inline std::string NumberCell(double value, const char* format = "{:.2e}") {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

struct TextColumn {
  std::string heading;
  int width = 0;  ///< characters: above 0 to the right, below 0 to the left; 0: as long as it is
};

class TextTable {
 public:
  /// `indent` stands before every line.
  TextTable(std::string indent, std::vector<TextColumn> columns);

  /// The headings as one line, without its end.
  [[nodiscard]] std::string Head() const;
  /// Cells of the first columns as one line, without its end.
  [[nodiscard]] std::string Row(const std::vector<std::string>& cells) const;

 private:
  std::string indent_;
  std::vector<TextColumn> columns_;
};

// The text of a result for a terminal: title with verdict, what is said about it, checks, tables.

enum class Paint { kPlain, kGood, kBad, kWarning, kTitle, kFaint };

class TerminalText {
 public:
  explicit TerminalText(const TableOptions& options) : options_(options) {}

  [[nodiscard]] bool verbose() const { return options_.verbose; }
  [[nodiscard]] bool sizing() const { return options_.sizing; }
  [[nodiscard]] const std::string& text() const { return text_; }

  /// Coloured where the terminal is.
  [[nodiscard]] std::string Painted(const std::string& text, Paint paint) const;
  [[nodiscard]] std::string Word(Verdict verdict) const;

  void Line(const std::string& text = "") { text_ += text + "\n"; }

  /// "title: VERDICT"; below it the description, `about`, reason, reservations, attribution and
  /// findings.
  void Head(const ResultView& view, const std::string& title,
            const std::vector<std::string>& about);
  /// All checks by subject; unless verbose, those that pass and are not key are counted only.
  void Checks(const ResultView& view);
  /// What could not be compared, and why.
  void Gaps(const ResultView& view);
  /// What a section of the page shows: its texts and tables that are not folded.
  void Add(const std::vector<Block>& blocks);
  /// After a blank line, the headings of a table.
  void TableHead(const TextTable& table);
  /// How long each part took, then `more`.
  void Times(const std::vector<std::pair<const char*, double>>& parts, double total_s,
             const std::string& more = "");

 private:
  void Subject(const std::vector<ShownCheck>& checks, const TextTable& table);
  [[nodiscard]] std::string CheckLine(const ShownCheck& check, const TextTable& table) const;

  const TableOptions options_;
  std::string text_;
};

}  // namespace mbv
