// Computes points of a study: the scenario with some numbers replaced, by some of its witnesses.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/diagnostics.h"
#include "core/inputs.h"
#include "pipeline/prepare.h"
#include "study/point_row.h"
#include "study/study.h"
#include "study/validation.h"

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
  std::string table;                    ///< file name; "" where nothing is validated
  std::string numerical;                ///< where u_num is from
  std::vector<ForceComparison> drives;  ///< those that the table has; u_input is still empty
  std::vector<size_t> places;           ///< of these drives in StudyForces::drives
};

struct StudyPoint {
  PointRow row;
  std::vector<float> forces;  ///< drives × times; NaN where there are none
};

class StudyBench {
 public:
  /// Computes the scenario as it is, with nothing varied, and checks all names against it. Null
  /// after bad input (exit code 2) or where it cannot run (3).
  [[nodiscard]] static std::unique_ptr<StudyBench> Make(const Study& study,
                                                        Diagnostics* diagnostics, int* exit_code);

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
  /// Tells a study, its scenario and model, and this program from others.
  [[nodiscard]] const std::string& fingerprint() const { return fingerprint_; }

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
  explicit StudyBench(Study study) : study_(std::move(study)), points_(study_.Points()) {}
  [[nodiscard]] std::vector<SetValue> SetsOf(const std::vector<double>& varied) const;
  [[nodiscard]] std::string MovedBy(size_t factor) const;
  void CheckKeys(Diagnostics* diagnostics) const;
  void Measure(const Prepared& prepared, const StudyRun& run, Diagnostics* diagnostics);
  void CheckQuantities(const std::vector<std::string>& channels, Diagnostics* diagnostics) const;

  Study study_;
  DesignPoints points_;
  StudyPoint nominal_;
  StudyForces forces_;
  MeasuredForces measured_;
  bool steps_ = false;
  std::vector<std::string> idle_;
  std::vector<InputFile> inputs_;
  std::string fingerprint_;
};

}  // namespace mbv
