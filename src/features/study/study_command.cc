// mbverify study
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/regress/find_cases.h"
#include "features/study/study.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

using StudyClock = std::chrono::steady_clock;

struct StudyArguments {
  std::vector<std::string> files, folders;
  std::string out = "out", shard;
  RunStudyOptions options;
  JsonOption json;
};

// How far a study is and how long the rest takes: one line that rewrites itself, or a line now and
// then where there is no such terminal.
class StudyProgress {
 public:
  explicit StudyProgress(std::string name) : name_(std::move(name)) {}

  void Report(std::uint64_t done, std::uint64_t all) {
    constexpr double kBetween_s = 30.0;
    if (first_ == 0) first_ = done;
    const double elapsed = Since(start_);
    const double left = done > first_ ? elapsed / static_cast<double>(done - first_) *
                                            static_cast<double>(all - done)
                                      : 0.0;
    const std::string text = fmt::format("{}: {} of {} points", name_, done, all);
    if (line_.active()) {
      line_.Show(text, static_cast<double>(done) / static_cast<double>(all));
    } else if (Since(reported_) > kBetween_s) {
      Say(stderr, "{}, {} left\n", text, done > first_ ? TimeText(left) : "?");
      reported_ = StudyClock::now();
    }
  }

 private:
  static double Since(StudyClock::time_point start) {
    return std::chrono::duration<double>(StudyClock::now() - start).count();
  }

  std::string name_;
  ProgressLine line_{true};
  StudyClock::time_point start_ = StudyClock::now(), reported_ = start_;
  std::uint64_t first_ = 0;
};

// What a study came to; its exit code.
int PrintStudy(const StudyArguments& arguments, const std::string& file,
               const StudyOutcome& outcome) {
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.folder.empty()) return outcome.exit_code;
  int exit_code = outcome.exit_code;
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report));
    exit_code = WorseExit(exit_code,
                          arguments.json.Write(ToJson(*outcome.report),
                                               {{file, ""}, {outcome.report->study.scenario, ""}}));
  }
  Say(stderr, "wrote {}\n", outcome.folder);
  return exit_code;
}

// A word that is not a file but nearly a command; "" where there is none.
std::string MisspeltCommand(const std::vector<std::string>& words) {
  std::error_code error;
  const bool file = words.empty() || std::filesystem::exists(FindScenario(words[0]), error);
  return file || ClosestWord(words[0], {"merge"}).empty() ? "" : words[0];
}

int RunStudies(StudyArguments arguments) {
  if (arguments.files.empty()) return Refuse("which study?", "mbverify study FILE.yaml");
  if (const std::string word = MisspeltCommand(arguments.files); !word.empty()) {
    return Refuse(fmt::format("there is no command 'mbverify study {}'", word),
                  DidYouMean(word, {"merge"}));
  }
  if (arguments.files.size() > 1 && arguments.json.wanted()) {
    return Refuse("--json is about one study", "run them one after the other");
  }
  if (!arguments.shard.empty()) {
    const auto shard = ParseShard(arguments.shard);
    if (!shard) return Refuse("--shard " + arguments.shard + ": write i/n with 1 <= i <= n", "");
    arguments.options.points.share = {static_cast<std::uint64_t>(shard->index - 1),
                                      static_cast<std::uint64_t>(shard->count)};
  }
  arguments.options.out_dir = arguments.out;
  int exit_code = 0;
  for (const std::string& given : arguments.files) {
    const std::string file = FindScenario(given);
    StudyOutcome outcome;
    {
      StudyProgress progress(file);
      arguments.options.points.progress = [&](std::uint64_t done, std::uint64_t all) {
        progress.Report(done, all);
      };
      outcome = RunStudy(file, arguments.options);
    }
    exit_code = WorseExit(exit_code, PrintStudy(arguments, file, outcome));
  }
  return exit_code;
}

void AddStudyOptions(CLI::App* study, StudyArguments* arguments) {
  study->add_option("files", arguments->files, "study files");
  study->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  study->add_option("--jobs", arguments->options.points.jobs, "worker processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  study->add_flag("--resume", arguments->options.resume, "go on with what a killed study left");
  study->add_option("--shard", arguments->shard, "i/n: every n-th point, to be merged later");
  study
      ->add_option("--timeout", arguments->options.points.timeout_s,
                   "wall time limit of a point [s]")
      ->check(Positive())
      ->capture_default_str();
  study
      ->add_option("--count", arguments->options.reading.drawn.count,
                   "how many points are drawn, instead of the file's number")
      ->check(WholeNumber());
  study
      ->add_option("--seed", arguments->options.reading.drawn.seed,
                   "which points are drawn, instead of the file's seed")
      ->check(WholeNumber());
  study->add_flag("--yes", arguments->options.reading.many, "take more than 1e7 points");
  arguments->json.AddTo(study);
}

}  // namespace

void AddStudyCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<StudyArguments>();
  arguments->options.points.jobs = AllCores();
  CLI::App* study = app->add_subcommand(
      "study", "Vary numbers of a scenario: which of them matter, and how often limits are kept");
  AddStudyOptions(study, arguments.get());
  CLI::App* merge = study->add_subcommand("merge", "Join the folders of all shards of a study");
  merge->add_option("folders", arguments->folders, "result folders of the shards")->required();
  merge->add_option("-o,--out", arguments->out, "folder for results")->capture_default_str();
  merge->callback([arguments, exit_code] {
    *exit_code = PrintStudy(*arguments, "", MergeStudies(arguments->folders, arguments->out));
  });
  const char* codes = "0 limits are kept, 1 one is not, 2 bad input, 3 no point could run";
  SetFooter(merge, {"study merge out/s.shard-1-of-2 out/s.shard-2-of-2 -o out"}, codes);
  SetFooter(study,
            {"study my_study.yaml", "study my_study.yaml --resume",
             "study my_study.yaml --shard 2/8 --out shards"},
            codes);
  study->callback([arguments, merge, exit_code] {
    if (!merge->parsed()) *exit_code = RunStudies(*arguments);
  });
}

}  // namespace mbv
