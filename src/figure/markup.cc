#include "figure/markup.h"

#include <fmt/format.h>

#include <functional>

#include "core/markup.h"
#include "core/tex_text.h"

namespace mbv {
namespace {

// How one way of writing renders the pieces.
struct MarkupWords {
  std::function<std::string(std::string_view)> plain;
  const char *symbol, *below, *above;  // "{}" is the rendered content
};

// Up to `end`, from behind the opening; moves `at` behind the end. A backslash takes the next
// character as it is.
std::string Piece(std::string_view markup, char end, const MarkupWords& words, size_t* at);

std::string Enclosed(const char* format, std::string_view markup, char end,
                     const MarkupWords& words, size_t* at) {
  return fmt::format(fmt::runtime(format), Piece(markup, end, words, at));
}

std::string Piece(std::string_view markup, char end, const MarkupWords& words, size_t* at) {
  std::string out, plain;
  const auto flush = [&] {
    if (!plain.empty()) out += words.plain(plain);
    plain.clear();
  };
  while (*at < markup.size()) {
    const char c = markup[(*at)++];
    const bool opens = *at < markup.size() && markup[*at] == '{';
    if (c == '\\' && *at < markup.size()) {
      plain += markup[(*at)++];
    } else if (c == end && end != '\0') {
      break;
    } else if (c == '*') {
      flush();
      out += Enclosed(words.symbol, markup, '*', words, at);
    } else if ((c == '_' || c == '^') && opens) {
      flush();
      ++*at;
      out += Enclosed(c == '_' ? words.below : words.above, markup, '}', words, at);
    } else {
      plain += c;
    }
  }
  flush();
  return out;
}

}  // namespace

std::string ToPango(std::string_view markup, double font_pt) {
  constexpr double kPangoUnits = 1024, kSmall = 0.72, kUp = 0.36, kDown = -0.2;
  const auto span = [&](double rise) {
    return fmt::format("<span size=\"{:.0f}\" rise=\"{:.0f}\">{{}}</span>",
                       kPangoUnits * kSmall * font_pt, kPangoUnits * rise * font_pt);
  };
  const std::string below = span(kDown), above = span(kUp);
  size_t at = 0;
  const MarkupWords words = {[](std::string_view text) { return EscapeMarkup(text); }, "<i>{}</i>",
                             below.c_str(), above.c_str()};
  return Piece(markup, '\0', words, &at);
}

std::string ToTex(std::string_view markup) {
  size_t at = 0;
  const MarkupWords words = {TexText, "\\textit{{{}}}", "\\textsubscript{{{}}}",
                             "\\textsuperscript{{{}}}"};
  return Piece(markup, '\0', words, &at);
}

std::string Verbatim(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '*' || c == '_' || c == '^' || c == '\\' || c == '}') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace mbv
