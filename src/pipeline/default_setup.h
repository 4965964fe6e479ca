// A robot from a file, made ready to run: drives for every freedom, and a first motion.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "mechanism/mechanism.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"

namespace mbv {

/// Gives every freedom of a mechanism one drive. Drives that depend on others are left out, and
/// freedoms that none of them holds get drives on joints, chosen by rank. A rod that can spin about
/// its own axis between two balls is held by making one of them a universal joint. What was done is
/// said in `notes`.
[[nodiscard]] Mechanism WithDriveForEachFreedom(const Mechanism& mechanism,
                                                std::vector<std::string>* notes);

struct DriveStroke {
  double home = 0.0;    ///< [m] or [rad]
  double height = 0.0;  ///< of its bump; 0: it rests
  double start_s = 0.0, duration_s = 1.0;
};
/// A motion from rest to rest: each drive goes out and back again.
struct FirstMotion {
  std::vector<DriveStroke> strokes;  ///< per drive
  double duration_s = 1.0;
  bool found = false;          ///< the loops stay closed on it, away from singular poses
  bool beyond_ranges = false;  ///< home itself is out of range
};
/// The largest of a sequence of ever smaller motions on which loops stay closed, joints stay in
/// their ranges and no body moves much faster against the drives than it does at home. Drives named
/// in `resting` rest.
[[nodiscard]] FirstMotion FindFirstMotion(const Mechanism& mechanism,
                                          const std::vector<std::string>& resting);

/// The files to go on from.
struct DefaultSetup {
  std::string model;                  ///< model.yaml
  std::string scenario;               ///< first.yaml
  std::vector<ModelMeshFile> meshes;  ///< beside model.yaml
  std::vector<std::string> notes;
  Mechanism mechanism;  ///< as `model` describes it
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

}  // namespace mbv
