// Computes points of a study: the scenario with some numbers replaced, by some of its witnesses.
#pragma once

#include <algorithm>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/inputs.h"
#include "features/study/design.h"
#include "features/study/summary.h"
#include "features/study/validation.h"
#include "verify/prepare.h"
#include "verify/run_witnesses.h"

namespace mbv {

struct StudyRun;

/// The drive forces over time that bands are made of.
struct StudyForces {
  std::vector<std::string> drives, units;
  std::vector<double> time_s;         ///< at most kBandTimes of the nominal samples
  std::vector<Eigen::Index> samples;  ///< their rows
  [[nodiscard]] size_t size() const { return drives.size() * time_s.size(); }
};
inline constexpr size_t kBandTimes = 240;

/// What a measured table says at these times, and how exact the nominal run is.
struct MeasuredForces {
  std::string table;                         ///< file name; "" where nothing is validated
  std::string numerical;                     ///< where u_num is from
  std::vector<ForceComparison> drives = {};  ///< those that the table has; u_input is still empty
  std::vector<size_t> places;                ///< of these drives in StudyForces::drives
};

struct StudyPoint {
  PointRow row;
  /// Drives × times; NaN where there are none. Empty of points from kBandPoints on.
  std::vector<float> forces;
};

class StudyBench {
 public:
  /// Computes the scenario as it is, with nothing varied, and checks all names against it. Null
  /// after bad input (exit code 2) or where it cannot run (3).
  [[nodiscard]] static std::unique_ptr<StudyBench> Make(const Study& study,
                                                        Diagnostics* diagnostics, int* exit_code);

  ~StudyBench();

  [[nodiscard]] const Study& study() const { return study_; }
  [[nodiscard]] const DesignPoints& points() const { return points_; }
  /// Of the scenario as it is; `row.varied` are the nominal values.
  [[nodiscard]] const StudyPoint& nominal() const { return nominal_; }
  [[nodiscard]] const StudyForces& forces() const { return forces_; }
  /// Whether the first witness goes in steps: the simulation in forward mode.
  [[nodiscard]] bool steps() const { return steps_; }
  [[nodiscard]] const MeasuredForces& measured() const { return measured_; }
  /// The files that it is computed from.
  [[nodiscard]] const std::vector<InputFile>& inputs() const { return inputs_; }
  /// Distinguishes a study, its scenario and model, and this program from others.
  [[nodiscard]] std::string fingerprint() const { return FingerprintOf(study_.design.count); }
  /// That of the same study with another number of drawn points.
  [[nodiscard]] std::string FingerprintOf(std::uint64_t count) const;

  /// Whether points differ in numbers of commands and loads alone, so that no file is read for
  /// them.
  [[nodiscard]] bool keeps() const { return kept_ != nullptr; }
  /// A function of the study and the number alone.
  [[nodiscard]] StudyPoint Run(std::uint64_t number) const;
  /// Finds which numbers move which quantities, by setting each alone to its ends, in a child
  /// process. A number that moves none is a warning; a limit whose quantity none moves is an error.
  void FindIdle(double timeout_s, Diagnostics* diagnostics);
  /// Names of the numbers that move no quantity; empty before FindIdle().
  [[nodiscard]] const std::vector<std::string>& idle() const { return idle_; }
  /// A point that gave nothing.
  [[nodiscard]] StudyPoint Lost(std::uint64_t number, const std::string& reason) const;
  /// What runs the scenario at these values, to be typed.
  [[nodiscard]] std::string Command(const std::vector<double>& varied) const;

 private:
  struct Kept;
  explicit StudyBench(Study study);
  void Keep();
  [[nodiscard]] std::vector<SetValue> SetsOf(const std::vector<double>& varied) const;
  [[nodiscard]] std::vector<SetValue> SetsOfPoint(const std::vector<double>& varied) const;
  [[nodiscard]] std::string MovedBy(size_t factor) const;
  void CheckKeys(Diagnostics* diagnostics) const;
  void Measure(const Prepared& prepared, const StudyRun& run, Diagnostics* diagnostics);
  void CheckQuantities(const std::vector<std::string>& channels, Diagnostics* diagnostics) const;

  Study study_;
  mutable ScenarioMemory memory_;
  std::unique_ptr<Kept> kept_;  // null where more than these numbers is varied
  DesignPoints points_;
  StudyPoint nominal_;
  StudyForces forces_;
  MeasuredForces measured_;
  bool steps_ = false, without_closed_form_ = false;
  std::vector<std::string> idle_;
  std::vector<InputFile> inputs_;
};

// The rows of a study, computed in worker processes and appended to files as they come.

inline constexpr const char* kPointsFile = "points.csv";
/// Drive forces of points below kBandPoints: records of StudyForces::size() little-endian 32-bit
/// floats, in the order of the rows.
inline constexpr const char* kForcesFile = "forces.bin";
inline constexpr std::uint64_t kBandPoints = 4096;

/// Every `count`-th point, from `index` (0 … count − 1) on.
struct StudyShare {
  std::uint64_t index = 0, count = 1;

  [[nodiscard]] std::uint64_t size(std::uint64_t points) const {
    return points > index ? (points - index - 1) / count + 1 : 0;
  }
  [[nodiscard]] std::uint64_t number(std::uint64_t row) const { return index + row * count; }
  /// How many of its first `rows` have forces.
  [[nodiscard]] std::uint64_t records(std::uint64_t rows) const {
    return std::min(rows, size(kBandPoints));
  }
};

struct PointsOptions {
  StudyShare share;
  int jobs = 1;
  double timeout_s = 300.0;  ///< of one point
  /// `cpu_s`: processor time of a point, the mean of those computed now.
  std::function<void(std::uint64_t done, std::uint64_t all, double cpu_s)> progress = {};
};

/// How much of an earlier computation is good.
struct PointsDone {
  std::uint64_t rows = 0, csv_bytes = 0, force_bytes = 0;
};
/// Looks at what a killed computation left in `folder`: rows of this study in their order, each
/// with its forces. A last line that was cut off does not count, nor does what comes after it.
[[nodiscard]] PointsDone FindDone(const StudyBench& bench, const StudyShare& share,
                                  const std::filesystem::path& folder);

/// Computes the rest, in order, and appends it; the files' bytes depend neither on the number of
/// jobs nor on interruptions. "" or what went wrong.
[[nodiscard]] std::string ComputePoints(const StudyBench& bench, const PointsOptions& options,
                                        const PointsDone& done,
                                        const std::filesystem::path& folder);

// What a study asks of one run of a scenario: the witnesses' traces, reduced to numbers.

/// The witnesses that a study names, run on a prepared scenario.
struct StudyRun {
  const Prepared* prepared = nullptr;
  WitnessRuns runs;
  std::vector<const WitnessRecord*> witnesses = {};  ///< those named, in their order
  std::string failure;  ///< why there is nothing to measure; "" otherwise
};
/// `prepared` must outlive the result. `reuse`: runs that are not needed any more, of a scenario
/// that differs in numbers of its commands alone.
[[nodiscard]] StudyRun RunStudyWitnesses(const Prepared& prepared,
                                         const std::vector<std::string>& names,
                                         WitnessRuns reuse = {});

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

/// Values are NaN where the witnesses do not give it. Of a channel: by the first
/// witness that records it. Of a check: the worst of all witnesses, or of all their pairs;
/// `motor_margin` is the smallest margin.
[[nodiscard]] StudyMeasures MeasureQuantities(const StudyRun& run,
                                              const std::vector<StudyQuantity>& quantities);

// A study's nominal forces against the table in the reference's place
// (features/study/validation.h).

/// The table on the scenario's grid of samples.
[[nodiscard]] AlignedTable TableOf(const Prepared& prepared);

/// Of the first witness, at the times of `forces`. u_num: as stated, else what the first witness
/// differs by from the second one (RMS), 0 if it is alone.
[[nodiscard]] MeasuredForces MeasureForces(const AlignedTable& table, const StudyRun& run,
                                           const StudyForces& forces,
                                           const StudyValidation& settings);

/// All of it, with the deviations of the records in `file` (kForcesFile). Where the first witness
/// has a step, u_num is half the grid convergence index of `mbverify converge`, unless stated.
[[nodiscard]] StudyValidationResult ValidateStudy(const StudyBench& bench,
                                                  const std::filesystem::path& file);

}  // namespace mbv
