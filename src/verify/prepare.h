// A scenario made ready to run: loaded, and resolved for each witness.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analytic/closed_form.h"
#include "base/diagnostics.h"
#include "base/roles.h"
#include "comparison/comparison.h"
#include "mechanism/mechanism.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"
#include "verify/program_consent.h"

namespace mbv {

/// The scenario's mechanism as each witness sees it (their own parameter overrides applied).
struct WitnessMechanisms {
  Mechanism analytic, reference, simulated;
};

/// A closed form for a scenario, or the reason why there is none.
struct ClosedFormChoice {
  std::unique_ptr<ClosedForm> closed_form;
  std::string reason;  ///< not empty: switched off, or the mechanism has none, or it is outside
                       ///< what the equations cover
  /// kNotApplicable where the scenario counts on one: it asks for it, or the mechanism has one.
  WitnessGap gap = WitnessGap::kNone;
  std::string unchecked = {};  ///< of a file of equations that does not state what it covers
};
/// Unsuitable models, errata and commands are errors; what the equations do not cover of the
/// mechanism and its loads is a warning each.
[[nodiscard]] ClosedFormChoice MakeClosedForm(const Scenario& scenario, const Mechanism& mechanism,
                                              const ProgramConsent& consent,
                                              Diagnostics* diagnostics);

struct Prepared {
  Scenario scenario;
  Mechanism base;  ///< with the scenario's common parameters
  WitnessMechanisms mechanisms;
  ClosedFormChoice closed_form;
  ProgramConsent consent = {};  ///< with which the equations of a file run
  /// Of a phase: what happens at its beginning and is in no computation. Sentences.
  std::vector<std::string> left_out_at_start = {};

  /// The witness whose kinematics the simulation follows.
  [[nodiscard]] const Role& driver() const;
  [[nodiscard]] bool has_closed_form() const { return closed_form.closed_form != nullptr; }
  /// A table stands in the reference's place.
  [[nodiscard]] bool has_table() const { return scenario.reference.table != nullptr; }
  /// The commanded motion of everything driven; refers to this object.
  [[nodiscard]] DrivenMotion MakeDrivenMotion() const;
  /// The drive forces for it, by the same witness; refers to this object. Empty where the
  /// simulation is given none.
  [[nodiscard]] DriveForces MakeDriveForces() const;
};

/// Warns of what a closed form does not cover; in short why it does not apply, "" if it does.
[[nodiscard]] std::string WarnNotApplicable(const std::string& scenario_file,
                                            std::vector<Finding> uncovered,
                                            Diagnostics* diagnostics);
/// What a factory of closed forms found, about the scenario where it names no file.
void AddFormFindings(const std::string& scenario_file, const Diagnostics& found,
                     Diagnostics* diagnostics);

/// Loads a scenario with everything it needs. Empty after bad input; warnings may remain.
/// Equations that run as a program run where they are trusted or `consent` allows it.
[[nodiscard]] std::optional<Prepared> Prepare(const std::string& file,
                                              const ScenarioOptions& options,
                                              Diagnostics* diagnostics,
                                              const ProgramConsent& consent = {});
/// The same of a scenario that was loaded.
[[nodiscard]] std::optional<Prepared> Prepare(ScenarioResult loaded, Diagnostics* diagnostics,
                                              const ProgramConsent& consent = {});

/// After numbers in profiles of commands and loads of `prepared->scenario.motion` have changed, and
/// nothing else: makes again what depends on them. False after bad input.
[[nodiscard]] bool PrepareAgain(Prepared* prepared, Diagnostics* diagnostics);

/// The phases of a scenario, each from where the reference's kinematics leaves the one before; a
/// scenario without phases is one. Empty after bad input. Ends with a phase whose motion is not
/// possible: running it says why.
[[nodiscard]] std::vector<Prepared> PreparePhases(const std::string& file,
                                                  const ScenarioOptions& options,
                                                  Diagnostics* diagnostics,
                                                  const ProgramConsent& consent = {});

/// The mechanism as each witness sees it. Findings are bad input.
[[nodiscard]] WitnessMechanisms LoadMechanisms(const Scenario& scenario, const Mechanism& base,
                                               Diagnostics* diagnostics);
/// Of this mechanism, the parameters that the scenario gives single witnesses another value of.
[[nodiscard]] std::map<std::string, Overrides> OwnParameters(const Scenario& scenario,
                                                             const Mechanism& base);

/// The mechanism with a witness' own overrides: `base`, or the model loaded again. Findings are bad
/// input.
[[nodiscard]] Mechanism LoadVariant(const Scenario& scenario, const Mechanism& base,
                                    const Overrides& own, const Role& witness,
                                    Diagnostics* diagnostics);

}  // namespace mbv
