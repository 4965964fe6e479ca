// Runs the built program as a user would.
#pragma once

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include "program.h"
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
    if (std::getenv(kInFork) != nullptr) {
      std::fputs("a fork of a test has started workers\n", stderr);
      _exit(127);
    }
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
  /// The same in a fork of the test, which has the program inside: nothing is loaded anew, which
  /// is most of what help and wrong arguments cost. Not for what starts workers: they would be
  /// this test. Words are parted by blanks alone.
  ProgramResult Forked(const std::string& arguments, const char* columns = nullptr) const {
    std::vector<std::string> words = {std::string(kBinaryDir) + "/mbverify"};
    std::istringstream stream(arguments);
    for (std::string word; stream >> word;) words.push_back(word);
    std::cout.flush(), std::fflush(nullptr);  // else the fork writes it, too
    const pid_t child = fork();
    if (child == 0) RunIn(words, columns);
    int status = -1;
    waitpid(child, &status, 0);
    return Result(status);
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
    return Result(std::system(command.c_str()));
  }
  [[nodiscard]] ProgramResult Result(int status) const {
    return {WIFEXITED(status) ? WEXITSTATUS(status) : 128, ReadAll(folder_ / "stdout"),
            ReadAll(folder_ / "stderr")};
  }
  // The forked process, with the output and the surroundings that Execute() gives.
  [[noreturn]] void RunIn(std::vector<std::string>& words, const char* columns) const {
    for (const auto& [name, number] : {std::pair("stdout", 1), std::pair("stderr", 2)}) {
      const int file = open((folder_ / name).c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
      if (file < 0 || dup2(file, number) < 0) _exit(127);
    }
    if (chdir(kSourceDir) != 0) _exit(127);
    setenv("NO_COLOR", "", 1);
    setenv(kInFork, "", 1);
    if (columns != nullptr) setenv("COLUMNS", columns, 1);
    std::vector<char*> argv;
    argv.reserve(words.size() + 1);
    for (std::string& word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    const int code = RunProgram(static_cast<int>(words.size()), argv.data());
    std::cout.flush(), std::fflush(nullptr);
    _exit(code);
  }

  static constexpr const char* kInFork = "MBV_TEST_IN_FORK";

  std::filesystem::path folder_;
};

}  // namespace mbv
