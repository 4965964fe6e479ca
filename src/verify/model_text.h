// What is known about a model: mobility report, generated MJCF and URDF.
#pragma once

#include <string>
#include <vector>

#include "base/run_summary.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"

// Robots of foreign formats.

namespace mbv {

/// LoadModel(), which takes .urdf; MJCF (.xml) by MuJoCo's compiler and SDF (.sdf) by libsdformat,
/// each in a process of its own.
[[nodiscard]] LoadResult LoadRobot(const std::string& file, const LoadOptions& options = {});

/// LoadBodies() of the same files.
[[nodiscard]] LoadedBodies LoadRobotBodies(const std::string& file);

/// Mobility report to read or as JSON, the generated MJCF, URDF or model.yaml, or the
/// mechanism.json of foreign witnesses. A model.yaml says what its source left out.
enum class ModelFormat { kMobility, kJson, kMjcf, kUrdf, kYaml, kMechanism };
[[nodiscard]] std::string ModelText(const Mechanism& mechanism, ModelFormat format,
                                    const std::vector<ModelCaveat>& caveats = {});

/// Servos that hold a mechanism in its home pose.
struct HomeServos {
  std::vector<double> kp, kv;  ///< per drive [N/m, N s/m or N m/rad, N m s/rad]
  std::vector<double> force;   ///< per drive: what holds home [N or N m]; the least where shared
  RunSummary summary;          ///< kUnsupported: drives cannot hold home, or MuJoCo lacks one
};

/// Gains by each drive's inertia at home, the others free to move: with `frequency_hz` and critical
/// damping all together are no faster than the number of drives times that.
[[nodiscard]] HomeServos TuneHomeServos(const Mechanism& mechanism, double frequency_hz = 5.0);

/// What holds the drives of a generated MJCF: nothing, their equalities, or servos tuned for it.
enum class ModelDrives { kFree, kHeld, kServo };

struct MjcfText {
  std::string text = {};                  ///< "" when there is trouble
  std::string trouble;                    ///< why there is no such text
  std::vector<std::string> missing = {};  ///< what acts on forces and MuJoCo has no word for
};
[[nodiscard]] MjcfText MjcfFor(const Mechanism& mechanism, ModelDrives drives);

}  // namespace mbv
