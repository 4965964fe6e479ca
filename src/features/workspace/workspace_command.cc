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
#include "features/workspace/constraint_curves.h"
#include "features/workspace/joint_space.h"
#include "features/workspace/modes.h"
#include "features/workspace/set_report.h"
#include "features/workspace/workspace.h"
#include "model_file/load_model.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

struct WorkspaceArguments {
  std::string model, out = "out";
  std::string modes;  // "drives", "output", "all"; "": a set
  std::vector<std::string> set;
  bool no_pictures = false, joint_space = false;
  int jobs = 1;
  SetArguments set_of_poses;
  RobotArguments options;
  JsonOption json;
};

nlohmann::ordered_json OutcomeJson(const std::string& mechanism, bool agree,
                                   const std::vector<WorkspaceMeasure>& measures) {
  auto list = nlohmann::ordered_json::array();
  for (const WorkspaceMeasure& m : measures) {
    list.push_back({{"name", m.name},
                    {"value", Number(m.value)},
                    {"error", Number(m.error)},
                    {"unit", m.unit}});
  }
  return {{"mechanism", mechanism}, {"agree", agree}, {"measures", std::move(list)}};
}

// Those of a closed form that are of the same set.
std::vector<KnownMeasure> KnownOf(const WorkspaceOutcome& form, const SetQuestion& question,
                                  const ReachableSet& set) {
  std::vector<KnownMeasure> known;
  if (!form.summary.ok() || question.ranges_changed || question.boxed) return known;
  for (const BoundShare& share : set.shares) {
    if (share.bound >= 0 &&
        set.bounds[static_cast<size_t>(share.bound)].kind == SetBound::Kind::kType2) {
      return known;
    }
  }
  for (const WorkspaceMeasure& m : form.measures) {
    bool same = !m.over.empty() && m.over.size() == set.over.size();
    for (size_t k = 0; same && k < m.over.size(); ++k) {
      same = set.over[k] == question.output + "." + m.over[k];
    }
    for (const auto& [name, value] : m.at) {
      const auto at = std::ranges::find(set.held, question.output + "." + name);
      same = same && at != set.held.end() &&
             std::abs(set.held_values[at - set.held.begin()] - value) < 1e-12;
    }
    if (same) known.push_back({"closed form: " + m.name, m.value, m.error});
  }
  return known;
}

// The surface from the output's reference frame to the world.
std::vector<std::pair<TriangleMesh, std::string>> InWorld(
    const Mechanism& mechanism, const std::string& output_name,
    std::vector<std::pair<TriangleMesh, std::string>> surfaces) {
  const int index = mechanism.FindOutput(output_name);
  if (index < 0) return {};
  const Output& output = mechanism.outputs[static_cast<size_t>(index)];
  const Pose X_WR = mechanism.X_WB_home[static_cast<size_t>(output.reference_body)] * output.X_RbR;
  for (auto& [mesh, color] : surfaces) {
    for (Vec3& p : mesh.vertices) p = X_WR * p;
  }
  return surfaces;
}

using Files = std::vector<std::pair<std::string, std::string>>;

int WriteResults(const WorkspaceArguments& arguments, const std::string& mechanism,
                 const Files& files, bool agree, const nlohmann::ordered_json& json,
                 const std::vector<InputFile>& inputs) {
  OutputFolder folder(arguments.out, mechanism + "/workspace");
  if (const std::string trouble = folder.WriteAll(files); !trouble.empty()) {
    return NotWritten(trouble, "choose another folder with --out");
  }
  Say(stderr, "results in {}\n", folder.target().string());
  return WorseExit(agree ? 0 : 1, arguments.json.Write(json, inputs));
}

// Of any model, with the closed form's measures of the same set.
int SetOfPoses(const WorkspaceArguments& arguments, const Mechanism& mechanism,
               const ProgressFunction& progress, ProgressLine* line,
               const std::vector<InputFile>& inputs) {
  SetArguments asked = arguments.set_of_poses;
  asked.flood.threads = arguments.jobs;
  Diagnostics diagnostics;
  const auto question = ReadQuestion(mechanism, asked, &diagnostics);
  SayText(stderr, diagnostics.Text());
  if (!question) return 2;
  SetReport report;
  report.mechanism = mechanism.name;
  report.set = ComputeReachableSet(*question, asked, progress);
  line->Clear();
  SayText(stderr, report.set.diagnostics.Text());
  if (report.set.diagnostics.has_errors()) return 2;
  if (!report.set.summary.ok()) {
    Say(stderr, "error: {}\n", report.set.verdict);
    const Stop stop = report.set.summary.stop;
    return stop == Stop::kUnsupported || stop == Stop::kUnreachable ? 2 : 3;
  }
  report.quality = MapQuality(*question, report.set, question->output, arguments.jobs,
                              StageOf(progress, "qualities"));
  report.constraint = ConstraintCurves(*question, report.set);
  line->Clear();
  WorkspaceOutcome form;
  if (FindWorkspaceForm(mechanism.name) != nullptr) {
    form = ComputeWorkspace(mechanism, false, arguments.jobs, progress);
    line->Clear();
    report.known = KnownOf(form, *question, report.set);
  }
  std::FILE* to = arguments.json.text();
  SayText(to, ToText(report, {.color = WantsColor(to), .columns = TerminalColumns(to)}));
  Files files = SetFiles(report);
  const auto surfaces = InWorld(mechanism, question->output, ColoredSurface(report.set));
  if (!arguments.no_pictures && !surfaces.empty()) {
    const RunSummary drawn =
        DrawInside(mechanism, surfaces, mechanism.name + " / reachable set", "reachable", &files);
    if (!drawn.ok()) Say(stderr, "warning: no pictures: {}\n", drawn.message);
  }
  nlohmann::ordered_json json = OutcomeJson(mechanism.name, report.agree(), form.measures);
  json["set"] = ToJson(report);
  return WriteResults(arguments, mechanism.name, files, report.agree(), json, inputs);
}

// Of one pose: in how many ways its drives, or its coordinates, can be had; and type-2 curves over
// two drives.
int WaysToClose(const WorkspaceArguments& arguments, const Mechanism& mechanism,
                const ProgressFunction& progress, ProgressLine* line,
                const std::vector<InputFile>& inputs) {
  Diagnostics diagnostics;
  const auto question = ReadQuestion(mechanism, arguments.set_of_poses, &diagnostics);
  if (arguments.set_of_poses.any_of_set() || (arguments.joint_space && !arguments.modes.empty())) {
    diagnostics.AddError(arguments.joint_space ? "--joint-space" : "--modes",
                         "it asks for another thing than a set of poses",
                         "leave out --resolution, --cone, --cross-singularities and the other one "
                         "of --modes and --joint-space");
  }
  nlohmann::ordered_json json = OutcomeJson(mechanism.name, true, {});
  Files files;
  std::string text;
  std::FILE* to = arguments.json.text();
  const TextStyle style = {.color = WantsColor(to), .columns = TerminalColumns(to)};
  RunSummary summary = RunSummary::Done();
  if (!diagnostics.has_errors() && arguments.joint_space) {
    const JointSpaceCurves curves =
        JointSpaceOf(*question, arguments.jobs, StageOf(progress, "type-2 curves"), &diagnostics);
    summary = curves.summary;
    if (!diagnostics.has_errors()) {
      text = ToText(mechanism, curves, style);
      json["joint_space"] = ToJson(mechanism, curves);
      files = JointSpaceFiles(mechanism, curves);
    }
  } else if (!diagnostics.has_errors()) {
    const ModesOfPose modes =
        FindModesOfPose(*question, arguments.modes != "output", arguments.modes != "drives",
                        arguments.jobs, progress, &diagnostics);
    text = ToText(mechanism, modes, style);
    json["modes"] = ToJson(mechanism, modes);
    files = ModeFiles(mechanism, modes);
  }
  line->Clear();
  SayText(stderr, diagnostics.Text());
  if (diagnostics.has_errors()) return 2;
  SayText(to, text);
  if (!summary.ok()) {
    Say(stderr, "error: {}\n", summary.message);
    return 3;
  }
  return WriteResults(arguments, mechanism.name, files, true, json, inputs);
}

int Workspace(const WorkspaceArguments& arguments) {
  const InputWatch inputs;
  std::optional<LoadResult> loaded =
      LoadModelOrRefuse(arguments.model, arguments.set, arguments.options);
  if (!loaded) return 2;
  AddMotorsOfJoints(loaded->motors_of_joints, &*loaded->mechanism);
  const Mechanism& mechanism = *loaded->mechanism;
  ProgressLine line(true);
  ProgressFunction progress;
  if (line.active()) {
    progress = [&](const std::string& what, double fraction) { line.Show(what, fraction); };
  }
  if (!arguments.modes.empty() || arguments.joint_space) {
    return WaysToClose(arguments, mechanism, progress, &line, inputs.files());
  }
  if (arguments.set_of_poses.any() || FindWorkspaceForm(mechanism.name) == nullptr) {
    return SetOfPoses(arguments, mechanism, progress, &line, inputs.files());
  }
  const WorkspaceOutcome outcome =
      ComputeWorkspace(mechanism, !arguments.no_pictures, arguments.jobs, progress);
  line.Clear();
  SayText(stderr, outcome.diagnostics.Text());
  if (outcome.diagnostics.has_errors()) return 2;
  SayText(arguments.json.text(), outcome.text);
  if (!outcome.summary.ok()) {
    Say(stderr, "error: {}\n", outcome.summary.message);
    return outcome.summary.stop == Stop::kUnsupported ? 2 : 3;
  }
  return WriteResults(arguments, mechanism.name, outcome.files, outcome.agree,
                      OutcomeJson(mechanism.name, outcome.agree, outcome.measures), inputs.files());
}

}  // namespace

void AddWorkspaceCommand(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<WorkspaceArguments>();
  arguments->jobs = AllCores();
  SetArguments& asked = arguments->set_of_poses;
  CLI::App* workspace = app->add_subcommand(
      "workspace", "Where a model reaches and what ends it; how well it moves and carries there");
  workspace
      ->add_option("model", arguments->model,
                   "model name, model.yaml, .urdf, MJCF (.xml) or .sdf file; " +
                       Joined(WorkspaceMechanisms()) + " without --over: by closed forms")
      ->required();
  const auto list = [&](const char* name, std::vector<std::string>* values, const char* text) {
    workspace->add_option(name, *values, text)->delimiter(',')->allow_extra_args(false);
  };
  workspace->add_option("--output", asked.output, "whose poses are asked (default: the first)");
  list("--over", &asked.over,
       "one to three coordinates that are free: x,y,z,roll,pitch,yaw of the output, drives, "
       "joints; x_mm=-100:100 within a box (repeatable)");
  list("--at", &asked.at, "NAME=VALUE (NAME_mm, NAME_deg): held there; others stay at home");
  list("--for-all", &asked.for_all,
       "NAME=LOW:HIGH: places reached with all values of the range (total orientation)");
  list("--for-some", &asked.for_some,
       "NAME=LOW:HIGH: places reached with some of them (inclusion orientation)");
  list("--from", &asked.from, "NAME=VALUE: a pose of the set, where home is none");
  list("--range", &asked.ranges, "NAME=LOW:HIGH of a drive or joint, instead of the model's");
  list("--cone", &asked.cones,
       "JOINT_deg=ANGLE: the joint's axis z (or JOINT.x_deg, JOINT.y_deg) stays within it");
  workspace->add_flag("--cross-singularities", asked.cross_singularities,
                      "poses where the drives lose their hold (type 2) end nothing");
  workspace
      ->add_option("--modes", arguments->modes,
                   "instead of a set: in how many ways the pose's drives can be had (drives: "
                   "assembly modes), or its coordinates (output: working modes), or both (all)")
      ->check(CLI::IsMember({"drives", "output", "all"}));
  workspace->add_flag("--joint-space", arguments->joint_space,
                      "instead of a set: type-2 curves over the two drives of --over, the others "
                      "held, with their cusps");
  workspace
      ->add_option("--resolution", asked.flood.resolution,
                   "finest cells across the set; otherwise 400, 240 or 64 by its dimension")
      ->check(CLI::Range(8, 100000));
  workspace->add_option("--set", arguments->set, "PARAMETER=VALUE of the model (repeatable)")
      ->allow_extra_args(false);
  AddRobotOptions(workspace, &arguments->options);
  workspace->add_option("--out", arguments->out, "result folder")->capture_default_str();
  workspace->add_option("--jobs", arguments->jobs, "processes or threads at once")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  arguments->json.AddTo(workspace);
  workspace->add_flag("--no-pictures", arguments->no_pictures, "data files only");
  SetFooter(workspace,
            {"workspace spr_tripod --set q_min=0.45 --set q_max=0.65",
             "workspace stewart --over x,y --at z=0.7 --range leg1=0.5:0.8",
             "workspace my_robot.urdf --output foot --over roll,pitch"},
            "0 the ways to a measure agree, 1 they contradict each other, 2 bad input, 3 could not "
            "run");
  workspace->callback([arguments, exit_code] { *exit_code = Workspace(*arguments); });
}

}  // namespace mbv
