#include "features/paper/package.h"

#include <fmt/format.h>
#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <set>

#include "base/files.h"
#include "base/inputs.h"
#include "base/json_text.h"
#include "base/scratch_folder.h"
#include "base/sha256.h"
#include "base/text.h"
#include "base/zip.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/paper/packed_run.h"
#include "model_file/mesh/read_mesh.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/find_model.h"
#include "verify/check_file.h"
#include "verify/version.h"

namespace mbv {

namespace {

namespace fs = std::filesystem;

constexpr const char* kNoDate = "1980-01-01";  // the first that ZIP knows

// "1700000000" → "2023-11-14"; empty of what is not a time.
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

namespace {

namespace fs = std::filesystem;

fs::path Whole(const fs::path& path) {
  std::error_code error;
  const fs::path whole = fs::absolute(path, error).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

bool IsBelow(const fs::path& path, const fs::path& folder) {
  const fs::path inside = path.lexically_relative(folder);
  return !inside.empty() && inside != "." && *inside.begin() != "..";
}

fs::path CommonFolder(const fs::path& a, const fs::path& b) {
  fs::path common;
  for (auto i = a.begin(), j = b.begin(); i != a.end() && j != b.end() && *i == *j; ++i, ++j) {
    common /= *i;
  }
  return common;
}

bool EndsIn(const std::string& file, std::initializer_list<const char*> endings) {
  return std::ranges::any_of(endings, [&](const char* ending) { return file.ends_with(ending); });
}

std::string RoleOf(const std::string& file) {
  if (EndsIn(file, {".yaml"})) {
    const DocumentKind& kind = KindOf(file);
    return kind.run != nullptr ? "scenario" : kind.name;
  }
  if (EndsIn(file, {".urdf", ".xml", ".sdf"})) return "model";
  if (EndsIn(file, {".stl", ".STL", ".obj", ".OBJ", ".dae", ".DAE", ".ply", ".PLY"})) return "mesh";
  return EndsIn(file, {".csv", ".txt", ".tab", ".dat"}) ? "table" : "input";
}

// Finds the place of every file.
class InputPlacer {
 public:
  InputPlacer(const std::vector<std::string>& scenarios, const std::vector<InputFile>& inputs,
              Diagnostics* diagnostics)
      : diagnostics_(diagnostics) {
    for (const std::string& file : scenarios) scenarios_.push_back(Whole(file));
    for (const InputFile& input : inputs) files_.push_back(Whole(input.file));
    FindLibraries();
  }

  // False after a finding.
  bool FindRoot() {
    root_ = scenarios_.front().parent_path();
    for (const fs::path& file : files_) Widen(file, file.parent_path());
    for (const fs::path& scenario : scenarios_) Widen(scenario, scenario.parent_path());
    for (const fs::path& models : source_models_) Widen(models, models.parent_path());
    for (const MeshPackage& package : own_packages_) Widen(package.folder, package.folder);
    return !diagnostics_->has_errors();
  }

  [[nodiscard]] std::string PlaceOf(const std::string& file) const {
    const fs::path path = Whole(file);
    return (fs::path(kInputsFolder) / Inside(path)).generic_string();
  }

  [[nodiscard]] std::vector<PackedMeshes> Meshes() const {
    std::vector<PackedMeshes> meshes;
    for (const MeshPackage& package : packages_) {
      if (Holds(package.folder)) meshes.push_back({package.name, FolderOf(package.name)});
    }
    for (const MeshPackage& package : own_packages_) {
      const fs::path inside = package.folder.lexically_relative(root_);
      meshes.push_back(
          {package.name, (fs::path(kInputsFolder) / inside).lexically_normal().generic_string()});
      if (inside == ".") meshes.back().folder = kInputsFolder;
    }
    return meshes;
  }

 private:
  // Folders that files are found in wherever the scenario lies; those around it are its own.
  void FindLibraries() {
    for (const MeshPackage& package : MeshPackages()) {
      const MeshPackage whole{package.name, Whole(package.folder)};
      const bool own = std::ranges::any_of(
          scenarios_, [&](const fs::path& file) { return IsBelow(file, whole.folder); });
      if (own || Holds(whole.folder)) (own ? own_packages_ : packages_).push_back(whole);
    }
    for (const fs::path& scenario : scenarios_) {
      for (const fs::path& folder : ModelFolders(scenario.parent_path())) {
        const fs::path models = Whole(folder);
        if (!Holds(models)) continue;
        const bool own = IsBelow(scenario, models.parent_path());
        (own ? source_models_ : libraries_).insert(models);
      }
    }
    for (const fs::path& models : source_models_) libraries_.erase(models);
  }

  [[nodiscard]] bool Holds(const fs::path& folder) const {
    return std::ranges::any_of(files_, [&](const fs::path& file) { return IsBelow(file, folder); });
  }

  [[nodiscard]] static std::string FolderOf(const std::string& package) {
    return fmt::format("{}/packages/{}", kInputsFolder, package);
  }

  // Below inputs/, of what has its place whatever the root is; empty of all else.
  [[nodiscard]] fs::path Elsewhere(const fs::path& file) const {
    for (const MeshPackage& package : packages_) {
      if (!IsBelow(file, package.folder)) continue;
      return fs::path("packages") / package.name / file.lexically_relative(package.folder);
    }
    for (const fs::path& models : libraries_) {
      if (IsBelow(file, models)) return fs::path("models") / file.lexically_relative(models);
    }
    return {};
  }

  [[nodiscard]] fs::path Inside(const fs::path& file) const {
    const fs::path elsewhere = Elsewhere(file);
    return elsewhere.empty() ? file.lexically_relative(root_) : elsewhere;
  }

  // A root above the home folder would put its owner's name into the archive.
  void Widen(const fs::path& file, const fs::path& folder) {
    if (!Elsewhere(file).empty()) return;
    const fs::path common = CommonFolder(root_, folder);
    const std::string home = HomeFolder();
    if (common == common.root_path() || (!home.empty() && IsBelow(home, common))) {
      diagnostics_->AddError(
          file.string(),
          fmt::format("lies in no folder with {} but {}", scenarios_.front().string(),
                      common.string()),
          "put what belongs together into one folder; meshes may lie in a --package NAME=DIR");
      return;
    }
    root_ = common;
  }

  std::vector<fs::path> scenarios_, files_;
  std::set<fs::path> source_models_, libraries_;
  std::vector<MeshPackage> own_packages_, packages_;
  fs::path root_;
  Diagnostics* diagnostics_;
};

// Loads everything; what was read, each file once.
std::vector<InputFile> LoadAll(const std::vector<std::string>& scenarios,
                               Diagnostics* diagnostics) {
  const ParsedDocuments documents;
  const InputWatch watch;
  for (const std::string& file : scenarios) {
    const DocumentKind& kind = KindOf(file);
    if (kind.runs() || IsBenchmarkCase(kind) || !fs::exists(file)) {
      diagnostics->Append(kind.check(file));
    } else {
      diagnostics->AddError(file, "is neither a scenario, a study nor a case of the benchmark",
                            "of a robot's file mbverify init --from makes a model and a scenario");
    }
  }
  return watch.files();
}

class InputReader {
 public:
  InputReader(const InputPlacer& placer, Diagnostics* diagnostics)
      : placer_(placer), diagnostics_(diagnostics) {}

  void Read(const InputFile& input) {
    const std::string path = placer_.PlaceOf(input.file);
    const auto content = ReadWholeFile(input.file);
    if (!content || ContentFingerprint(*content) != input.fingerprint) {
      return Refuse(input.file, "has changed meanwhile, or is not a file that can be read twice",
                    "pipes are not packed");
    }
    if (!IsPlainPath(path)) {
      return Refuse(input.file, "has no name for an archive: a part of it begins with a point",
                    "rename it");
    }
    const std::string home = HomeFolder();
    if (const int line = home.empty() ? 0 : LineNaming(*content, home); line > 0) {
      diagnostics_->Add({.severity = Severity::kError,
                         .file = input.file,
                         .line = line,
                         .column = 1,
                         .message = "contains the path of your home directory",
                         .hint = "write paths relative to the file, and nothing in comments"});
      return;
    }
    Keep({input.file, path, RoleOf(input.file), *content, IsProgram(input.file)});
  }

  std::vector<PackedInput> Take() {
    std::vector<PackedInput> files;
    for (auto& [path, input] : files_) files.push_back(std::move(input));
    return files;
  }

 private:
  void Keep(PackedInput input) {
    const auto [place, is_new] = files_.emplace(input.path, input);
    if (is_new || place->second.content == input.content) return;
    Refuse(input.file,
           fmt::format("and {} have one place in the archive, {}", place->second.file, input.path),
           "rename one of the models");
  }

  static bool IsProgram(const std::string& file) {
    std::error_code error;
    const auto mode = fs::status(file, error).permissions();
    return !error && (mode & fs::perms::owner_exec) != fs::perms::none;
  }

  void Refuse(const std::string& file, const std::string& message, const std::string& hint) {
    diagnostics_->AddError(file, message, hint);
  }

  const InputPlacer& placer_;
  Diagnostics* diagnostics_;
  std::map<std::string, PackedInput> files_;
};

std::string LicenseOf(const PackedInput& input) {
  YamlReader yaml(input.file);
  const YamlNodePtr root = yaml.Parse(input.content);
  if (root == nullptr || !root->is_map()) return "";
  const YamlNode* license = root->Find("license");
  return license != nullptr && license->is_scalar() ? license->text : "";
}

}  // namespace

std::optional<PackageInputs> GatherInputs(const std::vector<std::string>& scenarios,
                                          Diagnostics* diagnostics) {
  Diagnostics found;
  const std::vector<InputFile> read = LoadAll(scenarios, &found);
  PackageInputs inputs;
  if (!found.has_errors()) {
    InputPlacer placer(scenarios, read, &found);
    if (placer.FindRoot()) {
      InputReader reader(placer, &found);
      for (const InputFile& input : read) reader.Read(input);
      inputs.files = reader.Take();
      inputs.meshes = placer.Meshes();
      for (const std::string& file : scenarios) {
        const std::string place = placer.PlaceOf(file);
        if (!Contains(inputs.scenarios, place)) inputs.scenarios.push_back(place);
      }
    }
  }
  diagnostics->Append(found);
  return found.has_errors() ? std::nullopt : std::optional(std::move(inputs));
}

std::string LicensesOf(const PackageInputs& inputs) {
  std::set<std::string> licenses;
  for (const PackedInput& input : inputs.files) {
    if (input.role == "model" && input.path.ends_with(".yaml")) licenses.insert(LicenseOf(input));
  }
  licenses.erase("");
  return Joined({licenses.begin(), licenses.end()});
}

namespace fs = std::filesystem;

int LineNaming(const std::string& text, const std::string& path) {
  const auto part_of_name = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '-' || c == '.' || (c & 0x80) != 0;
  };
  for (size_t at = text.find(path); at != std::string::npos; at = text.find(path, at + 1)) {
    const size_t end = at + path.size();
    if (at > 0 && part_of_name(text[at - 1])) continue;
    if (end < text.size() && part_of_name(text[end])) continue;
    return 1 +
           static_cast<int>(std::count(text.begin(), text.begin() + static_cast<long>(at), '\n'));
  }
  return 0;
}

std::string HomeFolder() {
  const char* home = std::getenv("HOME");
  if (home == nullptr || *home != '/') return "";
  fs::path folder = fs::path(home).lexically_normal();
  if (!folder.has_filename()) folder = folder.parent_path();
  return folder == folder.root_path() ? "" : folder.string();
}

// mbverify package

namespace {

namespace fs = std::filesystem;

struct PackageArguments {
  bool check = false;
  std::vector<std::string> scenarios;
  std::string out = "paper.zip", date;
  bool no_report = false, no_figures = false, force = false, trust = false;
  JsonOption json;
};

// Before anything is computed: 0, or 2 after saying why the archive cannot be written there.
int CheckPackageOut(const PackageArguments& arguments) {
  std::error_code error;
  const fs::path out = arguments.out;
  if (!IsPlainPath(out.stem().string())) {
    return Refuse(arguments.out + " has no name for the folder in the archive",
                  "for example -o paper.zip");
  }
  const fs::path json = arguments.json.path();
  if (fs::absolute(json, error).lexically_normal() == fs::absolute(out, error).lexically_normal()) {
    return Refuse("the archive and --json are one file", "choose another for one of them");
  }
  if (fs::is_directory(out, error)) return Refuse(arguments.out + " is a folder", "");
  if (fs::exists(out, error) && !arguments.force) {
    return Refuse(arguments.out + " is there already", "choose another name, or --force");
  }
  return 0;
}

void PrintPackage(const PackageArguments& arguments, const PackageOutcome& outcome) {
  std::FILE* to = arguments.json.text();
  for (const PackedScenario& scenario : outcome.description.scenarios) {
    Say(to, "{}: {} (exit code {})\n", scenario.file, scenario.verdict, scenario.exit_code);
  }
  Say(to, "{}: {} files, {} bytes, SHA-256 {}\n", arguments.out,
      outcome.description.files.size() + 1, outcome.zip.size(), Sha256Hex(outcome.zip));
}

nlohmann::ordered_json PackageJson(const PackageArguments& arguments, const PackageOutcome& outcome,
                                   int exit_code) {
  // "package" is the schema of the manifest in it.
  nlohmann::ordered_json json = {
      {"schema", "mbverify.archive/1"}, {"archive", arguments.out}, {"exit_code", exit_code}};
  if (!outcome.zip.empty()) {
    json["bytes"] = outcome.zip.size();
    json["sha256"] = Sha256Hex(outcome.zip);
    json["manifest"] = ParseJson<nlohmann::ordered_json>(ManifestJson(outcome.description));
  }
  json["findings"] = FindingObjects(outcome.diagnostics);
  return json;
}

int Package(const PackageArguments& arguments) {
  int exit_code = CheckPackageOut(arguments);
  if (exit_code != 0) return exit_code;
  if (!arguments.date.empty() && !IsDate(arguments.date)) {
    return Refuse("--date " + arguments.date + " is not a date", "for example 2026-11-23");
  }
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.out, arguments.json.path()}, &exit_code);
  if (exit_code != 0) return exit_code;
  PackageOptions options{.folder = fs::path(arguments.out).stem().string(),
                         .date = arguments.date,
                         .page = !arguments.no_report,
                         .figures = !arguments.no_figures};
  exit_code = AskForPrograms(files, {}, arguments.trust, false, &options.programs);
  if (exit_code != 0) return exit_code;
  PackageOutcome outcome;
  {
    ProgressLine progress(true);
    options.progress = [&](const std::string& file, double fraction) {
      progress.active() ? progress.Show(file, fraction) : Say(stderr, "runs {}\n", file);
    };
    outcome = MakePackage(files, options);
  }
  FindingPrinter(stderr).Print(outcome.diagnostics);
  exit_code = outcome.exit_code;
  if (exit_code == 0) {
    // Inputs were refused before anything ran, and --force is for any other file.
    const std::string trouble = WriteFile(arguments.out, outcome.zip);
    if (!trouble.empty()) return NotWritten(trouble, "");
    PrintPackage(arguments, outcome);
    for (const PackedScenario& scenario : outcome.description.scenarios) {
      exit_code = WorseExit(exit_code, scenario.exit_code);
    }
  }
  return WorseExit(exit_code, arguments.json.Write(PackageJson(arguments, outcome, exit_code), {}));
}

}  // namespace

void AddPackageCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<PackageArguments>();
  auto archive = std::make_shared<ArchiveArguments>();
  CLI::App* package = app->add_subcommand(
      "package", "An archive beside a paper: inputs, results, figures, and how to repeat them");
  CLI::Option* check =
      package->add_flag("--check", arguments->check,
                        "repeat what an archive holds, and say which results are the same");
  package
      ->add_option(
          "scenario", arguments->scenarios,
          "scenario files or folders of them, study files, and case.yaml of the benchmark; with "
          "--check the archive")
      ->required();
  package->add_option("-o,--out", arguments->out, "the archive")
      ->capture_default_str()
      ->excludes(check);
  package
      ->add_option("--date", arguments->date,
                   "YYYY-MM-DD that it says it was published; else that of SOURCE_DATE_EPOCH")
      ->excludes(check);
  package->add_flag("--no-report", arguments->no_report, "without report.html")->excludes(check);
  package->add_flag("--no-figures", arguments->no_figures, "without figures")->excludes(check);
  package->add_flag("--force", arguments->force, "replace a file of this name")->excludes(check);
  package
      ->add_flag("-v,--verbose", archive->verbose,
                 "with --check: every file, and every signal of those that are not the same")
      ->needs(check);
  AddTrustOption(package, &arguments->trust);
  arguments->json.AddTo(package);
  SetFooter(package,
            {"package scenarios/stabilizing_platform/sea_state.yaml -o paper.zip",
             "package four_bar/turn scara_robot/stiffness -o paper.zip --date 2026-11-23",
             "package --check paper.zip"},
            "0 agree, or the same within limits; 1 disagree (packed all the same), or something "
            "differs; 2 bad input, 3 could not run, 4 internal error");
  package->callback([arguments, archive, exit_code] {
    if (!arguments->check) {
      *exit_code = Package(*arguments);
    } else if (arguments->scenarios.size() != 1) {
      *exit_code = Refuse("package --check takes one archive", "");
    } else {
      archive->archive = arguments->scenarios.front();
      archive->trust = arguments->trust;
      archive->json = arguments->json;
      *exit_code = CheckArchive(*archive);
    }
  });
}

}  // namespace mbv
