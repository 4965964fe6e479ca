// Parts of the attribution that its files share. Internal to comparison/.
#pragma once

#include <string>

#include "comparison/comparison.h"

namespace mbv::internal {

/// "0.001 m"; without a unit a ratio: "3.5e-05", "2.1 %", "3.4e+03 times".
[[nodiscard]] std::string Amount(double value, const std::string& unit);
[[nodiscard]] std::string AmountOf(const CheckResult& check);
/// "d1.force, t = 0.3 s"; without a time the channel alone.
[[nodiscard]] std::string ChannelAndTime(const std::string& channel, double time_s);
/// "simulation", "the generic solver", "the table forces.csv", …
[[nodiscard]] std::string NameOf(const Comparison& comparison, const std::string& witness);

/// Has a limit and exceeds it.
[[nodiscard]] bool Failed(const CheckResult* check);

/// What a computation shows by itself: rates that are not the derivatives of its positions, outputs
/// that are not where the commands say. Empty if there is nothing of the kind.
[[nodiscard]] Attribution AttributeByOwnMotion(const ComparisonInput& input,
                                               const Comparison& comparison);

/// Evidence from motion of a simulation that follows a drive motion: that motion against the
/// commands. Empty if motion shows nothing.
[[nodiscard]] Attribution AttributeByKinematics(const ComparisonInput& input,
                                                const Comparison& comparison);

/// Of the two witnesses of a pair, the one whose own energy drifts beyond its limit while the
/// other's does not, and a sentence about it: what integrates badly gains or loses energy. Named
/// only if the drift is large enough to explain `differ`, the failed check of the pair.
[[nodiscard]] Attribution AttributeByEnergy(const ComparisonInput& input,
                                            const Comparison& comparison,
                                            const PairComparison& pair, const CheckResult& differ);
/// What a drift of the simulated energy adds to another finding, "; …"; "" if there is none.
[[nodiscard]] std::string EnergyHint(const Comparison& comparison);

}  // namespace mbv::internal
