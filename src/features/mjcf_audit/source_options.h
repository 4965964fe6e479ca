// A user's own MJCF, stepped as it is or with some of its settings changed.
//
// Only the motion is imposed. Contacts are off, bodies on free joints do not move, couplings that
// the mechanism does not have and actuators that are no drives are off; SourceModelRun::facts says
// what was done. MuJoCo's parser and engine may crash on hostile files: call it in a process of its
// own.
#pragma once

#include <string>
#include <vector>

#include "base/run_summary.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "simulation/engine/simulation.h"

namespace mbv {

/// What makes a drive follow the commanded motion.
enum class DriveHold {
  kServo,     ///< the file's position actuators on the joint get the commanded position (its
              ///< velocity actuators there the commanded velocity)
  kEquality,  ///< the file's equality that holds the joint gets the commanded position
  kAdded,     ///< an added equality of impedance 0.9999, whose reference acceleration is exact
};

enum class SourceModelIntegrator { kOwn, kEuler, kRk4, kImplicit };

/// What differs from the file; NaN and false: nothing.
struct SourceModelSettings {
  double step_factor = 1.0;  ///< of the file's step
  SourceModelIntegrator integrator = SourceModelIntegrator::kOwn;
  double time_constant_s = kNan;  ///< of the closures: solref "x 1"
  double impedance = kNan;        ///< of the closures: solimp "x x 0.001 0.5 2"
  double impratio = kNan;
  /// Supplies J̇q̇, which MuJoCo before 3.7 leaves out of the closures' reference acceleration, as a
  /// central difference of J q̇ along the motion.
  bool velocity_term = false;
  bool exact_drives = false;  ///< all drives as DriveHold::kAdded
  bool plain = false;  ///< without what the mechanism does not have: SourceModelFacts::left_out
  bool exact_solver = false;    ///< Newton's method to the end
  bool stiff_friction = false;  ///< friction losses as stiff as MuJoCo allows: 2 steps, 0.9999
};

struct SourceModelTask {
  std::string text, file;                ///< MJCF as the user wrote it
  std::string base;                      ///< LoadOptions::base with which `mechanism` was made
  const Mechanism* mechanism = nullptr;  ///< made of the file, with all drives
  DrivenMotion driven;                   ///< of the drives; starts at home at rest
  double duration_s = 1.0;
  double sample_s = 0.01;      ///< wanted; samples fall on whole steps of the file
  bool ignore_ranges = false;  ///< joint limits are off
  SourceModelSettings settings = {};
};

/// What the file says, and what was made of it.
struct SourceModelFacts {
  double step_s = kNan;            ///< the file's
  std::string integrator, solver;  ///< as MJCF names them
  double tolerance = kNan;
  int iterations = 0;
  bool has_friction = false;          ///< hinges or slides with a friction loss
  bool rough_solver = false;          ///< not Newton's method with at least MuJoCo's default effort
  std::vector<std::string> closures;  ///< names
  std::vector<std::string> solref, solimp;  ///< per closure, as MJCF
  std::vector<DriveHold> held_by;           ///< per drive
  std::vector<std::string> motors;          ///< per drive: its motor in the file, or ""
  std::vector<std::string> left_out;        ///< "armature", "damping", …
  std::vector<std::string> held;            ///< free bodies that do not move
  std::vector<std::string> damped;          ///< servos with a `kv`, which MuJoCo 2.2 drops
  std::vector<std::string> couplings, unused_actuators;  ///< equalities and actuators that are off
};

struct SourceModelRun {
  RunSummary summary;  ///< kUnsupported: cannot be run so; kEngineFailure: the numbers are unsound
  SourceModelFacts facts;
  /// DRIVE.force of every drive [N, N m], and the force part of the closures' reactions.
  Trace trace;
  struct Gap {  ///< of one closure, its largest at the samples
    double position_m = 0.0, position_at_s = 0.0, rotation_rad = 0.0, rotation_at_s = 0.0;
  };
  std::vector<Gap> gaps;           ///< per facts.closures
  std::vector<double> tracking;    ///< per drive: largest distance from its command [m, rad]
  std::vector<std::string> notes;  ///< limits, saturation; with times
  double step_s = kNan;            ///< used
  double cost_ms = kNan;           ///< processor time of mj_step per simulated second
};

[[nodiscard]] SourceModelRun RunSourceModel(const SourceModelTask& task);

}  // namespace mbv
