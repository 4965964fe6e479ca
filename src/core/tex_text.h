// Text for LaTeX.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// `text` as LaTeX sets it, in text and in mathematics, without packages: its special characters
/// escaped; Greek letters, minus signs, degrees and the like as commands; line ends as blanks.
/// Other letters (Chinese) stay as they are.
[[nodiscard]] std::string TexText(std::string_view text);

}  // namespace mbv
