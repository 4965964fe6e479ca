// What a study asks of one run of a scenario: the witnesses' traces, reduced to numbers.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/prepare.h"
#include "pipeline/run_witnesses.h"
#include "study/study.h"

namespace mbv {

/// The witnesses that a study names, run on a prepared scenario.
struct StudyRun {
  const Prepared* prepared = nullptr;
  WitnessRuns runs;
  std::vector<const WitnessRecord*> witnesses;  ///< those named, in their order
  std::string failure;                          ///< why there is nothing to measure; "" otherwise
};
/// `prepared` must outlive the result.
[[nodiscard]] StudyRun RunStudyWitnesses(const Prepared& prepared,
                                         const std::vector<std::string>& names);

/// What `--set` says of the simulation's mode for these witnesses; "" for the scenario's own.
[[nodiscard]] std::string ModeOf(const std::vector<std::string>& names);

/// Of a trace, from its first to its last sample; NaN if some sample is none.
[[nodiscard]] double StatisticOf(const VecX& samples, Statistic statistic);

/// Why the first witness' samples do not resolve the motion; "" if they do.
[[nodiscard]] std::string UnresolvedBySamples(const StudyRun& run);

struct StudyMeasures {
  std::vector<double> values;      ///< one per quantity
  std::optional<Verdict> verdict;  ///< of several witnesses, by the scenario's checks
  std::string reason;              ///< of the verdict
};

/// Values are NaN where the witnesses do not tell it. Of a channel: by the first
/// witness that records it. Of a check: the worst of all witnesses, or of all their pairs;
/// `motor_margin` is the smallest margin.
[[nodiscard]] StudyMeasures MeasureQuantities(const StudyRun& run,
                                              const std::vector<StudyQuantity>& quantities);

}  // namespace mbv
