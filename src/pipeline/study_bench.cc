#include "pipeline/study_bench.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/files.h"
#include "core/in_children.h"
#include "core/inputs.h"
#include "core/shell_word.h"
#include "core/text.h"
#include "core/word_hints.h"
#include "pipeline/study_validation.h"
#include "pipeline/study_values.h"
#include "pipeline/version.h"
#include "scenario/study_file.h"

namespace mbv {
namespace {

std::string FirstErrorText(const Diagnostics& diagnostics) {
  for (const Finding& finding : diagnostics.findings()) {
    if (finding.severity == Severity::kError) return finding.message;
  }
  return "";
}

// One computation: of the scenario as it is, or of a point.
struct Attempt {
  Diagnostics diagnostics;
  std::optional<Prepared> prepared;
  StudyRun run;
};

// Peaks and means over samples that do not resolve the motion keep a limit or violate it by chance.
// What compares two witnesses, or closes a loop, is judged at the samples themselves.
bool LimitsSamples(const Study& study) {
  return std::ranges::any_of(study.limits, [&](const StudyLimit& limit) {
    return !study.quantities[limit.quantity].is_check();
  });
}

// Not moved: the run refers to what was prepared.
void Try(const Study& study, const std::vector<SetValue>& sets, Attempt* attempt, PointRow* row) {
  row->values.assign(study.quantities.size(), kNan);
  attempt->prepared = Prepare(study.scenario, {.set = sets}, &attempt->diagnostics);
  if (!attempt->prepared) {
    row->exit_code = 2;
    row->reason = FirstErrorText(attempt->diagnostics);
    return;
  }
  attempt->run = RunStudyWitnesses(*attempt->prepared, study.witnesses);
  row->reason = attempt->run.failure;
  std::optional<Verdict> verdict;
  if (row->reason.empty()) {
    StudyMeasures measures = MeasureQuantities(attempt->run, study.quantities);
    row->values = std::move(measures.values);
    verdict = measures.verdict;
    for (size_t k = 0; k < row->values.size() && row->reason.empty(); ++k) {
      if (!std::isfinite(row->values[k])) row->reason = study.quantities[k].name + " has no value";
    }
    if (row->reason.empty() && verdict == Verdict::kNotRun) row->reason = measures.reason;
    if (row->reason.empty() && LimitsSamples(study)) {
      row->reason = UnresolvedBySamples(attempt->run);
      if (!row->reason.empty()) row->values.assign(study.quantities.size(), kNan);
    }
  }
  row->exit_code = !row->reason.empty() ? 3 : verdict == Verdict::kDisagree ? 1 : 0;
}

// The drive forces that the first witness records; at times of `only`, if that is given.
StudyForces ForcesOf(const Trace& trace, const Trace* only) {
  StudyForces forces;
  for (const Channel& channel : trace.channels) {
    if (channel.quantity != Quantity::kForce) continue;
    forces.drives.push_back(channel.subject);
    forces.units.push_back(channel.unit);
  }
  std::vector<size_t> rows;
  for (size_t row = 0; row < trace.time_s.size(); ++row) {
    if (only != nullptr &&
        !std::binary_search(only->time_s.begin(), only->time_s.end(), trace.time_s[row])) {
      continue;
    }
    rows.push_back(row);
  }
  const size_t samples = rows.size(), times = std::min(samples, kBandTimes);
  for (size_t k = 0; k < times; ++k) {
    const size_t row = rows[times == 1 ? 0 : k * (samples - 1) / (times - 1)];
    forces.samples.push_back(static_cast<Eigen::Index>(row));
    forces.time_s.push_back(trace.time_s[row]);
  }
  return forces;
}

// NaN where the trace has other samples than the nominal one.
std::vector<float> ForceSamples(const StudyForces& forces, const Trace* trace) {
  std::vector<float> samples(forces.size(), std::numeric_limits<float>::quiet_NaN());
  if (trace == nullptr) return samples;
  for (size_t d = 0; d < forces.drives.size(); ++d) {
    const int column = trace->Find(Quantity::kForce, forces.drives[d]);
    for (size_t k = 0; k < forces.time_s.size() && column >= 0; ++k) {
      const Eigen::Index row = forces.samples[k];
      const bool same =
          row < trace->values.rows() && trace->time_s[static_cast<size_t>(row)] == forces.time_s[k];
      if (!same) continue;
      samples[d * forces.time_s.size() + k] = static_cast<float>(trace->values(row, column));
    }
  }
  return samples;
}

const Trace* FirstTrace(const Attempt& attempt) {
  return attempt.run.failure.empty() && !attempt.run.witnesses.empty()
             ? &attempt.run.witnesses.front()->trace
             : nullptr;
}

// Count and seed may be others than the file's.
std::string FingerprintOf(const std::vector<InputFile>& files, const Design& design) {
  Fingerprint fingerprint;
  fingerprint.Add(fmt::format("{} {}", design.count, design.seed));
  for (const InputFile& file : files) fingerprint.Add(file.fingerprint);
  for (const auto& [name, version] : Versions()) fingerprint.Add(name + " " + version);
  return fingerprint.Text();
}

Finding FindingAt(const Study& study, int line, int column, std::string message, std::string hint) {
  return {Severity::kError, study.file, line, column, std::move(message), std::move(hint)};
}

}  // namespace

std::unique_ptr<StudyBench> StudyBench::Make(const Study& study, Diagnostics* diagnostics,
                                             int* exit_code) {
  *exit_code = 2;
  const InputWatch watch;
  (void)LoadStudy(study.file, {.many = true});  // for the watch
  std::unique_ptr<StudyBench> bench(new StudyBench(study));
  bench->CheckKeys(diagnostics);
  Attempt attempt;
  PointRow& row = bench->nominal_.row;
  Try(study, bench->SetsOf({}), &attempt, &row);
  for (const Factor& factor : study.factors) row.varied.push_back(factor.axis.nominal);
  diagnostics->Append(attempt.diagnostics);
  if (!attempt.prepared) return nullptr;
  if (!attempt.run.failure.empty()) {
    *exit_code = 3;
    diagnostics->AddError(study.scenario, "cannot run with nothing varied: " + row.reason,
                          "mbverify run shows why");
    return nullptr;
  }
  const std::string unresolved = LimitsSamples(study) ? UnresolvedBySamples(attempt.run) : "";
  if (!unresolved.empty()) {
    *exit_code = 3;
    diagnostics->AddError(study.scenario,
                          "limits cannot be judged with nothing varied: " + unresolved,
                          "a smaller motion.sample_s resolves it");
    return nullptr;
  }
  std::vector<std::string> channels;
  for (const WitnessRecord* record : attempt.run.witnesses) {
    for (const Channel& channel : record->trace.channels) channels.push_back(channel.name);
  }
  bench->CheckQuantities(channels, diagnostics);
  if (diagnostics->has_errors()) return nullptr;
  bench->Measure(*attempt.prepared, attempt.run, diagnostics);
  if (diagnostics->has_errors()) return nullptr;
  bench->nominal_.forces = ForceSamples(bench->forces_, FirstTrace(attempt));
  bench->fingerprint_ = FingerprintOf(watch.files(), study.design);
  bench->inputs_ = watch.files();
  *exit_code = 0;
  return bench;
}

// The nominal forces, and what they are validated against.
void StudyBench::Measure(const Prepared& prepared, const StudyRun& run, Diagnostics* diagnostics) {
  const Trace& trace = run.witnesses.front()->trace;
  if (!study_.validation) {
    forces_ = ForcesOf(trace, nullptr);
    return;
  }
  steps_ = run.witnesses.front()->name == role::kSimulated && prepared.scenario.simulation.forward;
  const AlignedTable table = TableOf(prepared);
  forces_ = ForcesOf(trace, &table.trace);
  measured_ = MeasureForces(table, run, forces_, *study_.validation);
  if (!measured_.drives.empty()) return;
  diagnostics->Add(FindingAt(
      study_, study_.validation->line, study_.validation->column,
      fmt::format("validation: {} has no drive force at any sample of the motion", table.name),
      "its columns: DRIVE.force"));
}

// Keys that the scenario does not state: whoever reads scenarios says what they mean.
void StudyBench::CheckKeys(Diagnostics* diagnostics) const {
  const std::vector<double> first = points_.At(0);
  for (size_t k = 0; k < study_.factors.size(); ++k) {
    const Factor& factor = study_.factors[k];
    if (!std::isnan(factor.axis.nominal)) continue;
    const SetValue set{factor.key, fmt::format("{:.17g}", first[k])};
    const ScenarioResult loaded = LoadScenario(study_.scenario, {.set = {set}});
    for (const Finding& finding : loaded.diagnostics.findings()) {
      if (!finding.file.starts_with("--set ") || finding.severity != Severity::kError) continue;
      diagnostics->Add(FindingAt(study_, factor.line, factor.column,
                                 fmt::format("vary.{}: {}", factor.name, finding.message),
                                 finding.hint));
    }
  }
}

// What has no value with nothing varied is asked of the wrong witnesses, or misspelt.
void StudyBench::CheckQuantities(const std::vector<std::string>& channels,
                                 Diagnostics* diagnostics) const {
  for (size_t k = 0; k < study_.quantities.size(); ++k) {
    const StudyQuantity& quantity = study_.quantities[k];
    if (std::isfinite(nominal_.row.values[k])) continue;
    std::string message, hint;
    if (!quantity.is_check() && !Contains(channels, quantity.channel)) {
      message = fmt::format("quantities: no witness records '{}'", quantity.channel);
      hint = DidYouMean(quantity.channel, channels, "witnesses: " + Joined(study_.witnesses));
    } else {
      message = fmt::format("quantities: {} has no value with nothing varied", quantity.name);
      const MetricRow* row = FindMetric(quantity.name);
      if (row != nullptr && row->of_pair) hint = "it compares two witnesses: name both";
      if (row != nullptr && row->metric == Metric::kMotorUse) hint = "the model states no motors";
    }
    diagnostics->Add(FindingAt(study_, quantity.line, quantity.column, message, hint));
  }
}

std::vector<SetValue> StudyBench::SetsOf(const std::vector<double>& varied) const {
  std::vector<SetValue> sets;
  for (size_t k = 0; k < varied.size(); ++k) {
    sets.emplace_back(study_.factors[k].key, fmt::format("{:.17g}", varied[k]));
  }
  const std::string mode = ModeOf(study_.witnesses);
  if (!mode.empty()) sets.emplace_back("simulation.mode", mode);
  return sets;
}

// Per quantity '1' where it is another than with nothing varied, else '0'.
std::string StudyBench::MovedBy(size_t factor) const {
  std::string moved(study_.quantities.size(), '0');
  const std::vector<double> ends = Excursions(study_.factors[factor].axis.distribution);
  for (const double end : {ends.front(), ends.back()}) {
    if (moved.find('0') == std::string::npos) break;
    std::vector<SetValue> sets = SetsOf({});
    sets.emplace_back(study_.factors[factor].key, fmt::format("{:.17g}", end));
    Attempt attempt;
    PointRow row;
    Try(study_, sets, &attempt, &row);
    for (size_t k = 0; k < moved.size(); ++k) {
      if (row.values[k] != nominal_.row.values[k]) moved[k] = '1';  // NaN, too
    }
  }
  return moved;
}

void StudyBench::FindIdle(double timeout_s, Diagnostics* diagnostics) {
  const auto found = InChildren(study_.factors.size(), 2.0 * timeout_s,
                                [&](size_t factor) { return MovedBy(factor); });
  std::vector<bool> moved(study_.quantities.size(), false);
  for (size_t f = 0; f < found.size(); ++f) {
    const Factor& factor = study_.factors[f];
    const std::string by = found[f].value_or(std::string(moved.size(), '1'));
    for (size_t k = 0; k < moved.size(); ++k) moved[k] = moved[k] || by[k] == '1';
    if (by.find('1') != std::string::npos) continue;
    idle_.push_back(factor.name);
    Finding finding = FindingAt(
        study_, factor.line, factor.column,
        fmt::format("vary.{}: moves no quantity of this study: with it alone at its ends, every "
                    "value is that of nothing varied",
                    factor.name),
        fmt::format("the quantities of {} do not depend on it; ask for others, or leave it out",
                    Joined(study_.witnesses)));
    finding.severity = Severity::kWarning;
    diagnostics->Add(std::move(finding));
  }
  for (const StudyLimit& limit : study_.limits) {
    if (moved[limit.quantity]) continue;
    const StudyQuantity& quantity = study_.quantities[limit.quantity];
    diagnostics->Add(FindingAt(
        study_, quantity.line, quantity.column,
        fmt::format("limits.{}: none of the varied numbers moves it, so that every point keeps "
                    "it or none does",
                    quantity.name),
        "vary what it depends on, or ask witnesses that read what is varied"));
  }
}

StudyPoint StudyBench::Run(std::uint64_t number) const {
  StudyPoint point;
  point.row.point = number;
  point.row.varied = points_.At(number);
  Attempt attempt;
  Try(study_, SetsOf(point.row.varied), &attempt, &point.row);
  point.forces = ForceSamples(forces_, FirstTrace(attempt));
  return point;
}

StudyPoint StudyBench::Lost(std::uint64_t number, const std::string& reason) const {
  StudyPoint point;
  point.row = {.point = number,
               .exit_code = 3,
               .reason = reason,
               .varied = points_.At(number),
               .values = std::vector<double>(study_.quantities.size(), kNan)};
  point.forces = ForceSamples(forces_, nullptr);
  return point;
}

std::string StudyBench::Command(const std::vector<double>& varied) const {
  std::string command = "mbverify run " + ShellWord(study_.scenario);
  for (const auto& [key, value] : SetsOf(varied))
    command += " --set " + ShellWord(key + "=" + value);
  return command;
}

}  // namespace mbv
