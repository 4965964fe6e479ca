// --assembly CLOSURE=N of commands that load robots.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/inputs.h"

namespace mbv {

void AddAssemblyOption(CLI::App* command, std::vector<std::string>* texts);

/// False after a message: not CLOSURE=N, N from 1.
[[nodiscard]] bool ReadAssembly(const std::vector<std::string>& texts,
                                std::map<std::string, int>* assembly);

// --json of the commands that print a result: the same for programs.

class JsonOption {
 public:
  /// What is written has `schema` ("mbverify.COMMAND/1", if it states none) and `program` in front;
  /// docs/reference/schemas/ has a JSON Schema of each.
  void AddTo(CLI::App* command);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool wanted() const { return !path_.empty(); }
  /// Where the text to read goes: standard error when JSON takes standard output.
  [[nodiscard]] std::FILE* text() const { return path_ == "-" ? stderr : stdout; }
  /// Writes what was asked for, but not over one of `inputs`. Exit code as of
  /// WriteWholeFile().
  [[nodiscard]] int Write(const std::string& json, const std::vector<InputFile>& inputs) const;
  /// The same as a text, for who prints it: with `schema` and `program` in front.
  [[nodiscard]] std::string Text(const nlohmann::ordered_json& json) const;
  [[nodiscard]] int Write(const nlohmann::ordered_json& json,
                          const std::vector<InputFile>& inputs) const;

 private:
  std::string path_, command_;
};

/// For programs, unlike the sentences in summary.json: a list of objects with severity, file, line,
/// column, message and hint.
[[nodiscard]] nlohmann::ordered_json FindingObjects(const Diagnostics& diagnostics);

}  // namespace mbv
