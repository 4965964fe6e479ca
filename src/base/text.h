// What counts as text: UTF-8 without control characters.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "base/diagnostics.h"

namespace mbv {

/// Offset of the first byte at or after `from` that is not UTF-8 text, or npos. Control characters
/// other than tab, line feed and carriage return are no text, and neither are surrogates, overlong
/// forms and U+FFFE, U+FFFF: XML and JSON refuse them.
[[nodiscard]] size_t FindNonText(std::string_view text, size_t from = 0);

/// The same without line feeds, carriage returns and tabs: what can be a name.
[[nodiscard]] size_t FindNonName(std::string_view text);

/// `text` with "\x1b" for each byte that is not text: nothing that a terminal obeys.
[[nodiscard]] std::string Printable(std::string_view text);

/// Lines for a terminal: printable, without carriage returns, and without marks that reverse the
/// order of characters or take no room. Colours that mbverify paints with stay.
[[nodiscard]] std::string ForTerminal(std::string_view text);

/// The same of one name or command: line feeds and tabs are shown, too, and no colour stays.
[[nodiscard]] std::string OneLine(std::string_view text);

/// OneLine() of a value that a message quotes: of more than `most` bytes the beginning and how many
/// there are.
[[nodiscard]] std::string QuotedValue(std::string_view text, size_t most = 200);

/// A message whose values may be of any length: of more than `most` bytes its beginning and end.
[[nodiscard]] std::string Shortened(std::string text, size_t most = 2000);

/// A text as a cell of CSV: on one line, in quotes where it needs them, and after a ' where a
/// spreadsheet would compute it (=, +, - and @ in front of what is not a number).
[[nodiscard]] std::string CsvCell(std::string_view text);

/// "a, b, c"; of more than `most` words the first ones and "…".
[[nodiscard]] std::string Joined(const std::vector<std::string>& words,
                                 size_t most = static_cast<size_t>(-1));

/// "a, b, c and 4 more" where there are more than `most`.
[[nodiscard]] std::string JoinedAndMore(const std::vector<std::string>& words, size_t most = 3);

[[nodiscard]] bool Contains(const std::vector<std::string>& words, std::string_view word);

/// Of bodies, joints, parameters … all that have a `name`.
template <typename T>
[[nodiscard]] std::vector<std::string> NamesOf(const std::vector<T>& items) {
  std::vector<std::string> names;
  names.reserve(items.size());
  for (const T& item : items) names.push_back(item.name);
  return names;
}

// Text to read, broken into lines that fit.

/// Columns of a terminal that a line takes: UTF-8, where escape sequences take none.
[[nodiscard]] size_t PrintedWidth(std::string_view line);

/// Lines that take more than `width` columns broken at blanks. What follows is indented like the
/// line's second column, or by 4 more than the line. A longer word has its own line. 0: no limit.
[[nodiscard]] std::string Wrapped(std::string_view text, size_t width);

// "Did you mean …?" about whatever a user may name: one resolver for all of it.

/// As DidYouMean(word, candidates) in base/diagnostics.h, or `otherwise` when none is near.
[[nodiscard]] std::string DidYouMean(const std::string& word,
                                     const std::vector<std::string>& candidates,
                                     const std::string& otherwise);

/// The same about a path, folder by folder: what exists and is spelt like it.
[[nodiscard]] std::string DidYouMeanPath(const std::string& path,
                                         const std::string& otherwise = "");

// Commands as shown to users, to be typed.

/// A word of a command line as a shell takes it: in quotes where it must be.
[[nodiscard]] inline std::string ShellWord(std::string word) {
  constexpr std::string_view kSpecial = " \t\n'\"\\$&|;()[]{}*?<>`!#~";
  if (!word.empty() && word.find_first_of(kSpecial) == std::string::npos) return word;
  for (size_t at = 0; (at = word.find('\'', at)) != std::string::npos; at += 4) {
    word.replace(at, 1, "'\\''");
  }
  return "'" + word + "'";
}

}  // namespace mbv
