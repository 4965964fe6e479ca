// A robot from a file, made ready to run: drives for every DOF, and a first motion.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"

namespace mbv {

/// Gives every DOF of a mechanism one drive. Drives that depend on others are left
/// out unless feet on the ground make them dependent, and DOFs that none of them holds get drives
/// on joints, chosen by rank. Idle spins need none. Rotations of balls that no drive on a joint can
/// hold, such as spins that are not idle, move by forces: `by_forces` gets coordinates for them.
/// What was done is reported in `notes`.
[[nodiscard]] Mechanism WithDriveForEachDof(const Mechanism& mechanism,
                                            std::vector<std::string>* notes,
                                            std::vector<Coordinate>* by_forces);

struct DriveStroke {
  double home = 0.0;    ///< [m] or [rad]
  double height = 0.0;  ///< of its bump; 0: it rests
  double start_s = 0.0, duration_s = 1.0;
};
/// A motion from rest to rest: each drive goes out and back again. Of a robot on its feet, whose
/// drives depend on each other, the base does, and the drives that this leaves free.
struct FirstMotion {
  std::vector<Coordinate> coordinates;  ///< that are commanded
  std::vector<DriveStroke> strokes;     ///< of each
  double duration_s = 1.0;
  bool found = false;                     ///< the loops stay closed on it, away from singular poses
  bool beyond_ranges = false;             ///< home itself is out of range
  std::vector<std::string> without_room;  ///< what rests because other joints' ranges hold it
};
/// The largest of a sequence of ever smaller motions on which loops stay closed, joints stay in
/// their ranges and no body moves much faster against the drives than it does at home. Drives named
/// in `resting` rest, and so do rotations that move by forces.
[[nodiscard]] FirstMotion FindFirstMotion(const Mechanism& mechanism,
                                          const std::vector<std::string>& resting);

/// The files to go on from.
struct DefaultSetup {
  std::string model;                  ///< model.yaml
  std::string scenario;               ///< first.yaml
  std::vector<ModelMeshFile> meshes;  ///< beside model.yaml
  std::vector<std::string> notes;
  Mechanism mechanism;  ///< as `model` describes it
  int by_forces = 0;    ///< DOFs that move by forces: the scenario is a free motion
};
struct DefaultSetupResult {
  std::optional<DefaultSetup> setup;  ///< empty after errors
  Diagnostics diagnostics;
};
/// `file`: anything LoadRobot() takes, with its options. `name`: of the model; "": its own.
/// `model_ref`: how the scenario names the model.
[[nodiscard]] DefaultSetupResult MakeDefaultSetup(const std::string& file, const std::string& name,
                                                  const std::string& model_ref,
                                                  const LoadOptions& options = {});

/// Writes the files of a setup, whose model_ref is "./model.yaml", to `folder`/NAME/setup; empty,
/// or what kept it from that. `scenario`: path of first.yaml, beside model.yaml.
[[nodiscard]] std::string WriteSetup(const DefaultSetup& setup, const std::string& folder,
                                     std::string* scenario);

}  // namespace mbv
