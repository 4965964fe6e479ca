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

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "base/roles.h"
#include "base/types.h"
#include "math/trace.h"
#include "mechanism/mechanism.h"
#include "mechanism/motion.h"
#include "model_file/yaml/value_reader.h"
#include "scenario/tables/text.h"

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
  double noise = 0.0;  ///< standard deviation, SI; 0 when too few rows to estimate it
  std::optional<TableTolerance> tolerance;
};

struct ReferenceTable {
  std::string file;            ///< path
  std::string name;            ///< file name, to show
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

// `reference: {csv: …}`: what a scenario says about a table.

/// One entry of `columns:`.
struct TableColumnSettings {
  YamlEntry place;     ///< key and place; its value may be dropped
  std::string path;    ///< for findings: "reference.columns.limb1.drive.force"
  std::string signal;  ///< channel name, or "time"
  bool off = false;    ///< not to be used, though its name may fit
  std::string column;  ///< heading; "" when given by number
  int number = 0;      ///< 1-based; 0 when given by heading
  std::string unit;    ///< as written; "" when left out
  int unit_line = 0, unit_character = 0;
  double sign = 1.0, scale = 1.0, offset = 0.0;  ///< sign · scale · number + offset, in `unit`
  std::optional<TableTolerance> tolerance;       ///< absolute in `unit`
};

struct TableSettings {
  std::string path = "reference";  ///< of the section, for findings
  /// What columns may be, where that is known: then only stated ones are read. Else every signal
  /// of the mechanism, stated or by its name.
  std::vector<Channel> signals;
  std::string csv;   ///< as written
  std::string file;  ///< path, relative ones taken from the scenario's folder
  YamlEntry place;   ///< of `csv`
  TableFormat format;
  std::string witness = role::kReference.name;  ///< which witness' columns of a traces.csv
  std::string time_unit;
  int time_unit_line = 0, time_unit_character = 0;
  double time_offset_s = 0.0;
  std::vector<TableColumnSettings> columns;
  std::optional<TableTolerance> tolerance;  ///< of all columns; absolute in each column's unit
  double coverage = 2.0, coarsest = 0.1;
};

/// Reads the section; findings go to the reader. `node` has a key `csv`.
[[nodiscard]] TableSettings ReadTableSettings(ValueReader* values, const YamlNode* node);

/// The keys of a table that say which file it is and how to read it.
extern const std::vector<std::string> kTableSourceKeys;
/// Reads these; `map` has been given them.
void ReadTableSource(ValueReader* values, const YamlMap& map, TableSettings* settings);
/// Reads a column that is given as a heading, a number or a map.
void ReadTableColumn(ValueReader* values, const YamlNode& node, TableColumnSettings* column);
/// Reads the keys column, unit, sign, scale and offset of a map that holds them among others.
void ReadTableColumnKeys(ValueReader* values, const YamlMap& map, TableColumnSettings* column);

/// Loads the table of a scenario; findings about its settings go to `yaml`, those about the file to
/// `diagnostics`. Null after an error.
[[nodiscard]] std::shared_ptr<const ReferenceTable> LoadTable(const TableSettings& settings,
                                                              const Mechanism& mechanism,
                                                              YamlReader* yaml,
                                                              Diagnostics* diagnostics);

/// The same from the file's text, for tests.
[[nodiscard]] std::shared_ptr<const ReferenceTable> LoadTableText(const std::string& text,
                                                                  const TableSettings& settings,
                                                                  const Mechanism& mechanism,
                                                                  YamlReader* yaml,
                                                                  Diagnostics* diagnostics);

// How the rows of a table lie in time.

// Noise of sampled signals.

/// Standard deviation of the noise in each column of `values` (rows at `time_s`, increasing): what
/// a smooth curve cannot explain. A sample is predicted from its 2, 4, … 10 nearest neighbours by
/// the polynomial through them; the median of the errors, scaled to what white noise of deviation
/// 1 would give, estimates the deviation. The truncation error of a smooth signal falls with the
/// number of neighbours while noise keeps its size, so the smallest of the estimates is taken.
/// The median makes it robust against steps and kinks. Zero with fewer than kFewestForNoise rows.
[[nodiscard]] std::vector<double> EstimateNoise(std::span<const double> time_s, const MatX& values);
inline constexpr size_t kFewestForNoise = 16;

/// Fills uniform, spacing_s and stamp_error_s from time_s (two rows at least): equal steps, equal
/// steps rounded to the printed digits, or anything else.
void DescribeTimes(ReferenceTable* table);

/// The times at which the rows were taken: evened out where only rounding makes them uneven.
[[nodiscard]] std::vector<double> TrueTimes(const ReferenceTable& table);

// Which column of a table is which signal.

/// A column to read.
struct MappedColumn {
  size_t index = 0;  ///< 0-based
  TableColumn column;
  bool unit_assumed = false;  ///< neither heading nor settings state one
  /// For `tolerance:` and findings.
  const TableColumnSettings* settings = nullptr;
};

/// All columns to read.
struct TableMapping {
  size_t time_index = 0;
  double time_factor = 1.0;        ///< to seconds
  bool time_unit_assumed = false;  ///< neither heading nor settings state one
  std::vector<MappedColumn> columns;
  std::vector<std::string> notes;  ///< automatic choices, assumed units, unused columns
};

/// Every signal a table may give: drives, outputs, prescribed joints' forces, joint reactions.
[[nodiscard]] std::vector<Channel> TableSignals(const Mechanism& mechanism);

/// Maps columns as the scenario says, the others by their names: a heading that is a signal's name,
/// or that with `.reference` behind it as in our own traces.csv. Findings about the settings go to
/// `yaml`, those about the file's units to `diagnostics`.
[[nodiscard]] TableMapping MapColumns(const TableText& text, const TableSettings& settings,
                                      const Mechanism& mechanism, YamlReader* yaml,
                                      Diagnostics* diagnostics);

}  // namespace mbv
