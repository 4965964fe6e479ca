// mbverify history
#include <fmt/format.h>

#include <memory>

#include "cli/cli.h"
#include "cli/files.h"
#include "cli/json_option.h"
#include "cli/terminal.h"
#include "regress/history.h"

namespace mbv {
namespace {

struct HistoryArguments {
  std::string history = "out/regress/history.sqlite";
  std::string run_a, run_b, csv, scenario, note;
  JsonOption json;
};

int Show(const HistoryText& answer, const HistoryArguments& arguments) {
  SayText(arguments.json.text(), answer.text);
  if (answer.trouble.empty()) return arguments.json.Write(answer.json, {{arguments.history, ""}});
  Say(stderr, "error: {}\n", answer.trouble);
  return 2;
}

int Export(const HistoryArguments& arguments) {
  const HistoryText answer = HistoryCsv(arguments.history);
  if (!answer.trouble.empty()) return Show(answer, arguments);
  if (arguments.csv.empty()) {
    fmt::print("{}", answer.text);
    return 0;
  }
  return WriteWholeFile(arguments.csv, answer.text, {{arguments.history, ""}});
}

}  // namespace

void AddHistoryCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<HistoryArguments>();
  CLI::App* history = app->add_subcommand("history", "Ask the history of regress");
  history->add_option("--history", arguments->history, "SQLite file")->capture_default_str();
  history->require_subcommand(1);
  history->fallthrough();
  CLI::App* list = history->add_subcommand("list", "All runs");
  list->callback(
      [arguments, exit_code] { *exit_code = Show(ListRuns(arguments->history), *arguments); });
  CLI::App* compare = history->add_subcommand("compare", "What differs between two runs");
  compare->add_option("run1", arguments->run_a, "number, last or last~1")->required();
  compare->add_option("run2", arguments->run_b, "number, last or last~1")->required();
  compare->callback([arguments, exit_code] {
    *exit_code =
        Show(CompareRuns(arguments->history, arguments->run_a, arguments->run_b), *arguments);
  });
  CLI::App* csv = history->add_subcommand("export", "All metrics of all runs as CSV");
  csv->add_option("--csv", arguments->csv, "write to this file instead of stdout");
  csv->callback([arguments, exit_code] { *exit_code = Export(*arguments); });
  CLI::App* accept =
      history->add_subcommand("accept", "Start baselines with a run: drift is meant");
  accept->add_option("run", arguments->run_a, "number, last or last~1")->required();
  accept->add_option("--scenario", arguments->scenario, "only this one, e.g. spr_tripod/default");
  accept->add_option("--note", arguments->note, "why");
  accept->callback([arguments, exit_code] {
    *exit_code =
        Show(AcceptRun(arguments->history, arguments->run_a, arguments->scenario, arguments->note),
             *arguments);
  });
  for (CLI::App* asked : {list, compare}) arguments->json.AddTo(asked);
  const char* codes = "0 done, 2 bad input";
  SetFooter(list, {"history list", "history list --history nightly.sqlite"}, codes);
  SetFooter(compare, {"history compare last~1 last", "history compare 3 7"}, codes);
  SetFooter(csv, {"history export --csv metrics.csv"}, codes);
  SetFooter(accept, {"history accept last --scenario spr_tripod/default --note \"stiffer legs\""},
            codes);
  SetFooter(history,
            {"history list", "history compare last~1 last --history nightly.sqlite",
             "history export --csv metrics.csv"},
            codes);
}

}  // namespace mbv
