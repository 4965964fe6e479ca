// Why a bent parameter is not seen: what it changes in the model, and proof that this has no
// effect.
#pragma once

#include <string>

#include "pipeline/mutation_bench.h"

namespace mbv {

/// What two versions of a model differ in: "the mass of ship; guesses and home pose".
[[nodiscard]] std::string DescribeChange(const Mechanism& base, const Mechanism& bent);

/// One sentence with numbers: what the bend changes in the model, the largest change of any drive
/// force over the run relative to its RMS, and where the effect goes instead (base reactions, joint
/// reactions, inertia forces that the motion does not call for). `bend` is the subject of that
/// sentence: "10 % wrong".
[[nodiscard]] std::string WhyUnseen(const MutationBench& bench, const Mechanism& bent,
                                    const BentRun& run, const std::string& bend);

/// Why two exchanged drives are not told apart: how much they differ in the unbent run.
[[nodiscard]] std::string WhySwapUnseen(const MutationBench& bench, const std::string& a,
                                        const std::string& b);

/// Largest change of any drive force against the unbent run, relative to the RMS force of all
/// drives of its unit.
[[nodiscard]] double ForceSensitivity(const MutationBench& bench, const Trace& bent);

}  // namespace mbv
