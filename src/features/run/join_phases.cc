#include "features/run/join_phases.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <set>

#include "base/text.h"
#include "comparison/metrics.h"
#include "report/sizing.h"

namespace mbv {
namespace {

std::string InPhase(const ScenarioPhase& phase, const std::string& text) {
  return fmt::format("phase '{}': {}", phase.name, text);
}

// Rows at an instant that both have are those of `more`.
void Append(const Trace& more, Trace* all) {
  if (all->time_s.empty()) {
    *all = more;
    return;
  }
  if (more.time_s.empty()) return;
  const bool shared = all->time_s.back() >= more.time_s.front();
  const auto kept = static_cast<Eigen::Index>(all->time_s.size()) - (shared ? 1 : 0);
  const Trace before = std::move(*all);
  std::vector<double> times(before.time_s.begin(), before.time_s.begin() + kept);
  times.insert(times.end(), more.time_s.begin(), more.time_s.end());
  std::vector<Channel> channels = before.channels;
  for (const Channel& channel : more.channels) {
    if (before.Find(channel.name) < 0) channels.push_back(channel);
  }
  all->witness = before.witness;
  all->events = before.events;
  all->events.insert(all->events.end(), more.events.begin(), more.events.end());
  all->Reset(std::move(times), std::move(channels));
  for (size_t c = 0; c < all->channels.size(); ++c) {
    const auto column = static_cast<Eigen::Index>(c);
    if (c < before.channels.size()) {
      all->values.col(column).head(kept) = before.values.col(column).head(kept);
    }
    if (const int from = more.Find(all->channels[c].name); from >= 0) {
      all->values.col(column).tail(more.values.rows()) = more.values.col(from);
    }
  }
}

void Append(RunSummary&& more, RunSummary* all) {
  const double wall_s = all->wall_s + more.wall_s, cpu_s = all->cpu_s + more.cpu_s;
  if (all->ok()) *all = std::move(more);
  all->wall_s = wall_s;
  all->cpu_s = cpu_s;
}

template <typename T, typename Same>
void AppendNew(const std::vector<T>& more, std::vector<T>* all, const Same& same) {
  for (const T& item : more) {
    const bool known = std::ranges::any_of(*all, [&](const T& other) { return same(item, other); });
    if (!known) all->push_back(item);
  }
}

void AppendNew(const std::vector<std::string>& more, std::vector<std::string>* all) {
  AppendNew(more, all, std::equal_to<>());
}

double RootMeanSquare(double a, double count_a, double b, double count_b) {
  return std::sqrt((a * a * count_a + b * b * count_b) / (count_a + count_b));
}

void Join(const PairComparison& more, PairComparison* all) {
  if (!more.compared || !all->compared) {
    if (!all->compared && more.compared) *all = more;
    return;
  }
  const auto n = static_cast<double>(all->force_samples),
             m = static_cast<double>(more.force_samples);
  all->samples += more.samples;
  all->force_samples += more.force_samples;
  all->samples_at_rest += more.samples_at_rest;
  all->from_s = std::fmin(all->from_s, more.from_s);
  all->to_s = std::fmax(all->to_s, more.to_s);
  all->forces_act = all->forces_act || more.forces_act;
  all->digits = std::fmin(all->digits, more.digits);
  for (const auto& [metric, measured] : more.metrics) {
    const auto [at, is_new] = all->metrics.emplace(metric, measured);
    if (!is_new) KeepWorst(&at->second, measured);
  }
  for (const DriveMetrics& drive : more.drives) {
    const auto known = std::ranges::find(all->drives, drive.drive, &DriveMetrics::drive);
    if (known == all->drives.end()) {
      all->drives.push_back(drive);
      continue;
    }
    known->rms_truth = RootMeanSquare(known->rms_truth, n, drive.rms_truth, m);
    known->rms_measured = RootMeanSquare(known->rms_measured, n, drive.rms_measured, m);
    known->nrmse = std::fmax(known->nrmse, drive.nrmse);
    known->max_relative = std::fmax(known->max_relative, drive.max_relative);
    known->digits = std::fmin(known->digits, drive.digits);
    known->floored = known->floored || drive.floored;
    known->factor = known->factor_residual = known->offset_residual = kNan;
    if (!(drive.max_error <= known->max_error)) {
      known->max_error = drive.max_error;
      known->time_s = drive.time_s;
    }
  }
  AppendNew(more.reactions, &all->reactions);
}

void Join(const EnergyAudit& more, EnergyAudit* all) {
  for (const EnergyPart& part : more.parts) {
    const auto known = std::ranges::find(all->parts, part.name, &EnergyPart::name);
    if (known == all->parts.end()) {
      all->parts.push_back(part);
      continue;
    }
    known->end_J += part.end_J;
    known->most_J = std::max(known->most_J, part.most_J);
  }
  if (more.drift.value <= all->drift.value) return;
  std::vector<EnergyPart> parts = std::move(all->parts);
  *all = more;
  all->parts = std::move(parts);
}

void Join(const WitnessMetrics& more, WitnessMetrics* all) {
  for (const auto& [metric, measured] : more.metrics) {
    const auto [at, is_new] = all->metrics.emplace(metric, measured);
    if (!is_new) KeepWorst(&at->second, measured);
  }
  if (more.energy && all->energy) Join(*more.energy, &*all->energy);
  if (more.energy && !all->energy) all->energy = more.energy;
  if (all->derivatives_gap.empty()) all->derivatives_gap = more.derivatives_gap;
  if (all->unresolved.empty()) all->unresolved = more.unresolved;
}

// How much of its limit a check uses; what failed is worse than any that passed.
std::pair<bool, double> UseOf(const CheckResult& check) {
  const double use = check.limit ? check.value / *check.limit : -1.0;
  return {check.limit && !check.pass, std::isnan(use) ? INFINITY : use};
}

void Join(const CheckResult& more, CheckResult* all) {
  // What verifies something in one phase verifies something.
  const bool follows = all->follows && more.follows;
  const std::string insensitive = more.insensitive.empty() ? "" : all->insensitive;
  if (UseOf(more) > UseOf(*all)) *all = more;
  all->follows = follows;
  all->insensitive = insensitive;
}

int Gravity(Verdict verdict) {
  return verdict == Verdict::kDisagree ? 2 : verdict == Verdict::kNotRun ? 1 : 0;
}

template <typename T, typename Key>
void JoinEach(const std::vector<T>& more, std::vector<T>* all, const Key& key) {
  for (const T& item : more) {
    const auto known =
        std::ranges::find_if(*all, [&](const T& other) { return key(other) == key(item); });
    if (known == all->end()) {
      all->push_back(item);
    } else {
      Join(item, &*known);
    }
  }
}

// A caveat that all phases have in the same words is one of the whole.
void JoinCaveats(const std::vector<PhaseRun>& runs, std::vector<Caveat>* all) {
  all->clear();
  for (const PhaseRun& run : runs) {
    for (Caveat caveat : run.report.comparison.caveats) {
      const auto same = [&](const Caveat& other) { return other.text == caveat.text; };
      const bool everywhere = std::ranges::all_of(runs, [&](const PhaseRun& other) {
        return std::ranges::any_of(other.report.comparison.caveats, same);
      });
      if (!everywhere) caveat.text = InPhase(run.phase, caveat.text);
      if (std::ranges::none_of(*all, same)) all->push_back(std::move(caveat));
    }
  }
}

Comparison JoinComparisons(const std::vector<PhaseRun>& runs) {
  Comparison all = runs.front().report.comparison;
  const PhaseRun* worst = &runs.front();
  for (const PhaseRun& run : runs) {
    const Comparison& more = run.report.comparison;
    if (Gravity(more.verdict) > Gravity(worst->report.comparison.verdict)) worst = &run;
    if (&run == &runs.front()) continue;
    JoinEach(more.pairs, &all.pairs, [](const PairComparison& pair) { return pair.name(); });
    JoinEach(more.witnesses, &all.witnesses, [](const WitnessMetrics& w) { return w.witness; });
    JoinEach(more.checks, &all.checks, [](const CheckResult& check) { return check.name; });
    AppendNew(more.not_compared, &all.not_compared, [](const NotCompared& a, const NotCompared& b) {
      return a.what == b.what && a.why == b.why;
    });
  }
  JoinCaveats(runs, &all.caveats);
  const Comparison& decides = worst->report.comparison;
  all.verdict = decides.verdict;
  all.reason = decides.verdict == Verdict::kAgree
                   ? fmt::format("{} phases, taken together: {}", runs.size(), CountText(all))
                   : InPhase(worst->phase, decides.reason);
  all.attribution = decides.attribution;
  if (!all.attribution.text.empty() && decides.verdict != Verdict::kAgree) {
    all.attribution.text = InPhase(worst->phase, all.attribution.text);
  }
  return all;
}

PhaseLine LineOf(const PhaseRun& run) {
  const Comparison& comparison = run.report.comparison;
  PhaseLine line{.name = run.phase.name,
                 .from_s = run.phase.from_s,
                 .to_s = run.phase.to_s,
                 .contacts = run.phase.contacts,
                 .verdict = comparison.verdict,
                 .reason = comparison.reason};
  const CheckResult* worst = nullptr;
  for (const CheckResult& check : comparison.checks) {
    if (check.limit && (worst == nullptr || UseOf(check) > UseOf(*worst))) worst = &check;
  }
  if (worst != nullptr) {
    line.worst_check = worst->name;
    line.worst_use = UseOf(*worst).second;
  }
  return line;
}

void Join(SingularApproaches&& more, SingularApproaches* all) {
  all->poses += more.poses;
  for (SingularApproach& approach : more.of) {
    const auto known = std::ranges::find(all->of, approach.kind, &SingularApproach::kind);
    if (known == all->of.end()) {
      all->of.push_back(std::move(approach));
    } else if (approach.distance < known->distance) {
      *known = std::move(approach);
    }
  }
}

void Join(const Timing& more, Timing* all) {
  all->analytic_s += more.analytic_s;
  all->reference_s += more.reference_s;
  all->simulation_s += more.simulation_s;
  all->stock_s += more.stock_s;
  all->foreign_s += more.foreign_s;
  all->loop_s += more.loop_s;
  all->steps += more.steps;
}

void Join(WitnessRecord&& more, std::vector<WitnessRecord>* all) {
  const auto known = std::ranges::find(*all, more.name, &WitnessRecord::name);
  if (known == all->end()) {
    all->push_back(std::move(more));
    return;
  }
  Append(more.trace, &known->trace);
  if (known->summary.ok()) known->gap = more.gap;
  Append(std::move(more.summary), &known->summary);
}

// Motors over the joined traces; a row between two phases is that of the phase that begins.
void SizeMotors(const Mechanism& mechanism, const std::vector<PhaseRun>& runs, Report* all) {
  std::vector<DriveFacts> facts(mechanism.motors.size());
  const auto append = [&](const Report& report, bool last, size_t k) {
    if (k >= report.drive_facts.size()) return;
    const DriveAtRest& more = report.drive_facts[k].at_rest;
    DriveAtRest* rest = &facts[k].at_rest;
    const Eigen::Index at = rest->force.size(), rows = more.force.size() - (last ? 0 : 1);
    if (rows <= 0) return;
    for (const auto& [from, to] :
         {std::pair{&more.force, &rest->force}, std::pair{&more.energy_J, &rest->energy_J}}) {
      to->conservativeResize(at + rows);
      to->tail(rows) = from->head(rows);
    }
  };
  for (size_t k = 0; k < facts.size(); ++k) {
    append(*all, runs.size() == 1, k);
    for (size_t r = 1; r < runs.size(); ++r) append(runs[r].report, r + 1 == runs.size(), k);
  }
  std::vector<MotorLoad> before = std::move(all->motor_loads);
  all->motor_loads.clear();
  all->link_loads.clear();
  all->drive_facts = facts;
  for (const WitnessRecord& record : all->witnesses) {
    const auto measured = std::ranges::find(before, record.name, &MotorLoad::witness);
    if (measured == before.end()) continue;
    std::string unresolved = measured->unresolved;
    for (const PhaseRun& run : runs) {
      for (const MotorLoad& part : run.report.motor_loads) {
        if (part.witness == record.name && unresolved.empty()) unresolved = part.unresolved;
      }
    }
    AddMotorLoads(mechanism, record, unresolved, all);
  }
}

}  // namespace

Report JoinPhases(const Mechanism& mechanism, std::vector<PhaseRun>* runs) {
  Comparison comparison = JoinComparisons(*runs);
  std::vector<PhaseLine> phases;
  for (const PhaseRun& run : *runs) phases.push_back(LineOf(run));
  Report all;
  for (PhaseRun& run : *runs) {
    Report& more = run.report;
    for (ContactLoad& load : more.contact_loads) load.phase = run.phase.name;
    if (&run == &runs->front()) {
      all = std::move(more);
      continue;
    }
    std::set<std::string> known;
    for (const Finding& finding : all.findings.findings()) known.insert(ToText(finding));
    for (const Finding& finding : more.findings.findings()) {
      if (known.insert(ToText(finding)).second) all.findings.Add(finding);
    }
    for (WitnessRecord& record : more.witnesses) Join(std::move(record), &all.witnesses);
    AppendNew(more.drives_not_unique, &all.drives_not_unique);
    AppendNew(more.simulated_not_unique, &all.simulated_not_unique);
    AppendNew(more.reactions_not_unique, &all.reactions_not_unique);
    AppendNew(more.sheets, &all.sheets,
              [](const SignalSheet& a, const SignalSheet& b) { return a.signal == b.signal; });
    Join(std::move(more.singular), &all.singular);
    Join(more.timing, &all.timing);
    std::ranges::move(more.contact_loads, std::back_inserter(all.contact_loads));
    for (size_t d = 0; d < std::min(all.smoothed_forces.size(), more.smoothed_forces.size()); ++d) {
      SmoothedForce& force = all.smoothed_forces[d];
      const SmoothedForce& other = more.smoothed_forces[d];
      const double before_s = run.phase.from_s, lasts_s = run.phase.to_s - run.phase.from_s;
      force.rms = RootMeanSquare(force.rms, before_s, other.rms, lasts_s);
      force.change_rms = RootMeanSquare(force.change_rms, before_s, other.change_rms, lasts_s);
      force.change_max = std::max(force.change_max, other.change_max);
    }
  }
  SizeMotors(mechanism, *runs, &all);
  all.comparison = std::move(comparison);
  all.phases = std::move(phases);
  all.duration_s = runs->back().phase.end_s;
  return all;
}

std::optional<SimulationRun> JoinSimulations(std::vector<PhaseRun>* runs) {
  std::optional<SimulationRun> all;
  for (PhaseRun& run : *runs) {
    if (!run.simulation) return all;
    if (!all) {
      all = std::move(run.simulation);
      continue;
    }
    const bool shared = !all->trace.time_s.empty() && !run.simulation->trace.time_s.empty() &&
                        all->trace.time_s.back() >= run.simulation->trace.time_s.front();
    if (shared && !all->X_WB.empty()) all->X_WB.pop_back();
    Append(run.simulation->trace, &all->trace);
    std::ranges::move(run.simulation->X_WB, std::back_inserter(all->X_WB));
    Append(std::move(run.simulation->summary), &all->summary);
    all->steps += run.simulation->steps;
  }
  return all;
}

}  // namespace mbv
