// A program outside, called in a folder of its own with files that it gets and leaves.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/scratch_folder.h"
#include "comparison/comparison.h"
#include "scenario/scenario.h"

namespace mbv {

/// Programs that mbverify installs beside itself.
[[nodiscard]] bool IsInstalledProgram(const std::string& program);

/// Words of a command that was typed; those that name a file become its path.
[[nodiscard]] std::vector<std::string> CommandWords(const std::string& typed);

/// Why a program gave nothing.
struct ProgramFailure {
  WitnessGap gap = WitnessGap::kNotStarted;
  std::string text;  ///< one sentence without its subject
};

/// The folder goes with this object. Limits of time, memory and output are the witness' own.
class ProgramCall {
 public:
  explicit ProgramCall(const ForeignWitness& witness) : witness_(witness), folder_("witness") {}

  /// Puts a file into the folder. "" or what went wrong.
  [[nodiscard]] std::string WriteInput(const std::string& name, const std::string& text) const;
  /// Calls the program with few variables of the environment (docs/how-to/external_solvers.md) and
  /// waits. Empty, or how it failed, with what it printed last.
  [[nodiscard]] std::optional<ProgramFailure> Run();
  /// A file that it left, if it is not longer than it may be.
  [[nodiscard]] std::optional<std::string> Text(const std::string& name) const;
  /// The last line that the program printed, behind ": "; "" if it printed none.
  [[nodiscard]] std::string OutputTail() const;
  /// Of the program's whole run.
  [[nodiscard]] double wall_s() const { return wall_s_; }
  [[nodiscard]] double cpu_s() const { return cpu_s_; }

 private:
  const ForeignWitness& witness_;
  ScratchFolder folder_;
  double wall_s_ = 0.0, cpu_s_ = 0.0;
};

}  // namespace mbv
