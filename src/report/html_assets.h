// The script and the style of report.html, bundled from web/ when the program is built.
#pragma once

#include <string_view>

namespace mbv {

[[nodiscard]] std::string_view PageScript();
[[nodiscard]] std::string_view PageStyle();

}  // namespace mbv
