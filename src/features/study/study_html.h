// Plots of a study: each is a file of its own, and stands in a section of the page.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "features/study/study_report.h"
#include "math/plot.h"

namespace mbv {

/// Sections of the page that have plots.
enum class StudySection { kIndices, kTornado, kBands, kValidation, kHistograms, kScatter };

struct StudyPlot {
  StudySection section;
  std::string file;  ///< "band_limb1.drive.svg", unique and fit for any disk
  std::string svg;
  std::optional<LinePlot> lines = {};  ///< what is drawn, where it is lines
};

[[nodiscard]] std::vector<StudyPlot> StudyPlots(const StudyReport& report);

/// Quantities over varied numbers, a dot per point.
struct ScatterMatrix {
  std::string title;
  std::vector<std::string> columns, rows;           ///< names
  std::vector<std::vector<double>> across, upward;  ///< per point: of columns, of rows
};
[[nodiscard]] std::string ToSvg(const ScatterMatrix& matrix);

}  // namespace mbv
