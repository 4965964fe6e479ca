// In how many ways a mechanism can be put together for the same drives, or for the same output:
// assembly modes (direct kinematics) and working modes (inverse kinematics).
//
// Ways are poses at which loops and couplings close and d coordinates have given values. Two
// searches that know of each other only what they found:
//   * starts: damped Gauss–Newton from joint coordinates drawn at random (each start has a seed of
//     its own). f₁ ways that one start alone has found of N that closed leave a chance of about
//     f₁/N that the next one finds another [Good 1953]; starts end where f₁ = 0 and N ≥ 5 of each.
//   * curves: of every way, each coordinate in turn is let go while the others stay; the curve of
//     poses is followed through its folds, and where it has the value again there is a way, too.
// No proof of completeness follows from either: the number is what was found.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "base/json_text.h"
#include "base/run_summary.h"
#include "features/workspace/reachable_set.h"
#include "report/document.h"

namespace mbv {

struct ModeSettings {
  int least_starts = 64, most_starts = 20000;
  bool curves = true;
  int threads = 1;  ///< nothing depends on it
};

struct AssemblyMode {
  SpacePose pose;
  bool within = true;  ///< the ranges of drives and joints
  int starts = 0;      ///< that ended here
  VecX drives;         ///< values [m or rad], turns near home's
  MatX outputs;        ///< outputs × 6: x … yaw
};

struct AssemblyModes {
  RunSummary summary;
  std::vector<std::string> held, units;  ///< coordinates that are the same, "m" or "rad"
  VecX values;
  std::vector<AssemblyMode> modes;       ///< by their distance from home
  int starts = 0, closed = 0, once = 0;  ///< tried; N; f₁
  int curves = 0, by_curves = 0;         ///< followed; ways that curves found first
  bool settled = false;                  ///< the rule above ended the starts
  double wall_s = 0.0;
};

/// Of drives [m or rad], turns near home's; of outputs, x … yaw in rows.
[[nodiscard]] VecX DriveValues(const Mechanism& mechanism, const BodyStates& states);
[[nodiscard]] MatX OutputValues(const Mechanism& mechanism, const BodyStates& states);

/// All ways with these coordinates, as many as degrees of freedom. Angles of outputs and joints
/// count modulo a turn; coordinates of couplings are in the turns of home.
[[nodiscard]] AssemblyModes FindModes(const Mechanism& mechanism,
                                      const std::vector<NamedCoordinate>& held, const VecX& values,
                                      const ModeSettings& settings,
                                      const std::function<void(double)>& progress = {});

/// Of the pose that a question starts at.
struct ModesOfPose {
  std::vector<std::pair<std::string, AssemblyModes>> of;  ///< "drives", "output"
  std::vector<std::string> notes;
};
/// Errors where drives are not as many as degrees of freedom, or the pose is not reached.
[[nodiscard]] ModesOfPose FindModesOfPose(const SetQuestion& question, bool of_drives,
                                          bool of_output, int threads,
                                          const ProgressFunction& progress,
                                          Diagnostics* diagnostics);

/// The model whose home is one of the ways to close.
[[nodiscard]] Mechanism WithHomeAt(const Mechanism& mechanism, const AssemblyMode& mode);

[[nodiscard]] std::string ToText(const Mechanism& mechanism, const ModesOfPose& modes,
                                 const TextStyle& style);
[[nodiscard]] nlohmann::ordered_json ToJson(const Mechanism& mechanism, const ModesOfPose& modes);
/// The page, and a row per way as CSV.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> ModeFiles(const Mechanism& mechanism,
                                                                         const ModesOfPose& modes);

}  // namespace mbv
