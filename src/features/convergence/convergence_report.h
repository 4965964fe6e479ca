// Writers of a convergence study.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "features/convergence/order.h"

namespace mbv {

/// A table to read.
[[nodiscard]] std::string ToText(const ConvergenceReport& report);
/// One row per run, 17 significant digits.
[[nodiscard]] std::string ToCsv(const ConvergenceReport& report);
/// Everything.
[[nodiscard]] std::string ToJson(const ConvergenceReport& report);
/// File names and contents: error against step, time constant and processor time.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> ConvergencePlots(
    const ConvergenceReport& report);

}  // namespace mbv
