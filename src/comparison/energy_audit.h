// Where the energy of one witness' run came from and went, and whether all of it is accounted for.
#pragma once

#include <optional>

#include "comparison/comparison.h"

namespace mbv {

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
