// The program: argv → command → exit code.
//
// Exit codes: 0 agree (or done), 1 disagree, 2 bad input, 3 could not run, 4 internal error; over
// several scenarios the worst in the order 4, 2, 3, 1, 0. Results go to stdout, diagnostics to
// stderr.
#pragma once

#include <span>

#include "cli/cli.h"

namespace mbv {

/// One command of the program.
struct CommandRow {
  void (*add)(CLI::App* app, int* exit_code);  ///< adds it; when chosen, it sets *exit_code
  const char* heading = "";                    ///< that help shows it under; "": not at all
  bool reads_robots = false;                   ///< takes --package for the meshes of robots
};

/// Runs the program with these commands, in the order of its help; never throws.
[[nodiscard]] int RunCli(int argc, char** argv, std::span<const CommandRow> commands);

}  // namespace mbv
