// A program of a stranger as a witness (docs/how-to/external_solvers.md): it gets a folder with the
// mechanism and its motion, and leaves its traces there.
#pragma once

#include "pipeline/prepare.h"
#include "report/report.h"

namespace mbv {

/// Runs it on the drives' motion. Whatever the program does (dies, hangs, floods, answers nonsense)
/// is in the record's summary, as not run, and in its gap.
[[nodiscard]] WitnessRecord RunForeign(const ForeignWitness& witness, const Prepared& prepared,
                                       const Mechanism& mechanism, const DrivenMotion& driven);

}  // namespace mbv
