// Numbers of a table as text: value, and how many digits were printed.
#pragma once

#include <span>
#include <string_view>
#include <vector>

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
  [[nodiscard]] bool says_little() const { return distinct_.size() < kTelling || equal_steps_; }

 private:
  static constexpr size_t kTelling = 12;  // different values that show a format
  int decimals_ = 0, significant_ = 0;
  bool equal_steps_ = true;
  size_t count_ = 0;
  double last_ = 0.0, step_ = 0.0;
  std::vector<double> distinct_;  // at most kTelling
};

/// The printed step of each value: one unit of its last digit. Serves both fixed decimals (%.3f)
/// and a fixed number of digits (%.5g, %.4e): a value's step is the coarser of 10^-decimals and
/// its leading digit's power less the digits, both with the column's largest counts. A column that
/// says little takes the digits of the rest of the table (`table_significant`, 0: none known).
[[nodiscard]] std::vector<double> PrintedSteps(std::span<const double> values,
                                               const DigitStatistics& digits,
                                               int table_significant);

}  // namespace mbv
