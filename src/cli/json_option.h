// --json of the commands that print a result: the same for programs.
#pragma once

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/inputs.h"

namespace mbv {

class JsonOption {
 public:
  void AddTo(CLI::App* command);

  [[nodiscard]] const std::string& path() const { return path_; }
  [[nodiscard]] bool wanted() const { return !path_.empty(); }
  /// Where the text for people goes: standard error when JSON takes standard output.
  [[nodiscard]] std::FILE* text() const { return path_ == "-" ? stderr : stdout; }
  /// Writes what was asked for, but not over one of `inputs`. Exit code as of
  /// WriteWholeFile().
  [[nodiscard]] int Write(const std::string& json, const std::vector<InputFile>& inputs) const;
  [[nodiscard]] int Write(const nlohmann::ordered_json& json,
                          const std::vector<InputFile>& inputs) const;

 private:
  std::string path_;
};

/// For programs, unlike the sentences in summary.json: a list of objects with severity, file, line,
/// column, message and hint.
[[nodiscard]] nlohmann::ordered_json FindingObjects(const Diagnostics& diagnostics);

}  // namespace mbv
