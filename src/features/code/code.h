// Verified code of a mechanism: inverse kinematics, Jacobians and inverse dynamics in C99 and
// Python, judged against the reference.
#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/diagnostics.h"
#include "features/code/code_text.h"
#include "mechanism/mechanism.h"

namespace mbv {

struct CodeRange {
  std::string coordinate;
  double low = kNan, high = kNan;  ///< [rad or m]
};

struct CodeSettings {
  std::string name = {};               ///< before all names in C; "": of the mechanism
  std::vector<CodeRange> ranges = {};  ///< of all coordinates: with a table to start from
  size_t states = 10000;               ///< that it is judged by
  std::uint64_t seed = 1;
  std::string check = {};  ///< another header with the same functions, to be judged instead
  bool compile = true;
  std::string origin = {};  ///< for the head: how the model is called
};

/// How code compares with the reference.
struct CodeJudgement {
  std::string language;         ///< "C", "C, from the table", "Python"
  std::string compiler = {};    ///< its first line about itself
  std::string not_judged = {};  ///< why; "": it was
  bool broken = false;          ///< it does not compile or run
  size_t states = 0;            ///< that both reached
  size_t only_one = 0;          ///< that one of them reached
  double position = kNan;       ///< largest difference, by the largest value of its actuator
  double force = kNan;          ///< of actuators; NaN: there are none
  double along = kNan;          ///< of forces along the coordinates
  double output = kNan;         ///< of the outputs' poses [characteristic lengths, rad]
  double back = kNan;           ///< share of the states that the way by actuators leads back to
  double jacobian = kNan;       ///< by the largest entry
  double nanoseconds = kNan;    ///< per state: pose, Jacobian and forces
  std::string slip = {};        ///< what is wrong, where that is found out
  std::vector<std::string> warnings = {};  ///< of the compiler

  /// Limit of all differences.
  static constexpr double kLimit = 1e-9;
  [[nodiscard]] bool agrees() const;
};

struct CodeResult {
  std::string name;
  std::vector<std::string> coordinates, actuators, notes;
  size_t blocks = 0, largest_block = 0, unknowns = 0;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, content
  std::vector<CodeJudgement> judgements;
  double table_bound = kNan, table_share = kNan;  ///< error left, share of the range that is proved
  std::optional<LookupTable> lookup = {};
  double lookup_share = kNan;  ///< of its cells, that are proved
  VecX lookup_error = {};      ///< per actuator: largest that was found at the states
  Diagnostics diagnostics;     ///< errors: there is no code

  [[nodiscard]] bool agrees() const;
};

/// To read, the verdicts alone, and for programs.
[[nodiscard]] std::string ToText(const CodeResult& result);
[[nodiscard]] std::string JudgementsText(const CodeResult& result);
[[nodiscard]] nlohmann::ordered_json ToJson(const CodeResult& result, const std::string& model);

/// What code is made for.
struct CodeTask {
  std::vector<NamedCoordinate> coordinates;     ///< q
  std::vector<NamedCoordinate> held;            ///< at home
  std::vector<NamedCoordinate> actuators = {};  ///< drives and prescribed joints
  /// The mechanism is a part of `whole`, and the forces of another part, `given`, along the
  /// coordinates are inputs: together they need the actuators' forces of the whole.
  const Mechanism* whole = nullptr;
  const Mechanism* given = nullptr;
};

/// By names; the rest of `settings` is of no influence. Nothing after an error.
[[nodiscard]] std::optional<CodeTask> ChooseCodeTask(const Mechanism& mechanism,
                                                     const std::vector<std::string>& coordinates,
                                                     Diagnostics* diagnostics);

/// `progress` gets the share that is done.
[[nodiscard]] CodeResult MakeCode(const Mechanism& mechanism, const CodeTask& task,
                                  const CodeSettings& settings,
                                  const std::function<void(double)>& progress = {});

}  // namespace mbv
