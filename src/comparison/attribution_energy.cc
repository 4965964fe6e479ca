// Attribution by energy: a witness that integrates its motion with too coarse a step gains or loses
// energy, although its forces and accelerations fit at every single instant.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/attribution_parts.h"

namespace mbv::internal {
namespace {

// Order in the step of the simulation's integration.
constexpr double kOrder = 4.0;

// The energy check of a witness, if it is judged.
const CheckResult* EnergyCheck(const Comparison& comparison, const std::string& witness) {
  const CheckResult* check = comparison.FindCheck(witness + "." + RowOf(Metric::kEnergy).key);
  return check != nullptr && check->limit ? check : nullptr;
}

// Forces and accelerations that do not fit at an instant are no matter of the step.
bool IsOfTheStep(const Comparison& comparison, const CheckResult& drift) {
  const Role* role = FindRole(drift.subject);
  return role != nullptr && role->is_engine() &&
         !Failed(comparison.FindCheck(*role, Metric::kPower));
}

// "power balances at every sample, so simulation.step_s is too coarse: try a step about 3 times
// smaller"
std::string StepText(const CheckResult& drift) {
  std::string text = "power balances at every sample, so simulation.step_s is too coarse";
  const double smaller = std::ceil(std::pow(drift.value / *drift.limit, 1.0 / kOrder));
  if (std::isfinite(smaller)) {
    text += fmt::format(": try a step about {:.0f} times smaller", std::max(2.0, smaller));
  }
  return text;
}

}  // namespace

Attribution AttributeByEnergy(const Comparison& comparison, const PairComparison& pair) {
  const CheckResult* a = EnergyCheck(comparison, pair.measured);
  const CheckResult* b = EnergyCheck(comparison, pair.truth);
  if (a == nullptr || b == nullptr || Failed(a) == Failed(b)) return {};
  const CheckResult& bad = Failed(a) ? *a : *b;
  const CheckResult& good = Failed(a) ? *b : *a;
  std::string text = fmt::format(
      "the energy of the {} drifts by {:.1e} of what is turned over, that of the {} by {:.1e}",
      NameOf(comparison, bad.subject), bad.value, NameOf(comparison, good.subject), good.value);
  if (IsOfTheStep(comparison, bad)) text += "; " + StepText(bad);
  return {bad.subject, text};
}

std::string EnergyHint(const Comparison& comparison) {
  const CheckResult* drift = EnergyCheck(comparison, role::kSimulated.name);
  if (!Failed(drift) || !IsOfTheStep(comparison, *drift)) return "";
  return fmt::format("; the simulated energy drifts by {:.1e} of what is turned over and {}",
                     drift->value, StepText(*drift));
}

}  // namespace mbv::internal
