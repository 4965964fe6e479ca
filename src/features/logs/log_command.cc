// mbverify log
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>

#include "base/files.h"
#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/logs/log_report.h"
#include "features/run/default_setup.h"
#include "features/run/run_scenario.h"
#include "kinematics/command_rank.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

constexpr double kMostSamples = 20000.0;  // of the run

struct LogArguments {
  std::string robot, log, map, out = "out", mode = "inverse", smoothing = "auto";
  std::vector<std::string> columns, set;
  RobotArguments options;
  LogSettings settings;
  double cutoff_hz = 0.0, most_delay_s = 0.05, limit = kNan;
  bool ignore_ranges = false, no_pictures = false, quiet = false, verbose = false;
  JsonOption json;
};

// The robot, and what the scenario calls it.
struct LogRobot {
  Mechanism mechanism;
  std::vector<std::pair<fs::path, std::string>> files;  // of a model that is made
  std::string model_ref;
  bool made = false;               // from a robot's file
  std::vector<std::string> names;  // of the axes, in the scenario
};

// How the motion is commanded.
struct LogCommands {
  std::vector<size_t> logged, held;  // axes
};

class LogRun {
 public:
  explicit LogRun(const LogArguments& arguments)
      : arguments_(arguments), settings_(arguments.settings) {}

  int Run() {
    if (!ReadSettings()) return BadInput();
    if (!LoadLogRobot()) return BadInput();
    axes_ = LogAxes(robot_.mechanism);
    NameAxes();
    auto log = ReadLog(arguments_.log, settings_, axes_, &findings_);
    if (!log) return BadInput();
    log_ = std::move(*log);
    CheckLimit();
    if (!ChooseCommands()) return BadInput();
    if (!arguments_.ignore_ranges && !CheckLogRanges(log_, axes_, &findings_)) return BadInput();
    printer_.Print(findings_);
    if (const std::string trouble = WriteSetup(); !trouble.empty()) {
      return NotWritten(trouble, "choose another folder with --out");
    }
    return Verify();
  }

 private:
  int BadInput() {
    printer_.Print(findings_);
    return WriteJson(2, Verdict::kNotRun, "bad input", "", nullptr);
  }

  int WriteJson(int exit_code, Verdict verdict, const std::string& reason,
                const std::string& folder, const nlohmann::ordered_json& log) {
    return WorseExit(exit_code, arguments_.json.Write({{"exit_code", exit_code},
                                                       {"verdict", ToText(verdict)},
                                                       {"reason", reason},
                                                       {"folder", folder},
                                                       {"findings", FindingObjects(findings_)},
                                                       {"log", log}},
                                                      {}));
  }

  void AddError(const std::string& file, std::string message, std::string hint) {
    findings_.AddError(file, std::move(message), std::move(hint));
  }

  bool ReadSettings() {
    if (!arguments_.map.empty()) ReadLogMap(arguments_.map, &settings_, &findings_);
    for (const std::string& text : arguments_.columns) {
      if (AddLogColumn(text, &settings_)) continue;
      AddError("--column " + text, "is not NAME.QUANTITY=HEADING",
               "for instance --column left_knee.position='knee angle'");
    }
    if (arguments_.cutoff_hz > 0.0) {
      settings_.smoothing = fmt::format("{{cutoff_hz: {:.12g}}}", arguments_.cutoff_hz);
    } else {
      settings_.smoothing = arguments_.smoothing;
    }
    return !findings_.has_errors();
  }

  bool LoadLogRobot() {
    LoadOptions options;
    if (!ReadRobotOptions(arguments_.options, &options)) return false;
    if (IsRobotFile(arguments_.robot)) {
      DefaultSetupResult made = MakeDefaultSetup(arguments_.robot, "", "./model.yaml", options);
      findings_.Append(made.diagnostics);
      if (!made.setup) return false;
      if (made.setup->by_forces > 0) {
        AddError(
            arguments_.robot,
            fmt::format("{} degrees of freedom move by forces, and a log does not say how they "
                        "start",
                        made.setup->by_forces),
            "a model file (mbverify init NAME --from ROBOT) can hold them");
        return false;
      }
      robot_.made = true;
      robot_.model_ref = "./model.yaml";
      robot_.mechanism = std::move(made.setup->mechanism);
      robot_.files.emplace_back("model.yaml", std::move(made.setup->model));
      for (ModelMeshFile& mesh : made.setup->meshes) {
        robot_.files.emplace_back(mesh.path, std::move(mesh.content));
      }
      return true;
    }
    if (arguments_.options.any()) {
      AddError(arguments_.robot, "--assembly, --base and --closure-tolerance are for robots",
               "a model file states these itself");
      return false;
    }
    const auto file = FindModel(arguments_.robot, ".");
    if (!file) {
      AddError(arguments_.robot, "there is no such model", ModelHint(arguments_.robot, "."));
      return false;
    }
    LoadResult loaded = LoadModel(*file, options);
    findings_.Append(loaded.diagnostics);
    if (!loaded.mechanism) return false;
    robot_.mechanism = std::move(*loaded.mechanism);
    robot_.model_ref = fs::absolute(*file).lexically_normal().string();
    return true;
  }

  // A robot's names may be others in the model that is made of it.
  void NameAxes() {
    const WrittenNames written = NamesInModel(robot_.mechanism);
    for (const LogAxis& axis : axes_) {
      std::string name = axis.name();
      const auto index = static_cast<size_t>(axis.coordinate.index);
      if (robot_.made && axis.coordinate.kind == Coordinate::Kind::kDrive) {
        name = written.drives[index];
      } else if (robot_.made && axis.coordinate.kind == Coordinate::Kind::kJoint) {
        name = written.joints[index];
        if (DofsOf(robot_.mechanism.joints[index].kind) > 1) {
          name += fmt::format(".{}", axis.coordinate.component);
        }
      }
      robot_.names.push_back(std::move(name));
    }
  }

  // Held ones first, then drives that are logged, then other joints: as many as are independent.
  bool ChooseCommands() {
    std::vector<size_t> candidates;
    for (const std::string& name : settings_.hold) {
      const auto axis = std::ranges::find_if(
          axes_, [&](const LogAxis& one) { return Contains(one.names, name); });
      if (axis == axes_.end()) {
        std::vector<std::string> names;
        for (const LogAxis& one : axes_)
          names.insert(names.end(), one.names.begin(), one.names.end());
        AddError("--hold " + name, "the model has no drive or joint of this name",
                 DidYouMean(name, names));
        continue;
      }
      candidates.push_back(static_cast<size_t>(axis - axes_.begin()));
    }
    const size_t held = candidates.size();
    for (const bool driven : {true, false}) {
      for (size_t a = 0; a < axes_.size(); ++a) {
        if (axes_[a].driven() != driven || log_.Find(a, LogQuantity::kPosition) == nullptr)
          continue;
        if (std::ranges::count(candidates, a) == 0) candidates.push_back(a);
      }
    }
    if (findings_.has_errors()) return false;
    std::vector<Coordinate> coordinates;
    coordinates.reserve(candidates.size());
    for (const size_t a : candidates) coordinates.push_back(axes_[a].coordinate);
    const CoordinateChoice choice =
        ChooseCoordinates(robot_.mechanism, coordinates, coordinates.size());
    std::vector<bool> chosen(candidates.size(), false);
    for (const size_t k : choice.chosen) chosen[k] = true;
    std::vector<std::string> unused;
    for (size_t k = 0; k < candidates.size(); ++k) {
      if (!chosen[k]) {
        unused.push_back(axes_[candidates[k]].name());
      } else {
        (k < held ? commands_.held : commands_.logged).push_back(candidates[k]);
      }
    }
    if (!unused.empty()) {
      log_.notes.push_back(fmt::format("not commanded, because the others determine it at home: {}",
                                       Joined(unused)));
    }
    if (choice.left() <= 0) return CheckMotion();
    for (size_t a = 0; a < axes_.size(); ++a) {
      if (!axes_[a].driven() || std::ranges::count(candidates, a) > 0) continue;
      AddError(log_.file, fmt::format("has no column for the position of {}", axes_[a].name()),
               fmt::format("--column {}.position=HEADING names it, --hold {} keeps it at home",
                           axes_[a].name(), axes_[a].name()));
    }
    if (!findings_.has_errors()) {
      AddError(log_.file,
               fmt::format("{} of {} degrees of freedom are given by no column", choice.left(),
                           choice.dofs),
               "log positions of more joints, or --hold them");
    }
    return false;
  }

  bool CheckMotion() {
    if (!commands_.logged.empty()) return true;
    AddError(log_.file, "has no position of a drive or joint of the model",
             "names of the model: " + Joined(NamesOf(robot_.mechanism.drives), 8));
    return false;
  }

  // A limit of what is not compared would hold of every log.
  void CheckLimit() {
    if (std::isnan(arguments_.limit)) return;
    for (size_t a = 0; a < axes_.size(); ++a) {
      if (axes_[a].driven() && log_.Find(a, LogQuantity::kEffort) != nullptr) return;
    }
    AddError(log_.file, "has no effort of a drive, which --limit is about",
             "--column NAME.effort=HEADING names one");
  }

  [[nodiscard]] bool Shapes(size_t axis) const {
    return !settings_.positions_only && log_.Find(axis, LogQuantity::kVelocity) != nullptr;
  }

  static std::string Heading(const std::string& name, LogQuantity quantity) {
    return name + "." + kLogQuantities[static_cast<size_t>(quantity)];
  }

  [[nodiscard]] std::string MotionCsv() const {
    std::string text = "time (s)";
    std::vector<const LogSeries*> columns;
    for (const size_t a : commands_.logged) {
      for (const LogQuantity quantity : {LogQuantity::kPosition, LogQuantity::kVelocity}) {
        if (quantity == LogQuantity::kVelocity && !Shapes(a)) continue;
        columns.push_back(log_.Find(a, quantity));
        text += "," + CsvCell(Heading(robot_.names[a], quantity));
      }
    }
    text += "\n";
    for (size_t i = 0; i < log_.stamps.size(); ++i) {
      text += log_.stamps[i];
      for (const LogSeries* column : columns) text += "," + column->cells[i];
      text += "\n";
    }
    return text;
  }

  static std::string ColumnKeys(const std::string& name, const LogColumn& column,
                                LogQuantity quantity) {
    std::string keys = fmt::format("column: {}, unit: {}", QuotedYaml(Heading(name, quantity)),
                                   QuotedYaml(column.unit));
    const TableColumnSettings& stated = column.stated;
    if (stated.sign != 1.0) keys += fmt::format(", sign: {:.17g}", stated.sign);
    if (stated.scale != 1.0) keys += fmt::format(", scale: {:.17g}", stated.scale);
    if (stated.offset != 0.0) keys += fmt::format(", offset: {:.17g}", stated.offset);
    return keys;
  }

  // Samples at the log's rows, every second or third of many.
  [[nodiscard]] double SampleStep() const {
    const double step_s =
        log_.even ? log_.step_s : std::pow(10.0, std::floor(std::log10(log_.step_s)));
    return step_s * std::max(1.0, std::ceil(log_.time_s.back() / step_s / kMostSamples));
  }

  [[nodiscard]] std::string ScenarioText(const std::string& csv) const {
    std::string text = fmt::format(
        "# The motion of a log, made by mbverify log. All keys: docs/reference/scenario_file.md.\n"
        "mechanism: {}\ndescription: {}\nmotion:\n  sample_s: {:.12g}\n  commands:\n",
        QuotedYaml(robot_.model_ref), QuotedYaml("The motion of " + log_.name), SampleStep());
    for (const size_t a : commands_.logged) {
      const std::string& name = robot_.names[a];
      const LogColumn& position = log_.Find(a, LogQuantity::kPosition)->column;
      std::string rate;
      if (Shapes(a)) {
        rate = fmt::format(
            ", rate: {{{}}}",
            ColumnKeys(name, log_.Find(a, LogQuantity::kVelocity)->column, LogQuantity::kVelocity));
      }
      text +=
          fmt::format("    {}: {{table: {{csv: {}, {}, time: \"time (s)\", smoothing: {}{}}}}}\n",
                      QuotedYaml(name), csv, ColumnKeys(name, position, LogQuantity::kPosition),
                      settings_.smoothing, rate);
    }
    for (const size_t a : commands_.held) {
      text += fmt::format("    {}: home\n", QuotedYaml(robot_.names[a]));
    }
    if (robot_.made) text += "analytic: none\n";
    text += fmt::format("simulation: {{mode: {}, stock_too: false{}}}\n", arguments_.mode,
                        arguments_.ignore_ranges ? ", ignore_ranges: true" : "");
    return text + "snapshots: {times_s: [0]}\n";
  }

  // A letter, then letters, digits and _.
  [[nodiscard]] std::string Stem() const {
    constexpr size_t kLongest = 40;
    std::string stem;
    for (const char c : fs::path(arguments_.log).stem().string()) {
      stem += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    }
    if (stem.empty() || std::isalpha(static_cast<unsigned char>(stem[0])) == 0)
      stem = "log_" + stem;
    return stem.substr(0, kLongest);
  }

  std::string WriteSetup() {
    const fs::path folder = fs::path(arguments_.out) / robot_.mechanism.name / "setup";
    const std::string csv = Stem() + "_motion.csv";
    scenario_ = (folder / (Stem() + ".yaml")).string();
    robot_.files.emplace_back(csv, MotionCsv());
    robot_.files.emplace_back(Stem() + ".yaml", ScenarioText(csv));
    for (const auto& [name, content] : robot_.files) {
      if (std::string trouble = WriteFile(folder / name, content); !trouble.empty()) return trouble;
    }
    if (!arguments_.quiet) {
      Say(stderr, "the motion of {} is run by {}; go on from there\n", arguments_.log, scenario_);
    }
    return "";
  }

  int Verify() {
    RunOptions options;
    options.out_dir = arguments_.out;
    options.pictures = !arguments_.no_pictures;
    if (!ReadAssignments(arguments_.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
      return 2;
    std::vector<bool> shaping(axes_.size(), false);
    for (const size_t a : commands_.logged) shaping[a] = Shapes(a);
    LogComparison comparison;
    options.more_files = [&](const Report& report) {
      comparison = CompareLog(log_, axes_, robot_.names, shaping, report, arguments_.most_delay_s);
      return LogFiles(comparison, report);
    };
    ProgressLine progress(!arguments_.quiet);
    if (progress.active()) {
      options.progress = [&](const std::string& stage, double fraction) {
        progress.Show(log_.name + ": " + stage, fraction);
      };
    }
    const RunOutcome outcome = RunMotion(scenario_, options);
    progress.Clear();
    printer_.Print(outcome.diagnostics);
    findings_.Append(outcome.diagnostics);
    int exit_code = outcome.exit_code;
    if (!outcome.report) return WriteJson(exit_code, Verdict::kNotRun, "bad input", "", nullptr);
    const TableOptions table{.color = WantsColor(arguments_.json.text()),
                             .verbose = arguments_.verbose,
                             .columns = TerminalColumns(arguments_.json.text())};
    SayText(arguments_.json.text(), arguments_.quiet ? VerdictLine(ViewOf(*outcome.report), table)
                                                     : ToTable(*outcome.report, table) + "\n");
    SayText(arguments_.json.text(),
            ToText(comparison, TextStyle{.color = table.color, .columns = table.columns}));
    if (LargestShare(comparison) > arguments_.limit) {
      Say(arguments_.json.text(),
          "the log differs from the model by {:.2f} % of a drive's RMS, more than {:.2f} %\n",
          100.0 * LargestShare(comparison), 100.0 * arguments_.limit);
      exit_code = WorseExit(exit_code, 1);
    }
    std::fflush(stdout);
    if (!outcome.folder.empty() && !arguments_.quiet)
      Say(stderr, "results in {}\n", outcome.folder);
    const Comparison& judged = outcome.report->comparison;
    return WriteJson(exit_code, judged.verdict, judged.reason, outcome.folder, ToJson(comparison));
  }

  const LogArguments& arguments_;
  LogSettings settings_;
  Diagnostics findings_;
  FindingPrinter printer_{stderr};
  LogRobot robot_;
  std::vector<LogAxis> axes_;
  RobotLog log_;
  LogCommands commands_;
  std::string scenario_;
};

}  // namespace

void AddLogCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<LogArguments>();
  CLI::App* log = app->add_subcommand(
      "log", "Verify a robot on the motion of its log, and compare logged forces with the model's");
  log->add_option("robot", arguments->robot,
                  "robot (.urdf, MJCF as .xml, .sdf), model.yaml or the name of a model")
      ->required();
  log->add_option("log", arguments->log, "table of time, positions, velocities, torques (CSV)")
      ->required();
  log->add_option("--map", arguments->map, "file that says what the columns are");
  log->add_option("--column", arguments->columns,
                  "NAME.position=HEADING, also .velocity, .acceleration, .effort (repeatable)")
      ->allow_extra_args(false);
  log->add_option("--joints", arguments->settings.joints,
                  "names behind position[0], position[1], …, in this order")
      ->delimiter(',')
      ->allow_extra_args(false);
  log->add_option("--hold", arguments->settings.hold,
                  "drive or joint without a column that rests at home (repeatable)")
      ->allow_extra_args(false);
  log->add_option("--ignore", arguments->settings.ignore, "heading to pass over (repeatable)")
      ->allow_extra_args(false);
  log->add_option("--time", arguments->settings.time, "heading of the time");
  log->add_option("--time-unit", arguments->settings.time_unit, "of the time")
      ->check(OneOf({"s", "ms", "us", "ns"}));
  log->add_flag("--degrees", arguments->settings.degrees,
                "angles and their rates without a unit are in degrees");
  log->add_option("--from", arguments->settings.from_s, "start in s after the first row");
  log->add_option("--to", arguments->settings.to_s, "end in s after the first row");
  log->add_option("--rate", arguments->settings.rate_hz,
                  "rows per second: spaces the rows evenly, whatever their stamps")
      ->check(Positive());
  log->add_option("--smoothing", arguments->smoothing, "of positions: auto or none")
      ->check(OneOf({"auto", "none"}))
      ->capture_default_str();
  log->add_option("--cutoff", arguments->cutoff_hz, "smoothing that halves this frequency [Hz]")
      ->check(Positive());
  log->add_flag("--positions-only", arguments->settings.positions_only,
                "logged velocities are compared, and do not shape the motion");
  log->add_flag("--ignore-ranges", arguments->ignore_ranges, "joints may leave their ranges");
  log->add_option("--most-delay", arguments->most_delay_s, "of logged forces, searched for [s]")
      ->check(Positive())
      ->capture_default_str();
  log->add_option("--limit", arguments->limit,
                  "a drive whose log differs by more than this share of its RMS ends with 1")
      ->check(Positive());
  log->add_option("--mode", arguments->mode, "of the simulation")
      ->check(OneOf({"forward", "inverse"}))
      ->capture_default_str();
  log->add_option("--set", arguments->set,
                  "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(log, &arguments->options);
  log->add_option("--out", arguments->out, "folder for results")->capture_default_str();
  log->add_flag("--no-pictures", arguments->no_pictures, "do not draw snapshots");
  log->add_flag("-q,--quiet", arguments->quiet, "one line and the log's tables");
  log->add_flag("-v,--verbose", arguments->verbose, "also how to read each signal");
  arguments->json.AddTo(log);
  SetFooter(log,
            {"log my_robot.urdf walk.csv", "log my_robot.urdf walk.csv --degrees --hold waist",
             "log my_robot.xml bag.csv --joints left_knee,right_knee --from 2 --to 8",
             "log my_robot.urdf walk.csv --map columns.yaml --cutoff 30 --limit 0.1"},
            "0 the witnesses agree, 1 they disagree or --limit is exceeded, 2 bad input, 3 could "
            "not run, 4 internal error");
  log->callback([arguments, exit_code] { *exit_code = LogRun(*arguments).Run(); });
}

}  // namespace mbv
