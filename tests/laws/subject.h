// The mechanisms that the laws run on, the states at which they are asked, and their answers.
#pragma once

#include <map>
#include <ostream>
#include <string>
#include <vector>

#include "analytic/closed_form.h"
#include "mechanism/motion.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"

namespace mbv::laws {

/// A shipped model with a shipped motion that commands its outputs, and one load on its first
/// output's body at a point beside the origin.
struct Subject {
  std::string name;  ///< MODEL_SCENARIO
  Scenario scenario;
  Mechanism mechanism;
  Motion motion;
  double length_m = 1.0;  ///< typical of the mechanism

  /// The same with model parameters replaced.
  [[nodiscard]] Subject With(const Overrides& overrides) const;
  /// Parameters that scale all masses and inertias by `factor`.
  [[nodiscard]] Overrides Heavier(double factor) const;
  [[nodiscard]] std::unique_ptr<ClosedForm> MakeClosedForm() const;
  /// Commands every drive and prescribed joint instead (forward kinematics).
  [[nodiscard]] Motion DriveMotion() const;
  /// Length or angle?
  [[nodiscard]] bool IsLengthCommand(size_t k) const;
  /// Scale of a command: length_m or 1 rad.
  [[nodiscard]] double ScaleOf(size_t k) const { return IsLengthCommand(k) ? length_m : 1.0; }
  /// Commands that may not be disturbed: couplings, and what the closed form holds (the platform's
  /// equations with coupled drives are for a level platform).
  [[nodiscard]] bool IsHeld(size_t k) const { return held[k]; }
  std::vector<bool> held;
  /// Commands that are neither held nor base motion.
  [[nodiscard]] std::vector<size_t> FreeCommands() const;
};

/// Every model folder and every registered closed form.
[[nodiscard]] std::vector<std::string> ModelNames();
/// One or two shipped motions of each of them.
[[nodiscard]] std::vector<std::string> SubjectNames();
[[nodiscard]] const Subject& SubjectOf(const std::string& name);

enum class Regime { kFirstSample, kClose, kRandom, kNearSingular };
[[nodiscard]] const std::string& NameOf(Regime regime);
void PrintTo(Regime regime, std::ostream* out);  ///< for GoogleTest

struct State {
  std::string name;
  CommandSample command;
  /// How much an error of the drives grows in the forces: condition of the Jacobian from commands
  /// to drives (metres divided by length_m), times the relative change of the forces per relative
  /// displacement of the commands where that is above one.
  double condition = kNan;
  double difference_step_s = 1e-3;  ///< for differences along the state's motion
};
/// The states of a regime; the same at every call.
[[nodiscard]] const std::vector<State>& StatesOf(const std::string& subject, Regime regime);

/// Where the closed form stops answering when one command leaves the first sample.
struct Boundary {
  size_t command = 0;
  double distance = 0.0;  ///< signed, command units; the last answer is just before
};
[[nodiscard]] const std::vector<Boundary>& BoundariesOf(const std::string& subject);

/// `from` with one command moved; at rest.
[[nodiscard]] CommandSample Displaced(const CommandSample& from, size_t command, double distance);

/// What a witness says at one state: drives, then prescribed joints.
struct Answer {
  RunSummary summary;
  DrivenSample driven;
  VecX force;             ///< drives
  VecX prescribed_force;  ///< not from the closed form
  VecX extra;             ///< closed form only
  BodyStates states;      ///< V_WB and A_WB from the reference only
  double power_input_W = kNan, energy_rate_W = kNan;
};

[[nodiscard]] Answer ByClosedForm(const Subject& subject, const CommandSample& command);
/// Fresh solvers, or one kept by the caller near the state.
[[nodiscard]] Answer ByReference(const Subject& subject, const CommandSample& command);
[[nodiscard]] Answer Ask(ReferenceSolver* solver, const CommandSample& command);
/// MuJoCo's inverse dynamics for the given motion of everything driven, moved there by WayTo.
[[nodiscard]] Answer BySimulation(const Subject& subject, const DrivenSample& driven,
                                  const CommandSample& command);

/// Commands' values, rates and accelerations at body states.
[[nodiscard]] CommandSample CommandsAt(const Subject& subject, const BodyStates& states,
                                       const CommandSample& near);
/// Drives at rest on the straight way of the commands from the first sample to `command`, by the
/// closed form: forward solutions follow it, because drive positions alone do not say which of
/// several assemblies is meant.
[[nodiscard]] std::vector<DrivenSample> WayTo(const Subject& subject, const CommandSample& command);

/// CommandSample for DriveMotion().
[[nodiscard]] CommandSample DriveCommand(const DrivenSample& driven, const CommandSample& loads);

/// Jacobian from command rates to driven rates (driven × commands), by the closed form; columns of
/// held commands are zero, NaN where it does not answer.
[[nodiscard]] MatX DriveJacobian(const Subject& subject, const CommandSample& at);

}  // namespace mbv::laws
