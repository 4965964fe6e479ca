// The same scenario against many wrong models of the simulated side: everything else is computed
// once.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "comparison/comparison.h"
#include "pipeline/prepare.h"
#include "scenario/table.h"

namespace mbv {

/// What the checks say when the simulated side is `wrong`.
struct BentRun {
  bool ran = false;    ///< false: `failure` says why there is nothing to compare
  bool loaded = true;  ///< false: the loader refused the bent model
  std::string failure;
  Trace trace;  ///< of the simulation
  Comparison comparison;

  /// A check failed, or the model could not run at all.
  [[nodiscard]] bool detected() const { return !ran || comparison.failed() > 0; }
  /// The value of a check; 0 if there is none.
  [[nodiscard]] double ValueOf(const std::string& check) const;
};

class MutationBench {
 public:
  /// Loads and runs the unbent scenario with inverse dynamics per sample (round-off accuracy). The
  /// generic reference takes part only where no closed form does. Null after bad input, or when
  /// the unbent scenario does not agree; `exit_code` as of `run`.
  [[nodiscard]] static std::unique_ptr<MutationBench> Make(const std::string& file,
                                                           Diagnostics* diagnostics,
                                                           int* exit_code);

  [[nodiscard]] const Scenario& scenario() const { return prepared_.scenario; }
  /// The simulated side as it is.
  [[nodiscard]] const Mechanism& mechanism() const { return prepared_.mechanisms.simulated; }
  [[nodiscard]] const BentRun& base() const { return base_; }
  /// "analytic", "reference" (a table, too) or "solver": what the simulation is judged by first.
  [[nodiscard]] const std::string& truth() const { return truth_; }
  [[nodiscard]] std::string ForceCheck() const { return "simulated_vs_" + truth_ + ".force_nrmse"; }

  /// The simulated side with one parameter replaced.
  [[nodiscard]] BentRun Run(const std::string& parameter, double value) const;
  [[nodiscard]] BentRun Run(const Mechanism& wrong) const;
  /// The model with one parameter replaced; empty with the reason when it does not load.
  [[nodiscard]] std::optional<Mechanism> Bend(const std::string& parameter, double value,
                                              std::string* why) const;

  /// A value counts as an effect when it is clearly above what the unbent run gives.
  [[nodiscard]] static double Visible(double base);

 private:
  explicit MutationBench(Prepared prepared) : prepared_(std::move(prepared)) {}
  void RunTruths();
  void TakeDrivenMotion();
  [[nodiscard]] ComparisonInput Input() const;

  Prepared prepared_;
  std::vector<std::pair<std::string, RunSummary>> summaries_;  // of traces_
  std::vector<Trace> traces_;
  std::optional<AlignedTable> table_;
  std::vector<DrivenSample> driven_;  // per sample of the motion
  RunSummary driven_summary_;
  std::string truth_;
  std::vector<std::string> reactions_not_unique_;
  BentRun base_;
};

}  // namespace mbv
