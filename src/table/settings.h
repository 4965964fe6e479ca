// `reference: {csv: …}`: what a scenario says about a table.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/roles.h"
#include "input/value_reader.h"
#include "table/table.h"
#include "table/text.h"

namespace mbv {

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

}  // namespace mbv
