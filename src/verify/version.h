// Version of the program; a test keeps it equal to CMakeLists.txt.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace mbv {

inline constexpr const char* kVersion = "0.1.0";

/// Name and version of the program, of the libraries that decide numbers, and of the compiler.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Versions();

}  // namespace mbv
