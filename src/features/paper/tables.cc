#include "features/paper/tables.h"

#include <fmt/format.h>
#include <filesystem>
#include <memory>

#include "base/output_folder.h"
#include "base/text.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/run/run_scenario.h"
#include "kinematics/mobility.h"
#include "model_file/yaml/yaml_reader.h"
#include "verify/check_file.h"

namespace mbv {
namespace {

constexpr int kDeepestParametersFrom = 16;

// A parameter by the name that it has in the mechanism.
void AddStated(const YamlEntry& entry, const std::string& name,
               std::map<std::string, StatedNumber>* stated) {
  const YamlNode* value = entry.value.get();
  const YamlNode* unit = nullptr;
  const UnitSuffix* suffix = &kPlain;
  if (value->is_map()) {
    unit = value->Find("unit");
    const YamlNode* map = value;
    value = map->Find("value");
    for (const auto& [key, other] : {std::pair{"value_deg", &kDeg}, {"value_mm", &kMm}}) {
      if (const YamlNode* found = map->Find(key)) value = found, suffix = other;
    }
  }
  stated->erase(name);  // an expression of a nearer file replaces a number
  if (value == nullptr || !value->is_scalar()) return;
  const auto number = PlainNumber(value->text);
  if (!number) return;
  const std::string own = unit != nullptr && unit->is_scalar() ? unit->text : "";
  const std::string shown = suffix == &kDeg ? "deg" : suffix == &kMm ? "mm" : own;
  (*stated)[name] = {value->text, shown, suffix->to_si(*number)};
}

// The unit that a part's parameter says it has, for a value that an instance gives it.
std::string UnitOfPart(const YamlNode& value) {
  const YamlNode* unit = value.is_map() ? value.Find("unit") : nullptr;
  return unit != nullptr && unit->is_scalar() ? unit->text : "";
}

// "limb1.m": what the instance says, else what its part does; `around`: "" or "limb1.".
void ReadInstances(const YamlNode* parts, const YamlNode& block, const std::string& around,
                   int depth, std::map<std::string, StatedNumber>* stated) {
  const YamlNode* instances = block.Find("instances");
  if (parts == nullptr || instances == nullptr || depth > kDeepestParametersFrom) return;
  for (const YamlEntry& instance : instances->entries) {
    const YamlNode* named = instance.value->Find("part");
    const YamlNode* part = named == nullptr ? nullptr : parts->Find(named->text);
    if (part == nullptr) continue;
    const std::string prefix = around + instance.key + ".";
    const YamlNode* parameters = part->Find("parameters");
    if (parameters != nullptr) {
      for (const YamlEntry& entry : parameters->entries) {
        AddStated(entry, prefix + entry.key, stated);
        const YamlNode* given = instance.value->Find(entry.key);
        if (given == nullptr) continue;
        stated->erase(prefix + entry.key);
        const auto number = given->is_scalar() ? PlainNumber(given->text) : std::nullopt;
        if (!number) continue;
        (*stated)[prefix + entry.key] = {given->text, UnitOfPart(*entry.value), *number};
      }
    }
    ReadInstances(parts, *part, prefix, depth + 1, stated);
  }
}

// The files that parameters come from, those behind first.
void ReadStated(const std::string& file, int depth, std::map<std::string, StatedNumber>* stated) {
  if (depth > kDeepestParametersFrom) return;
  YamlReader yaml(file);
  const auto text = yaml.ReadFile();
  const YamlNodePtr root = text ? yaml.Parse(*text) : nullptr;
  if (root == nullptr || !root->is_map()) return;
  const YamlNode* from = root->Find("parameters_from");
  if (from != nullptr && from->is_scalar()) {
    const auto path = std::filesystem::path(file).parent_path() / from->text;
    ReadStated(path.lexically_normal().string(), depth + 1, stated);
  }
  if (depth == 0) ReadInstances(root->Find("parts"), *root, "", 0, stated);
  const YamlNode* parameters = root->Find("parameters");
  if (parameters == nullptr || !parameters->is_map()) return;
  for (const YamlEntry& entry : parameters->entries) AddStated(entry, entry.key, stated);
}

class TableMaker {
 public:
  TableMaker(const TablesOptions& options, TablesOutcome* outcome)
      : options_(options), outcome_(*outcome) {}

  void OfMechanism(const Mechanism& mechanism) {
    if (Wanted("parameters")) {
      Table table = ParameterTable(mechanism.parameters, StatedNumbers(mechanism.file));
      table.caption = fmt::format("Parameters of {} in {}", mechanism.name, outcome_.scenario);
      Add(std::move(table), "the model has no parameters");
    }
    if (Wanted("mobility")) Add(MobilityTable(mechanism, ReportMobility(mechanism)), "");
  }

  void OfRun(const ResultView& view, const Report* report) {
    if (Wanted("checks")) Add(CheckTable(view), "nothing was compared");
    if (!Wanted("sizing")) return;
    if (report == nullptr) {
      outcome_.left_out.push_back("sizing: a stiffness asks nothing of motors");
    } else {
      Add(SizingTable(*report), "the model states no motors");
    }
  }

 private:
  [[nodiscard]] bool Wanted(const char* name) const {
    return options_.only.empty() || Contains(options_.only, name);
  }

  void Add(Table table, const std::string& without_rows) {
    if (table.rows.empty()) {
      outcome_.left_out.push_back(table.name + ": " + without_rows);
      return;
    }
    Table labelled = table;
    labelled.name = outcome_.mechanism + "_" + outcome_.scenario + "_" + table.name;
    for (const std::string& format : options_.formats) {
      outcome_.files.emplace_back(table.name + "." + format,
                                  format == "tex" ? ToLatex(labelled) : ToMarkdown(labelled));
    }
    outcome_.tables.push_back(std::move(table));
  }

  const TablesOptions& options_;
  TablesOutcome& outcome_;
};

// The mechanism of a scenario of any kind, as it runs.
std::optional<Mechanism> MechanismOf(const std::string& file, const ScenarioOptions& options) {
  Diagnostics run_findings;
  const DocumentKind& kind = KindOf(file);
  return kind.mechanism != nullptr ? kind.mechanism(file, options, &run_findings) : std::nullopt;
}

}  // namespace

const std::vector<std::string>& TableFormats() {
  static const std::vector<std::string> words = {"tex", "md"};
  return words;
}

const std::vector<std::string>& TableNames() {
  static const std::vector<std::string> words = {"parameters", "mobility", "checks", "sizing"};
  return words;
}

std::map<std::string, StatedNumber> StatedNumbers(const std::string& model_file) {
  std::map<std::string, StatedNumber> stated;
  if (model_file.ends_with(".yaml")) ReadStated(model_file, 0, &stated);
  return stated;
}

TablesOutcome MakeTables(const std::string& file, const TablesOptions& options) {
  TablesOutcome outcome;
  RunOptions run;
  run.scenario = options.scenario;
  run.programs = options.programs;
  run.pictures = run.page = false;
  run.progress = options.progress;
  const RunOutcome ran = RunScenario(file, run);
  outcome.exit_code = ran.exit_code;
  outcome.diagnostics = ran.diagnostics;
  const std::optional<ResultView> view = ran.View();
  if (!view) return outcome;
  const auto mechanism = MechanismOf(file, options.scenario);
  if (!mechanism) return outcome;
  outcome.mechanism = view->frame->mechanism;
  outcome.scenario = view->frame->scenario;
  outcome.verdict = ToText(view->verdict);
  TableMaker maker(options, &outcome);
  maker.OfMechanism(*mechanism);
  maker.OfRun(*view, ran.report ? &*ran.report : nullptr);
  return outcome;
}

// mbverify tables

namespace {

struct TablesArguments {
  std::vector<std::string> scenarios, set, formats = {"tex", "md"}, only;
  std::string out = "tables";
  bool trust = false;
  JsonOption json;
};

// What was written, one table a line; "" or what went wrong.
std::string WriteTables(const TablesArguments& arguments, const TablesOutcome& outcome,
                        std::string* written) {
  for (const Table& table : outcome.tables) {
    Say(arguments.json.text(), "{:<12} {} rows: {}\n", table.name, table.rows.size(),
        table.caption);
  }
  for (const std::string& text : outcome.left_out) {
    Say(arguments.json.text(), "left out: {}\n", text);
  }
  if (outcome.files.empty()) return "";
  OutputFolder folder(arguments.out, outcome.mechanism + "/" + outcome.scenario);
  if (std::string trouble = folder.WriteAll(outcome.files); !trouble.empty()) return trouble;
  *written = folder.target().string();
  Say(stderr, "tables in {}\n", *written);
  return "";
}

nlohmann::ordered_json TablesJson(const std::string& file, const TablesOutcome& outcome,
                                  const std::string& folder) {
  auto tables = nlohmann::ordered_json::array();
  for (const Table& table : outcome.tables) {
    std::vector<std::string> columns;
    for (const Column& column : table.columns) columns.push_back(column.title);
    auto rows = nlohmann::ordered_json::array();
    for (const auto& row : table.rows) rows.push_back(Texts(row));
    tables.push_back({{"name", table.name},
                      {"caption", table.caption},
                      {"columns", columns},
                      {"rows", std::move(rows)}});
  }
  std::vector<std::string> files;
  for (const auto& [name, content] : outcome.files) files.push_back(name);
  return {{"scenario_file", file},
          {"exit_code", outcome.exit_code},
          {"verdict", outcome.verdict},
          {"folder", folder},
          {"files", files},
          {"tables", std::move(tables)},
          {"left_out", outcome.left_out},
          {"findings", FindingObjects(outcome.diagnostics)}};
}

int Tables(const TablesArguments& arguments) {
  TablesOptions options{.scenario = {},
                        .programs = {},
                        .formats = arguments.formats,
                        .only = arguments.only,
                        .progress = {}};
  if (!ReadAssignments(arguments.set, "--set", "simulation.step_s=0.002", &options.scenario.set))
    return 2;
  int exit_code = 0;
  const std::vector<std::string> files =
      FilesToRun(arguments.scenarios, {arguments.json.path()}, &exit_code);
  if (exit_code == 0) {
    exit_code = AskForPrograms(files, options.scenario, arguments.trust, false, &options.programs);
  }
  if (exit_code != 0) return exit_code;
  FindingPrinter findings(stderr);
  auto results = nlohmann::ordered_json::array();
  for (const std::string& file : files) {
    const TablesOutcome outcome = MakeTables(file, options);
    findings.Print(outcome.diagnostics);
    std::string folder;
    if (const std::string lost = WriteTables(arguments, outcome, &folder); !lost.empty()) {
      return NotWritten(lost, "choose another folder with --out");
    }
    exit_code = WorseExit(exit_code, outcome.exit_code);
    results.push_back(TablesJson(file, outcome, folder));
  }
  return WorseExit(exit_code,
                   arguments.json.Write({{"exit_code", exit_code}, {"results", results}}, {}));
}

}  // namespace

void AddTablesCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<TablesArguments>();
  CLI::App* tables = app->add_subcommand(
      "tables", "Tables for a paper: parameters, mobility, checks, motors as LaTeX and Markdown");
  tables->add_option("scenario", arguments->scenarios, "scenario files or folders of them")
      ->required();
  tables->add_option("--formats", arguments->formats, "files of each table")
      ->delimiter(',')
      ->check(OneOf(TableFormats()))
      ->capture_default_str();
  tables->add_option("--only", arguments->only, "the tables that are wanted")
      ->delimiter(',')
      ->check(OneOf(TableNames()));
  tables->add_option("--out", arguments->out, "folder for the tables")->capture_default_str();
  AddTrustOption(tables, &arguments->trust);
  arguments->json.AddTo(tables);
  tables
      ->add_option("--set", arguments->set,
                   "key=value: overrides a value of the scenario (repeatable)")
      ->allow_extra_args(false);
  SetFooter(tables,
            {"tables scenarios/stabilizing_platform/sea_state.yaml",
             "tables scara_robot/stiffness --formats tex --only parameters,checks"},
            "0 agree, 1 disagree (written all the same), 2 bad input, 3 could not run, 4 internal "
            "error");
  tables->callback([arguments, exit_code] { *exit_code = Tables(*arguments); });
}

}  // namespace mbv
