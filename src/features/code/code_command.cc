// mbverify code
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/code/code.h"
#include "model_file/load_model.h"
#include "model_file/yaml/units.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

struct CodeArguments {
  std::string model, out = "out";
  std::vector<std::string> coordinates, ranges, set;
  RobotArguments options;
  CodeSettings settings;
  bool quiet = false, no_test = false;
  JsonOption json;
};

std::string JudgementText(const CodeJudgement& judgement) {
  if (!judgement.not_judged.empty()) {
    std::string text =
        fmt::format("{}: not judged: {}\n", judgement.language, judgement.not_judged);
    for (const std::string& line : judgement.warnings) text += "  " + OneLine(line) + "\n";
    return text;
  }
  std::string text = fmt::format("{}: {} at {} states", judgement.language,
                                 judgement.agrees() ? "agrees" : "DIFFERS", judgement.states);
  const char* before = ": ";
  const auto add = [&](const char* what, double difference) {
    if (std::isnan(difference)) return;
    text += fmt::format("{}{} {:.2g}", before, what, difference);
    before = ", ";
  };
  add("positions", judgement.position);
  add("rates and accelerations", judgement.jacobian);
  add("forces", judgement.force);
  add("forces along the coordinates", judgement.along);
  add("outputs", judgement.output);
  text += fmt::format(" (limit {:.0e} of the largest value)", CodeJudgement::kLimit);
  if (!std::isnan(judgement.nanoseconds)) {
    text += fmt::format("; {:.3g} µs a state", 1e-3 * judgement.nanoseconds);
  }
  text += "\n";
  if (judgement.back < 1.0) {
    text += fmt::format(
        "  the way back from the actuators' positions ends at the same coordinates in "
        "{:.1f} % of the states, else in another assembly or nowhere\n",
        100.0 * judgement.back);
  }
  if (judgement.only_one > 0) {
    text += fmt::format("  {} states that only one of the two reaches\n", judgement.only_one);
  }
  if (!judgement.agrees()) {
    text += judgement.slip.empty() ? "  no single slip explains it\n"
                                   : "  what explains it: " + judgement.slip + "\n";
  }
  for (const std::string& line : judgement.warnings) text += "  " + OneLine(line) + "\n";
  return text;
}

std::string CodeText(const CodeResult& result) {
  std::string text = fmt::format("coordinates: {}\nactuators: {}\n", Joined(result.coordinates),
                                 Joined(result.actuators));
  text += result.blocks == 0
              ? "the joints follow from the coordinates without equations to solve\n"
              : fmt::format("{} joints' coordinates are searched, in {} blocks of at most {}\n",
                            result.unknowns, result.blocks, result.largest_block);
  for (const std::string& note : result.notes) text += note + "\n";
  if (!std::isnan(result.table_bound)) {
    text += fmt::format("table: proved in {:.1f} % of the range, error left below {:.1g}\n",
                        100.0 * result.table_share, result.table_bound);
  }
  for (const CodeJudgement& judgement : result.judgements) text += JudgementText(judgement);
  return text;
}

nlohmann::ordered_json NumberOrNull(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json CodeJson(const CodeResult& result, const std::string& model) {
  nlohmann::ordered_json json = {{"model", model},
                                 {"name", result.name},
                                 {"coordinates", result.coordinates},
                                 {"actuators", result.actuators},
                                 {"notes", result.notes},
                                 {"blocks", result.blocks},
                                 {"largest_block", result.largest_block},
                                 {"searched", result.unknowns},
                                 {"limit", CodeJudgement::kLimit},
                                 {"agrees", result.agrees()}};
  if (!std::isnan(result.table_bound)) {
    json["table"] = {{"error", result.table_bound}, {"proved", result.table_share}};
  }
  json["judgements"] = nlohmann::ordered_json::array();
  for (const CodeJudgement& one : result.judgements) {
    json["judgements"].push_back({{"language", one.language},
                                  {"compiler", one.compiler},
                                  {"not_judged", one.not_judged},
                                  {"agrees", one.agrees()},
                                  {"states", one.states},
                                  {"only_one", one.only_one},
                                  {"position", NumberOrNull(one.position)},
                                  {"rates", NumberOrNull(one.jacobian)},
                                  {"force", NumberOrNull(one.force)},
                                  {"along", NumberOrNull(one.along)},
                                  {"output", NumberOrNull(one.output)},
                                  {"back", NumberOrNull(one.back)},
                                  {"nanoseconds", NumberOrNull(one.nanoseconds)},
                                  {"slip", one.slip},
                                  {"warnings", one.warnings}});
  }
  json["files"] = nlohmann::ordered_json::array();
  for (const auto& [name, content] : result.files) json["files"].push_back(name);
  return json;
}

int Code(CodeArguments arguments) {
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
  const Mechanism& mechanism = *loaded.mechanism;
  Diagnostics found;
  const std::optional<CodeTask> task = ChooseCodeTask(mechanism, arguments.coordinates, &found);
  SayText(stderr, found.Text());
  if (!task) return 2;
  CodeSettings& settings = arguments.settings;
  for (const std::string& text : arguments.ranges) {
    const auto range =
        ReadNamedRange(text, NamesOf(task->coordinates), [&](const std::string& name) {
          return CoordinateUnit(
              mechanism,
              std::ranges::find(task->coordinates, name, &NamedCoordinate::name)->coordinate);
        });
    if (!range) return 2;
    settings.ranges.push_back({range->name, range->low, range->high});
  }
  settings.compile = !arguments.no_test;
  settings.origin = arguments.model;
  for (const std::string& set : arguments.set) settings.origin += " --set " + set;
  ProgressLine line(!arguments.quiet);
  std::function<void(double)> progress;
  if (line.active()) progress = [&](double share) { line.Show(mechanism.name + ": code", share); };
  const CodeResult result = MakeCode(mechanism, *task, settings, progress);
  line.Clear();
  SayText(stderr, result.diagnostics.Text());
  if (result.diagnostics.has_errors()) return 2;
  std::FILE* to = arguments.json.text();
  if (!arguments.quiet) {
    SayText(to, CodeText(result));
  } else {
    for (const CodeJudgement& judgement : result.judgements) SayText(to, JudgementText(judgement));
  }
  const std::string json = arguments.json.Text(CodeJson(result, mechanism.name));
  std::vector<std::pair<std::string, std::string>> files = {{"code.json", json}};
  if (settings.check.empty()) files.insert(files.begin(), result.files.begin(), result.files.end());
  OutputFolder folder(arguments.out, mechanism.name + "/code");
  if (const std::string trouble = folder.WriteAll(files); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  if (!arguments.quiet) Say(stderr, "results in {}\n", folder.target().string());
  const int written = arguments.json.Write(json, inputs.files());
  return written != 0 ? written : result.agrees() ? 0 : 1;
}

}  // namespace

void AddCodeCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CodeArguments>();
  CLI::App* code = app->add_subcommand(
      "code", "C99 and Python of a mechanism's kinematics and dynamics, judged by the reference");
  code->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file")
      ->required();
  code->add_option("--coordinates", arguments->coordinates,
                   "that positions and forces are functions of, as many as degrees of freedom; "
                   "otherwise the first output's, then drives")
      ->delimiter(',')
      ->allow_extra_args(false);
  code->add_option("--range", arguments->ranges,
                   "NAME_deg=LOW:HIGH (NAME= in rad or m, NAME_mm=) of each coordinate: adds a "
                   "table to start from, and the proof of where that does")
      ->allow_extra_args(false);
  code->add_option("--name", arguments->settings.name, "of the files, and before names in C");
  code->add_option("--check", arguments->settings.check,
                   "a header with the same functions, to be judged instead of the one made");
  code->add_option("--states", arguments->settings.states, "random states to judge by")
      ->check(CLI::Range(10, 10000000))
      ->capture_default_str();
  code->add_option("--seed", arguments->settings.seed, "of the states")
      ->check(WholeNumber())
      ->capture_default_str();
  code->add_flag("--no-test", arguments->no_test, "files alone: compiles and runs nothing");
  code->add_option("--set", arguments->set, "PARAMETER=VALUE of the model (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(code, &arguments->options);
  code->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  code->add_flag("-q,--quiet", arguments->quiet, "the verdicts alone");
  arguments->json.AddTo(code);
  SetFooter(
      code,
      {"code delta",
       "code ankle.yaml --coordinates pitch,roll --range pitch_deg=-40:30 "
       "--range roll_deg=-15:15",
       "code ankle.yaml --coordinates pitch,roll --check mine.h"},
      "0 the code agrees, 1 it differs, 2 bad input, 3 results could not be written, 4 internal "
      "error");
  code->callback([arguments, exit_code] { *exit_code = Code(*arguments); });
}

}  // namespace mbv
