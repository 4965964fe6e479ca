// mbverify workspace
#include <fmt/format.h>

#include <memory>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/workspace/workspace.h"
#include "model_file/load_model.h"
#include "scenario/find_model.h"

namespace mbv {
namespace {

struct WorkspaceArguments {
  std::string model, out = "out";
  std::vector<std::string> set;
  bool no_pictures = false;
  int jobs = 1;
  JsonOption json;
};

nlohmann::ordered_json OutcomeJson(const std::string& mechanism, const WorkspaceOutcome& outcome) {
  auto measures = nlohmann::ordered_json::array();
  for (const WorkspaceMeasure& m : outcome.measures) {
    measures.push_back({{"name", m.name},
                        {"value", Number(m.value)},
                        {"error", Number(m.error)},
                        {"unit", m.unit}});
  }
  return {{"mechanism", mechanism}, {"agree", outcome.agree}, {"measures", std::move(measures)}};
}

int Workspace(const WorkspaceArguments& arguments) {
  const auto file = FindModelOrRefuse(arguments.model);
  if (!file) return 2;
  LoadOptions options;
  if (!ReadParameters(arguments.set, &options)) return 2;
  const LoadResult loaded = LoadModel(*file, options);
  SayText(stderr, loaded.diagnostics.Text());
  if (!loaded.mechanism) return 2;
  ProgressLine line(true);
  ProgressFunction progress;
  if (line.active()) {
    progress = [&](const std::string& what, double fraction) { line.Show(what, fraction); };
  }
  const WorkspaceOutcome outcome =
      ComputeWorkspace(*loaded.mechanism, !arguments.no_pictures, arguments.jobs, progress);
  line.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.diagnostics.has_errors()) return 2;
  SayText(arguments.json.text(), outcome.text);
  if (!outcome.summary.ok()) {
    Say(stderr, "error: {}\n", outcome.summary.message);
    return outcome.summary.stop == Stop::kUnsupported ? 2 : 3;
  }
  OutputFolder folder(arguments.out, loaded.mechanism->name + "/workspace");
  if (const std::string trouble = folder.WriteAll(outcome.files); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  Say(stderr, "results in {}\n", folder.target().string());
  return WorseExit(
      outcome.agree ? 0 : 1,
      arguments.json.Write(OutcomeJson(loaded.mechanism->name, outcome), {{*file, ""}}));
}

}  // namespace

void AddWorkspaceCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<WorkspaceArguments>();
  arguments->jobs = AllCores();
  CLI::App* workspace =
      app->add_subcommand("workspace", "Reachable workspace: measures, meshes, sections, pictures");
  workspace
      ->add_option("model", arguments->model,
                   Joined(WorkspaceMechanisms()) + ", or a model.yaml of one")
      ->required();
  workspace->add_option("--set", arguments->set, "PARAMETER=VALUE of the model (repeatable)")
      ->allow_extra_args(false);
  workspace->add_option("--out", arguments->out, "result folder")->capture_default_str();
  workspace->add_option("--jobs", arguments->jobs, "processes at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  arguments->json.AddTo(workspace);
  workspace->add_flag("--no-pictures", arguments->no_pictures, "data files only");
  SetFooter(workspace, {"workspace spr_tripod --set q_min=0.45 --set q_max=0.65"},
            "0 the ways to a measure agree, 1 they contradict each other, 2 bad input, 3 could not "
            "run");
  workspace->callback([arguments, exit_code] { *exit_code = Workspace(*arguments); });
}

}  // namespace mbv
