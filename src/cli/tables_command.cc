// mbverify tables
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "cli/trust.h"
#include "core/output_folder.h"
#include "core/text.h"
#include "pipeline/tables.h"

namespace mbv {
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
  for (const PaperTable& table : outcome.tables) {
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
  for (const PaperTable& table : outcome.tables) {
    std::vector<std::string> columns;
    for (const PaperTableColumn& column : table.columns) columns.push_back(column.title);
    tables.push_back({{"name", table.name},
                      {"caption", table.caption},
                      {"columns", columns},
                      {"rows", table.rows}});
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
