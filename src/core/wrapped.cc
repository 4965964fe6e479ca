#include "core/wrapped.h"

#include <algorithm>
#include <cctype>

namespace mbv {
namespace {

// Where the rest of a line that is too long goes.
size_t HangOf(std::string_view line, size_t width) {
  constexpr size_t kStep = 4, kColumn = 16;  // text that begins further right is a column's
  const size_t indent = std::min(line.find_first_not_of(' '), line.size());
  const size_t gap = line.find("  ", indent);
  if (gap != std::string_view::npos) {
    const size_t second = PrintedWidth(line.substr(0, line.find_first_not_of(' ', gap)));
    if (second <= width / 2) return second;
  }
  return std::min(indent >= kColumn ? indent : indent + kStep, width / 2);
}

std::string WrappedLine(std::string_view line, size_t width) {
  const size_t hang = HangOf(line, width);
  std::string wrapped;
  size_t column = 0;
  for (size_t at = 0; at < line.size();) {
    // Blanks and the word behind them.
    const size_t word = std::min(line.find_first_not_of(' ', at), line.size());
    const size_t end = std::min(line.find(' ', word), line.size());
    const std::string_view blanks = line.substr(at, word - at),
                           text = line.substr(word, end - word);
    if (at > 0 && column + blanks.size() > hang &&
        column + blanks.size() + PrintedWidth(text) > width) {
      if (text.empty()) break;
      wrapped += "\n" + std::string(hang, ' ');
      column = hang;
    } else {
      wrapped += blanks;
      column += blanks.size();
    }
    wrapped += text;
    column += PrintedWidth(text);
    at = end;
  }
  return wrapped;
}

}  // namespace

size_t PrintedWidth(std::string_view line) {
  size_t columns = 0;
  for (size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '\x1b') {
      while (i < line.size() && std::isalpha(static_cast<unsigned char>(line[i])) == 0) ++i;
    } else {
      columns += (static_cast<unsigned char>(line[i]) & 0xC0U) == 0x80U ? 0 : 1;
    }
  }
  return columns;
}

std::string Wrapped(std::string_view text, size_t width) {
  if (width == 0) return std::string(text);
  std::string wrapped;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    const std::string_view line = text.substr(from, end - from);
    wrapped += PrintedWidth(line) > width ? WrappedLine(line, width) : std::string(line);
    if (end < text.size()) wrapped += '\n';
    from = end + 1;
  }
  return wrapped;
}

}  // namespace mbv
