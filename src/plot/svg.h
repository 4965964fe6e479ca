// SVG as text: one writer for every picture that the program draws itself.
//
// Numbers are written with as many decimals as a picture shows; texts are escaped, contents are SVG
// already.
#pragma once

#include <fmt/format.h>

#include <initializer_list>
#include <string>
#include <string_view>

#include "base/markup.h"

namespace mbv {

/// Of the outermost element, where the picture is a file of its own.
inline constexpr const char* kSvgNamespace = "http://www.w3.org/2000/svg";

/// name="value".
struct SvgAttribute {
  SvgAttribute(const char* key, std::string_view text) : name(key), value(EscapeMarkup(text)) {}
  /// In pixels, rounded to this many decimals.
  SvgAttribute(const char* key, double number, int decimals)
      : name(key), value(fmt::format("{:.{}f}", number, decimals)) {}
  /// As short as it can be written.
  SvgAttribute(const char* key, double number) : name(key), value(fmt::format("{:g}", number)) {}

  const char* name;
  std::string value;  ///< escaped
};
using SvgAttributes = std::initializer_list<SvgAttribute>;

/// `<tag …>content</tag>`, attributes in the order given.
[[nodiscard]] inline std::string SvgElement(std::string_view tag, SvgAttributes attributes,
                                            std::string_view content) {
  std::string svg = fmt::format("<{}", tag);
  for (const SvgAttribute& a : attributes) svg += fmt::format(" {}=\"{}\"", a.name, a.value);
  return svg + fmt::format(">{}</{}>", content, tag);
}

/// `<tag …/>`: a line, a rectangle, a path.
[[nodiscard]] inline std::string SvgShape(std::string_view tag, SvgAttributes attributes) {
  std::string svg = fmt::format("<{}", tag);
  for (const SvgAttribute& a : attributes) svg += fmt::format(" {}=\"{}\"", a.name, a.value);
  return svg + "/>";
}

[[nodiscard]] inline std::string SvgText(SvgAttributes attributes, std::string_view text) {
  return SvgElement("text", attributes, EscapeMarkup(text));
}

/// A figure that is a file of its own and stands in pages: it shrinks with them and has the colour
/// of the text around it.
[[nodiscard]] inline std::string SvgFigure(double width, double height, const std::string& title,
                                           std::string_view content) {
  return SvgElement("svg",
                    {{"xmlns", kSvgNamespace},
                     {"viewBox", fmt::format("0 0 {:g} {:g}", width, height)},
                     {"width", width},
                     {"height", height},
                     {"style", "max-width:100%;height:auto"},
                     {"font-size", "12"},
                     {"fill", "currentColor"},
                     {"role", "img"},
                     {"aria-label", title}},
                    content) +
         "\n";
}

}  // namespace mbv
