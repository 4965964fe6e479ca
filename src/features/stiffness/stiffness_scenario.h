// StiffnessScenario: the stiffness of a mechanism at one pose, and displacements under loads, as
// data. A scenario file with `kind: stiffness`; see docs/explanation/stiffness.md.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
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

// The checks of a stiffness scenario: what is judged and how good it must be.
//
//   checks: {stiffness_entry: 1e-5}             simulation against another computation
//           {reference_stiffness_entry: 1e-10}  frame elements against closed form
//           {displacement_axis: null}           switched off, and reported as such

/// A judged quantity. Those of a pair compare two witnesses; the others need one only. Entries are
/// compared in units of sqrt(K_ii K_jj): that number does not change with the units of length and
/// angle, and is the relative error for i = j.
enum class StiffnessMetric {
  kStiffnessEntry,    ///< pair: max |ΔK_ij| / sqrt(K_ii K_jj)
  kComplianceEntry,   ///< pair: max |ΔC_ij| / sqrt(C_ii C_jj)
  kShareEntry,        ///< pair: the same for each element's share of C, in units of the whole C
  kDisplacementAxis,  ///< pair: max error of Δx, Δy, Δz over the loads / max |Δ| of that axis
  kDisplacementVector,  ///< pair: max over the loads of |error of (Δx, Δy, Δz)| / |(Δx, Δy, Δz)|
  kRotationAxis,        ///< pair: as displacement_axis, for the rotation vector
  kSymmetry,            ///< |K_ij − K_ji| / sqrt(K_ii K_jj)
  kDefinite,            ///< how far the scaled K's smallest eigenvalue is below zero
  kSharesSum,           ///< elements' shares add up to C
  kResidual,            ///< unbalanced force of the equilibria, over the load
  kExtrapolation,       ///< error of the extrapolation to zero load
};
inline constexpr int kStiffnessMetrics = 11;

/// Limits of one metric; an empty one is switched off.
struct StiffnessLimit {
  std::optional<double> simulated;  ///< a simulation takes part
  std::optional<double> computed;   ///< closed form and frame elements only
};

struct StiffnessMetricRow {
  StiffnessMetric metric;
  const char* key;       ///< in `checks:` and in check names
  const char* title;     ///< for people
  bool of_pair;          ///< compares two witnesses
  StiffnessLimit limit;  ///< defaults
};

[[nodiscard]] std::span<const StiffnessMetricRow> StiffnessMetricRows();
[[nodiscard]] const StiffnessMetricRow& RowOf(StiffnessMetric metric);
[[nodiscard]] const StiffnessMetricRow* FindStiffnessMetric(const std::string& key);

/// All limits of a scenario, starting from the defaults.
struct StiffnessLimits {
  StiffnessLimits();
  std::array<StiffnessLimit, kStiffnessMetrics> of;

  [[nodiscard]] const StiffnessLimit& operator[](StiffnessMetric m) const {
    return of[static_cast<size_t>(m)];
  }
  [[nodiscard]] StiffnessLimit& operator[](StiffnessMetric m) { return of[static_cast<size_t>(m)]; }
};

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

/// models/<name>/elastic.yaml for a name, or the path itself (as FindModel()); a finding without a
/// place when there is none.
[[nodiscard]] std::variant<std::string, Finding> FindElasticModel(const std::string& name,
                                                                  const std::string& start);

/// A pose as constant commands, for loop closure. The names must be CoordinateNames()
/// (coordinate_names.h).
[[nodiscard]] Motion PoseMotion(const Mechanism& mechanism, const PoseValues& pose);

/// The values of all drives at the home pose.
[[nodiscard]] PoseValues HomePose(const Mechanism& mechanism);

/// What is wrong with a pose's names and their number, without a place.
[[nodiscard]] std::optional<Finding> CheckPose(const Mechanism& mechanism, const PoseValues& pose);

// The sections of a stiffness scenario that do not need its mechanism.

[[nodiscard]] ReferenceSettings ReadStiffnessReference(ValueReader* values, const YamlNode* node);
[[nodiscard]] StiffnessSimulation ReadStiffnessSimulation(ValueReader* values,
                                                          const YamlNode* node);
/// The wrenches of `loads:` and where they come from.
[[nodiscard]] std::vector<Vec6> ReadStiffnessLoads(ValueReader* values, const YamlNode* node,
                                                   std::string* text);
[[nodiscard]] StiffnessLimits ReadStiffnessChecks(ValueReader* values, const YamlNode* node);

}  // namespace mbv
