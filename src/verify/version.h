// Version of the program; a test keeps it equal to CMakeLists.txt.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/inputs.h"

namespace mbv {

inline constexpr const char* kVersion = "0.1.0";

/// Name and version of the program, of the libraries that decide numbers, and of the compiler.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> Versions();

/// inputs.json, what a result was made of: {schema, program, set: {KEY: VALUE}, inputs: [{file,
/// fingerprint}]}. `set`: what replaced values of the files.
[[nodiscard]] std::string InputsJson(
    const std::vector<InputFile>& inputs,
    const std::vector<std::pair<std::string, std::string>>& set = {});

}  // namespace mbv
