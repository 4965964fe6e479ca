// What the commands of the program share.
#pragma once

#include <CLI/CLI.hpp>
#include <array>
#include <span>
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

// The program: argv → command → exit code.
//
// Exit codes: 0 agree (or done), 1 disagree, 2 bad input, 3 could not run, 4 internal error; over
// several scenarios the worst in the order 4, 2, 3, 1, 0. Results go to stdout, diagnostics to
// stderr.

/// One command of the program.
struct CommandRow {
  void (*add)(CLI::App* app, int* exit_code);  ///< adds it; when chosen, it sets *exit_code
  const char* heading = "";                    ///< that help shows it under; "": not at all
  bool reads_robots = false;                   ///< takes --package for the meshes of robots
};

/// A command that was called otherwise: its first word still works, but help does not show it.
struct FormerName {
  const char* name;
  std::array<const char*, 2> now;  ///< words in its place; null: none
};

/// Runs the program with these commands, in the order of its help; never throws.
[[nodiscard]] int RunCli(int argc, char** argv, std::span<const CommandRow> commands,
                         std::span<const FormerName> former);

}  // namespace mbv
