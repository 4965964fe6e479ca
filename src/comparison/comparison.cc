#include "comparison/comparison.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "comparison/caveats.h"
#include "comparison/compare_stiffness.h"
#include "comparison/driven.h"
#include "comparison/force_band.h"
#include "comparison/force_scale.h"
#include "comparison/pair_reader.h"
#include "comparison/table_tube.h"
#include "comparison/verdict.h"
#include "math/spatial.h"
#include "mechanism/channels.h"

namespace mbv {
namespace {

// Quantities that one would expect to be judged but that the traces do not hold.
void AddMissingNotes(const ComparisonInput& input, Comparison* comparison) {
  const auto note = [&](const std::string& what, const char* why) {
    comparison->not_compared.push_back({what, why});
  };
  for (const PairComparison& pair : comparison->pairs) {
    if (!pair.compared) continue;
    if (!input.mechanism->outputs.empty() && !pair.metrics.contains(Metric::kPoseM)) {
      note(pair.name() + ".pose", "the outputs are not recorded by both");
    }
    if (pair.reactions.empty()) {
      note(pair.name() + ".reaction", "no unique joint reaction is recorded by both");
    }
  }
  for (const WitnessMetrics& witness : comparison->witnesses) {
    const Role* role = FindRole(witness.witness);
    if (role != nullptr && !role->has_bodies()) continue;
    if (IsTable(input, witness.witness)) continue;
    if (!witness.metrics.contains(Metric::kClosureM))
      note(witness.witness + ".closure", "not recorded");
    if (!witness.metrics.contains(Metric::kPower)) note(witness.witness + ".power", "not recorded");
    if (IsEngine(witness.witness) && IsTaskSpace(*input.motion) &&
        !witness.metrics.contains(Metric::kCommandVelocity)) {
      note(witness.witness + "." + RowOf(Metric::kCommandVelocity).key,
           "the rates of the commanded coordinates are not recorded");
    }
  }
  for (const Witness& witness : input.witnesses) {
    if (!witness.foreign) continue;
    for (const auto& [what, why] : witness.foreign->left_out) {
      note(witness.name + ": " + what, why.c_str());
    }
  }
  if (HasPayloads(*input.motion)) {
    note(RowOf(Metric::kEnergy).key, "a body whose mass changes brings energy and takes it along");
  }
  for (const WitnessMetrics& witness : comparison->witnesses) {
    if (witness.derivatives_gap.empty()) continue;
    note(witness.witness + ".derivatives", witness.derivatives_gap.c_str());
  }
}

// Reaction components that statics leaves open, joint by joint: "hinge.reaction (fz, mx, my)".
void AddReactionNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const Joint& joint : input.mechanism->joints) {
    std::string components;
    size_t count = 0;
    for (const Channel& channel : ReactionChannels(joint)) {
      const auto& open = input.reactions_not_unique;
      if (std::find(open.begin(), open.end(), channel.name) == open.end()) continue;
      components += (count++ == 0 ? "" : ", ") + SignalWord(channel);
    }
    if (count == 0) continue;
    comparison->not_compared.push_back(
        {ChannelName(Quantity::kReaction, joint.name) + (count == 6 ? "" : " (" + components + ")"),
         "statics alone does not determine it (redundant constraints)"});
  }
}

// Prescribed motion is imposed; no witness records it as a signal.
void AddCommandNotes(const ComparisonInput& input, Comparison* comparison) {
  for (const Command& command : input.motion->commands) {
    for (const Command::Term& term : command.terms) {
      if (term.coordinate.kind != Coordinate::Kind::kPrescribed) continue;
      comparison->not_compared.push_back(
          {command.name, "a prescribed joint's motion is an input and is not measured back"});
    }
  }
}

// Given forces are the same in every witness.
void AddForceNotes(const ComparisonInput& input, Comparison* comparison) {
  if (input.mode == DriveMode::kForceDriven) {
    comparison->not_compared.push_back(
        {role::kSimulated.name + std::string(" drive forces"),
         "they are the " + input.driven_by + " forces; the motion that they cause is compared"});
  }
  for (const DriveForce& force : input.motion->forces) {
    const std::string& drive = input.mechanism->drives[force.drive].name;
    comparison->not_compared.push_back({ChannelName(Quantity::kForce, drive),
                                        "it is given by the scenario; the motion it causes is "
                                        "compared"});
  }
}

}  // namespace

void AddNotCompared(const ComparisonInput& input, Comparison* comparison) {
  if (input.of_stiffness) {
    internal::AddStiffnessNotes(input, comparison);
    return;
  }
  AddMissingNotes(input, comparison);
  AddReactionNotes(input, comparison);
  AddCommandNotes(input, comparison);
  AddForceNotes(input, comparison);
}

namespace {

constexpr double kPi = std::numbers::pi;
constexpr KnownFactor kFactors[] = {
    {1e3, "1000: is the unit kN, mm or ms mistaken?"},
    {1e-3, "1/1000: is the unit kN, mm or ms mistaken?"},
    {1e6, "1000000: is the unit mistaken?"},
    {1e-6, "1/1000000: is the unit mistaken?"},
    {180.0 / kPi, "180/pi: degrees taken for radians?"},
    {kPi / 180.0, "pi/180: radians taken for degrees?"},
    {9.80665, "9.81: N taken for kgf, or a mass for a weight?"},
    {1.0 / 9.80665, "1/9.81: kgf taken for N, or a weight for a mass?"},
    {4.4482216152605, "4.448: N taken for lbf?"},
    {1.0 / 4.4482216152605, "1/4.448: lbf taken for N?"},
    {0.0254, "0.0254: inches taken for metres?"},
    {1.0 / 0.0254, "1/0.0254: metres taken for inches?"},
    {2.0 * kPi, "2 pi: revolutions taken for radians?"},
    {0.5 / kPi, "1/(2 pi): radians taken for revolutions?"},
    {2.0, "2: is something counted twice?"},
    {0.5, "1/2: is it shared between two?"},
};

}  // namespace

const KnownFactor* FindFactor(double factor) {
  for (const KnownFactor& known : kFactors) {
    if (std::abs(factor / known.factor - 1.0) < kSameFactor) return &known;
  }
  return nullptr;
}

std::string CountText(const Comparison& comparison) {
  const size_t failed = comparison.failed(), followed = comparison.followed();
  const size_t insensitive = comparison.insensitive();
  const size_t all = failed + comparison.verified() + followed + insensitive;
  if (failed > 0) return fmt::format("{} of {} checks exceed their limits", failed, all);
  std::string text = fmt::format("all {} checks are within their limits", all);
  if (followed > 0) {
    text += fmt::format(", but {} of them compare{} a drive motion with itself and verif{} nothing",
                        followed, followed == 1 ? "s" : "", followed == 1 ? "ies" : "y");
  }
  if (insensitive > 0) text += fmt::format("; {} more verify nothing", insensitive);
  return text;
}

// Pairs and single witnesses → checks, verdict.

namespace {

// "reference: the commands do not hold the mechanism at this pose (near limb2.R12; t = 3.22 s)".
std::string Explain(const Witness& witness) {
  std::string text = witness.name + ": " + witness.summary.message;
  const RunSummary& summary = witness.summary;
  if (!summary.names_where && !summary.where.empty()) text += " (near " + summary.where + ")";
  if (!summary.states_time && !std::isnan(summary.time_s)) {
    text += fmt::format(" (t = {:.6g} s)", summary.time_s);
  }
  return text;
}

LimitColumn ColumnOf(const ComparisonInput& input, const std::string& measured) {
  const Witness* witness = FindNamed(input.witnesses, measured);
  if (witness != nullptr && witness->foreign) return witness->foreign->limits;
  return IsEngine(measured) ? input.simulation_limits : LimitColumn::kReference;
}

// The looser one, of a pair with a foreign witness whose own is stated.
std::optional<double> LimitOf(const ComparisonInput& input, const std::string& measured,
                              const std::string& truth, LimitColumn column, Metric metric) {
  std::optional<double> limit = input.limits[metric].Of(column);
  if (metric != Metric::kForceNrmse || !limit) return limit;
  for (const Witness& witness : input.witnesses) {
    const bool of_pair = witness.name == measured || witness.name == truth;
    if (!of_pair || !witness.foreign || !witness.foreign->force_nrmse) continue;
    limit = std::max(*limit, *witness.foreign->force_nrmse);
  }
  return limit;
}

// Of the pair `measured` against `truth`; of one witness by itself, `truth` is "".
void AddChecks(const ComparisonInput& input, const std::string& measured_by,
               const std::string& truth, LimitColumn column,
               const std::map<Metric, Measured>& metrics, const OtherLimits& other,
               Comparison* comparison) {
  const std::string subject = truth.empty() ? measured_by : PairName(measured_by, truth);
  for (const auto& [metric, measured] : metrics) {
    CheckResult check{.name = subject + "." + RowOf(metric).key,
                      .subject = subject,
                      .measured = measured_by,
                      .truth = truth,
                      .metric = metric,
                      .value = measured.value,
                      .limit = LimitOf(input, measured_by, truth, column, metric),
                      .stated_limit = {},
                      .limit_by = {},
                      .time_s = measured.time_s,
                      .channel = measured.channel,
                      .floored = measured.floored};
    ApplyOther(other, input, &check);
    check.pass = Passes(check.value, check.limit);
    check.follows = ComparesMotionWithItself(input, check);
    comparison->checks.push_back(std::move(check));
  }
}

// A pair with a table: its columns judged one by one, and the tubes of its metrics.
std::map<Metric, double> JudgeTablePair(const ComparisonInput& input, const Witness& other,
                                        PairComparison* pair, TableVerdict* verdict) {
  const bool table_is_truth = IsTable(input, pair->truth);
  pair->columns = JudgeColumns(input, *other.trace, ColumnOf(input, pair->measured));
  if (!pair->columns.empty()) pair->metrics[Metric::kTableTube] = WorstOf(pair->columns);
  std::map<Metric, double> tubes = TubeLimits(input, *other.trace, table_is_truth);
  if (verdict->too_coarse.empty()) verdict->too_coarse = TooCoarse(input, tubes, pair->columns);
  return tubes;
}

void AddPair(const ComparisonInput& input, const std::string& measured, const std::string& truth,
             Comparison* comparison) {
  const Witness* a = FindNamed(input.witnesses, measured);
  const Witness* b = FindNamed(input.witnesses, truth);
  if (a == nullptr || b == nullptr) return;
  PairComparison pair;
  if (input.of_stiffness) {
    pair = CompareStiffnesses(*a, *b);
  } else {
    pair.measured = measured;
    pair.truth = truth;
    pair.reason = internal::NotComparedReason(*a, *b);
    if (pair.reason.empty()) pair = ComparePair(input, *a->trace, *b->trace);
    LeaveOutReachedMotion(&pair);
  }
  OtherLimits other;
  const Role& solves = input.table == nullptr ? role::kReference : role::kSolver;
  other.integrated = measured == solves || truth == solves;
  if (pair.compared && SharesForces(input, measured, truth)) {
    other.growth = GrowthLimits(input, *a->trace);
  }
  if (a->ran() && b->ran() && (IsTable(input, measured) || IsTable(input, truth))) {
    other.tubes =
        JudgeTablePair(input, IsTable(input, measured) ? *b : *a, &pair, &*comparison->table);
  }
  if (!pair.compared) comparison->not_compared.push_back({pair.name(), pair.reason});
  AddChecks(input, measured, truth, ColumnOfPair(input, measured, truth), pair.metrics, other,
            comparison);
  comparison->pairs.push_back(std::move(pair));
}

// Every pair that is looked at, by names: those of our own roles, then each foreign witness against
// those that compute, the simulation against it where both follow the commands, and against those
// before it.
std::vector<std::pair<std::string, std::string>> PairsOf(const ComparisonInput& input) {
  std::vector<std::pair<std::string, std::string>> pairs;
  pairs.reserve(kRolePairs.size());
  for (const auto& [measured, truth] : kRolePairs) pairs.emplace_back(measured->name, truth->name);
  std::vector<std::string> before;
  for (const Role* role : {&role::kAnalytic, &role::kReference, &role::kSolver}) {
    before.emplace_back(role->name);
  }
  for (const Witness& witness : input.witnesses) {
    if (!witness.foreign) continue;
    if (PrescribesMotion(input.mode)) pairs.emplace_back(role::kSimulated.name, witness.name);
    for (const std::string& other : before) pairs.emplace_back(witness.name, other);
    before.push_back(witness.name);
  }
  return pairs;
}

// A witness that started and broke down, or nullptr.
const Witness* FindBroken(const ComparisonInput& input) {
  for (const Witness& witness : input.witnesses) {
    if (!witness.summary.ok() && witness.summary.stop != Stop::kNotRun) return &witness;
  }
  return nullptr;
}

// A table that was given must have been judged, and must be able to show errors.
std::string TableVerifiesNothingReason(const Comparison& comparison) {
  const TableVerdict& table = *comparison.table;
  if (!table.too_coarse.empty()) return table.too_coarse;
  const bool judged =
      std::any_of(comparison.checks.begin(), comparison.checks.end(), [](const CheckResult& check) {
        return check.limit && (check.metric == Metric::kTableTube || check.stated_limit);
      });
  if (judged) return "";
  return fmt::format("nothing of the table {} could be compared", table.name);
}

// What the table is, for the report.
TableVerdict Introduce(const AlignedTable& table) {
  TableVerdict verdict;
  verdict.name = table.name;
  verdict.grid = table.grid;
  verdict.notes = table.notes;
  verdict.columns = table.columns;
  verdict.uncertainty = table.uncertainty;
  verdict.coverage = table.coverage;
  return verdict;
}

// Drives without a column, and what the differences look like.
void FinishTable(const ComparisonInput& input, Comparison* comparison) {
  TableVerdict& table = *comparison->table;
  for (const Drive& drive : input.mechanism->drives) {
    const std::string force = ChannelName(Quantity::kForce, drive.name);
    if (input.table->trace.Find(force) >= 0) continue;
    comparison->not_compared.push_back({force, "it is not in the table"});
  }
  // The computation that the simulation does not depend on says more than the simulation.
  for (const auto& [measured, truth] : {RolePair{&role::kReference, &role::kAnalytic},
                                        {&role::kReference, &role::kSolver},
                                        {&role::kSimulated, &role::kReference}}) {
    const PairComparison* pair = comparison->FindPair(PairName(*measured, *truth));
    if (pair == nullptr || pair->columns.empty()) continue;
    table.judged_against = pair->measured == role::kReference ? pair->truth : pair->measured;
    const CheckResult* tube = comparison->FindCheck(*measured, *truth, Metric::kTableTube);
    table.judged = tube != nullptr && tube->limit;
    if (!table.judged) return;  // nothing to explain
    const Witness* other = FindNamed(input.witnesses, table.judged_against);
    table.diagnoses = DiagnoseTable(input, *other->trace, pair->columns);
    return;
  }
}

// A witness without which the scenario wants no verdict, and that nothing was compared with.
const Caveat* FindMissingRequired(const ComparisonInput& input,
                                  const std::vector<Caveat>& missing) {
  for (const Caveat& caveat : missing) {
    const Witness* witness = FindNamed(input.witnesses, caveat.of.front());
    if (witness != nullptr && witness->required) return &caveat;
  }
  return nullptr;
}

void Judge(const ComparisonInput& input, Comparison* comparison) {
  if (const Witness* broken = FindBroken(input)) {
    comparison->reason = Explain(*broken);
    return;
  }
  const std::vector<Caveat> missing = MissingWitnesses(input, *comparison);
  if (const Caveat* caveat = FindMissingRequired(input, missing)) {
    comparison->reason = "the scenario requires " + caveat->text;
    return;
  }
  const auto compared = std::count_if(comparison->pairs.begin(), comparison->pairs.end(),
                                      [](const PairComparison& p) { return p.compared; });
  if (compared == 0) {
    comparison->verdict = Verdict::kNotRun;
    comparison->reason = input.of_stiffness     ? "no stiffness could be compared"
                         : input.motion->free() ? "no free motion could be compared"
                                                : "no drive force could be compared";
    if (!comparison->pairs.empty()) {
      // Rather of a pair that ran than of a witness that was switched off.
      const auto ran = std::find_if(comparison->pairs.begin(), comparison->pairs.end(),
                                    [](const PairComparison& p) { return p.samples > 0; });
      comparison->reason +=
          ": " + (ran == comparison->pairs.end() ? comparison->pairs.front() : *ran).reason;
    }
    return;
  }
  comparison->reason = HorizonTooLongReason(input, *comparison);
  if (!comparison->reason.empty()) return;
  const std::string nothing = NothingVerifiedReason(input, *comparison);
  const size_t failed = comparison->failed();
  if (failed == 0 && !nothing.empty()) {
    comparison->reason = nothing;
    return;
  }
  if (input.table != nullptr && failed == 0) {
    comparison->reason = TableVerifiesNothingReason(*comparison);
    if (!comparison->reason.empty()) return;
  }
  if (failed == 0) {
    comparison->reason = MarginUnknownReason(*comparison);
    if (!comparison->reason.empty()) return;
  }
  comparison->verdict = failed == 0 ? Verdict::kAgree : Verdict::kDisagree;
  comparison->reason = CountText(*comparison);
}

}  // namespace

bool Witness::ran() const {
  return stiffness != nullptr ? stiffness->ran() : trace != nullptr && summary.ok();
}

std::string internal::NotComparedReason(const Witness& measured, const Witness& truth) {
  std::string why;
  for (const Witness* witness : {&measured, &truth}) {
    if (witness->ran()) continue;
    // What went wrong is said where the witness is.
    const bool failed = witness->stiffness == nullptr && witness->summary.stop != Stop::kNotRun;
    why += (why.empty() ? "" : "; ") + (failed ? witness->name + " failed" : Explain(*witness));
  }
  return why;
}

const char* ToText(Verdict verdict) {
  switch (verdict) {
    case Verdict::kNotRun:
      return "not_run";
    case Verdict::kAgree:
      return "agree";
    case Verdict::kDisagree:
      return "disagree";
  }
  return "?";
}

const char* ToText(WitnessGap gap) {
  switch (gap) {
    case WitnessGap::kNone:
      return "";
    case WitnessGap::kNotApplicable:
      return "not_applicable";
    case WitnessGap::kNotHandedOver:
      return "not_handed_over";
    case WitnessGap::kNotStarted:
      return "not_started";
    case WitnessGap::kExitCode:
      return "exit_code";
    case WitnessGap::kSignal:
      return "signal";
    case WitnessGap::kTimedOut:
      return "timed_out";
    case WitnessGap::kNoAnswer:
      return "no_answer";
    case WitnessGap::kBadAnswer:
      return "bad_answer";
    case WitnessGap::kOutOfScope:
      return "declined";
    case WitnessGap::kNoForces:
      return "no_forces";
  }
  return "?";
}

const char* ToText(CaveatKind kind) {
  switch (kind) {
    case CaveatKind::kWideLimits:
      return "wide_limits";
    case CaveatKind::kForcesCancel:
      return "forces_cancel";
    case CaveatKind::kFewSamples:
      return "few_samples";
    case CaveatKind::kPartOfMotion:
      return "part_of_motion";
    case CaveatKind::kTable:
      return "table";
    case CaveatKind::kRatesUnchecked:
      return "rates_unchecked";
    case CaveatKind::kWitnessMissing:
      return "witness_missing";
    case CaveatKind::kWitnessInPart:
      return "witness_in_part";
    case CaveatKind::kLeftOut:
      return "left_out";
    case CaveatKind::kContact:
      return "contact";
    case CaveatKind::kCoverage:
      return "coverage";
  }
  return "?";
}

const PairComparison* Comparison::FindPair(const std::string& name) const {
  const auto found = std::ranges::find(pairs, name, &PairComparison::name);
  return found == pairs.end() ? nullptr : &*found;
}

const CheckResult* Comparison::FindCheck(const std::string& name) const {
  return FindNamed(checks, name);
}

const CheckResult* Comparison::FindCheck(const Role& witness, Metric metric) const {
  return FindCheck(witness.name + std::string(".") + RowOf(metric).key);
}

const CheckResult* Comparison::FindCheck(const Role& measured, const Role& truth,
                                         Metric metric) const {
  return FindCheck(PairName(measured, truth) + "." + RowOf(metric).key);
}

const PairComparison* Comparison::MainPair() const {
  for (const auto& [measured, truth] : kMainPairs) {
    const PairComparison* pair = FindPair(PairName(*measured, *truth));
    if (pair != nullptr && pair->compared) return pair;
  }
  return nullptr;
}

namespace {

template <typename Counts>
size_t Count(const std::vector<CheckResult>& checks, const Counts& counts) {
  return static_cast<size_t>(
      std::ranges::count_if(checks, [&](const CheckResult& c) { return c.limit && counts(c); }));
}

}  // namespace

size_t Comparison::failed() const {
  return Count(checks, [](const CheckResult& c) { return !c.pass; });
}

size_t Comparison::verified() const {
  return Count(checks,
               [](const CheckResult& c) { return c.pass && !c.follows && c.insensitive.empty(); });
}

size_t Comparison::followed() const {
  return Count(checks, [](const CheckResult& c) { return c.pass && c.follows; });
}

size_t Comparison::insensitive() const {
  return Count(checks,
               [](const CheckResult& c) { return c.pass && !c.follows && !c.insensitive.empty(); });
}

namespace {

// What the table's differences look like is about the table: where another witness is wrong, it
// would have a right table repaired.
void DescribeTable(Comparison* comparison) {
  std::vector<std::string>& diagnoses = comparison->table->diagnoses;
  Attribution& attribution = comparison->attribution;
  const std::string& odd = attribution.odd_one_out;
  if (!odd.empty() && odd != role::kReference) diagnoses.clear();
  if (comparison->verdict != Verdict::kDisagree) return;
  for (const std::string& diagnosis : diagnoses) {
    attribution.text += (attribution.text.empty() ? "" : "; ") + diagnosis;
  }
}

// What a witness shows by itself. Servos follow their commands as well as their gains let them.
void AddWitness(const ComparisonInput& input, const Witness& witness, Comparison* comparison) {
  if (input.of_stiffness) {
    comparison->witnesses.push_back(
        {.witness = witness.name,
         .metrics = MeasureStiffness(*witness.stiffness, IsEngine(witness.name))});
    AddChecks(input, witness.name, "", ColumnOf(input, witness.name),
              comparison->witnesses.back().metrics, {}, comparison);
    return;
  }
  WitnessMetrics metrics = MeasureWitness(input, *witness.trace);
  OtherLimits other;
  const bool engine = IsEngine(witness.name);
  if (IsTable(input, witness.name)) {
    other.tubes = CommandTubes(input);
  } else {
    metrics.unresolved = UnresolvedBySamples(input, *witness.trace, engine ? nullptr : &metrics);
  }
  if (engine) other.growth = CommandGrowth(input, metrics);
  std::map<Metric, Measured> commands, others;
  for (const auto& [metric, measured] : metrics.metrics) {
    (IsCommand(metric) ? commands : others)[metric] = measured;
  }
  const LimitColumn column = ColumnOf(input, witness.name);
  const bool servo = engine && input.mode == DriveMode::kServo;
  AddChecks(input, witness.name, "", servo ? LimitColumn::kServo : column, commands, other,
            comparison);
  AddChecks(input, witness.name, "", column, others, other, comparison);
  comparison->witnesses.push_back(std::move(metrics));
}

}  // namespace

Comparison Compare(const ComparisonInput& given) {
  ComparisonInput input = given;
  const DrivenTwists twists = input.of_stiffness ? DrivenTwists() : TwistsFor(input);
  if (input.twists == nullptr) input.twists = &twists;
  Comparison comparison;
  if (input.table != nullptr) comparison.table = Introduce(*input.table);
  if (!input.of_stiffness) comparison.driving = DrivingText(input);
  for (const auto& [measured, truth] : PairsOf(input)) {
    AddPair(input, measured, truth, &comparison);
  }
  for (const Witness& witness : input.witnesses) {
    const Role* role = FindRole(witness.name);
    const bool alone = role == nullptr || role->judged_alone();
    if (witness.ran() && alone) AddWitness(input, witness, &comparison);
  }
  AddNotCompared(input, &comparison);
  if (input.table != nullptr) FinishTable(input, &comparison);
  MarkInsensitive(input, &comparison);
  Judge(input, &comparison);
  comparison.caveats = CaveatsOf(input, comparison);
  comparison.attribution = Attribute(input, comparison);
  if (comparison.table) DescribeTable(&comparison);
  return comparison;
}

// Metrics of one witness against another.

namespace {

using internal::Columns;
using internal::KeepWorst;
using internal::PairReader;

Measured AsMeasured(const ErrorSum& sum, double value) {
  return {.value = value, .time_s = sum.worst_time_s(), .channel = sum.worst_channel()};
}

// Drive positions (absolute), velocities and accelerations (relative to their RMS).
void CompareDriveMotion(const ComparisonInput& input, const PairReader& reader,
                        PairComparison* pair) {
  std::map<std::string, ErrorSum> velocity, acceleration;
  for (const Drive& drive : input.mechanism->drives) {
    const std::string unit = PositionUnit(*input.mechanism, drive);
    const std::string position = ChannelName(Quantity::kPosition, drive.name);
    if (const Columns c = reader.Find(position); c.both()) {
      const ErrorSum sum = reader.Sum(position, c, 0.0, unit == "rad");
      const Metric metric = unit == "rad" ? Metric::kPositionRad : Metric::kPositionM;
      KeepWorst(&pair->metrics, metric, AsMeasured(sum, sum.max_error()));
    }
    const std::string rate = ChannelName(Quantity::kVelocity, drive.name);
    const std::string rate2 = ChannelName(Quantity::kAcceleration, drive.name);
    if (const Columns c = reader.Find(rate); c.both()) {
      velocity[unit].Merge(reader.Sum(rate, c, 0.0, false));
    }
    if (const Columns c = reader.Find(rate2); c.both()) {
      acceleration[unit].Merge(reader.Sum(rate2, c, 0.0, false));
    }
  }
  for (const auto& [unit, sum] : velocity) {
    KeepWorst(&pair->metrics, Metric::kVelocity,
              sum.MeasuredNrmse(RestFloorOf(input, unit, reader.truth).velocity));
  }
  for (const auto& [unit, sum] : acceleration) {
    KeepWorst(&pair->metrics, Metric::kAcceleration,
              sum.MeasuredNrmse(RestFloorOf(input, unit, reader.truth).acceleration));
  }
}

// Six columns of an output in one trace.
using OutputColumns = std::array<int, 6>;

std::optional<OutputColumns> FindOutput(const Trace& trace, const Output& output) {
  OutputColumns columns{};
  for (int c = 0; c < 6; ++c) {
    const int column = trace.Find(Quantity::kPose, output.name, c);
    if (column < 0) return {};
    columns[static_cast<size_t>(c)] = column;
  }
  return columns;
}

Vec3 Pick(const Trace& trace, Eigen::Index row, const OutputColumns& columns, size_t first) {
  return {trace.values(row, columns[first]), trace.values(row, columns[first + 1]),
          trace.values(row, columns[first + 2])};
}

void ComparePoses(const ComparisonInput& input, const PairReader& reader, PairComparison* pair) {
  for (const Output& output : input.mechanism->outputs) {
    const auto a = FindOutput(reader.measured, output), b = FindOutput(reader.truth, output);
    if (!a || !b) continue;
    for (const auto& [i, j] : reader.samples) {
      const double time_s = reader.measured.time_s[static_cast<size_t>(i)];
      const Vec3 p_error = Pick(reader.measured, i, *a, 0) - Pick(reader.truth, j, *b, 0);
      const Mat3 R_a = RotRpy(Pick(reader.measured, i, *a, 3));
      const Mat3 R_b = RotRpy(Pick(reader.truth, j, *b, 3));
      KeepWorst(&pair->metrics, Metric::kPoseM,
                {.value = p_error.norm(), .time_s = time_s, .channel = output.name});
      // A NaN matrix has no angle; the sum keeps the NaN.
      const Mat3 R_error = R_b.transpose() * R_a;
      const double angle = R_error.allFinite() ? LogRotation(R_error).norm() : kNan;
      KeepWorst(&pair->metrics, Metric::kPoseRad,
                {.value = angle, .time_s = time_s, .channel = output.name});
    }
  }
}

}  // namespace

ErrorSum internal::PairReader::Sum(const std::string& name, Columns columns, double start_s,
                                   bool angle) const {
  ErrorSum sum;
  for (const auto& [i, j] : samples) {
    const double time_s = measured.time_s[static_cast<size_t>(i)];
    if (time_s < start_s) continue;
    const double a = measured.values(i, columns.measured), b = truth.values(j, columns.truth);
    sum.Add(angle ? AngleDifference(a, b) : a - b, b, time_s, name);
  }
  return sum;
}

ErrorSum internal::PairReader::SumForces(const std::string& name, Columns columns,
                                         double start_s) const {
  ErrorSum sum;
  const ForceSignal a(measured, columns.measured), b(truth, columns.truth);
  for (const auto& [i, j] : samples) {
    const double time_s = measured.time_s[static_cast<size_t>(i)];
    if (time_s < start_s) continue;
    sum.Add(Difference(a.At(i), b.At(j)), b.At(j).middle, time_s, name);
  }
  return sum;
}

PairComparison ComparePair(const ComparisonInput& input, const Trace& measured,
                           const Trace& truth) {
  PairComparison pair;
  pair.measured = measured.witness;
  pair.truth = truth.witness;
  const PairReader reader{measured, truth, AlignSamples(measured, truth)};
  pair.samples = reader.samples.size();
  internal::CompareForces(input, reader, &pair);
  CompareDriveMotion(input, reader, &pair);
  ComparePoses(input, reader, &pair);
  // A free motion is judged by where it goes.
  const bool trajectory = std::any_of(pair.metrics.begin(), pair.metrics.end(),
                                      [](const auto& entry) { return IsTrajectory(entry.first); });
  if (pair.compared && pair.drives.empty() && !trajectory) {
    pair.compared = false;
    pair.reason = "the model has neither drives nor outputs whose motion could be compared";
  }
  internal::CompareReactions(input, reader, &pair);
  return pair;
}

}  // namespace mbv
