// Which column of a table is which signal.
#pragma once

#include <string>
#include <vector>

#include "mechanism/mechanism.h"
#include "scenario/tables/table.h"

namespace mbv {

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
