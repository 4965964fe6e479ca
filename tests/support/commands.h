// The program's commands, as its help lists them.
#pragma once

#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/run_program.h"

namespace mbv::test {

/// Names below the headings of a command's help, with the command before them.
inline std::vector<std::string> CommandsBelow(const Program& mbverify, const std::string& command) {
  static const std::set<std::string> kHeadings = {
      "Subcommands:",       "Start:",   "Verify:",  "Understand:",
      "Robots and motors:", "Engines:", "Publish:", "Shell:"};
  std::vector<std::string> names;
  bool inside = false;
  std::istringstream help(mbverify.Forked(command + " --help").out);
  for (std::string line; std::getline(help, line);) {
    inside = kHeadings.contains(line) || (inside && line.starts_with("  "));
    const bool is_name = inside && line.starts_with("  ") && line.size() > 2 && line[2] != ' ';
    if (is_name) {
      names.push_back((command.empty() ? "" : command + " ") +
                      line.substr(2, line.find(' ', 2) - 2));
    }
  }
  return names;
}

inline std::vector<std::string> AllCommands(const Program& mbverify) {
  std::vector<std::string> all = CommandsBelow(mbverify, "");
  for (const std::string& command : CommandsBelow(mbverify, "")) {
    for (const std::string& inner : CommandsBelow(mbverify, command)) all.push_back(inner);
  }
  return all;
}

}  // namespace mbv::test
