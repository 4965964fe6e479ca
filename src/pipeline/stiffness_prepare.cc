// Stiffness scenarios made ready: output, pose, witnesses' parameters, closed forms.
#include <fmt/format.h>

#include <algorithm>

#include "core/demand.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "model_file/load_model.h"
#include "pipeline/stiffness.h"

namespace mbv {
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
  const PoseFault fault = CheckPose(prepared->base, pose);
  if (!fault.message.empty()) {
    diagnostics->AddError(prepared->scenario.file, fault.message, fault.hint);
  }
}

// Why the closed form does not take this model; "" if it does. One warning each.
std::string Decline(const PreparedStiffness& prepared, const StiffnessFormRow& row,
                    Diagnostics* diagnostics) {
  if (row.coverage == nullptr) return "";
  std::vector<Finding> uncovered =
      FindUncovered(row.coverage(prepared.analytic), prepared.analytic, Concern::kStiffness);
  const std::string reason = ReasonToDecline(uncovered);
  for (Finding& finding : uncovered) {
    finding.file = prepared.scenario.file;
    finding.message = "analytic declines: " + finding.message;
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
  prepared->form_reason = Decline(*prepared, *row, diagnostics);
  if (!prepared->form_reason.empty()) return;
  prepared->form = MakeForm(*prepared, *row, prepared->form_model, diagnostics);
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
