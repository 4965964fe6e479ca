// Text for people, broken into lines that fit.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace mbv {

/// Columns of a terminal that a line takes: UTF-8, where escape sequences take none.
[[nodiscard]] size_t PrintedWidth(std::string_view line);

/// Lines that take more than `width` columns broken at blanks. What follows is indented like the
/// line's second column, or by 4 more than the line. A longer word has its own line. 0: no limit.
[[nodiscard]] std::string Wrapped(std::string_view text, size_t width);

}  // namespace mbv
