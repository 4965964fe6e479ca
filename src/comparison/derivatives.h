// Whether a witness' drive rates are the time derivatives of its drive positions.
#pragma once

#include <string>

#include "comparison/comparison.h"

namespace mbv {

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

}  // namespace mbv
