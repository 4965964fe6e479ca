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
#include "scenario/motion_reader.h"

namespace mbv {
namespace {

struct StiffnessArguments {
  std::string model, output, out, format = "text", seed, closed_form;
  std::vector<std::string> at, set, indices;
  std::vector<std::vector<std::string>> maps;
  int loads = 0, jobs = 1;
  double force_max = 1000.0, moment_max = 1.0;
  bool no_simulation = false, verbose = false;
  JsonOption json;
};

// Coordinates that --at leaves out keep their values of the usual pose, if it is stated by the same
// coordinates.
void FillPose(const Mechanism& mechanism, ScenarioOptions* options) {
  PoseValues rest = ExamplePose(mechanism.name);
  if (rest.empty()) rest = HomePose(mechanism);
  const std::vector<std::string> coordinates = CoordinateNames(mechanism);
  bool any = false;
  for (const auto& [key, value] : options->set) {
    if (!key.starts_with("pose.")) continue;
    const std::string name = SplitUnit(key.substr(5)).name;
    if (std::find(coordinates.begin(), coordinates.end(), name) == coordinates.end()) continue;
    any = true;
    if (rest.erase(name) == 0) return;
  }
  if (!any) return;
  for (const auto& [name, value] : rest) {
    options->set.emplace_back("pose." + name, fmt::format("{:.17g}", value));
  }
}

// What was given as an argument of this command stands in the scenario as a key.
Diagnostics AtArguments(const Diagnostics& diagnostics) {
  Diagnostics placed;
  for (Finding finding : diagnostics.findings()) {
    const auto& [key, value] = finding.set;
    for (const auto& [above, option] :
         {std::pair<std::string, std::string>{"pose.", "--at "}, {"parameters.", "--set "}}) {
      if (key.starts_with(above)) finding.file = option + key.substr(above.size()) + "=" + value;
    }
    if (key == "output") finding.file = "--output " + value;
    if (key == "mechanism") finding.file = value;
    placed.Add(std::move(finding));
  }
  return placed;
}

// The request as a scenario, so that it is checked and run like one.
std::optional<PreparedStiffness> PrepareRequest(const StiffnessArguments& arguments,
                                                Diagnostics* diagnostics) {
  ScenarioOptions options;
  options.set.emplace_back("mechanism", "\"" + arguments.model + "\"");
  if (!ReadAssignments(arguments.at, "--at", "platform.x=-0.05", &options.set, "pose.") ||
      !ReadAssignments(arguments.set, "--set", "K_act=10000", &options.set, "parameters.")) {
    return {};
  }
  if (!arguments.output.empty()) options.set.emplace_back("output", arguments.output);
  if (arguments.no_simulation) options.set.emplace_back("simulation", "off");
  if (!arguments.closed_form.empty()) {
    options.set.emplace_back("analytic.model", arguments.closed_form);
  }
  if (arguments.loads > 0) {
    options.set.emplace_back("loads.random.count", std::to_string(arguments.loads));
    options.set.emplace_back("loads.random.force_max", fmt::format("{:.17g}", arguments.force_max));
    options.set.emplace_back("loads.random.moment_max",
                             fmt::format("{:.17g}", arguments.moment_max));
    if (!arguments.seed.empty()) options.set.emplace_back("loads.random.seed", arguments.seed);
  }
  constexpr const char* kText = "kind: stiffness\n";
  const StiffnessScenarioResult home =
      LoadStiffnessScenarioText(kText, "mbverify stiffness", {.set = {options.set.front()}});
  if (home.mechanism) FillPose(*home.mechanism, &options);
  StiffnessScenarioResult loaded = LoadStiffnessScenarioText(kText, "mbverify stiffness", options);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario) return {};
  auto prepared =
      PrepareStiffness(*std::move(loaded.scenario), *std::move(loaded.mechanism), diagnostics);
  if (prepared) prepared->scenario.file.clear();  // there is none
  return prepared;
}

std::string CommandOf(const StiffnessArguments& arguments) {
  std::string command = "mbverify stiffness " + arguments.model;
  for (const std::string& at : arguments.at) command += " --at " + at;
  for (const std::string& set : arguments.set) command += " --set " + set;
  if (!arguments.output.empty()) command += " --output " + arguments.output;
  if (!arguments.closed_form.empty()) command += " --closed-form " + arguments.closed_form;
  if (arguments.loads > 0) command += fmt::format(" --loads {}", arguments.loads);
  if (!arguments.seed.empty()) command += " --seed " + arguments.seed;
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
  SayText(stderr, AtArguments(diagnostics).Text());
  if (!prepared) return 2;
  ProgressLine progress_line(true);
  ProgressFunction progress;
  if (progress_line.active()) {
    progress = [&](const std::string& stage, double fraction) {
      progress_line.Show(stage, fraction);
    };
  }
  StiffnessRun run = RunStiffness(*prepared, progress);
  run.report.scenario = "stiffness_at_pose";
  run.report.command = CommandOf(arguments);
  Diagnostics map_diagnostics;
  const MapFolder maps = DrawMaps(arguments, *prepared, progress, &map_diagnostics);
  progress_line.Clear();
  SayText(stderr, map_diagnostics.Text());
  if (map_diagnostics.has_errors()) return 2;
  const bool json = arguments.format == "json";
  const TableOptions table{.color = WantsColor(arguments.json.text()),
                           .verbose = arguments.verbose};
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
  stiffness->add_option("--loads", arguments->loads, "displacements under so many random wrenches")
      ->check(CLI::Range(1, 10000));
  stiffness->add_option("--seed", arguments->seed, "of the random wrenches");
  stiffness->add_option("--force-max", arguments->force_max, "of the random wrenches [N]")
      ->capture_default_str();
  stiffness->add_option("--moment-max", arguments->moment_max, "of the random wrenches [N m]")
      ->capture_default_str();
  stiffness->add_option(
      "--map", arguments->maps,
      "map over two coordinates: NAME=LOW:HIGH:POINTS twice (default: the ranges of the "
      "mechanism's usual map) and others NAME=VALUE; 'usual' draws all usual maps "
      "(repeatable)");
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
