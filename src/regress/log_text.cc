#include "regress/log_text.h"

namespace mbv {
namespace {

constexpr unsigned char kEscape = 0x1b;

}  // namespace

std::string WithoutControls(const std::string& text) {
  std::string clean;
  for (size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    if (c == kEscape && i + 1 < text.size() && text[i + 1] == '[') {  // a terminal's colour
      i += 2;
      while (i < text.size() && (text[i] < '@' || text[i] > '~')) ++i;
      continue;
    }
    if (c >= 0x20 || c == '\n' || c == '\t') clean += text[i];
  }
  return clean;
}

std::string LastLines(const std::string& text, int count) {
  const std::string clean = WithoutControls(text);
  const size_t end = clean.find_last_not_of("\n ");
  if (end == std::string::npos) return "";
  size_t at = end;
  for (int i = 0; i < count; ++i) {
    const size_t newline = clean.rfind('\n', at);
    if (newline == std::string::npos || newline == 0) return clean.substr(0, end + 1);
    at = newline - 1;
  }
  return clean.substr(at + 2, end - at - 1);
}

}  // namespace mbv
