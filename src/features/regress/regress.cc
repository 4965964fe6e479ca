#include "features/regress/regress.h"

#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <limits>
#include <map>

#include "base/files.h"
#include "base/json_document.h"
#include "base/worker_pool.h"
#include "features/regress/history.h"
#include "features/regress/run_folder.h"
#include "features/regress/trouble_text.h"

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

// Of `mbverify study`: the regression run itself takes the cores.
const std::vector<std::string> kOneWorker = {"--jobs",
                                             "1"};  // of commands with workers of their own

class Run {
 public:
  Run(const RegressOptions& options, const RegressProgress& progress)
      : options_(options), progress_(progress), folder_(options.out) {}

  RegressOutcome Do() {
    if (!Prepare()) return BadInput();
    const auto start = std::chrono::steady_clock::now();
    report().run.started_utc = UtcNow();
    outcome_.trouble = folder_.Begin(report().run.started_utc);
    if (!outcome_.trouble.empty()) return BadInput();
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
    for (const std::string& unread : unread_) AddTrouble(unread, &outcome_);
    for (const std::string& trouble : unpublished_) AddTrouble(trouble, &outcome_);
    FinishRegression(options_, folder_, &outcome_);
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
    for (const std::string& trouble : found.troubles) AddTrouble(trouble, &outcome_);
    if (!found.troubles.empty()) return false;
    cases_ = std::move(found.cases);
    unread_ = std::move(found.unread);
    report().run.covers = CoversOf(options_.paths);
    report().run.found = cases_.size();
    report().fail_on_missing = options_.fail_on_missing;
    KeepShard(options_.shard, &cases_);
    outcome_.trouble = FindClash(options_, cases_);
    if (outcome_.trouble.empty()) outcome_.trouble = folder_.Open();
    if (outcome_.trouble.empty()) outcome_.trouble = CheckHistory(options_.history);
    if (outcome_.trouble.empty()) outcome_.trouble = Claim();
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

  std::string Claim() {
    std::vector<std::string> keys;
    for (const CaseFile& file : cases_) keys.push_back(file.key);
    std::string trouble = FindTaken(options_, keys);
    return trouble.empty() ? folder_.Claim(RegressionFiles(options_, keys)) : trouble;
  }

  // Scenario, program and options decide a result; and what else was read, see SameInputs().
  std::string FingerprintOf(const CaseFile& file) {
    Fingerprint fingerprint;
    fingerprint.Add(file.inputs);
    fingerprint.Add(file.models);
    fingerprint.Add(report().run.program);
    fingerprint.Add(options_.pictures ? "pictures" : "no pictures");
    for (const std::string& word : options_.worker_options) fingerprint.Add(word);
    return fingerprint.Text();
  }

  // Every file that was read for the result is as it was. Without a result nothing is known.
  bool SameInputs(const CaseResult& state) {
    for (const InputFile& input : state.input_files) {
      auto [known, is_new] = fingerprints_.try_emplace(input.file);
      if (is_new) {
        const auto content = ReadWholeFile(input.file);
        known->second = content ? ContentFingerprint(*content) : "";
      }
      if (known->second != input.fingerprint) return false;
    }
    return !state.input_files.empty();
  }

  // --resume: results of the interrupted run whose inputs are the same. What crashed or hung is
  // tried again.
  void KeepFinished() {
    if (!options_.resume) folder_.ForgetStates();
    report().run.uid = folder_.RunId();
    if (!options_.resume) return;
    std::vector<CaseFile> rest;
    for (CaseFile& file : cases_) {
      auto state = folder_.LoadState(file.key);
      const bool usable =
          state && state->fingerprint == FingerprintOf(file) && SameInputs(*state) &&
          state->status != CaseStatus::kCrashed && state->status != CaseStatus::kTimedOut &&
          state->status != CaseStatus::kInternalError &&
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
      return found == wall_s.end() ? std::numeric_limits<double>::infinity()
                                   : found->second;  // unknown: may be long
    };
    std::stable_sort(cases_.begin(), cases_.end(),
                     [&](const CaseFile& a, const CaseFile& b) { return cost(a) > cost(b); });
  }

  bool RunWorkers() {
    // Workers take the cores: additional threads of OSMesa would cost a tenth of a picture's time.
    setenv("LP_NUM_THREADS", "0", /*overwrite=*/0);
    std::vector<WorkerJob> jobs;
    for (size_t i = 0; i < cases_.size(); ++i) {
      WorkerJob job{options_.worker, folder_.StagedLog(i)};
      const std::string& command = cases_[i].command;
      job.argv.insert(job.argv.end(),
                      {command, cases_[i].file, "--out", folder_.Staging(i).string()});
      const std::vector<std::string> rest = command == "run" ? RunWords(cases_[i]) : kOneWorker;
      job.argv.insert(job.argv.end(), rest.begin(), rest.end());
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

  // Of `mbverify run`, except what is run and where to.
  std::vector<std::string> RunWords(const CaseFile& file) const {
    std::vector<std::string> words = {"--kept-audits", folder_.Shared().string()};
    const auto agreed = options_.agreed_programs.find(file.file);
    if (agreed != options_.agreed_programs.end()) {
      words.insert(words.end(), {"--agreed-programs", agreed->second});
    }
    if (!options_.pictures) words.emplace_back("--no-pictures");
    for (const std::string& word : WorkerOptions(file.key)) words.push_back(word);
    return words;
  }

  // "{up}" stands for the way from the result's folder to --out.
  std::vector<std::string> WorkerOptions(const std::string& key) const {
    std::string up = "..";
    for (const char c : key) up += c == '/' ? "/.." : "";
    std::vector<std::string> words = options_.worker_options;
    for (std::string& word : words) {
      const size_t at = word.find("{up}");
      if (at != std::string::npos) word.replace(at, 4, up);
    }
    return words;
  }

  void Collect(size_t i, const WorkerEnd& end) {
    const CaseFile& file = cases_[i];
    const std::string output = ReadWholeFile(folder_.StagedLog(i)).value_or("");
    const auto staged = folder_.FindStaged(i);
    const auto summary = staged ? ReadWholeFile(*staged / "summary.json") : std::nullopt;
    CaseResult result = JudgeCase(file, end, options_.timeout_s, output, summary);
    result.fingerprint = FingerprintOf(file);
    if (staged) {
      const auto inputs = ReadWholeFile(*staged / "inputs.json");
      const std::string damage = inputs ? AddInputs(*inputs, &result) : "";
      if (!damage.empty()) {
        report().notes.push_back(fmt::format("{}: inputs.json: {}", file.key, damage));
      }
      result.has_report = fs::exists(*staged / "report.html");
      const std::string trouble = folder_.Publish(*staged, file.key);
      result.has_folder = trouble.empty();
      if (!trouble.empty()) unpublished_.push_back(trouble);
    }
    if (const std::string trouble = folder_.Write(RunFolder::Log(file.key), output);
        !trouble.empty()) {
      unpublished_.push_back(trouble);
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
  std::vector<CaseFile> cases_;           ///< still to run
  std::vector<std::string> unread_;       ///< folders that may hold more scenarios
  std::vector<std::string> unpublished_;  ///< results that could not be put in their place
  std::map<std::string, std::string> fingerprints_;  ///< of input files, by name
  size_t done_ = 0;
  RegressOutcome outcome_;
};

}  // namespace

bool IsSharedScript(const std::string& name) {
  return name.starts_with("report-") && name.ends_with(".js") && name.size() == 26 &&
         name.find_first_not_of("0123456789abcdef", 7) == 23;
}

RegressOutcome Regress(const RegressOptions& options, const RegressProgress& progress) {
  return Run(options, progress).Do();
}

namespace {

constexpr int kTailLines = 12;       // of a log that a failure shows
constexpr int kSearchedLines = 200;  // of a log, from its end: what went wrong is said there

bool States(const JsonValue& json, const char* key) {
  return json.contains(key) && !json.at(key).is_null();
}

// "" where it is left out.
std::string Word(const JsonValue& json, const char* key) {
  return States(json, key) ? json.at(key).get<std::string>() : "";
}

// NaN where it is left out.
double Number(const JsonValue& json, const char* key) {
  return json.contains(key) ? json.at(key).NumberOrNan() : kNan;
}

std::vector<JsonValue> List(const JsonValue& json, const char* key) {
  return States(json, key) ? json.at(key).list() : std::vector<JsonValue>();
}

struct SummaryText {
  std::string reason;
  std::string culprits;  ///< failed checks and where witnesses broke down, one per line
  bool judged = true;    ///< anything was asked; a study may ask nothing
  std::string damage;    ///< why it is not one of ours
};

SummaryText ReadSummary(const JsonValue& json, CaseResult* result) {
  SummaryText words;
  words.reason = Word(json, "reason");
  words.judged = json.value("judged", true);
  if (const std::string verdict = Word(json, "verdict"); !verdict.empty()) {
    result->verdict = verdict;
  }
  if (result->description.empty()) result->description = Word(json, "description");
  for (const JsonValue& witness : List(json, "witnesses")) {
    result->ran = result->ran || witness.value("ran", false);
    words.culprits += "\n" + Word(witness, "where");
  }
  result->compared = States(json, "counts") && Number(json.at("counts"), "pairs_compared") > 0.0;
  for (const char* list : {"checks", "checks_off"}) {
    for (const JsonValue& check : List(json, list)) {
      MetricValue& metric = result->metrics[Word(check, "name")];
      metric.value = Number(check, "value");
      metric.channel = Word(check, "channel");
      metric.time_s = Number(check, "time_s");
      if (!check.contains("limit")) continue;
      metric.limit = Number(check, "limit");
      metric.pass = check.value("pass", false);
      if (!metric.pass) words.culprits += "\n" + Word(check, "name");
    }
  }
  for (const JsonValue& item : List(json, "not_compared")) {
    result->not_compared.push_back({Word(item, "what"), Word(item, "why")});
  }
  for (const JsonValue& caveat : List(json, "caveats")) {
    result->caveats.push_back(Word(caveat, "text"));
  }
  if (States(json, "versions")) {
    for (const auto& [name, version] : json.at("versions").items()) {
      result->versions[name] = version.get<std::string>();
    }
  }
  return words;
}

// What a summary.json says of `result`, which stays as it was if it is not one of ours.
SummaryText ReadSummary(const std::string& text, CaseResult* result) {
  CaseResult read = *result;
  auto words = ReadJson(text, [&](const JsonValue& json) { return ReadSummary(json, &read); });
  if (!words) {
    SummaryText damaged;
    damaged.damage = "summary.json: " + words.refusal.Text();
    return damaged;
  }
  *result = std::move(read);
  return std::move(*words.value);
}

// The line that states what went wrong: the last one with "error:", else the last one.
std::string ErrorLine(const std::string& output) {
  const std::string tail = LastLines(output, kSearchedLines);
  const size_t error = tail.rfind("error:");
  const size_t at = error == std::string::npos ? tail.size() : error;
  const size_t newline = tail.rfind('\n', at == 0 ? 0 : at - 1);
  const size_t begin = newline == std::string::npos ? 0 : newline + 1;
  return tail.substr(begin, tail.find('\n', begin) - begin);
}

// What is not as expected, "" if nothing; `text` must have what the file says is mentioned.
std::string Offence(const CaseResult& result, const std::string& text) {
  const Expectation& expected = result.expected;
  if (result.exit_code != expected.exit_code) {
    return fmt::format("exit code {}, expected {}", result.exit_code, expected.exit_code);
  }
  if (result.verdict != expected.verdict) {
    return fmt::format("verdict {}, expected {}", result.verdict, expected.verdict);
  }
  if (WithoutControls(text).find(expected.mentions) == std::string::npos) {
    return fmt::format("the result does not mention '{}'", expected.mentions);
  }
  return "";
}

CaseStatus StatusOf(const CaseResult& result) {
  if (result.exit_code == result.expected.exit_code) return CaseStatus::kUnexpected;
  if (result.exit_code == 2) return CaseStatus::kBadInput;
  if (result.exit_code == 3) return CaseStatus::kCouldNotRun;
  return CaseStatus::kUnexpected;
}

// Ends that no `expect:` can ask for; false if the worker ended properly.
bool EndedBadly(const WorkerEnd& end, double timeout_s, const std::string& output,
                CaseResult* result) {
  const auto is = [&](CaseStatus status, std::string reason) {
    result->status = status;
    result->reason = std::move(reason);
    return true;
  };
  if (end.timed_out) {
    return is(CaseStatus::kTimedOut, fmt::format("no end after {:g} s: killed", timeout_s));
  }
  if (end.signal != 0) {
    return is(CaseStatus::kCrashed,
              fmt::format("killed by signal {} ({})", end.signal, strsignal(end.signal)));
  }
  if (!end.trouble.empty()) {
    return is(CaseStatus::kCrashed, end.trouble + ": " + ErrorLine(output));
  }
  if (end.exit_code < 0 || end.exit_code > 3) {
    return is(CaseStatus::kInternalError,
              fmt::format("exit code {}: {}", end.exit_code, ErrorLine(output)));
  }
  return false;
}

}  // namespace

CaseResult JudgeCase(const CaseFile& file, const WorkerEnd& end, double timeout_s,
                     const std::string& output, const std::optional<std::string>& summary) {
  CaseResult result;
  result.key = file.key;
  result.file = file.file;
  result.description = file.head.description;
  result.expected = file.head.expect;
  result.inputs = file.inputs;
  result.exit_code = end.exit_code;
  result.signal = end.signal;
  result.cost = end.cost;
  const SummaryText words = summary ? ReadSummary(*summary, &result) : SummaryText{};
  std::string reason = words.reason;
  if (!EndedBadly(end, timeout_s, output, &result)) {
    const std::string offence = Offence(result, output + words.culprits);
    if (reason.empty()) reason = ErrorLine(output);
    if (!words.damage.empty()) {
      result.status = CaseStatus::kInternalError;
      result.reason = words.damage;
    } else if (!summary && end.exit_code == 3) {
      // Results that could not be written are never what was expected.
      result.status = CaseStatus::kCouldNotRun;
      result.reason = (offence.empty() ? "no results" : offence) + ": " + reason;
    } else if (!summary && end.exit_code != 2) {
      result.status = CaseStatus::kInternalError;
      result.reason = fmt::format("exit code {} but no summary.json", end.exit_code);
    } else if (offence.empty()) {
      result.status = CaseStatus::kAsExpected;
      result.reason = reason;
      result.verified = result.verdict == "agree" && words.judged;
    } else {
      result.status = StatusOf(result);
      result.reason = offence + (reason.empty() ? "" : ": " + reason);
    }
  }
  if (!result.ran && result.not_compared.empty()) {
    result.not_compared.push_back({"everything", result.reason});
  }
  if (result.failed()) result.log_tail = LastLines(output, kTailLines);
  return result;
}

std::string AddInputs(const std::string& inputs, CaseResult* result) {
  const auto read = ReadJson(inputs, [](const JsonValue& json) {
    std::vector<InputFile> files;
    for (const JsonValue& input : List(json, "inputs")) {
      files.push_back({Word(input, "file"), Word(input, "fingerprint")});
    }
    return files;
  });
  if (!read) return read.refusal.Text();
  Fingerprint fingerprint;
  for (const InputFile& input : *read.value) {
    result->input_files.push_back(input);
    fingerprint.Add(std::filesystem::path(input.file).filename().string());
    fingerprint.Add(input.fingerprint);
  }
  if (!result->input_files.empty()) result->inputs = fingerprint.Text();
  return "";
}

}  // namespace mbv
