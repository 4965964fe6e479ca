#include "pipeline/package.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>

#include "archive/zip.h"
#include "core/files.h"
#include "core/scratch_folder.h"
#include "core/sha256.h"
#include "pipeline/home_folder.h"
#include "pipeline/package_inputs.h"
#include "pipeline/packed_run.h"
#include "pipeline/version.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kNoDate = "1980-01-01";  // the first that ZIP knows

// "1700000000" → "2023-11-14"; empty of what is no time.
std::optional<std::string> DateOfEpoch(const char* text) {
  long long seconds = -1;
  const char* end = text + std::strlen(text);
  const auto [stop, error] = std::from_chars(text, end, seconds);
  constexpr long long kMost = 253402300799;  // 9999-12-31
  if (error != std::errc() || stop != end || seconds < 0 || seconds > kMost) return {};
  const std::chrono::sys_seconds time{std::chrono::seconds(seconds)};
  const std::chrono::year_month_day day{std::chrono::floor<std::chrono::days>(time)};
  return fmt::format("{:04}-{:02}-{:02}", static_cast<int>(day.year()),
                     static_cast<unsigned>(day.month()), static_cast<unsigned>(day.day()));
}

class PackageMaker {
 public:
  PackageMaker(const std::vector<std::string>& scenarios, const PackageOptions& options)
      : scenarios_(scenarios), options_(options), stage_("package") {}

  PackageOutcome Make() {
    outcome_.exit_code = 2;
    if (!stage_.trouble().empty()) return CannotWrite("", stage_.trouble());
    FindDate();
    if (!MayRun()) return std::move(outcome_);
    const auto inputs = GatherInputs(scenarios_, &outcome_.diagnostics);
    if (!inputs || outcome_.diagnostics.has_errors()) return std::move(outcome_);
    package().license = LicensesOf(*inputs);
    package().page = options_.page;
    package().versions = Versions();
    package().meshes = inputs->meshes;
    for (const PackedInput& input : inputs->files) {
      if (std::string trouble = StageInput(input); !trouble.empty()) {
        return CannotWrite(input.file, std::move(trouble));
      }
    }
    for (size_t k = 0; k < inputs->scenarios.size(); ++k) {
      if (outcome_.diagnostics.has_errors()) return std::move(outcome_);
      if (options_.progress) {
        options_.progress(inputs->scenarios[k],
                          static_cast<double>(k) / static_cast<double>(inputs->scenarios.size()));
      }
      RunOne(inputs->scenarios[k]);
    }
    if (outcome_.diagnostics.has_errors()) return std::move(outcome_);
    Pack();
    if (!outcome_.diagnostics.has_errors()) outcome_.exit_code = 0;
    return std::move(outcome_);
  }

 private:
  PackageDescription& package() { return outcome_.description; }

  void FindDate() {
    package().date = options_.date.empty() ? kNoDate : options_.date;
    const char* epoch = std::getenv("SOURCE_DATE_EPOCH");
    if (!options_.date.empty() || epoch == nullptr) return;
    if (const auto date = DateOfEpoch(epoch)) {
      package().date = *date;
    } else {
      outcome_.diagnostics.AddError(
          "SOURCE_DATE_EPOCH", fmt::format("is '{}', seconds since 1970 are needed", epoch),
          "unset it, or: export SOURCE_DATE_EPOCH=$(git log -1 --format=%ct)");
    }
  }

  PackageOutcome CannotWrite(const std::string& file, std::string trouble) {
    outcome_.diagnostics.AddError(file, std::move(trouble));
    outcome_.exit_code = 3;
    return std::move(outcome_);
  }

  // "" or what went wrong.
  std::string StageInput(const PackedInput& input) {
    const fs::path path = stage_.path() / input.path;
    std::string trouble = WriteFile(path, input.content, false);
    std::error_code error;
    if (input.executable) fs::permissions(path, fs::perms::owner_all, error);
    Keep({.path = input.path, .role = input.role, .bytes = 0, .sha256 = ""}, input.content,
         input.executable);
    return trouble;
  }

  // Consent is about the files as they are; what runs is their copies.
  bool MayRun() {
    for (const std::string& file : scenarios_) {
      const ProgramList list = ProgramsOf(file, {});
      if (!options_.programs.Allows(list)) outcome_.diagnostics.Add(Refusal(list));
    }
    return !outcome_.diagnostics.has_errors();
  }

  void RunOne(const std::string& file) {
    const PackedRun run = RunPacked(file, {.folder = stage_.path(),
                                           .meshes = package().meshes,
                                           .page = options_.page,
                                           .figures = options_.figures,
                                           .programs = {.all = true}});
    for (const Finding& finding : run.findings) outcome_.diagnostics.Add(finding);
    if (!run.failure.empty()) outcome_.diagnostics.AddError(file, run.failure);
    if (!run.failure.empty() && run.scenario.exit_code == 3) outcome_.exit_code = 3;
    for (const PackedScenario& other : package().scenarios) {
      if (other.results != run.scenario.results || run.scenario.results.empty()) continue;
      outcome_.diagnostics.AddError(file, "has its results where those of " + other.file + " are",
                                    "rename one of the two files");
    }
    package().scenarios.push_back(run.scenario);
  }

  void Keep(PackedFile file, const std::string& content, bool executable) {
    file.bytes = content.size();
    file.sha256 = Sha256Hex(content);
    entries_.push_back({options_.folder + "/" + file.path, content, executable});
    package().files.push_back(std::move(file));
  }

  void Pack() {
    for (const PackedScenario& scenario : package().scenarios) {
      KeepFolder(scenario.results, "result");
      KeepFolder(scenario.figures, "figure");
    }
    std::ranges::sort(package().files, {}, &PackedFile::path);
    const std::string crate = CrateJson(package());
    Keep({.path = kReadmeFile, .role = "description", .bytes = 0, .sha256 = ""},
         PackageReadme(package()), false);
    Keep({.path = kCrateFile, .role = "description", .bytes = 0, .sha256 = ""}, crate, false);
    std::ranges::sort(package().files, {}, &PackedFile::path);
    entries_.push_back({options_.folder + "/" + kManifestFile, ManifestJson(package()), false});
    std::string trouble;
    if (auto zip = WriteZip(std::move(entries_), &trouble)) {
      outcome_.zip = *std::move(zip);
    } else {
      outcome_.diagnostics.AddError("", trouble);
    }
  }

  // What a witness says of itself may name folders of this machine.
  void KeepFolder(const std::string& folder, const char* role) {
    const auto files = FilesOf(stage_.path(), folder);
    if (files.empty() && !folder.empty()) {
      outcome_.diagnostics.AddError(folder, "holds nothing after the run");
    }
    for (const auto& [path, content] : files) {
      for (const std::string& own : {HomeFolder(), stage_.path().string()}) {
        if (own.empty() || LineNaming(content, own) == 0) continue;
        outcome_.diagnostics.AddError(
            path, fmt::format("names {}, a folder of this machine", own),
            "a witness' program or a description says so; archives hold no such name");
      }
      Keep({.path = path, .role = role, .bytes = 0, .sha256 = ""}, content, false);
    }
  }

  const std::vector<std::string>& scenarios_;
  const PackageOptions& options_;
  const ScratchFolder stage_;
  PackageOutcome outcome_;
  std::vector<ArchiveEntry> entries_;
};

}  // namespace

PackageOutcome MakePackage(const std::vector<std::string>& scenarios,
                           const PackageOptions& options) {
  return PackageMaker(scenarios, options).Make();
}

bool IsDate(const std::string& text) {
  const auto number = [&](size_t from, size_t count) {
    int value = -1;
    const char* end = text.data() + from + count;
    const auto [stop, error] = std::from_chars(text.data() + from, end, value);
    return error == std::errc() && stop == end ? value : -1;
  };
  if (text.size() != 10 || text[4] != '-' || text[7] != '-') return false;
  const int year = number(0, 4), month = number(5, 2), day = number(8, 2);
  if (year < 0 || month < 0 || day < 0) return false;
  return (std::chrono::year(year) / month / day).ok();
}

}  // namespace mbv
