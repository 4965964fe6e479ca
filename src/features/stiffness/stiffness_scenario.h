// StiffnessScenario: the stiffness of a mechanism at one pose, and displacements under loads, as
// data. A scenario file with `kind: stiffness`; see docs/explanation/stiffness.md.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/types.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/load_scenario.h"
#include "scenario/scenario.h"

// Loads of a stiffness scenario: wrenches [m; f] on the output, about its origin, world axes.

namespace mbv {

/// Random wrenches that every computer draws alike. Each number is
///   x ← 6364136223846793005 x + 1442695040888963407 mod 2⁶⁴,  u = (x >> 11) 2⁻⁵³ in [0, 1),
/// starting at x = seed; one wrench takes six: Fx, Fy, Fz = force_max·u, Mx, My, Mz = moment_max·u.
struct RandomLoads {
  int count = 50;  ///< > 0
  std::uint64_t seed = 20250201;
  double force_max = 1000.0;  ///< [N], >= 0
  double moment_max = 1.0;    ///< [N m], >= 0
};

[[nodiscard]] std::vector<Vec6> DrawLoads(const RandomLoads& loads);
/// "50 random wrenches, seed 20250201: …"
[[nodiscard]] std::string TextOf(const RandomLoads& loads);

/// Values of an independent set of coordinates by name: OUTPUT.x … OUTPUT.yaw or DRIVE [m, rad].
using PoseValues = std::map<std::string, double>;

/// What of a scenario concerns its stiffness; parameters, witnesses and checks are those of all.
struct StiffnessScenario : Scenario {
  PoseValues pose;     ///< coordinates; empty: home pose, to be filled in by the user of this
  std::string output;  ///< "" if the file names none
  /// Largest loads of the simulation's extrapolation to zero load, > 0.
  double force_N = 1000.0, moment_Nm = 100.0;
  bool compare_printed = false;  ///< the paper's own model, too: stated, never judged
  std::vector<Vec6> loads;       ///< [m; f], about the output's origin, world axes
  std::string loads_text;        ///< where they come from, to read
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

/// models/<name>/elastic.yaml for a name, or the path itself (as FindModel()); a finding without a
/// place when there is none.
[[nodiscard]] std::variant<std::string, Finding> FindElasticModel(const std::string& name,
                                                                  const std::string& start);

/// A pose as constant commands, for loop closure. The names must be among
/// NamedCommandCoordinates().
[[nodiscard]] Motion PoseMotion(const Mechanism& mechanism, const PoseValues& pose);

/// The values of all drives at the home pose.
[[nodiscard]] PoseValues HomePose(const Mechanism& mechanism);

/// What is wrong with a pose's names and their number, without a place.
[[nodiscard]] std::optional<Finding> CheckPose(const Mechanism& mechanism, const PoseValues& pose);

/// Takes one entry of a pose: a coordinate, or a parameter of the model that belongs to it. `key`
/// may end in a unit, in which `number` is; without a number only the name is checked. What is
/// wrong with it, without a place.
[[nodiscard]] std::optional<Finding> PutIntoPose(const Mechanism& mechanism, const std::string& key,
                                                 std::optional<double> number, PoseValues* pose,
                                                 Overrides* parameters);

/// Why a model has no stiffness: nothing in it yields.
[[nodiscard]] std::optional<Finding> CheckElastic(const Mechanism& mechanism,
                                                  const std::string& model_file);

}  // namespace mbv
