#include "pipeline/prepare.h"

namespace mbv {

std::optional<Prepared> Prepare(const std::string& file, const ScenarioOptions& options,
                                Diagnostics* diagnostics) {
  ScenarioResult loaded = LoadScenario(file, options);
  diagnostics->Append(loaded.diagnostics);
  if (!loaded.scenario) return {};
  Prepared prepared{.scenario = *std::move(loaded.scenario),
                    .base = *std::move(loaded.mechanism),
                    .mechanisms = {},
                    .closed_form = {},
                    .driven_by = {}};
  prepared.mechanisms = LoadWitnessMechanisms(prepared.scenario, prepared.base, diagnostics);
  prepared.closed_form =
      MakeClosedForm(prepared.scenario, prepared.mechanisms.analytic, diagnostics);
  const bool analytic = prepared.closed_form.closed_form != nullptr;
  const bool table = prepared.scenario.reference.table != nullptr;
  prepared.driven_by = analytic ? "analytic" : table ? "solver" : "reference";
  if (prepared.scenario.simulation.on && !analytic && !prepared.scenario.reference.on &&
      !prepared.scenario.motion.free()) {
    Finding finding;
    finding.file = file;
    finding.message =
        "simulation needs the drive motion, but neither a closed form nor the reference gives it";
    finding.hint = "set reference: on";
    diagnostics->Add(std::move(finding));
  }
  if (diagnostics->has_errors()) return {};
  return prepared;
}

DrivenMotion Prepared::MakeDrivenMotion() const {
  if (scenario.motion.free()) return DriveByCommands(mechanisms.simulated, scenario.motion);
  if (driven_by != "analytic") return DriveByReference(mechanisms.reference, scenario.motion);
  // A fresh closed form, because it may follow its solution from the start of the motion.
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, &known);
  return DriveByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

DriveForces Prepared::MakeDriveForces() const {
  const SimulationSettings& settings = scenario.simulation;
  const bool servo = settings.drive_by == DriveBy::kServos && settings.servo.feedforward;
  if (!settings.forward || (settings.drive_by != DriveBy::kForces && !servo)) return {};
  if (driven_by != "analytic") return ForcesByReference(mechanisms.reference, scenario.motion);
  Diagnostics known;
  ClosedFormChoice fresh = MakeClosedForm(scenario, mechanisms.analytic, &known);
  return ForcesByClosedForm(scenario.motion, std::move(fresh.closed_form));
}

}  // namespace mbv
