// What a study found, and its writers.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "features/study/summary.h"
#include "features/study/validation.h"
#include "math/plot.h"
#include "report/document.h"

namespace mbv {

/// A drive's force over time: what most points stay between, beside the nominal curve.
struct StudyBand {
  std::string drive, unit;
  std::vector<double> time_s, nominal, lower, median, upper;
  std::uint64_t points = 0, left_out = 0;  ///< with forces at the nominal times, and without

  /// From the 5th to the 95th percentile; of few points from the least to the most.
  [[nodiscard]] bool percentiles() const { return points >= kFewestForPercentiles; }
};

struct StudyReport {
  Study study;
  std::vector<double> nominal;    ///< per quantity
  std::vector<std::string> idle;  ///< varied numbers that move no quantity
  StudySummary summary;
  std::vector<StudyBand> bands;
  std::optional<StudyValidationResult> validation;
  std::vector<PointRow> shown;  ///< evenly chosen, at most kMostShown: for the scatter matrix
  /// What runs a point's scenario, to be typed: per quantity, as its worst points; and of failures.
  std::vector<std::vector<std::string>> worst_commands;
  std::vector<std::string> failed_commands, disagreed_commands;
  std::vector<std::pair<std::string, std::string>> versions;

  /// Whether anything is asked of the points.
  [[nodiscard]] bool judged() const {
    return !study.limits.empty() || validation || study.missing || study.witnesses.size() > 1;
  }
  /// 0 limits are kept (or there are none), 1 one is not, 3 no point has values, or nothing could
  /// be validated.
  [[nodiscard]] int exit_code() const {
    if (!summary.any_value() || (validation && !validation->trouble.empty())) return 3;
    return summary.within_limits() && (!validation || validation->pass()) ? 0 : 1;
  }
};
inline constexpr std::uint64_t kMostShown = 800;

/// "1024 points by sobol, 3 of them without a result".
[[nodiscard]] std::string PointsText(const StudyReport& report);
struct StudyPlot;
/// With the plots that belong to them; a section without blocks has nothing to show.
[[nodiscard]] std::vector<ReportSection> SectionsOf(const StudyReport& report,
                                                    const std::vector<StudyPlot>& plots);
/// For a terminal.
[[nodiscard]] std::string ToText(const StudyReport& report);
/// summary.json, schema "mbverify.study_summary/1".
[[nodiscard]] std::string ToJson(const StudyReport& report);
/// report.html.
[[nodiscard]] std::string ToHtml(const StudyReport& report);

// Plots of a study: each is a file of its own, and stands in a section of the page.

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
