// Parts of the attribution that its files share. Internal to comparison/.
#pragma once

#include <string>

#include "comparison/comparison.h"

namespace mbv::internal {

/// "0.001 m"; without a unit a ratio: "3.5e-05", "2.1 %", "3.4e+03 times".
[[nodiscard]] std::string Amount(double value, const std::string& unit);
[[nodiscard]] std::string AmountOf(const CheckResult& check);
/// "d1.force, t = 0.3 s"
[[nodiscard]] std::string Place(const std::string& channel, double time_s);
/// "simulation", "the generic solver", "the table forces.csv", …
[[nodiscard]] std::string NameOf(const Comparison& comparison, const std::string& witness);

/// Has a limit and exceeds it.
[[nodiscard]] bool Failed(const CheckResult* check);

/// Evidence from motion alone: rates against positions, drive motion against commands. Empty if
/// motion tells nothing.
[[nodiscard]] Attribution AttributeByKinematics(const ComparisonInput& input,
                                                const Comparison& comparison);

/// Of the two witnesses of a pair, the one whose own energy drifts beyond its limit while the
/// other's does not, and a sentence about it: what integrates badly gains or loses energy.
[[nodiscard]] Attribution AttributeByEnergy(const Comparison& comparison,
                                            const PairComparison& pair);
/// What a drift of the simulated energy adds to another finding, "; …"; "" if there is none.
[[nodiscard]] std::string EnergyHint(const Comparison& comparison);

}  // namespace mbv::internal
