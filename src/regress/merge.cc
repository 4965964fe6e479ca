// Joins the folders of several runs: what they hold is a stranger's.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include "core/files.h"
#include "core/names.h"
#include "core/output_folder.h"
#include "regress/finish.h"
#include "regress/history.h"
#include "regress/log_text.h"
#include "regress/one_night.h"
#include "regress/plain_files.h"
#include "regress/utc_time.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// Whether a part of `path` below `folder` is a link: it could lead to files of this machine.
bool HasLink(const fs::path& folder, const std::string& path) {
  std::error_code error;
  fs::path at = folder;
  for (const fs::path& part : fs::path(path)) {
    at /= part;
    if (fs::is_symlink(at, error)) return true;
  }
  return false;
}

class Merger {
 public:
  explicit Merger(const RegressOptions& options) : options_(options), folder_(options.out) {}

  RegressOutcome Do(const std::vector<std::string>& folders) {
    outcome_.exit_code = 2;
    outcome_.trouble = folder_.Open();
    if (outcome_.trouble.empty()) outcome_.trouble = CheckHistory(options_.history);
    for (const std::string& from : folders) {
      if (outcome_.trouble.empty()) outcome_.trouble = Read(from);
    }
    if (outcome_.trouble.empty()) CheckParts();
    if (outcome_.trouble.empty()) outcome_.trouble = Claim();
    for (const auto& [key, from] : from_) {
      if (outcome_.trouble.empty()) outcome_.trouble = Copy(key, from);
    }
    if (!outcome_.trouble.empty()) return std::move(outcome_);
    if (!options_.label.empty()) report().run.label = options_.label;
    // The same parts give the same run.
    Fingerprint fingerprint;
    for (const std::string& uid : uids_) fingerprint.Add(uid);
    report().run.uid = fmt::format("merge-{}", fingerprint.Text());
    report().fail_on_missing = options_.fail_on_missing;
    FinishNight(options_, folder_, &outcome_);
    return std::move(outcome_);
  }

 private:
  RegressReport& report() { return outcome_.report; }

  std::string Claim() {
    std::vector<std::string> keys;
    for (const CaseResult& result : report().cases) keys.push_back(result.key);
    std::vector<std::string> names = NightFiles(options_, keys);
    for (const auto& [name, content] : scripts_) names.push_back(name);
    std::string trouble = FindTaken(options_, keys);
    if (trouble.empty()) trouble = folder_.Claim(names);
    if (trouble.empty()) trouble = folder_.Begin(UtcNow());
    for (const auto& [name, content] : scripts_) {
      if (trouble.empty()) trouble = folder_.Write(name, content);
    }
    return trouble;
  }

  // Whether the folders are all of one night; else with --partial a note on every summary.
  void CheckParts() {
    const PartTroubles troubles = FindPartTroubles(parts_, unfinished_);
    if (troubles.empty()) return;
    if (options_.partial && !parts_.empty()) {
      report().run.partial = true;
      for (const auto* list : {&troubles.missing, &troubles.foreign}) {
        report().notes.insert(report().notes.end(), list->begin(), list->end());
      }
      return;
    }
    for (const auto* list : {&troubles.foreign, &troubles.missing}) {
      for (const std::string& text : *list) AddTrouble(text, &outcome_);
    }
    AddTrouble("nothing was joined; --partial joins what there is", &outcome_);
    outcome_.exit_code = troubles.foreign.empty() ? 3 : 2;
  }

  void JoinInfo(const RunInfo& part) {
    RunInfo& run = report().run;
    uids_.insert(part.uid.empty() ? part.started_utc + part.host + part.shard : part.uid);
    if (uids_.size() == 1 && report().cases.empty()) {
      run = part;
      run.id = 0;
      run.shard.clear();
      return;
    }
    if (part.covers != run.covers) run.covers.clear();
    run.started_utc = std::min(run.started_utc, part.started_utc);
    run.finished_utc = std::max(run.finished_utc, part.finished_utc);
    run.wall_s = std::max(run.wall_s, part.wall_s);  // shards run side by side
    run.jobs += part.jobs;
  }

  // Adds one run's cases; "" or what is wrong with it. What it says is a stranger's.
  std::string Read(const std::string& from) {
    std::error_code error;
    if (fs::exists(fs::path(from) / kUnfinished, error)) {
      return fmt::format(
          "{}: its night has not finished, so that results and regress.json may be of two nights: "
          "run it again, with --resume if it was interrupted",
          from);
    }
    const std::string report_file = (fs::path(from) / "regress.json").string();
    for (const std::string& output :
         {options_.junit, options_.markdown, options_.json, options_.history}) {
      if (output.empty() || SameFile(output, {{report_file, ""}}).empty()) continue;
      return fmt::format("{}: error: is read for the merge; choose another output", output);
    }
    const auto text = ReadWholeFile(fs::path(from) / "regress.json");
    if (!text) {
      unfinished_.push_back(from);
      return "";
    }
    std::optional<Finding> damage;
    auto part = ReportFromJson(*text, report_file, &damage);
    if (damage) return ToText(*damage);
    parts_.push_back({from, part->run, part->cases.size()});
    JoinInfo(part->run);
    for (const std::string& note : part->notes) report().notes.push_back(note);
    for (CaseResult& result : part->cases) {
      if (!IsPlainPath(result.key)) {
        return fmt::format("{}/regress.json: key '{}' is no name of a scenario", from,
                           WithoutControls(result.key));
      }
      if (!from_.emplace(result.key, from).second) {
        return fmt::format("{}: {} is in another folder, too", from, result.key);
      }
      result.drifts.clear();  // judged anew against the history given
      result.course.clear();
      result.past = {};
      report().cases.push_back(std::move(result));
    }
    return ReadScripts(from);
  }

  // Scripts that reports share, of this or another version.
  std::string ReadScripts(const fs::path& from) {
    std::error_code error;
    for (fs::directory_iterator entry(from, error), end; !error && entry != end;
         entry.increment(error)) {
      const std::string name = entry->path().filename();
      if (!IsSharedScript(name) || entry->is_symlink(error)) continue;
      if (auto text = ReadWholeFile(entry->path())) scripts_[name] = *std::move(text);
    }
    return "";
  }

  std::string Copy(const std::string& key, const fs::path& from) {
    const auto found = std::find_if(report().cases.begin(), report().cases.end(),
                                    [&](const CaseResult& result) { return result.key == key; });
    std::string trouble;
    if (found->has_folder && HasLink(from, key)) {
      return fmt::format("{}: {} is a link", from.string(), key);
    }
    if (found->has_folder) {
      // What belongs to the result; without a list its folder as it is.
      const fs::path staged = folder_.Staging(0);
      trouble = CopyPlainFiles(from / key, staged, ReadFileList(from / key));
      if (trouble.empty()) trouble = folder_.Publish(staged, key);
      folder_.RemoveStaging(0);
    }
    const std::string name = RunFolder::Log(key);
    if (!trouble.empty() || HasLink(from, name)) return trouble;
    const auto log = ReadWholeFile(from / name);
    return log ? folder_.Write(name, *log) : "";
  }

  const RegressOptions& options_;
  RunFolder folder_;
  RegressOutcome outcome_;
  std::map<std::string, std::string> from_;     // folder of each key
  std::map<std::string, std::string> scripts_;  // by name
  std::set<std::string> uids_;
  std::vector<NightPart> parts_;
  std::vector<std::string> unfinished_;  // folders without a regress.json
};

}  // namespace

RegressOutcome MergeRuns(const std::vector<std::string>& folders, const RegressOptions& options) {
  return Merger(options).Do(folders);
}

}  // namespace mbv
