// Text inside XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// `text` with & < > " ' as entities, safe in elements and in quoted attributes; other bytes stay.
[[nodiscard]] std::string EscapeMarkup(std::string_view text);

}  // namespace mbv
