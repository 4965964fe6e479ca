// mbverify linearise
#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/linearise/linearise.h"
#include "model_file/load_model.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"

namespace mbv {
namespace {

struct LinearArguments {
  std::string model, out = "out";
  std::vector<std::string> set, at, rates, forces;
  RobotArguments options;
  LinearSettings settings;
  std::optional<double> time_s;
  std::vector<std::string> data;
  bool quiet = false;
  JsonOption json;
};

// The mechanism, and of a scenario its motion.
struct Subject {
  std::optional<Mechanism> mechanism;
  std::optional<Scenario> scenario;
};

Subject LoadSubject(const LinearArguments& arguments) {
  Subject subject;
  if (!arguments.time_s) {
    if (auto loaded = LoadModelOrRefuse(arguments.model, arguments.set, arguments.options)) {
      subject.mechanism = std::move(loaded->mechanism);
    }
    return subject;
  }
  ScenarioOptions options;
  if (!ReadAssignments(arguments.set, "--set", "motion.duration_s=2", &options.set)) return subject;
  ScenarioResult loaded = LoadScenario(FindScenario(arguments.model), options);
  SayText(stderr, loaded.diagnostics.Text());
  if (loaded.diagnostics.has_errors() || !loaded.scenario) return subject;
  subject.mechanism = std::move(loaded.mechanism), subject.scenario = std::move(loaded.scenario);
  return subject;
}

int LineariseModel(LinearArguments arguments) {
  const InputWatch inputs;
  if (arguments.time_s && !(arguments.at.empty() && arguments.rates.empty())) {
    return Refuse("--time: the scenario's motion is the state", "without --at and --rate");
  }
  const Subject subject = LoadSubject(arguments);
  if (!subject.mechanism) return 2;
  const Mechanism& mechanism = *subject.mechanism;
  LinearSettings& settings = arguments.settings;
  if (subject.scenario) {
    settings.motion = &subject.scenario->motion, settings.time_s = *arguments.time_s;
  }
  const std::vector<NamedCoordinate> known = NamedMotionCoordinates(mechanism);
  const auto unit = [&](const std::string& name) {
    return CoordinateUnit(mechanism,
                          std::ranges::find(known, name, &NamedCoordinate::name)->coordinate);
  };
  const auto at = ReadNamedValues("--at", arguments.at, NamesOf(known), unit);
  if (!at) return 2;
  const auto rates = ReadNamedValues("--rate", arguments.rates, NamesOf(known), unit);
  if (!rates) return 2;
  const auto forces = ReadNamedValues("--force", arguments.forces, NamesOf(mechanism.drives),
                                      [](const std::string&) { return std::string(); });
  if (!forces) return 2;
  settings.at = *at, settings.rates = *rates, settings.forces = *forces;
  const Linearisation result = Linearise(mechanism, settings);
  SayText(stderr, result.diagnostics.Text());
  if (result.diagnostics.has_errors()) return 2;
  std::FILE* to = arguments.json.text();
  const std::string text = LinearisationText(result, WantsColor(to), TerminalColumns(to));
  SayText(to, arguments.quiet ? text.substr(0, text.find('\n') + 1) : text);
  const std::string json =
      arguments.json.Text(nlohmann::ordered_json::parse(LinearisationJson(result, mechanism)));
  std::vector<std::pair<std::string, std::string>> files = {
      {"linearise.html", LinearisationPage(result, mechanism)}, {"linearise.json", json}};
  std::string trouble;
  if (!arguments.data.empty()) {
    files.emplace_back("linearise.mat",
                       MatBytes(LinearisationMatrices(result, mechanism), &trouble));
  }
  OutputFolder folder(arguments.out, mechanism.name + "/linearise");
  if (trouble.empty()) trouble = folder.WriteAll(files);
  if (!trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  if (!arguments.quiet) Say(stderr, "results in {}\n", folder.target().string());
  const int written = arguments.json.Write(json, inputs.files());
  return written != 0 ? written : result.agrees() ? 0 : 1;
}

}  // namespace

void AddLineariseCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<LinearArguments>();
  CLI::App* linearise = app->add_subcommand(
      "linearise", "derivatives of a mechanism about a state: A, B, frequencies, modes");
  linearise
      ->add_option(
          "model", arguments->model,
          "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file; with --time a scenario")
      ->required();
  LinearSettings& settings = arguments->settings;
  const auto list = [&](const char* name, std::vector<std::string>* values, const char* help) {
    linearise->add_option(name, *values, help)->delimiter(',')->allow_extra_args(false);
  };
  list("--coordinates", &settings.coordinates,
       "that the state is stated in, as many as degrees of freedom; otherwise drives first");
  list("--at", &arguments->at, "NAME=VALUE (NAME_mm, NAME_deg); others are at home");
  list("--rate", &arguments->rates, "NAME=VALUE per second (NAME_mm, NAME_deg); others rest");
  linearise->add_option("--time", arguments->time_s,
                        "the state at this instant of a scenario's motion, with its loads [s]");
  list("--force", &arguments->forces,
       "DRIVE=VALUE in N or N m, of others none; otherwise drives hold the state");
  linearise->add_flag("--no-forces", settings.no_forces, "drives exert none");
  linearise->add_flag("--equilibrium", settings.equilibrium,
                      "searches an equilibrium near the state under these forces");
  linearise->add_flag("--servos", settings.servos,
                      "drives hold their place with the stiffness that the model states");
  linearise->add_flag("--mujoco", settings.mujoco,
                      "MuJoCo's own derivative at rest (mjd_transitionFD) beside ours");
  linearise->add_option("--check", settings.check,
                        "a JSON file with user-defined derivatives to be judged: f_q, f_v, f_a, A, "
                        "B");
  linearise->add_option("--check-limit", settings.check_limit, "of their largest entries")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  linearise->add_option("--engine", settings.program,
                        "COMMAND: a program that is asked for the same, see "
                        "docs/how-to/linearise.md");
  linearise
      ->add_option("--data", arguments->data,
                   "matrices also as linearise.mat, for MATLAB, Octave, Python …")
      ->delimiter(',')
      ->check(OneOf({"mat"}));
  linearise
      ->add_option("--set", arguments->set,
                   "PARAMETER=VALUE of the model, KEY=VALUE of the scenario (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(linearise, &arguments->options);
  linearise->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  linearise->add_flag("-q,--quiet", arguments->quiet, "the verdict alone");
  arguments->json.AddTo(linearise);
  SetFooter(linearise,
            {"linearise stewart --servos --set servo_stiffness=1e6",
             "linearise spring_cart --no-forces --equilibrium",
             "linearise spr_tripod/tool_load --time 0.4 --data mat",
             "linearise four_bar --at motor_deg=30 --check mine.json"},
            "0 all ways to the derivatives agree, 1 they differ, 2 bad input, 3 results could not "
            "be written, 4 internal error");
  linearise->callback([arguments, exit_code] { *exit_code = LineariseModel(*arguments); });
}

}  // namespace mbv
