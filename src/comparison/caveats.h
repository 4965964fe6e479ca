// What keeps an agreement from meaning what it seems to mean.
#pragma once

#include <string>
#include <vector>

#include "comparison/comparison.h"

namespace mbv {

/// Sets `insensitive` of the checks that verify nothing although they may pass: limits coarser than
/// kCoarsestLimit, drive forces that vanish because nothing moves, weighs or exerts a force, and
/// motors over samples that do not resolve the motion.
void MarkInsensitive(const ComparisonInput& input, Comparison* comparison);

/// Why no check of drive forces (of a free motion: of where it goes) verified anything; "" if one
/// did.
[[nodiscard]] std::string NothingVerifiedReason(const ComparisonInput& input,
                                                const Comparison& comparison);

/// Why a margin of motors is not known although its check passed: samples that do not resolve the
/// motion; "" if there is none.
[[nodiscard]] std::string MarginUnknownReason(const Comparison& comparison);

/// Loud in every report: limits that verify nothing, forces that only cancel out, few samples, a
/// part of the motion that was not judged, a table without forces, rates that could not be checked
/// against positions, witnesses that nothing was compared with, what acts on forces in
/// a robot's file and was left out.
[[nodiscard]] std::vector<Caveat> CaveatsOf(const ComparisonInput& input,
                                            const Comparison& comparison);

/// Of what acts on forces in a robot's file and is not in the model.
[[nodiscard]] Caveat LeftOutCaveat(const std::string& text);
/// Of a witness that gave nothing to compare: "the witness NAME, …".
[[nodiscard]] Caveat MissingWitnessCaveat(const std::string& witness, WitnessGap gap,
                                          const std::string& why);

/// Those of witnesses that the scenario has and that nothing was compared with; each names one.
[[nodiscard]] std::vector<Caveat> MissingWitnesses(const ComparisonInput& input,
                                                   const Comparison& comparison);

}  // namespace mbv
