// --assembly CLOSURE=N of commands that load robots.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace mbv {

void AddAssemblyOption(CLI::App* command, std::vector<std::string>* texts);

/// False after a message: not CLOSURE=N, N from 1.
[[nodiscard]] bool ReadAssembly(const std::vector<std::string>& texts,
                                std::map<std::string, int>* assembly);

}  // namespace mbv
