#include "cli/options.h"

#include <fmt/format.h>
#include <unistd.h>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <memory>
#include <set>

#include "base/demand.h"
#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/terminal.h"
#include "model_file/load_model.h"
#include "verify/model_text.h"
#include "verify/version.h"

namespace mbv {

void AddToleranceOption(CLI::App* command, double* tolerance_m) {
  command
      ->add_option("--closure-tolerance", *tolerance_m,
                   "gap [m] up to which overconstrained loops of a robot count as rounded and are "
                   "closed by moving joint frames; by default what the digits of its file explain; "
                   "0: none")
      ->check(CLI::NonNegativeNumber);
}

void AddRobotOptions(CLI::App* command, RobotArguments* arguments) {
  command
      ->add_option("--assembly", arguments->assembly,
                   "CLOSURE=N: takes the N-th of the ways to close the loops of this closure that "
                   "are reported (repeatable)")
      ->allow_extra_args(false);
  command->add_option("--base", arguments->base,
                      "body or link of a robot that is held; by default its root, where joints or "
                      "loops do not hold it in the world");
  command->add_flag("--free-base", arguments->free_base,
                    "nothing is held: a free joint carries the root of the robot");
  command
      ->add_option("--plant", arguments->plants,
                   "BODY, BODY:point|line|sole@x,y,z or {on: BODY, …}: this foot stands on the "
                   "ground, the base is free (repeatable)")
      ->allow_extra_args(false);
  AddToleranceOption(command, &arguments->closure_tolerance_m);
}

int RefuseRobotOptions() {
  return Refuse(
      "--assembly, --base, --free-base, --plant and --closure-tolerance are for robots (.urdf, "
      ".xml, .sdf)",
      "a model file says it itself: guesses of the joints, what is fixed to the world, "
      "contacts, closure_tolerance");
}

bool ReadRobotOptions(const RobotArguments& arguments, LoadOptions* options) {
  options->base = arguments.base;
  options->free_base = arguments.free_base || !arguments.plants.empty();
  options->plants = arguments.plants;
  options->closure_tolerance_m = arguments.closure_tolerance_m;
  bool good = true;
  if (options->free_base && !options->base.empty()) {
    Say(stderr, "--base {}: error: --free-base and --plant hold no body\n", options->base);
    good = false;
  }
  for (const std::string& text : arguments.assembly) {
    const size_t at = text.rfind('=');
    const std::string number = at == std::string::npos ? "" : text.substr(at + 1);
    int n = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), n);
    if (at == 0 || error != std::errc() || end != number.data() + number.size() || n < 1) {
      Say(stderr, "--assembly {}: error: write CLOSURE=N with N from 1, e.g. knee_loop=2\n", text);
      good = false;
      continue;
    }
    options->assembly[text.substr(0, at)] = n;
  }
  return good;
}

std::optional<LoadResult> LoadModelOrRefuse(const std::string& model,
                                            const std::vector<std::string>& set,
                                            const RobotArguments& robot) {
  const auto file = FindModelOrRefuse(model);
  if (!file) return std::nullopt;
  LoadOptions options;
  if (!ReadParameters(set, &options)) return std::nullopt;
  if (!IsRobotFile(*file) && robot.any()) {
    (void)RefuseRobotOptions();
    return std::nullopt;
  }
  if (!ReadRobotOptions(robot, &options)) return std::nullopt;
  LoadResult loaded = LoadRobot(*file, options);
  SayText(stderr, loaded.diagnostics.Text());
  if (!loaded.mechanism) return std::nullopt;
  return loaded;
}

void JsonOption::AddTo(CLI::App* command) {
  const CLI::App* above = command->get_parent();
  const bool nested = above != nullptr && above->get_parent() != nullptr;
  command_ = (nested ? above->get_name() + "_" : "") + command->get_name();
  command->add_option("--json", path_,
                      "write the result to this file, too; -: to standard output, the text then to "
                      "standard error");
}

int JsonOption::Write(const std::string& json, const std::vector<InputFile>& inputs) const {
  if (!wanted()) return 0;
  return Write(ParseJson<nlohmann::ordered_json>(json), inputs);
}

int JsonOption::Write(const nlohmann::ordered_json& json,
                      const std::vector<InputFile>& inputs) const {
  if (!wanted()) return 0;
  const std::string text = Text(json);
  if (path_ != "-") return WriteWholeFile(path_, text, inputs);
  fmt::print("{}", text);
  return 0;
}

std::string JsonOption::Text(const nlohmann::ordered_json& json) const {
  MBV_DEMAND(json.is_object(), command_);
  nlohmann::ordered_json whole = {
      {"schema", json.value("schema", fmt::format("mbverify.{}/1", command_))},
      {"program", fmt::format("mbverify {}", kVersion)}};
  whole.update(json);
  return Dump(whole);
}

nlohmann::ordered_json FindingObjects(const Diagnostics& diagnostics) {
  auto findings = nlohmann::ordered_json::array();
  for (const Finding& f : diagnostics.findings()) {
    findings.push_back({{"severity", f.severity == Severity::kError ? "error" : "warning"},
                        {"file", f.file},
                        {"line", f.line},
                        {"column", f.column},
                        {"message", f.message},
                        {"hint", f.hint}});
  }
  return findings;
}

// mbverify trust, and consent for the programs that scenarios name.

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
