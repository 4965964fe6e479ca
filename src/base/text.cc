#include "base/text.h"

#include <fmt/format.h>
#include <algorithm>
#include <cctype>
#include <charconv>
#include <filesystem>
#include <initializer_list>
#include <utility>

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

namespace {

// Characters that take no room, change the order of others or end a line, where a reader sees
// nothing of it. (Variation selectors stay: signs like ⚠️ have them.)
constexpr std::pair<unsigned, unsigned> kMisleading[] = {
    {0x00AD, 0x00AD}, {0x034F, 0x034F}, {0x061C, 0x061C}, {0x115F, 0x1160},   {0x17B4, 0x17B5},
    {0x180B, 0x180F}, {0x200B, 0x200F}, {0x2028, 0x202E}, {0x2060, 0x206F},   {0x3164, 0x3164},
    {0xFEFF, 0xFEFF}, {0xFFA0, 0xFFA0}, {0xFFF0, 0xFFFB}, {0x1D173, 0x1D17A}, {0xE0000, 0xE0FFF}};

// The code of the character of `length` bytes at `at`, if it is one of these, else 0.
unsigned MisleadingAt(std::string_view text, size_t at, size_t length) {
  if (length < 2) return 0;
  unsigned code = static_cast<unsigned char>(text[at]) & (0xFFU >> (length + 1));
  for (size_t k = 1; k < length; ++k) {
    code = code << 6U | (static_cast<unsigned char>(text[at + k]) & 0x3FU);
  }
  const bool misleads = std::ranges::any_of(
      kMisleading, [&](const auto& range) { return range.first <= code && code <= range.second; });
  return misleads ? code : 0;
}

// The length of a sequence that paints, in one of a few ways; 0 for anything else.
size_t PaintAt(std::string_view text, size_t at) {
  for (const std::string_view paint : {"\x1b[0m", "\x1b[1m", "\x1b[2m", "\x1b[32m", "\x1b[33m",
                                       "\x1b[36m", "\x1b[1;31m", "\x1b[1;32m", "\x1b[1;33m"}) {
    if (text.substr(at).starts_with(paint)) return paint.size();
  }
  return 0;
}

std::string Tamed(std::string_view text, bool one_line) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string shown;
  for (size_t at = 0; at < text.size();) {
    const char c = text[at];
    const size_t paint = c == '\x1b' && !one_line ? PaintAt(text, at) : 0;
    const bool splits = c == '\r' || (one_line && (c == '\n' || c == '\t'));
    const size_t length = splits ? 0 : std::max(paint, LengthAt(text, at));
    if (length == 0) {
      const auto byte = static_cast<unsigned char>(c);
      shown += {'\\', 'x', kDigits[byte >> 4U], kDigits[byte & 0xFU]};
    } else if (const unsigned code = MisleadingAt(text, at, length); code != 0) {
      shown += code > 0xFFFF ? "\\U000" : "\\u";
      if (code > 0xFFFF) shown += kDigits[code >> 16U & 0xFU];
      for (const unsigned shift : {12U, 8U, 4U, 0U}) shown += kDigits[code >> shift & 0xFU];
    } else {
      shown += text.substr(at, length);
    }
    at += std::max<size_t>(length, 1);
  }
  return shown;
}

// Where a character begins, at or before `at`.
size_t StartOfCharacter(std::string_view text, size_t at) {
  while (at > 0 && at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U)
    --at;
  return at;
}

bool IsNumber(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size();
}

}  // namespace

std::string ForTerminal(std::string_view text) { return Tamed(text, false); }

std::string OneLine(std::string_view text) { return Tamed(text, true); }

std::string QuotedValue(std::string_view text, size_t most) {
  if (text.size() <= most) return OneLine(text);
  return OneLine(text.substr(0, StartOfCharacter(text, most))) + "… (" +
         std::to_string(text.size()) + " bytes)";
}

std::string Shortened(std::string text, size_t most) {
  if (text.size() <= most) return text;
  const size_t begin = StartOfCharacter(text, most / 2);
  const size_t end = StartOfCharacter(text, text.size() - most / 2);
  return text.substr(0, begin) + " … (" + std::to_string(end - begin) + " bytes left out) … " +
         text.substr(end);
}

std::string CsvCell(std::string_view text) {
  std::string cell;
  // Blanks in front are skipped by some spreadsheets, and wide signs taken as signs.
  const std::string_view begin =
      text.substr(std::min(text.find_first_not_of(" \t\r\n"), text.size()));
  const bool computed = std::ranges::any_of(
      std::initializer_list<std::string_view>{"=", "+", "-", "@", "＝", "＋", "－", "＠"},
      [&](std::string_view sign) { return begin.starts_with(sign); });
  if (computed && !IsNumber(text)) cell += '\'';
  std::string plain(text);
  for (char& c : plain) {
    if (c == '\n' || c == '\r' || c == '\t') c = ' ';
  }
  cell += OneLine(plain);
  if (cell.find_first_of(",\"") == std::string::npos) return cell;
  std::string quoted = "\"";
  for (const char c : cell) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string Joined(const std::vector<std::string>& words, size_t most) {
  std::string text;
  for (size_t i = 0; i < words.size() && i < most; ++i) text += (i == 0 ? "" : ", ") + words[i];
  return words.size() > most ? text + ", …" : text;
}

std::string JoinedAndMore(const std::vector<std::string>& words, size_t most) {
  if (words.size() <= most) return Joined(words);
  const std::vector<std::string> first(words.begin(), words.begin() + static_cast<long>(most));
  return fmt::format("{} and {} more", Joined(first), words.size() - most);
}

bool Contains(const std::vector<std::string>& words, std::string_view word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

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

std::string DidYouMean(const std::string& word, const std::vector<std::string>& candidates,
                       const std::string& otherwise) {
  std::string hint = DidYouMean(word, candidates);
  return hint.empty() ? otherwise : hint;
}

std::string DidYouMeanPath(const std::string& path, const std::string& otherwise) {
  namespace fs = std::filesystem;
  std::error_code error;
  fs::path found;
  for (const fs::path& part : fs::path(path)) {
    if (fs::exists(found / part, error)) {
      found /= part;
      continue;
    }
    std::vector<std::string> names;
    const fs::path folder = found.empty() ? fs::path(".") : found;
    for (auto entry = fs::directory_iterator(folder, error);
         !error && entry != fs::directory_iterator(); entry.increment(error)) {
      names.push_back(entry->path().filename().string());
    }
    std::sort(names.begin(), names.end());  // the file system's order is arbitrary
    const std::string near = ClosestWord(part.string(), names);
    if (near.empty()) return otherwise;
    found /= near;
  }
  return found == fs::path(path) ? otherwise : fmt::format("did you mean '{}'?", found.string());
}

}  // namespace mbv
