// StiffnessForm: a paper's stiffness model of one mechanism.
//
// Like ClosedForm (closed_form.h): reads its constants from Mechanism::parameters and knows nothing
// of beams, finite elements or MuJoCo. A form is added by one row in registry.cc, or from outside
// by register_closed_form.h.
#pragma once

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "analytic/coverage.h"
#include "base/diagnostics.h"
#include "math/stiffness.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// A pose as the values of an independent set of coordinates by name: OUTPUT.x … OUTPUT.yaw or
/// DRIVE [m, rad].
using PoseCoordinates = std::map<std::string, double>;

/// A number that the paper derives from K ("kappa_m").
struct StiffnessIndex {
  std::string name, unit, meaning;
};

class StiffnessForm {
 public:
  virtual ~StiffnessForm() = default;

  /// K, C and the elements' shares at a pose. Unreachable poses and singular ones are in the
  /// summary of the result.
  [[nodiscard]] virtual StiffnessResult Evaluate(const PoseCoordinates& pose) const = 0;

  /// The same without the elements' shares, for many poses: takes no memory where the summary is
  /// kDone.
  [[nodiscard]] virtual StiffnessResult EvaluateMatrices(const PoseCoordinates& pose) const = 0;

  /// No joint and no drive is beyond its range at a pose that is reached: what workspaces ask, too.
  [[nodiscard]] virtual bool IsWithinRanges(const PoseCoordinates& pose) const = 0;

  /// The paper's indices, and their values for a stiffness (one per index).
  [[nodiscard]] virtual std::vector<StiffnessIndex> indices() const = 0;
  virtual void IndexValues(const StiffnessResult& result, std::span<double> values) const = 0;
};

/// Makes the form, or explains in `diagnostics` why the parameters, the names of the pose's
/// coordinates or the model do not suit it.
using StiffnessFormFactory = std::unique_ptr<StiffnessForm> (*)(const Mechanism&,
                                                                const PoseCoordinates& pose,
                                                                const std::string& model,
                                                                Diagnostics* diagnostics);

struct StiffnessFormRow {
  std::string mechanism;            ///< Mechanism::name
  std::string output;               ///< the output whose stiffness the paper gives
  std::vector<std::string> models;  ///< formulations, the default ("corrected") first, the paper's
                                    ///< own ("as_printed") among them
  StiffnessFormFactory factory = nullptr;
  CoverageFunction coverage = nullptr;  ///< what it takes for granted; see ClosedFormRow
  PoseCoordinates example_pose = {};    ///< where a scenario gives none; empty: the home pose
  std::vector<std::string> usual_maps =
      {};  ///< of `--map usual`, the first one's ranges the default
};

[[nodiscard]] std::span<const StiffnessFormRow> StiffnessForms();
/// The row for a mechanism name, or nullptr.
[[nodiscard]] const StiffnessFormRow* FindStiffnessForm(const std::string& mechanism);

// What the stiffness forms of all mechanisms check before they are made, as findings.

/// The coordinates by which a form takes its pose.
struct PoseNames {
  std::vector<std::string> needed, accepted = {};
  std::string hint = {};  ///< "the pose is platform.x, …"
};

/// Coordinates that the form of this mechanism cannot take, and those it misses.
void CheckPoseNames(const Mechanism& mechanism, const PoseNames& names, const PoseCoordinates& pose,
                    Diagnostics* diagnostics);

/// Parameters that the model does not have, and those of `positive` that are not.
void CheckStiffnessParameters(const Mechanism& mechanism, std::span<const std::string> positive,
                              std::span<const std::string> others, Diagnostics* diagnostics);

/// Index of `model` among `models`; 0 for "", the default; −1 after a finding.
[[nodiscard]] int IndexOfModel(std::span<const std::string> models, const std::string& model,
                               Diagnostics* diagnostics);

/// (M + Mᵀ)/2.
[[nodiscard]] inline Mat6 Symmetric(const Mat6& M) { return 0.5 * (M + M.transpose()); }

}  // namespace mbv
