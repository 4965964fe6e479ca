// Comparison: what the witnesses computed, traces or stiffnesses at a pose → metrics, checks,
// verdict and attribution.
//
// Compared are signals with the same channel name at common sample times. Angles are differenced
// modulo 2π, orientations as log(RᵀR'). A check passes only if its value is a number at or below
// its limit. The verdict starts as kNotRun and is kAgree only if drive forces of at least one pair
// of witnesses were compared (trajectories, where DOFs move by given forces; of stiffnesses K or
// C) on enough samples and within limits that are sensitive, no witness broke down and every check
// passes. What makes an agreement say less than it seems to is a caveat.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/roles.h"
#include "base/run_summary.h"
#include "comparison/metrics.h"
#include "comparison/motor_load.h"
#include "kinematics/command_rank.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "scenario/checks.h"
#include "scenario/scenario.h"
#include "scenario/tables/table.h"

namespace mbv {

enum class Verdict { kNotRun, kAgree, kDisagree };
[[nodiscard]] const char* ToText(Verdict verdict);  ///< "not_run", "agree", "disagree"

/// Why a witness that a scenario has gave nothing to compare.
enum class WitnessGap {
  kNone,           ///< it answered, or the scenario does not have it
  kNotApplicable,  ///< a closed form that covers neither this mechanism nor this motion
  kNotHandedOver,  ///< a program: the scenario cannot be written for one
  kNotStarted,     ///< no such program, or none that can be executed
  kExitCode,       ///< it ended with one that is not 0
  kSignal,
  kTimedOut,
  kNoAnswer,    ///< it left no files, or longer ones than they may be
  kBadAnswer,   ///< its files are not what docs/how-to/external_solvers.md asks for
  kOutOfScope,  ///< it states that the mechanism or motion is beyond it
  kNoForces,    ///< it answered, without drive forces that another witness has, too
};
[[nodiscard]] const char* ToText(WitnessGap gap);  ///< "timed_out"; "" of kNone

struct StiffnessWitness;  // comparison/compare_stiffness.h

/// One witness as handed to the comparison.
struct Witness {
  std::string name;              ///< of its role (base/roles.h)
  const Trace* trace = nullptr;  ///< null if there is none; summary says why
  RunSummary summary;            ///< the trace is compared only if this is ok
  /// Of a program outside (docs/how-to/external_solvers.md): what it is, the limits it is judged
  /// by, and what it leaves out, and why.
  struct Foreign {
    std::string program;
    LimitColumn limits = LimitColumn::kReference;
    std::optional<double> force_nrmse;  ///< instead of that limit
    std::vector<std::pair<std::string, std::string>> left_out = {};
    double compute_s = kNan;  ///< without its start, reading and writing, as it says itself
  };
  std::optional<Foreign> foreign = {};
  WitnessGap gap = WitnessGap::kNone;           ///< why it did not run, if the scenario asks it to
  bool required = false;                        ///< without it there is no verdict
  const StiffnessWitness* stiffness = nullptr;  ///< instead of a trace

  [[nodiscard]] bool ran() const;  ///< has something to compare
};

struct ComparisonInput {
  const Mechanism* mechanism = nullptr;
  const Motion* motion = nullptr;
  CheckLimits limits;
  LimitColumn simulation_limits = LimitColumn::kForward;
  double start_window_s = 0.0;  ///< force samples before it are left out (named in the scenario)
  std::vector<Witness> witnesses = {};  ///< in the order in which they are shown
  std::string driven_by;                ///< the witness whose kinematics the simulation follows
  /// Channels of reactions that statics leaves open ("hinge.reaction.fz").
  std::vector<std::string> reactions_not_unique = {};
  const AlignedTable* table = nullptr;            ///< what the reference is, if it is a table
  const DrivenTwists* twists = nullptr;           ///< TwistsFor() this; found where needed if null
  DriveMode mode = DriveMode::kPrescribedMotion;  ///< what moves the simulation's drives (driven.h)
  const Trace* perturbed = nullptr;  ///< force-driven: the same run with perturbed forces
  double perturbation = kNan;        ///< by this share of their RMS
  /// Of a free motion: how far the trajectory of the reference (beside a table, of the solver) is
  /// from the exact one, as it states itself, lengths over the characteristic length [1]. NaN if it
  /// states nothing.
  double integration_error = kNan;
  /// Per witness: parameters of the model that the scenario gives it another value of.
  std::map<std::string, std::map<std::string, double>> own_parameters = {};
  std::vector<std::string> left_out = {};    ///< by the model, of the file that it was made from
  std::string unchecked_coverage = {};       ///< why it is unknown what the analytic witness covers
  std::vector<DriveFacts> drive_facts = {};  ///< by motor; empty: nothing is known
  /// The witnesses bring stiffnesses instead of traces; the motion is the pose, commanded.
  bool of_stiffness = false;
};

/// Judges where a forward motion goes.
[[nodiscard]] constexpr bool IsTrajectory(Metric metric) {
  return metric == Metric::kPositionM || metric == Metric::kPositionRad ||
         metric == Metric::kPoseM || metric == Metric::kPoseRad;
}

/// One drive's force in a pair of witnesses.
struct DriveMetrics {
  std::string drive;
  std::string unit;            ///< of the force
  double rms_truth = kNan;     ///< RMS force of the second witness
  double rms_measured = kNan;  ///< RMS force of the first witness
  double nrmse = kNan;
  double max_error = kNan;  ///< [unit]
  double max_relative = kNan;
  double digits = kNan;           ///< matching digits, from the NRMSE
  bool floored = false;           ///< NRMSE and digits relate to a floor above the RMS force
  double time_s = kNan;           ///< of the largest error
  double factor = kNan;           ///< k of the best fit measured = k · truth
  double factor_residual = kNan;  ///< RMS of measured − k · truth, over the RMS of the truth
  double offset_residual = kNan;  ///< the same of measured − truth − c, the best constant c
};

/// What could not be compared, and why.
struct NotCompared {
  std::string what;
  std::string why;
};

/// One column of a table against the same signal of another witness. All in the signal's SI unit.
struct TableColumnResult {
  std::string channel;
  size_t column = 0;        ///< of the table's trace
  size_t samples = 0;       ///< compared
  double rms = kNan;        ///< of the table
  double standard = kNan;   ///< RMS of its standard uncertainty
  double bound = kNan;      ///< largest distance that its uncertainty allows a sample
  double error_rms = kNan;  ///< difference to the other witness
  double error_max = kNan;
  double time_s = kNan;    ///< of the largest difference
  double tube_rms = kNan;  ///< limits of both; infinite where the scenario switched them off
  double tube_max = kNan;
  [[nodiscard]] double ratio() const;  ///< difference / tube, the worse of both; NaN stays
  [[nodiscard]] bool inside() const { return ratio() <= 1.0; }
};

/// `measured` against `truth`.
struct PairComparison {
  std::string measured, truth;
  bool compared = false;                    ///< drive forces at one common sample at least
  std::string reason = "was not compared";  ///< why not, when not compared
  size_t samples = 0;                       ///< common samples
  size_t force_samples = 0;                 ///< of these, inside the judged window
  size_t samples_at_rest = 0;               ///< of these, with a band instead of some force
  double from_s = kNan, to_s = kNan;        ///< first and last sample that forces were judged at
  bool forces_act = true;                   ///< some load, weight or motion asks for drive forces
  std::map<Metric, Measured> metrics;       ///< those that could be measured
  std::vector<DriveMetrics> drives;
  std::vector<std::string> reactions;      ///< joints of which a reaction component was compared
  double digits = kNan;                    ///< matching digits of all forces
  std::vector<TableColumnResult> columns;  ///< where one of the two is a table

  [[nodiscard]] std::string name() const { return PairName(measured, truth); }
  [[nodiscard]] bool Involves(const Role& role) const { return measured == role || truth == role; }
};

/// One place where energy came from or went.
struct EnergyPart {
  std::string name;  ///< "kinetic energy", "gravity", "springs", a drive, "loads", "dampers", …
  bool stored = false;   ///< a change of energy since the start; otherwise work put in
  double end_J = kNan;   ///< at the end
  double most_J = kNan;  ///< largest magnitude
};

/// The energy balance of one run.
struct EnergyAudit {
  std::string witness;
  bool integrated = false;  ///< the witness integrated the work; otherwise cubics through samples
  std::vector<EnergyPart> parts;
  double scale_J = kNan;                      ///< energy turned over
  Measured drift;                             ///< largest |energy − start − work| / scale
  double drift_J = kNan, end_drift_J = kNan;  ///< largest, and at the end
  double from_s = kNan;                       ///< first sample beyond the limit; NaN if none
  std::string culprit;                        ///< part that the drift is proportional to, or ""
  double share = kNan;                        ///< drift = share · part
  std::string text;                           ///< one sentence; "" without a drift beyond the limit
};

/// What one witness shows by itself.
struct WitnessMetrics {
  std::string witness;
  std::map<Metric, Measured> metrics = {};
  std::optional<EnergyAudit> energy = {};
  std::string derivatives_gap = {};  ///< why rates were not checked against positions; "" if so
  std::string unresolved = {};       ///< see UnresolvedBySamples(); "" of tables
};

struct CheckResult {
  std::string name;     ///< "simulated_vs_analytic.force_nrmse", "simulated.closure_m"
  std::string subject;  ///< the part before the point: a witness or a pair
  std::string measured = {}, truth = {};  ///< the pair; of one witness by itself, `truth` is ""
  Metric metric = Metric::kForceNrmse;
  double value = kNan;
  std::optional<double> limit;  ///< empty: switched off in the scenario
  /// Set where `limit` is not the scenario's own but what a table's uncertainty allows, or how far
  /// perturbed forces set it.
  std::optional<double> stated_limit;
  std::string limit_by;                     ///< what `limit` comes from then
  bool limit_is_integration_error = false;  ///< of the reference, as it states it
  bool pass = false;
  /// Compares a drive motion with itself: it can fail, but that it passes verifies nothing.
  bool follows = false;
  double time_s = kNan;
  std::string channel;
  bool floored = false;          ///< the value relates to a floor above the quantity itself
  std::string insensitive = {};  ///< why passing verifies nothing; "" if it does

  [[nodiscard]] bool of_pair() const { return !truth.empty(); }
  [[nodiscard]] bool Involves(const Role& role) const { return measured == role || truth == role; }
};

/// What the witnesses say about each other: what was found, and what follows from it.
struct Attribution {
  std::string odd_one_out;  ///< the witness that is wrong; "" if none is, or if nothing decides
  std::string text;         ///< one or two sentences to read
  /// Witnesses that agree where another one differs from them: a fact, whoever is wrong.
  struct Split {
    std::vector<std::string> agree = {};
    double agree_to = kNan;
    std::string differs = {};
    double differs_by = kNan;
    std::string measure = {};  ///< "drive force, RMS"
    std::string unit = {};     ///< of both amounts; "" of ratios
    /// What those that agree have in common and the other one has not, so that a fault in it would
    /// make them agree on something wrong; "" where they are independent of each other.
    std::string shared = {};
  };
  std::optional<Split> split = {};
};

/// What there is to say about a table that stands in for the reference.
struct TableVerdict {
  std::string name;  ///< file name
  std::string grid;  ///< how its rows meet the scenario's samples
  std::vector<std::string> notes;
  std::vector<TableColumn> columns;
  std::vector<TableUncertainty> uncertainty;  ///< of columns
  double coverage = kNan;                     ///< k
  std::string judged_against;                 ///< witness of the results that are shown first
  bool judged = false;                        ///< there columns must stay inside their tubes
  std::string too_coarse;                     ///< why it verifies nothing; "" if it does
  std::vector<std::string> diagnoses;         ///< what the differences look like
};

/// What makes an agreement say less than it seems to.
enum class CaveatKind {
  kWideLimits,      ///< limits that verify nothing
  kForcesCancel,    ///< forces so small that zero would pass
  kFewSamples,      ///< of forces
  kPartOfMotion,    ///< forces were judged in a part of it
  kTable,           ///< has no forces, a part of the motion, or columns that verify nothing
  kRatesUnchecked,  ///< against positions
  kWitnessMissing,  ///< a witness of the scenario gave nothing to compare
  kWitnessInPart,   ///< a program gave the forces of some drives only
  kLeftOut,         ///< what acts on forces in a robot's file and not in the model
  kContact,         ///< a foot that is computed as holding would lift, slip, tip or twist
  kCoverage,        ///< what a closed form takes for granted is not stated
};
[[nodiscard]] const char* ToText(CaveatKind kind);  ///< "witness_missing"

struct Caveat {
  CaveatKind kind = CaveatKind::kWideLimits;
  std::vector<std::string> of = {};    ///< witnesses, pairs, checks or the mechanism
  std::string text = {};               ///< one sentence, with what it is about
  WitnessGap gap = WitnessGap::kNone;  ///< of kWitnessMissing
};

struct Comparison {
  Verdict verdict = Verdict::kNotRun;
  std::string reason = "comparison was not run";  ///< one sentence
  std::string driving;  ///< one sentence: whose motion the simulation follows
  std::vector<PairComparison> pairs;
  std::vector<WitnessMetrics> witnesses;  ///< those that ran
  std::vector<CheckResult> checks;        ///< off ones included
  std::vector<NotCompared> not_compared;
  std::vector<Caveat> caveats;
  Attribution attribution;
  std::optional<TableVerdict> table;

  [[nodiscard]] const PairComparison* FindPair(const std::string& name) const;
  /// The pair that a reader looks at first (kMainPairs); null if none of them was compared.
  [[nodiscard]] const PairComparison* MainPair() const;
  [[nodiscard]] const CheckResult* FindCheck(const std::string& name) const;
  /// The check of a witness by itself, and of a pair; null if there is none.
  [[nodiscard]] const CheckResult* FindCheck(const Role& witness, Metric metric) const;
  [[nodiscard]] const CheckResult* FindCheck(const Role& measured, const Role& truth,
                                             Metric metric) const;
  [[nodiscard]] size_t failed() const;    ///< checks that have a limit and did not pass
  [[nodiscard]] size_t verified() const;  ///< checks that passed and verify something
  [[nodiscard]] size_t followed() const;  ///< checks that passed and compare a motion with itself
  [[nodiscard]] size_t insensitive() const;  ///< other checks that passed and verify nothing
};

[[nodiscard]] Comparison Compare(const ComparisonInput& given);
/// "all 31 checks are within their limits".
[[nodiscard]] std::string CountText(const Comparison& comparison);

/// The parts of Compare(), for tests and for other uses (a second engine, history).
[[nodiscard]] PairComparison ComparePair(const ComparisonInput& input, const Trace& measured,
                                         const Trace& truth);
[[nodiscard]] WitnessMetrics MeasureWitness(const ComparisonInput& input, const Trace& trace);
[[nodiscard]] Attribution Attribute(const ComparisonInput& input, const Comparison& comparison);

// What a comparison leaves out, and why.

/// Notes what one would expect to be judged and is not; of pairs and witnesses as measured so far.
void AddNotCompared(const ComparisonInput& input, Comparison* comparison);

// Factors by which signals of other programs are wrong: units, mostly.

struct KnownFactor {
  double factor;
  const char* text;  ///< "1000: is the unit kN, mm or ms mistaken?"
};

/// How far a fitted factor may be from a known one.
inline constexpr double kSameFactor = 5e-3;

/// The known one that a fitted factor > 0 is; null if it is none.
[[nodiscard]] const KnownFactor* FindFactor(double factor);

// Whether a witness' drive rates are the time derivatives of its drive positions.

/// Central differences of sixth order of positions and velocities against the recorded rates, over
/// the rate's RMS, at least RestFloorOf() the trace.
/// Where samples do not resolve the motion nothing is judged: the differences of fourth and sixth
/// order disagree there, or a command or drive turns too far between two samples.
/// `derivatives_gap` says why drives were not judged.
void MeasureDerivatives(const ComparisonInput& input, const Trace& trace, WitnessMetrics* out);

/// Why the samples of a trace do not resolve the motion (by the same formulas) or the forces and
/// powers of drives (midpoints by four and by six samples disagree): peaks, means, energies and
/// margins over them then mean nothing. "" where they do. Samples too few for the formulas are
/// judged by the commands alone: fewer than twelve per oscillation, six of a power. `measured`:
/// where MeasureDerivatives() of the trace was called before.
[[nodiscard]] std::string UnresolvedBySamples(const ComparisonInput& input, const Trace& trace,
                                              const WitnessMetrics* measured = nullptr);

// Where the energy of one witness' run came from and went, and whether all of it is accounted for.

/// Balances energies and work; nothing where the trace has no energies or less than four samples.
/// The drift E(t) − E(0) − W(t) is measured against the energy turned over: the largest kinetic
/// energy or total work, at least what the force scale does over 0.1 % of the characteristic
/// length; where joints are prescribed, at most what drives and the bodies they carry can turn
/// over, whatever the base does. `limit` says from when on the drift counts as one, where the work
/// was integrated.
[[nodiscard]] std::optional<EnergyAudit> AuditEnergy(const ComparisonInput& input,
                                                     const Trace& trace,
                                                     std::optional<double> limit);

}  // namespace mbv
