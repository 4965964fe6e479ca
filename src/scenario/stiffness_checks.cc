#include "scenario/stiffness_checks.h"

#include "core/demand.h"

namespace mbv {
namespace {

// Two linear computations differ by rounding only. The simulated stiffness is extrapolated to zero
// load; its finite displacements also contain the geometric non-linearity of the load itself.
constexpr StiffnessMetricRow kStiffnessRows[] = {
    {StiffnessMetric::kStiffnessEntry,
     "stiffness_entry",
     "stiffness, worst entry",
     true,
     {1e-4, 1e-9}},
    {StiffnessMetric::kComplianceEntry,
     "compliance_entry",
     "compliance, worst entry",
     true,
     {1e-4, 1e-9}},
    {StiffnessMetric::kShareEntry,
     "share_entry",
     "elements' shares, worst entry",
     true,
     {1e-4, 1e-9}},
    {StiffnessMetric::kDisplacementAxis,
     "displacement_axis",
     "displacement, worst axis",
     true,
     {1e-2, 1e-9}},
    {StiffnessMetric::kDisplacementVector,
     "displacement_vector",
     "displacement, worst vector",
     true,
     {1e-2, 1e-9}},
    {StiffnessMetric::kRotationAxis, "rotation_axis", "rotation, worst axis", true, {1e-2, 1e-9}},
    {StiffnessMetric::kSymmetry, "symmetry", "symmetry", false, {1e-6, 1e-9}},
    {StiffnessMetric::kDefinite, "definite", "no negative stiffness", false, {1e-6, 1e-9}},
    {StiffnessMetric::kSharesSum, "shares_sum", "shares add up", false, {1e-6, 1e-9}},
    {StiffnessMetric::kResidual, "residual", "equilibrium, unbalanced force", false, {1e-8, 1e-8}},
    {StiffnessMetric::kExtrapolation,
     "extrapolation",
     "extrapolation to zero load",
     false,
     {1e-5, 1e-5}},
};
static_assert(std::size(kStiffnessRows) == kStiffnessMetrics);

}  // namespace

std::span<const StiffnessMetricRow> StiffnessMetricRows() { return kStiffnessRows; }

const StiffnessMetricRow& RowOf(StiffnessMetric metric) {
  const StiffnessMetricRow& row = kStiffnessRows[static_cast<int>(metric)];
  MBV_DEMAND(row.metric == metric, row.key);
  return row;
}

const StiffnessMetricRow* FindStiffnessMetric(const std::string& key) {
  for (const StiffnessMetricRow& row : kStiffnessRows) {
    if (key == row.key) return &row;
  }
  return nullptr;
}

StiffnessLimits::StiffnessLimits() {
  for (const StiffnessMetricRow& row : kStiffnessRows) (*this)[row.metric] = row.limit;
}

}  // namespace mbv
