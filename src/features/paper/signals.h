// Curves of figures from the traces of a run.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "plot/figure.h"
#include "plot/style.h"
#include "report/plot_points.h"
#include "report/report.h"

// The words of figures in the languages that they can be drawn in.

namespace mbv {

enum class Language { kEnglish, kChinese, kGerman };

/// "en", "zh", "de", in the order of Language.
[[nodiscard]] const std::vector<std::string>& LanguageCodes();
[[nodiscard]] Language LanguageOf(const std::string& code);

/// What a figure says.
enum class FigureWord {
  kTime,
  kDriveForce,
  kDriveTorque,
  kDriveStroke,
  kDriveAngle,
  kDriveSpeed,
  kDriveRate,
  kReactionForce,
  kReactionMoment,
  kPower,
  kEnergy,
  kTotal,
  kKinetic,
  kGravity,
  kSprings,
  kDifference,
  kStep,
  kTimeConstant,
  kForceError,
  kCorrectedEngine,
  kStockEngine,
  kStepAlone,
  kAxisDistance,
  kAzimuth,
  kLimit,
  kCount_,
};
[[nodiscard]] std::string WordFor(FigureWord word, Language language);

/// "simulation", of a role's name in files (base/roles.h).
[[nodiscard]] std::string SayWitness(std::string_view name, Language language);

/// More points than a printer shows across a column are thinned; extremes are kept.
inline constexpr size_t kFigureBins = 1000;
/// Spans of differences on a logarithmic scale, of which the largest are shown.
inline constexpr size_t kDifferenceSpans = 120;
/// Markers along one curve.
inline constexpr size_t kMarksAlong = 11;

/// Witnesses that ran and take part in the comparison, in the order in which they ran.
[[nodiscard]] std::vector<const WitnessRecord*> ShownWitnesses(const Report& report);
/// The one whose curves are lines: the main pair's truth, else the first that ran; null if none.
[[nodiscard]] const WitnessRecord* LineWitness(const Report& report);

/// Times in the x unit and values in the y unit.
[[nodiscard]] FigurePoints Scaled(const PlotPoints& points, const ShownUnit& x, const ShownUnit& y);
/// The largest value of each of this many spans, at its time.
[[nodiscard]] PlotPoints Envelope(const PlotPoints& points, size_t spans);
/// Some of the points, spread evenly; `shift` (0 … 1) of a spacing later than the first.
[[nodiscard]] FigurePoints SomeOf(const FigurePoints& points, double shift);

/// The largest magnitude of a channel among the witnesses that record it; 0 without one.
[[nodiscard]] double LargestOf(const Report& report, const std::string& channel);

/// A signal of a panel, and its row of the legend (markup).
struct SignalRow {
  std::string channel, label;
};
struct OverTimeOptions {
  ShownUnit time, unit;
  Language language = Language::kEnglish;
  bool legend = true;
  bool from_start = false;  ///< changes since the first sample
};
/// The same points without the first value, or as they are.
[[nodiscard]] PlotPoints FromStart(PlotPoints points, bool from_start);
/// Signals over time: of one witness as lines, of the others as markers at some samples; where
/// friction at rest leaves a force open, a stroke from end to end. The legend says who is what.
void AddOverTime(const std::vector<SignalRow>& rows,
                 const std::vector<const WitnessRecord*>& witnesses, const WitnessRecord* line,
                 const OverTimeOptions& options, FigurePanel* panel);

}  // namespace mbv
