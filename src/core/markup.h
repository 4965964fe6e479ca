// Text inside XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// `text` with & < > " ' as entities, safe in elements and in quoted attributes. What is no text
/// (core/text.h) becomes U+FFFD.
[[nodiscard]] std::string EscapeMarkup(std::string_view text);

}  // namespace mbv
