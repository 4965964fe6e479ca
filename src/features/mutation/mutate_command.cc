// mbverify sensitivity
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "base/files.h"
#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/scratch_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/mutation/mutate.h"
#include "features/regress/find_cases.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "verify/version.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

struct MutateArguments {
  std::string scenario;
  std::string size = "0.1 %";
  double resolution_percent = 10.0;
  std::vector<std::string> numbers;
  bool markdown = false, no_search = false, no_faults = false;
  std::string mode = "both", part, progress, out;
  JsonOption json;
  int jobs = 1;
};

// "0.1", "0.1%", "0.1 %": percent; empty when it is none or not above 0.
std::optional<double> ReadPercent(std::string text) {
  while (!text.empty() && (text.back() == '%' || text.back() == ' ')) text.pop_back();
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  if (!(value > 0.0) || !std::isfinite(value)) return {};
  return value / 100.0;
}

// Empty after a message.
std::optional<MutationOptions> OptionsOf(const MutateArguments& arguments) {
  MutationOptions options;
  const auto size = ReadPercent(arguments.size);
  if (!size) {
    Say(stderr, "--size {}: error: violates: a percentage above 0, e.g. 1%\n", arguments.size);
    return {};
  }
  options.size = *size;
  options.numbers = arguments.numbers;
  options.resolution = arguments.resolution_percent / 100.0;
  options.smallest = !arguments.no_search;
  options.structural = !arguments.no_faults;
  options.modes = arguments.mode == "own"       ? MutationModes::kOwn
                  : arguments.mode == "inverse" ? MutationModes::kInverse
                                                : MutationModes::kBoth;
  if (arguments.part.empty()) return options;
  const auto part = ParseShard(arguments.part);
  if (!part) {
    Say(stderr, "--part {}: error: write i/n with 1 <= i <= n, e.g. 2/3\n", arguments.part);
    return {};
  }
  options.part = static_cast<size_t>(part->index - 1);
  options.parts = static_cast<size_t>(part->count);
  return options;
}

// What a worker is started with: these arguments, for one part; it writes how far it is.
std::vector<std::string> CommandOf(const MutateArguments& arguments, int part,
                                   const std::string& json, const std::string& progress) {
  std::vector<std::string> argv = {ProgramToStart(),
                                   "sensitivity",
                                   arguments.scenario,
                                   "--size",
                                   arguments.size,
                                   "--resolution",
                                   fmt::format("{:.17g}", arguments.resolution_percent),
                                   "--part",
                                   fmt::format("{}/{}", part + 1, arguments.jobs),
                                   "--mode",
                                   arguments.mode,
                                   "--json",
                                   json,
                                   "--progress",
                                   progress};
  for (const std::string& number : arguments.numbers) {
    argv.insert(argv.end(), {"--parameter", number});
  }
  if (arguments.no_search) argv.emplace_back("--no-search");
  if (arguments.no_faults) argv.emplace_back("--no-faults");
  return argv;
}

// The work shared out to processes.
class Workers {
 public:
  explicit Workers(const MutateArguments& arguments)
      : arguments_(arguments),
        parts_(static_cast<size_t>(arguments.jobs)),
        ended_(parts_.size(), false) {}

  // Where a worker fails, the report has its exit code only, and what it printed is shown.
  MutationReport Run() {
    if (!folder_.trouble().empty()) {
      Say(stderr, "error: {}\n", folder_.trouble());
      return Failed(3);
    }
    std::vector<WorkerJob> jobs;
    for (size_t k = 0; k < parts_.size(); ++k) {
      jobs.push_back({CommandOf(arguments_, static_cast<int>(k), Place(k, "json").string(),
                                Place(k, "done").string()),
                      Place(k, "log")});
    }
    WorkerPool pool;
    pool.parallel = arguments_.jobs;
    pool.timeout_s = std::numeric_limits<double>::infinity();
    pool.ended = [this](size_t part, const WorkerEnd& end) { Take(part, end); };
    if (progress_.active()) pool.tick = [this] { ShowProgress(); };
    (void)pool.Run(jobs);
    progress_.Clear();
    return failure_ == 0 ? MergeParts(std::move(parts_)) : Failed(failure_);
  }

 private:
  [[nodiscard]] fs::path Place(size_t part, const char* ending) const {
    return folder_.path() / fmt::format("{}.{}", part, ending);
  }

  static MutationReport Failed(int exit_code) {
    MutationReport report;
    report.exit_code = exit_code;
    return report;
  }

  // The mean of what the workers wrote: they have as many numbers each.
  void ShowProgress() {
    double done = 0.0;
    for (size_t k = 0; k < parts_.size(); ++k) {
      const std::string text = ended_[k] ? "1" : ReadWholeFile(Place(k, "done")).value_or("");
      double fraction = 0.0;
      std::from_chars(text.data(), text.data() + text.size(), fraction);
      done += std::clamp(fraction, 0.0, 1.0);
    }
    farthest_ = std::max(farthest_, done / static_cast<double>(parts_.size()));
    progress_.Show(fmt::format("{} workers", arguments_.jobs), farthest_);
  }

  void Take(size_t part, const WorkerEnd& end) {
    ended_[part] = true;
    auto report = MutationReportOf(ReadWholeFile(Place(part, "json")).value_or(""));
    const bool good = report && (end.exit_code == 0 || end.exit_code == 1);
    if (good) parts_[part] = *std::move(report);
    // All workers find the same in the files.
    if (std::exchange(reported_, true) && (good || failure_ > 0)) return;
    progress_.Clear();
    SayText(stderr, ReadWholeFile(Place(part, "log")).value_or(""));
    if (good) return;
    if (end.signal != 0) Say(stderr, "a worker was ended by signal {}\n", end.signal);
    failure_ = std::max(failure_, end.exit_code > 0 ? end.exit_code : 3);
  }

  const MutateArguments& arguments_;
  const ScratchFolder folder_{"mutate"};
  ProgressLine progress_{true};
  std::vector<MutationReport> parts_;
  std::vector<bool> ended_;
  double farthest_ = 0.0;
  int failure_ = 0;
  bool reported_ = false;
};

MutationReport RunHere(const MutateArguments& arguments, MutationOptions options) {
  ProgressLine progress(true);
  if (progress.active()) {
    options.progress = [&](const std::string& number, double fraction) {
      progress.Show(number, fraction);
    };
  } else if (!arguments.progress.empty()) {
    options.progress = [&, reported = std::chrono::steady_clock::time_point()](
                           const std::string&, double fraction) mutable {
      constexpr std::chrono::milliseconds kBetween(500);
      const auto now = std::chrono::steady_clock::now();
      if (now < reported + kBetween) return;
      reported = now;
      (void)WriteFile(arguments.progress, fmt::format("{:.6f}", fraction), false);
    };
  }
  return MutateScenario(arguments.scenario, options);
}

// "" or what went wrong. Workers read the files; what they read is read once more here.
std::string WriteFolder(const MutateArguments& arguments, const MutationReport& report) {
  const InputWatch inputs;
  const ScenarioResult loaded = LoadScenario(arguments.scenario);
  if (!loaded.scenario) return "";
  OutputFolder folder(arguments.out,
                      loaded.mechanism->name + "/sensitivity/" + loaded.scenario->name);
  std::string trouble = folder.WriteAll(
      {{"sensitivity.json", arguments.json.Text(ParseJson<nlohmann::ordered_json>(ToJson(report)))},
       {"inputs.json", InputsJson(inputs.files())}});
  if (trouble.empty()) Say(stderr, "results in {}\n", folder.target().string());
  return trouble;
}

int Mutate(MutateArguments arguments) {
  arguments.scenario = FindScenario(arguments.scenario);
  const auto options = OptionsOf(arguments);
  if (!options) return 2;
  if (!options->numbers.empty()) {
    arguments.jobs = std::min(arguments.jobs, static_cast<int>(options->numbers.size()));
  }
  if (const int code = RefuseInput(arguments.json.path(), arguments.scenario); code != 0)
    return code;
  const InputWatch watch;
  const bool shared = arguments.jobs > 1 && arguments.part.empty();
  const MutationReport report = shared ? Workers(arguments).Run() : RunHere(arguments, *options);
  SayText(stderr, report.diagnostics.Text());
  const bool nothing = report.mutations.empty() && report.faults.empty();
  if (report.exit_code > 1 || (nothing && arguments.part.empty())) return report.exit_code;
  std::vector<InputFile> inputs = watch.files();
  inputs.push_back({arguments.scenario, ""});  // workers read it
  if (const int code = arguments.json.Write(ToJson(report), inputs); code != 0) return code;
  if (!arguments.part.empty()) return report.exit_code;
  const std::string text = ToText(report, arguments.markdown);
  if (arguments.markdown) {
    fmt::print(arguments.json.text(), "{}", ForTerminal(text));
  } else {
    SayText(arguments.json.text(), text);
  }
  if (arguments.out.empty()) return report.exit_code;
  const std::string trouble = WriteFolder(arguments, report);
  return trouble.empty() ? report.exit_code
                         : NotWritten(trouble, "choose another folder with --out");
}

}  // namespace

void AddSensitivityCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<MutateArguments>();
  arguments->jobs = AllCores();
  CLI::App* mutate = app->add_subcommand(
      "sensitivity",
      "Perturb each number of the simulated side and put structural faults into it: which errors "
      "would be noticed, and down to which size?");
  mutate->add_option("scenario", arguments->scenario, "scenario file that agrees")->required();
  mutate->add_option("--size", arguments->size, "relative error in percent (1%)")
      ->capture_default_str();
  CLI::Option* only =
      mutate
          ->add_option(
              "--parameter", arguments->numbers,
              "only these numbers: a parameter, limb2.azimuth of an instance, or the place of "
              "a number such as bodies.rod.mass (repeatable)")
          ->allow_extra_args(false);
  mutate
      ->add_option("--resolution", arguments->resolution_percent,
                   "of the smallest detectable error, in percent")
      ->check(Positive())
      ->capture_default_str();
  mutate->add_flag("--no-search", arguments->no_search,
                   "smallest errors by proportion, without searching");
  mutate->add_flag("--no-faults", arguments->no_faults, "numbers only");
  mutate
      ->add_option("--mode", arguments->mode,
                   "of a forward scenario: its own, inverse dynamics, or both side by side")
      ->check(OneOf({"both", "own", "inverse"}))
      ->capture_default_str();
  mutate->add_option("--jobs", arguments->jobs, "worker processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  mutate->add_option("--part", arguments->part, "i/n: a worker's share")->group("");
  mutate->add_option("--progress", arguments->progress, "file for a worker's progress")->group("");
  mutate->add_flag("--markdown", arguments->markdown, "print Markdown tables");
  mutate
      ->add_option("--out", arguments->out,
                   "folder that keeps the result, for mbverify sheet; of all numbers only")
      ->excludes(only);
  arguments->json.AddTo(mutate);
  SetFooter(
      mutate,
      {"sensitivity scenarios/stabilizing_platform/sea_state.yaml --size 1%",
       "sensitivity scenarios/four_bar/turn_inverse.yaml --parameter rho --no-search"},
      "0 everything that matters is detected, 1 some is missed, 2 bad input, 3 could not run");
  mutate->callback([arguments, exit_code] { *exit_code = Mutate(*arguments); });
}

}  // namespace mbv
