// The checks of a stiffness scenario: what is judged and how good it must be.
//
//   checks: {stiffness_entry: 1e-5}             simulation against another computation
//           {reference_stiffness_entry: 1e-10}  frame elements against closed form
//           {displacement_axis: null}           switched off, and reported as such
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>

namespace mbv {

/// A judged quantity. Those of a pair compare two witnesses; the others need one only. Entries are
/// compared in units of sqrt(K_ii K_jj): that number does not change with the units of length and
/// angle, and is the relative error for i = j.
enum class StiffnessMetric {
  kStiffnessEntry,    ///< pair: max |ΔK_ij| / sqrt(K_ii K_jj)
  kComplianceEntry,   ///< pair: max |ΔC_ij| / sqrt(C_ii C_jj)
  kShareEntry,        ///< pair: the same for each element's share of C, in units of the whole C
  kDisplacementAxis,  ///< pair: max error of Δx, Δy, Δz over the loads / max |Δ| of that axis
  kDisplacementVector,  ///< pair: max over the loads of |error of (Δx, Δy, Δz)| / |(Δx, Δy, Δz)|
  kRotationAxis,        ///< pair: as displacement_axis, for the rotation vector
  kSymmetry,            ///< |K_ij − K_ji| / sqrt(K_ii K_jj)
  kDefinite,            ///< how far the scaled K's smallest eigenvalue is below zero
  kSharesSum,           ///< elements' shares add up to C
  kResidual,            ///< unbalanced force of the equilibria, over the load
  kExtrapolation,       ///< error of the extrapolation to zero load
};
inline constexpr int kStiffnessMetrics = 11;

/// Limits of one metric; an empty one is switched off.
struct StiffnessLimit {
  std::optional<double> simulated;  ///< a simulation takes part
  std::optional<double> computed;   ///< closed form and frame elements only
};

struct StiffnessMetricRow {
  StiffnessMetric metric;
  const char* key;       ///< in `checks:` and in check names
  const char* title;     ///< for people
  bool of_pair;          ///< compares two witnesses
  StiffnessLimit limit;  ///< defaults
};

[[nodiscard]] std::span<const StiffnessMetricRow> StiffnessMetricRows();
[[nodiscard]] const StiffnessMetricRow& RowOf(StiffnessMetric metric);
[[nodiscard]] const StiffnessMetricRow* FindStiffnessMetric(const std::string& key);

/// All limits of a scenario, starting from the defaults.
struct StiffnessLimits {
  StiffnessLimits();
  std::array<StiffnessLimit, kStiffnessMetrics> of;

  [[nodiscard]] const StiffnessLimit& operator[](StiffnessMetric m) const {
    return of[static_cast<size_t>(m)];
  }
  [[nodiscard]] StiffnessLimit& operator[](StiffnessMetric m) { return of[static_cast<size_t>(m)]; }
};

}  // namespace mbv
