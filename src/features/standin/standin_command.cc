// mbverify standin
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/standin/standin_export.h"
#include "features/standin/standin_report.h"
#include "model_file/load_model.h"
#include "model_file/yaml/units.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

struct StandinArguments {
  std::string model, out = "out";
  std::vector<std::string> joints, ranges, set;
  RobotArguments options;
  StandinSettings settings;
  bool quiet = false, exports = false;
  JsonOption json;
};

// "pitch_deg=-50:30".
bool ReadRange(const std::string& text, const Mechanism& mechanism,
               const std::vector<std::string>& joints, StandinSettings* settings) {
  const auto assigned = SplitSet(text);
  const size_t colon = assigned ? assigned->second.find(':') : std::string::npos;
  if (colon == std::string::npos) {
    (void)Refuse("--range " + text + " is not JOINT=LOW:HIGH", "for instance pitch_deg=-50:30");
    return false;
  }
  const NameInUnit named =
      SplitUnit(assigned->first, [&](const std::string& name) { return Contains(joints, name); });
  const auto number = [&](const std::string& word) {
    char* end = nullptr;
    const double value = std::strtod(word.c_str(), &end);
    return word.empty() || *end != '\0' || !std::isfinite(value) ? kNan : named.unit.to_si(value);
  };
  const StandinRange range{.joint = named.name,
                           .low = number(assigned->second.substr(0, colon)),
                           .high = number(assigned->second.substr(colon + 1))};
  if (std::isnan(range.low) || std::isnan(range.high)) {
    (void)Refuse("--range " + text + ": two numbers are needed", "for instance pitch_deg=-50:30");
    return false;
  }
  for (const NamedCoordinate& joint : NamedJointCoordinates(mechanism)) {
    const std::string unit = CoordinateUnit(mechanism, joint.coordinate);
    if (joint.name != range.joint || named.unit.Suits(unit)) continue;
    (void)Refuse("--range " + text + ": the joint's coordinate is in " + unit,
                 unit == "rad" ? "NAME=… in rad or NAME_deg=…" : "NAME=… in m or NAME_mm=…");
    return false;
  }
  for (const StandinRange& other : settings->ranges) {
    if (other.joint != range.joint) continue;
    (void)Refuse("--range of '" + range.joint + "' is stated twice", "each joint once");
    return false;
  }
  settings->ranges.push_back(range);
  return true;
}

int Standin(const StandinArguments& arguments) {
  const auto file = FindModelOrRefuse(arguments.model);
  if (!file) return 2;
  LoadOptions options;
  if (!ReadParameters(arguments.set, &options)) return 2;
  if (!IsRobotFile(*file) && arguments.options.any()) return RefuseRobotOptions();
  if (!ReadRobotOptions(arguments.options, &options)) return 2;
  const InputWatch inputs;
  LoadResult loaded = LoadRobot(*file, options);
  SayText(stderr, loaded.diagnostics.Text());
  if (!loaded.mechanism) return 2;
  AddMotorsOfJoints(loaded.motors_of_joints, &*loaded.mechanism);
  const Mechanism& mechanism = *loaded.mechanism;
  StandinSettings settings = arguments.settings;
  for (const std::string& range : arguments.ranges) {
    if (!ReadRange(range, mechanism, arguments.joints, &settings)) return 2;
  }
  ProgressLine line(!arguments.quiet);
  std::function<void(double)> progress;
  if (line.active()) {
    progress = [&](double share) { line.Show(mechanism.name + ": poses", share); };
  }
  const StandinResult result = ComputeStandin(mechanism, arguments.joints, settings, progress);
  line.Clear();
  SayText(stderr, result.diagnostics.Text());
  if (result.diagnostics.has_errors()) return 2;
  std::FILE* to = arguments.json.text();
  if (arguments.quiet) {
    for (const std::string& sentence : AdviceOf(result)) Say(to, "{}\n", sentence);
  } else {
    SayText(to, ToText(result, {.color = WantsColor(to), .columns = TerminalColumns(to)}));
  }
  nlohmann::ordered_json document = ToJson(result, mechanism.name);
  std::vector<std::pair<std::string, std::string>> files = {
      {"standin.html", StandinPage(result, mechanism.name)}, {"standin.csv", StandinCsv(result)}};
  bool agrees = true;
  if (arguments.exports) {
    const StandinExport made =
        ExportStandin(mechanism, result, mechanism.name + "_standin", progress);
    line.Clear();
    SayText(stderr, made.code.diagnostics.Text());
    if (made.code.diagnostics.has_errors()) return 2;
    SayText(to, ToText(made));
    document["exports"] = ToJson(made, mechanism.name);
    files.insert(files.end(), made.files.begin(), made.files.end());
    agrees = made.agrees();
  }
  const std::string json = arguments.json.Text(document);
  files.emplace_back("standin.json", json);
  OutputFolder folder(arguments.out, mechanism.name + "/standin");
  if (const std::string trouble = folder.WriteAll(files); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  if (!arguments.quiet) Say(stderr, "results in {}\n", folder.target().string());
  const int written = arguments.json.Write(json, inputs.files());
  return written != 0 || agrees ? written : 1;
}

}  // namespace

void AddStandinCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<StandinArguments>();
  CLI::App* standin = app->add_subcommand(
      "standin", "What a serial model of joints that rods drive costs: ratios, inertia, torques");
  standin
      ->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file")
      ->required();
  standin
      ->add_option("--joints", arguments->joints,
                   "joints of the serial model, as many as drives move them: pitch,roll")
      ->delimiter(',')
      ->allow_extra_args(false);
  standin
      ->add_option("--range", arguments->ranges,
                   "NAME_deg=LOW:HIGH (NAME= in rad or m, NAME_mm=; repeatable); otherwise the "
                   "joint's limits or home ± 30°")
      ->allow_extra_args(false);
  standin
      ->add_option("--resolution", arguments->settings.resolution,
                   "poses along each joint; otherwise 201, 41, 11 or 5 by the number of joints")
      ->check(CLI::Range(2, 100000));
  standin
      ->add_option("--amplitude", arguments->settings.amplitude, "of the motion, by half the range")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  standin->add_option("--frequency", arguments->settings.frequency_hz, "of the motion [Hz]")
      ->check(Positive())
      ->capture_default_str();
  standin->add_option("--seed", arguments->settings.seed, "of the states that are drawn")
      ->check(WholeNumber())
      ->capture_default_str();
  standin->add_option("--set", arguments->set, "PARAMETER=VALUE of the model (repeatable)")
      ->allow_extra_args(false);
  standin->add_flag("--export", arguments->exports,
                    "also writes what replaces the loop: C99, Python, a lookup table, the serial "
                    "robot as MJCF and URDF, each judged");
  AddRobotOptions(standin, &arguments->options);
  standin->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  standin->add_flag("-q,--quiet", arguments->quiet, "the sentences alone");
  arguments->json.AddTo(standin);
  SetFooter(standin,
            {"standin my_robot.urdf --joints ankle_pitch,ankle_roll",
             "standin my_robot.xml --joints knee --range knee_deg=0:110 --frequency 2"},
            "0 computed, 1 an export differs from the full loop, 2 bad input, 3 results could not "
            "be written, 4 internal error");
  standin->callback([arguments, exit_code] { *exit_code = Standin(*arguments); });
}

}  // namespace mbv
