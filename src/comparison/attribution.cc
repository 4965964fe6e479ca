// Which witness is the odd one out, and what the difference looks like.
//
// Evidence is taken in this order:
//   1. what a witness shows by itself: rates that are no derivatives, its own command missed
//      (attribution_kinematics.cc);
//   2. where forces or servos move the simulation: whether it confirms the forces (driven.cc);
//      elsewhere motion: drive motion that goes elsewhere than commanded. Wrong motion makes wrong
//      forces, so it is looked at before them;
//   3. the two that are closest by far stand against the third;
//   4. of two that differ, the one whose own energy drifts (attribution_energy.cc).
// That two agree against a third is a fact. That the third is wrong follows only if the two are
// independent of each other in what they agree on; SharedBy() says what they may have in common.

#include "comparison/attribution.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>

#include "comparison/comparison.h"
#include "comparison/driven.h"
#include "comparison/metrics.h"
#include "comparison/table_tube.h"
#include "comparison/verdict.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

using internal::Amount;
using internal::AmountOf;
using internal::ChannelAndTime;
using internal::Failed;
using internal::NameOf;

// What the force of the worst drive looks like: opposite sign or a constant factor. A force that
// hardly varies has a constant ratio to anything, so a factor that no unit explains must explain
// the difference better than a constant that is added.
std::string Hint(const PairComparison& pair, const Measured& worst) {
  constexpr double kLooksConstant = 1e-3;
  constexpr double kVaries = 1e-2;  // by ten times what a factor may leave
  const auto drive =
      std::find_if(pair.drives.begin(), pair.drives.end(), [&](const DriveMetrics& one) {
        return ChannelName(Quantity::kForce, one.drive) == worst.channel;
      });
  if (drive == pair.drives.end()) return "";
  if (!(drive->factor_residual < kLooksConstant * std::abs(drive->factor - 1.0))) return "";
  if (std::abs(drive->factor + 1.0) < kLooksConstant) {
    return fmt::format("; {} has the opposite sign throughout", drive->drive);
  }
  const KnownFactor* known = FindFactor(drive->factor);
  const bool varies = drive->offset_residual > kVaries * std::abs(drive->factor - 1.0);
  if (known == nullptr && !varies) return "";
  return fmt::format(
      "; the ratio at {} is constant ({:.6g}){}", drive->drive, drive->factor,
      known == nullptr ? ": a factor or a mass?" : std::string(", near ") + known->text);
}

// The metric to judge three pairs by: forces if they fail, else what fails worst.
const CheckResult* WorstPairCheck(const Comparison& comparison) {
  const CheckResult* worst = nullptr;
  double worst_ratio = -1.0;
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || !RowOf(check.metric).of_pair) continue;
    const bool force = IsDriveForce(check.metric);
    double ratio = std::isnan(check.value) ? 1e300 : check.value / *check.limit;
    if (force) ratio += 1e301;
    if (ratio > worst_ratio) {
      worst = &check;
      worst_ratio = ratio;
    }
  }
  return worst;
}

// What a failed check of a pair is measured by in all pairs.
struct Yardstick {
  std::string title;  // "drive force, RMS"
  std::string unit;   // "" for a ratio
  Metric metric = Metric::kForceNrmse;
  std::string column = {};  // of a table; "" measures the metric itself
};

struct Distance : PairDistance {
  Distance(const PairComparison& of, Measured by)
      : PairDistance{of.measured, of.truth, by.value}, pair(&of), where(std::move(by)) {}

  const PairComparison* pair;
  Measured where;
};

const Trace* TraceOf(const ComparisonInput& input, const std::string& witness) {
  for (const Witness& w : input.witnesses) {
    if (w.name == witness && w.trace != nullptr && w.summary.ok()) return w.trace;
  }
  return nullptr;
}

// RMS difference of one signal in two traces [unit].
std::optional<Measured> SignalDistance(const ComparisonInput& input, const PairComparison& pair,
                                       const std::string& channel) {
  const Trace* a = TraceOf(input, pair.measured);
  const Trace* b = TraceOf(input, pair.truth);
  if (a == nullptr || b == nullptr) return {};
  const int i = a->Find(channel), j = b->Find(channel);
  if (i < 0 || j < 0) return {};
  const bool angle = a->channels[static_cast<size_t>(i)].unit == "rad";
  ErrorSum sum;
  for (const auto& [k, l] : AlignSamples(*a, *b)) {
    const double time_s = a->time_s[static_cast<size_t>(k)];
    if (time_s < input.start_window_s) continue;
    const double x = a->values(k, i), y = b->values(l, j);
    sum.Add(angle ? AngleDifference(x, y) : x - y, y, time_s, channel);
  }
  if (sum.count() == 0) return {};
  return Measured{sum.rms_error(), sum.worst_time_s(), channel};
}

// The compared pairs by increasing distance; NaN counts as farthest.
std::vector<Distance> Distances(const ComparisonInput& input, const Comparison& comparison,
                                const Yardstick& yardstick) {
  std::vector<Distance> distances;
  for (const PairComparison& pair : comparison.pairs) {
    if (!yardstick.column.empty()) {
      const auto distance = SignalDistance(input, pair, yardstick.column);
      if (distance) distances.emplace_back(pair, *distance);
      continue;
    }
    const auto found = pair.metrics.find(yardstick.metric);
    if (pair.compared && found != pair.metrics.end()) distances.emplace_back(pair, found->second);
  }
  SortByDistance(&distances);
  return distances;
}

// A column of a table is measured in its own unit: how often it leaves its tube says nothing about
// two computations that have none.
Yardstick YardstickOf(const ComparisonInput& input, const CheckResult& check) {
  Yardstick yardstick{
      .title = RowOf(check.metric).title, .unit = RowOf(check.metric).unit, .metric = check.metric};
  if (check.metric != Metric::kTableTube || input.table == nullptr) return yardstick;
  const int column = input.table->trace.Find(check.channel);
  if (column < 0) return yardstick;
  yardstick.column = check.channel;
  yardstick.unit = input.table->trace.channels[static_cast<size_t>(column)].unit;
  yardstick.title = check.channel + ", RMS";
  return yardstick;
}

// Why two computations that differ leave open which of them is wrong, or which one it is.
Attribution UndecidedAttribution(const ComparisonInput& input, const Comparison& comparison,
                                 const CheckResult& check, bool third) {
  const PairComparison& pair = *comparison.FindPair(check.subject);
  if (check.follows && IsEngine(pair.measured) && pair.truth == input.driven_by) {
    if (third) return {pair.measured, "the simulation does not follow the motion that it is given"};
    return {"",
            "either the simulation does not follow the motion that it is given, or that motion "
            "contradicts itself"};
  }
  if (!third) {
    Attribution energy = internal::AttributeByEnergy(input, comparison, pair, check);
    if (!energy.text.empty()) return energy;
    return {"", "a third witness would show which one is wrong" + internal::EnergyHint(comparison)};
  }
  return {"", fmt::format("the simulation follows the {} drive motion and cannot show which is "
                          "wrong",
                          input.driven_by)};
}

// Two computations only, or drive motion that one of them took from another.
Attribution TwoDiffer(const ComparisonInput& input, const Comparison& comparison,
                      const CheckResult& check, bool third) {
  const PairComparison& pair = *comparison.FindPair(check.subject);
  const Measured worst{.value = check.value, .time_s = check.time_s, .channel = check.channel};
  Attribution attribution = UndecidedAttribution(input, comparison, check, third);
  attribution.text = fmt::format(
      "{} and {} differ by {} in {}: worst at {}{}; {}", NameOf(comparison, pair.measured),
      NameOf(comparison, pair.truth), AmountOf(check), RowOf(check.metric).title,
      ChannelAndTime(check.channel, check.time_s), Hint(pair, worst), attribution.text);
  return attribution;
}

const Witness* FindWitness(const ComparisonInput& input, const std::string& name) {
  return FindNamed(input.witnesses, name);
}

// "reference and simulation"; "analytic, reference and simulation".
std::string Listed(const Comparison& comparison, const std::vector<std::string>& witnesses) {
  std::string text;
  for (size_t k = 0; k < witnesses.size(); ++k) {
    text += k == 0 ? "" : k + 1 == witnesses.size() ? " and " : ", ";
    text += NameOf(comparison, witnesses[k]);
  }
  return text;
}

// Parameters that the scenario gives all of these and not the odd one: "m_platform = 30.001".
std::string OwnParametersOf(const ComparisonInput& input, const std::vector<std::string>& agree,
                            const std::string& odd) {
  const auto has = [&](const std::string& witness, const std::string& name, double value) {
    const auto own = input.own_parameters.find(witness);
    if (own == input.own_parameters.end()) return false;
    const auto found = own->second.find(name);
    return found != own->second.end() && found->second == value;
  };
  const auto own = input.own_parameters.find(agree.front());
  std::string text;
  if (own == input.own_parameters.end()) return text;
  for (const auto& [name, value] : own->second) {
    const bool all = std::all_of(agree.begin(), agree.end(),
                                 [&, n = name, v = value](const auto& w) { return has(w, n, v); });
    if (!all || has(odd, name, value)) continue;
    text += fmt::format("{}{} = {:.10g}", text.empty() ? "" : ", ", name, value);
  }
  return text;
}

std::string OwnText(const ComparisonInput& input, const Comparison& comparison,
                    const std::vector<std::string>& agree, const std::string& odd) {
  const std::string own = OwnParametersOf(input, agree, odd);
  if (own.empty()) return "";
  return fmt::format("the scenario gives {} {} and {} another value", Listed(comparison, agree),
                     own, NameOf(comparison, odd));
}

// Moves as the drive motion says that the driver computed.
bool FollowsDriver(const ComparisonInput& input, const std::string& name) {
  const Witness* witness = FindWitness(input, name);
  const bool engine = IsEngine(name) && PrescribesMotion(input.mode);
  return name == input.driven_by || engine || (witness != nullptr && witness->foreign);
}

bool Confirms(const CheckResult* check) {
  return check != nullptr && check->limit && check->pass && !check->follows;
}

// Something that does not follow the drive motion has found it right: the command, where MuJoCo's
// kinematics moves the outputs, or the other witness, which has computed it, too.
bool DriveMotionIsConfirmed(const ComparisonInput& input, const Comparison& comparison,
                            const std::string& odd) {
  const auto by_command = [&](Metric metric) {
    return Confirms(comparison.FindCheck(role::kSimulated, metric));
  };
  if ((by_command(Metric::kCommandM) || by_command(Metric::kCommandRad)) &&
      by_command(Metric::kCommandVelocity) && by_command(Metric::kCommandAcceleration)) {
    return true;
  }
  const auto by_other = [&](Metric metric) {
    const char* key = RowOf(metric).key;
    return Confirms(comparison.FindCheck(PairName(odd, input.driven_by) + "." + key)) ||
           Confirms(comparison.FindCheck(PairName(input.driven_by, odd) + "." + key));
  };
  return (by_other(Metric::kPositionM) || by_other(Metric::kPositionRad)) &&
         by_other(Metric::kVelocity) && by_other(Metric::kAcceleration);
}

// What those that agree have in common and the odd one has not; "" where nothing is known that
// would make them agree on something wrong.
std::string SharedBy(const ComparisonInput& input, const Comparison& comparison,
                     const std::vector<std::string>& agree, const std::string& odd) {
  if (std::string own = OwnText(input, comparison, agree, odd); !own.empty()) return own;
  const bool engine = std::any_of(agree.begin(), agree.end(),
                                  [](const std::string& name) { return IsEngine(name); });
  if (input.motion->free()) {
    // A table has a start of its own; all others begin where the generic solver does, which
    // MuJoCo's reading of the start values can confirm.
    const bool confirmed = Confirms(comparison.FindCheck(role::kSimulated, Metric::kCommandM)) ||
                           Confirms(comparison.FindCheck(role::kSimulated, Metric::kCommandRad));
    if (!engine || !IsTable(input, odd) || confirmed) return "";
    return fmt::format("{} start from one state, which the generic solver computes",
                       Listed(comparison, agree));
  }
  if (GivesAllDriveMotion(input)) return "";
  const bool follow = std::all_of(agree.begin(), agree.end(), [&](const std::string& name) {
    return FollowsDriver(input, name);
  });
  if (!follow || DriveMotionIsConfirmed(input, comparison, odd)) return "";
  const Role* driver = FindRole(input.driven_by);
  return fmt::format(
      "{} have the drive motion in common that the {} computes, and nothing else confirms it",
      Listed(comparison, agree), driver == nullptr ? input.driven_by : driver->method);
}

// Names of all that take part, the odd one left out; nearest pair first.
std::vector<std::string> AllBut(const std::string& odd, const std::vector<Distance>& distances) {
  std::vector<std::string> names;
  for (const Distance& d : distances) {
    for (const std::string& name : {d.measured, d.truth}) {
      const bool known = std::find(names.begin(), names.end(), name) != names.end();
      if (name != odd && !known) names.push_back(name);
    }
  }
  return names;
}

// 3. Two against one.
Attribution ByDistance(const ComparisonInput& input, const Comparison& comparison) {
  const CheckResult* check = WorstPairCheck(comparison);
  if (check == nullptr) return {};
  const Yardstick yardstick = YardstickOf(input, *check);
  const auto amount = [&](const Distance& d) { return Amount(d.value, yardstick.unit); };
  const std::vector<Distance> distances = Distances(input, comparison, yardstick);
  const bool followed = IsDriveMotion(check->metric) && !input.motion->free();
  if (distances.size() < 3 || followed) {
    return TwoDiffer(input, comparison, *check, distances.size() >= 3);
  }
  const Distance& near = distances[0];
  const std::string odd = OddOneOut(distances);
  const Distance& far = odd.empty() ? distances[1] : *NearestOf(odd, distances);
  if (odd.empty() && distances.size() > 3) {
    std::string all;
    for (const Distance& d : distances) all += fmt::format(", {} {}", d.pair->name(), amount(d));
    return {"", fmt::format("no witness stands clearly alone ({}{})", yardstick.title, all)};
  }
  if (odd.empty()) {
    return {"", fmt::format("no two witnesses stand clearly against the third: {} {}, {} {}, {} {} "
                            "({})",
                            near.pair->name(), amount(near), far.pair->name(), amount(far),
                            distances[2].pair->name(), amount(distances[2]), yardstick.title)};
  }
  const std::string tube = yardstick.column.empty() ? "" : " (" + AmountOf(*check) + ")";
  const std::vector<std::string> agree = AllBut(odd, distances);
  double agree_to = near.value;
  for (const Distance& d : distances) {
    if (d.measured != odd && d.truth != odd) agree_to = std::max(agree_to, d.value);
  }
  const std::string text = fmt::format(
      "{} agree to {}, {} differs by {} in {}{}: worst at {}{}", Listed(comparison, agree),
      Amount(agree_to, yardstick.unit), NameOf(comparison, odd), amount(far), yardstick.title, tube,
      ChannelAndTime(far.where.channel, far.where.time_s), Hint(*far.pair, far.where));
  const std::string energy = odd == role::kSimulated ? internal::EnergyHint(comparison) : "";
  return {odd, text + energy,
          Attribution::Split{.agree = agree,
                             .agree_to = agree_to,
                             .differs = odd,
                             .differs_by = far.value,
                             .measure = yardstick.title,
                             .unit = yardstick.unit,
                             .shared = SharedBy(input, comparison, agree, odd)}};
}

// 5. A check of one witness alone (loop gap, power) that fails while all pairs agree.
Attribution BySingleCheck(const Comparison& comparison) {
  for (const CheckResult& check : comparison.checks) {
    if (!Failed(&check) || RowOf(check.metric).of_pair) continue;
    if (check.metric == Metric::kMotorUse) {
      return {"", fmt::format("by {}, the motor of {} has a margin of {:.3g} where {:.3g} is "
                              "required: the witnesses do not disagree about that",
                              NameOf(comparison, check.subject), check.channel, 1.0 / check.value,
                              1.0 / *check.limit)};
    }
    const std::string energy =
        check.subject == role::kSimulated ? internal::EnergyHint(comparison) : "";
    const std::string place = ChannelAndTime(check.channel, check.time_s);
    return {check.subject, fmt::format("{}: {} is {}{}{}", NameOf(comparison, check.subject),
                                       RowOf(check.metric).title, AmountOf(check),
                                       place.empty() ? "" : " at ", place) +
                               energy};
  }
  return {};
}

std::string AgreementText(const ComparisonInput& input, const Comparison& comparison) {
  std::string text;
  const auto share_of_limit = [&](Metric metric) {
    double most = -1.0;
    for (const CheckResult& check : comparison.checks) {
      if (check.metric == metric && check.limit) most = std::max(most, check.value / *check.limit);
    }
    return most;
  };
  // A free motion has no drive force to compare: by what is nearest to its limit, as outputs may
  // rest.
  std::array<Metric, 3> motions = {Metric::kPoseM, Metric::kPositionM, Metric::kPositionRad};
  std::ranges::stable_sort(motions, std::greater<>(), share_of_limit);
  for (const Metric metric :
       {Metric::kForceNrmse, Metric::kStiffnessEntry, motions[0], motions[1], motions[2]}) {
    const Yardstick yardstick{.title = "", .unit = RowOf(metric).unit, .metric = metric};
    for (const Distance& distance : Distances(input, comparison, yardstick)) {
      text += fmt::format("{}{} and {} agree to {}", text.empty() ? "" : ", ",
                          NameOf(comparison, distance.pair->measured),
                          NameOf(comparison, distance.pair->truth),
                          Amount(distance.value, yardstick.unit));
    }
    if (!text.empty()) break;
  }
  return text;
}

// What a disagreement comes from: motion first, then forces. Motion that only the simulation gets
// wrong (its own error) does not hide that another witness' forces are wrong by far.
Attribution OfDisagreement(const ComparisonInput& input, const Comparison& comparison) {
  Attribution motion = internal::AttributeByOwnMotion(input, comparison);
  if (motion.text.empty()) {
    motion = PrescribesMotion(input.mode) || input.motion->free()
                 ? internal::AttributeByKinematics(input, comparison)
                 : AttributeDriven(input, comparison);
  }
  if (motion.text.empty()) {
    Attribution found = ByDistance(input, comparison);
    return found.text.empty() ? BySingleCheck(comparison) : found;
  }
  if (!IsEngine(motion.odd_one_out) || !PrescribesMotion(input.mode)) return motion;
  Attribution distance = ByDistance(input, comparison);
  if (distance.odd_one_out.empty() || distance.odd_one_out == motion.odd_one_out) return motion;
  distance.text += "; also, " + motion.text;
  return distance;
}

// An inference that what the others have in common takes away leaves the facts.
void KeepToIndependence(const ComparisonInput& input, const Comparison& comparison,
                        Attribution* attribution) {
  const std::string odd = attribution->odd_one_out;
  if (odd.empty()) return;
  std::string shared = attribution->split ? attribution->split->shared : "";
  if (shared.empty()) {
    std::vector<std::string> others;
    for (const Witness& witness : input.witnesses) {
      if (witness.ran() && witness.name != odd && witness.name != role::kReached) {
        others.push_back(witness.name);
      }
    }
    if (others.size() > 1) shared = OwnText(input, comparison, others, odd);
    if (attribution->split) attribution->split->shared = shared;
  }
  if (shared.empty()) return;
  attribution->odd_one_out = "";
  attribution->text += fmt::format("; {}: this leaves open which is wrong", shared);
}

}  // namespace

namespace internal {

std::string Amount(double value, const std::string& unit) {
  if (!unit.empty()) return fmt::format("{:.2g} {}", value, unit);
  if (value >= 10.0) return fmt::format("{:.2g} times", value);
  if (value >= 1.0) return fmt::format("{:.0f} %", 100.0 * value);
  if (value >= 1e-3) return fmt::format("{:.2g} %", 100.0 * value);
  return fmt::format("{:.1e}", value);
}

std::string AmountOf(const CheckResult& check) {
  if (check.metric == Metric::kTableTube)
    return fmt::format("{:.2g} times its tolerance", check.value);
  return Amount(check.value, RowOf(check.metric).unit);
}

std::string ChannelAndTime(const std::string& channel, double time_s) {
  return std::isnan(time_s) ? channel : fmt::format("{}, t = {:.4g} s", channel, time_s);
}

std::string NameOf(const Comparison& comparison, const std::string& witness) {
  if (witness == role::kReference && comparison.table) return "the table " + comparison.table->name;
  const Role* role = FindRole(witness);
  return role == nullptr ? witness : role->called;
}

bool Failed(const CheckResult* check) { return check != nullptr && check->limit && !check->pass; }

}  // namespace internal

Attribution Attribute(const ComparisonInput& input, const Comparison& comparison) {
  if (comparison.verdict == Verdict::kNotRun) return {};
  if (comparison.verdict == Verdict::kAgree) {
    const Attribution driven = AttributeDriven(input, comparison);
    return driven.text.empty() ? Attribution{"", AgreementText(input, comparison)} : driven;
  }
  Attribution attribution = OfDisagreement(input, comparison);
  KeepToIndependence(input, comparison, &attribution);
  return attribution;
}

}  // namespace mbv

// Attribution by energy: a witness that integrates its motion with too coarse a step gains or loses
// energy, although its forces and accelerations fit at every single instant.

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
// much larger it is not a cause. Coarse steps leave the loops open, which costs some power, too.
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
                    "; this is too little to explain the difference: a third witness would show "
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
  return fmt::format("{}: {} would show whether simulation.step_s is too coarse", drifts,
                     SmallerStep(*drift));
}

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
                     ChannelAndTime(check.channel, check.time_s));
}

Attribution ByDerivatives(const Comparison& comparison) {
  for (const Role* role : kComputed) {
    const char* name = role->name;
    const CheckResult* check = comparison.FindCheck(*role, Metric::kDerivatives);
    if (!Failed(check)) continue;
    return {name,
            fmt::format("{}: its drive rates are not the time derivatives of its drive "
                        "positions; they differ by {} at {}",
                        name, AmountOf(*check), ChannelAndTime(check->channel, check->time_s))};
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
                     comparison.table->name, AmountOf(check),
                     ChannelAndTime(check.channel, check.time_s),
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
                     ChannelAndTime(opinions.differ->channel, opinions.differ->time_s));
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
      DriveNoun(differ.metric), AmountOf(differ), ChannelAndTime(differ.channel, differ.time_s));
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
                            "witness to decide",
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
