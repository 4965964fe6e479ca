// model.yaml (and URDF) → Mechanism.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/markup.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// A number that a file writes out where it is used: no parameter, no expression of parameters.
struct Literal {
  std::string place;    ///< "parts.leg.bodies.rod.mass", "urdf.rod.inertia.xy"
  double value = kNan;  ///< SI units
};

struct LoadOptions {
  /// Parameter overrides by name; an unknown name is an error. Names may end in a unit:
  /// SplitUnit().
  std::map<std::string, double> overrides;
  /// Where the overrides were written, for messages ("scenario.yaml:7:3").
  std::map<std::string, Finding> override_places;
  std::optional<Vec3> gravity_W;  ///< [m/s²], instead of the model's; its `up` stays
  /// Which way to close the loops is meant (kinematics/home.h), by the name of a closure; counted
  /// from 1 in the order in which they are reported.
  std::map<std::string, int> assembly = {};
  /// The body or link of a robot that is held in the pose of its file; "": what hangs together is
  /// held at its root, where nothing ties it to the world. No model file has one.
  std::string base = {};
  /// Gap up to which rounded loops are closed [m], instead of what a model file states or the
  /// digits of a robot's file explain.
  double closure_tolerance_m = kNan;
  /// Of the robot's file that the text stands for; of a URDF file its own.
  PrintedRounding printed = {};
  /// Other values of literals, by place.
  std::map<std::string, double> literals;
  /// The base is not held: a free joint carries it, and contacts may hold its feet.
  bool free_base = false;
  /// Contacts beside those of the file, as --plant takes them (internal::ContactReader).
  std::vector<std::string> plants = {};
  /// Names of the contacts that hold; empty: all of them.
  std::optional<std::vector<std::string>> holding = {};
  /// Joint coordinates from which the home pose is solved, by joint, instead of the file's guesses.
  std::map<std::string, std::array<double, 6>> guesses = {};
};

/// Whether a file is a robot of a foreign format (.urdf, .xml, .sdf), by its name, or
/// becomes one (.xacro).
[[nodiscard]] bool IsRobotFile(const std::string& file);
/// The model file that completes a URDF and stands for it, where one lies beside it
/// (UrdfCompanionPath()); else the file itself.
[[nodiscard]] std::string CompletedModel(const std::string& file);
/// "expand it first: xacro X.urdf.xacro > X.urdf", of a file that is to be expanded.
[[nodiscard]] std::string XacroHint(const std::string& file);

struct LoadResult {
  std::optional<Mechanism> mechanism;  ///< empty when there are errors
  Diagnostics diagnostics;             ///< all findings, warnings included
  std::vector<Literal> literals;       ///< in the order of reading, each place once
  std::vector<ModelCaveat> caveats;    ///< what every verdict on it names
  /// Limits that a URDF file states of what may move a joint, by the joint's name; those of drives
  /// are motors of the mechanism.
  std::map<std::string, Motor> motors_of_joints = {};
};

/// Gives every drive on a joint of one coordinate that has no motor the one of its joint.
void AddMotorsOfJoints(const std::map<std::string, Motor>& motors, Mechanism* mechanism);

/// Loads `file` (model.yaml or .urdf), evaluates expressions, builds the joint graph and spanning
/// tree, solves the home pose and checks that all loops close. Never throws for bad input.
[[nodiscard]] LoadResult LoadModel(const std::string& file, const LoadOptions& options = {});

/// The same from text, for tests and fuzzing; `file` is used in messages and to find a URDF.
[[nodiscard]] LoadResult LoadModelText(const std::string& text, const std::string& file,
                                       const LoadOptions& options = {});

// The bodies of a model file alone: how they are joined, and whether their masses are possible, is
// not judged.

struct LoadedBodies {
  std::vector<Body> bodies;  ///< the world first; empty after errors
  Diagnostics diagnostics;   ///< all findings, warnings included
};

/// Reads `file` (model.yaml or .urdf) as LoadModel() does. Never throws for bad input.
[[nodiscard]] LoadedBodies LoadBodies(const std::string& file);

/// The same from text; `file` is used in messages and to find other files.
[[nodiscard]] LoadedBodies LoadBodiesText(const std::string& text, const std::string& file);

}  // namespace mbv
