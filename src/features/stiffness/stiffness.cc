#include "features/stiffness/stiffness.h"

#include <fmt/format.h>
#include <algorithm>
#include <chrono>

#include "base/inputs.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "reference/frame_stiffness.h"
#include "reference/reference.h"
#include "report/report.h"
#include "simulation/engine/compliant.h"
#include "verify/run_witnesses.h"
#include "verify/version.h"

namespace mbv {
namespace {

class Runner {
 public:
  Runner(const PreparedStiffness& prepared, const ProgressFunction& progress)
      : prepared_(prepared), scenario_(prepared.scenario), progress_(progress) {}

  StiffnessRun Run() {
    const auto start = std::chrono::steady_clock::now();
    Describe();
    Timing& timing = report().timing;
    const char* off = "switched off in the scenario";
    const auto add = [&](const Role& role, const char* stage, double fraction,
                         const std::string& why_not, double* wall_s, const auto& compute) {
      if (progress_) progress_(stage, fraction);
      StiffnessWitness witness{.name = role.name};
      if (why_not.empty()) {
        const auto begin = std::chrono::steady_clock::now();
        compute(&witness);
        *wall_s = witness.result.summary.wall_s = Since(begin);
      } else {
        witness.result.summary = NotRun(why_not);
      }
      report().witnesses.push_back(std::move(witness));
    };
    add(role::kAnalytic, "closed form", 0.0, prepared_.form_reason, &timing.analytic_s,
        [&](StiffnessWitness* witness) {
          witness->result = prepared_.form->Evaluate(scenario_.pose);
          witness->displacements = Displacements(witness->result, scenario_.loads);
        });
    report().witnesses.back().gap = prepared_.form_gap;
    add(role::kReference, "frame elements", 0.1, scenario_.reference.on ? "" : off,
        &timing.reference_s, [&](StiffnessWitness* witness) { RunFrame(witness); });
    add(role::kSimulated, "simulation", 0.2,
        !scenario_.simulation.on ? off
        : IsSingular()           ? "the stiffness is singular: nothing can be loaded"
                                 : "",
        &timing.simulation_s, [&](StiffnessWitness* witness) { Simulate(witness); });
    RunPrinted();
    Judge();
    Measure();
    timing.total_s = Since(start);
    return std::move(run_);
  }

 private:
  StiffnessReport& report() { return run_.report; }

  static double Since(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
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
    for (const Command& command : scenario_.motion.commands) {
      r.pose.push_back({command.name, Evaluate(command.profile, 0.0).value,
                        CoordinateUnit(prepared_.base, command.terms[0].coordinate)});
    }
  }

  // Poses of all bodies of a witness' mechanism, and where its output is; empty after a failure.
  std::vector<Pose> Assemble(const Mechanism& mechanism, StiffnessWitness* witness) {
    std::vector<Pose> X_WB;
    witness->result.summary = CloseLoops(mechanism, scenario_.pose, &X_WB);
    if (X_WB.empty()) return X_WB;
    const Output& output = prepared_.base.outputs[static_cast<size_t>(prepared_.output)];
    report().p_WO = (X_WB[static_cast<size_t>(output.body)] * output.X_BO).translation();
    return X_WB;
  }

  void RunFrame(StiffnessWitness* witness) {
    const Mechanism& mechanism = prepared_.mechanisms.reference;
    const std::vector<Pose> X_WB = Assemble(mechanism, witness);
    if (X_WB.empty()) return;
    witness->result = FrameStiffness(mechanism, X_WB, prepared_.output);
    witness->displacements = Displacements(witness->result, scenario_.loads);
  }

  // No load can be in equilibrium where another computation found a DOF that nothing holds.
  bool IsSingular() {
    return std::ranges::any_of(report().witnesses, [](const StiffnessWitness& witness) {
      return witness.result.summary.stop == Stop::kSingular;
    });
  }

  void Simulate(StiffnessWitness* witness) {
    const Mechanism& mechanism = prepared_.mechanisms.simulated;
    const std::vector<Pose> X_WB = Assemble(mechanism, witness);
    if (X_WB.empty()) return;
    CompliantRun run =
        SimulateStiffness(mechanism, X_WB, prepared_.output, scenario_.loads,
                          {.force_N = scenario_.force_N, .moment_Nm = scenario_.moment_Nm});
    run_.mjcf = std::move(run.mjcf);
    witness->result = std::move(run.result);
    witness->residual = run.residual;
    witness->extrapolation_error = run.extrapolation_error;
    // Under finite loads, geometry included.
    for (const LoadedDisplacement& loaded : run.loaded) {
      witness->displacements.push_back(loaded.displacement);
    }
  }

  void RunPrinted() {
    if (prepared_.printed == nullptr) return;
    StiffnessWitness& witness = report().printed.emplace_back();
    witness.name = "printed";
    witness.result = prepared_.printed->Evaluate(scenario_.pose);
    // Its stiffness is compared even where its model finds itself singular.
    witness.displacements = Displacements(witness.result, scenario_.loads);
    report().printed_pairs.push_back(
        CompareStiffnesses(AsWitness(witness), AsWitness(report().witnesses.front())));
  }

  void Judge() {
    ComparisonInput input{.mechanism = &prepared_.base,
                          .motion = &scenario_.motion,
                          .limits = scenario_.checks,
                          .driven_by = {},
                          .own_parameters = OwnParameters(scenario_, prepared_.base),
                          .left_out = TextsOf(scenario_.model_caveats, ModelCaveat::Kind::kLeftOut),
                          .of_stiffness = true};
    for (const StiffnessWitness& witness : report().witnesses) {
      input.witnesses.push_back(AsWitness(witness));
    }
    report().comparison = Compare(input);
    const Verdict verdict = report().comparison.verdict;
    report().exit_code = verdict == Verdict::kAgree ? 0 : verdict == Verdict::kDisagree ? 1 : 3;
  }

  void Measure() {
    for (const NamedIndex& index : IndicesOf(prepared_.form.get(), {})) {
      report().indices.push_back({index.name, index.unit, index.meaning, {}});
    }
    for (const StiffnessWitness& witness : report().witnesses) {
      const std::vector<NamedIndex> indices = IndicesOf(prepared_.form.get(), witness.result);
      for (size_t k = 0; k < indices.size(); ++k) {
        report().indices[k].values.push_back(indices[k].value);
      }
    }
  }

  const PreparedStiffness& prepared_;
  const StiffnessScenario& scenario_;
  const ProgressFunction& progress_;
  StiffnessRun run_;
};

}  // namespace

std::vector<NamedIndex> IndicesOf(const StiffnessForm* form, const StiffnessResult& result) {
  std::vector<NamedIndex> all;
  const auto own = form == nullptr ? std::vector<StiffnessIndex>() : form->indices();
  std::vector<double> values(own.size(), kNan);
  if (form != nullptr && result.K.allFinite()) form->IndexValues(result, values);
  for (size_t k = 0; k < own.size(); ++k) {
    all.push_back({own[k].name, own[k].unit, own[k].meaning, values[k]});
  }
  for (NamedIndex& index : GeneralIndices(result)) all.push_back(std::move(index));
  return all;
}

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
    files.emplace_back("inputs.json", InputsJson(inputs.files(), options.scenario.set));
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
  outcome.other = std::make_shared<ShownStiffness>(std::move(run.report));
  return outcome;
}

// Stiffness scenarios made ready: output, pose, witnesses' parameters, closed forms.

namespace {

constexpr const char* kPrintedModel = "as_printed";

void ResolveOutput(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  const StiffnessFormRow* row = FindStiffnessForm(prepared->base.name);
  std::string name = prepared->scenario.output;
  if (name.empty() && row != nullptr) name = row->output;
  if (name.empty() && prepared->base.outputs.size() == 1) name = prepared->base.outputs[0].name;
  prepared->output = prepared->base.FindOutput(name);
  if (prepared->output >= 0) return;
  Finding none = MissingOutput(prepared->base, name);
  none.file = prepared->scenario.file;
  diagnostics->Add(std::move(none));
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

// What the closed form does not cover of the model.
std::vector<Finding> UncoveredBy(const StiffnessFormRow& row, const Mechanism& mechanism) {
  if (row.coverage == nullptr) return {};
  return FindUncovered(row.coverage(mechanism), mechanism, Concern::kStiffness);
}

std::unique_ptr<StiffnessForm> MakeForm(const PreparedStiffness& prepared,
                                        const StiffnessFormRow& row, const std::string& model,
                                        Diagnostics* diagnostics) {
  Diagnostics found;
  auto form = row.factory(prepared.mechanisms.analytic, prepared.scenario.pose, model, &found);
  AddFormFindings(prepared.scenario.file, found, diagnostics);
  return form;
}

// Makes the closed forms, or says why there are none.
std::string FindForms(PreparedStiffness* prepared, Diagnostics* diagnostics) {
  const AnalyticSettings& settings = prepared->scenario.analytic;
  const std::string& file = prepared->scenario.file;
  const StiffnessFormRow* row = FindStiffnessForm(prepared->base.name);
  if (!settings.on) return "switched off in the scenario";
  if (settings.stated) prepared->form_gap = WitnessGap::kNotApplicable;
  if (row == nullptr) {
    std::string none = "there is no closed form of the stiffness of " + prepared->base.name;
    if (!settings.model.empty()) diagnostics->AddError(file, "analytic.model: " + none);
    return none;
  }
  const std::string& output = prepared->base.outputs[size_t(prepared->output)].name;
  if (output != row->output) {
    return fmt::format("the closed form is for output {}, not {}", row->output, output);
  }
  prepared->form_model = settings.model.empty() ? row->models.front() : settings.model;
  if (!Contains(row->models, prepared->form_model)) {
    diagnostics->AddError(file, fmt::format("analytic.model = '{}' is not one of: {}",
                                            settings.model, Joined(row->models)));
    return "the scenario asks for a formulation that does not exist";
  }
  prepared->form_gap = WitnessGap::kNotApplicable;  // unless it is made
  std::string outside =
      WarnNotApplicable(file, UncoveredBy(*row, prepared->mechanisms.analytic), diagnostics);
  if (!outside.empty()) return outside;
  prepared->form = MakeForm(*prepared, *row, prepared->form_model, diagnostics);
  if (prepared->form == nullptr) return "the closed form does not suit this scenario";
  prepared->form_gap = WitnessGap::kNone;
  if (prepared->scenario.compare_printed) {
    prepared->printed = MakeForm(*prepared, *row, kPrintedModel, diagnostics);
  }
  return "";
}

}  // namespace

Finding MissingOutput(const Mechanism& mechanism, const std::string& name) {
  std::vector<std::string> known;
  for (const Output& output : mechanism.outputs) known.push_back(output.name);
  return {.message = name.empty() ? fmt::format("output is not given, and {} has {}",
                                                mechanism.name, known.empty() ? "none" : "several")
                                  : fmt::format("there is no output '{}'", name),
          .hint = known.empty() ? "declare one under outputs: in the model"
                                : DidYouMean(name, known, "outputs: " + Joined(known))};
}

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
  std::string unknown;
  if (!prepared.base.couplings.empty()) {
    unknown = fmt::format("couples joints ({})", prepared.base.couplings.front().name);
  } else if (!prepared.base.elements.empty()) {
    const ForceElement& element = prepared.base.elements.front();
    unknown =
        fmt::format("has element '{}', a {}", element.name, Described(prepared.base, element));
  }
  if (!unknown.empty()) {
    diagnostics->AddError(
        s.file,
        fmt::format("model '{}' {}, which stiffness does not know", prepared.base.name, unknown),
        "beams and servos are what stiffness knows: a model with them alone has one");
    return {};
  }
  prepared.mechanisms = LoadMechanisms(s, prepared.base, diagnostics);
  ResolveOutput(&prepared, diagnostics);
  ResolvePose(&prepared, diagnostics);
  if (diagnostics->has_errors()) return {};
  prepared.scenario.motion = PoseMotion(prepared.base, prepared.scenario.pose);
  prepared.form_reason = FindForms(&prepared, diagnostics);
  if (s.analytic.required && prepared.form == nullptr) {
    diagnostics->AddError(s.file, "analytic.required: " + prepared.form_reason);
  }
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
