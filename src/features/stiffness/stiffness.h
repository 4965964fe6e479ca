// Stiffness of a mechanism at a pose by closed form, frame elements and simulation.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "analytic/stiffness_form.h"
#include "base/diagnostics.h"
#include "features/stiffness/stiffness_measures.h"
#include "features/stiffness/stiffness_report.h"
#include "features/stiffness/stiffness_scenario.h"
#include "verify/prepare.h"
#include "verify/run_options.h"

namespace mbv {

/// A scenario ready to run: names resolved, closed forms made.
struct PreparedStiffness {
  StiffnessScenario scenario;  ///< its motion is the pose, commanded
  Mechanism base;              ///< with the scenario's common parameters
  WitnessMechanisms mechanisms;
  int output = 0;
  std::unique_ptr<StiffnessForm> form;  ///< null: none, or switched off
  std::string form_reason;              ///< why, if null
  /// Not kNone where the scenario states a closed form, or there is one that does not apply.
  WitnessGap form_gap = WitnessGap::kNone;
  std::string form_model;
  std::unique_ptr<StiffnessForm> printed;  ///< the paper's own, if it is compared
  std::string pose_note;                   ///< where a pose comes from that the scenario left out
};

/// Resolves what a scenario leaves open: output (the closed form's, else the only one), pose (that
/// of the mechanism's example, else home). Empty after findings.
[[nodiscard]] std::optional<PreparedStiffness> PrepareStiffness(StiffnessScenario scenario,
                                                                Mechanism base,
                                                                Diagnostics* diagnostics);
/// From a file.
[[nodiscard]] std::optional<PreparedStiffness> PrepareStiffnessFile(const std::string& file,
                                                                    const ScenarioOptions& options,
                                                                    Diagnostics* diagnostics);

/// That a mechanism has no output of this name, or not one alone if it is ""; without a place.
[[nodiscard]] Finding MissingOutput(const Mechanism& mechanism, const std::string& name);

/// The example pose that is used when none is given; empty for other mechanisms.
[[nodiscard]] PoseValues ExamplePose(const std::string& mechanism);

struct StiffnessRun {
  StiffnessReport report;
  std::string mjcf;  ///< the compliant model as simulated; "" if it was not
};
[[nodiscard]] StiffnessRun RunStiffness(const PreparedStiffness& prepared,
                                        const ProgressFunction& progress = {});

/// Indices of the paper (`form` may be null), then the general ones; NaN without a stiffness.
[[nodiscard]] std::vector<NamedIndex> IndicesOf(const StiffnessForm* form,
                                                const StiffnessResult& result);

/// Poses of all bodies at given coordinates, loops closed by the reference solver.
[[nodiscard]] RunSummary CloseLoops(const Mechanism& mechanism, const PoseValues& pose,
                                    std::vector<Pose>* X_WB);

/// `mbverify run` for a file with `kind: stiffness`.
[[nodiscard]] RunOutcome RunStiffnessScenario(const std::string& file, const RunOptions& options);

/// Name and content of everything a run writes.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> StiffnessFiles(
    const StiffnessRun& run);

}  // namespace mbv
