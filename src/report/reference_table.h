// What the report says about a table that stands in for the reference.
#pragma once

#include <string>
#include <vector>

#include "report/report.h"

namespace mbv {

/// The pair whose columns are shown: the table against the witness it is judged by first. Null
/// without a table, or if none of its columns was compared.
[[nodiscard]] const PairComparison* TablePair(const Comparison& comparison);

/// "digits 2.9e-04, noise 1.1e-03": the parts of a column's standard uncertainty that are not 0.
[[nodiscard]] std::string UncertaintyText(const TableUncertainty& uncertainty);

/// Lines for a terminal: the file, its uncertainty, each column with its tube; empty without a
/// table. Notes of the reader only when `verbose`.
[[nodiscard]] std::vector<std::string> ReferenceTableLines(const Comparison& comparison,
                                                           bool verbose);

/// Section of report.html: the columns with tubes, plots of the worst columns, notes; "" without a
/// table.
[[nodiscard]] std::string ReferenceTableHtml(const Report& report);

}  // namespace mbv
