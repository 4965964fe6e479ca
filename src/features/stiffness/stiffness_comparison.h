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
#include "features/stiffness/stiffness_scenario.h"
#include "math/stiffness.h"

namespace mbv {

/// One computation's part.
struct StiffnessWitness {
  std::string name;  ///< of its role (base/roles.h); "printed" for the paper's own
  StiffnessResult result;
  std::vector<Vec6> displacements;  ///< [Δγ; Δε] per load; empty if K is singular or none is given
  double residual = kNan;           ///< simulation only
  double extrapolation_error = kNan;   ///< simulation only
  WitnessGap gap = WitnessGap::kNone;  ///< why the scenario's closed form has no result

  [[nodiscard]] bool ran() const { return result.K.allFinite(); }
};

struct StiffnessInput {
  StiffnessLimits limits;
  std::vector<Vec6> loads;
  std::vector<StiffnessWitness> witnesses;  ///< in the order analytic, reference, simulated
  std::vector<std::string> left_out = {};   ///< what a robot's file has and the model has not
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
  std::vector<Caveat> caveats;
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

// What one stiffness shows a designer: its weakest directions, what each element contributes to the
// compliance, and indices that every mechanism has.

/// The unit direction of a pure force (or moment) under which the output yields most along it, and
/// the stiffness against it; world axes.
struct WeakDirection {
  Vec3 direction = Vec3::Constant(kNan);
  double stiffness = kNan;  ///< [N/m] or [N m/rad]
};
[[nodiscard]] WeakDirection WeakestTranslation(const Mat6& C);
[[nodiscard]] WeakDirection WeakestRotation(const Mat6& C);

/// The weakest motion of all, rotation and translation together. That needs a length L, by which
/// rotations are made displacements; L = sqrt(tr C_εε / tr C_γγ) makes both count alike, and stays
/// with the mechanism when units change.
struct WeakScrew {
  double length_m = kNan;             ///< L
  double stiffness = kNan;            ///< [N/m]
  Vec6 twist = Vec6::Constant(kNan);  ///< [γ; ε], world, of the output's origin; |[Lγ; ε]| = 1
  Vec3 axis = Vec3::Constant(kNan);   ///< unit direction of the screw (of ε if it does not turn)
  Vec3 point = Vec3::Constant(kNan);  ///< of the axis nearest to the output's origin [m]
  double pitch_m = kNan;              ///< displacement along the axis per radian; infinite without
                                      ///< rotation
};
[[nodiscard]] WeakScrew WeakestScrew(const Mat6& C, double length_m = kNan);  ///< NaN: the above L

/// Parts of the compliance that one element causes; each column adds up to 1 over the elements.
struct Contribution {
  std::string element;
  double translation = kNan, rotation = kNan;  ///< in the weakest directions
  Vec6 axis = Vec6::Constant(kNan);            ///< of C_ii, order [rotations; translations]
};
/// Largest in the weakest translation first. Empty without shares or a compliance.
[[nodiscard]] std::vector<Contribution> Contributions(const StiffnessResult& result);

struct NamedIndex {
  std::string name, unit, meaning;
  double value = kNan;
};
/// Indices of any stiffness: weakest and largest principal stiffnesses, condition number.
[[nodiscard]] std::vector<NamedIndex> GeneralIndices(const StiffnessResult& result);

/// "rx", "ry", "rz", "x", "y", "z": names of the rows of K and C.
[[nodiscard]] const char* AxisName(int row);
/// Rows of a wrench: moments first.
inline constexpr const char* kWrenchNames[] = {"mx", "my", "mz", "fx", "fy", "fz"};
/// Unit of an entry of K ("N m/rad", "N/rad", "N m/m", "N/m") and of C.
[[nodiscard]] const char* StiffnessUnit(int row, int column);
[[nodiscard]] const char* ComplianceUnit(int row, int column);

}  // namespace mbv
