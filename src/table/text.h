// The text of a table file: lines, cells, delimiter, heading. What the numbers mean comes later.
//
// Tables come from MATLAB, ADAMS, Simscape, Excel and numpy, so much is found out by looking:
// delimiter, decimal sign, title, heading and unit rows, comments, byte order mark, line ends.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/diagnostics.h"

namespace mbv {

/// What a scenario states about the text; what is left out is found out.
struct TableFormat {
  std::optional<char> delimiter;  ///< '\t', ',', ';' or ' ' for any white space
  std::optional<bool> decimal_comma;
  std::optional<int> heading_rows;  ///< lines before the numbers, comments and blank lines not
                                    ///< counted
};

/// A line that is neither blank nor a comment.
struct TableLine {
  std::string_view text;
  int number = 0;  ///< 1-based, in the file
};

struct TableCell {
  std::string_view text;  ///< without blanks and quotes
  int column = 0;         ///< 1-based character of the line
};

/// A column as the heading describes it; all empty without a heading.
struct TableHeading {
  std::string full;  ///< as in the file: "FORCE_1.FX (newton)"
  std::string name;  ///< without the unit: "FORCE_1.FX"
  std::string unit;  ///< from brackets in the heading or from the unit row; may be unknown
  int line = 0, character = 0;  ///< of the unit, or of the name where there is none
};

/// A table cut into lines, and its heading. Refers to the text it was made from.
struct TableText {
  char delimiter = ',';
  bool decimal_comma = false;
  size_t columns = 0;
  std::vector<TableHeading> headings;  ///< one per column
  bool has_names = false;
  std::vector<TableLine> rows;  ///< those with numbers
};

inline constexpr size_t kMaxTableBytes = 200'000'000;
inline constexpr size_t kMaxTableRows = 2'000'000;
inline constexpr size_t kMaxTableColumns = 2000;

/// Cuts `text` (which must outlive the result) into lines and finds delimiter and heading. Empty
/// after a finding that leaves nothing to read; `file` is used in findings.
[[nodiscard]] std::optional<TableText> CutTable(std::string_view text, const std::string& file,
                                                const TableFormat& format,
                                                Diagnostics* diagnostics);

/// Cuts one line. An unclosed quote leaves `closed` false.
struct CutLine {
  std::vector<TableCell> cells;
  bool closed = true;
};
void CutCells(std::string_view line, char delimiter, CutLine* cut);

/// "a tab", "';'", "white space".
[[nodiscard]] std::string DelimiterName(char delimiter);

}  // namespace mbv
