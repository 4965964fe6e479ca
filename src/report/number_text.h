// Numbers in tables of text.
#pragma once

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace mbv {

/// "-" for NaN.
[[nodiscard]] inline std::string NumberCell(double value, const char* format = "{:.2e}") {
  return std::isnan(value) ? "-" : fmt::format(fmt::runtime(format), value);
}

}  // namespace mbv
