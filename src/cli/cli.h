// The commands of the program (run_cli.h), and what they share.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace mbv {

/// The worse of two exit codes.
[[nodiscard]] int WorseExit(int a, int b);

/// Ends a command's help with examples (what follows "mbverify ") and the meaning of exit codes.
void SetFooter(CLI::App* command, const std::vector<std::string>& examples,
               const std::string& exit_codes);

/// A check that a value is a number above 0.
[[nodiscard]] CLI::Validator Positive();

/// A check that a value is a whole number from 0 to 2^64 - 1, for options of unsigned numbers,
/// whose conversion takes -3 for 2^64 - 3 and what is too large for the largest.
[[nodiscard]] CLI::Validator WholeNumber();

/// A check that a value is one of some words.
[[nodiscard]] CLI::Validator OneOf(const std::vector<std::string>& words);

/// Says "error: message" and the hint, if there is one. Exit code 2.
[[nodiscard]] int Refuse(const std::string& message, const std::string& hint);
/// The same of results that cannot be written. Exit code 3.
[[nodiscard]] int NotWritten(const std::string& message, const std::string& hint);

// Commands of the spine itself; those of features/ are rows of program.cc.
void AddCompletionCommand(CLI::App* app, int* exit_code);
void AddManPageCommand(CLI::App* app, int* exit_code);
void AddTrustCommand(CLI::App* app, int* exit_code);
void AddHelpCommand(CLI::App* app, int* exit_code);

}  // namespace mbv
