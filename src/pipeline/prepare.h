// A scenario made ready to run: loaded, and resolved for each witness.
#pragma once

#include <optional>
#include <string>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"
#include "pipeline/witnesses.h"
#include "scenario/load_scenario.h"

namespace mbv {

struct Prepared {
  Scenario scenario;
  Mechanism base;  ///< with the scenario's common parameters
  WitnessMechanisms mechanisms;
  ClosedFormChoice closed_form;
  std::string driven_by;  ///< whose kinematics the simulation follows

  /// The commanded motion of everything driven; refers to this object.
  [[nodiscard]] DrivenMotion MakeDrivenMotion() const;
  /// The drive forces for it, by the same witness; refers to this object. Empty where the
  /// simulation is given none.
  [[nodiscard]] DriveForces MakeDriveForces() const;
};

/// Loads a scenario with everything it needs. Empty after bad input; warnings may remain.
[[nodiscard]] std::optional<Prepared> Prepare(const std::string& file,
                                              const ScenarioOptions& options,
                                              Diagnostics* diagnostics);

}  // namespace mbv
