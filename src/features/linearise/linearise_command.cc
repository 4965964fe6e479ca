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

namespace mbv {
namespace {

struct LinearArguments {
  std::string model, out = "out";
  std::vector<std::string> set, at, rates, forces;
  RobotArguments options;
  LinearSettings settings;
  bool quiet = false;
  JsonOption json;
};

int LineariseModel(LinearArguments arguments) {
  const InputWatch inputs;
  std::optional<LoadResult> loaded =
      LoadModelOrRefuse(arguments.model, arguments.set, arguments.options);
  if (!loaded) return 2;
  const Mechanism& mechanism = *loaded->mechanism;
  LinearSettings& settings = arguments.settings;
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
      arguments.json.Text(nlohmann::ordered_json::parse(LinearisationJson(result, mechanism.name)));
  OutputFolder folder(arguments.out, mechanism.name + "/linearise");
  if (const std::string trouble = folder.WriteAll(
          {{"linearise.html", LinearisationPage(result, mechanism)}, {"linearise.json", json}});
      !trouble.empty()) {
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
      ->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file")
      ->required();
  LinearSettings& settings = arguments->settings;
  const auto list = [&](const char* name, std::vector<std::string>* values, const char* help) {
    linearise->add_option(name, *values, help)->delimiter(',')->allow_extra_args(false);
  };
  list("--coordinates", &settings.coordinates,
       "that the state is stated in, as many as degrees of freedom; otherwise drives first");
  list("--at", &arguments->at, "NAME=VALUE (NAME_mm, NAME_deg); others are at home");
  list("--rate", &arguments->rates, "NAME=VALUE per second (NAME_mm, NAME_deg); others rest");
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
  linearise->add_option("--set", arguments->set, "PARAMETER=VALUE of the model (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(linearise, &arguments->options);
  linearise->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  linearise->add_flag("-q,--quiet", arguments->quiet, "the verdict alone");
  arguments->json.AddTo(linearise);
  SetFooter(linearise,
            {"linearise stewart --servos --set servo_stiffness=1e6",
             "linearise spring_cart --no-forces --equilibrium",
             "linearise four_bar --at crank.drive_deg=30 --check mine.json"},
            "0 all ways to the derivatives agree, 1 they differ, 2 bad input, 3 results could not "
            "be written, 4 internal error");
  linearise->callback([arguments, exit_code] { *exit_code = LineariseModel(*arguments); });
}

}  // namespace mbv
