// `mbverify package --check`: repeats the results of an archive (features/paper/package.h) on this
// machine.

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>
#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/files.h"
#include "base/json_text.h"
#include "base/scratch_folder.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/zip.h"
#include "cli/cli.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/paper/package.h"
#include "features/paper/packed_run.h"
#include "features/paper/rerun_report.h"
#include "scenario/load_scenario.h"
#include "verify/run_witnesses.h"
#include "verify/version.h"

namespace mbv {

struct VerifyOptions {
  using Programs = std::vector<std::string>;
  bool trust = false;  ///< run the programs that scenarios of the archive call
  /// Is asked before, of a scenario and its programs, without `trust`; null: no.
  std::function<bool(const std::string& scenario, const Programs& programs)> ask = {};
  /// Is shown the programs of a scenario that ran.
  std::function<void(const std::string& scenario, const Programs& programs)> show = {};
  ProgressFunction progress = {};
};

struct VerifyOutcome {
  int exit_code = 4;  ///< 0 repeated, 1 something differs, 2 bad input, 3 something could not run
  Diagnostics diagnostics;
  std::optional<RerunReport> report;  ///< empty after bad input
};

namespace {

namespace fs = std::filesystem;

constexpr const char* kPackedFolder = "packed";  // of the stage: what the archive's results are

// An archive that is what its manifest says, unpacked into a folder: nothing is before the names
// and sizes of all files are those of the manifest, and no file is held in memory but the manifest.
class CheckedArchive {
 public:
  CheckedArchive(const std::string& file, const fs::path& stage, Diagnostics* diagnostics)
      : file_(file), stage_(stage), diagnostics_(diagnostics), zip_(file, {}, diagnostics) {}

  bool Read() {
    if (zip_.entries().empty() || !FindFolder()) return false;
    for (const ListedEntry& entry : zip_.entries()) {
      files_.emplace(entry.path.substr(folder_.size() + 1), entry);
    }
    const auto manifest = files_.find(kManifestFile);
    if (manifest == files_.end()) {
      Refuse(fmt::format("has no {}/{}", folder_, kManifestFile),
             "only archives of mbverify package are verified");
      return false;
    }
    if (manifest->second.bytes > kMostManifest) {
      Refuse(fmt::format("has a manifest of {} MB", manifest->second.bytes >> 20), kChanged);
      return false;
    }
    std::string text;
    const bool read = zip_.Read(manifest->second, [&](std::string_view piece) {
      text += piece;
      return true;
    });
    auto package = read ? ReadManifest(text, file_, diagnostics_) : std::nullopt;
    if (!package) return false;
    package_ = *std::move(package);
    return CheckFiles() && Unpack();
  }

  [[nodiscard]] const PackageDescription& package() const { return package_; }
  [[nodiscard]] const std::map<std::string, ListedEntry>& files() const { return files_; }
  /// It could not be unpacked here, whatever is in it.
  [[nodiscard]] bool not_written() const { return not_written_; }

 private:
  static constexpr std::uint64_t kMostManifest = 16'000'000;

  void Refuse(const std::string& message, const std::string& hint) {
    diagnostics_->AddError(file_, message, hint);
  }

  bool FindFolder() {
    const std::vector<ListedEntry>& entries = zip_.entries();
    folder_ = entries.front().path.substr(0, entries.front().path.find('/'));
    const auto outside = std::ranges::find_if(
        entries, [&](const ListedEntry& entry) { return !entry.path.starts_with(folder_ + "/"); });
    if (outside == entries.end()) return true;
    Refuse(fmt::format("does not hold one folder alone: '{}' and '{}'",
                       Printable(entries.front().path), Printable(outside->path)),
           "only archives of mbverify package are verified");
    return false;
  }

  // Each file of the manifest with its size, and no other; all findings at once.
  bool CheckFiles() {
    for (const PackedFile& file : package_.files) {
      if (!listed_.emplace(file.path, &file).second) Refuse(TwiceText(file.path), kChanged);
    }
    for (const auto& [path, file] : listed_) {
      const auto found = files_.find(path);
      if (found == files_.end()) {
        Refuse(fmt::format("lacks '{}', which its manifest names", Printable(path)), kChanged);
      } else if (found->second.bytes != file->bytes) {
        Refuse(fmt::format("'{}' was changed: it has {} bytes, {} in the manifest", Printable(path),
                           found->second.bytes, file->bytes),
               kChanged);
      }
    }
    for (const auto& [path, entry] : files_) {
      if (path == kManifestFile || listed_.contains(path)) continue;
      Refuse(fmt::format("holds '{}', which its manifest does not name", Printable(path)),
             kChanged);
    }
    for (const PackedScenario& scenario : package_.scenarios) CheckScenario(scenario);
    return !diagnostics_->has_errors();
  }

  // Inputs where they are read; results, which are compared and not looked up, aside.
  [[nodiscard]] fs::path PlaceOf(const std::string& path) const {
    if (path.starts_with(std::string(kInputsFolder) + "/")) return stage_ / path;
    for (const char* folder : {kResultsFolder, kFiguresFolder}) {
      if (path.starts_with(std::string(folder) + "/")) return stage_ / kPackedFolder / path;
    }
    return {};
  }

  bool Unpack() {
    for (const auto& [path, file] : listed_) {
      if (!UnpackFile(path, *file)) return false;
    }
    return !diagnostics_->has_errors();
  }

  // False where going on is of no use.
  bool UnpackFile(const std::string& path, const PackedFile& file) {
    const ListedEntry& entry = files_.at(path);
    const fs::path place = PlaceOf(path);
    int to = -1;
    if (!place.empty()) {
      std::error_code error;
      fs::create_directories(place.parent_path(), error);
      constexpr int kFlags = O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC;
      to = open(place.c_str(), kFlags, entry.executable ? 0700 : 0600);
      if (to < 0) return CannotWrite(place);
    }
    Sha256Sum sum;
    bool written = true;
    (void)zip_.Read(entry, [&](std::string_view piece) {
      sum.Add(piece);
      written = to < 0 || WriteBytes(to, piece);
      return written;
    });
    if (!written) (void)CannotWrite(place);
    if (to >= 0) close(to);
    if (written && !diagnostics_->has_errors() && sum.Hex() != file.sha256) {
      Refuse(
          fmt::format("'{}' was changed: its SHA-256 is not that of the manifest", Printable(path)),
          kChanged);
    }
    return written;
  }

  bool CannotWrite(const fs::path& place) {
    const std::string reason = std::strerror(errno);
    diagnostics_->AddError(file_, fmt::format("cannot unpack {}: {}", place.string(), reason),
                           "TMPDIR names another folder for temporary files");
    not_written_ = true;
    return false;
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

  static constexpr const char* kChanged =
      "checksum mismatch: modified after packaging; ask for the archive as it was made";
  const std::string& file_;
  const fs::path stage_;
  Diagnostics* diagnostics_;
  ZipFile zip_;
  std::string folder_;
  PackageDescription package_;
  std::map<std::string, const PackedFile*> listed_;  // by the manifest
  std::map<std::string, ListedEntry> files_;         // in the archive
  bool not_written_ = false;
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
      : options_(options), stage_("verify") {
    report_.archive = file;
  }

  VerifyOutcome Verify() {
    outcome_.exit_code = 3;
    if (!stage_.trouble().empty()) {
      outcome_.diagnostics.AddError("", stage_.trouble());
      return std::move(outcome_);
    }
    archive_.emplace(report_.archive, stage_.path(), &outcome_.diagnostics);
    if (!archive_->Read()) {
      outcome_.exit_code = archive_->not_written() ? 3 : 2;
      return std::move(outcome_);
    }
    outcome_.exit_code = 2;
    report_.other_versions = OtherVersions(package());
    for (const PackedFile& file : package().files) {
      if (file.path.starts_with(std::string(kInputsFolder) + "/")) report_.inputs.push_back(file);
    }
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
  [[nodiscard]] const PackageDescription& package() const { return archive_->package(); }

  // True when it ran.
  bool Repeat(const PackedScenario& packed) {
    PackedTruth truth{packed, stage_.path() / kPackedFolder, {}, report_.other_versions.empty()};
    for (const auto& [path, entry] : archive_->files()) {
      const bool of_it = path.starts_with(packed.results + "/") ||
                         (!packed.figures.empty() && path.starts_with(packed.figures + "/"));
      if (of_it) truth.files.push_back(path);
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
    if (!run.failure.empty() && run.scenario.exit_code == 3) outcome_.exit_code = 3;
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
  std::optional<CheckedArchive> archive_;
  RerunReport report_;
};

}  // namespace

// Nothing of the archive is believed: what is not a plain ZIP of one folder with a manifest whose
// checksums hold is a finding, and nothing of it is run.
VerifyOutcome VerifyPackage(const std::string& file, const VerifyOptions& options) {
  return PackageVerifier(file, options).Verify();
}

// mbverify package --check

int CheckArchive(const ArchiveArguments& arguments) {
  // A scenario is what many give to a command that verifies.
  const ScenarioHead head = ReadScenarioHead(arguments.archive);
  if (head.is_scenario || head.HasKey("study")) {
    return Refuse(
        fmt::format("{} is not an archive", arguments.archive),
        fmt::format("mbverify {} {}", head.is_scenario ? "run" : "study", arguments.archive));
  }
  VerifyOptions options{.trust = arguments.trust};
  VerifyOutcome outcome;
  {
    ProgressLine progress(true);
    options.progress = [&](const std::string& file, double fraction) {
      progress.active() ? progress.Show(file, fraction) : Say(stderr, "repeats {}\n", file);
    };
    options.ask = [&](const std::string& file, const std::vector<std::string>& programs) {
      progress.Clear();
      return AskForPrograms(file, programs);
    };
    options.show = [&](const std::string& file, const std::vector<std::string>& programs) {
      progress.Clear();
      ListPrograms(file, programs);
    };
    outcome = VerifyPackage(arguments.archive, options);
  }
  FindingPrinter(stderr).Print(outcome.diagnostics);
  if (outcome.report) {
    SayText(arguments.json.text(), ToText(*outcome.report, arguments.verbose));
  }
  RerunReport none;
  none.archive = arguments.archive;
  auto json =
      ParseJson<nlohmann::ordered_json>(ToJson(outcome.report.value_or(none), outcome.exit_code));
  json["findings"] = FindingObjects(outcome.diagnostics);
  return WorseExit(outcome.exit_code, arguments.json.Write(json, {{arguments.archive, ""}}));
}

}  // namespace mbv
