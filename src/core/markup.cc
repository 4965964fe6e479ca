#include "core/markup.h"

#include "core/text.h"

namespace mbv {

std::string EscapeMarkup(std::string_view text) {
  constexpr std::string_view kReplacement = "\uFFFD";
  std::string escaped;
  escaped.reserve(text.size());
  size_t bad = FindNonText(text);
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (i == bad) {
      escaped += kReplacement;
      bad = FindNonText(text, i + 1);
      continue;
    }
    switch (c) {
      case '&':
        escaped += "&amp;";
        break;
      case '<':
        escaped += "&lt;";
        break;
      case '>':
        escaped += "&gt;";
        break;
      case '"':
        escaped += "&quot;";
        break;
      case '\'':
        escaped += "&#39;";
        break;
      default:
        escaped += c;
    }
  }
  return escaped;
}

}  // namespace mbv
