// The page index.html of a regression, from web/src/regression: page.html with {{places}} to fill,
// script and style, bundled when the program is built.
#pragma once

#include <string_view>

namespace mbv {

[[nodiscard]] std::string_view IndexPage();
[[nodiscard]] std::string_view IndexScript();
[[nodiscard]] std::string_view IndexStyle();

}  // namespace mbv
