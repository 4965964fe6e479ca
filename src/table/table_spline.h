// Rows of a table → the spline that a motion follows, with what there is to say about it.
#pragma once

#include <string>

#include "input/yaml_reader.h"
#include "mechanism/motion.h"
#include "table/row_spline.h"

namespace mbv {

/// Where findings about a table's rows belong.
struct RowsPlace {
  YamlReader* yaml = nullptr;
  YamlEntry csv;      ///< the key that names the file
  std::string path;   ///< of the table
  std::string file;   ///< as written
  double step = 0.0;  ///< of the printed digits, in the values' unit
};

/// Completes a table whose description (unit, periodic, smoothing, moves) is filled in: splines and
/// what smoothing changes. Findings: a round that does not close (errors; of the acceleration a
/// warning), a second derivative that is mostly noise (a warning). False after an error.
bool MakeSplines(const RowsPlace& place, const SplineRows& rows, MotionTable* table);

}  // namespace mbv
