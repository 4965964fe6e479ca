// Options of commands that load robots.
#pragma once

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/inputs.h"
#include "base/types.h"
#include "verify/program_consent.h"

namespace mbv {

struct LoadOptions;  // model_file/load_model.h
struct LoadResult;

/// What a robot's file leaves open.
struct RobotArguments {
  std::vector<std::string> assembly;  ///< CLOSURE=N
  std::string base;                   ///< the body or link that is held
  double closure_tolerance_m = kNan;  ///< NaN: what the digits of the file explain
  bool free_base = false;             ///< nothing is held
  std::vector<std::string> plants;    ///< feet on the ground, LoadOptions::plants

  [[nodiscard]] bool any() const {
    return !assembly.empty() || !base.empty() || free_base || !plants.empty() ||
           std::isfinite(closure_tolerance_m);
  }
};
void AddRobotOptions(CLI::App* command, RobotArguments* arguments);
/// The exit code after the message that they are for robots only.
[[nodiscard]] int RefuseRobotOptions();
/// --closure-tolerance alone.
void AddToleranceOption(CLI::App* command, double* tolerance_m);

/// False after a message: --assembly is not CLOSURE=N, N from 1; --base with --free-base or
/// --plant.
[[nodiscard]] bool ReadRobotOptions(const RobotArguments& arguments, LoadOptions* options);
/// A command's model: by name or file, with `set` parameters (PARAMETER=VALUE) and what a robot's
/// file leaves open. Its findings are printed; empty after them where there is no mechanism.
[[nodiscard]] std::optional<LoadResult> LoadModelOrRefuse(const std::string& model,
                                                          const std::vector<std::string>& set,
                                                          const RobotArguments& robot);

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

// Consent for the programs that scenarios name.

/// --trust: the programs that scenarios name run this time.
void AddTrustOption(CLI::App* command, bool* trust);

/// Before anything runs: lists the programs of all scenarios on stderr (`quiet`: only those that
/// need consent) and asks for what is not trusted, if a person can be asked. Exit code 0 with what
/// was agreed to in `consent`, or 2 after stating what would run and how to allow it.
[[nodiscard]] int AskForPrograms(const std::vector<std::string>& scenarios,
                                 const ScenarioOptions& options, bool trust, bool quiet,
                                 ProgramConsent* consent);

/// The same of one whose programs are known (ProgramList::Lines()), for this time; true: they may.
[[nodiscard]] bool AskForPrograms(const std::string& scenario,
                                  const std::vector<std::string>& programs);
/// Shows them on stderr.
void ListPrograms(const std::string& scenario, const std::vector<std::string>& programs);

}  // namespace mbv
