// Runs the built program as a user would.
#pragma once

#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "tests/support/source_dir.h"

namespace mbv {

inline std::string ReadAll(const std::filesystem::path& path) {
  std::ifstream stream(path, std::ios::binary);
  std::stringstream text;
  text << stream.rdbuf();
  return text.str();
}

struct ProgramResult {
  int exit_code = -1;
  std::string out, err;  ///< stdout, stderr
};

/// A temporary folder of this process' own with a program run in the project's folder.
class Program {
 public:
  explicit Program(const std::string& name)
      : folder_(std::filesystem::temp_directory_path() /
                ("mbv_cli_" + name + "_" + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~Program() { std::filesystem::remove_all(folder_); }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] std::string Out() const { return (folder_ / "out").string(); }

  ProgramResult operator()(const std::string& arguments) const {
    return Execute("NO_COLOR= " + Call(arguments));
  }
  /// With another search path for programs.
  ProgramResult WithPath(const std::string& path, const std::string& arguments) const {
    return Execute("PATH='" + path + "' " + Call(arguments));
  }
  /// In another folder than the project's.
  ProgramResult From(const std::filesystem::path& folder, const std::string& arguments) const {
    return Execute("cd '" + folder.string() + "' && NO_COLOR= " + Call(arguments));
  }
  /// As part of a shell script, where "$mbverify" is the program.
  ProgramResult Script(const std::string& script) const {
    return Execute("mbverify='" + std::string(kBinaryDir) + "/mbverify'; { " + script + "; }");
  }
  /// With a terminal for input and output, both in `out`; `script` is part of every Debian.
  ProgramResult OnTerminal(const std::string& arguments) const {
    return Execute("script --quiet --return --command \"NO_COLOR=1 " + Call(arguments) +
                   "\" /dev/null </dev/null");
  }

 private:
  [[nodiscard]] static std::string Call(const std::string& arguments) {
    return "'" + std::string(kBinaryDir) + "/mbverify' " + arguments;
  }
  [[nodiscard]] ProgramResult Execute(const std::string& call) const {
    const std::string command = "cd '" + std::string(kSourceDir) + "' && " + call + " >'" +
                                (folder_ / "stdout").string() + "' 2>'" +
                                (folder_ / "stderr").string() + "'";
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, ReadAll(folder_ / "stdout"),
            ReadAll(folder_ / "stderr")};
  }

  std::filesystem::path folder_;
};

}  // namespace mbv
