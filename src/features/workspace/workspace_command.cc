// mbverify workspace
#include <fmt/format.h>

#include <charconv>
#include <memory>

#include "base/json_text.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "cli/cli.h"
#include "cli/files.h"
#include "cli/options.h"
#include "cli/terminal.h"
#include "features/workspace/best_design.h"
#include "features/workspace/joint_space.h"
#include "features/workspace/modes.h"
#include "features/workspace/set_report.h"
#include "features/workspace/workspace.h"
#include "math/resume.h"
#include "model_file/load_model.h"
#include "model_file/yaml/yaml_reader.h"
#include "scenario/find_model.h"
#include "verify/model_text.h"
#include "verify/version.h"

namespace mbv {
namespace {

struct WorkspaceArguments {
  std::string model, out = "out";
  std::string modes;  // "drives", "output", "all"; "": a set
  std::string way;    // "output=3": of modes, where the set begins
  std::vector<std::string> set, formats;
  std::string style = "ieee";
  bool no_pictures = false, joint_space = false, local = false;
  std::string maximise;
  std::vector<std::string> over_parameters;
  int evaluations = 0;
  unsigned long seed = 1;
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

// Of all that a set depends on.
std::string IdentityOf(const WorkspaceArguments& arguments, const std::vector<InputFile>& inputs) {
  const SetArguments& asked = arguments.set_of_poses;
  const RobotArguments& robot = arguments.options;
  Fingerprint sum;
  sum.AddFile(ProgramFile());  // another build of the same version may find other numbers
  for (const auto& [name, version] : Versions()) sum.Add(name + " " + version);
  for (const InputFile& input : inputs) sum.Add(input.fingerprint);
  for (const auto& list :
       {arguments.set, arguments.over_parameters, asked.over, asked.at, asked.from, asked.ranges,
        asked.cones, asked.for_all, asked.for_some, robot.assembly, robot.plants}) {
    sum.Add(fmt::format("{}", list.size()));
    for (const std::string& text : list) sum.Add(text);
  }
  for (const std::string& text : {asked.output, robot.base, arguments.way}) sum.Add(text);
  sum.Add(fmt::format("{} {} {} {} {} {} {} {}", asked.clearance, asked.cross_singularities,
                      asked.flood.resolution, robot.free_base, robot.closure_tolerance_m,
                      arguments.local, arguments.evaluations, arguments.seed));
  return sum.Text();
}

// Beside the results; found again by whoever asks the same. Null after a message.
std::unique_ptr<ResumeFolder> ResumeFolderOf(const WorkspaceArguments& arguments,
                                             const std::string& mechanism,
                                             const std::vector<InputFile>& inputs) {
  auto folder = std::make_unique<ResumeFolder>(
      std::filesystem::path(arguments.out) / mechanism / "workspace.part",
      IdentityOf(arguments, inputs));
  if (folder->taken()) {
    (void)Refuse("another process computes a workspace of this model there",
                 "choose another folder with --out");
    return nullptr;
  }
  if (folder->resumes()) Say(stderr, "goes on with what an interrupted run left\n");
  return folder;
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

// "output=3": the set begins at that way to close.
bool BeginAtWay(const WorkspaceArguments& arguments, const SetArguments& asked,
                const ProgressFunction& progress, std::optional<SetQuestion>* question,
                Diagnostics* diagnostics) {
  const std::string where = "--way " + arguments.way;
  const size_t equals = arguments.way.find('=');
  const std::string same = arguments.way.substr(0, equals);
  const std::string number = arguments.way.substr(std::min(equals, arguments.way.size() - 1) + 1);
  size_t n = 0;
  const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), n);
  if ((same != "drives" && same != "output") || error != std::errc() ||
      end != number.data() + number.size() || n < 1) {
    diagnostics->AddError(where, "a way to close is needed", "--way output=2, as --modes lists it");
    return false;
  }
  const ModesOfPose found = FindModesOfPose(**question, same == "drives", same == "output",
                                            arguments.jobs, progress, diagnostics);
  if (diagnostics->has_errors()) return false;
  const std::vector<AssemblyMode>& modes = found.of.front().second.modes;
  if (n > modes.size()) {
    diagnostics->AddError(where, fmt::format("{} ways are found", modes.size()),
                          "--modes " + same + " lists them");
    return false;
  }
  *question = ReadQuestion(WithHomeAt((*question)->mechanism, modes[n - 1]), asked, diagnostics);
  if (*question) {
    (*question)->notes.push_back(
        fmt::format("home is way {} of {} for the same {}", n, modes.size(), same));
  }
  return question->has_value();
}

// Of any model, with the closed form's measures of the same set.
int SetOfPoses(const WorkspaceArguments& arguments, const Mechanism& mechanism,
               const ProgressFunction& progress, ProgressLine* line,
               const std::vector<InputFile>& inputs) {
  SetArguments asked = arguments.set_of_poses;
  asked.flood.threads = arguments.jobs;
  Diagnostics diagnostics;
  auto question = ReadQuestion(mechanism, asked, &diagnostics);
  if (question && !arguments.way.empty()) {
    (void)BeginAtWay(arguments, asked, progress, &question, &diagnostics);
    line->Clear();
  }
  SayText(stderr, diagnostics.Text());
  if (!question || diagnostics.has_errors()) return 2;
  const auto folder = ResumeFolderOf(arguments, mechanism.name, inputs);
  if (!folder) return 2;
  SetReport report;
  report.mechanism = mechanism.name;
  report.set =
      ComputeReachableSet(*question, asked, progress, folder.get(),
                          {.announce = [](const std::string& text) { Say(stderr, "{}\n", text); }});
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
  report.constraint_surface = SingularSurface(*question, report.set, SetBound::Kind::kConstraint);
  report.type2_surface = SingularSurface(*question, report.set, SetBound::Kind::kType2);
  line->Clear();
  WorkspaceOutcome form;
  if (FindWorkspaceForm(mechanism.name) != nullptr) {
    form = ComputeWorkspace(mechanism, false, arguments.jobs, progress);
    line->Clear();
    if (arguments.way.empty()) report.known = KnownOf(form, *question, report.set);
  }
  std::FILE* to = arguments.json.text();
  SayText(to, ToText(report, {.color = WantsColor(to), .columns = TerminalColumns(to)}));
  Files files = SetFiles(report, {arguments.formats, *FindFigureStyle(arguments.style)});
  const auto surfaces = InWorld(question->mechanism, question->output, ColoredSurface(report.set));
  if (!arguments.no_pictures && !surfaces.empty()) {
    const RunSummary drawn =
        DrawInside(mechanism, surfaces, mechanism.name + " / reachable set", "reachable", &files);
    if (!drawn.ok()) Say(stderr, "warning: no pictures: {}\n", drawn.message);
  }
  nlohmann::ordered_json json = OutcomeJson(mechanism.name, report.agree(), form.measures);
  json["set"] = ToJson(report);
  return WriteResults(arguments, mechanism.name, files, report.agree(), json, inputs);
}

// "mbverify workspace arm --over x,y --set a=0.35": the set of a design.
std::string CommandOf(const WorkspaceArguments& arguments, const DesignQuestion& question,
                      const TriedDesign& design) {
  const SetArguments& asked = arguments.set_of_poses;
  std::string command = "mbverify workspace " + arguments.model;
  const auto add = [&](const char* option, const std::vector<std::string>& texts) {
    for (const std::string& text : texts) command += fmt::format(" {} {}", option, text);
  };
  if (!asked.output.empty()) add("--output", {asked.output});
  add("--over", asked.over);
  add("--at", asked.at);
  add("--from", asked.from);
  add("--range", asked.ranges);
  add("--cone", asked.cones);
  if (std::isfinite(asked.clearance))
    command += fmt::format(" --clearance {:.17g}", asked.clearance);
  add("--for-all", asked.for_all);
  add("--for-some", asked.for_some);
  if (asked.cross_singularities) command += " --cross-singularities";
  add("--set", arguments.set);
  for (size_t k = 0; k < question.parameters.size(); ++k) {
    command += fmt::format(" --set {}={:.17g}", question.parameters[k].name,
                           design.at[static_cast<Eigen::Index>(k)]);
  }
  return command;
}

// The design whose set is largest.
int BestOfDesigns(const WorkspaceArguments& arguments, const Mechanism& mechanism,
                  const ProgressFunction& progress, ProgressLine* line,
                  const std::vector<InputFile>& inputs) {
  SetArguments asked = arguments.set_of_poses;
  asked.flood.threads = arguments.jobs;
  Diagnostics diagnostics;
  DesignQuestion question{
      .parameters = ReadDesignParameters(mechanism, arguments.over_parameters, &diagnostics),
      .global = !arguments.local,
      .evaluations = arguments.evaluations,
      .seed = arguments.seed};
  if (arguments.over_parameters.empty() || arguments.maximise.empty()) {
    diagnostics.AddError(arguments.maximise.empty() ? "--over-parameters" : "--maximise",
                         "a search of designs needs --maximise and --over-parameters",
                         "--maximise volume --over-parameters NAME=LOW:HIGH");
  }
  if (arguments.joint_space || !arguments.modes.empty() || !arguments.way.empty()) {
    diagnostics.AddError("--maximise",
                         "it asks for another thing than --modes, --joint-space and --way",
                         "leave them out");
  }
  (void)ReadQuestion(mechanism, asked, &diagnostics);
  SayText(stderr, diagnostics.Text());
  LoadOptions options;
  const auto file = FindModelOrRefuse(arguments.model);
  if (diagnostics.has_errors() || !file || !ReadParameters(arguments.set, &options) ||
      !ReadRobotOptions(arguments.options, &options)) {
    return 2;
  }
  const auto folder = ResumeFolderOf(arguments, mechanism.name, inputs);
  if (!folder) return 2;
  const ParsedDocuments documents;
  const ModelOfDesign model = [&](const VecX& values) {
    LoadOptions with = options;
    for (size_t k = 0; k < question.parameters.size(); ++k) {
      with.overrides[question.parameters[k].name] = values[static_cast<Eigen::Index>(k)];
    }
    return LoadRobot(*file, with).mechanism;
  };
  const BestDesign design = FindBestDesign(question, model, asked, progress, folder.get());
  line->Clear();
  if (!design.summary.ok()) {
    Say(stderr, "error: {}\n", design.verdict);
    const Stop stop = design.summary.stop;
    return stop == Stop::kUnsupported || stop == Stop::kUnreachable ? 2 : 3;
  }
  const std::string command = CommandOf(arguments, question, design.best);
  std::FILE* to = arguments.json.text();
  SayText(to, mechanism.name + "\n" +
                  ToText(SectionOf(question, design, command),
                         {.color = WantsColor(to), .columns = TerminalColumns(to)}));
  nlohmann::ordered_json json = OutcomeJson(mechanism.name, design.agree, {});
  json["best_design"] = ToJson(question, design);
  return WriteResults(arguments, mechanism.name,
                      DesignFiles(mechanism.name, question, design, command), design.agree, json,
                      inputs);
}

// Of one pose: in how many ways its drives, or its coordinates, can be had; and type-2 curves over
// two drives.
int WaysToClose(const WorkspaceArguments& arguments, const Mechanism& mechanism,
                const ProgressFunction& progress, ProgressLine* line,
                const std::vector<InputFile>& inputs) {
  Diagnostics diagnostics;
  const auto question = ReadQuestion(mechanism, arguments.set_of_poses, &diagnostics);
  if (arguments.set_of_poses.any_of_set() || !arguments.way.empty() ||
      (arguments.joint_space && !arguments.modes.empty())) {
    diagnostics.AddError(arguments.joint_space ? "--joint-space" : "--modes",
                         "it asks for another thing than a set of poses",
                         "leave out --resolution, --cone, --clearance, --cross-singularities, "
                         "--way and the other one "
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
  if (!arguments.maximise.empty() || !arguments.over_parameters.empty()) {
    return BestOfDesigns(arguments, mechanism, progress, &line, inputs.files());
  }
  if (!arguments.modes.empty() || arguments.joint_space) {
    return WaysToClose(arguments, mechanism, progress, &line, inputs.files());
  }
  if (arguments.set_of_poses.any() || !arguments.way.empty() ||
      FindWorkspaceForm(mechanism.name) == nullptr) {
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
  workspace->add_option("--output", asked.output,
                        "whose poses are asked: an output (default: the first), a body or a frame");
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
  workspace
      ->add_option("--clearance", asked.clearance,
                   "METRES: poses end where the shapes of two bodies that no joint connects come "
                   "as near as this")
      ->check(CLI::PositiveNumber);
  workspace->add_flag("--cross-singularities", asked.cross_singularities,
                      "poses where the drives lose their hold (type 2) end nothing");
  workspace
      ->add_option("--modes", arguments->modes,
                   "instead of a set: in how many ways the pose's drives can be had (drives: "
                   "assembly modes), or its coordinates (output: working modes), or both (all)")
      ->check(CLI::IsMember({"drives", "output", "all"}));
  workspace->add_option("--way", arguments->way,
                        "drives=N or output=N: the set of another assembly or working mode, as "
                        "--modes lists them");
  workspace->add_flag("--joint-space", arguments->joint_space,
                      "instead of a set: type-2 curves over the two drives of --over, the others "
                      "held, with their cusps");
  workspace
      ->add_option("--maximise", arguments->maximise,
                   "instead of a set: the design whose set is largest (length and area, too)")
      ->check(CLI::IsMember({"volume"}));
  list("--over-parameters", &arguments->over_parameters,
       "NAME=LOW:HIGH (NAME_mm, NAME_deg): parameters of the model that a design chooses");
  workspace->add_flag("--local", arguments->local,
                      "designs only near the model's own; otherwise the whole box is searched");
  workspace->add_option("--seed", arguments->seed, "of the search of designs")
      ->capture_default_str();
  workspace
      ->add_option("--evaluations", arguments->evaluations,
                   "designs at most (default: 100 for each parameter)")
      ->check(CLI::Range(1, 1000000));
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
  workspace
      ->add_option("--formats", arguments->formats,
                   "pdf, png: figures of a set for print, beside their SVG")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember({"pdf", "png"}));
  std::vector<std::string> styles;
  for (const FigureStyle& style : FigureStyles()) styles.push_back(style.name);
  workspace->add_option("--style", arguments->style, "of figures for print")
      ->check(CLI::IsMember(styles))
      ->capture_default_str();
  workspace->add_flag("--no-pictures", arguments->no_pictures, "data files only");
  SetFooter(workspace,
            {"workspace spr_tripod --set q_min=0.45 --set q_max=0.65",
             "workspace stewart --over x,y --at z=0.7 --range leg1=0.5:0.8",
             "workspace friction_five_bar --over x,y --maximise volume --over-parameters "
             "upper=0.2:0.3,base=0.1:0.4",
             "workspace my_robot.urdf --output foot --over roll,pitch"},
            "0 the ways to a measure agree, 1 they contradict each other, 2 bad input, 3 could not "
            "run");
  workspace->callback([arguments, exit_code] { *exit_code = Workspace(*arguments); });
}

}  // namespace mbv
