// A row of points.csv: what one point of a study gave.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "features/study/design.h"

namespace mbv {

struct PointRow {
  std::uint64_t point = 0;  ///< its number
  int exit_code = 0;        ///< as of `mbverify run`; 1: witnesses disagree, values are there
  std::string reason;       ///< why it has no values; "" if it has
  std::vector<double> varied, values;
};

/// "point,seed,exit,reason,…": names of factors and quantities.
[[nodiscard]] std::string PointHeader(const Study& study);
/// One line with its end; numbers in 17 digits, nothing for what is not a number.
[[nodiscard]] std::string PointLine(const PointRow& row, const Study& study);
/// Reads such a line (without its end) back; empty if it is not a row of this study.
[[nodiscard]] std::optional<PointRow> ReadPointLine(std::string_view line, const Study& study);

}  // namespace mbv
