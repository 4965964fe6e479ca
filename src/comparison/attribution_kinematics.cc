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

#include <algorithm>
#include <cmath>

#include "comparison/attribution_parts.h"
#include "comparison/driven.h"
#include "mechanism/reach.h"

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

// What a command goes through, least to most.
double SpanOf(const Motion& motion, const std::string& command_name) {
  double least = kNan, most = kNan;
  for (const Command& command : motion.commands) {
    if (command.name != command_name) continue;
    for (const double t_s : SampleTimes(motion.duration_s, motion.sample_s)) {
      const double value = Evaluate(command.profile, t_s).value;
      least = std::fmin(least, value);
      most = std::fmax(most, value);
    }
  }
  return most - least;
}

std::string TableMissText(const ComparisonInput& input, const Comparison& comparison,
                          const CheckResult& check) {
  // Less than this share of the way is a scale, a rounding or a delay of the same motion.
  constexpr double kAnotherMotion = 0.1;
  const bool another = (check.metric == Metric::kCommandM || check.metric == Metric::kCommandRad) &&
                       !(check.value <= kAnotherMotion * SpanOf(*input.motion, check.channel));
  return fmt::format("the table {} does not follow the commanded motion: {} off at {}{}",
                     comparison.table->name, AmountOf(check), Place(check.channel, check.time_s),
                     another ? "; does it belong to another motion?" : "");
}

// Computations that do not do what is commanded, whatever the simulation does. Where all of them
// miss alike, they agree with each other, and none is wrong alone.
Attribution ByOwnCommand(const ComparisonInput& input, const Comparison& comparison) {
  constexpr double kAlike = 10.0;
  std::vector<const CheckResult*> missed;
  std::string names;
  size_t judged = 0;
  for (const Role* role : kGenericFirst) {
    const bool any = std::any_of(
        comparison.checks.begin(), comparison.checks.end(),
        [&](const CheckResult& c) { return c.subject == *role && c.limit && IsCommand(c.metric); });
    judged += any ? 1 : 0;
    const CheckResult* check = FirstFailed(comparison, role->name, kCommandMetrics);
    if (check == nullptr) continue;
    missed.push_back(check);
    names += (names.empty() ? "" : " and ") + NameOf(comparison, role->name);
  }
  if (missed.empty()) return {};
  const CheckResult& first = *missed.front();
  const bool alike = std::all_of(missed.begin(), missed.end(), [&](const CheckResult* check) {
    return check->metric == first.metric && check->value <= kAlike * first.value &&
           first.value <= kAlike * check->value;
  });
  if (judged > 1 && missed.size() == judged && alike) {
    return {"",
            fmt::format("{} agree with each other that the mechanism {}", names, MissText(first))};
  }
  if (comparison.table && first.subject == role::kReference) {
    return {first.subject, TableMissText(input, comparison, first)};
  }
  return {first.subject, fmt::format("the {} {}", first.subject, MissText(first))};
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

// A difference of positions that is nothing beside the miss is not its cause. Rates are measured
// relative to scales of their own.
bool Explains(const Opinions& opinions, const CheckResult& miss) {
  constexpr double kNothing = 1e-3;
  const CheckResult* differ = opinions.differ;
  if (differ == nullptr) return false;
  const auto is_length = [](Metric metric) { return std::string(RowOf(metric).unit) == "m"; };
  const bool alike = is_length(differ->metric) && is_length(miss.metric);
  return !alike || !(differ->value < kNothing * miss.value);
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

// The opinions differ, and the simulation meets the command with the driver's. Another assembly
// meets the command, too, with drive positions far away; with ones nearby only close to a
// singularity.
Attribution OtherIsWrong(const ComparisonInput& input, const Comparison& comparison,
                         const Opinions& opinions) {
  constexpr double kAnotherAssembly = 0.05;  // of the characteristic length, or rad
  const CheckResult& differ = *opinions.differ;
  const std::string text = fmt::format(
      "under the {} drive motion the simulation meets the command; {}{}'s {} differ from it by {} "
      "(worst at {})",
      opinions.driver, comparison.table ? "" : "the ", NameOf(comparison, opinions.other),
      DriveNoun(differ.metric), AmountOf(differ), Place(differ.channel, differ.time_s));
  const bool position =
      differ.metric == Metric::kPositionM || differ.metric == Metric::kPositionRad;
  const double size =
      differ.metric == Metric::kPositionM ? CharacteristicLength(*input.mechanism) : 1.0;
  if (position && !comparison.table && !(differ.value <= kAnotherAssembly * size)) {
    return {"",
            text + " and meet it too: another assembly of the same mechanism, or wrong lengths"};
  }
  return {opinions.other, text};
}

}  // namespace

Attribution AttributeByOwnMotion(const ComparisonInput& input, const Comparison& comparison) {
  Attribution found = ByDerivatives(comparison);
  return found.text.empty() ? ByOwnCommand(input, comparison) : found;
}

Attribution AttributeByKinematics(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* miss = FirstFailed(comparison, role::kSimulated.name, kCommandMetrics);
  if (input.motion->free()) {
    return miss == nullptr ? Attribution{}
                           : Attribution{miss->subject, "the simulation " + MissText(*miss)};
  }
  const Opinions opinions = OpinionsOf(input, comparison);
  if (miss == nullptr) {
    const bool judged =
        opinions.differ != nullptr && JudgesMotion(comparison, opinions.differ->metric);
    return judged ? OtherIsWrong(input, comparison, opinions) : Attribution{};
  }
  if (opinions.pair == nullptr) {
    return {"", fmt::format("the simulation, driven by the {} drive motion, {}; either that drive "
                            "motion or the simulated model is wrong, and there is no third "
                            "witness to tell",
                            input.driven_by, MissText(*miss))};
  }
  if (!Explains(opinions, *miss)) {
    return {miss->subject,
            fmt::format("{} and {} agree on the drive motion{}, but under it the simulation {}",
                        opinions.driver, NameOf(comparison, opinions.other),
                        opinions.differ == nullptr ? "" : " to " + AmountOf(*opinions.differ),
                        MissText(*miss))};
  }
  return {opinions.driver,
          fmt::format("under the {} drive motion the simulation {}; {}", opinions.driver,
                      MissText(*miss), OtherText(comparison, opinions))};
}

}  // namespace mbv::internal
