#include "report/svg_contours.h"

#include <cmath>

#include "core/demand.h"

namespace mbv {
namespace {

// Corners of a square, counter-clockwise from its lower left; edge k joins corners k and k + 1.
constexpr std::array<std::array<int, 2>, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

}  // namespace

std::vector<ContourPiece> Contour(const std::vector<double>& values, int columns, int rows,
                                  double level) {
  MBV_DEMAND(values.size() == static_cast<size_t>(columns) * static_cast<size_t>(rows),
             values.size());
  std::vector<ContourPiece> pieces;
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      std::array<double, 4> v{};
      double mean = 0.0;
      for (size_t k = 0; k < 4; ++k) {
        v[k] = values[static_cast<size_t>(r + kCorners[k][1]) * static_cast<size_t>(columns) +
                      static_cast<size_t>(c + kCorners[k][0])] -
               level;
        mean += v[k] / 4;
      }
      if (!std::isfinite(mean)) continue;
      // Crossings in order around the square: none, two, or four at a saddle.
      std::vector<std::array<double, 2>> crossings;
      for (size_t k = 0; k < 4; ++k) {
        const size_t next = (k + 1) % 4;
        if ((v[k] < 0) == (v[next] < 0)) continue;
        const double t = v[k] / (v[k] - v[next]);
        crossings.push_back({c + kCorners[k][0] + t * (kCorners[next][0] - kCorners[k][0]),
                             r + kCorners[k][1] + t * (kCorners[next][1] - kCorners[k][1])});
      }
      if (crossings.size() == 2) {
        pieces.push_back({crossings[0], crossings[1]});
      } else if (crossings.size() == 4) {
        // The middle belongs to corner 0's side or not: cut off corners 1 and 3, or 0 and 2.
        const size_t first = (mean < 0) == (v[0] < 0) ? 0 : 1;
        pieces.push_back({crossings[first], crossings[first + 1]});
        pieces.push_back({crossings[first + 2], crossings[(first + 3) % 4]});
      }
    }
  }
  return pieces;
}

}  // namespace mbv
