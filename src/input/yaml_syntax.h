// Why a text is no YAML, in the words of who wrote it. Internal to input/.
#pragma once

#include <optional>
#include <string>

namespace mbv::internal {

struct SyntaxCause {
  int line = 0, column = 0;  ///< 1-based
  std::string message, hint;
};

/// The first thing in a text known to be no YAML that explains it: a tab, an indent that fits no
/// line above, a key without ": ", a bracket or quote that is never closed. Parsers name the place
/// where they give up instead, which may be the end of the file.
[[nodiscard]] std::optional<SyntaxCause> FindSyntaxCause(const std::string& text);

}  // namespace mbv::internal
