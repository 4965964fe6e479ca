// The program: argv → command → exit code.
//
// Exit codes: 0 agree (or done), 1 disagree, 2 bad input, 3 could not run, 4 internal error; over
// several scenarios the worst in the order 4, 2, 3, 1, 0. Results go to stdout, diagnostics to
// stderr.
#pragma once

#include <array>
#include <span>

#include "cli/cli.h"

namespace mbv {

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
