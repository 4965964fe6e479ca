// Runs of a user's file, measured against the reference. Internal to pipeline/.
#pragma once

#include <optional>
#include <string>

#include "kinematics/driven_twists.h"
#include "pipeline/own_file_audit.h"
#include "reference/reference.h"
#include "simulation/own_file.h"

namespace mbv {

class OwnFileRuns {
 public:
  /// `request` outlives it.
  explicit OwnFileRuns(const OwnFileRequest& request);

  /// Why nothing can be run; "" if it can.
  [[nodiscard]] const std::string& declined() const { return declined_; }

  struct Measured {
    OwnRun run;
    OwnError error;
  };
  /// One run with these settings, of another text than the file's if `text` is one.
  [[nodiscard]] Measured Run(const OwnSettings& settings, const std::string& text = "");

  [[nodiscard]] const std::string& text() const { return task_.text; }
  [[nodiscard]] double length_m() const { return length_m_; }

 private:
  void FindCommands();
  [[nodiscard]] OwnRun InChild(const OwnTask& task) const;
  [[nodiscard]] OwnError ErrorOf(const OwnRun& run);
  void Solve(const Trace& like);
  void MeasureForces(const OwnRun& run, OwnError* error) const;
  void MeasureJointForces(const Trace& trace, OwnError* error) const;

  const OwnFileRequest& request_;
  const Prepared& prepared_;
  OwnTask task_;
  std::vector<size_t> command_of_;  // per drive
  Motion motion_;                   // sampled as the runs are
  DrivenTwists twists_;             // of the drives, for the scale of forces
  std::optional<ReferenceRun> truth_;
  double length_m_ = kNan;
  std::string declined_;
};

}  // namespace mbv
