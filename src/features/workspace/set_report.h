// What is known of a reachable set: text, page, files.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "base/json_text.h"
#include "features/workspace/quality.h"
#include "plot/style.h"
#include "report/document.h"

namespace mbv {

/// A measure of the same set by a closed form.
struct KnownMeasure {
  std::string way;  ///< "closed form: volume by smooth faces"
  double value = kNan, error = kNan;
};

/// All that a page shows.
struct SetReport {
  std::string mechanism;
  ReachableSet set;
  QualityMap quality;
  std::vector<TracedArc> constraint;  ///< constraint singularities inside (constraint_curves.cc)
  TriangleMesh constraint_surface;    ///< the same of three dimensions
  TriangleMesh type2_surface;         ///< of three, where the drives lose their hold
  std::vector<KnownMeasure> known;

  /// Of both ways and of all that is known otherwise.
  [[nodiscard]] bool agree() const;
};

[[nodiscard]] std::string ToText(const SetReport& report, const TextStyle& style);
[[nodiscard]] nlohmann::ordered_json ToJson(const SetReport& report);
/// Figures for print, beside those of the page.
struct PrintedFigures {
  std::vector<std::string> formats;  ///< "pdf", "png"
  FigureStyle style;
};
/// The page, boundary and poses as CSV, figures, and of three dimensions the surface as STL and PLY
/// with a colour per bound, and that of constraint singularities inside as STL.
[[nodiscard]] std::vector<std::pair<std::string, std::string>> SetFiles(
    const SetReport& report, const PrintedFigures& printed = {});
/// The surface of a set over x, y and z of an output, a mesh per bound, in the output's reference
/// frame; else empty.
[[nodiscard]] std::vector<std::pair<TriangleMesh, std::string>> ColoredSurface(
    const ReachableSet& set);

}  // namespace mbv
