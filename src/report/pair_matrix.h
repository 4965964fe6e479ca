// Every witness against every other, where there are more than three: one number per pair.
#pragma once

#include <string>
#include <vector>

#include "report/report.h"

namespace mbv {

/// Lines for a terminal; empty with up to three witnesses.
[[nodiscard]] std::vector<std::string> PairMatrixLines(const Comparison& comparison);

/// Table of report.html; "" with up to three witnesses.
[[nodiscard]] std::string PairMatrixHtml(const Comparison& comparison);

}  // namespace mbv
