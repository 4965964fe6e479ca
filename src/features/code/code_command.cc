// mbverify code
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/code/code.h"
#include "model_file/load_model.h"

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

int Code(CodeArguments arguments) {
  const InputWatch inputs;
  std::optional<LoadResult> loaded =
      LoadModelOrRefuse(arguments.model, arguments.set, arguments.options);
  if (!loaded) return 2;
  const Mechanism& mechanism = *loaded->mechanism;
  Diagnostics found;
  const std::optional<CodeTask> task = ChooseCodeTask(mechanism, arguments.coordinates, &found);
  SayText(stderr, found.Text());
  if (!task) return 2;
  CodeSettings& settings = arguments.settings;
  const auto ranges = ReadNamedRanges(
      arguments.ranges, NamesOf(task->coordinates), [&](const std::string& name) -> std::string {
        const auto at = std::ranges::find(task->coordinates, name, &NamedCoordinate::name);
        return at == task->coordinates.end() ? "" : CoordinateUnit(mechanism, at->coordinate);
      });
  if (!ranges) return 2;
  for (const NamedRange& range : *ranges) {
    settings.ranges.push_back({range.name, range.low, range.high});
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
  SayText(to, arguments.quiet ? JudgementsText(result) : ToText(result));
  const std::string json = arguments.json.Text(ToJson(result, mechanism.name));
  std::vector<std::pair<std::string, std::string>> files = {{"code.json", json}};
  if (settings.check.empty()) files.insert(files.begin(), result.files.begin(), result.files.end());
  // A header that lies in the folder of those made stays there.
  OutputFolder folder(arguments.out,
                      mechanism.name + (settings.check.empty() ? "/code" : "/code_check"));
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
  code->add_option("--cells", arguments->settings.cells,
                   "of the table, per coordinate: more prove more of the ranges, in more time "
                   "(512, 64 or 16 of one, two or three coordinates)")
      ->check(CLI::IsMember({4, 8, 16, 32, 64, 128, 256, 512}));
  code->add_option("--name", arguments->settings.name, "of the files, and before names in C");
  code->add_option("--check", arguments->settings.check,
                   "a header with the same functions, to be judged instead of the one made");
  code->add_option("--states", arguments->settings.states, "random states to judge by")
      ->check(CLI::Range(10, 1000000))
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
       "code ankle.yaml --coordinates pitch,roll --range pitch_deg=-40:30 --range roll_deg=-15:15",
       "code ankle.yaml --coordinates pitch,roll --check mine.h"},
      "0 the code agrees, 1 it differs, 2 bad input, 3 results could not be written, 4 internal "
      "error");
  code->callback([arguments, exit_code] { *exit_code = Code(*arguments); });
}

}  // namespace mbv
