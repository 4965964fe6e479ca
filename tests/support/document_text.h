// How documents write what C++ prints.
#pragma once

#include <string>

namespace mbv::test {

/// C++ writes 1e-06 where documents write 1e-6.
inline std::string AsPlainText(const std::string& line) {
  std::string plain;
  for (size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '0' && i > 1 && line[i - 1] == '-' && line[i - 2] == 'e') continue;
    plain += line[i];
  }
  return plain;
}

}  // namespace mbv::test
