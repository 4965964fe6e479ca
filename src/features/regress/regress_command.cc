// mbverify regress, merge

#include <fmt/format.h>
#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/regress/case_result.h"
#include "features/regress/history.h"
#include "features/regress/regress.h"
#include "features/regress/summaries.h"
#include "features/regress/trouble_text.h"
#include "report/html_report.h"
#include "report/page.h"
#include "verify/version.h"

namespace mbv {
namespace {

// What a regression does now: a table that rewrites itself on a terminal, plain lines elsewhere.

class LiveTable {
 public:
  /// Writes to stderr; nothing at all unless `wanted`.
  explicit LiveTable(bool wanted);

  void Begin(size_t cases, size_t kept);
  void Started(const std::string& key);
  void Ended(const CaseResult& result);
  void Draw();   ///< the running scenarios below the finished ones
  void Clear();  ///< removes the running ones

 private:
  struct Running {
    std::string key;
    std::chrono::steady_clock::time_point start;
  };
  bool wanted_ = false, terminal_ = false, color_ = false;
  size_t cases_ = 0, done_ = 0, failed_ = 0, lines_ = 0;
  std::vector<Running> running_;
};

LiveTable::LiveTable(bool wanted)
    : wanted_(wanted), terminal_(ObeysEscapes(stderr)), color_(WantsColor(stderr)) {}

void LiveTable::Begin(size_t cases, size_t kept) {
  cases_ = cases;
  if (wanted_ && kept > 0) Say(stderr, "{} finished scenarios are kept\n", kept);
}

void LiveTable::Started(const std::string& key) {
  running_.push_back({key, std::chrono::steady_clock::now()});
}

void LiveTable::Ended(const CaseResult& result) {
  ++done_;
  failed_ += result.failed() ? 1 : 0;
  std::erase_if(running_, [&](const Running& running) { return running.key == result.key; });
  if (!wanted_) return;
  Clear();
  const char* start = !color_ ? "" : result.failed() ? "\x1b[1;31m" : "\x1b[32m";
  Say(stderr, "[{:>{}}/{}] {}{:<16}{} {:<52} {:>6.1f} s {:>5.0f} MiB  {}\n", done_,
      fmt::formatted_size("{}", cases_), cases_, start, WordOf(result), color_ ? "\x1b[0m" : "",
      result.key, result.cost.wall_s, static_cast<double>(result.cost.peak_kib) / 1024.0,
      result.failed() ? FailureLine(result) : KeyText(result));
  Draw();
}

void LiveTable::Draw() {
  if (!wanted_ || !terminal_ || running_.empty()) return;
  Clear();
  // What the terminal would break could not be taken back.
  const size_t columns = TerminalColumns(stderr), most = 52;
  const size_t room = columns == 0 ? most : std::min(most, std::max<size_t>(columns, 28) - 27);
  for (const Running& running : running_) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - running.start;
    Say(stderr, "  running  {:<{}.{}} {:>6.1f} s\n", running.key, room, room, elapsed.count());
  }
  Say(stderr, "  {} of {} done, {} not as expected\n", done_, cases_, failed_);
  lines_ = running_.size() + 1;
  std::fflush(stderr);
}

void LiveTable::Clear() {
  if (lines_ > 0) fmt::print(stderr, "\x1b[{}A\x1b[J", lines_);
  lines_ = 0;
}

}  // namespace
namespace {

struct RegressArguments {
  RegressOptions options;
  std::vector<std::string> folders;  // of merge
  std::string shard, worker;
  bool trust = false, no_reports = false, embed = false, no_pictures = false, no_history = false,
       quiet = false, fail_on_drift = false;
  JsonOption json;
};

volatile std::sig_atomic_t interrupted = 0;
void Interrupt(int) { interrupted = 1; }

// Reports of a regression run share one script unless each is to be sent alone.
void ShareScript(const RegressArguments& arguments, RegressOptions* options) {
  if (arguments.no_reports) {
    options->worker_options.emplace_back("--no-report");
    return;
  }
  if (arguments.embed) return;
  const std::string name = SharedScriptName();
  options->shared_files[name] = std::string(PageScript());
  options->worker_options.insert(options->worker_options.end(),
                                 {"--report-script", "{up}/" + name});
}

// Options that follow from others; false after a message.
bool Complete(RegressArguments* arguments) {
  RegressOptions& options = arguments->options;
  if (!arguments->shard.empty()) {
    const auto shard = ParseShard(arguments->shard);
    if (!shard) {
      Say(stderr, "--shard {}: error: write i/n with 1 <= i <= n, e.g. 2/3\n", arguments->shard);
      return false;
    }
    options.shard = *shard;
  }
  if (arguments->no_history) {
    options.history.clear();
  } else if (options.history.empty() && options.shard.count == 1) {
    options.history = (std::filesystem::path(options.out) / "history.sqlite").string();
  }
  if (options.fail_on_missing && options.history.empty()) {
    Say(stderr, "--fail-on-missing: error: needs a history: --history FILE says what there was{}\n",
        options.shard.count > 1 ? "; or give it to merge" : "");
    return false;
  }
  if (arguments->json.path() != "-") options.json = arguments->json.path();
  options.pictures = !arguments->no_pictures;
  ShareScript(*arguments, &options);
  options.program = std::string("mbverify ") + kVersion;
  if (!arguments->worker.empty()) options.worker = {arguments->worker};
  options.stop = &interrupted;
  return true;
}

int Conclude(const RegressArguments& arguments, const RegressOutcome& outcome) {
  if (!outcome.trouble.empty()) Say(stderr, "{}\n", outcome.trouble);
  if (outcome.files.empty()) return outcome.exit_code;
  SayText(arguments.json.text(), ToSummaryText(outcome.report));
  std::vector<InputFile> inputs;
  for (const CaseResult& result : outcome.report.cases) {
    inputs.insert(inputs.end(), result.input_files.begin(), result.input_files.end());
  }
  if (const int code = arguments.json.Write(ToJson(outcome.report), inputs); code != 0) return code;
  if (!arguments.quiet) {
    for (const std::string& file : outcome.files) Say(stderr, "wrote {}\n", file);
  }
  const bool drifted = CountCases(outcome.report).drifted > 0;
  return outcome.exit_code == 0 && drifted && arguments.fail_on_drift ? 1 : outcome.exit_code;
}

// Workers have no terminal: what they may run is decided here, and handed to each. A scenario whose
// reading ends the process is left to its worker, which may run nothing.
int AskForCases(RegressArguments* arguments) {
  constexpr double kLongestReading_s = 60.0;
  FoundCases found = FindCases(arguments->options.paths);
  KeepShard(arguments->options.shard, &found.cases);
  std::vector<std::string> files;
  for (const CaseFile& file : found.cases) {
    if (!file.head.names_programs) continue;
    const auto list = InChildren(1, kLongestReading_s,
                                 [&](size_t) { return ProgramsOf(file.file, {}).Fingerprint(); });
    if (!list.front()) continue;
    arguments->options.agreed_programs[file.file] = *list.front();
    files.push_back(file.file);
  }
  ProgramConsent consent;
  return AskForPrograms(files, {}, arguments->trust, arguments->quiet, &consent);
}

int RunRegress(RegressArguments* arguments) {
  if (!Complete(arguments)) return 2;
  if (const int code = AskForCases(arguments); code != 0) return code;
  std::signal(SIGINT, Interrupt);
  std::signal(SIGTERM, Interrupt);
  LiveTable table(!arguments->quiet);
  RegressProgress progress;
  progress.begin = [&](size_t cases, size_t kept) { table.Begin(cases, kept); };
  progress.started = [&](const std::string& key) { table.Started(key); };
  progress.ended = [&](const CaseResult& result) { table.Ended(result); };
  progress.tick = [&] { table.Draw(); };
  const RegressOutcome outcome = Regress(arguments->options, progress);
  table.Clear();
  return Conclude(*arguments, outcome);
}

int RunMerge(RegressArguments* arguments) {
  if (!Complete(arguments)) return 2;
  return Conclude(*arguments, MergeRuns(arguments->folders, arguments->options));
}

void AddOutputOptions(CLI::App* app, RegressArguments* arguments) {
  RegressOptions& options = arguments->options;
  app->add_option("--out", options.out, "folder for results and summaries")->capture_default_str();
  app->add_option("--history", options.history, "SQLite file to append to (OUT/history.sqlite)");
  app->add_flag("--no-history", arguments->no_history, "do not keep or judge the history");
  app->add_option("--junit", options.junit, "JUnit XML file (OUT/junit.xml)");
  app->add_option("--markdown", options.markdown, "Markdown file (OUT/summary.md)");
  app->add_option("--tables", options.tables,
                  "documents whose accuracy tables are filled with the results");
  arguments->json.AddTo(app);
  app->add_option("--label", options.label, "text kept with the run, e.g. a commit");
  app->add_flag("--fail-on-drift", arguments->fail_on_drift, "exit code 1 if a metric drifted");
  app->add_flag("--fail-on-missing", options.fail_on_missing,
                "exit code 1 if a scenario that an earlier run had is gone");
  app->add_flag("-q,--quiet", arguments->quiet, "only what failed or drifted, and the counts");
}

}  // namespace

void AddRegressCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RegressArguments>();
  RegressOptions& options = arguments->options;
  options.jobs = AllCores();
  CLI::App* regress = app->add_subcommand(
      "regress", "Run all scenarios, judge them by their expect:, keep history");
  regress->add_option("path", options.paths, "scenario files or folders (scenarios)");
  AddOutputOptions(regress, arguments.get());
  regress->add_option("--jobs", options.jobs, "worker processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  regress->add_option("--shard", arguments->shard, "i/n: run the i-th of n parts");
  regress->add_flag("--resume", options.resume, "keep what an interrupted run has finished");
  regress->add_option("--timeout", options.timeout_s, "wall time limit of a scenario [s]")
      ->check(Positive())
      ->capture_default_str();
  AddTrustOption(regress, &arguments->trust);
  regress->add_flag("--no-pictures", arguments->no_pictures, "do not draw snapshots");
  regress->add_flag("--no-reports", arguments->no_reports, "do not write a report.html for each");
  regress->add_flag("--embed", arguments->embed,
                    "each report.html with its script inside, to be sent alone");
  regress->add_option("--worker", arguments->worker, "program run instead of this one")->group("");
  SetFooter(regress,
            {"regress", "regress scenarios/spr_tripod --no-pictures --junit junit.xml",
             "regress --shard 1/4 --out shard1"},
            "0 all as expected, 1 some not, 2 bad input, 3 some could not run");
  regress->callback([arguments, exit_code] { *exit_code = RunRegress(arguments.get()); });
}

void AddMergeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RegressArguments>();
  CLI::App* merge = app->add_subcommand("merge", "Join the folders of regress --shard into one");
  merge->add_option("folder", arguments->folders, "folders of regress")->required();
  AddOutputOptions(merge, arguments.get());
  merge->add_flag("--partial", arguments->options.partial,
                  "join what there is: not all shards, or of different runs");
  SetFooter(merge, {"merge shard1 shard2 --out merged --history nightly.sqlite"},
            "0 all as expected, 1 some not, 2 bad input (also: shards of different regression "
            "runs), 3 some could not run, or a shard is missing");
  merge->callback([arguments, exit_code] { *exit_code = RunMerge(arguments.get()); });
}

// mbverify history

namespace {

struct HistoryArguments {
  std::string history = "out/regress/history.sqlite";
  std::string run_a, run_b, csv, scenario, note;
  bool changed = false;
  JsonOption list_json, compare_json;  // each names its own command
};

int Show(const HistoryText& answer, const HistoryArguments& arguments, const JsonOption& json) {
  SayText(json.text(), answer.text);
  if (answer.trouble.empty()) return json.Write(answer.json, {{arguments.history, ""}});
  Say(stderr, "error: {}\n", answer.trouble);
  return 2;
}

int Export(const HistoryArguments& arguments) {
  const HistoryText answer = HistoryCsv(arguments.history);
  if (!answer.trouble.empty()) return Show(answer, arguments, {});
  if (arguments.csv.empty()) {
    fmt::print("{}", answer.text);
    return 0;
  }
  return WriteWholeFile(arguments.csv, answer.text, {{arguments.history, ""}});
}

}  // namespace

void AddHistoryCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<HistoryArguments>();
  CLI::App* history = app->add_subcommand("history", "Ask the history of regress");
  history->add_option("--history", arguments->history, "SQLite file")->capture_default_str();
  history->require_subcommand(1);
  history->fallthrough();
  CLI::App* list = history->add_subcommand("list", "All runs");
  arguments->list_json.AddTo(list);
  list->callback([arguments, exit_code] {
    *exit_code = Show(ListRuns(arguments->history), *arguments, arguments->list_json);
  });
  CLI::App* compare = history->add_subcommand("compare", "What differs between two runs");
  compare->add_option("run1", arguments->run_a, "number, last or last~1")->required();
  compare->add_option("run2", arguments->run_b, "number, last or last~1")->required();
  compare->add_flag("--changed", arguments->changed, "only scenarios in which something changed");
  arguments->compare_json.AddTo(compare);
  compare->callback([arguments, exit_code] {
    *exit_code = Show(
        CompareRuns(arguments->history, arguments->run_a, arguments->run_b, arguments->changed),
        *arguments, arguments->compare_json);
  });
  CLI::App* csv = history->add_subcommand("export", "All metrics of all runs as CSV");
  csv->add_option("--csv", arguments->csv, "write to this file instead of stdout");
  csv->callback([arguments, exit_code] { *exit_code = Export(*arguments); });
  CLI::App* accept =
      history->add_subcommand("accept", "Start baselines with a run: drift is meant");
  accept->add_option("run", arguments->run_a, "number, last or last~1")->required();
  accept->add_option("--scenario", arguments->scenario, "only this one, e.g. spr_tripod/default");
  accept->add_option("--note", arguments->note, "why");
  accept->callback([arguments, exit_code] {
    *exit_code =
        Show(AcceptRun(arguments->history, arguments->run_a, arguments->scenario, arguments->note),
             *arguments, {});
  });
  const char* codes = "0 done, 2 bad input";
  SetFooter(list, {"history list", "history list --history nightly.sqlite"}, codes);
  SetFooter(compare, {"history compare last~1 last --changed", "history compare 3 7"}, codes);
  SetFooter(csv, {"history export --csv metrics.csv"}, codes);
  SetFooter(accept, {"history accept last --scenario spr_tripod/default --note \"stiffer legs\""},
            codes);
  SetFooter(history,
            {"history list", "history compare last~1 last --history nightly.sqlite",
             "history export --csv metrics.csv"},
            codes);
}

}  // namespace mbv
