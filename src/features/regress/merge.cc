// Whether folders that are to be joined are the whole of one regression run.

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/output_folder.h"
#include "features/regress/case_result.h"
#include "features/regress/find_cases.h"
#include "features/regress/history.h"
#include "features/regress/run_folder.h"
#include "features/regress/trouble_text.h"

namespace mbv {

/// One folder's run.
struct RunPart {
  std::string folder;
  RunInfo run;
  size_t cases = 0;
};

/// What speaks against it, one line each.
struct PartTroubles {
  std::vector<std::string> missing;  ///< "shard 3/8 missing", folders without a result
  std::vector<std::string> foreign;  ///< parts of different regression runs, labels or programs

  [[nodiscard]] bool empty() const { return missing.empty() && foreign.empty(); }
};

/// Shards of one regression run start within this time of each other: less than nightly runs are
/// apart.
inline constexpr double kShardSpan_h = 12.0;

// Result folders copied without what is hidden or a link.

namespace {

// Both parts and what each of them says, where that differs.
void CompareParts(const std::vector<RunPart>& parts, const char* what,
                  const std::function<std::string(const RunInfo&)>& value,
                  std::vector<std::string>* troubles) {
  for (const RunPart& part : parts) {
    const std::string here = value(part.run), there = value(parts.front().run);
    if (here == there) continue;
    troubles->push_back(fmt::format("{} has {} '{}', {} has '{}'", part.folder, what, here,
                                    parts.front().folder, there));
    return;
  }
}

void CheckSameRegression(const std::vector<RunPart>& parts, std::vector<std::string>* troubles) {
  const auto earlier = [](const RunPart& a, const RunPart& b) {
    return a.run.started_utc < b.run.started_utc;
  };
  const auto [first, last] = std::minmax_element(parts.begin(), parts.end(), earlier);
  const double hours = UtcHours(last->run.started_utc) - UtcHours(first->run.started_utc);
  if (hours <= kShardSpan_h) return;
  troubles->push_back(fmt::format("{} started {}, {} started {}: two regression runs",
                                  first->folder, first->run.started_utc, last->folder,
                                  last->run.started_utc));
}

// Which of the n shards are there.
void CheckShards(const std::vector<RunPart>& parts, PartTroubles* troubles) {
  std::set<int> seen;
  int count = 0;
  for (const RunPart& part : parts) {
    const auto shard = ParseShard(part.run.shard);
    if (!shard || (count != 0 && shard->count != count)) {
      troubles->foreign.push_back(part.run.shard.empty()
                                      ? fmt::format("{} is a whole run, no shard", part.folder)
                                      : fmt::format("{} is shard {}, others are parts of {}",
                                                    part.folder, part.run.shard, count));
      return;
    }
    count = shard->count;
    if (!seen.insert(shard->index).second) {
      troubles->foreign.push_back(
          fmt::format("{}: shard {} is in another folder, too", part.folder, part.run.shard));
    }
  }
  for (int i = 1; i <= count; ++i) {
    if (!seen.contains(i))
      troubles->missing.push_back(fmt::format("shard {}/{} missing", i, count));
  }
}

// All shards list the same scenarios and take every n-th of them.
void CheckTotal(const std::vector<RunPart>& parts, PartTroubles* troubles) {
  size_t cases = 0;
  for (const RunPart& part : parts) cases += part.cases;
  const size_t found = parts.front().run.found;
  if (found == 0 || cases == found || !troubles->empty()) return;
  troubles->missing.push_back(
      fmt::format("the shards hold {} scenarios, {} were found", cases, found));
}

}  // namespace

// A run that is not a shard is whole by itself. `unfinished`: folders that hold no result.
PartTroubles FindPartTroubles(const std::vector<RunPart>& parts,
                              const std::vector<std::string>& unfinished) {
  PartTroubles troubles;
  for (const std::string& folder : unfinished) {
    troubles.missing.push_back(folder + ": no regress.json in this folder: its run did not end");
  }
  if (parts.empty()) {
    troubles.foreign.emplace_back("none of the folders holds a run");
    return troubles;
  }
  const bool whole = parts.size() == 1 && parts.front().run.shard.empty();
  if (!whole) {
    CheckShards(parts, &troubles);
    CompareParts(
        parts, "label", [](const RunInfo& run) { return run.label; }, &troubles.foreign);
    CompareParts(
        parts, "program", [](const RunInfo& run) { return run.program; }, &troubles.foreign);
    const auto total = [](const RunInfo& run) { return fmt::format("{}", run.found); };
    CompareParts(parts, "a number of scenarios of", total, &troubles.foreign);
    CheckSameRegression(parts, &troubles.foreign);
  }
  CheckTotal(parts, &troubles);
  return troubles;
}

namespace fs = std::filesystem;

namespace {

std::string Copy(const fs::path& from, const fs::path& to, const std::set<std::string>& wanted,
                 const std::string& folder) {
  std::error_code error;
  for (fs::directory_iterator entry(from / folder, error), end; !error && entry != end;
       entry.increment(error)) {
    const std::string name = entry->path().filename();
    const std::string path = folder.empty() ? name : folder + "/" + name;
    const fs::file_type type = entry->symlink_status(error).type();
    std::string trouble;
    if (type == fs::file_type::directory && !name.starts_with('.')) {
      trouble = Copy(from, to, wanted, path);
    } else if (type == fs::file_type::regular &&
               (wanted.empty() ? !name.starts_with('.') : wanted.contains(path))) {
      const auto content = ReadWholeFile(entry->path());
      trouble = content ? WriteFile(to / path, *content, false)
                        : fmt::format("cannot read {}", entry->path().string());
    }
    if (!trouble.empty()) return trouble;
  }
  return error ? fmt::format("cannot read {}: {}", (from / folder).string(), error.message()) : "";
}

}  // namespace

// Copies the regular files of a folder: `wanted` (relative names), or all that are not hidden if
// it is empty. Links are not followed. "" or what went wrong.
std::string CopyPlainFiles(const fs::path& from, const fs::path& to,
                           const std::set<std::string>& wanted) {
  std::error_code error;
  fs::create_directories(to, error);
  if (error) return fmt::format("cannot make folder {}: {}", to.string(), error.message());
  return Copy(from, to, wanted, "");
}

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
    FinishRegression(options_, folder_, &outcome_);
    return std::move(outcome_);
  }

 private:
  RegressReport& report() { return outcome_.report; }

  std::string Claim() {
    std::vector<std::string> keys;
    for (const CaseResult& result : report().cases) keys.push_back(result.key);
    std::vector<std::string> names = RegressionFiles(options_, keys);
    for (const auto& [name, content] : scripts_) names.push_back(name);
    std::string trouble = FindTaken(options_, keys);
    if (trouble.empty()) trouble = folder_.Claim(names);
    if (trouble.empty()) trouble = folder_.Begin(UtcNow());
    for (const auto& [name, content] : scripts_) {
      if (trouble.empty()) trouble = folder_.Write(name, content);
    }
    return trouble;
  }

  // Whether the folders are all of one regression run; else with --partial a note on every summary.
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

  // Adds one run's cases; "" or what is wrong with it. Its text is untrusted.
  std::string Read(const std::string& from) {
    std::error_code error;
    if (fs::exists(fs::path(from) / kUnfinished, error)) {
      return fmt::format(
          "{}: its run has not finished, so that results and regress.json may be of two runs: "
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
        return fmt::format("{}/regress.json: key '{}' is not a name of a scenario", from,
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
  std::vector<RunPart> parts_;
  std::vector<std::string> unfinished_;  // folders without a regress.json
};

}  // namespace

RegressOutcome MergeRuns(const std::vector<std::string>& folders, const RegressOptions& options) {
  return Merger(options).Do(folders);
}

}  // namespace mbv
