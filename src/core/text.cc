#include "core/text.h"

#include <algorithm>

namespace mbv {
namespace {

// Bytes of the character at `at`, or 0 if there is none.
size_t LengthAt(std::string_view text, size_t at) {
  const auto byte = [&](size_t k) {
    return at + k < text.size() ? static_cast<unsigned char>(text[at + k]) : 0U;
  };
  const unsigned first = byte(0);
  if (first < 0x20) return first == '\t' || first == '\n' || first == '\r' ? 1 : 0;
  if (first < 0x7F) return 1;
  const size_t length = first < 0xC2   ? 0
                        : first < 0xE0 ? 2
                        : first < 0xF0 ? 3
                        : first < 0xF5 ? 4
                                       : 0;
  for (size_t k = 1; k < length; ++k) {
    if ((byte(k) & 0xC0U) != 0x80U) return 0;
  }
  const unsigned second = byte(1);
  const bool bad = (first == 0xC2 && second < 0xA0) ||   // control characters of ISO 8859
                   (first == 0xE0 && second < 0xA0) ||   // overlong
                   (first == 0xED && second >= 0xA0) ||  // surrogates
                   (first == 0xEF && second == 0xBF && byte(2) >= 0xBE) ||
                   (first == 0xF0 && second < 0x90) ||  // overlong
                   (first == 0xF4 && second >= 0x90);   // beyond Unicode
  return bad ? 0 : length;
}

}  // namespace

size_t FindNonText(std::string_view text, size_t from) {
  for (size_t i = from; i < text.size();) {
    const size_t length = LengthAt(text, i);
    if (length == 0) return i;
    i += length;
  }
  return std::string_view::npos;
}

size_t FindNonName(std::string_view text) {
  return std::min(FindNonText(text), text.find_first_of("\t\n\r"));
}

std::string Printable(std::string_view text) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string shown;
  size_t from = 0;
  for (size_t at = FindNonText(text); at < text.size(); at = FindNonText(text, from)) {
    shown += text.substr(from, at - from);
    const auto byte = static_cast<unsigned char>(text[at]);
    shown += {'\\', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    from = at + 1;
  }
  return shown += text.substr(from);
}

std::string Joined(const std::vector<std::string>& words, size_t most) {
  std::string text;
  for (size_t i = 0; i < words.size() && i < most; ++i) text += (i == 0 ? "" : ", ") + words[i];
  return words.size() > most ? text + ", …" : text;
}

bool Contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

}  // namespace mbv
