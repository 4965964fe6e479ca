// The equality rows of a model in two versions of MuJoCo, and the known changes behind differences.
#pragma once

#include <vector>

#include "exchange/row_states.h"
#include "report/upgrade.h"
#include "simulation/row_survey.h"

namespace mbv {

/// One entry per kind of row, in the order in which they come. The answer's rows must be the
/// survey's, by name and number; else empty.
[[nodiscard]] std::vector<RowChange> CompareRows(const RowSurvey& survey, const RowAnswer& answer);

}  // namespace mbv
