#include "comparison/caveats.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <utility>

#include "base/text.h"
#include "comparison/contact_load.h"
#include "comparison/driven.h"
#include "comparison/verdict.h"
#include "mechanism/reach.h"

namespace mbv {
namespace {

constexpr size_t kFewSamples = 5;
constexpr double kWhole = 0.95;  // of the motion: judged up to the samples at its ends

// Of what is measured in parts of what may be used.
bool IsWide(const CheckResult& check) { return check.limit && *check.limit > 1.0; }

bool IsCoarse(const ComparisonInput& input, const CheckResult& check) {
  // A limit that a table's uncertainty widened is judged with the table, one that perturbed forces
  // set by how much these show.
  if (!check.limit || (check.stated_limit && !check.limit_is_integration_error)) return false;
  if (check.metric == Metric::kTableTube || check.metric == Metric::kMotorUse) {
    return IsWide(check);
  }
  const bool metres = std::string(RowOf(check.metric).unit) == "m";
  const double size = metres ? CharacteristicLength(*input.mechanism) : 1.0;
  return *check.limit > kCoarsestLimit * size;
}

const Measured* MeasuredOf(const Comparison& comparison, const CheckResult& check) {
  const PairComparison* pair = comparison.FindPair(check.subject);
  if (pair == nullptr) return nullptr;
  const auto found = pair->metrics.find(check.metric);
  return found == pair->metrics.end() ? nullptr : &found->second;
}

// Zero in the place of the measured forces would pass.
bool ZeroPasses(const Comparison& comparison, const CheckResult& check) {
  if (!check.limit || !IsDriveForce(check.metric)) return false;
  const Measured* measured = MeasuredOf(comparison, check);
  return measured != nullptr && measured->of_zero < 1.0 && measured->of_zero <= *check.limit;
}

// Limits below what the reference claims of itself: what is smaller is not seen.
Caveat IntegrationErrors(const ComparisonInput& input, const Comparison& comparison) {
  Caveat caveat{.kind = CaveatKind::kWideLimits};
  for (const CheckResult& check : comparison.checks) {
    if (check.limit_is_integration_error) caveat.of.push_back(check.name);
  }
  if (caveat.of.empty()) return caveat;
  caveat.text = fmt::format(
      "the reference states an error of its trajectory of {:.1e} [rad, characteristic lengths], "
      "which is above the limit and replaces it: {}",
      input.integration_error, Joined(caveat.of));
  return caveat;
}

bool Judges(const ComparisonInput& input, const CheckResult& check) {
  return IsEvidence(input, check);
}

// All limits that are too wide, with the checks they belong to.
Caveat CoarseLimits(const ComparisonInput& input, const Comparison& comparison) {
  Caveat caveat{.kind = CaveatKind::kWideLimits};
  for (const CheckResult& check : comparison.checks) {
    if (!IsCoarse(input, check)) continue;
    caveat.text +=
        fmt::format("{}{} ({:.2g}{}{})", caveat.of.empty() ? "" : ", ", check.name, *check.limit,
                    *RowOf(check.metric).unit == '\0' ? "" : " ", RowOf(check.metric).unit);
    caveat.of.push_back(check.name);
  }
  return caveat;
}

bool IsWhole(const ComparisonInput& input, double from_s, double to_s) {
  const Motion& motion = *input.motion;
  return to_s - from_s >= kWhole * motion.duration_s - motion.sample_s;
}

// A pair's judged time against the motion's; "" if it is the whole. A table speaks for itself.
std::string Span(const ComparisonInput& input, const PairComparison& pair) {
  const bool table = input.table != nullptr && pair.Involves(role::kReference);
  if (pair.drives.empty() || (table && input.start_window_s == 0.0)) return "";
  if (IsWhole(input, pair.from_s, pair.to_s)) return "";
  return fmt::format("forces were judged from {:.4g} to {:.4g} s only, in a motion of {:.4g} s",
                     pair.from_s, pair.to_s, input.motion->duration_s);
}

// Sentences that several pairs share are written once, with the pairs.
class Sentences {
 public:
  void Add(CaveatKind kind, const std::string& subject, const std::string& text) {
    if (text.empty()) return;
    for (Caveat& known : all_) {
      if (known.text != text) continue;
      known.of.push_back(subject);
      return;
    }
    all_.push_back({.kind = kind, .of = {subject}, .text = text});
  }
  [[nodiscard]] std::vector<Caveat> Take() {
    for (Caveat& caveat : all_) caveat.text = Joined(caveat.of) + ": " + caveat.text;
    return std::move(all_);
  }

 private:
  std::vector<Caveat> all_;
};

bool IsForce(const std::string& unit) { return unit == "N" || unit == "N m"; }

// What the table does not say: forces, a part of the motion, or a column closely enough.
void ReserveTable(const ComparisonInput& input, const Comparison& comparison,
                  Sentences* sentences) {
  const AlignedTable& table = *input.table;
  const std::string name = "the table " + table.name;
  const auto& channels = table.trace.channels;
  if (!input.motion->free() &&
      std::none_of(channels.begin(), channels.end(),
                   [](const Channel& channel) { return IsForce(channel.unit); })) {
    sentences->Add(CaveatKind::kTable, name,
                   "it has no column of forces, so it verifies the motion only");
  }
  if (!table.trace.time_s.empty() &&
      !IsWhole(input, table.trace.time_s.front(), table.trace.time_s.back())) {
    sentences->Add(CaveatKind::kTable, name,
                   fmt::format("it covers {:.4g} to {:.4g} s only, of a motion of {:.4g} s",
                               table.trace.time_s.front(), table.trace.time_s.back(),
                               input.motion->duration_s));
  }
  std::string coarse;
  for (const PairComparison& pair : comparison.pairs) {
    const std::string& other = pair.measured == role::kReference ? pair.truth : pair.measured;
    if (other != comparison.table->judged_against) continue;
    for (const TableColumnResult& column : pair.columns) {
      if (!IsForce(channels[column.column].unit)) continue;
      if (!(column.tube_rms > table.coarsest * column.rms) || column.rms == 0.0) continue;
      coarse += (coarse.empty() ? "" : ", ") + column.channel;
    }
  }
  if (!coarse.empty()) {
    sentences->Add(CaveatKind::kTable, name,
                   fmt::format("a tube of more than {:g} % of the column verifies nothing: {}",
                               100.0 * table.coarsest, coarse));
  }
}

// Of a witness that ran and that nothing was compared with.
std::string NothingInCommonReason(const ComparisonInput& input, const Comparison& comparison,
                                  const Witness& witness) {
  for (const PairComparison& pair : comparison.pairs) {
    const bool first = pair.measured == witness.name;
    if (!first && pair.truth != witness.name) continue;
    const Witness* other = FindNamed(input.witnesses, first ? pair.truth : pair.measured);
    if (other != nullptr && other->summary.ok()) return pair.reason;
  }
  return "no other witness ran that it is compared with";
}

// The drives whose forces a program does not give; "" if it gives all of them, or none.
std::string ForcesLeftOut(const ComparisonInput& input, const Witness& witness) {
  const bool analytic = witness.name == role::kAnalytic;
  if ((!witness.foreign && !analytic) || witness.trace == nullptr || !witness.summary.ok()) {
    return "";
  }
  if (input.motion->free()) return "";
  std::vector<std::string> left_out;
  for (const Drive& drive : input.mechanism->drives) {
    if (witness.trace->Find(ChannelName(Quantity::kForce, drive.name)) < 0) {
      left_out.push_back(drive.name);
    }
  }
  if (left_out.empty()) return "";
  if (left_out.size() == input.mechanism->drives.size()) {
    return analytic ? "its equations give no forces: its motion alone is compared" : "";
  }
  return "it gives no force of " + Joined(left_out);
}

}  // namespace

void MarkInsensitive(const ComparisonInput& input, Comparison* comparison) {
  for (CheckResult& check : comparison->checks) {
    const PairComparison* pair = comparison->FindPair(check.subject);
    if (check.metric == Metric::kMotorUse) {
      for (const WitnessMetrics& witness : comparison->witnesses) {
        if (witness.witness == check.measured) check.insensitive = witness.unresolved;
      }
      if (!check.insensitive.empty()) continue;
    }
    if (IsCoarse(input, check)) {
      check.insensitive = "a limit so wide verifies nothing";
    } else if (pair != nullptr && !pair->forces_act && ZeroPasses(*comparison, check)) {
      check.insensitive = "nothing asks for drive forces";
    }
  }
}

std::string MarginUnknownReason(const Comparison& comparison) {
  for (const CheckResult& check : comparison.checks) {
    if (check.metric != Metric::kMotorUse || check.insensitive.empty() || IsWide(check)) continue;
    return fmt::format("{}: {}; what motors need between the samples is not known", check.name,
                       check.insensitive);
  }
  return "";
}

std::string NothingVerifiedReason(const ComparisonInput& input, const Comparison& comparison) {
  bool any = false, coarse = true;
  for (const CheckResult& check : comparison.checks) {
    if (!Judges(input, check)) continue;
    if (check.insensitive.empty()) return "";
    any = true;
    coarse = coarse && IsCoarse(input, check);
  }
  const bool motion = input.motion->free() || input.mode == DriveMode::kForceDriven;
  const char* what = input.of_stiffness ? "stiffness and compliance"
                     : motion           ? "position and pose"
                                        : "force";
  if (!any) return fmt::format("every {} check is switched off, so nothing was verified", what);
  if (coarse) {
    return fmt::format("every {} limit is so wide that it verifies nothing: {}", what,
                       CoarseLimits(input, comparison).text);
  }
  return "nothing moves, weighs or exerts a force: the drive forces vanish whatever the masses "
         "are, so nothing was verified";
}

Caveat LeftOutCaveat(const std::string& text) {
  return {
      .kind = CaveatKind::kLeftOut, .of = {"mechanism"}, .text = "not the whole robot: " + text};
}

// Feet that the ground does not hold, each limit once: by the first witness that shows it.
std::vector<Caveat> ContactCaveats(const ComparisonInput& input) {
  std::vector<Caveat> caveats;
  std::set<std::pair<std::string, ContactLoad::Limit>> known;
  for (const Witness& witness : input.witnesses) {
    if (witness.trace == nullptr || !witness.ran() || input.mechanism->contacts.empty()) continue;
    for (const ContactLoad& load :
         ContactLoadsOf(*input.mechanism, *witness.trace, input.reactions_not_unique)) {
      for (const ContactLoad::Use& use : load.uses) {
        if (!use.exceeded() || !known.emplace(load.contact, use.limit).second) continue;
        caveats.push_back(
            {.kind = CaveatKind::kContact, .of = {load.name()}, .text = ExceededText(load, use)});
      }
    }
  }
  return caveats;
}

Caveat MissingWitnessCaveat(const std::string& witness, WitnessGap gap, const std::string& why) {
  return {.kind = CaveatKind::kWitnessMissing,
          .of = {witness},
          .text = fmt::format("the witness {}, which nothing was compared with: {}", witness, why),
          .gap = gap};
}

std::vector<Caveat> MissingWitnesses(const ComparisonInput& input, const Comparison& comparison) {
  std::vector<Caveat> missing;
  for (const Witness& witness : input.witnesses) {
    const bool compared =
        std::any_of(comparison.pairs.begin(), comparison.pairs.end(), [&](const auto& pair) {
          return pair.compared && (pair.measured == witness.name || pair.truth == witness.name);
        });
    const bool asked = witness.foreign || witness.required || witness.gap != WitnessGap::kNone;
    if (!asked || compared) continue;
    missing.push_back(
        witness.ran() ? MissingWitnessCaveat(witness.name, WitnessGap::kNoForces,
                                             NothingInCommonReason(input, comparison, witness))
                      : MissingWitnessCaveat(witness.name, witness.gap, witness.summary.message));
  }
  return missing;
}

std::vector<Caveat> CaveatsOf(const ComparisonInput& input, const Comparison& comparison) {
  Sentences sentences;
  for (const PairComparison& pair : comparison.pairs) {
    if (!pair.compared) continue;
    const CheckResult* force = comparison.FindCheck(pair.name() + ".force_nrmse");
    if (force != nullptr && pair.forces_act && ZeroPasses(comparison, *force)) {
      sentences.Add(CaveatKind::kForcesCancel, pair.name(),
                    "the drive forces are so small that zero would pass, too: "
                    "verified is only that they cancel out");
    }
    if (!pair.drives.empty() && pair.force_samples < kFewSamples) {
      sentences.Add(CaveatKind::kFewSamples, pair.name(),
                    fmt::format("forces were judged at {} sample{} only", pair.force_samples,
                                pair.force_samples == 1 ? "" : "s"));
    }
    sentences.Add(CaveatKind::kPartOfMotion, pair.name(), Span(input, pair));
  }
  if (input.table != nullptr) ReserveTable(input, comparison, &sentences);
  for (const WitnessMetrics& witness : comparison.witnesses) {
    if (witness.derivatives_gap.empty()) continue;
    sentences.Add(CaveatKind::kRatesUnchecked, witness.witness,
                  "rates were not checked against positions: " + witness.derivatives_gap);
  }
  for (const Witness& witness : input.witnesses) {
    sentences.Add(CaveatKind::kWitnessInPart, witness.name, ForcesLeftOut(input, witness));
  }
  std::vector<Caveat> all = sentences.Take();
  for (const std::string& text : input.left_out) {
    all.push_back(LeftOutCaveat(text));
  }
  for (Caveat& contact : ContactCaveats(input)) all.push_back(std::move(contact));
  if (!input.unchecked_coverage.empty()) {
    all.push_back({.kind = CaveatKind::kCoverage,
                   .of = {role::kAnalytic.name},
                   .text = "analytic: " + input.unchecked_coverage});
  }
  if (Caveat own = IntegrationErrors(input, comparison); !own.of.empty()) {
    all.insert(all.begin(), std::move(own));
  }
  if (Caveat coarse = CoarseLimits(input, comparison); !coarse.of.empty()) {
    coarse.text = "limits so wide that they verify nothing: " + coarse.text;
    all.insert(all.begin(), std::move(coarse));
  }
  for (Caveat& missing : MissingWitnesses(input, comparison)) {
    missing.text = "without " + missing.text;
    all.push_back(std::move(missing));
  }
  return all;
}

}  // namespace mbv
