// Motion: what a scenario commands, as scalar coordinates with time profiles, and its loads.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/run_summary.h"
#include "base/types.h"
#include "math/profile.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"

namespace mbv {

/// How a simulation moves the drives: a scenario's `simulation.mode`.
enum class DriveMode {
  kPrescribedMotion,  ///< `forward`: constraints hold them on the commanded motion; the force is
                      ///< the constraint's
  kInverse,           ///< `inverse`: on the commanded motion, inverse dynamics sample by sample
  kForceDriven,       ///< `force_driven`: given forces in open loop, from the commanded start
  kServo,             ///< `servo`: MuJoCo's position and velocity actuators follow the command
};

/// The drives are where the command has them, whatever forces that takes.
[[nodiscard]] constexpr bool PrescribesMotion(DriveMode mode) {
  return mode == DriveMode::kInverse || mode == DriveMode::kPrescribedMotion;
}

/// A scalar coordinate of a mechanism that a command can refer to.
struct Coordinate {
  enum class Kind {
    kPrescribed,  ///< index into Mechanism::prescribed
    kDrive,       ///< index into Mechanism::drives
    kOutput,      ///< index into Mechanism::outputs, component 0…5 = x, y, z, roll, pitch, yaw
    kJoint,       ///< index into Mechanism::joints, component: its coordinate
  };
  Kind kind = Kind::kDrive;
  int index = 0;
  int component = 0;

  bool operator==(const Coordinate&) const = default;
};

/// True when it is a length (else it is an angle).
[[nodiscard]] bool IsLength(const Mechanism& mechanism, const Coordinate& coordinate);
/// "m" or "rad".
[[nodiscard]] std::string CoordinateUnit(const Mechanism& mechanism, const Coordinate& coordinate);
/// Its value at the mechanism's home pose [m or rad].
[[nodiscard]] double HomeValue(const Mechanism& mechanism, const Coordinate& coordinate);

struct NamedCoordinate {
  std::string name;
  Coordinate coordinate;
};
/// What a command may name: prescribed joints, drives, OUTPUT.x … OUTPUT.yaw.
[[nodiscard]] std::vector<NamedCoordinate> NamedCommandCoordinates(const Mechanism& mechanism);
/// The same and, behind them, coordinates of joints as NamedJointCoordinates() calls them, unless
/// the name is taken or the coordinate is one of a ball's. Where a drive acts on a joint, or its
/// motion is prescribed, the joint's name stands for that.
[[nodiscard]] std::vector<NamedCoordinate> NamedMotionCoordinates(const Mechanism& mechanism);
/// Coordinates of joints: JOINT, or JOINT.0, JOINT.1 … where one has several. Prescribed joints
/// and drives may have the names of theirs.
[[nodiscard]] std::vector<NamedCoordinate> NamedJointCoordinates(const Mechanism& mechanism);

/// Σ factor · coordinate = profile(t). Most commands have one term with factor 1; a coupling such
/// as "these two drives are equally long" is a difference commanded to zero.
struct Command {
  struct Term {
    Coordinate coordinate;
    double factor = 1.0;
  };
  std::string name;  ///< "roll", "limb1.drive", "platform.z", "limb1.drive - limb1.drive_p"
  std::vector<Term> terms = {};
  Profile profile = {};
};

/// A number that follows from time and from coordinates of the mechanism and their rates [SI].
struct StateFunction {
  struct Input {
    Coordinate coordinate;
    bool rate = false;  ///< its rate instead of its value
    double near = 0.0;  ///< angles are taken within half a turn of this: at home
  };
  std::vector<Input> inputs;
  std::function<double(double t_s, std::span<const double> inputs)> value;
  /// As in ExpressionLaw.
  std::function<int(double t_s, std::span<const double> inputs)> branch = {};
  std::function<double(int branch, double t_s, std::span<const double> inputs)> on_branch = {};
  int number = -1;                    ///< among those of its motion that have branches
  std::vector<Profile> signals = {};  ///< of the time, which `value` knows; here for their breaks

  /// By this branch; kAnyBranch: by the one that holds.
  [[nodiscard]] double At(double t_s, std::span<const double> at, int by_branch) const {
    const bool fixed = on_branch && by_branch != kAnyBranch;
    return fixed ? on_branch(by_branch, t_s, at) : value(t_s, at);
  }
};

/// An external wrench on a body, acting at point Q fixed in the body.
struct Load {
  std::string name;
  int body = 0;
  Vec3 p_BoQ_B = Vec3::Zero();
  bool in_body_axes = false;      ///< components in body axes instead of world axes
  std::array<Profile, 3> force;   ///< [N]
  std::array<Profile, 3> moment;  ///< [N m], about Q
  /// What a component (0…2 of the force, 3…5 of the moment) is in addition to its profile.
  struct Following {
    int component = 0;
    StateFunction function;
  };
  std::vector<Following> following = {};
};

/// A drive that exerts a given force instead of following a command.
struct DriveForce {
  int drive = 0;                                ///< index into Mechanism::drives
  Profile force;                                ///< [N] or [N m]
  std::optional<StateFunction> following = {};  ///< what it is in addition
};

/// A force element that acts with a share of its force: a brake or clutch that is switched. Or a
/// body that has a share of its mass and inertia: a payload that is gripped and released. What
/// joins it has its velocity already.
struct Switch {
  std::string name;    ///< of the element, or of a ball's three, or of the body
  size_t element = 0;  ///< index into Mechanism::elements: dry friction, or a curve of the rate; or
  int body = -1;       ///< of this body instead
  Profile share;       ///< >= 0
};

/// Where a DOF starts that moves by forces.
struct InitialValue {
  std::string name;
  Coordinate coordinate;
  double position = 0.0, rate = 0.0;  ///< [m] or [rad], per second
};

/// A table that gives a coordinate (or a load) over time, as a spline.
struct MotionTable {
  std::string name;          ///< of what it gives: "crank.drive", "loads.crane.force[0]"
  std::string file, column;  ///< file name and heading
  std::string unit;          ///< SI, of the values
  size_t rows = 0;
  double from_s = 0.0, to_s = 0.0;  ///< scenario time of the first and the last row
  double stamp_error_s = 0.0;       ///< rounding of the printed times
  bool periodic = false, with_rates = false;
  bool moves = false;              ///< a command: its second derivative makes forces
  std::string smoothing = "none";  ///< "none", "auto", "stated" or "cut-off"
  double deviation = 0.0;          ///< standard deviation of the noise: estimated, or as stated
  double cutoff_hz = kNan;         ///< smoothing halves this frequency; NaN: it changes nothing
  /// The smoothing spline less the interpolating one over all rows: that in use, or, without
  /// smoothing, what `auto` would do. Value and second derivative, and that of the spline in use.
  double change_rms = 0.0, change_max = 0.0;
  double acceleration_change_rms = 0.0, acceleration_change_max = 0.0;
  double acceleration_rms = 0.0;
  std::shared_ptr<const Piecewise> spline;        ///< in use
  std::shared_ptr<const Piecewise> interpolated;  ///< through all rows
  std::vector<std::string> notes = {};            ///< what was found out or assumed of the file

  [[nodiscard]] bool smoothed() const { return smoothing != "none"; }
  /// The share of the interpolating spline's mean square acceleration that smoothing takes away.
  [[nodiscard]] double noise_share() const;
};

struct Motion {
  double duration_s = 1.0;
  double sample_s = 0.01;
  std::vector<Command> commands;
  std::vector<Load> loads;
  std::vector<DriveForce> forces = {};  ///< free motion only; no drive is commanded and forced
  std::vector<Switch> switches = {};
  std::vector<InitialValue> initial = {};  ///< one per DOF that no command holds
  std::vector<MotionTable> tables = {};    ///< those that profiles above were made of

  /// True when some DOFs move by forces (forward dynamics) instead of by commands.
  [[nodiscard]] bool free() const { return !initial.empty(); }
  /// Index into `forces` of a drive, or -1.
  [[nodiscard]] int FindForce(int drive) const;

  [[nodiscard]] int FindCommand(const std::string& command_name) const;  ///< index or -1

  /// Coordinates of joints without a drive that witnesses record: those that are commanded.
  [[nodiscard]] std::vector<Coordinate> RecordedJoints() const;
};

/// A load at one instant; what follows the mechanism's state is not in it.
struct LoadSample {
  int body = 0;
  Vec3 p_BoQ_B = Vec3::Zero();
  bool in_body_axes = false;
  Vec3 force = Vec3::Zero(), moment = Vec3::Zero();
  const Load* load = nullptr;  ///< whose sample it is
  double time_s = 0.0;
};

/// All commands at one instant: entry k belongs to Motion::commands[k].
struct CommandSample {
  double time_s = 0.0;
  VecX position, velocity, acceleration;
  std::vector<LoadSample> loads;
  std::vector<double> engaged = {};  ///< BodyStates::engaged
  std::vector<double> carried = {};  ///< BodyStates::carried
};

/// Evaluates every profile at t. Allocates only when `sample` is first used.
void EvaluateMotion(const Motion& motion, double t_s, CommandSample* sample);

/// CommandSample::engaged alone, and CommandSample::carried.
void EvaluateSwitches(const Motion& motion, double t_s, std::vector<double>* engaged);
void EvaluatePayloads(const Motion& motion, double t_s, std::vector<double>* carried);
/// True if some body's mass changes.
[[nodiscard]] bool HasPayloads(const Motion& motion);

/// Motion of everything driven at one instant: the drives in model order, then the prescribed
/// joints in model order.
struct DrivenSample {
  VecX position, velocity, acceleration;
};

// The times at which a motion is not smooth.

/// Times [s] at which a command, given force or load of the motion changes its formula; increasing,
/// the same time may occur more than once.
[[nodiscard]] std::vector<double> BreakTimes(const Motion& motion);
/// Those of them at which forces jump (JumpTimes() of profiles).
[[nodiscard]] std::vector<double> JumpTimes(const Motion& motion);
/// What loads and given drive forces are in addition to their profiles, where that has branches;
/// by the path in the scenario.
struct BranchingFunction {
  std::string path;
  const StateFunction* function = nullptr;
};
/// By StateFunction::number; `motion` outlives the list.
[[nodiscard]] std::vector<BranchingFunction> BranchingFunctions(const Mechanism& mechanism,
                                                                const Motion& motion);
/// Elements that are switched off from one time to another, increasing: they neither hold nor
/// slide.
[[nodiscard]] std::vector<size_t> SwitchedOff(const Motion& motion, double from_s, double to_s);
/// What is to be evaluated at t on the way to the next jump after `from_s`: t, or, at that jump, a
/// time before it.
class UntilJump {
 public:
  explicit UntilJump(const Motion& motion) : jumps_s_(JumpTimes(motion)) {}
  void StartFrom(double from_s);
  [[nodiscard]] double operator()(double t_s) const { return std::min(t_s, before_s_); }
  [[nodiscard]] bool IsJump(double t_s) const;

 private:
  std::vector<double> jumps_s_;
  double before_s_ = std::numeric_limits<double>::infinity();
};

// Where the bodies of a mechanism are and how they move, in maximal coordinates.

/// Pose X_WB, twist V_WB = [ω; v of Bo] and acceleration A_WB = [ε; a of Bo] of every body, in
/// world axes (the classical acceleration of the origin, not the spatial one); index 0 (the world)
/// stays at rest.
struct BodyStates {
  std::vector<Pose> X_WB;
  std::vector<Vec6> V_WB;
  std::vector<Vec6> A_WB;

  /// Per term of the mechanism's couplings in order: a value of its coordinate within half a turn,
  /// which says how many turns an angle counts; empty: home (coupling_rows.h).
  std::vector<double> coupled;
  /// The same per force element, drive and prescribed joint (element_rows.h).
  std::vector<double> turns;
  /// Share of its force with which a force element acts (Switch); of those beyond the end 1.
  std::vector<double> engaged = {};
  /// Branches by which expressions are taken: per force element, then per StateFunction::number;
  /// of those beyond the end kAnyBranch.
  std::vector<int> branches = {};
  [[nodiscard]] int Branch(size_t at) const {
    return at < branches.size() ? branches[at] : kAnyBranch;
  }
  [[nodiscard]] double Engaged(size_t element) const {
    return element < engaged.size() ? engaged[element] : 1.0;
  }
  /// The same of its mass and inertia per body.
  std::vector<double> carried = {};
  [[nodiscard]] double Carried(size_t body) const {
    return body < carried.size() ? carried[body] : 1.0;
  }

  void Resize(size_t bodies);
};

// What loads that follow the state read, and what they report where they have no value.
//
// Lengths need no more than poses. Angles count rotations: those of joints, drives and prescribed
// joints from home, those of outputs from the command or start value that gives them; from there
// all go on without a jump. Reference and simulation count each by itself.

/// An angle of a joint or an output that some load or drive force follows.
struct FollowedAngle {
  Coordinate coordinate;
  double start = 0.0;  ///< within half a rotation of it at t = 0 [rad]
};
/// Of all loads and drive forces, in their order; drives and prescribed joints are not among them.
[[nodiscard]] std::vector<FollowedAngle> FollowedAngles(const Mechanism& mechanism,
                                                        const Motion& motion);

/// A value within half a rotation of an angle at t = 0: the command or the start value that gives
/// this very coordinate, else its value at home [rad].
[[nodiscard]] double StartAngle(const Mechanism& mechanism, const Motion& motion,
                                const Coordinate& coordinate);

/// Its name in scenario files, without .position or .velocity: "motor", "tool.yaw", "hip.0".
[[nodiscard]] std::string NameOf(const Mechanism& mechanism, const Coordinate& coordinate);

/// "loads.drag.force[2]", "forces.motor".
[[nodiscard]] std::string PathOf(const Load& load, const Load::Following& part);
[[nodiscard]] std::string PathOf(const Mechanism& mechanism, const DriveForce& force);
/// How a run ends where the function of a load or drive force at this path is `value`, which is not
/// finite, at these inputs and time.
[[nodiscard]] RunSummary HasNoValue(const Mechanism& mechanism, const std::string& path,
                                    const StateFunction& function, double t_s,
                                    std::span<const double> inputs, double value);
/// The same of an element that is an expression.
[[nodiscard]] RunSummary HasNoValue(const ForceElement& element, double t_s, double position,
                                    double rate, double value);

}  // namespace mbv
