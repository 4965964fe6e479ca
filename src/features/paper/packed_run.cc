#include "features/paper/packed_run.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/files.h"
#include "base/inputs.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "features/paper/figures.h"
#include "features/paper/rerun_judge.h"
#include "features/run/run_scenario.h"
#include "features/study/study.h"
#include "math/bytes.h"
#include "model_file/mesh/read_mesh.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kLongestRun_s = 1e6;

// In the child, whose current folder is the archive's.
class PackedRunner {
 public:
  PackedRunner(const std::string& file, const PackedRunOptions& options) : options_(options) {
    run_.scenario.file = file;
  }

  PackedRun Run() {
    std::vector<MeshPackage> packages;
    for (const PackedMeshes& meshes : options_.meshes) {
      packages.push_back({meshes.name, meshes.folder});
    }
    UseMeshPackages(std::move(packages));
    const ScenarioHead head = ReadScenarioHead(run_.scenario.file);
    run_.scenario.description = head.description;
    const DocumentKind& kind = KindOf(run_.scenario.file);
    run_.scenario.kind = kind.name;
    if (!MayCallPrograms()) return std::move(run_);
    const bool study = kind.run == nullptr;
    if (ReadsOutside(study)) return std::move(run_);
    study ? RunAsStudy() : RunAsScenario();
    return std::move(run_);
  }

 private:
  // Lists the programs it names; false if they may not run.
  bool MayCallPrograms() {
    if (run_.scenario.kind != "motion") return true;
    const ScenarioResult loaded = LoadScenario(run_.scenario.file);
    if (!loaded.scenario) return true;
    const ProgramList list = ProgramsOf(*loaded.scenario, options_.programs.archived);
    run_.programs = list.Lines();
    if (options_.programs.Allows(list)) return true;
    run_.refused = true;
    Refuse("calls programs (" + Joined(run_.programs) + ")",
           "read what they are; --trust lets them run as you");
    return false;
  }

  void RunAsStudy() {
    RunStudyOptions study;
    study.out_dir = kResultsFolder;
    study.points.jobs = AllCores();
    const StudyOutcome outcome = RunStudy(run_.scenario.file, study);
    Report(outcome.diagnostics, outcome.exit_code, outcome.folder);
    if (!outcome.report) return;
    run_.scenario.description = outcome.report->study.description;
    run_.scenario.verdict = outcome.exit_code == 0   ? "limits kept"
                            : outcome.exit_code == 1 ? "limits broken"
                                                     : "not run";
    run_.scenario.reason = fmt::format("{} points", outcome.report->study.Points().count());
  }

  void RunAsScenario() {
    RunOptions run;
    run.out_dir = kResultsFolder;
    run.pictures = run.timed = false;
    run.page = options_.page;
    run.programs = options_.programs;
    const RunOutcome outcome = RunScenario(run_.scenario.file, run);
    Report(outcome.diagnostics, outcome.exit_code, outcome.folder);
    const std::optional<ResultView> view = outcome.View();
    if (!view) return;
    run_.scenario.verdict = ToText(view->verdict);
    run_.scenario.reason = view->reason;
    if (options_.figures) Draw(outcome);
  }

  void Draw(const RunOutcome& outcome) {
    FigureOptions figures;
    figures.formats = {"pdf", "svg"};
    const FigureOutcome drawn = MakeFigures(run_.scenario.file, figures, &outcome);
    if (drawn.files.empty()) return;
    OutputFolder folder(kFiguresFolder, drawn.mechanism + "/" + drawn.scenario);
    if (const std::string trouble = folder.WriteAll(drawn.files); !trouble.empty()) {
      return Refuse(trouble, "");
    }
    run_.scenario.figures = folder.target().generic_string();
  }

  void Report(const Diagnostics& diagnostics, int exit_code, const std::string& folder) {
    for (const Finding& finding : diagnostics.findings()) run_.findings.push_back(finding);
    run_.scenario.exit_code = exit_code;
    run_.scenario.results = fs::path(folder).generic_string();
    if (folder.empty()) run_.failure = "gave no result";
  }

  // Another machine may have other files there, or none. (The models of papers whose equations a
  // page audits come with the program.)
  bool ReadsOutside(bool study) {
    const InputWatch watch;
    (void)(study ? CheckStudy(run_.scenario.file) : CheckFile(run_.scenario.file));
    for (const InputFile& input : watch.files()) {
      const fs::path path = fs::path(input.file).lexically_normal();
      if (path.is_relative() && path.generic_string().starts_with("inputs/")) continue;
      Refuse(fmt::format("reads {}, which is not in the archive", input.file),
             "name files relative to the scenario and its model");
    }
    return !run_.failure.empty();
  }

  void Refuse(const std::string& message, const std::string& hint) {
    run_.failure = message;
    run_.findings.push_back({.severity = Severity::kError,
                             .file = run_.scenario.file,
                             .line = 0,
                             .column = 0,
                             .message = message,
                             .hint = hint});
  }

  const PackedRunOptions& options_;
  PackedRun run_;
};

PackedRun RunHere(const std::string& file, const PackedRunOptions& options,
                  const PackedTruth* truth) {
  fs::current_path(options.folder);
  PackedRun run = PackedRunner(file, options).Run();
  if (truth == nullptr || !run.failure.empty()) return run;
  if (run.scenario.kind != truth->scenario.kind) {
    run.failure = fmt::format("is of the kind '{}', not '{}' as the manifest says",
                              run.scenario.kind, truth->scenario.kind);
    return run;
  }
  std::map<std::string, std::string> now = FilesOf(".", truth->scenario.results);
  now.merge(FilesOf(".", run.scenario.results));
  if (!truth->scenario.figures.empty()) now.merge(FilesOf(".", truth->scenario.figures));
  std::map<std::string, std::string> packed;
  for (const std::string& path : truth->files) {
    packed[path] = ReadWholeFile(truth->folder / path).value_or("");
  }
  run.files = JudgeReruns(truth->scenario, packed, now, truth->same_versions);
  return run;
}

}  // namespace

PackedRun RunPacked(const std::string& file, const PackedRunOptions& options,
                    const PackedTruth* truth) {
  const auto texts =
      InChildren(1, kLongestRun_s, [&](size_t) { return ToBytes(RunHere(file, options, truth)); });
  auto run = texts.front() ? FromBytes<PackedRun>(*texts.front()) : std::nullopt;
  if (run) return *std::move(run);
  PackedRun lost;
  lost.scenario.file = file;
  lost.failure = "the process that ran it died (out of memory?)";
  return lost;
}

std::map<std::string, std::string> FilesOf(const fs::path& archive, const std::string& folder) {
  std::map<std::string, std::string> files;
  std::vector<std::string> unread;
  if (folder.empty()) return files;
  for (const std::string& file : FilesBelow(archive / folder, "", &unread)) {
    const fs::path path = fs::path(file).lexically_relative(archive).lexically_normal();
    const bool hidden = std::any_of(path.begin(), path.end(), [](const fs::path& part) {
      return part.string().starts_with('.');
    });
    if (hidden) continue;
    if (auto content = ReadWholeFile(file)) files[path.generic_string()] = *std::move(content);
  }
  return files;
}

}  // namespace mbv
