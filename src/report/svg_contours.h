// Contour lines of values on a regular grid of points.
#pragma once

#include <array>
#include <vector>

namespace mbv {

/// A piece of a contour in grid units: (0, 0) is the first point, x counts columns, y rows.
struct ContourPiece {
  std::array<double, 2> from{}, to{};
};

/// Pieces where the linearly interpolated value is `level` (marching squares; a saddle is told by
/// its mean). Squares with a missing corner (NaN) have none. `values` is rows × columns.
[[nodiscard]] std::vector<ContourPiece> Contour(const std::vector<double>& values, int columns,
                                                int rows, double level);

}  // namespace mbv
