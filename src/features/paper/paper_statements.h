// What a paper says of a figure, measured on what was computed for it.
#pragma once

#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "features/paper/paper_file.h"
#include "math/plot.h"
#include "report/report.h"

namespace mbv {

struct StatedResult {
  std::string says, where;
  double low = kNan;       ///< of a range
  double measured = kNan;  ///< of a range the largest
  double printed = kNan;   ///< NaN: the paper prints no number
  std::string unit;        ///< as files name it: "kN", "%"; "" for numbers

  [[nodiscard]] double deviation() const { return measured - printed; }
};

/// Statements about signals. Witnesses, signals and units that the run does not have are findings
/// in `file`.
[[nodiscard]] StatedResult MeasureSignals(const PaperStatement& statement, const Report& report,
                                          const std::string& file, Diagnostics* diagnostics);
/// Statements about maps, which are square where they are mirrored.
[[nodiscard]] StatedResult MeasureMaps(const PaperStatement& statement,
                                       const std::vector<MapPlot>& maps, const std::string& file,
                                       Diagnostics* diagnostics);

/// "“agree to 0.1 kN” (section 4): printed 0.1 kN, computed 46.6 kN, deviation +46.5 kN".
[[nodiscard]] std::string ResultText(const StatedResult& result);

}  // namespace mbv
