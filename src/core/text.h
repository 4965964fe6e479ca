// What counts as text: UTF-8 without control characters.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

namespace mbv {

/// Offset of the first byte at or after `from` that is no UTF-8 text, or npos. Control characters
/// other than tab, line feed and carriage return are no text, and neither are surrogates, overlong
/// forms and U+FFFE, U+FFFF: XML and JSON refuse them.
[[nodiscard]] size_t FindNonText(std::string_view text, size_t from = 0);

/// The same without line feeds, carriage returns and tabs: what can be a name.
[[nodiscard]] size_t FindNonName(std::string_view text);

/// `text` with "\x1b" for each byte that is no text: nothing that a terminal obeys.
[[nodiscard]] std::string Printable(std::string_view text);

/// "a, b, c"; of more than `most` words the first ones and "…".
[[nodiscard]] std::string Joined(const std::vector<std::string>& words,
                                 size_t most = static_cast<size_t>(-1));

[[nodiscard]] bool Contains(const std::vector<std::string>& words, std::string_view word);

}  // namespace mbv
