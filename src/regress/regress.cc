#include "regress/regress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>

#include "regress/accuracy.h"
#include "regress/files.h"
#include "regress/history.h"
#include "regress/judge.h"
#include "regress/run_folder.h"
#include "regress/summaries.h"
#include "regress/workers.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string HostName() {
  char name[256] = {};
  return gethostname(name, sizeof name - 1) == 0 ? name : "";
}

// The program's version and the fingerprint of its file: builds differ where versions do not.
std::string ProgramText(const RegressOptions& options) {
  Fingerprint fingerprint;
  fingerprint.AddFile(options.worker.front());
  return fmt::format("{} build {}", options.program.empty() ? "mbverify" : options.program,
                     fingerprint.Text().substr(0, 8));
}

// Everything after the scenarios ran: history, summaries, files.
void Finish(const RegressOptions& options, const RunFolder& folder, RegressOutcome* outcome) {
  RegressReport& report = outcome->report;
  std::sort(report.cases.begin(), report.cases.end(),
            [](const CaseResult& a, const CaseResult& b) { return a.key < b.key; });
  std::map<std::string, std::string> thumbnails;
  std::map<std::string, GoldenTraces> goldens;
  for (const CaseResult& result : report.cases) {
    if (!result.has_folder) continue;
    if (options.pictures) thumbnails[result.key] = folder.Thumbnail(result.key);
    if (!options.history.empty()) goldens[result.key] = folder.Golden(result.key);
  }
  if (!options.history.empty()) {
    const std::string trouble = AppendRun(options.history, goldens, &report);
    if (!trouble.empty()) report.notes.push_back("not in the history: " + trouble);
  }
  const auto write = [&](const fs::path& path, const std::string& content) {
    const std::string trouble = WriteDurably(path, content);
    if (trouble.empty()) {
      outcome->files.push_back(path);
    } else {
      outcome->trouble = trouble;
    }
  };
  write(options.junit.empty() ? folder.path() / "junit.xml" : fs::path(options.junit),
        ToJUnit(report));
  write(options.markdown.empty() ? folder.path() / "summary.md" : fs::path(options.markdown),
        ToMarkdown(report));
  const auto summary = [&](const std::string& scenario) {
    return ReadWholeFile(folder.path() / scenario / "summary.json");
  };
  for (const std::string& document : options.tables) {
    if (const auto text = ReadWholeFile(document)) {
      write(document, FillAccuracyTables(*text, summary));
    } else {
      outcome->trouble = document + ": cannot be read";
    }
  }
  write(folder.path() / "index.html", ToIndexHtml(report, thumbnails));
  write(folder.path() / "regress.json", ToJson(report));
  outcome->exit_code = outcome->trouble.empty() ? ExitCodeOf(report) : 2;
}

class Run {
 public:
  Run(const RegressOptions& options, const RegressProgress& progress)
      : options_(options), progress_(progress), folder_(options.out) {}

  RegressOutcome Do() {
    if (!Prepare()) return BadInput();
    const auto start = std::chrono::steady_clock::now();
    report().run.started_utc = UtcNow();
    KeepFinished();
    SortByCost();
    if (progress_.begin) progress_.begin(cases_.size(), report().cases.size());
    const bool whole = RunWorkers();
    report().run.wall_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report().run.finished_utc = UtcNow();
    if (!whole) {
      outcome_.trouble =
          fmt::format("interrupted after {} of {} scenarios; --resume continues",
                      report().cases.size(), report().cases.size() + cases_.size() - done_);
      outcome_.exit_code = 3;
      return std::move(outcome_);
    }
    Finish(options_, folder_, &outcome_);
    // A finished run is not resumed: the next --resume starts anew.
    if (outcome_.trouble.empty()) folder_.ForgetStates();
    return std::move(outcome_);
  }

 private:
  RegressReport& report() { return outcome_.report; }

  RegressOutcome BadInput() {
    outcome_.exit_code = 2;
    return std::move(outcome_);
  }

  bool Prepare() {
    FoundCases found = FindCases(options_.paths);
    for (const std::string& trouble : found.troubles) {
      outcome_.trouble += (outcome_.trouble.empty() ? "" : "\n") + trouble;
    }
    if (!found.troubles.empty()) return false;
    cases_ = std::move(found.cases);
    KeepShard(options_.shard, &cases_);
    outcome_.trouble = folder_.Open();
    if (!outcome_.trouble.empty()) return false;
    report().run.label = options_.label;
    report().run.host = HostName();
    report().run.program = ProgramText(options_);
    report().run.jobs = options_.jobs;
    if (options_.shard.count > 1) {
      report().run.shard = fmt::format("{}/{}", options_.shard.index, options_.shard.count);
    }
    return true;
  }

  // Inputs, program and options decide a result.
  std::string FingerprintOf(const CaseFile& file) {
    Fingerprint fingerprint;
    fingerprint.Add(file.inputs);
    fingerprint.Add(report().run.program);
    fingerprint.Add(options_.pictures ? "pictures" : "no pictures");
    return fingerprint.Text();
  }

  // --resume: results of the interrupted run whose inputs are the same. What crashed or hung is
  // tried again.
  void KeepFinished() {
    if (!options_.resume) {
      folder_.ForgetStates();
      return;
    }
    std::vector<CaseFile> rest;
    for (CaseFile& file : cases_) {
      auto state = folder_.LoadState(file.key);
      const bool usable =
          state && state->fingerprint == FingerprintOf(file) &&
          state->status != CaseStatus::kCrashed && state->status != CaseStatus::kTimedOut &&
          state->status != CaseStatus::kInternal &&
          (!state->has_folder || fs::exists(folder_.Result(file.key) / "summary.json"));
      if (!usable) {
        rest.push_back(std::move(file));
        continue;
      }
      state->kept = true;
      state->file = file.file;
      report().cases.push_back(*std::move(state));
    }
    cases_ = std::move(rest);
  }

  // Long ones first, so that no worker is left alone at the end.
  void SortByCost() {
    if (options_.history.empty() || !fs::exists(options_.history)) return;
    const std::map<std::string, double> wall_s = LastWallTimes(options_.history);
    const auto cost = [&](const CaseFile& file) {
      const auto found = wall_s.find(file.key);
      return found == wall_s.end() ? 1e9 : found->second;  // unknown: may be long
    };
    std::stable_sort(cases_.begin(), cases_.end(),
                     [&](const CaseFile& a, const CaseFile& b) { return cost(a) > cost(b); });
  }

  bool RunWorkers() {
    std::vector<WorkerJob> jobs;
    for (size_t i = 0; i < cases_.size(); ++i) {
      WorkerJob job{options_.worker, folder_.Log(cases_[i].key)};
      for (const std::string& word : {std::string("run"), cases_[i].file, std::string("--out"),
                                      folder_.Staging(i).string()}) {
        job.argv.push_back(word);
      }
      if (!options_.pictures) job.argv.emplace_back("--no-pictures");
      jobs.push_back(std::move(job));
    }
    WorkerPool pool;
    pool.parallel = options_.jobs;
    pool.timeout_s = options_.timeout_s;
    pool.stop = options_.stop;
    pool.tick = progress_.tick;
    pool.started = [&](size_t i) {
      if (progress_.started) progress_.started(cases_[i].key);
    };
    pool.ended = [&](size_t i, const WorkerEnd& end) { Collect(i, end); };
    return pool.Run(jobs);
  }

  void Collect(size_t i, const WorkerEnd& end) {
    const CaseFile& file = cases_[i];
    const std::string output = ReadWholeFile(folder_.Log(file.key)).value_or("");
    const auto staged = folder_.FindStaged(i);
    const auto summary = staged ? ReadWholeFile(*staged / "summary.json") : std::nullopt;
    CaseResult result = JudgeCase(file, end, options_.timeout_s, output, summary);
    result.fingerprint = FingerprintOf(file);
    if (staged) {
      const std::string trouble = folder_.Publish(*staged, file.key);
      result.has_folder = trouble.empty();
      if (!trouble.empty()) report().notes.push_back(trouble);
    }
    folder_.RemoveStaging(i);
    if (const std::string trouble = folder_.SaveState(result); !trouble.empty()) {
      report().notes.push_back(trouble);
    }
    ++done_;
    if (progress_.ended) progress_.ended(result);
    report().cases.push_back(std::move(result));
  }

  const RegressOptions& options_;
  const RegressProgress& progress_;
  RunFolder folder_;
  std::vector<CaseFile> cases_;  ///< still to run
  size_t done_ = 0;
  RegressOutcome outcome_;
};

// Adds one run's cases; "" or what is wrong with it.
std::string Join(const fs::path& from, const RunFolder& folder, RegressReport* report) {
  const auto text = ReadWholeFile(from / "regress.json");
  if (!text) return fmt::format("{}: no regress.json in this folder", from.string());
  auto part = ReportFromJson(*text);
  if (!part) return fmt::format("{}: is no regress.json of this version", from.string());
  RunInfo& run = report->run;
  const bool first = report->cases.empty() && run.started_utc.empty();
  if (first) {
    run = part->run;
    run.id = 0;
    run.shard.clear();
  } else {
    run.started_utc = std::min(run.started_utc, part->run.started_utc);
    run.finished_utc = std::max(run.finished_utc, part->run.finished_utc);
    run.wall_s = std::max(run.wall_s, part->run.wall_s);  // shards run side by side
    run.jobs += part->run.jobs;
    if (part->run.program != run.program) {
      report->notes.push_back(fmt::format("{} was made by {}", from.string(), part->run.program));
    }
  }
  for (const std::string& note : part->notes) report->notes.push_back(note);
  for (CaseResult& result : part->cases) {
    const auto same = [&](const CaseResult& other) { return other.key == result.key; };
    if (std::any_of(report->cases.begin(), report->cases.end(), same)) {
      return fmt::format("{}: {} is in another folder, too", from.string(), result.key);
    }
    std::error_code error;
    if (result.has_folder) {
      fs::create_directories(folder.Result(result.key), error);
      fs::copy(from / result.key, folder.Result(result.key),
               fs::copy_options::recursive | fs::copy_options::overwrite_existing, error);
      if (error) return fmt::format("cannot copy {}: {}", result.key, error.message());
    }
    const fs::path log = folder.Log(result.key);
    fs::create_directories(log.parent_path(), error);
    fs::copy_file(from / "logs" / (result.key + ".txt"), log, fs::copy_options::overwrite_existing,
                  error);
    result.drifts.clear();  // judged anew against the history given
    result.course.clear();
    report->cases.push_back(std::move(result));
  }
  return "";
}

}  // namespace

RegressOutcome Regress(const RegressOptions& options, const RegressProgress& progress) {
  return Run(options, progress).Do();
}

RegressOutcome MergeRuns(const std::vector<std::string>& folders, const RegressOptions& options) {
  RegressOutcome outcome;
  outcome.exit_code = 2;
  RunFolder folder(options.out);
  outcome.trouble = folder.Open();
  for (const std::string& from : folders) {
    if (outcome.trouble.empty()) outcome.trouble = Join(from, folder, &outcome.report);
  }
  if (!outcome.trouble.empty()) return outcome;
  if (!options.label.empty()) outcome.report.run.label = options.label;
  Finish(options, folder, &outcome);
  return outcome;
}

}  // namespace mbv
