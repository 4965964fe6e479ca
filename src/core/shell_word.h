// Commands that are told, to be typed.
#pragma once

#include <string>
#include <string_view>

namespace mbv {

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
