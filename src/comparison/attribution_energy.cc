// Attribution by energy: a witness that integrates its motion with too coarse a step gains or loses
// energy, although its forces and accelerations fit at every single instant.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "comparison/attribution_parts.h"
#include "mechanism/reach.h"

namespace mbv::internal {
namespace {

// Order in the step of the simulation's integration.
constexpr double kOrder = 4.0;

// The energy check of a witness, if it is judged.
const CheckResult* EnergyCheck(const Comparison& comparison, const std::string& witness) {
  const CheckResult* check = comparison.FindCheck(witness + "." + RowOf(Metric::kEnergy).key);
  return check != nullptr && check->limit ? check : nullptr;
}

// Power that is wrong by some share loses at most that share of the energy; of a drift that is this
// much larger it is no cause. Coarse steps leave the loops open, which costs some power, too.
constexpr double kNoCause = 0.3;

// The power check of the witness, if what power is off by does not explain the drift; forces and
// accelerations that do not fit at an instant are no matter of the step.
const CheckResult* PowerBesideTheStep(const Comparison& comparison, const CheckResult& drift) {
  const Role* role = FindRole(drift.subject);
  if (role == nullptr || !role->is_engine()) return nullptr;
  const CheckResult* power = comparison.FindCheck(*role, Metric::kPower);
  if (power == nullptr || !(power->value <= kNoCause * drift.value)) return nullptr;
  return power;
}

// "a step about 3 times smaller"; the drift falls with the step's order.
std::string SmallerStep(const CheckResult& drift) {
  const double times = std::ceil(std::pow(drift.value / *drift.limit, 1.0 / kOrder));
  if (!std::isfinite(times)) return "a much smaller step";
  return fmt::format("a step about {:.0f} times smaller", std::max(2.0, times));
}

// "power balances at every sample, so simulation.step_s is too coarse: try a step about 3 times
// smaller"
std::string StepText(const CheckResult& power, const CheckResult& drift) {
  return fmt::format("power balances {}at every sample, so simulation.step_s is too coarse: try {}",
                     Failed(&power) ? fmt::format("to {:.1e} ", power.value) : "",
                     SmallerStep(drift));
}

}  // namespace

namespace {

// An error of the integration shifts a motion by more than the energy that it costs, but not by
// thousands of times as much.
bool DriftExplains(const ComparisonInput& input, const CheckResult& drift,
                   const CheckResult& differ) {
  constexpr double kMost = 1e3;
  const double size =
      std::string(RowOf(differ.metric).unit) == "m" ? CharacteristicLength(*input.mechanism) : 1.0;
  return !(differ.value > kMost * drift.value * size);
}

}  // namespace

Attribution AttributeByEnergy(const ComparisonInput& input, const Comparison& comparison,
                              const PairComparison& pair, const CheckResult& differ) {
  const CheckResult* a = EnergyCheck(comparison, pair.measured);
  const CheckResult* b = EnergyCheck(comparison, pair.truth);
  if (a == nullptr || b == nullptr || Failed(a) == Failed(b)) return {};
  const CheckResult& bad = Failed(a) ? *a : *b;
  const CheckResult& good = Failed(a) ? *b : *a;
  std::string text = fmt::format(
      "the energy of the {} drifts by {:.1e} of what is turned over, that of the {} by {:.1e}",
      NameOf(comparison, bad.subject), bad.value, NameOf(comparison, good.subject), good.value);
  if (const CheckResult* power = PowerBesideTheStep(comparison, bad)) {
    text += "; " + StepText(*power, bad);
  }
  if (!DriftExplains(input, bad, differ)) {
    return {"", text +
                    "; this is too little to explain the difference: a third witness would tell "
                    "which one is wrong"};
  }
  return {bad.subject, text};
}

std::string EnergyHint(const Comparison& comparison) {
  const CheckResult* drift = EnergyCheck(comparison, role::kSimulated.name);
  if (!Failed(drift)) return "";
  const std::string drifts =
      fmt::format("; the simulated energy drifts by {:.1e} of what is turned over", drift->value);
  if (const CheckResult* power = PowerBesideTheStep(comparison, *drift)) {
    return drifts + " and " + StepText(*power, *drift);
  }
  return fmt::format("{}: {} would tell whether simulation.step_s is too coarse", drifts,
                     SmallerStep(*drift));
}

}  // namespace mbv::internal
