// Judging simulations whose drives exert given forces (open loop) or follow servos.
//
// * Force-driven: the drive forces of the simulation are another witness' own, so the motion is
//   judged. In open loop errors grow by themselves: the limit of every metric of motion is how far
//   the same run goes when its forces are perturbed by ComparisonInput::perturbation of their RMS.
// * Servo: the forces are judged by the reference evaluated on the motion that was reached (witness
//   kReached). Against what is commanded they differ by what the servo's error costs: reported,
//   and judged where the scenario states a limit (column `servo`).
#pragma once

#include <map>
#include <string>

#include "comparison/comparison.h"

namespace mbv {

/// The drive forces of this pair are the same by construction.
[[nodiscard]] bool SharesForces(const ComparisonInput& input, const std::string& measured,
                                const std::string& truth);

/// The column by which a pair is judged.
[[nodiscard]] LimitColumn ColumnOfPair(const ComparisonInput& input, const std::string& measured,
                                       const std::string& truth);

/// Per metric of motion, how far `simulated` deviates under perturbed forces; empty unless
/// force-driven.
[[nodiscard]] std::map<Metric, double> GrowthLimits(const ComparisonInput& input,
                                                    const Trace& simulated);

/// The same for what is held against the command; `simulated`: what it shows by itself.
[[nodiscard]] std::map<Metric, double> CommandGrowth(const ComparisonInput& input,
                                                     const WitnessMetrics& simulated);

/// Compares a witness with the command.
[[nodiscard]] constexpr bool IsCommand(Metric metric) {
  return metric == Metric::kCommandM || metric == Metric::kCommandRad ||
         metric == Metric::kCommandVelocity || metric == Metric::kCommandAcceleration;
}

/// Limits that do not come from the scenario.
struct OtherLimits {
  std::map<Metric, double> tubes;   ///< a table's own uncertainty: the wider of it and the limit
  std::map<Metric, double> growth;  ///< by perturbed forces: counts instead of the limit
  bool integrated = false;          ///< one of both states ComparisonInput::integration_error
};
void ApplyOther(const OtherLimits& other, const ComparisonInput& input, CheckResult* check);

/// Metrics of drive motion that the reference on the reached motion has by construction.
void LeaveOutReachedMotion(PairComparison* pair);

/// Whether a check counts as evidence of what the simulation is for.
[[nodiscard]] bool IsEvidence(const ComparisonInput& input, const CheckResult& check);

/// Why the horizon of a force-driven run is too long for a judgement; "" if it is not.
[[nodiscard]] std::string HorizonTooLongReason(const ComparisonInput& input,
                                               const Comparison& comparison);

/// Who is wrong in a force-driven or servo run, or how well it agrees; an empty text where the
/// simulation's motion and forces show nothing.
[[nodiscard]] Attribution AttributeDriven(const ComparisonInput& input,
                                          const Comparison& comparison);

// Whose motion the drives follow, and which comparisons are therefore no evidence.

/// One sentence about who gives the simulation its motion; "" where nothing was simulated.
[[nodiscard]] std::string DrivingText(const ComparisonInput& input);

/// True of coordinates of outputs and of joints without a drive.
[[nodiscard]] bool IsOfTask(const Coordinate& coordinate);
/// True when some command is about one of these: drive motions are then computed, not given.
[[nodiscard]] bool IsTaskSpace(const Motion& motion);

/// True when the commands determine every drive's motion, so that all computations are given it.
[[nodiscard]] bool GivesAllDriveMotion(const ComparisonInput& input);

/// True when a check compares a drive motion with itself: the simulation's with its own command
/// to follow, or a drive that the scenario commands with its command. Such a check can fail; that
/// it passes verifies nothing.
[[nodiscard]] bool ComparesMotionWithItself(const ComparisonInput& input, const CheckResult& check);

}  // namespace mbv
