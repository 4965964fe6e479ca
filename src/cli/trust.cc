// mbverify trust, and consent for the programs that scenarios name.

#include "cli/trust.h"

#include <fmt/format.h>
#include <unistd.h>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "base/text.h"
#include "cli/cli.h"
#include "cli/terminal.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

struct TrustArguments {
  std::vector<std::string> folders;
  bool remove = false;
};

int Trust(const TrustArguments& arguments) {
  if (arguments.folders.empty()) {
    if (arguments.remove) return Refuse("--remove: which folder?", "");
    for (const fs::path& folder : TrustedFolders()) {
      fmt::print("{}\n", OneLine(folder.string()));
    }
    return 0;
  }
  for (const std::string& folder : arguments.folders) {
    const std::string trouble = TrustFolder(folder, !arguments.remove);
    if (!trouble.empty()) return Refuse(OneLine(trouble), "");
  }
  return 0;
}

// Folders of the scenarios, each once.
std::set<fs::path> FoldersOf(const std::vector<ProgramList>& lists) {
  std::set<fs::path> folders;
  std::error_code error;
  for (const ProgramList& list : lists) {
    folders.insert(fs::weakly_canonical(fs::absolute(list.scenario, error), error).parent_path());
  }
  return folders;
}

// A person at a terminal.
bool CanAsk() { return isatty(STDIN_FILENO) != 0 && isatty(STDERR_FILENO) != 0; }

char Answer() {
  std::fflush(stderr);
  std::string line;
  if (!std::getline(std::cin, line) || line.empty()) return 'n';
  return line.front();
}

}  // namespace

void AddTrustOption(CLI::App* command, bool* trust) {
  command->add_flag("--trust", *trust,
                    "let the programs run that scenarios name (witnesses), this time");
}

void ListPrograms(const std::string& scenario, const std::vector<std::string>& programs) {
  Say(stderr, "{} runs programs as you:\n", OneLine(scenario));
  // Whole: what is left out could be what matters.
  for (const std::string& line : programs) fmt::print(stderr, "  {}\n", line);
}

bool AskForPrograms(const std::string& scenario, const std::vector<std::string>& programs) {
  if (!CanAsk()) return false;
  ListPrograms(scenario, programs);
  Say(stderr, "Run them? [y]es, this time; [N]o: ");
  const char answer = Answer();
  return answer == 'y' || answer == 'Y';
}

int AskForPrograms(const std::vector<std::string>& scenarios, const ScenarioOptions& options,
                   bool trust, bool quiet, ProgramConsent* consent) {
  std::vector<ProgramList> untrusted;
  for (const std::string& scenario : scenarios) {
    ProgramList list = ProgramsOf(scenario, options);
    if (list.programs.empty()) continue;
    if (trust) consent->agreed.insert(list.Fingerprint());
    if (!trust && !consent->Allows(list)) {
      untrusted.push_back(std::move(list));
    } else if (!quiet) {
      ListPrograms(list.scenario, list.Lines());
    }
  }
  if (untrusted.empty()) return 0;
  if (!CanAsk()) {
    Diagnostics refused;
    for (const ProgramList& list : untrusted) refused.Add(Refusal(list));
    SayText(stderr, refused.Text());
    return 2;
  }
  for (const ProgramList& list : untrusted) ListPrograms(list.scenario, list.Lines());
  const std::set<fs::path> folders = FoldersOf(untrusted);
  for (const fs::path& folder : folders) {
    Say(stderr, "[f]rom now on means all scenarios below {}\n", OneLine(folder.string()));
  }
  Say(stderr, "Run them? [y]es, this time; [f]rom now on; [N]o: ");
  const char answer = Answer();
  if (answer == 'f' || answer == 'F') {
    for (const fs::path& folder : folders) {
      const std::string trouble = TrustFolder(folder, true);
      if (!trouble.empty()) return Refuse(OneLine(trouble), "");
    }
  } else if (answer != 'y' && answer != 'Y') {
    return Refuse("its programs may not run", "");
  }
  for (const ProgramList& list : untrusted) consent->agreed.insert(list.Fingerprint());
  return 0;
}

void AddTrustCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<TrustArguments>();
  CLI::App* trust = app->add_subcommand(
      "trust", "Folders whose scenarios may run programs (witnesses) unasked: list, add, remove");
  trust->add_option("folder", arguments->folders, "folders to trust; none: lists them");
  trust->add_flag("--remove", arguments->remove, "do not trust them any more");
  SetFooter(trust, {"trust", "trust ~/my_robots", "trust --remove ~/my_robots"},
            "0 done, 2 bad input");
  trust->callback([arguments, exit_code] { *exit_code = Trust(*arguments); });
}

}  // namespace mbv
