#include "verify/program_consent.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <sstream>

#include "base/files.h"
#include "base/roles.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "equations/equations.h"
#include "scenario/find_model.h"
#include "verify/program_call.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// The place itself, behind all links.
fs::path Real(const fs::path& path) {
  std::error_code error;
  fs::path real = fs::weakly_canonical(fs::absolute(path, error), error);
  if (!real.has_filename()) real = real.parent_path();  // "folder/"
  return real;
}

bool LiesBelow(const fs::path& path, const fs::path& folder) {
  const auto [end, rest] = std::mismatch(folder.begin(), folder.end(), path.begin(), path.end());
  return !folder.empty() && end == folder.end();
}

// Whoever could have put something there instead; "" if the user and root alone can.
std::string WhoElseWrites(const fs::path& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return fmt::format("{} cannot be read", path.string());
  if (status.st_uid != geteuid() && status.st_uid != 0) {
    return fmt::format("{} belongs to another user", path.string());
  }
  if ((status.st_mode & S_IWOTH) != 0) {
    return fmt::format("everybody may write to {}", path.string());
  }
  return "";
}

// From a file up to a folder above it.
std::string WhoElseWritesBetween(const fs::path& file, const fs::path& folder) {
  for (fs::path at = file;; at = at.parent_path()) {
    if (std::string who = WhoElseWrites(at); !who.empty()) return who;
    if (at == folder || at == at.parent_path()) return "";
  }
}

bool IsShipped(const fs::path& file) {
  const auto models = ShippedModels();
  if (!models) return false;
  const fs::path root = Real(*models).parent_path();
  return LiesBelow(file, root / "scenarios") || LiesBelow(file, root / "models");
}

// Why neither the scenario's place nor its owner lets its programs run; "" if they do.
std::string ReasonNotTrusted(const fs::path& file, const std::vector<std::string>& command) {
  std::string reason = "no folder above it is trusted";
  for (const fs::path& folder : TrustedFolders()) {
    if (!LiesBelow(file, folder)) continue;
    reason = WhoElseWritesBetween(file, folder);
    if (reason.empty()) break;
  }
  if (!reason.empty()) return reason;
  for (const std::string& word : command) {
    std::error_code error;
    if (!word.starts_with('/') || !fs::is_regular_file(word, error)) continue;
    if (std::string who = WhoElseWrites(Real(word)); !who.empty()) return who;
  }
  return "";
}

// `typed`: the command is an option's.
CalledProgram Called(const Scenario& scenario, const std::string& witness,
                     const std::vector<std::string>& command, bool typed, bool archived) {
  CalledProgram called{.witness = witness, .command = command};
  if (const auto program = FindProgram(called.command.front())) called.command.front() = *program;
  if (typed) {
    called.trust = ProgramTrust::kTyped;
  } else if (IsInstalledProgram(command.front())) {
    called.trust = ProgramTrust::kInstalledProgram;
  } else if (archived) {
    called.reason = "it comes from an archive";
  } else if (const fs::path file = Real(scenario.file); IsShipped(file)) {
    called.trust = ProgramTrust::kShippedScenario;
  } else {
    called.reason = ReasonNotTrusted(file, called.command);
    if (called.reason.empty()) called.trust = ProgramTrust::kTrustedFolder;
  }
  return called;
}

}  // namespace

const char* TrustWord(ProgramTrust trust) {
  switch (trust) {
    case ProgramTrust::kNone:
      return "not trusted";
    case ProgramTrust::kTyped:
      return "of the command line";
    case ProgramTrust::kInstalledProgram:
      return "installed with mbverify";
    case ProgramTrust::kShippedScenario:
      return "of a scenario shipped with mbverify";
    case ProgramTrust::kTrustedFolder:
      return "in a trusted folder";
  }
  return "?";
}

std::string CalledProgram::Text() const {
  std::string text = witness + ":";
  for (const std::string& word : command) {
    const bool plain = !word.empty() && word.find_first_of(" \t\n\r'\"\\") == std::string::npos;
    text += plain ? " " + OneLine(word) : fmt::format(" '{}'", OneLine(word));
  }
  return text;
}

bool ProgramList::trusted() const {
  return std::ranges::all_of(
      programs, [](const CalledProgram& called) { return called.trust != ProgramTrust::kNone; });
}

std::string ProgramList::Fingerprint() const {
  std::string all = Real(scenario).string() + '\0';
  for (const CalledProgram& called : programs) {
    all += fmt::format("{}\n{}\n", called.witness, called.command.size());
    for (const std::string& word : called.command) all += fmt::format("{}:{}", word.size(), word);
  }
  return Sha256Hex(all);
}

std::vector<std::string> ProgramList::Lines() const {
  std::vector<std::string> lines;
  for (const CalledProgram& called : programs) {
    lines.push_back(fmt::format("{} ({}{}{})", called.Text(), TrustWord(called.trust),
                                called.reason.empty() ? "" : ": ", OneLine(called.reason)));
  }
  return lines;
}

ProgramList ProgramsOf(const Scenario& scenario, bool archived) {
  ProgramList list = EquationProgramOf(scenario, archived);
  for (const ForeignWitness& witness : scenario.witnesses) {
    list.programs.push_back(
        Called(scenario, witness.name, witness.command, witness.typed, archived));
    if (list.line == 0) list.line = witness.line;
  }
  return list;
}

ProgramList EquationProgramOf(const Scenario& scenario, bool archived) {
  ProgramList list{.scenario = scenario.file};
  const AnalyticSettings& analytic = scenario.analytic;
  if (!analytic.on || !IsEquationProgram(analytic.equations)) return list;
  list.programs.push_back(Called(scenario, role::kAnalytic.name,
                                 EquationCommand(analytic.equations), analytic.equations_typed,
                                 archived));
  list.line = analytic.equations_line;
  return list;
}

ProgramList ProgramsOf(const std::string& file, const ScenarioOptions& options) {
  const ScenarioHead head = ReadScenarioHead(file);
  const bool set = std::ranges::any_of(options.set, [](const SetValue& value) {
    return value.first.starts_with("witnesses") || value.first.starts_with("analytic");
  });
  if (!head.is_scenario || !(head.names_programs || set)) {
    return {.scenario = file};
  }
  const PhaseStart first;  // all phases have the same programs
  ScenarioOptions with = options;
  if (head.HasKey("phases")) with.phase = &first;
  const ScenarioResult loaded = LoadScenario(file, with);
  return loaded.scenario ? ProgramsOf(*loaded.scenario) : ProgramList{.scenario = file};
}

bool ProgramConsent::Allows(const ProgramList& list) const {
  return all || list.trusted() || agreed.contains(list.Fingerprint());
}

Finding Refusal(const ProgramList& list) {
  std::string programs, reason;
  for (const CalledProgram& called : list.programs) {
    if (called.trust != ProgramTrust::kNone) continue;
    programs += (programs.empty() ? "" : "; ") + called.Text();
    if (reason.empty()) reason = OneLine(called.reason);
  }
  std::error_code error;
  const fs::path folder = Real(list.scenario).parent_path();
  Finding finding;
  finding.file = list.scenario;
  finding.line = list.line;
  finding.message = fmt::format("its programs may not run as you: {} ({})", programs, reason);
  finding.hint = fmt::format(
      "read what they do; --trust lets them run this time, 'mbverify trust {}' from now on",
      OneLine(folder.string()));
  return finding;
}

std::optional<fs::path> TrustFile() {
  const char* config = std::getenv("XDG_CONFIG_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (config != nullptr && *config == '/') {
    folder = config;
  } else if (home != nullptr && *home == '/') {
    folder = fs::path(home) / ".config";
  } else {
    return std::nullopt;
  }
  return folder / "mbverify" / "trusted_folders";
}

std::vector<fs::path> TrustedFolders() {
  std::vector<fs::path> folders;
  const auto file = TrustFile();
  std::error_code error;
  if (!file || !fs::is_regular_file(*file, error) || !WhoElseWrites(Real(*file)).empty() ||
      !WhoElseWrites(Real(*file).parent_path()).empty()) {
    return folders;
  }
  std::istringstream lines(ReadWholeFile(*file).value_or(""));
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('/')) folders.push_back(Real(line));
  }
  return folders;
}

std::string TrustFolder(const fs::path& folder, bool trusted) {
  const auto file = TrustFile();
  if (!file) return "neither XDG_CONFIG_HOME nor HOME says where the list of trusted folders is";
  const fs::path real = Real(folder);
  std::error_code error;
  if (trusted && !fs::is_directory(real, error)) {
    return fmt::format("{} is not a folder", QuotedValue(folder.string()));
  }
  if (FindNonName(real.string()) != std::string::npos) {
    return fmt::format("{} has a name that a list of lines cannot hold",
                       QuotedValue(real.string()));
  }
  if (trusted) {
    if (const std::string who = WhoElseWrites(real); !who.empty()) return who;
  }
  std::vector<fs::path> folders = TrustedFolders();
  const bool known = std::ranges::find(folders, real) != folders.end();
  if (!trusted && !known) return fmt::format("{} is not in the list", QuotedValue(real.string()));
  if (trusted && known) return "";
  if (trusted) folders.push_back(real);
  if (!trusted) std::erase(folders, real);
  std::ranges::sort(folders);
  std::string text;
  for (const fs::path& each : folders) text += each.string() + "\n";
  return WriteFile(*file, text);
}

}  // namespace mbv
