#include "features/stiffness/stiffness.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>

#include "base/demand.h"
#include "base/inputs.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "model_file/load_model.h"
#include "reference/frame_stiffness.h"
#include "reference/reference.h"
#include "report/json.h"
#include "scenario/motion_reader.h"
#include "simulation/engine/compliant.h"
#include "verify/run_witnesses.h"
#include "verify/version.h"

namespace mbv {
namespace {

double Since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

class Runner {
 public:
  Runner(const PreparedStiffness& prepared, const ProgressFunction& progress)
      : prepared_(prepared), scenario_(prepared.scenario), progress_(progress) {}

  StiffnessRun Run() {
    const auto start = std::chrono::steady_clock::now();
    Describe();
    Show("closed form", 0.0);
    RunAnalytic();
    Show("frame elements", 0.1);
    RunFrame();
    Show("simulation", 0.2);
    RunSimulated();
    RunPrinted();
    Judge();
    Measure();
    run_.report.timing.total_s = Since(start);
    return std::move(run_);
  }

 private:
  StiffnessReport& report() { return run_.report; }

  void Show(const char* stage, double fraction) const {
    if (progress_) progress_(stage, fraction);
  }

  void Describe() {
    StiffnessReport& r = report();
    r.scenario = scenario_.name;
    r.scenario_file = scenario_.file;
    r.mechanism = prepared_.base.name;
    r.model_file = scenario_.model_file;
    r.description = scenario_.description;
    r.output = prepared_.base.outputs[static_cast<size_t>(prepared_.output)].name;
    r.pose_note = prepared_.pose_note;
    r.model = prepared_.form_model;
    r.loads = scenario_.loads;
    r.loads_text = scenario_.loads_text;
    r.versions = Versions();
    r.parameters = prepared_.base.parameters;
    const Motion motion = PoseMotion(prepared_.base, scenario_.pose);
    for (const Command& command : motion.commands) {
      r.pose.push_back({command.name, Evaluate(command.profile, 0.0).value,
                        CoordinateUnit(prepared_.base, command.terms[0].coordinate)});
    }
  }

  StiffnessWitness& Add(const std::string& name, StiffnessResult result) {
    StiffnessWitness witness;
    witness.name = name;
    witness.displacements = Displacements(result, scenario_.loads);
    witness.result = std::move(result);
    report().witnesses.push_back(std::move(witness));
    return report().witnesses.back();
  }

  void AddFailed(const std::string& name, RunSummary summary) {
    StiffnessResult result;
    result.summary = std::move(summary);
    Add(name, std::move(result));
  }

  void RunAnalytic() {
    if (prepared_.form == nullptr) {
      AddFailed(role::kAnalytic.name, NotRun(prepared_.form_reason));
      report().witnesses.back().gap = prepared_.form_gap;
      return;
    }
    const auto start = std::chrono::steady_clock::now();
    StiffnessResult result = prepared_.form->Evaluate(scenario_.pose);
    report().timing.analytic_s = result.summary.wall_s = Since(start);
    Add(role::kAnalytic.name, std::move(result));
  }

  void RunFrame() {
    if (!scenario_.reference.on) {
      AddFailed(role::kReference.name, NotRun("switched off in the scenario"));
      return;
    }
    const auto start = std::chrono::steady_clock::now();
    std::vector<Pose> X_WB;
    if (!Assemble(role::kReference.name, prepared_.reference, &X_WB)) return;
    StiffnessResult result = FrameStiffness(prepared_.reference, X_WB, prepared_.output);
    report().timing.reference_s = result.summary.wall_s = Since(start);
    Add(role::kReference.name, std::move(result));
  }

  // Poses of all bodies of a witness' mechanism, and where its output is; false after a failure.
  bool Assemble(const std::string& witness, const Mechanism& mechanism, std::vector<Pose>* X_WB) {
    const RunSummary closed = CloseLoops(mechanism, scenario_.pose, X_WB);
    if (!closed.ok()) {
      AddFailed(witness, closed);
      return false;
    }
    const Output& output = prepared_.base.outputs[static_cast<size_t>(prepared_.output)];
    report().p_WO = ((*X_WB)[static_cast<size_t>(output.body)] * output.X_BO).translation();
    return true;
  }

  // No load can be in equilibrium where another computation found a DOF that nothing holds.
  bool IsSingular() const {
    for (const StiffnessWitness& witness : run_.report.witnesses) {
      if (witness.result.summary.stop == Stop::kSingular) return true;
    }
    return false;
  }

  void RunSimulated() {
    if (!scenario_.simulation.on) {
      AddFailed(role::kSimulated.name, NotRun("switched off in the scenario"));
      return;
    }
    if (IsSingular()) {
      AddFailed(role::kSimulated.name, NotRun("the stiffness is singular: nothing can be loaded"));
      return;
    }
    const auto start = std::chrono::steady_clock::now();
    std::vector<Pose> X_WB;
    if (!Assemble(role::kSimulated.name, prepared_.simulated, &X_WB)) return;
    CompliantRun run = SimulateStiffness(
        prepared_.simulated, X_WB, prepared_.output, scenario_.loads,
        {.force_N = scenario_.simulation.force_N, .moment_Nm = scenario_.simulation.moment_Nm});
    report().timing.simulation_s = run.result.summary.wall_s = Since(start);
    run_.mjcf = std::move(run.mjcf);
    StiffnessWitness& witness = Add(role::kSimulated.name, std::move(run.result));
    witness.residual = run.residual;
    witness.extrapolation_error = run.extrapolation_error;
    // Under finite loads, geometry included.
    witness.displacements.clear();
    for (const LoadedDisplacement& loaded : run.loaded) {
      witness.displacements.push_back(loaded.displacement);
    }
  }

  void RunPrinted() {
    if (prepared_.printed == nullptr) return;
    StiffnessWitness witness;
    witness.name = "printed";
    witness.result = prepared_.printed->Evaluate(scenario_.pose);
    // Its stiffness is compared even where its model finds itself singular.
    witness.displacements = Displacements(witness.result, scenario_.loads);
    report().printed_pairs.push_back(CompareStiffnessPair(witness, report().witnesses.front()));
    report().printed.push_back(std::move(witness));
  }

  void Judge() {
    StiffnessInput input;
    input.limits = scenario_.checks;
    input.loads = scenario_.loads;
    input.witnesses = report().witnesses;
    input.left_out = TextsOf(scenario_.model_caveats, ModelCaveat::Kind::kLeftOut);
    report().comparison = CompareStiffness(input);
    switch (report().comparison.verdict) {
      case Verdict::kAgree:
        report().exit_code = 0;
        break;
      case Verdict::kDisagree:
        report().exit_code = 1;
        break;
      case Verdict::kNotRun:
        report().exit_code = 3;
        break;
    }
  }

  void Measure() {
    StiffnessReport& r = report();
    const auto add = [&](const std::string& name, const std::string& unit,
                         const std::string& meaning, const auto& value_of) {
      IndexRow row{.name = name, .unit = unit, .meaning = meaning, .values = {}};
      for (const StiffnessWitness& witness : r.witnesses) {
        row.values.push_back(witness.ran() ? value_of(witness.result) : kNan);
      }
      r.indices.push_back(std::move(row));
    };
    if (prepared_.form != nullptr) {
      const std::vector<StiffnessIndex> indices = prepared_.form->indices();
      for (size_t k = 0; k < indices.size(); ++k) {
        add(indices[k].name, indices[k].unit, indices[k].meaning,
            [&](const StiffnessResult& result) {
              std::vector<double> values(indices.size());
              prepared_.form->IndexValues(result, values);
              return values[k];
            });
      }
    }
    const std::vector<NamedIndex> general = GeneralIndices({});
    for (size_t k = 0; k < general.size(); ++k) {
      add(general[k].name, general[k].unit, general[k].meaning,
          [k](const StiffnessResult& result) { return GeneralIndices(result)[k].value; });
    }
  }

  const PreparedStiffness& prepared_;
  const StiffnessScenario& scenario_;
  const ProgressFunction& progress_;
  StiffnessRun run_;
};

}  // namespace

RunSummary CloseLoops(const Mechanism& mechanism, const PoseValues& pose, std::vector<Pose>* X_WB) {
  const Motion motion = PoseMotion(mechanism, pose);
  ReferenceOptions options;
  options.reactions = false;
  ReferenceSolver solver(mechanism, motion, options);
  CommandSample command;
  EvaluateMotion(motion, 0.0, &command);
  ReferenceSample sample;
  RunSummary summary = solver.Kinematics(command, &sample);
  if (summary.ok()) *X_WB = sample.states.X_WB;
  return summary;
}

StiffnessRun RunStiffness(const PreparedStiffness& prepared, const ProgressFunction& progress) {
  return Runner(prepared, progress).Run();
}

std::vector<std::pair<std::string, std::string>> StiffnessFiles(const StiffnessRun& run) {
  std::vector<std::pair<std::string, std::string>> files = {
      {"stiffness.csv", StiffnessCsv(run.report)},
      {"contributions.csv", ContributionsCsv(run.report)},
      {"summary.json", ToJson(run.report)},
      {"report.html", ToHtml(run.report)}};
  if (!run.report.loads.empty()) files.emplace_back("loads.csv", LoadsCsv(run.report));
  if (!run.mjcf.empty()) files.emplace_back("model.xml", run.mjcf);
  return files;
}

RunOutcome RunStiffnessScenario(const std::string& file, const RunOptions& options) {
  RunOutcome outcome;
  const InputWatch inputs;
  const auto prepared = PrepareStiffnessFile(file, options.scenario, &outcome.diagnostics);
  if (!prepared) {
    outcome.exit_code = 2;
    return outcome;
  }
  StiffnessRun run = RunStiffness(*prepared, options.progress);
  run.report.timing.stated = options.timed;
  run.report.findings = outcome.diagnostics;
  run.report.command = "mbverify run " + ShellWord(file);
  for (const auto& [key, value] : options.scenario.set) {
    run.report.command += " --set " + ShellWord(key + "=" + value);
  }
  outcome.exit_code = run.report.exit_code;
  if (!options.out_dir.empty()) {
    OutputFolder folder(options.out_dir, prepared->base.name + "/" + prepared->scenario.name);
    std::vector<std::pair<std::string, std::string>> files = StiffnessFiles(run);
    files.emplace_back("inputs.json", ToJson(inputs.files()));
    std::erase_if(files,
                  [&](const auto& file) { return file.first == "report.html" && !options.page; });
    const std::string trouble = folder.WriteAll(files);
    if (trouble.empty()) {
      outcome.folder = folder.target();
    } else {
      Finding finding;
      finding.message = trouble;
      finding.hint = "choose another folder with --out";
      outcome.diagnostics.Add(std::move(finding));
      outcome.exit_code = 3;
    }
  }
  outcome.stiffness = std::make_shared<StiffnessReport>(std::move(run.report));
  return outcome;
}

// Stiffness scenarios made ready: output, pose, witnesses' parameters, closed forms.

namespace {

constexpr const char* kPrintedModel = "as_printed";

Mechanism WithParameters(const PreparedStiffness& prepared, const Overrides& own,
                         const char* witness, Diagnostics* diagnostics) {
  if (own.empty()) return prepared.base;
  LoadOptions options;
  options.overrides = Merge(prepared.scenario.parameters, own);
  LoadResult loaded = LoadModel(prepared.scenario.model_file, options);
  if (loaded.mechanism) return *std::move(loaded.mechanism);
  diagnostics->Append(loaded.diagnostics);
  diagnostics->AddError(
      prepared.scenario.file,
      fmt::format("the model cannot be loaded with the parameters of the {} witness", witness), "");
  return prepared.base;
}

void ResolveOutput(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  const StiffnessFormRow* row = FindStiffnessForm(prepared->base.name);
  std::string name = prepared->scenario.output;
  if (name.empty() && row != nullptr) name = row->output;
  if (name.empty() && prepared->base.outputs.size() == 1) name = prepared->base.outputs[0].name;
  prepared->output = prepared->base.FindOutput(name);
  if (prepared->output >= 0) return;
  std::vector<std::string> known;
  for (const Output& output : prepared->base.outputs) known.push_back(output.name);
  diagnostics->AddError(prepared->scenario.file,
                        name.empty()
                            ? fmt::format("output is not given, and {} has {}", prepared->base.name,
                                          known.empty() ? "none" : "several")
                            : fmt::format("there is no output '{}'", name),
                        known.empty() ? "declare one under outputs: in the model"
                                      : DidYouMean(name, known, "outputs: " + Joined(known)));
}

void ResolvePose(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  PoseValues& pose = prepared->scenario.pose;
  if (!pose.empty()) return;
  pose = ExamplePose(prepared->base.name);
  prepared->pose_note = "no pose is given: this is the pose of the project's example";
  if (!pose.empty()) return;
  pose = HomePose(prepared->base);
  prepared->pose_note = "no pose is given: this is the model's home pose";
  if (const auto fault = CheckPose(prepared->base, pose)) {
    diagnostics->AddError(prepared->scenario.file, fault->message, fault->hint);
  }
}

// Why the closed form does not take this model; "" if it does. One warning each.
std::string WarnNotApplicable(const PreparedStiffness& prepared, const StiffnessFormRow& row,
                              Diagnostics* diagnostics) {
  if (row.coverage == nullptr) return "";
  std::vector<Finding> uncovered =
      FindUncovered(row.coverage(prepared.analytic), prepared.analytic, Concern::kStiffness);
  const std::string reason = ReasonNotApplicable(uncovered);
  for (Finding& finding : uncovered) {
    finding.file = prepared.scenario.file;
    finding.message = "analytic is not applicable: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return reason;
}

std::unique_ptr<StiffnessForm> MakeForm(const PreparedStiffness& prepared,
                                        const StiffnessFormRow& row, const std::string& model,
                                        Diagnostics* diagnostics) {
  Diagnostics own;
  auto form = row.factory(prepared.analytic, prepared.scenario.pose, model, &own);
  for (Finding finding : own.findings()) {
    if (finding.file.empty()) finding.file = prepared.scenario.file;
    diagnostics->Add(std::move(finding));
  }
  return form;
}

void FindForms(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  const AnalyticSettings& settings = prepared->scenario.analytic;
  const StiffnessFormRow* row = FindStiffnessForm(prepared->base.name);
  if (settings.on && settings.stated) prepared->form_gap = WitnessGap::kNotApplicable;
  if (!settings.on) {
    prepared->form_reason = "switched off in the scenario";
    return;
  }
  if (row == nullptr) {
    prepared->form_reason = "there is no closed form of the stiffness of " + prepared->base.name;
    if (!settings.model.empty()) {
      diagnostics->AddError(prepared->scenario.file, "analytic.model: " + prepared->form_reason,
                            "");
    }
    return;
  }
  const std::string& output = prepared->base.outputs[size_t(prepared->output)].name;
  if (output != row->output) {
    prepared->form_reason =
        fmt::format("the closed form is for output {}, not {}", row->output, output);
    return;
  }
  const auto& models = row->models;
  prepared->form_model = settings.model.empty() ? models.front() : settings.model;
  if (std::find(models.begin(), models.end(), prepared->form_model) == models.end()) {
    diagnostics->AddError(
        prepared->scenario.file,
        fmt::format("analytic.model = '{}' is not one of: {}", settings.model, Joined(models)), "");
    return;
  }
  prepared->form_gap = WitnessGap::kNotApplicable;  // unless it is made
  prepared->form_reason = WarnNotApplicable(*prepared, *row, diagnostics);
  if (!prepared->form_reason.empty()) return;
  prepared->form = MakeForm(*prepared, *row, prepared->form_model, diagnostics);
  if (prepared->form == nullptr) {
    prepared->form_reason = "the closed form does not suit this scenario";
  } else {
    prepared->form_gap = WitnessGap::kNone;
  }
  if (prepared->scenario.compare_printed && prepared->form != nullptr) {
    prepared->printed = MakeForm(*prepared, *row, kPrintedModel, diagnostics);
  }
}

void MakeForms(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  FindForms(prepared, diagnostics);
  if (!prepared->scenario.analytic.required || prepared->form != nullptr) return;
  diagnostics->AddError(prepared->scenario.file, "analytic.required: " + prepared->form_reason, "");
}

}  // namespace

PoseValues ExamplePose(const std::string& mechanism) {
  const StiffnessFormRow* row = FindStiffnessForm(mechanism);
  return row == nullptr ? PoseValues{} : row->example_pose;
}

std::optional<PreparedStiffness> PrepareStiffness(StiffnessScenario scenario, Mechanism base,
                                                  Diagnostics* diagnostics) {
  PreparedStiffness prepared;
  prepared.scenario = std::move(scenario);
  prepared.base = std::move(base);
  const StiffnessScenario& s = prepared.scenario;
  if (!prepared.base.couplings.empty()) {
    diagnostics->AddError(
        s.file,
        fmt::format("model '{}' couples joints ({}), which stiffness does not know",
                    prepared.base.name, prepared.base.couplings.front().name),
        "without the coupling, held by drives, the model has a stiffness");
    return {};
  }
  if (!prepared.base.elements.empty()) {
    const ForceElement& element = prepared.base.elements.front();
    diagnostics->AddError(
        s.file,
        fmt::format("model '{}' has element '{}', a {}, which stiffness does not know",
                    prepared.base.name, element.name, Described(prepared.base, element)),
        "beams and servos are what stiffness knows");
    return {};
  }
  prepared.analytic =
      WithParameters(prepared, s.analytic.parameters, role::kAnalytic.name, diagnostics);
  prepared.reference =
      WithParameters(prepared, s.reference.parameters, role::kReference.name, diagnostics);
  prepared.simulated =
      WithParameters(prepared, s.simulation.parameters, role::kSimulated.name, diagnostics);
  ResolveOutput(&prepared, diagnostics);
  ResolvePose(&prepared, diagnostics);
  if (diagnostics->has_errors()) return {};
  MakeForms(&prepared, diagnostics);
  if (diagnostics->has_errors()) return {};
  return prepared;
}

std::optional<PreparedStiffness> PrepareStiffnessFile(const std::string& file,
                                                      const ScenarioOptions& options,
                                                      Diagnostics* diagnostics) {
  StiffnessScenarioResult loaded = LoadStiffnessScenario(file, options);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario) return {};
  return PrepareStiffness(*std::move(loaded.scenario), *std::move(loaded.mechanism), diagnostics);
}

}  // namespace mbv
