// `mbverify sheet`: how credible a scenario's results are, from what was run of it.
//
// Rows follow ASME V&V 10-2019 (code verification, solution verification, validation) and ASME V&V
// 20-2009 (u_num, u_input, E); factors and their levels 0 … 4 the credibility assessment scale of
// NASA-STD-7009 [2008]. A level counts from 0 as far as its evidence was run and passed: what
// failed, is missing, or was made from another state of the files raises none. What no run shows
// (whether a system is the real one, management, qualification) is not assessed.
//
// Evidence is what other commands left below the result folder OUT, each with its inputs.json:
//   run          OUT/MECHANISM/SCENARIO/summary.json
//   converge     OUT/MECHANISM/convergence/SCENARIO/converge.json
//   sensitivity  OUT/MECHANISM/sensitivity/SCENARIO/sensitivity.json
//   study        OUT/STUDY/summary.json
//   package      OUT/MECHANISM/package/SCENARIO.zip, and SCENARIO.json of its check
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"

namespace mbv {

enum class SheetStatus {
  kDone,           ///< was run, and passed
  kFailed,         ///< was run, and did not pass
  kStale,          ///< was made from another state of the files, or cannot be read
  kNotDone,        ///< was not run
  kNotApplicable,  ///< was run, and says that it does not apply
  kStated,         ///< is no matter of a run
};
/// Its word: "done", "failed", "other state", "not done", "not applicable", "stated".
[[nodiscard]] const char* ToText(SheetStatus status);

/// Words of a command, the first one after "mbverify".
using SheetCommand = std::vector<std::string>;

struct SheetRow {
  std::string key, title;  ///< "solution_grid", "Solution verification: discretization error"
  std::string standard;    ///< where it is asked for: "ASME V&V 20: u_num"
  SheetStatus status = SheetStatus::kNotDone;
  std::string result = {};                  ///< sentences
  std::string evidence = {};                ///< file that it was read from
  std::vector<SheetCommand> commands = {};  ///< that do it, one after the other; none: see `result`
  /// Numbers of `result` for programs.
  nlohmann::ordered_json values = nlohmann::ordered_json::object();
};

struct SheetFactor {
  std::string name;
  int level = -1;       ///< 0 … 4; −1: not assessed here
  std::string meaning;  ///< of the level
  std::string next;     ///< what the next one asks for; "" at the last one that can be reached here
};

struct Sheet {
  std::string scenario, scenario_file, mechanism, description;
  std::vector<SheetRow> rows = {};
  std::vector<SheetFactor> factors = {};
  std::vector<std::pair<std::string, std::string>> versions = {};

  [[nodiscard]] const SheetRow& Row(const std::string& key) const;  ///< must be there
  [[nodiscard]] size_t Count(SheetStatus status) const;
  /// 1 where something failed, else 0.
  [[nodiscard]] int exit_code() const { return Count(SheetStatus::kFailed) > 0 ? 1 : 0; }
};

/// Of a scenario of motion. Empty after findings.
[[nodiscard]] std::optional<Sheet> MakeSheet(const std::string& file,
                                             const std::filesystem::path& out,
                                             Diagnostics* diagnostics);

/// Levels that these rows support.
[[nodiscard]] std::vector<SheetFactor> FactorsOf(const Sheet& sheet);

/// Each command once that a row still needs, in order.
[[nodiscard]] std::vector<SheetCommand> Missing(const Sheet& sheet);
/// As a shell takes it, with "mbverify".
[[nodiscard]] std::string ToText(const SheetCommand& command);

// Writers.

struct TextStyle;  // report/document.h
[[nodiscard]] std::string ToText(const Sheet& sheet, const TextStyle& style);
[[nodiscard]] std::string SheetPage(const Sheet& sheet);
/// Pages of A4.
[[nodiscard]] std::string SheetPdf(const Sheet& sheet);
/// Schema "mbverify.sheet/1".
[[nodiscard]] nlohmann::ordered_json ToJson(const Sheet& sheet);

}  // namespace mbv
