// mbverify model, check, list
#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <set>
#include <string>

#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "verify/check_file.h"
#include "verify/model_text.h"
#include "verify/program_consent.h"

namespace mbv {

namespace {

namespace fs = std::filesystem;

struct ModelArguments {
  std::string model, format, out, drives;
  std::vector<std::string> set;
  RobotArguments robot;
  JsonOption json;
};

ModelFormat FormatOf(const std::string& word) {
  return word == "mjcf"        ? ModelFormat::kMjcf
         : word == "urdf"      ? ModelFormat::kUrdf
         : word == "yaml"      ? ModelFormat::kYaml
         : word == "json"      ? ModelFormat::kJson
         : word == "mechanism" ? ModelFormat::kMechanism
                               : ModelFormat::kMobility;
}

ModelDrives DrivesOf(const std::string& word) {
  return word == "free"    ? ModelDrives::kFree
         : word == "servo" ? ModelDrives::kServo
                           : ModelDrives::kHeld;
}

bool IsMobilityReport(const std::string& format) {
  return FormatOf(format) == ModelFormat::kMobility;
}

// What --json writes, as --format json prints it.
std::string WithHead(const JsonOption& json, const std::string& text) {
  return json.Text(ParseJson<nlohmann::ordered_json>(text));
}

// What URDF cannot say lies beside it, where it is found by who reads the URDF.
int WriteUrdfFiles(const std::string& path, const std::string& text, const LoadResult& loaded,
                   const std::vector<InputFile>& inputs) {
  if (fs::path(path).extension() != ".urdf") return WriteWholeFile(path, text, inputs);
  const std::string companion = UrdfCompanionPath(path);
  const std::string completed =
      WriteUrdfCompanion(*loaded.mechanism, fs::path(path).filename(), loaded.caveats);
  if (const std::string why = ForeignFileReason(path, text); !why.empty()) return Refuse(why, "");
  if (const int refused = WriteWholeFile(companion, completed, inputs); refused != 0) {
    return refused;
  }
  const int exit_code = WriteWholeFile(path, text, inputs);
  if (exit_code == 0) Say(stderr, "{} completes it, and is found beside it\n", companion);
  return exit_code;
}

int Model(const ModelArguments& arguments) {
  if (!arguments.drives.empty() && FormatOf(arguments.format) != ModelFormat::kMjcf) {
    return Refuse("--drives says what holds the drives of an MJCF", "add --format mjcf");
  }
  const InputWatch inputs;
  const std::optional<LoadResult> read =
      LoadModelOrRefuse(arguments.model, arguments.set, arguments.robot);
  if (!read) return 2;
  const LoadResult& loaded = *read;
  const ModelFormat format = FormatOf(arguments.format);
  if ((format == ModelFormat::kUrdf || format == ModelFormat::kYaml) &&
      !loaded.mechanism->beams.empty()) {
    Finding finding;
    finding.severity = Severity::kWarning;
    finding.file = loaded.mechanism->file;
    finding.message = fmt::format("{} has rigid links only: {} beams are left out",
                                  format == ModelFormat::kUrdf ? "URDF" : "what is written",
                                  loaded.mechanism->beams.size());
    SayText(stderr, ToText(finding) + "\n");
  }
  std::string text;
  if (format == ModelFormat::kMjcf) {
    MjcfText mjcf = MjcfFor(*loaded.mechanism, DrivesOf(arguments.drives));
    if (!mjcf.trouble.empty()) {
      const std::string of = arguments.drives.empty() ? "" : "--drives " + arguments.drives + ": ";
      return Refuse(of + mjcf.trouble, "");
    }
    for (const std::string& line : mjcf.missing) {
      Say(stderr, "warning: not in the MJCF, as MuJoCo 2.2 has no word for it: {}\n", line);
    }
    text = std::move(mjcf.text);
  } else {
    text = ModelText(*loaded.mechanism, format, loaded.caveats);
  }
  if (format == ModelFormat::kJson) text = WithHead(arguments.json, text);
  int exit_code = 0;
  if (!arguments.out.empty()) {
    exit_code = format == ModelFormat::kUrdf
                    ? WriteUrdfFiles(arguments.out, text, loaded, inputs.files())
                    : WriteWholeFile(arguments.out, text, inputs.files());
  } else if (IsMobilityReport(arguments.format)) {
    SayText(arguments.json.text(), text);
  } else {
    fmt::print(arguments.json.text(), "{}", text);
  }
  if (!arguments.json.wanted()) return exit_code;
  return WorseExit(
      exit_code,
      arguments.json.Write(ModelText(*loaded.mechanism, ModelFormat::kJson, {}), inputs.files()));
}

struct CheckArguments {
  std::vector<std::string> files;
  JsonOption json;
};

nlohmann::ordered_json ProgramsJson(const ProgramList& list) {
  auto programs = nlohmann::ordered_json::array();
  for (const CalledProgram& called : list.programs) {
    programs.push_back({{"witness", called.witness},
                        {"command", called.command},
                        {"trusted", called.trust != ProgramTrust::kNone},
                        {"because", TrustWord(called.trust)},
                        {"reason", called.reason}});
  }
  return programs;
}

int CheckFiles(const CheckArguments& arguments) {
  int exit_code = 0;
  std::FILE* const text = arguments.json.text();
  FindingPrinter findings(text);
  auto checked = nlohmann::ordered_json::array();
  std::vector<InputFile> inputs;
  for (const std::string& argument : arguments.files) {
    std::vector<std::string> unread;
    const std::vector<std::string> files = ExpandYaml(FindScenario(argument), &unread);
    for (const std::string& line : unread) Say(text, "{}\n", line);
    if (!unread.empty()) exit_code = 2;
    if (files.empty()) {
      Say(text, "{}: error: no *.yaml file in this folder\n", argument);
      exit_code = 2;
    }
    for (const std::string& file : files) {
      const InputWatch watch;
      const Diagnostics diagnostics = CheckFile(file);
      inputs.insert(inputs.end(), watch.files().begin(), watch.files().end());
      inputs.push_back({file, ""});
      const bool ok = !diagnostics.has_errors();
      const ProgramList programs = ok ? ProgramsOf(file, {}) : ProgramList{};
      checked.push_back({{"file", file}, {"ok", ok}, {"findings", FindingObjects(diagnostics)}});
      if (!programs.programs.empty()) checked.back()["programs"] = ProgramsJson(programs);
      findings.Print(diagnostics);
      if (!ok) exit_code = 2;
      if (ok) Say(text, "{}: ok\n", file);
      for (const std::string& line : programs.Lines()) Say(text, "  runs {}\n", line);
    }
  }
  return WorseExit(
      exit_code,
      arguments.json.Write({{"exit_code", exit_code}, {"files", std::move(checked)}}, inputs));
}

nlohmann::ordered_json ListModels(std::FILE* text) {
  auto models = nlohmann::ordered_json::array();
  fmt::print(text, "models\n");
  for (const std::string& name : ModelNames(".")) {
    const auto file = FindModel(name, ".");
    const LoadResult loaded = LoadModel(*file);
    Say(text, "  {:<24}{}\n", name,
        loaded.mechanism ? loaded.mechanism->description
                         : "(has errors: mbverify check " + *file + ")");
    models.push_back({{"name", name},
                      {"file", *file},
                      {"ok", loaded.mechanism.has_value()},
                      {"description", loaded.mechanism ? loaded.mechanism->description : ""}});
  }
  return models;
}

struct KnownScenario {
  std::string name;  ///< that leads to it
  std::string file, description;
};
// All scenarios in ScenarioFolders(); of two with one name that of the first folder.
std::vector<KnownScenario> KnownScenarios() {
  std::vector<KnownScenario> scenarios;
  std::set<std::string> names;
  for (const fs::path& folder : ScenarioFolders()) {
    std::vector<std::string> unread;
    for (const std::string& file : ExpandYaml(folder, &unread)) {
      const ScenarioHead head = ReadScenarioHead(file);
      if (!head.is_scenario) continue;
      std::string name = fs::path(file).lexically_relative(folder).replace_extension().string();
      if (names.insert(name).second) scenarios.push_back({name, file, head.description});
    }
  }
  return scenarios;
}

nlohmann::ordered_json ListScenarios(std::FILE* text) {
  auto scenarios = nlohmann::ordered_json::array();
  if (!ScenarioFolders().empty()) fmt::print(text, "scenarios\n");
  for (const KnownScenario& known : KnownScenarios()) {
    Say(text, "  {}\n      {}\n", known.file,
        known.description.empty() ? "(no description)" : known.description);
    scenarios.push_back({{"file", known.file}, {"description", known.description}});
  }
  return scenarios;
}

// Names alone, one per line: what completion offers.
int ListNames(const std::string& kind) {
  if (kind == "models") {
    for (const std::string& name : ModelNames(".")) fmt::print("{}\n", OneLine(name));
    return 0;
  }
  for (const KnownScenario& known : KnownScenarios()) fmt::print("{}\n", OneLine(known.name));
  return 0;
}

struct ListArguments {
  std::string names;
  JsonOption json;
};

int List(const ListArguments& arguments) {
  const JsonOption& json = arguments.json;
  if (!arguments.names.empty()) return ListNames(arguments.names);

  auto models = ListModels(json.text());
  auto scenarios = ListScenarios(json.text());
  return json.Write({{"models", std::move(models)}, {"scenarios", std::move(scenarios)}}, {});
}

}  // namespace

void AddModelCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<ModelArguments>();
  CLI::App* model = app->add_subcommand("model", "Mobility report, or the generated MJCF or URDF");
  model
      ->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file")
      ->required();
  model
      ->add_option(
          "--format", arguments->format,
          "text (mobility report), json (the same as --json writes), or the model as mjcf, "
          "urdf, yaml (a model file with the numbers that the parameters give) or mechanism "
          "(mechanism.json, docs/how-to/external_solvers.md)")
      ->check(OneOf({"text", "json", "mjcf", "urdf", "yaml", "mechanism"}));
  model
      ->add_option("--drives", arguments->drives,
                   "of an mjcf: free (nothing holds them), held (at home, by equalities; the "
                   "default) or servo (position and velocity servos, tuned for the home pose)")
      ->check(OneOf({"free", "held", "servo"}));
  model->add_option("--out", arguments->out, "write to this file instead of stdout");
  arguments->json.AddTo(model);
  model->add_option("--set", arguments->set, "PARAMETER=NUMBER (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(model, &arguments->robot);
  SetFooter(model,
            {"model stabilizing_platform", "model four_bar --set crank=0.16",
             "model spr_tripod --format mjcf --out spr_tripod.xml",
             "model scara_robot --format mjcf --drives servo --out scara_robot.xml",
             "model spr_tripod --json mobility.json"},
            "0 done, 2 bad input");
  model->callback([arguments, exit_code] { *exit_code = Model(*arguments); });
}

void AddCheckCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CheckArguments>();
  CLI::App* check =
      app->add_subcommand("check", "Validate model and scenario files, and mechanism.json");
  check->add_option("file", arguments->files, "files, or folders of them")->required();
  arguments->json.AddTo(check);
  SetFooter(check, {"check my_model.yaml my_scenario.yaml", "check scenarios/spr_tripod"},
            "0 no errors, 2 bad input");
  check->callback([arguments, exit_code] { *exit_code = CheckFiles(*arguments); });
}

void AddListCommand(CLI::App* app, int* exit_code) {
  CLI::App* list = app->add_subcommand("list", "List models and scenarios");
  auto arguments = std::make_shared<ListArguments>();
  list->add_option("--names", arguments->names, "names alone, one per line")
      ->check(OneOf({"models", "scenarios"}));
  arguments->json.AddTo(list);
  SetFooter(list, {"list", "list --json -"}, "0 done, 2 bad input");
  list->callback([arguments, exit_code] { *exit_code = List(*arguments); });
}

}  // namespace mbv
