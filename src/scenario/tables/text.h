// The text of a table file: lines, cells, delimiter, heading. What the numbers mean comes later.
//
// Tables come from MATLAB, ADAMS, Simscape, Excel and numpy, so much is found out by looking:
// delimiter, decimal sign, title, heading and unit rows, comments, byte order mark, line ends.
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostics.h"

// Numbers of a table as text: value, and how many digits were printed.

namespace mbv {

/// One cell.
struct CellNumber {
  enum class Kind {
    kNumber,
    kEmpty,
    kNotFinite,  ///< NaN, Inf, #N/A, 1.#QNAN
    kText,
  };
  Kind kind = Kind::kText;
  double value = 0.0;
  int decimals = 0;            ///< digits behind the point less the exponent: 1.250e+02 has 1
  int significant = 0;         ///< digits from the first one that is not 0; 0 for zero
  bool trailing_zero = false;  ///< ends in a 0 behind the point, as %.3f and %.3e print
};

/// Reads "1.5", "-1,5" (with `decimal_comma`), "+2.E3", "1.0D-03".
[[nodiscard]] CellNumber ReadCell(std::string_view text, bool decimal_comma);

/// What the printed digits of a column have in common.
class DigitStatistics {
 public:
  void Add(const CellNumber& cell);

  [[nodiscard]] int decimals() const { return decimals_; }
  [[nodiscard]] int significant() const { return significant_; }
  /// Few different values, or values in exactly equal steps: the digits left out may be zeros that
  /// the writer dropped, so the column says little about its own format.
  [[nodiscard]] bool says_little() const {
    return distinct_.size() < kEnoughValues || equal_steps_;
  }

 private:
  static constexpr size_t kEnoughValues = 12;  // different values that show a format
  int decimals_ = 0, significant_ = 0;
  bool equal_steps_ = true;
  size_t count_ = 0;
  double last_ = 0.0, step_ = 0.0;
  std::vector<double> distinct_;  // at most kEnoughValues
};

/// The printed step of each value: one unit of its last digit. Serves both fixed decimals (%.3f)
/// and a fixed number of digits (%.5g, %.4e): a value's step is the coarser of 10^-decimals and
/// its leading digit's power less the digits, both with the column's largest counts. A column that
/// says little takes the digits of the rest of the table (`table_significant`, 0: none known).
[[nodiscard]] std::vector<double> PrintedSteps(std::span<const double> values,
                                               const DigitStatistics& digits,
                                               int table_significant);

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

// Units of table columns: what MATLAB, ADAMS, Simscape and Excel users write, in SI.

/// A unit of a column.
struct TableUnit {
  std::string text;     ///< as written, without brackets: "kN"
  std::string si;       ///< the SI unit of its kind, spelled as in channels: "N", "N m", "rad/s"
  double factor = 1.0;  ///< SI value = factor · value
};

/// The unit written in `text`: "kN", "(newton)", "[N*mm]", "mm/s^2", "deg/sec**2", "rpm"; products
/// by `*`, `·`, `-`, `.` or a space, quotients by `/`. Empty when it is not a unit that is known.
[[nodiscard]] std::optional<TableUnit> FindUnit(std::string_view text);

/// "did you mean 'kN'?" for a misspelt unit, else the list of units of the kind `si` ("" for all).
[[nodiscard]] std::string UnitHint(const std::string& text, const std::string& si = "");

/// `text` without blanks at its ends and without one pair of brackets around it.
[[nodiscard]] std::string_view StripUnit(std::string_view text);

}  // namespace mbv
