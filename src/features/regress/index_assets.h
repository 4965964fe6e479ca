// The script and the style of index.html, bundled from web/src/regression when the program is
// built.
#pragma once

#include <string_view>

namespace mbv {

[[nodiscard]] std::string_view IndexScript();
[[nodiscard]] std::string_view IndexStyle();

}  // namespace mbv
