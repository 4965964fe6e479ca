// Text inside XML and HTML.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// `text` with & < > " ' as entities, safe in elements and in quoted attributes. What is no text
/// (base/text.h) becomes U+FFFD.
[[nodiscard]] std::string EscapeMarkup(std::string_view text);

/// A relative link to a file: every byte but letters, digits, '-', '_', '.', '~' and '/' as %XX, so
/// that no name is taken as a scheme, a query or a fragment, or ends an attribute.
[[nodiscard]] std::string EncodeLink(std::string_view path);

/// JSON inside a script element: '<' as \u003c, so that nothing in it ends or opens an element.
[[nodiscard]] std::string EscapeScript(std::string json);

/// RFC 4648, with padding.
[[nodiscard]] std::string EncodeBase64(std::string_view bytes);

// Text for LaTeX.

/// `text` as LaTeX sets it, in text and in mathematics, without packages: its special characters
/// escaped; Greek letters, minus signs, degrees and the like as commands; line ends as blanks.
/// Other letters (Chinese) stay as they are.
[[nodiscard]] std::string TexText(std::string_view text);

}  // namespace mbv
