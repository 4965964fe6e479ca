#include "pipeline/verify_package.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "archive/zip.h"
#include "core/files.h"
#include "core/scratch_folder.h"
#include "core/sha256.h"
#include "core/text.h"
#include "pipeline/package_inputs.h"
#include "pipeline/packed_run.h"
#include "pipeline/version.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

// An archive that is what its manifest says.
class CheckedArchive {
 public:
  CheckedArchive(const std::string& file, Diagnostics* diagnostics)
      : file_(file), diagnostics_(diagnostics) {}

  bool Read() {
    const auto bytes = ReadWholeFile(file_);
    if (!bytes) {
      Refuse("cannot be read", "is it there, and a file?");
      return false;
    }
    auto entries = ReadZip(*bytes, file_, {}, diagnostics_);
    if (!entries || !FindFolder(*entries)) return false;
    for (ArchiveEntry& entry : *entries) {
      const std::string path = entry.path.substr(folder_.size() + 1);
      entry.path = path;
      files_.emplace(path, std::move(entry));
    }
    const auto manifest = files_.find(kManifestFile);
    if (manifest == files_.end()) {
      Refuse(fmt::format("has no {}/{}", folder_, kManifestFile),
             "only archives of mbverify package are verified");
      return false;
    }
    auto package = ReadManifest(manifest->second.content, file_, diagnostics_);
    if (!package) return false;
    package_ = *std::move(package);
    return CheckFiles();
  }

  [[nodiscard]] const PackageDescription& package() const { return package_; }
  [[nodiscard]] const std::map<std::string, ArchiveEntry>& files() const { return files_; }

 private:
  void Refuse(const std::string& message, const std::string& hint) {
    diagnostics_->AddError(file_, message, hint);
  }

  bool FindFolder(const std::vector<ArchiveEntry>& entries) {
    folder_ = entries.front().path.substr(0, entries.front().path.find('/'));
    const auto outside = std::ranges::find_if(
        entries, [&](const ArchiveEntry& entry) { return !entry.path.starts_with(folder_ + "/"); });
    if (outside == entries.end()) return true;
    Refuse(fmt::format("does not hold one folder alone: '{}' and '{}'",
                       Printable(entries.front().path), Printable(outside->path)),
           "only archives of mbverify package are verified");
    return false;
  }

  // Each file of the manifest as it says, and no other; all findings at once.
  bool CheckFiles() {
    std::map<std::string, const PackedFile*> listed;
    for (const PackedFile& file : package_.files) {
      if (!listed.emplace(file.path, &file).second) Refuse(TwiceText(file.path), kChanged);
    }
    for (const auto& [path, file] : listed) {
      const auto found = files_.find(path);
      if (found == files_.end()) {
        Refuse(fmt::format("lacks '{}', which its manifest names", Printable(path)), kChanged);
      } else if (Sha256Hex(found->second.content) != file->sha256) {
        Refuse(fmt::format("'{}' was changed: its SHA-256 is not that of the manifest",
                           Printable(path)),
               kChanged);
      }
    }
    for (const auto& [path, entry] : files_) {
      if (path == kManifestFile || listed.contains(path)) continue;
      Refuse(fmt::format("holds '{}', which its manifest does not name", Printable(path)),
             kChanged);
    }
    for (const PackedScenario& scenario : package_.scenarios) CheckScenario(scenario);
    return !diagnostics_->has_errors();
  }

  void CheckScenario(const PackedScenario& scenario) {
    const std::string inputs = std::string(kInputsFolder) + "/";
    if (!scenario.file.starts_with(inputs) || !files_.contains(scenario.file)) {
      Refuse(fmt::format("names the scenario '{}', which is not in it", Printable(scenario.file)),
             kChanged);
    }
    if (!scenario.results.starts_with(std::string(kResultsFolder) + "/")) {
      Refuse(fmt::format("has results in '{}'", Printable(scenario.results)), kChanged);
    }
    const bool any = std::ranges::any_of(
        files_, [&](const auto& file) { return file.first.starts_with(scenario.results + "/"); });
    if (!any) {
      Refuse(fmt::format("has no results of '{}'", Printable(scenario.file)), kChanged);
    }
    if (!scenario.figures.empty() &&
        !scenario.figures.starts_with(std::string(kFiguresFolder) + "/")) {
      Refuse(fmt::format("has figures in '{}'", Printable(scenario.figures)), kChanged);
    }
  }

  static std::string TwiceText(const std::string& path) {
    return fmt::format("names '{}' twice in its manifest", Printable(path));
  }

  static constexpr const char* kChanged = "somebody changed it; ask for the archive as it was made";
  const std::string& file_;
  Diagnostics* diagnostics_;
  std::string folder_;
  PackageDescription package_;
  std::map<std::string, ArchiveEntry> files_;
};

std::vector<OtherVersion> OtherVersions(const PackageDescription& package) {
  std::map<std::string, OtherVersion> all;
  for (const auto& [name, version] : package.versions) all[name] = {name, version, ""};
  for (const auto& [name, version] : Versions()) {
    all[name].name = name;
    all[name].here = version;
  }
  std::vector<OtherVersion> other;
  for (const auto& [name, version] : all) {
    if (version.packed != version.here) other.push_back(version);
  }
  return other;
}

class PackageVerifier {
 public:
  PackageVerifier(const std::string& file, const VerifyOptions& options)
      : options_(options), stage_("verify"), archive_(file, &outcome_.diagnostics) {
    report_.archive = file;
  }

  VerifyOutcome Verify() {
    outcome_.exit_code = 2;
    if (!stage_.trouble().empty()) outcome_.diagnostics.AddError("", stage_.trouble());
    if (outcome_.diagnostics.has_errors() || !archive_.Read() || !Unpack()) {
      return std::move(outcome_);
    }
    report_.other_versions = OtherVersions(package());
    bool ran = true;
    for (size_t k = 0; k < package().scenarios.size(); ++k) {
      const PackedScenario& scenario = package().scenarios[k];
      if (options_.progress) {
        options_.progress(scenario.file,
                          static_cast<double>(k) / static_cast<double>(package().scenarios.size()));
      }
      ran = Repeat(scenario) && ran;
    }
    if (outcome_.diagnostics.has_errors()) return std::move(outcome_);
    outcome_.exit_code = ran ? report_.exit_code() : 3;
    outcome_.report = std::move(report_);
    return std::move(outcome_);
  }

 private:
  [[nodiscard]] const PackageDescription& package() const { return archive_.package(); }

  // Inputs alone: results of the archive are compared, not looked up.
  bool Unpack() {
    for (const auto& [path, entry] : archive_.files()) {
      if (!path.starts_with(std::string(kInputsFolder) + "/")) continue;
      const fs::path place = stage_.path() / path;
      const std::string trouble = WriteFile(place, entry.content, false);
      if (!trouble.empty()) {
        outcome_.diagnostics.AddError(report_.archive, trouble);
        return false;
      }
      std::error_code error;
      if (entry.executable) fs::permissions(place, fs::perms::owner_all, error);
    }
    return true;
  }

  // True when it ran.
  bool Repeat(const PackedScenario& packed) {
    PackedTruth truth{packed, {}, report_.other_versions.empty()};
    for (const auto& [path, entry] : archive_.files()) {
      const bool of_it = path.starts_with(packed.results + "/") ||
                         (!packed.figures.empty() && path.starts_with(packed.figures + "/"));
      if (of_it) truth.files[path] = entry.content;
    }
    PackedRunOptions options{.folder = stage_.path(),
                             .meshes = package().meshes,
                             .page = package().page,
                             .figures = !packed.figures.empty(),
                             .programs = {.all = options_.trust, .archived = true}};
    PackedRun run = RunPacked(packed.file, options, &truth);
    if (run.refused && options_.ask && options_.ask(packed.file, run.programs)) {
      options.programs.all = true;
      run = RunPacked(packed.file, options, &truth);
    }
    if (!run.refused && !run.programs.empty() && options_.show) {
      options_.show(packed.file, run.programs);
    }
    for (Finding& finding : run.findings) outcome_.diagnostics.Add(std::move(finding));
    report_.scenarios.push_back({.file = packed.file,
                                 .kind = packed.kind,
                                 .exit_code = run.scenario.exit_code,
                                 .packed_exit_code = packed.exit_code,
                                 .verdict = run.scenario.verdict,
                                 .packed_verdict = packed.verdict,
                                 .failure = run.failure,
                                 .files = std::move(run.files)});
    return run.failure.empty();
  }

  const VerifyOptions& options_;
  const ScratchFolder stage_;
  VerifyOutcome outcome_;
  CheckedArchive archive_;
  RerunReport report_;
};

}  // namespace

VerifyOutcome VerifyPackage(const std::string& file, const VerifyOptions& options) {
  return PackageVerifier(file, options).Verify();
}

}  // namespace mbv
