// ReferenceTable: measured or exported signals that stand in for the generic reference.
//
//   reference:
//     csv: forces.csv
//     columns: {time: t, limb1.drive.force: {column: "F1 (kN)", sign: -1}}
//
// Uncertainty. No check may ask for better agreement than its reference has, so each column's own
// uncertainty is estimated from what the file shows:
//   digits         half a unit of the last printed digit (uniform: step/√12 as standard deviation)
//   noise          standard deviation of what no smooth curve explains (see table_noise.h)
//   time stamps    slope · rounding of the printed times
//   interpolation  only where the samples lie off the scenario's grid: difference of the cubic and
//                  the quintic interpolant
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/trace.h"
#include "core/types.h"
#include "mechanism/motion.h"

namespace mbv {

/// A tolerance that a user states instead of the estimate: |error| ≤ absolute + relative · the
/// column's largest value.
struct TableTolerance {
  double absolute = 0.0;  ///< SI
  double relative = 0.0;
};

struct TableColumn {
  Channel channel;      ///< the signal it is, in SI
  std::string heading;  ///< in the file; "column 3" where there is none
  std::string unit;     ///< of the file's numbers
  double factor = 1.0;  ///< value = factor · number + shift; sign and unit included
  double shift = 0.0;
  double noise = 0.0;  ///< standard deviation, SI; 0 when too few rows to tell
  std::optional<TableTolerance> tolerance;
};

struct ReferenceTable {
  std::string file;            ///< path
  std::string name;            ///< file name, for people
  std::vector<double> time_s;  ///< scenario time (offset and unit applied), increasing
  double stamp_error_s = 0.0;  ///< rounding of the time stamps, largest
  /// Equal steps up to the rounding of the stamps: row i was taken at time_s[0] + i·spacing_s.
  bool uniform = false;
  double spacing_s = kNan;  ///< uniform: the step; else the median step
  std::vector<TableColumn> columns;
  MatX values;                     ///< rows × columns, SI
  MatX steps;                      ///< as values: one unit of the last printed digit, SI
  double coverage = 2.0;           ///< k: limits are k · uncertainty at least
  double coarsest = 0.1;           ///< of the RMS force: a coarser table verifies nothing
  std::vector<std::string> notes;  ///< what was found out or assumed; columns that are not used
};

/// Parts of a column's standard uncertainty, RMS over the samples, SI.
struct TableUncertainty {
  double digits = 0.0, noise = 0.0, stamps = 0.0, interpolation = 0.0;
  bool stated = false;  ///< by the scenario; the parts are then zero
};

/// The table on a scenario's grid, as a witness.
struct AlignedTable {
  std::string name;  ///< file name
  Trace trace;       ///< of the reference; rows at samples of the grid only
  MatX standard;     ///< as trace.values: standard uncertainty
  MatX bound;        ///< as trace.values: how far a single sample may be off
  double coverage = 2.0;
  double coarsest = 0.1;
  std::vector<TableColumn> columns;           ///< of trace.channels
  std::vector<TableUncertainty> uncertainty;  ///< of trace.channels
  bool interpolated = false;
  std::string grid;                ///< how the rows were brought to the grid, one sentence
  std::vector<std::string> notes;  ///< the table's and those of its alignment
};

/// The sample distance at which witnesses meet the table's rows, if the scenario states none.
[[nodiscard]] double SuggestSample(const ReferenceTable& table);

/// Puts the rows on the grid 0, sample_s, … of a motion: rows that lie on it (to the rounding of
/// their stamps) are taken as they are; a table that does not fit is interpolated, cubically. Rows
/// outside the motion are left out. The trace is empty when no row is inside.
[[nodiscard]] AlignedTable AlignTable(const ReferenceTable& table, const Motion& motion);

}  // namespace mbv
