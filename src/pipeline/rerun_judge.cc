#include "pipeline/rerun_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "pipeline/rerun_tables.h"
#include "report/rerun_summary.h"

namespace mbv {
namespace {

constexpr const char* kSummary = "summary.json";

class RerunJudge {
 public:
  RerunJudge(const PackedScenario& scenario, const PackedResults& packed,
             const PackedResults& rerun, bool same_versions)
      : scenario_(scenario), packed_(packed), rerun_(rerun), same_versions_(same_versions) {}

  std::vector<RerunFile> Judge() {
    std::set<std::string> paths;
    for (const auto* side : {&packed_, &rerun_}) {
      for (const auto& [path, content] : *side) paths.insert(path);
    }
    // Numbers first: what else there is follows from them.
    for (const std::string& path : paths) {
      if (IsNumbers(path)) files_.push_back(JudgeNumbers(path));
    }
    exact_ = same_versions_ && std::ranges::all_of(files_, [](const RerunFile& file) {
               return file.outcome == RerunOutcome::kSame;
             });
    for (const std::string& path : paths) {
      if (!IsNumbers(path)) files_.push_back(JudgeRest(path));
    }
    std::ranges::sort(files_, {}, &RerunFile::path);
    return std::move(files_);
  }

 private:
  [[nodiscard]] bool IsResult(const std::string& path, const char* name) const {
    return path == scenario_.results + "/" + name;
  }
  [[nodiscard]] bool IsNumbers(const std::string& path) const {
    const auto& names = NumberFiles(scenario_.kind);
    return std::ranges::any_of(names, [&](const char* name) { return IsResult(path, name); });
  }
  [[nodiscard]] bool IsFigure(const std::string& path) const {
    return !scenario_.figures.empty() && path.starts_with(scenario_.figures + "/");
  }

  // Decides what needs no look inside; false: both are there and differ.
  bool Settled(RerunFile* file) const {
    const auto before = packed_.find(file->path), now = rerun_.find(file->path);
    if (now == rerun_.end()) {
      file->why = "is in the archive and is not made any more";
    } else if (before == packed_.end()) {
      file->why = "is made, but is not in the archive";
    } else if (before->second == now->second) {
      file->outcome = RerunOutcome::kSame;
    } else {
      return false;
    }
    return true;
  }

  RerunFile JudgeNumbers(const std::string& path) {
    RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = "", .signals = {}};
    if (Settled(&file)) return file;
    const std::string name = std::filesystem::path(path).filename();
    file.signals = CompareTables(scenario_, name, packed_, rerun_, &file.why);
    const bool inside = file.why.empty() && !file.signals.empty() &&
                        std::ranges::all_of(file.signals, &RerunSignal::inside);
    if (inside) file.outcome = RerunOutcome::kWithin;
    return file;
  }

  RerunFile JudgeRest(const std::string& path) {
    RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = "", .signals = {}};
    if (Settled(&file)) return file;
    if (IsResult(path, kSummary) && (exact_ || scenario_.kind != "study")) {
      return CompareSummaries(path, packed_.at(path), rerun_.at(path), exact_);
    }
    if (IsFigure(path)) {
      file.outcome = RerunOutcome::kNotJudged;
      file.why = "is drawn otherwise: fonts and libraries of drawing decide, too";
    } else if (exact_) {
      file.why = "though the numbers that it is made of are the same";
    } else {
      file.outcome = RerunOutcome::kNotJudged;
      file.why = "follows from numbers or versions that have changed";
    }
    return file;
  }

  const PackedScenario& scenario_;
  const PackedResults& packed_;
  const PackedResults& rerun_;
  bool same_versions_, exact_ = false;
  std::vector<RerunFile> files_;
};

}  // namespace

std::vector<RerunFile> JudgeReruns(const PackedScenario& scenario, const PackedResults& packed,
                                   const PackedResults& rerun, bool same_versions) {
  return RerunJudge(scenario, packed, rerun, same_versions).Judge();
}

}  // namespace mbv
