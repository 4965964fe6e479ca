// The stiffness of a mechanism at a pose as witnesses hand it to the comparison, and how far two of
// them are from each other.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "comparison/comparison.h"
#include "math/stiffness.h"

namespace mbv {

/// One computation's part.
struct StiffnessWitness {
  std::string name;  ///< of its role (base/roles.h); "printed" for the paper's own
  StiffnessResult result = {};
  std::vector<Vec6> displacements =
      {};                  ///< [Δγ; Δε] per load; empty if K is singular or none is given
  double residual = kNan;  ///< simulation only
  double extrapolation_error = kNan;   ///< simulation only
  WitnessGap gap = WitnessGap::kNone;  ///< why the scenario's closed form has no result

  /// A singular stiffness is compared, too.
  [[nodiscard]] bool ran() const { return result.K.allFinite(); }
};
/// As the comparison takes it; refers to it.
[[nodiscard]] inline Witness AsWitness(const StiffnessWitness& witness) {
  return {.name = witness.name,
          .summary = witness.result.summary,
          .gap = witness.gap,
          .stiffness = &witness};
}

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

/// Every entry of measured − truth.
struct StiffnessDifference {
  Mat6 K = Mat6::Constant(kNan);    ///< ΔK_ij / sqrt(K_ii K_jj)
  Mat6 C = Mat6::Constant(kNan);    ///< the same of C; NaN where one of the two has none
  std::optional<LoadErrors> loads;  ///< empty where one of the two gives no displacements
};
[[nodiscard]] StiffnessDifference DifferenceOf(const StiffnessWitness& measured,
                                               const StiffnessWitness& truth);

/// The metrics of two witnesses of a stiffness; not compared, with the reason, where one did not
/// run.
[[nodiscard]] PairComparison CompareStiffnesses(const Witness& measured, const Witness& truth);

/// What one stiffness shows by itself; `simulated`: with what only a simulation has.
[[nodiscard]] std::map<Metric, Measured> MeasureStiffness(const StiffnessWitness& stiffness,
                                                          bool simulated);

/// C F for each load; empty where C does not exist.
[[nodiscard]] std::vector<Vec6> Displacements(const StiffnessResult& result,
                                              const std::vector<Vec6>& loads);

/// "rx", "ry", "rz", "x", "y", "z": names of the rows of K and C.
[[nodiscard]] const char* AxisName(int row);

}  // namespace mbv
