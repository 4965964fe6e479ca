#include "features/robots/survey.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>

#include "base/files.h"
#include "base/json_text.h"
#include "base/scratch_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/run/default_setup.h"
#include "features/run/run_scenario.h"
#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "math/bytes.h"
#include "mechanism/joint_pose.h"
#include "model_file/mesh/read_mesh.h"
#include "report/page.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

// There is one wherever nothing was made.
Finding FirstError(const Diagnostics& diagnostics) {
  const auto error =
      std::ranges::find(diagnostics.findings(), Severity::kError, &Finding::severity);
  return error == diagnostics.findings().end() ? Finding{} : *error;
}

std::string WithHint(const Finding& finding) {
  return finding.message + (finding.hint.empty() ? "" : " (" + finding.hint + ")");
}

std::string AllWarnings(const Diagnostics& diagnostics) {
  std::string text;
  for (const Finding& finding : diagnostics.findings()) {
    text += (text.empty() ? "" : "; ") + finding.message;
  }
  return text;
}

void MeasureHome(const Mechanism& m, SurveyRow* row) {
  row->bodies = static_cast<int>(m.bodies.size()) - 1;
  BodyStates home;
  home.Resize(m.bodies.size());
  home.X_WB = m.X_WB_home;
  row->loops = 0;
  row->gap_m = row->gap_rad = 0.0;
  for (const Joint& joint : m.joints) {
    if (!joint.closure) continue;
    ++row->loops;
    const ConstraintRows rows = RowsOf(joint, home, false);
    if (rows.translation_rows > 0) {
      row->gap_m =
          std::max(row->gap_m, rows.residual.head(rows.translation_rows).cwiseAbs().maxCoeff());
    }
    const Pose X_FM =
        (home.X_WB[joint.parent] * joint.X_PF).inverse() * (home.X_WB[joint.child] * joint.X_CM);
    row->gap_rad = std::max(row->gap_rad, RotationGap(joint, X_FM));
  }
  const Mobility mobility = AnalyseMobility(m);
  row->dofs = mobility.dofs;
  row->redundant = mobility.redundant;
}

// Agreement of one mode; false with the reason in the row where it does not agree. `step_s`: of the
// simulation, or 0: the scenario's.
bool RunMode(const std::string& scenario, const char* mode, double* nrmse, SurveyRow* row,
             double step_s = 0.0) {
  RunOptions options;
  options.pictures = options.page = false;
  options.scenario.set.emplace_back("simulation.mode", mode);
  if (step_s > 0.0) {
    options.scenario.set.emplace_back("simulation.step_s", fmt::format("{:.9g}", step_s));
  }
  const RunOutcome outcome = RunScenario(scenario, options);
  if (!outcome.report) {
    row->status = "failed";
    row->message = fmt::format("{}: {}", mode, WithHint(FirstError(outcome.diagnostics)));
    return false;
  }
  const Comparison& comparison = outcome.report->comparison;
  if (const PairComparison* pair =
          comparison.FindPair(PairName(role::kSimulated, role::kReference))) {
    const auto force = pair->metrics.find(Metric::kForceNrmse);
    if (force != pair->metrics.end()) *nrmse = force->second.value;
  }
  for (const Caveat& caveat : comparison.caveats) {
    if (!Contains(row->caveats, caveat.text)) row->caveats.push_back(caveat.text);
  }
  if (comparison.verdict == Verdict::kAgree) return true;
  row->status = comparison.verdict == Verdict::kDisagree ? "disagree" : "failed";
  row->message = fmt::format("{}: {}", mode, comparison.reason);
  return false;
}

void Survey(const std::string& file, const std::string& scratch, const LoadOptions& options,
            SurveyRow* row) {
  // The robot as it is, before drives are added to it.
  LoadResult loaded = LoadRobot(file, options);
  if (!loaded.mechanism) {
    const Finding error = FirstError(loaded.diagnostics);
    row->message = WithHint(error);
    row->status = error.code == FindingCode::kOpenLoop ? "not_closed" : "refused";
    return;
  }
  MeasureHome(*loaded.mechanism, row);
  DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml", options);
  if (!made.setup) {
    row->message = WithHint(FirstError(made.diagnostics));
    row->status = "refused";
    return;
  }
  const std::filesystem::path folder(scratch);
  for (const auto& [name, text] : {std::pair("model.yaml", made.setup->model),
                                   std::pair("first.yaml", made.setup->scenario)}) {
    if (const std::string trouble = WriteFile(folder / name, text); !trouble.empty()) {
      row->message = trouble;
      return;
    }
  }
  const std::string scenario = (folder / "first.yaml").string();
  // What moves by forces has no inverse dynamics.
  const bool inverse =
      made.setup->by_forces > 0 || RunMode(scenario, "inverse", &row->inverse_nrmse, row);
  const std::string said = row->message, status = row->status;
  bool forward = RunMode(scenario, "forward", &row->forward_nrmse, row);
  // What diverges at the step of a first motion may be stiffer than others are.
  const bool diverged = inverse && !forward && row->status == "failed";
  for (const double step_ms : {0.25, 0.0625}) {
    if (!diverged || forward) break;
    SurveyRow again = *row;
    forward = RunMode(scenario, "forward", &again.forward_nrmse, &again, 1e-3 * step_ms);
    if (!forward) continue;
    again.caveats.push_back(
        fmt::format("the simulation follows the motion at {:g} ms, not at 1 ms", step_ms));
    *row = std::move(again);
  }
  if (!inverse) {
    row->message = said;
    row->status = status;
  } else if (forward) {
    row->status = "ok";
    row->message = AllWarnings(made.diagnostics);
  }
}

std::string Count(int n) { return n < 0 ? "" : fmt::format("{}", n); }
std::string Small(double x) { return std::isfinite(x) ? fmt::format("{:.2g}", x) : ""; }
std::string Seconds(double x) { return std::isfinite(x) ? fmt::format("{:.1f}", x) : ""; }

std::vector<std::string> Fields(const SurveyRow& row) {
  return {row.file,
          row.status,
          Count(row.bodies),
          Count(row.loops),
          Count(row.dofs),
          Count(row.redundant),
          Small(row.gap_m),
          Small(row.gap_rad),
          Small(row.inverse_nrmse),
          Small(row.forward_nrmse),
          Seconds(row.seconds),
          fmt::format("{}", fmt::join(row.caveats, "; ")),
          row.message};
}

std::string CountedOk(const std::vector<SurveyRow>& rows) {
  const auto ok = std::ranges::count(rows, "ok", &SurveyRow::status);
  const auto partly = std::ranges::count_if(
      rows, [](const SurveyRow& row) { return row.status == "ok" && !row.caveats.empty(); });
  std::string text = fmt::format("{} of {} ok", ok, rows.size());
  if (partly > 0) text += fmt::format(", {} of them with caveats", partly);
  return text;
}

// None where no robot came as far as a comparison.
Verdict VerdictOf(const std::vector<SurveyRow>& rows) {
  if (SurveyExit(rows) != 0) return Verdict::kDisagree;
  const bool any = std::ranges::count(rows, "ok", &SurveyRow::status) > 0;
  return any ? Verdict::kAgree : Verdict::kNotRun;
}

const std::vector<std::string> kSurveyColumns = {
    "file",    "status",        "bodies",        "loops",   "dof",     "redundant", "gap_m",
    "gap_rad", "inverse_nrmse", "forward_nrmse", "seconds", "caveats", "message"};

}  // namespace

SurveyRow SurveyFile(const std::string& file, const std::string& scratch,
                     const LoadOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  SurveyRow row;
  row.file = file;
  Survey(file, scratch, options, &row);
  row.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return row;
}

std::string SurveyJson(const std::vector<SurveyRow>& rows) {
  auto robots = nlohmann::ordered_json::array();
  const auto count = [](int n) {
    return n < 0 ? nlohmann::ordered_json() : nlohmann::ordered_json(n);
  };
  for (const SurveyRow& row : rows) {
    robots.push_back({{"file", row.file},
                      {"status", row.status},
                      {"bodies", count(row.bodies)},
                      {"loops", count(row.loops)},
                      {"dof", count(row.dofs)},
                      {"redundant", count(row.redundant)},
                      {"gap_m", Number(row.gap_m)},
                      {"gap_rad", Number(row.gap_rad)},
                      {"inverse_nrmse", Number(row.inverse_nrmse)},
                      {"forward_nrmse", Number(row.forward_nrmse)},
                      {"seconds", Number(row.seconds)},
                      {"caveats", row.caveats},
                      {"message", row.message}});
  }
  return Dump({{"robots", std::move(robots)}});
}

std::string SurveyCsv(const std::vector<SurveyRow>& rows) {
  std::string text;
  for (const std::string& column : kSurveyColumns) text += (text.empty() ? "" : ",") + column;
  for (const SurveyRow& row : rows) {
    std::string line;
    for (const std::string& field : Fields(row)) line += "," + CsvCell(field);
    text += "\n" + line.substr(1);
  }
  return text + "\n";
}

namespace {

// All rows; caveats and messages follow below each on a terminal.
Table TableOf(const std::vector<SurveyRow>& rows) {
  Table table;
  for (size_t k = 0; k < kSurveyColumns.size(); ++k) {
    Column& column = table.columns.emplace_back(Text(Spaced(kSurveyColumns[k])));
    column.number = k >= 2 && k <= 10;
    if (k > 10) column.on = On::kPage;
  }
  for (const SurveyRow& row : rows) {
    const std::vector<std::string> fields = Fields(row);
    std::vector<Cell>& cells = table.rows.emplace_back(fields.begin(), fields.end());
    cells[1].mark = row.status == "ok"        ? Mark::kOk
                    : row.status == "refused" ? Mark::kOff
                                              : Mark::kFail;
  }
  return table;
}

}  // namespace

std::string SurveyTable(const std::vector<SurveyRow>& rows) {
  const std::vector<std::string> lines = TextLines(TableOf(rows), {.indent = ""});
  std::string text = lines[0] + "\n";
  for (size_t i = 0; i < rows.size(); ++i) {
    text += lines[i + 1] + "\n";
    for (const std::string& caveat : rows[i].caveats) {
      text += fmt::format("    caveat: {}\n", Printable(caveat));
    }
    if (rows[i].status != "ok") text += fmt::format("    {}\n", Printable(rows[i].message));
  }
  return text + CountedOk(rows) + "\n";
}

std::string SurveyHtml(const std::vector<SurveyRow>& rows, const std::string& folder) {
  Table table = TableOf(rows);
  table.caption = "Robots below " + folder;
  Page page;
  page.Add("Robots", "Robots", ToHtml(table));
  return page.Write(
      {.kicker = "mbverify survey",
       .title = "Survey of " + folder,
       .lead = CountedOk(rows),
       .verdict = VerdictOf(rows),
       .footer = "ok: built, closed, and simulation and reference agree; refused: the file's own "
                 "faults, which its message names"});
}

int SurveyExit(const std::vector<SurveyRow>& rows) {
  int exit_code = 0;
  for (const SurveyRow& row : rows) {
    if (row.status == "failed") return 3;
    if (row.status != "ok" && row.status != "refused") exit_code = 1;
  }
  return exit_code;
}

// mbverify survey

namespace {

namespace fs = std::filesystem;

struct SurveyArguments {
  std::string folder, out;
  double timeout_s = 300.0;
  LoadOptions load;
  JsonOption json;
};

SurveyRow RowOf(const std::string& file, const std::string& scratch,
                const SurveyArguments& arguments) {
  const double timeout_s = arguments.timeout_s;
  const auto texts = InChildren(
      1, timeout_s, [&](size_t) { return ToBytes(SurveyFile(file, scratch, arguments.load)); });
  SurveyRow lost{.file = file};
  if (!texts[0]) {
    lost.message = fmt::format("ended by a crash, or not finished after {:g} s", timeout_s);
    return lost;
  }
  lost.message = "gave no readable result";
  return FromBytes<SurveyRow>(*texts[0]).value_or(lost);
}

int WriteSurvey(const SurveyArguments& arguments, const std::vector<SurveyRow>& rows) {
  const fs::path out(arguments.out);
  int exit_code = WriteWholeFile((out / "survey.csv").string(), SurveyCsv(rows), {});
  exit_code = WorseExit(exit_code, WriteWholeFile((out / "survey.html").string(),
                                                  SurveyHtml(rows, arguments.folder), {}));
  if (exit_code == 0) {
    Say(stderr, "wrote {0}/survey.csv and {0}/survey.html\n", out.string());
  }
  return exit_code;
}

// Why a file that looks like a robot is passed over; "" of a robot.
std::string SkippedReason(const std::string& file) {
  if (file.ends_with(".xacro")) return XacroHint(file);
  if (file.ends_with(".urdf")) return "";
  const auto text = ReadWholeFile(file);
  if (!text) return "it cannot be read";
  const auto has = [&](const char* tag) { return text->find(tag) != std::string::npos; };
  if (file.ends_with(".sdf")) return has("<model") || has("<include") ? "" : "it holds no <model>";
  // Not all XML is MJCF; parts of models that others include are no robots either.
  if (!has("<mujoco")) return "no MJCF: there is no <mujoco> in it";
  return has("<worldbody") ? "" : "a part of a model: there is no <worldbody> in it";
}

std::vector<InputFile> RobotFiles(const std::vector<std::string>& files) {
  std::vector<InputFile> inputs;
  inputs.reserve(files.size());
  for (const std::string& file : files) inputs.push_back({file, ""});
  return inputs;
}

int Survey(const SurveyArguments& arguments) {
  std::vector<std::string> unread;
  std::vector<std::string> files;
  for (const char* ending : {".urdf", ".xml", ".sdf", ".xacro"}) {
    for (const std::string& file : FilesBelow(arguments.folder, ending, &unread)) {
      const std::string why = SkippedReason(file);
      if (why.empty()) {
        files.push_back(file);
      } else {
        unread.push_back(fmt::format("{} is passed over: {}", file, why));
      }
    }
  }
  for (const std::string& line : unread) Say(stderr, "{}\n", line);
  // Robots of one folder share parts.
  std::vector<MeshPackage> open = MeshPackages();
  open.push_back({"", arguments.folder});
  UseMeshPackages(std::move(open));
  if (files.empty()) {
    Say(stderr, "{}: error: no *.urdf, *.sdf and no MJCF file in this folder\n", arguments.folder);
    return 2;
  }
  const ScratchFolder scratch("survey");
  if (!scratch.trouble().empty()) {
    Say(stderr, "error: {}\n", scratch.trouble());
    return 3;
  }
  std::vector<SurveyRow> rows;
  for (size_t i = 0; i < files.size(); ++i) {
    rows.push_back(RowOf(files[i], (scratch.path() / fmt::format("{}", i)).string(), arguments));
    rows.back().file = fs::path(files[i]).lexically_relative(arguments.folder).string();
    Say(stderr, "{} of {}: {} {}\n", i + 1, files.size(), rows.back().file, rows.back().status);
  }
  SayText(arguments.json.text(), SurveyTable(rows));
  const int exit_code =
      WorseExit(SurveyExit(rows), arguments.json.Write(SurveyJson(rows), RobotFiles(files)));
  return arguments.out.empty() ? exit_code : WorseExit(exit_code, WriteSurvey(arguments, rows));
}

}  // namespace

void AddSurveyCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SurveyArguments>();
  CLI::App* survey = app->add_subcommand(
      "survey", "All robots below a folder: do they load, close and agree in a first motion?");
  survey->add_option("folder", arguments->folder, "folder with .urdf, .sdf and MJCF files")
      ->required();
  survey->add_option("--out", arguments->out, "folder for survey.csv and survey.html");
  survey->add_option("--timeout", arguments->timeout_s, "wall time limit of a robot [s]")
      ->check(Positive())
      ->capture_default_str();
  AddToleranceOption(survey, &arguments->load.closure_tolerance_m);
  arguments->json.AddTo(survey);
  SetFooter(survey, {"survey my_robots --out out"},
            "0 all ok (caveats are listed), or refused for a fault of the file itself; 1 some "
            "disagree or do "
            "not close; 2 bad input; 3 some failed");
  survey->callback([arguments, exit_code] { *exit_code = Survey(*arguments); });
}

}  // namespace mbv
