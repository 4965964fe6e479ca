// mbverify standin
#include <fmt/format.h>

#include <cmath>
#include <memory>

#include "base/files.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/standin/standin.h"
#include "kinematics/constraints.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "reference/reference.h"
#include "scenario/find_model.h"
#include "scenario/load_scenario.h"
#include "scenario/tables/motion_table.h"
#include "scenario/tables/text.h"

namespace mbv {
namespace {

struct StandinArguments {
  std::string model, out = "out";
  std::vector<std::string> joints, ranges, set, motions;
  RobotArguments options;
  StandinSettings settings;
  bool quiet = false, exports = false;
  JsonOption json;
};

constexpr size_t kMostSamples = 2000;  // of a motion

// Times of at most kMostSamples samples, `step_s` or a multiple of it apart.
std::vector<double> SampleTimes(double from_s, double to_s, double step_s) {
  const double steps = std::floor((to_s - from_s) / step_s * (1.0 + 1e-12));
  const double stride = std::max(1.0, std::ceil(steps / static_cast<double>(kMostSamples)));
  std::vector<double> times;
  for (double k = 0.0; k <= steps; k += stride) times.push_back(from_s + k * step_s);
  return times;
}

// A column of a table (docs/how-to/standin.md) as a spline: NAME or NAME.position, and _deg and the
// like behind it.
std::optional<MotionTable> TableColumnOf(const std::string& file, const TableText& cut,
                                         const NamedCoordinate& joint, const Mechanism& mechanism,
                                         Diagnostics* diagnostics) {
  std::vector<std::string> headings;
  for (const TableHeading& heading : cut.headings) headings.push_back(heading.name);
  std::string keys;
  for (const char* ending : {"", ".position", "_position", "_pos"}) {
    for (const std::string unit : {"", "deg", "rad", "mm", "m"}) {
      const std::string column = joint.name + ending + (unit.empty() ? "" : "_" + unit);
      if (!keys.empty() || !Contains(headings, column)) continue;
      keys = "column: " + QuotedYaml(column) + (unit.empty() ? "" : ", unit: " + unit);
    }
  }
  if (keys.empty()) {
    diagnostics->AddError(file, "has no column for the position of '" + joint.name + "'",
                          DidYouMean(joint.name, headings, "its columns: " + Joined(headings, 8)));
    return std::nullopt;
  }
  YamlReader yaml(file);
  const YamlNodePtr node =
      yaml.Parse(fmt::format("{{csv: {}, {}, smoothing: auto}}",
                             QuotedYaml(std::filesystem::path(file).filename().string()), keys));
  Scope scope;
  ValueReader values(&yaml, &scope);
  auto table = LoadMotionTable(&values, *node, joint.name,
                               {joint.name, CoordinateUnit(mechanism, joint.coordinate), true},
                               mechanism, diagnostics);
  diagnostics->Append(yaml.diagnostics());
  return table;
}

std::optional<StandinMotion> TableMotion(const std::string& file, const Mechanism& mechanism,
                                         const std::vector<NamedCoordinate>& joints,
                                         Diagnostics* diagnostics) {
  const auto content = ReadWholeFile(file);
  if (!content) {
    diagnostics->AddError(file, "cannot be read", "--motion SCENARIO or --motion TABLE.csv");
    return std::nullopt;
  }
  const auto cut = CutTable(*content, file, {}, diagnostics);
  if (!cut) return std::nullopt;
  std::vector<MotionTable> tables;
  for (const NamedCoordinate& joint : joints) {
    if (auto table = TableColumnOf(file, *cut, joint, mechanism, diagnostics)) {
      tables.push_back(*std::move(table));
    }
  }
  if (tables.size() != joints.size()) return std::nullopt;
  const double from_s = tables[0].from_s, to_s = tables[0].to_s;
  StandinMotion motion{
      .name = "along " + std::filesystem::path(file).filename().string(),
      .text = fmt::format("{} rows over {:.4g} s, the joints alone", tables[0].rows, to_s - from_s),
      .q = {},
      .v = {}};
  for (const MotionTable& table : tables) {
    if (!std::isfinite(table.cutoff_hz)) continue;
    motion.text += fmt::format(", {} smoothed above {:.3g} Hz", table.name, table.cutoff_hz);
  }
  const double step_s = (to_s - from_s) / static_cast<double>(tables[0].rows - 1);
  for (const double t : SampleTimes(from_s, to_s, step_s)) {
    for (auto* list : {&motion.q, &motion.v, &motion.a}) list->emplace_back(joints.size());
    for (size_t k = 0; k < joints.size(); ++k) {
      const Jet jet = Evaluate(*tables[k].spline, t);
      const auto at = static_cast<Eigen::Index>(k);
      motion.q.back()[at] = jet.value;
      motion.v.back()[at] = jet.rate;
      motion.a.back()[at] = jet.acceleration;
    }
  }
  return motion;
}

// The joints' motion in a scenario, by the reference.
std::optional<StandinMotion> ScenarioMotion(const std::string& file, const Mechanism& robot,
                                            const std::vector<NamedCoordinate>& joints,
                                            Diagnostics* diagnostics) {
  ScenarioResult loaded = LoadScenario(file);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario || !loaded.mechanism) return std::nullopt;
  const auto refuse = [&](std::string message, std::string hint) {
    diagnostics->AddError(file, std::move(message), std::move(hint));
    return std::nullopt;
  };
  const Mechanism& mechanism = *loaded.mechanism;
  const Motion& motion = loaded.scenario->motion;
  if (motion.free()) {
    return refuse("its motion follows from forces",
                  "give the joints' positions as a table: --motion TABLE.csv");
  }
  const std::vector<NamedCoordinate> all = NamedJointCoordinates(mechanism);
  std::vector<Coordinate> coordinates;
  for (const NamedCoordinate& joint : joints) {
    const auto at = std::ranges::find(all, joint.name, &NamedCoordinate::name);
    if (at == all.end() ||
        CoordinateUnit(mechanism, at->coordinate) != CoordinateUnit(robot, joint.coordinate)) {
      return refuse("its model has no joint coordinate '" + joint.name + "'",
                    "a scenario of this robot; there are: " + Joined(NamesOf(all), 8));
    }
    coordinates.push_back(at->coordinate);
  }
  StandinMotion result{.name = "along " + loaded.scenario->name, .q = {}, .v = {}};
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  std::vector<double> near;
  near.reserve(coordinates.size());
  for (const Coordinate& coordinate : coordinates) near.push_back(HomeValue(mechanism, coordinate));
  for (const double t : SampleTimes(0.0, motion.duration_s, motion.sample_s)) {
    EvaluateMotion(motion, t, &command);
    if (const RunSummary moved = solver.Kinematics(command, &sample); !moved.ok()) {
      return refuse(fmt::format("at t = {:.4g} s: {}", t, moved.message), "");
    }
    for (auto* list : {&result.q, &result.v, &result.a}) list->emplace_back(coordinates.size());
    for (size_t k = 0; k < coordinates.size(); ++k) {
      const ScalarRow row = CoordinateRow(mechanism, coordinates[k], sample.states, near[k]);
      const auto at = static_cast<Eigen::Index>(k);
      near[k] = result.q.back()[at] = row.value;
      result.v.back()[at] = RateOf(row, sample.states.V_WB);
      result.a.back()[at] = RateOf(row, sample.states.A_WB) + row.bias;
    }
  }
  result.text = fmt::format("the joints' motion in {} over {:.4g} s, the joints alone", Shown(file),
                            motion.duration_s);
  return result;
}

// False after a finding.
bool ReadMotions(const std::vector<std::string>& motions, const std::vector<std::string>& names,
                 const Mechanism& robot, StandinSettings* settings) {
  std::vector<NamedCoordinate> joints;
  const std::vector<NamedCoordinate> all = NamedJointCoordinates(robot);
  for (const std::string& name : names) {
    const auto at = std::ranges::find(all, name, &NamedCoordinate::name);
    if (at == all.end()) return true;  // a finding of FindTransmission()
    joints.push_back(*at);
  }
  Diagnostics diagnostics;
  for (const std::string& text : motions) {
    const std::string ending = std::filesystem::path(text).extension().string();
    const bool table = ending == ".csv" || ending == ".tsv" || ending == ".txt" || ending == ".dat";
    auto motion = table ? TableMotion(text, robot, joints, &diagnostics)
                        : ScenarioMotion(FindScenario(text), robot, joints, &diagnostics);
    if (motion) settings->motions.push_back(*std::move(motion));
  }
  SayText(stderr, diagnostics.Text());
  return !diagnostics.has_errors();
}

int Standin(const StandinArguments& arguments) {
  const InputWatch inputs;
  std::optional<LoadResult> loaded =
      LoadModelOrRefuse(arguments.model, arguments.set, arguments.options);
  if (!loaded) return 2;
  AddMotorsOfJoints(loaded->motors_of_joints, &*loaded->mechanism);
  const Mechanism& mechanism = *loaded->mechanism;
  StandinSettings settings = arguments.settings;
  const std::vector<NamedCoordinate> known = NamedJointCoordinates(mechanism);
  const auto ranges = ReadNamedRanges(
      arguments.ranges, arguments.joints, [&](const std::string& name) -> std::string {
        const auto at = std::ranges::find(known, name, &NamedCoordinate::name);
        return at == known.end() ? "" : CoordinateUnit(mechanism, at->coordinate);
      });
  if (!ranges) return 2;
  for (const NamedRange& range : *ranges) {
    settings.ranges.push_back({range.name, range.low, range.high});
  }
  if (!ReadMotions(arguments.motions, arguments.joints, mechanism, &settings)) return 2;
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
      ->add_option("--motion", arguments->motions,
                   "scenario or table (.csv) whose motion of the joints is compared along, too "
                   "(repeatable)")
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
             "standin my_robot.xml --joints knee --range knee_deg=0:110 --frequency 2",
             "standin my_robot.urdf --joints ankle_pitch,ankle_roll --motion walk.csv",
             "standin my_robot.urdf --joints ankle_pitch,ankle_roll --export"},
            "0 computed, 1 an export differs from the full loop, 2 bad input, 3 results could not "
            "be written, 4 internal error");
  standin->callback([arguments, exit_code] { *exit_code = Standin(*arguments); });
}

}  // namespace mbv
