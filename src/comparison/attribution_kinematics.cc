// Attribution by motion, before any force is looked at.
//
// In task space the drive motion comes from one witness, the driver, and the simulation follows it:
// their agreement on drive motion says nothing. What says something is where the simulated
// mechanism goes: its output, with rates and accelerations, comes from MuJoCo's kinematics alone
// and is held against the command. With a second opinion on the drive motion:
//
//   opinions differ   simulation meets the command   wrong is
//   yes               no                             the driver
//   yes               yes                            the second opinion
//   no                no                             the simulated model
#include <fmt/format.h>

#include "comparison/attribution_parts.h"

namespace mbv::internal {
namespace {

// Computations whose own motion can be wrong.
constexpr const Role* kComputed[] = {&role::kAnalytic, &role::kReference, &role::kSolver};
// The generic ones before a paper's: a table does not follow another motion by one equation.
constexpr const Role* kGenericFirst[] = {&role::kReference, &role::kAnalytic, &role::kSolver};

constexpr Metric kCommandMetrics[] = {Metric::kCommandM, Metric::kCommandRad,
                                      Metric::kCommandVelocity, Metric::kCommandAcceleration};
constexpr Metric kMotionMetrics[] = {Metric::kPositionM, Metric::kPositionRad, Metric::kVelocity,
                                     Metric::kAcceleration};

// The first failed check of some metrics: positions before rates before accelerations.
template <size_t n>
const CheckResult* FirstFailed(const Comparison& comparison, const std::string& subject,
                               const Metric (&metrics)[n]) {
  for (const Metric metric : metrics) {
    const CheckResult* check = comparison.FindCheck(subject + "." + RowOf(metric).key);
    if (Failed(check)) return check;
  }
  return nullptr;
}

const char* CommandedNoun(Metric metric) {
  if (metric == Metric::kCommandVelocity) return "commanded velocity";
  return metric == Metric::kCommandAcceleration ? "commanded acceleration" : "commanded motion";
}

const char* DriveNoun(Metric metric) {
  if (metric == Metric::kVelocity) return "drive velocities";
  return metric == Metric::kAcceleration ? "drive accelerations" : "drive positions";
}

// "misses the commanded motion by 0.001 m at plate.x, t = 0.3 s"
std::string MissText(const CheckResult& check) {
  return fmt::format("misses the {} by {} at {}", CommandedNoun(check.metric), AmountOf(check),
                     Place(check.channel, check.time_s));
}

Attribution ByDerivatives(const Comparison& comparison) {
  for (const Role* role : kComputed) {
    const char* name = role->name;
    const CheckResult* check = comparison.FindCheck(*role, Metric::kDerivatives);
    if (!Failed(check)) continue;
    return {name, fmt::format("{}: its drive rates are not the time derivatives of its drive "
                              "positions; they differ by {} at {}",
                              name, AmountOf(*check), Place(check->channel, check->time_s))};
  }
  return {};
}

// A computation that does not do what is commanded, whatever the simulation does.
Attribution ByOwnCommand(const Comparison& comparison) {
  for (const Role* role : kGenericFirst) {
    const char* name = role->name;
    const CheckResult* check = FirstFailed(comparison, name, kCommandMetrics);
    if (check == nullptr) continue;
    if (comparison.table && role == &role::kReference) {
      return {name, fmt::format("the table {} does not follow the commanded motion: {} off at {}; "
                                "does it belong to another motion?",
                                comparison.table->name, AmountOf(*check),
                                Place(check->channel, check->time_s))};
    }
    return {name, fmt::format("the {} {}", name, MissText(*check))};
  }
  return {};
}

// The second opinion on the drive motion, against the driver's.
struct Opinions {
  std::string driver, other;
  const PairComparison* pair = nullptr;  ///< null: there is only one
  const CheckResult* differ = nullptr;   ///< first of the motion checks that fails
};

Opinions OpinionsOf(const ComparisonInput& input, const Comparison& comparison) {
  Opinions opinions{.driver = input.driven_by, .other = role::kReference.name};
  if (opinions.driver == opinions.other) return opinions;
  const PairComparison* pair = comparison.FindPair(PairName(opinions.other, opinions.driver));
  if (pair == nullptr || !pair->compared) return opinions;
  // A table of forces alone has no opinion on motion.
  bool any = false;
  for (const Metric metric : kMotionMetrics) any = any || pair->metrics.contains(metric);
  if (!any) return opinions;
  opinions.pair = pair;
  opinions.differ = FirstFailed(comparison, pair->name(), kMotionMetrics);
  return opinions;
}

// The simulated output is judged against a command that it does not merely follow.
bool JudgesMotion(const Comparison& comparison, Metric motion) {
  const auto judged = [&](Metric metric) {
    const CheckResult* check = comparison.FindCheck(role::kSimulated, metric);
    return check != nullptr && check->limit && !check->follows;
  };
  if (motion == Metric::kVelocity) return judged(Metric::kCommandVelocity);
  if (motion == Metric::kAcceleration) return judged(Metric::kCommandAcceleration);
  return judged(Metric::kCommandM) || judged(Metric::kCommandRad);
}

std::string OtherText(const Comparison& comparison, const Opinions& opinions) {
  const bool table = comparison.table && opinions.other == role::kReference;
  const std::string who =
      table ? NameOf(comparison, opinions.other) + " gives"
            : "the " + NameOf(comparison, opinions.other) + ", which meets the command, needs";
  return fmt::format("{} {} that differ by {} (worst at {})", who,
                     DriveNoun(opinions.differ->metric), AmountOf(*opinions.differ),
                     Place(opinions.differ->channel, opinions.differ->time_s));
}

// The opinions differ, and the simulation meets the command with the driver's.
Attribution OtherIsWrong(const Comparison& comparison, const Opinions& opinions) {
  const CheckResult& differ = *opinions.differ;
  const std::string text = fmt::format(
      "under the {} drive motion the simulation meets the command; {}{}'s {} differ from it by {} "
      "(worst at {})",
      opinions.driver, comparison.table ? "" : "the ", NameOf(comparison, opinions.other),
      DriveNoun(differ.metric), AmountOf(differ), Place(differ.channel, differ.time_s));
  const bool position =
      differ.metric == Metric::kPositionM || differ.metric == Metric::kPositionRad;
  if (position && !comparison.table) {
    return {"", text + " and meet it too: two assemblies of the same mechanism"};
  }
  return {opinions.other, text};
}

}  // namespace

Attribution AttributeByKinematics(const ComparisonInput& input, const Comparison& comparison) {
  if (Attribution found = ByDerivatives(comparison); !found.text.empty()) return found;
  if (Attribution found = ByOwnCommand(comparison); !found.text.empty()) return found;
  const CheckResult* miss = FirstFailed(comparison, role::kSimulated.name, kCommandMetrics);
  if (input.motion->free()) {
    return miss == nullptr ? Attribution{}
                           : Attribution{miss->subject, "the simulation " + MissText(*miss)};
  }
  const Opinions opinions = OpinionsOf(input, comparison);
  if (miss == nullptr) {
    const bool told =
        opinions.differ != nullptr && JudgesMotion(comparison, opinions.differ->metric);
    return told ? OtherIsWrong(comparison, opinions) : Attribution{};
  }
  if (opinions.pair == nullptr) {
    return {"", fmt::format("the simulation, driven by the {} drive motion, {}; either that drive "
                            "motion or the simulated model is wrong, and there is no third "
                            "witness to tell",
                            input.driven_by, MissText(*miss))};
  }
  if (opinions.differ == nullptr) {
    return {miss->subject,
            fmt::format("{} and {} agree on the drive motion, but under it the "
                        "simulation {}",
                        opinions.driver, NameOf(comparison, opinions.other), MissText(*miss))};
  }
  return {opinions.driver,
          fmt::format("under the {} drive motion the simulation {}; {}", opinions.driver,
                      MissText(*miss), OtherText(comparison, opinions))};
}

}  // namespace mbv::internal
