// The same scenario against many wrong models of the simulated side: everything else is computed
// once.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "comparison/comparison.h"
#include "model_file/load_model.h"
#include "verify/computed_once.h"
#include "verify/run_witnesses.h"

namespace mbv {

/// What the checks say when the simulated side is `wrong`.
struct PerturbedRun {
  bool ran = false;    ///< false: `failure` says why there is nothing to compare
  bool loaded = true;  ///< false: the loader refused the perturbed model
  std::string failure;
  Trace trace;  ///< of the simulation
  Comparison comparison;

  /// A check failed, or the model could not run at all.
  [[nodiscard]] bool detected() const { return !ran || comparison.failed() > 0; }
  /// The value of a check; 0 if there is none.
  [[nodiscard]] double ValueOf(const std::string& check) const;
};

/// One number of the model file, replaced.
struct Replacement {
  std::string name;  ///< of a parameter ("limb2.azimuth" of an instance's), or a literal's place
  bool literal = false;  ///< Literal, load_model.h
  double value = kNan;
};

/// How a bench runs the scenario.
enum class BenchMode { kAsIs, kInverse };

class MutationBench {
 public:
  /// Loads and runs the unperturbed scenario as it is (driven by the unperturbed forces, or by
  /// servos, if it is), or with inverse dynamics per sample (round-off accuracy); its limits for
  /// that mode judge. The generic reference takes part only where no closed form does. Null after
  /// bad input, or when the unperturbed scenario does not agree; `exit_code` as of `run`.
  [[nodiscard]] static std::unique_ptr<MutationBench> Make(const std::string& file, BenchMode mode,
                                                           Diagnostics* diagnostics,
                                                           int* exit_code);

  [[nodiscard]] const Scenario& scenario() const { return prepared_.scenario; }
  /// The simulated side as it is.
  [[nodiscard]] const Mechanism& mechanism() const { return prepared_.mechanisms.simulated; }
  /// Numbers that its file writes out where they are used.
  [[nodiscard]] const std::vector<Literal>& literals() const { return literals_; }
  [[nodiscard]] const PerturbedRun& base() const { return base_; }
  /// What the simulation is judged by first.
  [[nodiscard]] const Role& truth() const {
    return prepared_.has_closed_form() ? role::kAnalytic : role::kReference;
  }
  /// Name of the check of its drive forces.
  [[nodiscard]] std::string ForceCheck() const;

  /// The simulated side with one number replaced.
  [[nodiscard]] PerturbedRun Run(const Replacement& replacement) const;
  [[nodiscard]] PerturbedRun Run(const Mechanism& wrong) const;
  /// The model with one number replaced; empty with the reason when it does not load.
  [[nodiscard]] std::optional<Mechanism> Perturb(const Replacement& replacement,
                                                 std::string* why) const;

  /// A value counts as an effect when it is clearly above what the unperturbed run gives.
  [[nodiscard]] static double Visible(double base);

 private:
  explicit MutationBench(Prepared prepared) : prepared_(std::move(prepared)) {}
  void RunTruths();
  [[nodiscard]] PerturbedRun Run(const Mechanism& wrong, const Scenario& scenario) const;
  /// What follows the unperturbed motion with this model, and its comparison with the truths.
  [[nodiscard]] WitnessRuns Follow(const Mechanism& wrong, const Scenario& scenario) const;
  [[nodiscard]] PerturbedRun Judge(WitnessRuns runs, const Scenario& scenario) const;
  [[nodiscard]] LoadOptions SimulatedOptions() const;

  Prepared prepared_;
  std::vector<Literal> literals_;
  // What the unperturbed run asks for; perturbed ones ask the same.
  ComputedOnce<DrivenSample> known_motion_;
  ComputedOnce<VecX> known_forces_;
  DrivenMotion driven_;
  DriveForces forces_;  // empty where the simulation is given none
  WitnessRuns truths_;  // with the unperturbed model under wrong forces, where it is force-driven
  std::vector<std::string> reactions_not_unique_;  // along the unperturbed run
  PerturbedRun base_;
};

}  // namespace mbv
