// Tables for papers of a scenario: its model, and what running it gave.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "report/result_tables.h"
#include "verify/run_options.h"

namespace mbv {

struct TablesOptions {
  ScenarioOptions scenario;
  ProgramConsent programs = {};                      ///< that it names
  std::vector<std::string> formats = {"tex", "md"};  ///< words of TableFormats()
  std::vector<std::string> only;                     ///< words of TableNames(); empty: all
  ProgressFunction progress;
};

/// "tex" (LaTeX, booktabs), "md" (Markdown).
[[nodiscard]] const std::vector<std::string>& TableFormats();
/// "parameters", "mobility", "checks", "sizing".
[[nodiscard]] const std::vector<std::string>& TableNames();

struct TablesOutcome {
  int exit_code = 4;  ///< of the run
  Diagnostics diagnostics;
  std::string mechanism, scenario, verdict;
  std::vector<Table> tables;                               ///< names as in TableNames()
  std::vector<std::string> left_out;                       ///< sentences
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
};

/// Runs a scenario of any kind. Findings are bad input.
[[nodiscard]] TablesOutcome MakeTables(const std::string& file, const TablesOptions& options);

/// The numbers (no expressions) of `parameters:` in a model file and those that it takes from
/// others, by name, those of instances as "limb1.m"; empty of a file of another kind.
[[nodiscard]] std::map<std::string, StatedNumber> StatedNumbers(const std::string& model_file);

}  // namespace mbv
