// A study as data: which numbers of a scenario are varied, by which design, and what is asked of
// each point. Read by scenario/study_file.h, then only read.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "study/design.h"

namespace mbv {

/// A varied number.
struct Factor {
  std::string name;  ///< as in the study: "m_p", "motion.duration_s"
  std::string key;   ///< what `--set` sets: "parameters.m_p"; its value is in the key's unit
  Axis axis;         ///< nominal: NaN where the scenario does not state the number
  int line = 0, column = 0;
};

/// What a signal over time is reduced to.
enum class Statistic { kMax, kMin, kPeak, kRms, kMean, kEnd };
struct StatisticWord {
  Statistic statistic;
  const char* word;
};
inline constexpr StatisticWord kStatisticWords[] = {
    {Statistic::kMax, "max"}, {Statistic::kMin, "min"},   {Statistic::kPeak, "peak"},
    {Statistic::kRms, "rms"}, {Statistic::kMean, "mean"}, {Statistic::kEnd, "end"}};

/// What is computed at each point: a statistic of a channel, or a check's value.
struct StudyQuantity {
  std::string name;     ///< as in the study: "limb1.drive.force.max", "closure_m"
  std::string channel;  ///< "" of a check
  Statistic statistic = Statistic::kMax;
  bool of_pair = false;  ///< a check that compares two witnesses
  int line = 0, column = 0;

  [[nodiscard]] bool is_check() const { return channel.empty(); }
};

/// What a quantity must not do in more than a share of all points.
struct StudyLimit {
  size_t quantity = 0;  ///< index into Study::quantities
  std::optional<double> below, above;
  double share = 0.0;  ///< 0 … 1

  /// A value that is no number keeps no limit.
  [[nodiscard]] bool Keeps(double value) const {
    return value == value && !(below && value >= *below) && !(above && value <= *above);
  }
};

/// A table in the reference's place is judged against the band of all points (pipeline/validate.h).
struct StudyValidation {
  double coverage = 2.0;             ///< k: |E| ≤ k u_val is asked of a sample
  double share = 0.05;               ///< of a drive's samples that may be beyond that
  std::optional<double> u_num = {};  ///< of the drive forces [N or N m]; left out: estimated
  int line = 0, column = 0;
};

struct Study {
  std::string name;
  std::string description;
  std::string file;      ///< as given
  std::string scenario;  ///< file
  std::vector<Factor> factors;
  Design design;
  std::vector<std::string> witnesses;  ///< words of kStudyWitnesses
  std::vector<StudyQuantity> quantities;
  std::vector<StudyLimit> limits;
  std::optional<StudyValidation> validation;
  /// The share of points that may have no result; limits are about the others then. Left out:
  /// points without a result violate every limit.
  std::optional<double> missing;
  int expected_exit = 0;  ///< for tests of shipped studies
  std::string mentions;   ///< must occur in what is printed

  [[nodiscard]] DesignPoints Points() const {
    std::vector<Axis> axes;
    for (const Factor& factor : factors) axes.push_back(factor.axis);
    return {std::move(axes), design};
  }
};

/// Who may compute a point; `inverse` and `forward` are the simulation in that mode, `simulation`
/// in the scenario's own.
inline constexpr const char* kStudyWitnesses[] = {"analytic", "reference", "inverse", "forward",
                                                  "simulation"};

}  // namespace mbv
