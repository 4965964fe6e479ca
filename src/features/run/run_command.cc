// What is printed when a run does not fit into memory.

#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <new>
#include <string>

#include "base/files.h"
#include "base/json_text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/certify/certify.h"
#include "features/linearise/linearise.h"
#include "features/run/default_setup.h"
#include "features/run/run_scenario.h"
#include "mechanism/channels.h"
#include "report/report.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

constexpr double kBytes = 8.0, kPoseBytes = 128.0;  // of a number, of a body's pose
constexpr double kMegabyte = 1e6;

// "" when the scenario is not a motion, or cannot be read either.
std::string WhatIsLarge(const std::string& file, const ScenarioOptions& options) {
  try {
    const ScenarioResult loaded = LoadScenario(file, options);
    if (!loaded.scenario) return "";
    const Motion& motion = loaded.scenario->motion;
    const double samples = motion.duration_s / motion.sample_s;
    const auto signals = static_cast<double>(MostChannels(*loaded.mechanism, motion));
    const auto bodies = static_cast<double>(loaded.mechanism->bodies.size());
    return fmt::format(
        "{:.0f} samples of {:.0f} signals and {:.0f} poses take about {:.0f} MB for each witness",
        samples, signals, bodies, samples * (signals * kBytes + bodies * kPoseBytes) / kMegabyte);
  } catch (const std::bad_alloc&) {
    return "";
  }
}

}  // namespace

// Exit code 3 with a finding that names what takes the memory: the samples and signals of a
// motion. Call it when everything of the run is released.
RunOutcome OutOfMemory(const std::string& file, const ScenarioOptions& options) {
  const std::string large = WhatIsLarge(file, options);
  RunOutcome outcome;
  outcome.exit_code = 3;
  Finding finding;
  finding.file = file;
  finding.message = "could not run: out of memory" + (large.empty() ? "" : ": " + large);
  finding.hint = "choose a larger motion.sample_s, or a shorter motion";
  outcome.diagnostics.Add(std::move(finding));
  return outcome;
}

namespace {

struct RunArguments {
  std::vector<std::string> scenarios, set, data;
  RobotArguments robot;
  std::string out = "out", mode, report_script, kept_audits, agreed, certify, derivatives;
  JsonOption json;
  bool no_report = false, no_pictures = false, no_source_model = false, quiet = false,
       verbose = false;
  bool sizing = false, trust = false;
};

// One scenario; prints its result. Our own bugs end this scenario, not the others.
RunOutcome RunOne(const std::string& file, const RunOptions& options, const RunArguments& arguments,
                  ProgressLine* progress, FindingPrinter* findings) {
  RunOutcome outcome;
  try {
    outcome = RunScenario(file, options);
  } catch (const std::bad_alloc&) {
    outcome = OutOfMemory(file, options.scenario);
  } catch (const std::exception& error) {
    progress->Clear();
    Say(stderr, "{}: internal error: {}\n", file, error.what());
    return {};
  }
  progress->Clear();
  findings->Print(outcome.diagnostics);
  if (const std::optional<ResultView> view = outcome.View()) {
    const TableOptions table{.color = WantsColor(arguments.json.text()),
                             .verbose = arguments.verbose,
                             .sizing = arguments.sizing,
                             .columns = TerminalColumns(arguments.json.text())};
    SayText(arguments.json.text(), arguments.quiet  ? VerdictLine(*view, table)
                                   : outcome.report ? ToTable(*outcome.report, table) + "\n"
                                                    : outcome.other->Table(table) + "\n");
  }
  if (!outcome.folder.empty() && !arguments.quiet) {
    Say(stderr, "results in {}\n", outcome.folder);
  }
  std::fflush(stdout);
  return outcome;
}

// summary.json of what ran, findings of what did not.
nlohmann::ordered_json ResultJson(const std::string& file, const RunOutcome& outcome) {
  if (outcome.report) return ParseJson<nlohmann::ordered_json>(ToJson(*outcome.report));
  if (outcome.other) return ParseJson<nlohmann::ordered_json>(outcome.other->Json());
  return {{"scenario_file", file},
          {"exit_code", outcome.exit_code},
          {"findings", FindingObjects(outcome.diagnostics)}};
}

// How many samples --certify or --derivatives asks for, 0: all; false (after a message) if that is
// no number.
bool ReadSamples(const char* option, const std::string& text, size_t* samples) {
  const bool digits = !text.empty() && text.size() < 7 &&
                      std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
  *samples = digits ? std::stoul(text) : 0;
  if (text == "all" || *samples > 0) return true;
  Say(stderr, "error: {0}={1}: a number of samples or 'all'\n  hint: {0}=20\n", option, text);
  return false;
}

// Options of all scenarios; false (after a message) if --set is malformed.
bool MakeOptions(const RunArguments& arguments, RunOptions* options) {
  options->out_dir = arguments.out;
  options->pictures = !arguments.no_pictures;
  options->page = !arguments.no_report;
  options->script_link = arguments.report_script;
  options->kept_audits = arguments.kept_audits;
  options->data = arguments.data;
  CertifyOptions certify;
  size_t derivatives = 0;
  const bool proves = !arguments.certify.empty(), differentiates = !arguments.derivatives.empty();
  if (proves && !ReadSamples("--certify", arguments.certify, &certify.samples)) return false;
  if (differentiates && !ReadSamples("--derivatives", arguments.derivatives, &derivatives)) {
    return false;
  }
  if (proves || differentiates) {
    options->after_judgement = [=](const Prepared& prepared, Report* report) {
      CertifyOptions followed = certify;
      followed.progress = StageOf(options->progress, "proof");
      if (proves) AddCertificate(prepared, followed, report);
      if (differentiates) {
        AddDerivatives(prepared, derivatives, StageOf(options->progress, "derivatives"), report);
      }
    };
  }
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options->scenario.set))
    return false;
  if (!arguments.mode.empty()) {
    options->scenario.set.emplace_back("simulation.mode", arguments.mode);
  }
  return true;
}

// A robot's file, or a model, is run by a first motion; its model and scenario are left to go on
// from.
bool SetUpRobot(const std::string& robot, const RunArguments& arguments, FindingPrinter* findings,
                std::string* scenario) {
  LoadOptions options;
  if (!ReadRobotOptions(arguments.robot, &options)) return false;
  const DefaultSetupResult made = MakeDefaultSetup(robot, "", "./model.yaml", options);
  findings->Print(made.diagnostics);
  if (!made.setup) return false;
  const std::string trouble = WriteSetup(*made.setup, arguments.out, scenario);
  if (!trouble.empty()) {
    Say(stderr, "error: {}\n", trouble);
    return false;
  }
  findings->AddMadeModel(std::filesystem::path(*scenario).replace_filename("model.yaml"));
  if (!arguments.quiet) {
    const std::string model = CompletedModel(robot);
    Say(stderr, "{}{} is run by {}; go on from there\n", robot,
        model == robot ? "" : ", completed by " + model + ",", *scenario);
  }
  return true;
}

int Run(const RunArguments& arguments) {
  RunOptions options;
  if (!MakeOptions(arguments, &options)) return 2;
  std::string trouble;
  const std::vector<std::string> files = ExpandScenarios(arguments.scenarios, &trouble);
  if (!trouble.empty()) {
    Say(stderr, "{}\n", trouble);
    return 2;
  }
  for (const std::string& file : files) {
    if (const int code = RefuseInput(arguments.json.path(), file); code != 0) return code;
  }
  if (!arguments.agreed.empty()) options.programs.agreed.insert(arguments.agreed);
  if (const int code = AskForPrograms(files, options.scenario, arguments.trust, arguments.quiet,
                                      &options.programs);
      code != 0) {
    return code;
  }
  ProgressLine progress(!arguments.quiet);
  FindingPrinter findings(stderr);
  RunCounts counts;
  auto results = nlohmann::ordered_json::array();
  int exit_code = 0;
  if (arguments.robot.any() && std::ranges::none_of(files, IsRobotFile)) {
    return RefuseRobotOptions();
  }
  for (const std::string& given : files) {
    std::string file = given;
    options.source_base = arguments.robot.base;
    // On its feet it is another mechanism than the file, whose contacts are MuJoCo's.
    const bool floats = arguments.robot.free_base || !arguments.robot.plants.empty();
    options.source_model =
        given.ends_with(".xml") && !arguments.no_source_model && !floats ? given : "";
    if ((IsRobotFile(given) || KindOf(given).set_up) &&
        !SetUpRobot(given, arguments, &findings, &file)) {
      exit_code = WorseExit(exit_code, 2);
      counts += RunCounts{.scenarios = 1, .bad_input = 1};
      results.push_back({{"scenario_file", given}, {"exit_code", 2}});
      continue;
    }
    if (progress.active()) {
      options.progress = [&](const std::string& stage, double fraction) {
        progress.Show(file + ": " + stage, fraction);
      };
    }
    const RunOutcome outcome = RunOne(file, options, arguments, &progress, &findings);
    exit_code = WorseExit(exit_code, outcome.exit_code);
    if (arguments.json.wanted()) results.push_back(ResultJson(file, outcome));
    const std::optional<ResultView> view = outcome.View();
    counts += view ? CountOf(*view) : RunCounts{.scenarios = 1, .bad_input = 1};
  }
  if (files.size() > 1) SayText(arguments.json.text(), CountLine(counts));
  return WorseExit(exit_code, arguments.json.Write(
                                  {{"exit_code", exit_code}, {"results", std::move(results)}}, {}));
}

}  // namespace

void AddRunCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RunArguments>();
  CLI::App* run = app->add_subcommand("run", "Compare analytic, reference and simulated forces");
  run->add_option("scenario", arguments->scenarios,
                  "scenario files, folders of them, models (model.yaml), or robots (.urdf, MJCF as "
                  ".xml, .sdf)")
      ->required();
  run->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  run->add_option("--mode", arguments->mode, "overrides the scenario's simulation mode")
      ->check(OneOf({"forward", "inverse"}));
  run->add_option("--set", arguments->set,
                  "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(run, &arguments->robot);
  run->add_flag("--no-pictures", arguments->no_pictures, "do not draw snapshots");
  run->add_flag("--no-report", arguments->no_report, "do not write report.html");
  run->add_flag("--no-own-file", arguments->no_source_model,
                "do not run a robot's MJCF as it is in addition");
  // How regress shares one script, and what the papers' audits gave, among the reports of a
  // regression run.
  run->add_option("--report-script", arguments->report_script)->group("");
  run->add_option("--kept-audits", arguments->kept_audits)->group("");
  // The fingerprint of the programs that regress was allowed to run for this scenario.
  run->add_option("--agreed-programs", arguments->agreed)->group("");
  AddTrustOption(run, &arguments->trust);
  run->add_option(
         "--data", arguments->data,
         "traces of motions also as traces.mat, traces_v73.mat or traces.h5, for MATLAB, Octave, "
         "Python …; csv: units and frames of the columns of traces.csv")
      ->delimiter(',')
      ->check(OneOf(DataWords()));
  run->add_flag(
      "--certify{10}", arguments->certify,
      "prove forces in interval arithmetic at 10 spread samples and where witnesses differ "
      "most; --certify=N: at N, --certify=all: at all samples");
  run->add_flag("--derivatives{10}", arguments->derivatives,
                "derivatives of forces two ways at 10 spread samples; --derivatives=N, "
                "--derivatives=all");
  arguments->json.AddTo(run);
  run->add_flag("--sizing", arguments->sizing, "all figures of the motors that the model states");
  run->add_flag("-q,--quiet", arguments->quiet, "one line per scenario");
  run->add_flag("-v,--verbose", arguments->verbose,
                "also how to read each signal, and what could not be compared");
  SetFooter(run,
            {"run scenarios/stabilizing_platform/sea_state.yaml", "run my_robot.urdf",
             "run scenarios/spr_tripod --mode inverse --quiet", "run four_bar/turn",
             "run my.yaml --set parameters.m_p=45000 --set simulation.step_s=0.0005"},
            "0 agree, 1 disagree, 2 bad input, 3 could not run, 4 internal error");
  run->callback([arguments, exit_code] { *exit_code = Run(*arguments); });
}

}  // namespace mbv
