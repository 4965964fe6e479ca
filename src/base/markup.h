// Text inside XML, HTML, Markdown and LaTeX: one function for each.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

/// What XML may hold, for writers that escape by themselves: what is not text (base/text.h) as
/// U+FFFD, marks that mislead as OneLine() shows them, carriage returns as line feeds.
[[nodiscard]] std::string XmlText(std::string_view text);

/// The same with & < > " ' as entities, safe in elements and in quoted attributes.
[[nodiscard]] std::string EscapeMarkup(std::string_view text);

/// A relative link to a file: every byte but letters, digits, '-', '_', '.', '~' and '/' as %XX, so
/// that no name is taken as a scheme, a query or a fragment, or ends an attribute.
[[nodiscard]] std::string EncodeLink(std::string_view path);

/// What Dump() or DumpLine() wrote, inside a script element: '<' as \u003c, so that nothing in it
/// ends or opens an element, and what they write as \uXXXX as these six characters.
[[nodiscard]] std::string EscapeScript(const std::string& json);

/// RFC 4648, with padding.
[[nodiscard]] std::string EncodeBase64(std::string_view bytes);

/// `text` in a paragraph, a list or a table of Markdown: nothing in it is markup; line ends and
/// tabs are blanks, what misleads is shown as OneLine() shows it.
[[nodiscard]] std::string MarkdownText(std::string_view text);

/// The same as code, `text`, where that can hold it.
[[nodiscard]] std::string MarkdownCode(std::string_view text);

/// How far the numbers of a robot's XML (URDF, MJCF, SDF) may be from what they were before they
/// were printed: half a unit of the last decimal of the typical (median) one with four digits or
/// more; 0 where there is none.
struct PrintedRounding {
  double length = 0.0;     ///< of positions
  double direction = 0.0;  ///< of angles [rad], quaternions and axes

  [[nodiscard]] bool explains() const { return length > 0.0 || direction > 0.0; }
};
[[nodiscard]] PrintedRounding RoundingOf(std::string_view xml);

// Text for LaTeX.

/// `text` as LaTeX sets it, in text and in mathematics, without packages: its special characters
/// escaped; Greek letters, minus signs, degrees and the like as commands; line ends as blanks; what
/// misleads as OneLine() shows it.
/// Other letters (Chinese) stay as they are.
[[nodiscard]] std::string TexText(std::string_view text);

}  // namespace mbv
