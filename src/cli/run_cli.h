// The program: argv → command → exit code.
//
// Exit codes: 0 agree (or done), 1 disagree, 2 bad input, 3 could not run, 4 internal error; over
// several scenarios the worst in the order 4, 2, 3, 1, 0. Results go to stdout, talk to stderr.
#pragma once

namespace mbv {

/// Runs the program; never throws.
[[nodiscard]] int RunCli(int argc, char** argv);

}  // namespace mbv
