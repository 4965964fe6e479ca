// Runs the witnesses of a prepared scenario and hands their traces over.
//
// Who takes part, in which order and by which computation stands in one table (kComputations in
// run_witnesses.cc), one row for each role (base/roles.h). All commands run witnesses here: `run`
// all of them, `sensitivity` the simulated side many times, `converge` the engine with its own
// options.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/roles.h"
#include "base/run_summary.h"
#include "comparison/comparison.h"
#include "report/report.h"
#include "scenario/scenario.h"
#include "scenario/tables/table.h"
#include "simulation/engine/simulation.h"
#include "verify/prepare.h"
#include "verify/ranges.h"

// One run of the simulation with a scenario's settings.

namespace mbv {

/// The engine's options as the scenario has them; forces are left to the caller.
[[nodiscard]] SimulationOptions OptionsOf(const Scenario& scenario, const Mechanism& mechanism,
                                          Engine engine);

struct SimulatedWitness {
  SimulationRun run;        ///< trace extrapolated; poses and MJCF of the first run
  Diagnostics diagnostics;  ///< bad input found on the way
};
/// Simulates, extrapolating if the scenario asks for it. Drives by forces or servos need options.
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven,
                                             const SimulationOptions& options,
                                             const std::function<void(double)>& progress = {});
/// With the options that the scenario has for the engine.
[[nodiscard]] SimulatedWitness RunSimulation(const Scenario& scenario, const Mechanism& mechanism,
                                             const DrivenMotion& driven, Engine engine,
                                             const std::function<void(double)>& progress = {});

/// a + (b − a)(target − at_a)/(at_b − at_a) for forces and powers; motion from `a`; the worse
/// closure of both.
[[nodiscard]] Trace Extrapolate(const Trace& a, double at_a, const Trace& b, double at_b,
                                double target);

// Computations that did not take place.

/// The summary of a witness that was not asked, and why.
inline RunSummary NotRun(const std::string& why) {
  RunSummary summary;
  summary.message = why;
  return summary;
}

// How far a computation is.

/// Stage ("simulation") and how much of it is done (0 … 1).
using ProgressFunction = std::function<void(const std::string& stage, double fraction)>;

/// The same of one stage; empty if not asked for.
[[nodiscard]] inline std::function<void(double)> StageOf(const ProgressFunction& progress,
                                                         const std::string& stage) {
  if (!progress) return {};
  return [progress, stage](double fraction) { progress(stage, fraction); };
}

// An external program as a witness (docs/how-to/external_solvers.md): it gets a folder with the
// mechanism and its motion, and leaves its traces there.

/// Runs it on the drives' motion. Whatever the program does (dies, hangs, floods, answers nonsense)
/// is in the record's summary, as not run, and in its gap.
[[nodiscard]] WitnessRecord RunForeign(const ForeignWitness& witness, const Prepared& prepared,
                                       const Mechanism& mechanism, const DrivenMotion& driven);

/// What the simulation is run with; what is left empty is the prepared scenario's own.
struct SimulatedSide {
  const Scenario* scenario = nullptr;
  const Mechanism* mechanism = nullptr;
  const Mechanism* ranges = nullptr;  ///< whose joint ranges hold; null: the base mechanism's
  DrivenMotion driven = {};
  DriveForces forces = {};
};

/// What witnesses gave.
struct WitnessRuns {
  std::vector<WitnessRecord> records;  ///< in the order in which they ran
  std::optional<AlignedTable> table;   ///< in the reference's place
  std::optional<SimulationRun> simulation;
  std::vector<RangeViolation> violations;  ///< of joints along the simulated motion
  std::optional<Trace> perturbed;          ///< force-driven, with perturbed forces
  double perturbation = kNan;              ///< wrong by this share of their RMS
  Diagnostics bad_input;                   ///< that only the simulation could find
  Diagnostics findings;                    ///< warnings, and ranges that are left
  std::string trust;                ///< of a free motion: how far the reference can be trusted
  double integration_error = kNan;  ///< of the reference there, as it states it
  Timing timing;

  /// The record of a witness; null if it did not take part.
  [[nodiscard]] const WitnessRecord* Find(const Role& role) const;
  /// Adds witnesses, table and perturbed run to what is compared; refers to this object.
  void HandOver(ComparisonInput* input) const;
};

class WitnessRunner {
 public:
  /// `prepared` must outlive the runner.
  explicit WitnessRunner(const Prepared& prepared, SimulatedSide side = {},
                         ProgressFunction progress = {});

  /// Runs of the same scenario with other numbers in its commands: traces of the closed form and of
  /// the reference take over their channels and memory.
  void Reuse(WitnessRuns runs) { reuse_ = std::move(runs); }

  /// Whether the scenario has this witness. One that has a place but was switched off, or cannot
  /// do its part, takes part with a record that says so.
  [[nodiscard]] bool TakesPart(const Role& role) const;
  /// Runs a witness that takes part.
  void Run(const Role& role);
  /// Those that compute motion and forces from the commands, one after the other; and those that
  /// need them.
  void RunComputed();
  void RunFollowing();
  /// Programs outside that the scenario names.
  void RunForeign();

  /// Strokes along the motion that was computed. False, and then the simulation must not run, if
  /// drives cannot go there and the scenario does not ignore it.
  bool CheckStrokes();
  /// Where the simulation is driven by forces, in addition to the witnesses: the same run with
  /// forces that are wrong by the limit of their checks. A warning if it fails.
  void RunPerturbed();
  /// One run of the simulation: as the scenario has it, by another engine, or by other options.
  [[nodiscard]] SimulatedWitness Simulate(Engine engine, const std::string& stage) const;
  [[nodiscard]] SimulatedWitness Simulate(const SimulationOptions& options,
                                          const std::string& stage) const;
  /// The engine that is judged.
  [[nodiscard]] Engine judged_engine() const;

  [[nodiscard]] const WitnessRuns& runs() const { return runs_; }
  [[nodiscard]] WitnessRuns Take() { return std::move(runs_); }

 private:
  struct Computation;
  static const std::vector<Computation>& Computations();

  void RunAnalytic();
  void RunReferenceOrTable();
  void RunSolver();
  void RunSimulated();
  void RunReached();
  void Solve(const Role& role);
  void SolveFree(const Role& role);
  void CheckRanges(SimulationRun* run);
  void LeaveOut(const Role& role, RunSummary why);
  void Add(const Role& role, RunSummary summary, Trace trace);
  void Warn(const std::string& text);
  /// An earlier one of this witness; empty without one.
  [[nodiscard]] Trace Earlier(const Role& role);
  void RunThose(bool following);
  /// Gave the simulation its motion; must have run.
  [[nodiscard]] const WitnessRecord& driver() const;
  [[nodiscard]] const Scenario& scenario() const;
  [[nodiscard]] const Mechanism& simulated() const;
  [[nodiscard]] DriveForces Forces() const;
  [[nodiscard]] DrivenMotion Driven() const;

  const Prepared& prepared_;
  SimulatedSide side_;
  ProgressFunction progress_;
  WitnessRuns runs_, reuse_;
};

/// What is compared, except for the witnesses and what statics leaves open; times are those of the
/// scenario, also where it is a phase (InScenarioTime()).
[[nodiscard]] ComparisonInput InputOf(const Prepared& prepared);

/// By motor: what holding brakes bear along the motion, by the reference. Nothing where no motor
/// has one, of a free motion, and where the reference does not get through the motion.
[[nodiscard]] std::vector<DriveFacts> DriveFactsOf(const Prepared& prepared);

/// Moves what a witness recorded of a phase, which begins at 0, to the scenario's time.
void InScenarioTime(const Scenario& scenario, RunSummary* summary, Trace* trace);

}  // namespace mbv
