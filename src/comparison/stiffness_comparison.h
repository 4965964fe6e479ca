// Stiffness results of the witnesses → differences, checks, verdict and attribution.
//
// As for motions: a check passes only if its value is a number at or below its limit, the verdict
// starts as kNotRun and is kAgree only if at least one pair of stiffnesses was compared and judged,
// no witness broke down, and every check passes.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "comparison/comparison.h"
#include "core/stiffness.h"
#include "scenario/stiffness_checks.h"

namespace mbv {

/// One computation's part.
struct StiffnessWitness {
  std::string name;  ///< of its role (core/roles.h); "printed" for the paper's own
  StiffnessResult result;
  std::vector<Vec6> displacements;  ///< [Δγ; Δε] per load; empty if K is singular or none is given
  double residual = kNan;           ///< simulation only
  double extrapolation_error = kNan;  ///< simulation only

  [[nodiscard]] bool ran() const { return result.K.allFinite(); }
};

struct StiffnessInput {
  StiffnessLimits limits;
  std::vector<Vec6> loads;
  std::vector<StiffnessWitness> witnesses;  ///< in the order analytic, reference, simulated
};

struct WorstEntry {
  double value = kNan;
  std::string where;  ///< "K(x, ry)", "load 12, y"
};

/// Displacements under all loads, measured − truth. Relative to the largest displacement of the
/// axis over all loads: a ratio per entry means nothing where a displacement passes through zero.
struct LoadErrors {
  Vec6 mean = Vec6::Constant(kNan);   ///< of |error| per axis, over the axis' largest
  Vec6 max = Vec6::Constant(kNan);    ///< the same, largest
  Vec6 scale = Vec6::Constant(kNan);  ///< the axis' largest displacement [rad, m]
  std::vector<double> vector;         ///< per load: |error of Δε| / |Δε|
  double vector_mean = kNan, vector_max = kNan;
  int worst_load = -1, worst_vector = -1;  ///< 0-based
};

/// `measured` against `truth`.
struct StiffnessPair {
  std::string measured, truth;
  bool compared = false;
  std::string reason = "was not compared";   ///< why not
  Mat6 K_difference = Mat6::Constant(kNan);  ///< ΔK_ij / sqrt(K_ii K_jj), signed
  Mat6 C_difference = Mat6::Constant(kNan);
  std::map<StiffnessMetric, WorstEntry> metrics;
  std::optional<LoadErrors> loads;

  [[nodiscard]] std::string name() const { return PairName(measured, truth); }
};

struct StiffnessCheck {
  std::string name, subject;  ///< "simulated_vs_analytic.stiffness_entry"
  StiffnessMetric metric = StiffnessMetric::kStiffnessEntry;
  double value = kNan;
  std::optional<double> limit;  ///< empty: switched off
  bool pass = false;
  std::string where;
};

struct StiffnessComparison {
  Verdict verdict = Verdict::kNotRun;
  std::string reason = "comparison was not run";
  std::vector<StiffnessPair> pairs;
  std::vector<StiffnessCheck> checks;  ///< off ones included
  std::vector<NotCompared> not_compared;
  Attribution attribution;

  [[nodiscard]] const StiffnessPair* FindPair(const std::string& name) const;
  [[nodiscard]] const StiffnessCheck* FindCheck(const std::string& name) const;
  /// The pair a reader looks at first; null if none was compared.
  [[nodiscard]] const StiffnessPair* MainPair() const;
  [[nodiscard]] size_t failed() const;
  [[nodiscard]] size_t verified() const;
};

[[nodiscard]] StiffnessComparison CompareStiffness(const StiffnessInput& input);

/// One pair, for what is stated but never judged.
[[nodiscard]] StiffnessPair CompareStiffnessPair(const StiffnessWitness& measured,
                                                 const StiffnessWitness& truth);

/// C F for each load; empty where C does not exist.
[[nodiscard]] std::vector<Vec6> Displacements(const StiffnessResult& result,
                                              const std::vector<Vec6>& loads);

}  // namespace mbv
