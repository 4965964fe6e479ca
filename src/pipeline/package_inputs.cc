#include "pipeline/package_inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <map>
#include <set>

#include "core/files.h"
#include "core/inputs.h"
#include "core/names.h"
#include "core/text.h"
#include "input/parsed_documents.h"
#include "input/yaml_reader.h"
#include "mesh/find_mesh.h"
#include "pipeline/check_file.h"
#include "pipeline/home_folder.h"
#include "pipeline/study.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"

namespace mbv {
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
    const ScenarioHead head = ReadScenarioHead(file);
    return head.is_study ? "study" : head.is_scenario ? "scenario" : "model";
  }
  if (EndsIn(file, {".urdf", ".xml"})) return "model";
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
    for (const fs::path& models : own_models_) Widen(models, models.parent_path());
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
        (own ? own_models_ : libraries_).insert(models);
      }
    }
    for (const fs::path& models : own_models_) libraries_.erase(models);
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
  std::set<fs::path> own_models_, libraries_;
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
    const ScenarioHead head = ReadScenarioHead(file);
    if (head.is_study) {
      diagnostics->Append(CheckStudy(file));
    } else if (head.is_scenario || !fs::exists(file)) {
      diagnostics->Append(CheckFile(file));
    } else {
      diagnostics->AddError(file, "is neither a scenario nor a study",
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
      return Refuse(input.file, "has changed meanwhile, or is no file that can be read twice",
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
                         .message = "names your home folder, which is nobody's business",
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

}  // namespace mbv
