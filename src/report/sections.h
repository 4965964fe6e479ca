// Parts of a report on a motion for a terminal, report.html and summary.json: what the ground bears
// of feet, tables that command motions, a table that replaces the reference.
#pragma once

#include <string>
#include <vector>

#include "base/json_text.h"
#include "report/document.h"
#include "report/report.h"

namespace mbv {

/// A row per phase; without blocks where the motion has none.
[[nodiscard]] ReportSection PhaseSection(const Report& report);
/// `phases` of summary.json.
[[nodiscard]] nlohmann::ordered_json PhasesJson(const Report& report);

/// When force elements rest, slide, meet an end or are switched, by the first witness that found
/// it, and how much later or earlier the others have it. On a terminal with `verbose` only; without
/// blocks in commanded motions.
[[nodiscard]] ReportSection EventSection(const Report& report, bool verbose);
/// `events` of summary.json: of every witness.
[[nodiscard]] nlohmann::ordered_json EventsJson(const Report& report);

/// A row per foot, by the witness that a reader looks at first; the path of the centre of pressure
/// under each foot. Without blocks where nothing stands on the ground.
[[nodiscard]] ReportSection ContactSection(const Report& report);
/// `contacts` of summary.json: of every witness.
[[nodiscard]] nlohmann::ordered_json ContactsJson(const Report& report);

// What the report says about tables that command a motion: how they were read, and what smoothing
// did to positions, accelerations and drive forces.

/// Without blocks where no table moves anything. Notes of the reader only when `verbose`.
[[nodiscard]] ReportSection MotionTableSection(const Report& report, bool verbose);

/// `motion_tables` of summary.json.
[[nodiscard]] nlohmann::ordered_json MotionTableJson(const Report& report);

// What the report says about a table that stands in for the reference.

/// The pair whose columns are shown: the table against the witness it is judged by first. Null
/// without a table, or if none of its columns was compared.
[[nodiscard]] const PairComparison* TablePair(const Comparison& comparison);

/// "digits 2.9e-04, noise 1.1e-03": the parts of a column's standard uncertainty that are not 0.
[[nodiscard]] std::string UncertaintyText(const TableUncertainty& uncertainty);

/// The file, its uncertainty, the columns with tubes, plots of the worst ones, how it was read;
/// without blocks where there is no table. `verbose`: notes of the reader and what the uncertainty
/// is made of also on a terminal.
[[nodiscard]] ReportSection ReferenceTableSection(const Report& report, bool verbose);

// How near a motion comes to singular poses: for a terminal, report.html and summary.json.

/// A row per kind. On a terminal only where one is close, or with `verbose`.
[[nodiscard]] ReportSection SingularitySection(const Report& report, bool verbose);
/// `singularity` of summary.json.
[[nodiscard]] nlohmann::ordered_json SingularityJson(const Report& report);
/// One sentence for each kind that comes close, of those that the motion asks for.
[[nodiscard]] std::vector<std::string> SingularityWarnings(const SingularApproaches& approaches);

}  // namespace mbv
