// `mbverify sheet` as a user types it.
#include <fmt/format.h>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/output_folder.h"
#include "base/scratch_folder.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/sheet/sheet.h"
#include "report/document.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct SheetArguments {
  std::string scenario, out = "out";
  bool run = false;
  JsonOption json;
};

// One after the other: each uses all cores. What ends one of them is shown, and the row stays as
// it is.
void RunMissing(const std::vector<SheetCommand>& commands) {
  const ScratchFolder folder("sheet");
  if (!folder.trouble().empty()) {
    Say(stderr, "error: {}\n", folder.trouble());
    return;
  }
  std::vector<WorkerJob> jobs;
  for (size_t k = 0; k < commands.size(); ++k) {
    std::vector<std::string> argv = {ProgramToStart()};
    argv.insert(argv.end(), commands[k].begin(), commands[k].end());
    jobs.push_back({std::move(argv), folder.path() / fmt::format("{}.log", k)});
  }
  ProgressLine progress(true);
  WorkerPool pool;
  pool.timeout_s = std::numeric_limits<double>::infinity();
  pool.started = [&](size_t job) {
    const double share = static_cast<double>(job) / static_cast<double>(jobs.size());
    progress.active() ? progress.Show(ToText(commands[job]), share)
                      : Say(stderr, "{}\n", ToText(commands[job]));
  };
  pool.ended = [&](size_t job, const WorkerEnd& end) {
    if (end.exit_code == 0 || end.exit_code == 1) return;
    progress.Clear();
    SayText(stderr, ReadWholeFile(jobs[job].log).value_or(""));
    Say(stderr, "{}: {}\n", ToText(commands[job]),
        end.signal != 0 ? fmt::format("ended by signal {}", end.signal)
                        : fmt::format("exit code {}", end.exit_code));
  };
  (void)pool.Run(jobs);
}

int WriteSheet(const SheetArguments& arguments) {
  const std::string file = FindScenario(arguments.scenario);
  if (const int code = RefuseInput(arguments.json.path(), file); code != 0) return code;
  Diagnostics diagnostics;
  std::optional<Sheet> sheet = MakeSheet(file, arguments.out, &diagnostics);
  FindingPrinter findings(stderr);
  findings.Print(diagnostics);
  if (!sheet) return 2;
  if (arguments.run) {
    RunMissing(Missing(*sheet));
    sheet = MakeSheet(file, arguments.out, &diagnostics);
    if (!sheet) return 2;
  }
  std::FILE* to = arguments.json.text();
  SayText(to, ToText(*sheet, {.color = WantsColor(to), .columns = TerminalColumns(to)}));
  std::fflush(to);
  const std::string json = arguments.json.Text(ToJson(*sheet));
  OutputFolder folder(arguments.out, sheet->mechanism + "/sheet/" + sheet->scenario);
  if (const std::string trouble = folder.WriteAll({{"sheet.html", SheetPage(*sheet)},
                                                   {"sheet.pdf", SheetPdf(*sheet)},
                                                   {"sheet.json", json}});
      !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  Say(stderr, "results in {}\n", folder.target().string());
  return WorseExit(sheet->exit_code(), arguments.json.Write(json, InputsOf(file)));
}

}  // namespace

void AddSheetCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<SheetArguments>();
  CLI::App* sheet = app->add_subcommand(
      "sheet", "How credible are a scenario's results? A sheet of what was run, and what was not");
  sheet->add_option("scenario", arguments->scenario, "scenario file with a motion")->required();
  sheet->add_option("--out", arguments->out, "folder with the results of earlier commands")
      ->capture_default_str();
  sheet->add_flag("--run", arguments->run, "run what is missing or of another state");
  arguments->json.AddTo(sheet);
  SetFooter(sheet, {"sheet spr_tripod/default", "sheet my_robot/first.yaml --run"},
            "0 nothing failed, 1 something that was run failed, 2 bad input, 3 could not be "
            "written");
  sheet->callback([arguments, exit_code] { *exit_code = WriteSheet(*arguments); });
}

}  // namespace mbv
