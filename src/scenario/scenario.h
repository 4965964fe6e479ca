// Scenario: one experiment on a mechanism, as data. Read by load_scenario.h, then only read.
//
// Every number is SI and radians; only the file may use keys ending in _deg and _mm.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"
#include "plot/figure.h"
#include "scenario/checks.h"

namespace mbv {

struct ReferenceTable;  // scenario/tables/table.h

/// The closed form's part in a scenario.
struct AnalyticSettings {
  bool on = true;                       ///< false: `analytic: none`
  bool stated = false;                  ///< the file asks for it
  bool required = false;                ///< without it there is no verdict
  std::string model;                    ///< formulation; "" is the mechanism's default
  std::vector<std::string> as_printed;  ///< errata left uncorrected on purpose
  Overrides parameters;                 ///< perturb this witness only
  /// The user's file of equations, as a path, in the place of the mechanism's closed form; "":
  /// none.
  std::string equations;
  bool equations_typed = false;  ///< the file is the user's, of an option
  int equations_line = 0;        ///< in the scenario; 0: unknown
};

/// The reference's part: the generic solver, or a table of forces in its place.
struct ReferenceSettings {
  bool on = true;
  Overrides parameters;
  std::shared_ptr<const ReferenceTable> table;  ///< `reference: {csv: …}`; null: generic solver
};

/// Forces that are linear in a parameter, extrapolated to the scenario's value of it from two runs
/// at values an engine can handle (massless links from factors 1 and 0.5).
struct Extrapolation {
  std::string parameter;
  std::array<double, 2> from{1.0, 0.5};
};

/// A servo gain: one number for all drives, or one per drive by name.
struct Gain {
  std::optional<double> all;
  std::map<std::string, double> by_drive;

  /// 0 for a drive without one.
  [[nodiscard]] double Of(const std::string& drive) const {
    const auto found = by_drive.find(drive);
    return found != by_drive.end() ? found->second : all.value_or(0.0);
  }
};

/// Position and velocity servos: force = kp (x_cmd − x) + kv (ẋ_cmd − ẋ) + feed-forward.
struct ServoSettings {
  Gain kp;                   ///< [N/m or N m/rad], > 0
  Gain kv;                   ///< [N s/m or N m s/rad], > 0
  bool feedforward = false;  ///< add the drive forces of the equations for the commanded motion
};

/// The simulation's part.
struct SimulationSettings {
  bool on = true;
  DriveMode mode = DriveMode::kPrescribedMotion;
  ServoSettings servo;         ///< kServo only
  bool stock_engine = false;   ///< judge MuJoCo as it is instead of the corrected engine
  bool stock_too = false;      ///< forward only: run MuJoCo as it is, too, and report its error
  double step_s = 1e-3;        ///< > 0
  bool ignore_ranges = false;  ///< simulate beyond drive and joint ranges
  Overrides parameters;
  std::optional<Extrapolation> extrapolate;

  /// Integrates in time.
  [[nodiscard]] bool forward() const { return mode != DriveMode::kInverse; }
};

/// A program outside that computes the scenario as well (docs/how-to/external_solvers.md).
struct ForeignWitness {
  std::string name;
  std::vector<std::string> command;              ///< program and arguments; not empty
  LimitColumn limits = LimitColumn::kReference;  ///< that it is judged by
  std::optional<double> force_nrmse;             ///< > 0, instead of that limit of drive forces
  bool required = false;                         ///< without it there is no verdict
  double timeout_s = 60.0, memory_mb = 4000.0, output_mb = 500.0;  ///< > 0
  bool typed = false;  ///< the command is the user's, of an option
  int line = 0;        ///< of the command in the file; 0: unknown
};

struct CameraSettings {
  std::optional<double> azimuth_rad, elevation_rad, distance_m;
  std::optional<Vec3> lookat_W;
  bool orthographic = false;
};

struct SnapshotSettings {
  std::vector<double> times_s;  ///< within the motion
  std::array<int, 2> size_px{1280, 960};
  CameraSettings camera;
  int path_output = -1;  ///< output whose path through the whole motion is drawn; -1: none
  /// Other instants drawn pale into each picture [s]; or this many between the start and its own.
  std::vector<double> ghost_times_s;
  int ghost_count = 0;
  std::string background;           ///< "transparent" or a colour; "": sky and ground
  std::vector<std::string> labels;  ///< words of PlacesFor() in mechanism/named_places.h
  bool scale_bar = false, line_art = false;
  double exploded = 1.0;  ///< 1 … 10
};

/// What running this file must give; used by the tests of the shipped scenarios.
struct Expectation {
  std::string verdict = "agree";  ///< "agree", "disagree" or "not_run"
  int exit_code = 0;
  std::string mentions;  ///< must occur in the printed result
};

/// A part of a scenario in which the same feet stand on the ground: a mechanism of its own, whose
/// home pose is where the part before ends.
struct ScenarioPhase {
  size_t index = 0, count = 1;
  std::string name = {};                   ///< of the file, or its number from 1
  double from_s = 0.0, to_s = 1.0;         ///< scenario time; that of Scenario::motion begins at 0
  double end_s = 1.0;                      ///< of the last phase
  std::vector<std::string> contacts = {};  ///< that hold
  /// Scenario::motion with profiles that are functions of scenario time.
  Motion in_scenario_time = {};
  /// Coordinates of the joints at its beginning, by joint; empty: those of the model's home.
  std::map<std::string, std::array<double, 6>> start = {};

  [[nodiscard]] bool last() const { return index + 1 == count; }
};

struct Scenario {
  std::string file;  ///< as given
  std::string name;  ///< file name without its ending, "must_fail/x" below a model's folder
  std::string description;
  std::string model_file;                           ///< the model.yaml it uses
  std::vector<ModelCaveat> model_caveats;           ///< of that model
  Overrides parameters;                             ///< for all witnesses
  std::map<std::string, Finding> parameter_places;  ///< where each override was written
  std::optional<Vec3> gravity_W;                    ///< instead of the model's [m/s²]
  Motion motion;
  /// Samples before this time are left out of the force metrics; 0 unless the file names it.
  double start_window_s = 0.0;
  AnalyticSettings analytic;
  ReferenceSettings reference;
  SimulationSettings simulation;
  std::vector<ForeignWitness> witnesses;
  CheckLimits checks;
  SnapshotSettings snapshots;
  Expectation expect;
  std::vector<FigureSpec> figures;                  ///< that its author composes
  std::optional<std::vector<std::string>> holding;  ///< contacts that hold; empty: all
  std::optional<ScenarioPhase> phase;               ///< that this is, of a scenario with `phases`
};

/// The sum of two override sets; `over` wins.
[[nodiscard]] Overrides Merge(const Overrides& base, const Overrides& over);

}  // namespace mbv
