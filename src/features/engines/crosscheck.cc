#include "features/engines/crosscheck.h"

#include <fmt/format.h>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>

#include "base/json_text.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "comparison/verdict.h"
#include "features/run/run_scenario.h"
#include "report/page.h"
#include "verify/program_call.h"

namespace mbv {
namespace {

using Rows = std::vector<CrosscheckRow>;

// Processor time by samples: of an external program what it reports of its computation, else its
// whole run.
double MicrosecondsEach(const WitnessRecord& witness) {
  double seconds = witness.summary.cpu_s;
  if (witness.foreign && !std::isnan(witness.foreign->compute_s))
    seconds = witness.foreign->compute_s;
  const auto samples = static_cast<double>(witness.trace.time_s.size());
  return seconds > 0.0 && samples > 0.0 ? 1e6 * seconds / samples : kNan;
}

std::string EngineName(const WitnessRecord& witness) {
  const Role* role = FindRole(witness.name);
  return role == nullptr ? witness.name : role->method;
}

double GapOf(const Comparison& comparison, const std::string& witness) {
  for (const WitnessMetrics& metrics : comparison.witnesses) {
    if (metrics.witness != witness) continue;
    return ValueOf(metrics.metrics, Metric::kClosureM);
  }
  return kNan;
}

CrosscheckRow RowOf(const Report& report, const WitnessRecord& witness) {
  CrosscheckRow row{.mechanism = report.mechanism,
                    .scenario = report.scenario,
                    .engine = EngineName(witness),
                    .program = witness.foreign ? witness.foreign->program : "",
                    .loop_gap_m = GapOf(report.comparison, witness.name),
                    .sample_us = MicrosecondsEach(witness),
                    .why = witness.summary.ok() ? "" : witness.summary.message};
  if (!row.why.empty()) return row;
  const PairComparison* pair =
      FindEitherWay(report.comparison, witness.name, role::kReference.name);
  if (pair == nullptr || !pair->compared) {
    row.why = pair == nullptr ? "is not held against the reference" : pair->reason;
    return row;
  }
  row.force_nrmse = ValueOf(pair->metrics, Metric::kForceNrmse);
  row.pose_m = ValueOf(pair->metrics, Metric::kPoseM);
  if (std::isnan(row.force_nrmse)) row.why = "has no drive force in common with the reference";
  return row;
}

std::string CaseOf(const CrosscheckRow& row) { return row.mechanism + "/" + row.scenario; }

// In the order in which they first come.
std::vector<std::string> Distinct(const Rows& rows, std::string (*name)(const CrosscheckRow&)) {
  std::vector<std::string> names;
  for (const CrosscheckRow& row : rows) {
    if (std::ranges::find(names, name(row)) == names.end()) names.push_back(name(row));
  }
  return names;
}

std::string EngineOf(const CrosscheckRow& row) { return row.engine; }

// "simbody (Simbody 3.7)".
std::string EngineAndProgram(const CrosscheckRow& row) {
  return row.engine + (row.program.empty() ? "" : " (" + row.program + ")");
}

// A row per scenario, a column per engine.
Table EngineTable(const Rows& rows, const std::function<std::string(const CrosscheckRow&)>& cell) {
  const std::vector<std::string> engines = Distinct(rows, &EngineOf);
  Table table{.columns = {Text("scenario")}};
  for (const std::string& engine : engines) table.columns.push_back(Text(engine));
  for (const std::string& scenario : Distinct(rows, &CaseOf)) {
    std::vector<Cell>& row = table.rows.emplace_back();
    row.push_back(Code(scenario));
    for (const std::string& engine : engines) {
      const auto found = std::ranges::find_if(rows, [&](const CrosscheckRow& one) {
        return CaseOf(one) == scenario && one.engine == engine;
      });
      row.emplace_back(found == rows.end() ? "" : cell(*found));
    }
  }
  return table;
}

// All engines, of one scenario or of all.
Table RowTable(const Rows& rows, const std::string& scenario) {
  Table table{.caption = "Engines on " + scenario,
              .columns = {Text("scenario", On::kTerminal), Text("engine"),
                          Digits("drive force, RMS"), Digits("pose [m]"), Digits("loop gap [m]"),
                          Digits("per sample [us]"), Text("why not")}};
  for (const CrosscheckRow& row : rows) {
    if (!scenario.empty() && CaseOf(row) != scenario) continue;
    table.rows.push_back(
        {CaseOf(row), EngineAndProgram(row), NumberOrDash(row.force_nrmse, "{:.1e}"),
         NumberOrDash(row.pose_m, "{:.1e}"), NumberOrDash(row.loop_gap_m, "{:.1e}"),
         NumberOrDash(row.sample_us, "{:.3g}"), OneLine(row.why)});
  }
  return table;
}

}  // namespace

std::optional<SetValue> WitnessesOf(const std::vector<std::string>& engines) {
  std::string text;
  for (const std::string& engine : engines) {
    const auto named = SplitSet(engine);
    if (!named) return {};
    std::string words;
    for (const std::string& word : CommandWords(named->second)) {
      words += fmt::format("{}\"{}\"", words.empty() ? "" : ", ", word);
    }
    text += fmt::format("{}{}: {{command: [{}]}}", text.empty() ? "" : ", ", named->first, words);
  }
  return SetValue{"witnesses", "{" + text + "}"};
}

Rows CrosscheckRows(const Report& report) {
  Rows rows;
  for (const WitnessRecord& witness : report.witnesses) {
    if (witness.name == role::kReference) continue;
    rows.push_back(RowOf(report, witness));
  }
  if (!report.engine_comparison) return rows;
  for (const EngineError& error : report.engine_comparison->engines) {
    if (error.engine == report.engine) continue;
    rows.push_back({.mechanism = report.mechanism,
                    .scenario = report.scenario,
                    .engine = EngineComparison::NameOf(error.engine),
                    .program = {},
                    .force_nrmse = error.force_nrmse,
                    .loop_gap_m = error.closure_max_m,
                    .why = error.failure});
  }
  return rows;
}

std::string ToText(const Rows& rows) { return ToText(RowTable(rows, ""), {.indent = ""}); }

std::string ToMarkdown(const Rows& rows) {
  struct Shown {
    const char* title;
    double CrosscheckRow::*number;
    const char* format;
  };
  constexpr Shown kShown[] = {
      {"Drive forces, RMS difference of all", &CrosscheckRow::force_nrmse, "{:.1e}"},
      {"Outputs' origins, largest distance [m]", &CrosscheckRow::pose_m, "{:.1e}"},
      {"Loops, largest gap [m]", &CrosscheckRow::loop_gap_m, "{:.1e}"},
      {"Cost of a sample [us]", &CrosscheckRow::sample_us, "{:.3g}"}};
  std::string text;
  for (const Shown& shown : kShown) {
    const Table table = EngineTable(rows, [&](const CrosscheckRow& row) {
      return NumberOrDash(row.*shown.number, shown.format);
    });
    text += fmt::format("{}## {}\n\n{}", text.empty() ? "" : "\n", shown.title, ToMarkdown(table));
  }
  return text;
}

std::string ToCsv(const Rows& rows) {
  std::string text =
      "mechanism,scenario,engine,program,force_nrmse,pose_m,loop_gap_m,sample_us,why\n";
  for (const CrosscheckRow& row : rows) {
    text +=
        fmt::format("{},{},{},{},{:.17g},{:.17g},{:.17g},{:.17g},{}\n", CsvCell(row.mechanism),
                    CsvCell(row.scenario), CsvCell(row.engine), CsvCell(row.program),
                    row.force_nrmse, row.pose_m, row.loop_gap_m, row.sample_us, CsvCell(row.why));
  }
  return text;
}

std::string ToHtml(const Rows& rows) {
  Page page;
  for (const std::string& scenario : Distinct(rows, &CaseOf)) {
    page.Add(scenario, scenario, ToHtml(RowTable(rows, scenario)));
  }
  return page.Write({.kicker = "mbverify crosscheck",
                     .title = "Engines side by side",
                     .lead = "Against the generic reference, given the same drive motion",
                     .judges = false});
}

std::string ToJson(const Rows& rows) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const CrosscheckRow& row : rows) {
    list.push_back({{"mechanism", row.mechanism},
                    {"scenario", row.scenario},
                    {"engine", row.engine},
                    {"program", row.program},
                    {"force_nrmse", Number(row.force_nrmse)},
                    {"pose_m", Number(row.pose_m)},
                    {"loop_gap_m", Number(row.loop_gap_m)},
                    {"sample_us", Number(row.sample_us)},
                    {"why", row.why}});
  }
  return Dump({{"schema", "mbverify.crosscheck/1"}, {"rows", std::move(list)}});
}

// mbverify crosscheck

namespace {

struct CrosscheckArguments {
  std::vector<std::string> scenarios, set;
  std::vector<std::string> engines = {"simbody=mbverify-witness-simbody",
                                      "mujoco_newest=mbverify-witness-mujoco",
                                      "mujoco_newest_default=mbverify-witness-mujoco --defaults"};
  std::string markdown, csv, html;
  bool newest = false;
  std::string program;  ///< with newest
  JsonOption json;
};

int WriteAll(const CrosscheckArguments& arguments, const std::vector<CrosscheckRow>& rows) {
  SayText(arguments.json.text(), ToText(rows));
  int exit_code = arguments.json.Write(ToJson(rows), {});
  const std::pair<const std::string&, std::string (*)(const std::vector<CrosscheckRow>&)> files[] =
      {{arguments.markdown, &ToMarkdown}, {arguments.csv, &ToCsv}, {arguments.html, &ToHtml}};
  for (const auto& [path, write] : files) {
    if (!path.empty()) exit_code = WorseExit(exit_code, WriteWholeFile(path, write(rows), {}));
  }
  return exit_code;
}

// What one scenario's engines give; its exit code. A disagreement is a result here.
int AddRows(const std::string& file, const RunOptions& options, std::vector<CrosscheckRow>* rows) {
  const RunOutcome outcome = RunScenario(file, options);
  if (!outcome.report) {
    SayText(stderr, outcome.diagnostics.Text());
    if (outcome.exit_code == 2) return 2;
    return Refuse(file + " is not a motion", "crosscheck takes scenarios with a motion");
  }
  const std::vector<CrosscheckRow> more = CrosscheckRows(*outcome.report);
  rows->insert(rows->end(), more.begin(), more.end());
  return outcome.exit_code == 3 ? 3 : 0;
}

int RunCrosscheck(const CrosscheckArguments& arguments) {
  if (arguments.newest) {
    return RunUpgrade({arguments.scenarios, arguments.set, arguments.program, arguments.json});
  }
  RunOptions options;
  options.out_dir.clear();
  options.pictures = options.page = false;
  const auto witnesses = WitnessesOf(arguments.engines);
  if (!witnesses) return Refuse("--engine: write NAME=COMMAND", "");
  options.scenario.set.push_back(*witnesses);
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files = FilesToRun(
      arguments.scenarios,
      {arguments.json.path(), arguments.markdown, arguments.csv, arguments.html}, &exit_code);
  std::vector<CrosscheckRow> rows;
  for (size_t i = 0; i < files.size(); ++i) {
    Say(stderr, "{} of {}: {}\n", i + 1, files.size(), files[i]);
    exit_code = WorseExit(exit_code, AddRows(files[i], options, &rows));
  }
  return rows.empty() ? exit_code : WorseExit(exit_code, WriteAll(arguments, rows));
}

}  // namespace

void AddCrosscheckCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CrosscheckArguments>();
  CLI::App* crosscheck = app->add_subcommand(
      "crosscheck", "Engines side by side on scenarios: force error, loop gap, cost");
  crosscheck->add_option("scenarios", arguments->scenarios, "scenario files or folders")
      ->required();
  CLI::Option* newest = crosscheck->add_flag(
      "--newest", arguments->newest,
      "what the newest MuJoCo changes for the scenarios' models, row by row, and why");
  crosscheck
      ->add_option("--program", arguments->program,
                   "runs the other version, in place of mbverify-witness-mujoco")
      ->needs(newest);
  crosscheck
      ->add_option("--engine", arguments->engines,
                   "NAME=COMMAND: a foreign witness (repeatable), see "
                   "docs/how-to/external_solvers.md; Simbody and "
                   "the newest MuJoCo in two ways if left out")
      ->allow_extra_args(false)
      ->excludes(newest);
  crosscheck
      ->add_option("--markdown", arguments->markdown,
                   "writes forces, poses, loop gaps and cost as tables, a column per engine")
      ->excludes(newest);
  crosscheck->add_option("--csv", arguments->csv, "writes all rows as CSV")->excludes(newest);
  crosscheck->add_option("--html", arguments->html, "writes all rows as a page")->excludes(newest);
  arguments->json.AddTo(crosscheck);
  crosscheck
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenarios (repeatable)")
      ->allow_extra_args(false);
  SetFooter(crosscheck,
            {"crosscheck scenarios/four_bar/turn_inverse.yaml",
             "crosscheck mine.yaml --engine 'mine=python3 my_engine.py' --markdown table.md",
             "crosscheck mine.yaml --newest --json -"},
            "0 compared, whatever differs; 2 bad input, 3 a scenario could not run, 4 "
            "internal error");
  crosscheck->callback([arguments, exit_code] { *exit_code = RunCrosscheck(*arguments); });
}

}  // namespace mbv
