#include "verify/prepare.h"

#include <fmt/format.h>

#include "base/text.h"
#include "equations/equations.h"
#include "mechanism/channels.h"
#include "mechanism/followed_state.h"
#include "model_file/load_model.h"
#include "plot/figure.h"
#include "verify/drive_by.h"

namespace mbv {
namespace {

// What the closed form does not cover of this mechanism and its loads.
std::vector<Finding> UncoveredBy(const ClosedFormRow& row, const Scenario& scenario,
                                 const Mechanism& mechanism) {
  if (row.coverage == nullptr) return {};
  const Coverage coverage = row.coverage(mechanism);
  std::vector<Finding> uncovered = FindUncovered(coverage, mechanism, Concern::kDynamics);
  for (Finding& load : FindUncoveredLoads(coverage, mechanism, scenario.motion)) {
    uncovered.push_back(std::move(load));
  }
  return uncovered;
}

// Every channel that some witness may record.
std::vector<Channel> RecordableChannels(const Prepared& prepared) {
  const Mechanism& mechanism = prepared.base;
  std::vector<Channel> channels;
  const auto add = [&](const std::vector<Channel>& more) {
    channels.insert(channels.end(), more.begin(), more.end());
  };
  add(DriveChannels(mechanism));
  add(OutputChannels(mechanism));
  for (const Output& output : mechanism.outputs) add(OutputRateChannels(mechanism, output));
  add(PrescribedChannels(mechanism));
  add(BandChannels(mechanism));
  for (const Joint& joint : mechanism.joints) add(ReactionChannels(joint));
  add(AuditChannels());
  add(EnergyChannels());
  for (const Coordinate& joint : prepared.scenario.motion.RecordedJoints()) {
    add(JointChannels(mechanism, joint, true));
  }
  add(WorkChannels(mechanism));
  if (prepared.has_closed_form()) add(prepared.closed_form.closed_form->extra_channels());
  return channels;
}

}  // namespace

std::string WarnNotApplicable(const std::string& scenario_file, std::vector<Finding> uncovered,
                              Diagnostics* diagnostics) {
  const std::string reason = ReasonNotApplicable(uncovered);
  for (Finding& finding : uncovered) {
    finding.file = scenario_file;
    finding.message = "analytic is not applicable: " + finding.message;
    diagnostics->Add(std::move(finding));
  }
  return reason;
}

void AddFormFindings(const std::string& scenario_file, const Diagnostics& found,
                     Diagnostics* diagnostics) {
  for (Finding finding : found.findings()) {
    if (finding.file.empty()) finding.file = scenario_file;
    diagnostics->Add(std::move(finding));
  }
}

WitnessMechanisms LoadMechanisms(const Scenario& scenario, const Mechanism& base,
                                 Diagnostics* diagnostics) {
  const auto load = [&](const Overrides& own, const Role& witness) {
    return LoadVariant(scenario, base, own, witness, diagnostics);
  };
  return {load(scenario.analytic.parameters, role::kAnalytic),
          load(scenario.reference.parameters, role::kReference),
          load(scenario.simulation.parameters, role::kSimulated)};
}

std::map<std::string, Overrides> OwnParameters(const Scenario& scenario, const Mechanism& base) {
  std::map<std::string, Overrides> own;
  const auto add = [&](const Role& role, const Overrides& parameters) {
    for (const auto& [name, value] : parameters) {
      if (base.ParameterValue(name) != value) own[role.name][name] = value;
    }
  };
  add(role::kAnalytic, scenario.analytic.parameters);
  for (const Role* role : {&role::kSolver, &role::kReached}) {
    add(*role, scenario.reference.parameters);
  }
  // A table has the reference's place.
  if (scenario.reference.table == nullptr) add(role::kReference, scenario.reference.parameters);
  add(role::kSimulated, scenario.simulation.parameters);
  return own;
}

Mechanism LoadVariant(const Scenario& scenario, const Mechanism& base, const Overrides& own,
                      const Role& witness, Diagnostics* diagnostics) {
  if (own.empty()) return base;
  LoadResult loaded = LoadModel(scenario.model_file, ModelOptions(scenario, own));
  if (loaded.mechanism) return *std::move(loaded.mechanism);
  diagnostics->Append(loaded.diagnostics);
  diagnostics->AddError(
      scenario.file,
      fmt::format("the model cannot be loaded with the parameters of the {} witness", witness.name),
      "");
  return base;
}

namespace {

// The equations of the scenario's file.
ClosedFormChoice MakeFromFile(const Scenario& scenario, const Mechanism& mechanism,
                              const ProgramConsent& consent, Diagnostics* diagnostics) {
  const ProgramList program = EquationProgramOf(scenario, consent.archived);
  if (consent.none && !program.programs.empty()) {
    return {nullptr, "its equations are a program, which is not run here"};
  }
  // Agreed to is a scenario's whole list.
  if (!consent.Allows(program) && !consent.Allows(ProgramsOf(scenario, consent.archived))) {
    Finding refusal = Refusal(program);
    refusal.severity = Severity::kWarning;
    diagnostics->Add(std::move(refusal));
    return {nullptr, "its equations are a program that may not run", WitnessGap::kNotApplicable};
  }
  Diagnostics found;
  FileForm made = MakeFileForm(scenario.analytic.equations, mechanism, scenario.motion, &found);
  diagnostics->Append(found);
  if (!made.uncovered.empty()) {
    ClosedFormChoice choice;
    choice.reason = ReasonNotApplicable(made.uncovered);
    choice.gap = WitnessGap::kNotApplicable;
    for (Finding& finding : made.uncovered) {
      if (finding.file.empty()) finding.file = scenario.analytic.equations;
      finding.message = "analytic is not applicable: " + finding.message;
      diagnostics->Add(std::move(finding));
    }
    return choice;
  }
  if (made.closed_form == nullptr) return {nullptr, "its equations do not work"};
  const SimulationSettings& simulation = scenario.simulation;
  const bool by_forces = simulation.mode == DriveMode::kForceDriven ||
                         (simulation.mode == DriveMode::kServo && simulation.servo.feedforward);
  if (!made.closed_form->gives_forces() && simulation.on && by_forces) {
    return {nullptr, "its equations give no forces, and these would move the simulation",
            WitnessGap::kNotApplicable};
  }
  ClosedFormChoice choice{std::move(made.closed_form), ""};
  choice.unchecked = std::move(made.unchecked);
  return choice;
}

}  // namespace

ClosedFormChoice MakeClosedForm(const Scenario& scenario, const Mechanism& mechanism,
                                const ProgramConsent& consent, Diagnostics* diagnostics) {
  if (!scenario.analytic.on) return {nullptr, "switched off in the scenario"};
  const WitnessGap asked =
      scenario.analytic.stated ? WitnessGap::kNotApplicable : WitnessGap::kNone;
  if (scenario.motion.free()) {
    return {nullptr, "closed forms give forces for a motion, not the motion for forces", asked};
  }
  if (const auto joints = scenario.motion.RecordedJoints(); !joints.empty()) {
    return {nullptr,
            "closed forms are commanded by drives and outputs, and the motion commands " +
                NameOf(mechanism, joints.front()),
            asked};
  }
  if (!scenario.analytic.equations.empty()) {
    return MakeFromFile(scenario, mechanism, consent, diagnostics);
  }
  const ClosedFormRow* row = FindClosedForm(mechanism.name);
  if (row == nullptr) {
    return {nullptr, "there are no closed-form equations for " + mechanism.name, asked};
  }
  const AnalyticSettings& settings = scenario.analytic;
  bool fits = true;
  if (!settings.model.empty() && !Contains(row->models, settings.model)) {
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.model = '{}' is not one of: {}", settings.model, Joined(row->models)),
        "");
    fits = false;
  }
  for (const std::string& erratum : settings.as_printed) {
    if (Contains(row->errata, erratum)) continue;
    diagnostics->AddError(
        scenario.file,
        fmt::format("analytic.as_printed: '{}' is not one of: {}", erratum, Joined(row->errata)),
        "");
    fits = false;
  }
  if (!fits) return {nullptr, "the scenario asks for a formulation that does not exist"};
  if (std::string reason =
          WarnNotApplicable(scenario.file, UncoveredBy(*row, scenario, mechanism), diagnostics);
      !reason.empty()) {
    return {nullptr, std::move(reason), WitnessGap::kNotApplicable};
  }
  Diagnostics found;
  auto closed_form =
      row->factory(mechanism, scenario.motion,
                   {.model = settings.model, .as_printed = settings.as_printed}, &found);
  AddFormFindings(scenario.file, found, diagnostics);
  if (closed_form == nullptr) return {nullptr, "the closed form does not suit this scenario"};
  return {std::move(closed_form), ""};
}

std::optional<Prepared> Prepare(const std::string& file, const ScenarioOptions& options,
                                Diagnostics* diagnostics, const ProgramConsent& consent) {
  return Prepare(LoadScenario(file, options), diagnostics, consent);
}

std::optional<Prepared> Prepare(ScenarioResult loaded, Diagnostics* diagnostics,
                                const ProgramConsent& consent) {
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario) return {};
  Prepared prepared{.scenario = *std::move(loaded.scenario),
                    .base = *std::move(loaded.mechanism),
                    .mechanisms = {},
                    .closed_form = {},
                    .consent = consent};
  prepared.mechanisms = LoadMechanisms(prepared.scenario, prepared.base, diagnostics);
  prepared.closed_form =
      MakeClosedForm(prepared.scenario, prepared.mechanisms.analytic, consent, diagnostics);
  if (prepared.scenario.simulation.on && !prepared.has_closed_form() &&
      !prepared.scenario.reference.on && !prepared.scenario.motion.free()) {
    Finding finding;
    finding.file = prepared.scenario.file;
    finding.message =
        "simulation needs the drive motion, but neither a closed form nor the reference gives it";
    finding.hint = "set reference: on";
    diagnostics->Add(std::move(finding));
  }
  std::vector<std::string> foreign;
  for (const ForeignWitness& witness : prepared.scenario.witnesses) foreign.push_back(witness.name);
  CheckFigures(prepared.scenario.figures, RecordableChannels(prepared), foreign,
               prepared.scenario.file, diagnostics);
  if (diagnostics->has_errors()) return {};
  return prepared;
}

const Role& Prepared::driver() const {
  if (has_closed_form()) return role::kAnalytic;
  return has_table() ? role::kSolver : role::kReference;
}

DrivenMotion Prepared::MakeDrivenMotion() const {
  if (scenario.motion.free()) return DriveByCommands(mechanisms.simulated, scenario.motion);
  if (!has_closed_form()) return DriveByReference(mechanisms.reference, scenario.motion);
  // A fresh closed form, because it may follow its solution from the start of the motion.
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, consent, &known);
  return DriveByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

DriveForces Prepared::MakeDriveForces() const {
  const SimulationSettings& settings = scenario.simulation;
  const bool servo = settings.mode == DriveMode::kServo && settings.servo.feedforward;
  if (settings.mode != DriveMode::kForceDriven && !servo) return {};
  if (!has_closed_form()) return ForcesByReference(mechanisms.reference, scenario.motion);
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, consent, &known);
  return ForcesByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

}  // namespace mbv
