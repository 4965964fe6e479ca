// Kinds of documents: how a file is recognised, checked without running anything, and run.
#pragma once

#include <optional>
#include <span>
#include <string>

#include "base/diagnostics.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct RunOptions;  // verify/run_options.h
struct RunOutcome;

/// A kind of file that users write. What it has no use for is null or "".
struct DocumentKind {
  const char* name;  ///< "motion", "stiffness", "study", "model", "mechanism"
  bool (*is)(const std::string& file, const ScenarioHead& head);
  Diagnostics (*check)(const std::string& file);
  const char* command = "";  ///< of the program that runs it
  bool in_time = false;      ///< a scenario with a motion: it has steps, and a model to perturb
  bool set_up = false;       ///< a mechanism without a scenario: a first motion runs it
  RunOutcome (*run)(const std::string& file, const RunOptions& options) = nullptr;
  /// The mechanism as it runs; empty after findings.
  std::optional<Mechanism> (*mechanism)(const std::string& file, const ScenarioOptions& options,
                                        Diagnostics* diagnostics) = nullptr;

  [[nodiscard]] bool runs() const { return *command != '\0'; }
  /// It is run, but has no motion: neither steps to refine nor a model to perturb.
  [[nodiscard]] bool timeless() const { return runs() && !in_time; }
};

/// The kinds that the program knows from now on, asked in this order; they must outlive every call.
/// The last one recognises every file.
void UseDocumentKinds(std::span<const DocumentKind> kinds);

/// The first that recognises the file.
[[nodiscard]] const DocumentKind& KindOf(const std::string& file);

/// All findings about a file.
[[nodiscard]] inline Diagnostics CheckFile(const std::string& file) {
  return KindOf(file).check(file);
}

/// mechanism.json as external witnesses get it: a name that ends in .json.
[[nodiscard]] bool IsMechanismJson(const std::string& file, const ScenarioHead& head);
[[nodiscard]] Diagnostics CheckMechanismFile(const std::string& file);
/// A model, and whether the closed form of its name covers it.
[[nodiscard]] Diagnostics CheckModel(const std::string& file);
/// A scenario of motion, including what its closed form has to say about the motion.
[[nodiscard]] Diagnostics CheckScenario(const std::string& file);
/// Of a scenario of motion.
[[nodiscard]] std::optional<Mechanism> MotionMechanism(const std::string& file,
                                                       const ScenarioOptions& options,
                                                       Diagnostics* diagnostics);

}  // namespace mbv
