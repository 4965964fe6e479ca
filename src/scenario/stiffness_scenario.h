// StiffnessScenario: the stiffness of a mechanism at one pose, and displacements under loads, as
// data. A scenario file with `kind: stiffness`; see docs/explanation/stiffness.md.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "scenario/load_scenario.h"
#include "scenario/scenario.h"
#include "scenario/stiffness_checks.h"
#include "scenario/stiffness_loads.h"

namespace mbv {

/// Values of an independent set of coordinates by name: OUTPUT.x … OUTPUT.yaw or DRIVE [m, rad].
using PoseValues = std::map<std::string, double>;

struct StiffnessSimulation {
  bool on = true;
  Overrides parameters;
  double force_N = 1000.0;   ///< largest load of the extrapolation to zero load, > 0
  double moment_Nm = 100.0;  ///< > 0
};

struct StiffnessScenario {
  std::string file, name, description;
  std::string model_file;                           ///< the model with beams
  std::vector<ModelCaveat> model_caveats;           ///< of that model
  Overrides parameters;                             ///< for all witnesses, the pose's included
  std::map<std::string, Finding> parameter_places;  ///< where each was written
  PoseValues pose;     ///< coordinates; empty: home pose, to be filled in by the user of this
  std::string output;  ///< "" if the file names none
  AnalyticSettings analytic;
  ReferenceSettings reference;
  StiffnessSimulation simulation;
  bool compare_printed = false;  ///< the paper's own model, too: stated, never judged
  std::vector<Vec6> loads;       ///< [m; f], about the output's origin, world axes
  std::string loads_text;        ///< where they come from, for people
  StiffnessLimits checks;
  Expectation expect;
};

struct StiffnessScenarioResult {
  std::optional<StiffnessScenario> scenario;  ///< empty when there are errors
  std::optional<Mechanism> mechanism;         ///< with `parameters` applied
  Diagnostics diagnostics;
};

[[nodiscard]] StiffnessScenarioResult LoadStiffnessScenario(const std::string& file,
                                                            const ScenarioOptions& options = {});
/// The same from text, for tests; `file` is used in messages and to find the model.
[[nodiscard]] StiffnessScenarioResult LoadStiffnessScenarioText(
    const std::string& text, const std::string& file, const ScenarioOptions& options = {});

/// models/<name>/elastic.yaml for a name, or the path itself (as FindModel()). Empty with the
/// reason in `why` when there is none.
[[nodiscard]] std::optional<std::string> FindElasticModel(const std::string& name,
                                                          const std::string& start,
                                                          std::string* why);

/// A pose as constant commands, for loop closure. The names must be CoordinateNames()
/// (coordinate_names.h).
[[nodiscard]] Motion PoseMotion(const Mechanism& mechanism, const PoseValues& pose);

/// The values of all drives at the home pose.
[[nodiscard]] PoseValues HomePose(const Mechanism& mechanism);

/// What is wrong with a pose's names and their number, with a hint; "" if nothing.
struct PoseFault {
  std::string message, hint;
};
[[nodiscard]] PoseFault CheckPose(const Mechanism& mechanism, const PoseValues& pose);

}  // namespace mbv
