// mbverify stiffness
#include <fmt/format.h>

#include <algorithm>
#include <memory>

#include "base/output_folder.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/stiffness/stiffness.h"
#include "features/stiffness/stiffness_map.h"
#include "model_file/load_model.h"
#include "scenario/file_parts.h"

namespace mbv {
namespace {

struct StiffnessArguments {
  std::string model, output, out, format = "text", closed_form;
  std::vector<std::string> at, set, indices;
  std::vector<std::vector<std::string>> maps;
  int jobs = 1;
  RandomLoads loads{.count = 0};
  bool no_simulation = false, verbose = false;
  JsonOption json;
};

Finding AtOption(const std::string& option, std::string message, std::string hint = "") {
  return {.file = option, .message = std::move(message), .hint = std::move(hint)};
}

// Loads the model with the overrides that the scenario holds; empty after findings.
std::optional<Mechanism> LoadModelOf(StiffnessScenario* scenario, Diagnostics* diagnostics) {
  LoadOptions options;
  options.overrides = scenario->parameters;
  options.override_places = scenario->parameter_places;
  LoadResult loaded = LoadModel(scenario->model_file, options);
  diagnostics->Append(loaded.diagnostics);
  scenario->model_caveats = std::move(loaded.caveats);
  if (loaded.mechanism)
    scenario->parameters = InPlainUnits(scenario->parameters, *loaded.mechanism);
  return std::move(loaded.mechanism);
}

// Numbers and expressions of the model's parameters; parameters among them load the model again.
// Coordinates that are left out keep their values of the usual pose, if that is stated by the same
// coordinates.
void ReadPose(const std::vector<SetValue>& at, StiffnessScenario* scenario,
              std::optional<Mechanism>* mechanism, Diagnostics* diagnostics) {
  Scope scope;
  for (const Parameter& p : (*mechanism)->parameters) scope.Set(p.name, p.value);
  Overrides parameters;
  for (const auto& [name, value] : at) {
    const std::string option = "--at " + name + "=" + value;
    YamlReader yaml(option);
    ValueReader values(&yaml, &scope);
    const YamlNodePtr node = yaml.Parse(value);
    const auto number = node == nullptr ? std::nullopt : values.Number(*node, name);
    for (Finding finding : yaml.diagnostics().findings()) {
      finding.line = 0;  // there is only one
      diagnostics->Add(std::move(finding));
    }
    if (auto fault = PutIntoPose(**mechanism, name, number, &scenario->pose, &parameters)) {
      diagnostics->Add(AtOption(option, std::move(fault->message), std::move(fault->hint)));
    }
    scenario->parameter_places[SplitUnit(name).name] = {.file = option};
  }
  if (diagnostics->has_errors()) return;
  if (!parameters.empty()) {
    scenario->parameters = Merge(scenario->parameters, parameters);
    *diagnostics = {};  // warnings of the model come again
    *mechanism = LoadModelOf(scenario, diagnostics);
  }
  PoseValues& pose = scenario->pose;
  if (!*mechanism || pose.empty()) return;
  PoseValues usual = ExamplePose((*mechanism)->name);
  if (usual.empty()) usual = HomePose(**mechanism);
  const bool same = std::ranges::all_of(
      pose, [&](const auto& coordinate) { return usual.contains(coordinate.first); });
  if (same) pose.merge(usual);
  if (const auto fault = CheckPose(**mechanism, pose)) {
    diagnostics->Add(AtOption("--at", fault->message, fault->hint));
  }
}

// The request as a scenario, so that it is checked and run like one; empty after findings.
std::optional<PreparedStiffness> PrepareRequest(const StiffnessArguments& arguments,
                                                Diagnostics* diagnostics) {
  std::vector<SetValue> at, set;
  if (!ReadAssignments(arguments.at, "--at", "platform.x=-0.05", &at) ||
      !ReadAssignments(arguments.set, "--set", "K_act=10000", &set)) {
    return {};
  }
  const auto model = FindElasticModel(arguments.model, "");
  if (const Finding* none = std::get_if<Finding>(&model)) {
    diagnostics->Add(AtOption(arguments.model, none->message, none->hint));
    return {};
  }
  StiffnessScenario scenario;
  scenario.name = "stiffness_at_pose";
  scenario.model_file = std::get<std::string>(model);
  LoadOptions options;
  diagnostics->Append(ReadParameterOptions(set, &options));
  if (diagnostics->has_errors()) return {};
  scenario.parameters = options.overrides;
  scenario.parameter_places = options.override_places;
  auto mechanism = LoadModelOf(&scenario, diagnostics);
  if (!mechanism) return {};
  if (const auto rigid = CheckElastic(*mechanism, scenario.model_file)) {
    diagnostics->Add(AtOption(arguments.model, rigid->message));
  }
  ReadPose(at, &scenario, &mechanism, diagnostics);
  if (diagnostics->has_errors()) return {};
  scenario.output = arguments.output;
  if (!scenario.output.empty() && mechanism->FindOutput(scenario.output) < 0) {
    Finding none = MissingOutput(*mechanism, scenario.output);
    none.file = "--output " + scenario.output;
    diagnostics->Add(std::move(none));
    return {};
  }
  scenario.simulation.on = !arguments.no_simulation;
  scenario.analytic.model = arguments.closed_form;
  scenario.analytic.stated = !arguments.closed_form.empty();
  const RandomLoads& loads = arguments.loads;
  if (loads.count > 0 && !(loads.force_max + loads.moment_max > 0.0)) {
    diagnostics->Add(AtOption("--loads", "forces and moments up to 0 are no loads"));
    return {};
  }
  scenario.loads = DrawLoads(loads);
  if (!scenario.loads.empty()) scenario.loads_text = TextOf(loads);
  return PrepareStiffness(std::move(scenario), *std::move(mechanism), diagnostics);
}

std::string CommandOf(const StiffnessArguments& arguments) {
  std::string command = "mbverify stiffness " + arguments.model;
  for (const std::string& at : arguments.at) command += " --at " + at;
  for (const std::string& set : arguments.set) command += " --set " + set;
  if (!arguments.output.empty()) command += " --output " + arguments.output;
  if (!arguments.closed_form.empty()) command += " --closed-form " + arguments.closed_form;
  if (const RandomLoads& loads = arguments.loads; loads.count > 0) {
    command += fmt::format(" --loads {} --seed {} --force-max {:g} --moment-max {:g}", loads.count,
                           loads.seed, loads.force_max, loads.moment_max);
  }
  return command;
}

std::string WriteFolder(const StiffnessArguments& arguments, const StiffnessRun& run,
                        const std::vector<std::pair<std::string, std::string>>& maps) {
  const std::string out = arguments.out.empty() ? "out" : arguments.out;
  OutputFolder folder(out, run.report.mechanism + "/" + run.report.scenario);
  std::vector<std::pair<std::string, std::string>> files = StiffnessFiles(run);
  for (const auto& [name, content] : maps) files.emplace_back("maps/" + name, content);
  std::string trouble = folder.WriteAll(files);
  if (trouble.empty()) Say(stderr, "results in {}\n", folder.target().string());
  return trouble;
}

struct MapFolder {
  std::string text;
  std::vector<std::pair<std::string, std::string>> files;
  bool whole = true;  ///< false: processes of rows were killed
};

// All wanted maps; findings are bad input.
MapFolder DrawMaps(const StiffnessArguments& arguments, const PreparedStiffness& prepared,
                   const ProgressFunction& progress, Diagnostics* diagnostics) {
  std::vector<std::string> texts;
  for (const std::vector<std::string>& words : arguments.maps) {
    const std::string text = fmt::format("{}", fmt::join(words, " "));
    if (text != "usual") {
      texts.push_back(text);
      continue;
    }
    const auto usual = UsualMaps(prepared.base.name);
    if (usual.empty()) {
      Finding finding;
      finding.file = "--map usual";
      finding.message = prepared.base.name + " has no usual maps";
      finding.hint = "give ranges, e.g. --map platform.x=-0.1:0.1:61,platform.y=-0.1:0.1:61";
      diagnostics->Add(std::move(finding));
    }
    texts.insert(texts.end(), usual.begin(), usual.end());
  }
  MapFolder folder;
  for (const std::string& text : texts) {
    const auto map = ParseMap(text, prepared, diagnostics);
    if (!map) continue;
    const MapResult result = ComputeMap(prepared, *map, progress, arguments.jobs);
    folder.text += MapText(*map, result, arguments.indices);
    folder.whole = folder.whole && result.lost_rows == 0;
    for (auto& file : MapFiles(*map, result, prepared.base.name, arguments.indices, diagnostics)) {
      folder.files.push_back(std::move(file));
    }
    if (diagnostics->has_errors()) break;
  }
  return folder;
}

int Stiffness(const StiffnessArguments& arguments) {
  Diagnostics diagnostics;
  const auto prepared = PrepareRequest(arguments, &diagnostics);
  SayText(stderr, diagnostics.Text());
  if (!prepared) return 2;
  ProgressLine progress_line(true);
  ProgressFunction progress;
  if (progress_line.active()) {
    progress = [&](const std::string& stage, double fraction) {
      progress_line.Show(stage, fraction);
    };
  }
  StiffnessRun run = RunStiffness(*prepared, progress);
  run.report.command = CommandOf(arguments);
  Diagnostics map_diagnostics;
  const MapFolder maps = DrawMaps(arguments, *prepared, progress, &map_diagnostics);
  progress_line.Clear();
  SayText(stderr, map_diagnostics.Text());
  if (map_diagnostics.has_errors()) return 2;
  const bool json = arguments.format == "json";
  const TableOptions table{.color = WantsColor(arguments.json.text()),
                           .verbose = arguments.verbose,
                           .columns = TerminalColumns(arguments.json.text())};
  if (json) {
    fmt::print("{}", ToJson(run.report));
  } else {
    SayText(arguments.json.text(), ToTable(run.report, table));
  }
  if (!maps.text.empty()) Say(json ? stderr : arguments.json.text(), "\n{}", maps.text);
  if (!arguments.out.empty() || !maps.files.empty()) {
    const std::string trouble = WriteFolder(arguments, run, maps.files);
    if (!trouble.empty()) return NotWritten(trouble, "choose another folder with --out");
  }
  const int exit_code = WorseExit(run.report.exit_code, maps.whole ? 0 : 3);
  return WorseExit(exit_code,
                   arguments.json.Write(ToJson(run.report), {{prepared->base.file, ""}}));
}

}  // namespace

void AddStiffnessCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<StiffnessArguments>();
  arguments->jobs = AllCores();
  CLI::App* stiffness = app->add_subcommand(
      "stiffness", "Stiffness at a pose by three computations, weak directions, maps");
  stiffness
      ->add_option("model", arguments->model,
                   "model with elastic parts: a name (models/NAME/elastic.yaml) or a file")
      ->required();
  stiffness->add_option("--at", arguments->at,
                        "NAME=VALUE …: pose by drives, outputs (platform.x, platform.yaw_deg) and "
                        "parameters; what is left out is as in the usual pose");
  stiffness->add_option("--output", arguments->output, "frame whose stiffness is computed");
  stiffness->add_option("--set", arguments->set, "PARAMETER=NUMBER (repeatable)")
      ->allow_extra_args(false);
  stiffness->add_option("--closed-form", arguments->closed_form,
                        "formulation, e.g. as_printed: the paper's own");
  stiffness
      ->add_option("--loads", arguments->loads.count,
                   "displacements under this many random wrenches")
      ->check(CLI::Range(1, 10000));
  stiffness->add_option("--seed", arguments->loads.seed, "of the random wrenches")
      ->check(WholeNumber())
      ->capture_default_str();
  const CLI::Range largest(0.0, 1e12);
  stiffness->add_option("--force-max", arguments->loads.force_max, "of the random wrenches [N]")
      ->check(largest)
      ->capture_default_str();
  stiffness->add_option("--moment-max", arguments->loads.moment_max, "of the random wrenches [N m]")
      ->check(largest)
      ->capture_default_str();
  stiffness->add_option(
      "--map", arguments->maps,
      "map over two coordinates: NAME=LOW:HIGH:POINTS twice (default: the ranges of the "
      "mechanism's usual map) and others NAME=VALUE; 'usual' draws all usual maps (repeatable)");
  stiffness->add_option("--index", arguments->indices, "index to draw on maps (repeatable)")
      ->allow_extra_args(false);
  stiffness->add_option("--jobs", arguments->jobs, "processes at once for maps")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  stiffness->add_option("--out", arguments->out, "folder for results (maps: default out)");
  stiffness->add_option("--format", arguments->format, "of what is printed")
      ->check(OneOf({"text", "json"}))
      ->capture_default_str();
  arguments->json.AddTo(stiffness);
  stiffness->add_flag("--no-simulation", arguments->no_simulation, "leave MuJoCo out");
  stiffness->add_flag("-v,--verbose", arguments->verbose, "also what could not be compared");
  SetFooter(stiffness,
            {"stiffness scara_robot",
             "stiffness scara_robot --at platform.x_mm=-60 platform.yaw_deg=10 --out out",
             "stiffness scara_robot --map z=-0.1 phi=0 --map z=-0.23 phi_deg=45",
             "stiffness scara_robot --map usual --index kappa_f",
             "stiffness cabin_robot --at d5=-0.3 --loads 50"},
            "0 the computations agree, 1 they do not, 2 bad input, 3 could not run");
  stiffness->callback([arguments, exit_code] { *exit_code = Stiffness(*arguments); });
}

}  // namespace mbv
