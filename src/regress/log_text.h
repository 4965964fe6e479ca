// What workers wrote into their logs, as plain text.
#pragma once

#include <string>

namespace mbv {

/// The last `count` lines of a text, without control characters.
[[nodiscard]] std::string LastLines(const std::string& text, int count);

/// Escape sequences of terminals go, too.
[[nodiscard]] std::string WithoutControls(const std::string& text);

}  // namespace mbv
