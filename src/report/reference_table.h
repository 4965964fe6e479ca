// What the report says about a table that stands in for the reference.
#pragma once

#include <string>
#include <vector>

#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// The pair whose columns are shown: the table against the witness it is judged by first. Null
/// without a table, or if none of its columns was compared.
[[nodiscard]] const PairComparison* TablePair(const Comparison& comparison);

/// "digits 2.9e-04, noise 1.1e-03": the parts of a column's standard uncertainty that are not 0.
[[nodiscard]] std::string UncertaintyText(const TableUncertainty& uncertainty);

/// The file, its uncertainty, the columns with tubes, plots of the worst ones, how it was read;
/// without blocks where there is no table. `verbose`: notes of the reader and what the uncertainty
/// is made of also on a terminal.
[[nodiscard]] ReportSection ReferenceTableSection(const Report& report, bool verbose);

}  // namespace mbv
