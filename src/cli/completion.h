// Scripts by which shells complete mbverify's commands, options and names.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace mbv {

/// An option as it is typed.
struct OptionWords {
  std::vector<std::string> names;  ///< "--quiet", "-q"
  std::string description;
  bool takes_value = false;
  std::vector<std::string> values;  ///< the words that it takes; empty: any, or files
};
/// A command, "" for the program itself, with what may follow it.
struct CommandWords {
  std::string path;  ///< "history list"
  std::string description;
  std::vector<OptionWords> options;
  std::vector<std::string> names;  ///< kinds of names it takes besides files: "models", "scenarios"
};

/// All commands and options that help shows, the program itself first.
[[nodiscard]] std::vector<CommandWords> WordsOf(const CLI::App& app);

/// The script of a shell: bash, zsh or fish.
[[nodiscard]] std::string CompletionScript(const std::string& shell,
                                           const std::vector<CommandWords>& commands);

}  // namespace mbv
