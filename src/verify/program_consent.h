// Whether programs that scenarios name (`witnesses:`) may run (docs/how-to/external_solvers.md,
// "Consent").
//
// A scenario from another source must not run commands unasked. Trusted are commands that the user
// wrote on the command line, programs that mbverify installs, scenarios that it is shipped with,
// and scenarios below folders that the user trusts; anything else needs an answer for the run.
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "scenario/load_scenario.h"

namespace mbv {

/// Why a program may run unasked.
enum class ProgramTrust {
  kNone,
  kTyped,             ///< the command is an option's
  kInstalledProgram,  ///< mbverify installs it
  kShippedScenario,   ///< the scenario is shipped with mbverify
  kTrustedFolder,     ///< the scenario lies below a folder that the user trusts
};

[[nodiscard]] const char* TrustWord(ProgramTrust trust);  ///< "in a trusted folder"

struct CalledProgram {
  std::string witness;
  std::vector<std::string> command =
      {};  ///< as it is executed; the program by its path if there is one
  ProgramTrust trust = ProgramTrust::kNone;
  std::string reason = {};  ///< of kNone: why

  /// "planar: /usr/bin/python3 planar.py", whole and printable.
  [[nodiscard]] std::string Text() const;
};

/// The programs of one scenario.
struct ProgramList {
  std::string scenario;  ///< its file
  int line = 0;          ///< of the first command; 0: unknown
  std::vector<CalledProgram> programs = {};

  [[nodiscard]] bool trusted() const;
  /// Of the file's place and all commands: what a user agreed to.
  [[nodiscard]] std::string Fingerprint() const;
  /// Each program with why it may run.
  [[nodiscard]] std::vector<std::string> Lines() const;
};

[[nodiscard]] ProgramList ProgramsOf(const Scenario& scenario, bool archived = false);
/// Of them, the one that computes the equations of a file; empty without one.
[[nodiscard]] ProgramList EquationProgramOf(const Scenario& scenario, bool archived = false);
/// The same of a file, which is loaded only if it has such a section; empty without programs, and
/// for what cannot be loaded (whoever runs it says why).
[[nodiscard]] ProgramList ProgramsOf(const std::string& file, const ScenarioOptions& options);

/// What the user said to programs that are not trusted. As it stands: no.
struct ProgramConsent {
  bool all = false;       ///< --trust
  bool archived = false;  ///< scenarios come from an archive: neither place nor owner is a reason
  std::set<std::string> agreed = {};  ///< fingerprints of lists
  bool none = false;                  ///< nothing runs, trusted or not

  [[nodiscard]] bool Allows(const ProgramList& list) const;
};

/// What would run, and how to allow it: bad input.
[[nodiscard]] Finding Refusal(const ProgramList& list);

/// The user's file of trusted folders: below $XDG_CONFIG_HOME, else ~/.config. Empty without both.
[[nodiscard]] std::optional<std::filesystem::path> TrustFile();
/// Folders in it. What another user could have written there is not read.
[[nodiscard]] std::vector<std::filesystem::path> TrustedFolders();
/// Adds a folder, or removes it; "" or what went wrong.
[[nodiscard]] std::string TrustFolder(const std::filesystem::path& folder, bool trusted);

}  // namespace mbv
