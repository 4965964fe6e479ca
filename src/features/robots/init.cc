#include "features/robots/init.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdio.h>
#include <unistd.h>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include "analytic/closed_form.h"
#include "base/files.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/run/default_setup.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlace = "@NAME@";

std::string Filled(std::string text, const std::string& name) {
  for (size_t at = 0; (at = text.find(kPlace, at)) != std::string::npos; at += name.size()) {
    text.replace(at, std::strlen(kPlace), name);
  }
  return text;
}

// A folder with files that appears whole, and only where nothing was before.
class NewFolder {
 public:
  NewFolder(fs::path target, std::string file, std::string content,
            std::vector<ModelMeshFile> meshes)
      : target_(std::move(target)),
        file_(std::move(file)),
        content_(std::move(content)),
        meshes_(std::move(meshes)) {}
  ~NewFolder() {
    std::error_code error;
    if (!temporary_.empty()) fs::remove_all(temporary_, error);
    // Folders made on the way, if nothing came to lie in them.
    for (const fs::path& made : made_) {
      if (!kept_) fs::remove(made, error);
    }
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  [[nodiscard]] fs::path path() const { return target_ / file_; }

  // Each returns "" or what went wrong.
  [[nodiscard]] std::string Fill() {
    std::error_code error;
    for (fs::path folder = target_.parent_path(); !folder.empty() && !fs::exists(folder, error);
         folder = folder.parent_path()) {
      made_.push_back(folder);
    }
    fs::create_directories(target_.parent_path(), error);
    if (error) return Trouble("make folder", target_, error.message());
    temporary_ = MakePrivateFolder(target_.parent_path() /
                                   fmt::format(".{}.mbverify-", target_.filename().string()));
    if (temporary_.empty()) return Trouble("make folder", target_, std::strerror(errno));
    for (const ModelMeshFile& mesh : meshes_) {
      std::string trouble = WriteFile(temporary_ / "new" / mesh.path, mesh.content);
      if (!trouble.empty()) return trouble;
    }
    return WriteFile(temporary_ / "new" / file_, content_);
  }
  [[nodiscard]] std::string Commit() {
    const fs::path made = temporary_ / "new";
    if (renameat2(AT_FDCWD, made.c_str(), AT_FDCWD, target_.c_str(), RENAME_NOREPLACE) == 0) {
      kept_ = true;
      return "";
    }
    return Trouble("make", target_, std::strerror(errno));
  }
  void TakeBack() {
    std::error_code error;
    fs::remove_all(target_, error);
    kept_ = false;
  }

 private:
  static std::string Trouble(const char* what, const fs::path& path, const std::string& reason) {
    return fmt::format("cannot {} {}: {}", what, path.string(), reason);
  }

  fs::path target_, temporary_;
  std::string file_, content_;
  std::vector<ModelMeshFile> meshes_;
  std::vector<fs::path> made_;  // innermost first
  bool kept_ = false;
};

class Initialiser {
 public:
  explicit Initialiser(const InitOptions& options) : options_(options) {}

  InitResult Run() {
    CheckName();
    const bool from_file = IsRobotFile(options_.from);
    const Starter* starter = from_file ? nullptr : FindStarter();
    const fs::path into = fs::path(options_.into).lexically_normal();
    const fs::path model = into / "models" / options_.name;
    const fs::path scenario = into / "scenarios" / options_.name;
    if (IsName(options_.name)) {
      CheckFree(model);
      CheckFree(scenario);
    }
    CheckFolder(into);
    if (result_.diagnostics.has_errors()) return std::move(result_);
    if (from_file) {
      WriteFromFile(model, scenario);
    } else {
      Write(Filled(starter->model, options_.name), Filled(starter->first, options_.name), model,
            scenario, {});
    }
    return std::move(result_);
  }

 private:
  void Add(const std::string& message, const std::string& hint) {
    Finding finding;
    finding.message = message;
    finding.hint = hint;
    result_.diagnostics.Add(std::move(finding));
  }

  void CheckName() {
    const std::string& name = options_.name;
    if (!IsName(name)) {
      const std::string near = NearestName(name);
      Add(fmt::format("name = '{}' violates: {}", name, kNameRule),
          near.empty() ? "for example my_linkage" : fmt::format("for example {}", near));
      return;
    }
    for (const ClosedFormRow& row : ClosedForms()) {
      if (row.mechanism != name) continue;
      Add(fmt::format("name = '{}' belongs to a mechanism with a closed form of its own", name),
          fmt::format("for example my_{}", name));
    }
  }

  const Starter* FindStarter() {
    std::vector<std::string> names;
    for (const Starter& starter : Starters()) {
      if (starter.name == options_.from) return &starter;
      names.emplace_back(starter.name);
    }
    Add(fmt::format("--from {} is not one of {}", options_.from, fmt::join(names, ", ")),
        DidYouMean(options_.from, names));
    return nullptr;
  }

  void CheckFree(const fs::path& folder) {
    std::error_code error;
    if (!fs::exists(fs::symlink_status(folder, error))) return;
    Add(fmt::format("{} is already there and is not overwritten", folder.string()),
        "choose another name, another folder by --into, or move it away");
  }

  void CheckFolder(const fs::path& into) {
    std::error_code error;
    if (!fs::exists(into, error) || fs::is_directory(into, error)) return;
    Add(fmt::format("--into {} is not a folder", into.string()), "");
  }

  void WriteFromFile(const fs::path& model, const fs::path& scenario) {
    DefaultSetupResult made =
        MakeDefaultSetup(options_.from, options_.name, options_.name, options_.load);
    result_.diagnostics.Append(made.diagnostics);
    if (!made.setup) return;
    const std::string head =
        fmt::format("# Made by mbverify from {}.\n", fs::path(options_.from).filename().string());
    Write(head + made.setup->model, made.setup->scenario, model, scenario,
          std::move(made.setup->meshes));
  }

  void Write(const std::string& model_text, const std::string& first_text, const fs::path& model,
             const fs::path& scenario, std::vector<ModelMeshFile> meshes) {
    NewFolder a(model, "model.yaml", model_text, std::move(meshes));
    NewFolder b(scenario, "first.yaml", first_text, {});
    std::string trouble = a.Fill();
    if (trouble.empty()) trouble = b.Fill();
    if (trouble.empty()) trouble = a.Commit();
    if (trouble.empty()) {
      trouble = b.Commit();
      if (!trouble.empty()) a.TakeBack();
    }
    if (!trouble.empty()) {
      Add(trouble, "choose another folder by --into");
      result_.exit_code = 3;
      return;
    }
    for (const NewFolder* folder : {&a, &b}) {
      result_.files.push_back(folder->path().string());
    }
  }

  const InitOptions& options_;
  InitResult result_;
};

}  // namespace

InitResult InitModel(const InitOptions& options) { return Initialiser(options).Run(); }

// mbverify init

namespace {

struct InitArguments {
  InitOptions options;
  RobotArguments robot;
};

int Init(InitArguments arguments) {
  if (!ReadRobotOptions(arguments.robot, &arguments.options.load)) return 2;
  const InitResult result = InitModel(arguments.options);
  SayText(stderr, result.diagnostics.Text());
  if (result.files.empty()) return result.exit_code;
  for (const std::string& file : result.files) fmt::print("wrote {}\n", file);
  Say(stdout, "next: mbverify run {}\n", result.files.back());
  return 0;
}

}  // namespace

void AddInitCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<InitArguments>();
  InitOptions* const options = &arguments->options;
  std::string names;
  for (const Starter& starter : Starters()) {
    names += fmt::format("{}{}", names.empty() ? "" : ", ", starter.name);
  }
  CLI::App* init = app->add_subcommand("init", "Write a model and a scenario to start from");
  init->add_option("name", options->name, "name of your mechanism")->required();
  init->add_option(
          "--from", options->from,
          "mechanism to start from: " + names + "; or a robot: FILE.urdf, FILE.xml, FILE.sdf")
      ->capture_default_str();
  init->add_option("--into", options->into, "folder that gets models/ and scenarios/")
      ->capture_default_str();
  AddRobotOptions(init, &arguments->robot);
  SetFooter(init,
            {"init my_linkage && mbverify run scenarios/my_linkage/first.yaml",
             "init my_crank --from slider_crank", "init my_robot --from my_robot.urdf"},
            "0 written, 2 bad input. Nothing that exists is overwritten.");
  init->callback([arguments, exit_code] { *exit_code = Init(*arguments); });
}

}  // namespace mbv
