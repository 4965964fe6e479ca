// Maps of stiffness indices over two coordinates.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "features/stiffness/stiffness.h"
#include "math/plot.h"

namespace mbv {

struct MapAxis {
  std::string name;  ///< a coordinate of the pose
  std::string unit;  ///< "m" or "rad"
  double low = kNan, high = kNan;
  int count = 0;  ///< points, both ends included, >= 2
};

struct MapValue {
  std::string name, unit;
  double value = kNan;
};

struct StiffnessMap {
  std::array<MapAxis, 2> axes;
  std::vector<MapValue> fixed;  ///< other coordinates of the pose that the map changes
  double within = kNan;  ///< only points whose two coordinates lie in a circle of this radius
                         ///< about zero; NaN: all
};

/// "platform.x=-0.1:0.1:61,y_mm=-100:100:61,z=-0.1,within=0.1": two ranges LOW:HIGH:POINTS, and
/// values of other coordinates of the pose, with commas or blanks between them. Without ranges,
/// those of the mechanism's usual map. Keys may end in _mm or _deg; x … yaw and phi (yaw) are those
/// of the output by which the pose is stated. Wrong ones are findings.
[[nodiscard]] std::optional<StiffnessMap> ParseMap(const std::string& text,
                                                   const PreparedStiffness& prepared,
                                                   Diagnostics* diagnostics);

/// The maps that belong to a mechanism's closed form; empty without one. In the text form of
/// ParseMap().
[[nodiscard]] std::vector<std::string> UsualMaps(const std::string& mechanism);

struct MapResult {
  std::vector<NamedIndex> indices;          ///< of the form, then general ones; no values
  std::vector<std::vector<double>> values;  ///< per index: rows × columns, axes[0] fastest; NaN
                                            ///< where the pose is not reached, out of a range
                                            ///< of joints or drives, or out of the circle
  std::vector<int> rank;                    ///< −1 where there is no stiffness
  size_t points = 0, reached = 0;           ///< within the circle
  size_t out_of_range = 0;  ///< poses that only joints or drives beyond their ranges would reach
  int lost_rows = 0;        ///< whose process was killed
  double wall_s = 0.0;
  bool closed_form = false;  ///< else frame elements
};
/// Evaluates by the closed form where there is one, else by frame elements; `jobs` processes at
/// once, on which the result does not depend. Rows whose process was killed are not reached, and
/// counted.
[[nodiscard]] MapResult ComputeMap(const PreparedStiffness& prepared, const StiffnessMap& map,
                                   const ProgressFunction& progress = {}, int jobs = 1);

/// A picture of each of `names` (default: the closed form's first two and the weakest stiffnesses)
/// by the name of its files. Unknown names are findings.
[[nodiscard]] std::vector<std::pair<std::string, MapPlot>> MapPlots(
    const StiffnessMap& map, const MapResult& result, const std::string& mechanism,
    const std::vector<std::string>& names, Diagnostics* diagnostics);

/// Files (name, content): the CSV of all indices and an SVG for each of MapPlots().
[[nodiscard]] std::vector<std::pair<std::string, std::string>> MapFiles(
    const StiffnessMap& map, const MapResult& result, const std::string& mechanism,
    const std::vector<std::string>& names, Diagnostics* diagnostics);

/// Median, smallest and largest value of each index with its place, to read.
[[nodiscard]] std::string MapText(const StiffnessMap& map, const MapResult& result,
                                  const std::vector<std::string>& names);

/// "x_y_yaw0deg_z-100mm", for file names.
[[nodiscard]] std::string MapName(const StiffnessMap& map);

}  // namespace mbv
