#include "features/study/study_bench.h"

#include <fmt/format.h>
#include <malloc.h>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>
#include <fstream>
#include <functional>
#include <limits>
#include <optional>

#include "base/files.h"
#include "base/inputs.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "comparison/comparison.h"
#include "comparison/motor_load.h"
#include "features/convergence/converge.h"
#include "features/study/study.h"
#include "features/study/study_file.h"
#include "kinematics/mobility.h"
#include "verify/version.h"

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

// Peaks, means and margins of motors over samples that do not resolve the motion are chance. What
// compares two witnesses, or closes a loop, is judged at the samples themselves; so is a last
// value.
bool IsOverSamples(const StudyQuantity& quantity) {
  if (!quantity.is_check()) return quantity.statistic != Statistic::kEnd;
  return FindMetric(quantity.name)->metric == Metric::kMotorUse;
}

bool LimitsSamples(const Study& study) {
  return std::ranges::any_of(study.limits, [&](const StudyLimit& limit) {
    return IsOverSamples(study.quantities[limit.quantity]);
  });
}

// What a run says of a study's quantities.
void Measure(const Study& study, const StudyRun& run, PointRow* row) {
  row->values.assign(study.quantities.size(), kNan);
  row->reason = run.failure;
  std::optional<Verdict> verdict;
  if (row->reason.empty()) {
    StudyMeasures measures = MeasureQuantities(run, study.quantities);
    row->values = std::move(measures.values);
    verdict = measures.verdict;
    for (size_t k = 0; k < row->values.size() && row->reason.empty(); ++k) {
      if (!std::isfinite(row->values[k])) row->reason = study.quantities[k].name + " has no value";
    }
    if (row->reason.empty() && verdict == Verdict::kNotRun) row->reason = measures.reason;
    if (row->reason.empty() && LimitsSamples(study)) {
      row->reason = UnresolvedBySamples(run);
      if (!row->reason.empty()) row->values.assign(study.quantities.size(), kNan);
    }
  }
  row->exit_code = !row->reason.empty() ? 3 : verdict == Verdict::kDisagree ? 1 : 0;
}

// Not moved: the run refers to what was prepared.
void Try(const Study& study, const std::vector<SetValue>& sets, ScenarioMemory* memory,
         Attempt* attempt, PointRow* row) {
  attempt->prepared =
      Prepare(LoadScenario(study.scenario, {.set = sets}, memory), &attempt->diagnostics);
  if (!attempt->prepared) {
    row->values.assign(study.quantities.size(), kNan);
    row->exit_code = 2;
    row->reason = FirstErrorText(attempt->diagnostics);
    return;
  }
  attempt->run = RunStudyWitnesses(*attempt->prepared, study.witnesses);
  Measure(study, attempt->run, row);
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

const Trace* FirstTrace(const StudyRun& run) {
  return run.failure.empty() && !run.witnesses.empty() ? &run.witnesses.front()->trace : nullptr;
}

// The reference alone needs no closed form: it is then not made for each point, where nothing in
// the scenario refers to it.
bool NeedsNoClosedForm(const Study& study, const Prepared& prepared) {
  return study.witnesses == std::vector<std::string>{role::kReference.name} &&
         prepared.scenario.reference.on && prepared.scenario.figures.empty() &&
         std::ranges::none_of(study.factors, [](const Factor& factor) {
           return factor.key.starts_with("analytic");
         });
}

Finding FindingAt(const Study& study, int line, int column, std::string message, std::string hint) {
  return {Severity::kError, study.file, line, column, std::move(message), std::move(hint)};
}

}  // namespace

// Where points differ in numbers of commands and loads alone, everything else stays prepared, and
// the traces of a point take the place of those of the point before.
struct StudyBench::Kept {
  std::vector<MotionNumber> numbers;  // per factor
  Prepared prepared;
  StudyRun run;

  // False where such numbers have to be read to say what is wrong with them.
  [[nodiscard]] bool Put(const std::vector<double>& varied) {
    Diagnostics diagnostics;
    for (size_t k = 0; k < varied.size(); ++k) {
      if (!numbers[k].Put(varied[k], &prepared.scenario.motion)) return false;
    }
    return PrepareAgain(&prepared, &diagnostics);
  }
};

StudyBench::StudyBench(Study study) : study_(std::move(study)), points_(study_.Points()) {}
StudyBench::~StudyBench() = default;

void StudyBench::Keep() {
  Diagnostics diagnostics;
  auto prepared = Prepare(
      LoadScenario(study_.scenario, {.set = SetsOfPoint(points_.At(0))}, &memory_), &diagnostics);
  if (!prepared || prepared->scenario.phase) return;
  auto kept = std::make_unique<Kept>(
      Kept{.numbers = {}, .prepared = *std::move(prepared), .run = {.runs = {}, .failure = {}}});
  const Motion& motion = kept->prepared.scenario.motion;
  if (motion.free()) return;  // it may begin where its commands are
  for (const Factor& factor : study_.factors) {
    const auto number = memory_.FindMotionNumber(factor.key, motion);
    if (!number) return;
    kept->numbers.push_back(*number);
  }
  kept_ = std::move(kept);
}

std::unique_ptr<StudyBench> StudyBench::Make(const Study& study, Diagnostics* diagnostics,
                                             int* exit_code) {
  *exit_code = 2;
  const InputWatch watch;
  (void)LoadStudy(study.file, {.many = true});  // for the watch
  std::unique_ptr<StudyBench> bench(new StudyBench(study));
  bench->CheckKeys(diagnostics);
  Attempt attempt;
  PointRow& row = bench->nominal_.row;
  Try(study, bench->SetsOf({}), &bench->memory_, &attempt, &row);
  for (const Factor& factor : study.factors) row.varied.push_back(factor.axis.nominal);
  diagnostics->Append(attempt.diagnostics);
  if (!attempt.prepared) return nullptr;
  if (!attempt.run.failure.empty()) {
    *exit_code = 3;
    diagnostics->AddError(study.scenario, "cannot run with nothing varied: " + row.reason,
                          "mbverify run shows why");
    return nullptr;
  }
  const bool over_samples = std::ranges::any_of(study.quantities, IsOverSamples);
  const std::string unresolved = over_samples ? UnresolvedBySamples(attempt.run) : "";
  if (!unresolved.empty() && !LimitsSamples(study)) {
    Finding finding = FindingAt(study, 0, 0, "", "a smaller motion.sample_s resolves it");
    finding.file = study.scenario;
    finding.message =
        "peaks and means are those of the samples alone, with nothing varied: " + unresolved;
    finding.severity = Severity::kWarning;
    diagnostics->Add(std::move(finding));
  } else if (!unresolved.empty()) {
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
  bench->nominal_.forces = ForceSamples(bench->forces_, FirstTrace(attempt.run));
  bench->without_closed_form_ = NeedsNoClosedForm(study, *attempt.prepared);
  bench->Keep();
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
  steps_ =
      run.witnesses.front()->name == role::kSimulated && prepared.scenario.simulation.forward();
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
    const ScenarioResult loaded = LoadScenario(study_.scenario, {.set = {set}}, &memory_);
    for (const Finding& finding : loaded.diagnostics.findings()) {
      if (finding.set.first.empty() || finding.severity != Severity::kError) continue;
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
    Try(study_, sets, &memory_, &attempt, &row);
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

// Without what no witness of the study reads.
std::vector<SetValue> StudyBench::SetsOfPoint(const std::vector<double>& varied) const {
  std::vector<SetValue> sets = SetsOf(varied);
  if (without_closed_form_) sets.emplace_back("analytic", "off");
  return sets;
}

// Count and seed may differ from the file's.
std::string StudyBench::FingerprintOf(std::uint64_t count) const {
  Fingerprint fingerprint;
  fingerprint.Add(fmt::format("{} {}", count, study_.design.seed));
  for (const InputFile& file : inputs_) fingerprint.Add(file.fingerprint);
  for (const auto& [name, version] : Versions()) fingerprint.Add(name + " " + version);
  return fingerprint.Text();
}

StudyPoint StudyBench::Run(std::uint64_t number) const {
  StudyPoint point;
  point.row.point = number;
  point.row.varied = points_.At(number);
  const auto take_forces = [&](const StudyRun& run) {
    if (number < kBandPoints) point.forces = ForceSamples(forces_, FirstTrace(run));
  };
  if (kept_ != nullptr && kept_->Put(point.row.varied)) {
    kept_->run = RunStudyWitnesses(kept_->prepared, study_.witnesses, std::move(kept_->run.runs));
    mbv::Measure(study_, kept_->run, &point.row);
    take_forces(kept_->run);
    return point;
  }
  Attempt attempt;
  Try(study_, SetsOfPoint(point.row.varied), &memory_, &attempt, &point.row);
  take_forces(attempt.run);
  return point;
}

StudyPoint StudyBench::Lost(std::uint64_t number, const std::string& reason) const {
  StudyPoint point;
  point.row = {.point = number,
               .exit_code = 3,
               .reason = reason,
               .varied = points_.At(number),
               .values = std::vector<double>(study_.quantities.size(), kNan)};
  if (number < kBandPoints) point.forces = ForceSamples(forces_, nullptr);
  return point;
}

std::string StudyBench::Command(const std::vector<double>& varied) const {
  std::string command = "mbverify run " + ShellWord(study_.scenario);
  for (const auto& [key, value] : SetsOf(varied))
    command += " --set " + ShellWord(key + "=" + value);
  return command;
}

namespace {

namespace fs = std::filesystem;

std::string BytesOfForces(const StudyPoint& point) {
  return {reinterpret_cast<const char*>(point.forces.data()), point.forces.size() * sizeof(float)};
}

double ProcessorTime() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Once more, alone: what killed the child may have been none of the point's doing.
std::optional<std::string> Again(const std::function<std::string(size_t)>& work, size_t point,
                                 double timeout_s) {
  return InChildren(1, timeout_s, [&](size_t) { return work(point); }).front();
}

// Rows that come fast are written together: a kill loses those of a tenth of a second.
class PendingRows {
 public:
  PendingRows(GrowingFile* csv, GrowingFile* forces) : csv_(*csv), forces_(*forces) {}

  void Add(std::string_view line, std::string_view force_bytes) {
    lines_ += line;
    bytes_ += force_bytes;
  }
  [[nodiscard]] bool due() const {
    constexpr size_t kMostBytes = 1 << 16;
    return lines_.size() + bytes_.size() > kMostBytes ||
           std::chrono::steady_clock::now() - written_ > std::chrono::milliseconds(100);
  }
  // "" or what went wrong.
  [[nodiscard]] std::string Write() {
    std::string trouble = forces_.Append(bytes_);  // first: a row has its forces
    if (trouble.empty()) trouble = csv_.Append(lines_);
    bytes_.clear();
    lines_.clear();
    written_ = std::chrono::steady_clock::now();
    return trouble;
  }

 private:
  GrowingFile &csv_, &forces_;
  std::string lines_, bytes_;
  std::chrono::steady_clock::time_point written_ = std::chrono::steady_clock::now();
};

std::uint64_t FileSize(const fs::path& path) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(path, error);
  return error ? 0 : size;
}

}  // namespace

PointsDone FindDone(const StudyBench& bench, const StudyShare& share, const fs::path& folder) {
  PointsDone done;
  std::ifstream stream(folder / kPointsFile, std::ios::binary);
  std::string line;
  const std::uint64_t record = bench.forces().size() * sizeof(float);
  const std::uint64_t forces = FileSize(folder / kForcesFile);
  if (!std::getline(stream, line) || stream.eof()) return done;
  if (line + "\n" != PointHeader(bench.study())) return done;
  done.csv_bytes = line.size() + 1;
  while (std::getline(stream, line) && !stream.eof()) {  // eof: the line has no end
    const auto row = ReadPointLine(line, bench.study());
    if (!row || row->point != share.number(done.rows)) break;
    const std::uint64_t force_bytes = record * share.records(done.rows + 1);
    if (force_bytes > forces) break;
    ++done.rows;
    done.csv_bytes += line.size() + 1;
    done.force_bytes = force_bytes;
  }
  return done;
}

std::string ComputePoints(const StudyBench& bench, const PointsOptions& options,
                          const PointsDone& done, const fs::path& folder) {
  GrowingFile csv(folder / kPointsFile), forces(folder / kForcesFile);
  std::string trouble = csv.Open(done.csv_bytes);
  if (trouble.empty()) trouble = forces.Open(done.force_bytes);
  if (trouble.empty() && done.csv_bytes == 0) trouble = csv.Append(PointHeader(bench.study()));
  if (!trouble.empty()) return trouble;
  // Each point takes the memory that the one before gave back: it stays with the process.
  mallopt(M_TRIM_THRESHOLD, 1 << 28);
  mallopt(M_MMAP_THRESHOLD, 1 << 25);
  const std::uint64_t all = options.share.size(bench.points().count());
  const auto number = [&](size_t i) { return options.share.number(done.rows + i); };
  const auto work = [&](size_t i) {  // in a child; its time comes first
    const double start_s = ProcessorTime();
    const StudyPoint point = bench.Run(number(i));
    const double cpu_s = ProcessorTime() - start_s;
    return std::string(reinterpret_cast<const char*>(&cpu_s), sizeof cpu_s) +
           PointLine(point.row, bench.study()) + BytesOfForces(point);
  };
  const std::string lost =
      fmt::format("ended by a crash, or not finished after {:g} s", options.timeout_s);
  PendingRows pending(&csv, &forces);
  double cpu_s = 0.0;
  const auto take = [&](size_t i, const std::optional<std::string>& from_child) {
    const auto again = from_child ? std::nullopt : Again(work, i, options.timeout_s);
    if (const auto& text = from_child ? from_child : again) {
      double of_point_s = 0.0;
      std::memcpy(&of_point_s, text->data(), sizeof of_point_s);
      cpu_s += of_point_s;
      const std::string_view rest = std::string_view(*text).substr(sizeof of_point_s);
      const size_t end = rest.find('\n') + 1;
      pending.Add(rest.substr(0, end), rest.substr(end));
    } else {
      const StudyPoint point = bench.Lost(number(i), lost);
      pending.Add(PointLine(point.row, bench.study()), BytesOfForces(point));
    }
    if (pending.due()) trouble = pending.Write();
    if (options.progress)
      options.progress(done.rows + i + 1, all, cpu_s / static_cast<double>(i + 1));
    return trouble.empty();
  };
  StreamFromChildren(all - done.rows,
                     {.parallel = options.jobs, .timeout_s = options.timeout_s, .together = true},
                     work, take);
  if (trouble.empty()) trouble = pending.Write();
  if (trouble.empty()) trouble = forces.Finish();
  return trouble.empty() ? csv.Finish() : trouble;
}

namespace {

const Role& RoleOfWitness(const std::string& name) {
  return name == "analytic"    ? role::kAnalytic
         : name == "reference" ? role::kReference
                               : role::kSimulated;
}

// Measures checks of one run; what several of them need is found once. Several witnesses are
// compared and judged as `mbverify run` does it.
class CheckMeter {
 public:
  explicit CheckMeter(const StudyRun& run) : run_(run), input_(InputOf(*run.prepared)) {
    run.runs.HandOver(&input_);
    input_.drive_facts = DriveFactsOf(*run.prepared);
    input_.reactions_not_unique = ReactionsNotUnique(
        run.prepared->base,
        run.runs.simulation ? run.runs.simulation->X_WB : std::vector<std::vector<Pose>>());
    if (run.witnesses.size() > 1) {
      comparison_ = Compare(input_);
    } else {
      comparison_.witnesses = {MeasureWitness(input_, run.witnesses.front()->trace)};
      comparison_.witnesses.front().witness = run.witnesses.front()->name;
    }
  }

  [[nodiscard]] const Comparison& comparison() const { return comparison_; }

  double Worst(const MetricRow& row) {
    if (row.metric == Metric::kMotorUse) return SmallestMargin();
    Measured worst;
    const auto keep = [&](const std::map<Metric, Measured>& metrics) {
      const auto found = metrics.find(row.metric);
      if (found == metrics.end()) return;
      if (std::isnan(worst.value) || !(found->second.value <= worst.value)) worst = found->second;
    };
    if (row.of_pair) {
      for (const PairComparison& pair : comparison_.pairs) {
        if (IsNamed(pair.measured) && IsNamed(pair.truth)) keep(pair.metrics);
      }
    } else {
      for (const WitnessMetrics& witness : comparison_.witnesses) {
        if (IsNamed(witness.witness)) keep(witness.metrics);
      }
    }
    return worst.value;
  }

 private:
  // Others may have run because these need them.
  [[nodiscard]] bool IsNamed(const std::string& witness) const {
    return std::any_of(run_.witnesses.begin(), run_.witnesses.end(),
                       [&](const WitnessRecord* record) { return record->name == witness; });
  }

  [[nodiscard]] double SmallestMargin() const {
    double largest = kNan;
    const auto keep = [&](std::span<const MotorLoad::Use> uses) {
      const MotorLoad::Use* use = LargestUse(uses);
      if (use != nullptr && !(use->use <= largest)) largest = use->use;
    };
    const Mechanism& mechanism = run_.prepared->base;
    for (const WitnessRecord* record : run_.witnesses) {
      const auto loads = MotorLoadsOf(mechanism, record->trace, input_.drive_facts);
      for (const MotorLoad& load : loads) keep(load.uses);
      if (!mechanism.dc_link) continue;
      if (const auto link = LinkLoadOf(*mechanism.dc_link, loads)) keep(link->uses);
    }
    return 1.0 / largest;
  }

  const StudyRun& run_;
  ComparisonInput input_;
  Comparison comparison_;
};

double OfChannel(const StudyRun& run, const StudyQuantity& quantity) {
  for (const WitnessRecord* record : run.witnesses) {
    const int column = record->trace.Find(quantity.channel);
    if (column >= 0) return StatisticOf(record->trace.values.col(column), quantity.statistic);
  }
  return kNan;
}

// Drives beyond their strokes are no result, unless the scenario says so.
std::string StrokeFailure(const Prepared& prepared, const WitnessRecord& record) {
  if (prepared.scenario.simulation.ignore_ranges) return "";
  const auto violations = DriveViolations(prepared.base, record.trace);
  return violations.empty() ? "" : violations.front().Text();
}

}  // namespace

std::string ModeOf(const std::vector<std::string>& names) {
  for (const char* mode : {"inverse", "forward"}) {
    if (Contains(names, mode)) return mode;
  }
  return "";
}

double StatisticOf(const VecX& samples, Statistic statistic) {
  if (samples.size() == 0 || !samples.allFinite()) return kNan;
  switch (statistic) {
    case Statistic::kMax:
      return samples.maxCoeff();
    case Statistic::kMin:
      return samples.minCoeff();
    case Statistic::kPeak:
      return samples.cwiseAbs().maxCoeff();
    case Statistic::kRms:
      return Rms(samples);
    case Statistic::kMean:
      return samples.mean();
    case Statistic::kEnd:
      return samples[samples.size() - 1];
  }
  return kNan;
}

StudyRun RunStudyWitnesses(const Prepared& prepared, const std::vector<std::string>& names,
                           WitnessRuns reuse) {
  StudyRun result{.prepared = &prepared, .runs = {}, .failure = {}};
  WitnessRunner runner(prepared);
  runner.Reuse(std::move(reuse));
  const auto ran = [&](const Role& role) { return runner.runs().Find(role) != nullptr; };
  for (const std::string& name : names) {
    const Role& role = RoleOfWitness(name);
    if (role.is_engine()) {
      if (!ran(prepared.driver())) runner.Run(prepared.driver());
      if (!runner.CheckStrokes()) continue;
    }
    if (!ran(role)) runner.Run(role);
  }
  result.runs = runner.Take();
  for (const std::string& name : names) {
    const WitnessRecord* record = result.runs.Find(RoleOfWitness(name));
    result.witnesses.push_back(record);
    if (!result.failure.empty()) continue;
    if (!record->summary.ok()) {
      result.failure = name + ": " + record->summary.message;
    } else {
      result.failure = StrokeFailure(prepared, *record);
    }
  }
  return result;
}

std::string UnresolvedBySamples(const StudyRun& run) {
  const ComparisonInput input = InputOf(*run.prepared);
  for (const WitnessRecord* record : run.witnesses) {
    const std::string why = UnresolvedBySamples(input, record->trace);
    if (!why.empty()) return record->name + ": " + why;
  }
  return "";
}

StudyMeasures MeasureQuantities(const StudyRun& run, const std::vector<StudyQuantity>& quantities) {
  StudyMeasures measures;
  std::optional<CheckMeter> meter;
  const auto ready = [&]() -> CheckMeter& {
    if (!meter) meter.emplace(run);
    return *meter;
  };
  for (const StudyQuantity& quantity : quantities) {
    measures.values.push_back(quantity.is_check() ? ready().Worst(*FindMetric(quantity.name))
                                                  : OfChannel(run, quantity));
  }
  if (run.witnesses.size() > 1) {
    measures.verdict = ready().comparison().verdict;
    measures.reason = ready().comparison().reason;
  }
  return measures;
}

namespace {

// A witness' force of a drive at the study's times; empty where it records none.
std::vector<double> ForceAtTimes(const Trace& trace, const std::string& drive,
                                 const StudyForces& forces) {
  std::vector<double> values;
  const int column = trace.Find(Quantity::kForce, drive);
  for (size_t k = 0; k < forces.time_s.size() && column >= 0; ++k) {
    values.push_back(trace.values(forces.samples[k], column));
  }
  return values;
}

// The second witness that computes anything; the table does not.
const WitnessRecord* SecondWitness(const StudyRun& run) {
  for (size_t k = 1; k < run.witnesses.size(); ++k) {
    if (!(run.witnesses[k]->name == role::kReference)) return run.witnesses[k];
  }
  return nullptr;
}

double RmsDifference(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.empty() || a.size() != b.size()) return 0.0;
  double sum = 0.0;
  for (size_t k = 0; k < a.size(); ++k) sum += (a[k] - b[k]) * (a[k] - b[k]);
  return std::sqrt(sum / static_cast<double>(a.size()));
}

// Rows of the table at the study's times.
std::vector<Eigen::Index> RowsOf(const Trace& table, const StudyForces& forces) {
  std::vector<Eigen::Index> rows;
  for (const double time : forces.time_s) {
    const auto found = std::lower_bound(table.time_s.begin(), table.time_s.end(), time);
    rows.push_back(found - table.time_s.begin());
  }
  return rows;
}

// Half the grid convergence index, which covers some 95 %, of the scenario's steps.
std::string FillFromSteps(const StudyBench& bench, std::vector<ForceComparison>* drives) {
  const ConvergeOutcome outcome = Converge(bench.study().scenario, {});
  if (outcome.exit_code > 1) {
    return "u_num: mbverify converge finds none" +
           (outcome.failure.empty() ? "" : ": " + outcome.failure) + "; state validation.u_num";
  }
  for (ForceComparison& forces : *drives) {
    const auto& found = outcome.report.extrapolation.drives;
    const auto drive = std::find_if(found.begin(), found.end(), [&](const ExtrapolatedDrive& d) {
      return d.drive == forces.drive;
    });
    if (drive == found.end() || !std::isfinite(drive->uncertainty)) {
      return fmt::format("u_num: mbverify converge finds none of {}; state validation.u_num",
                         forces.drive);
    }
    forces.u_num = drive->uncertainty / 2.0;
  }
  return "";
}

}  // namespace

AlignedTable TableOf(const Prepared& prepared) {
  return AlignTable(*prepared.scenario.reference.table, prepared.scenario.motion);
}

MeasuredForces MeasureForces(const AlignedTable& table, const StudyRun& run,
                             const StudyForces& forces, const StudyValidation& settings) {
  MeasuredForces measured{.table = table.name, .numerical = {}, .places = {}};
  const WitnessRecord& first = *run.witnesses.front();
  const WitnessRecord* second = SecondWitness(run);
  measured.numerical = settings.u_num      ? "as stated"
                       : second == nullptr ? "0: no step, and no second witness"
                                           : "RMS difference of the first two witnesses";
  const std::vector<Eigen::Index> rows = RowsOf(table.trace, forces);
  for (size_t d = 0; d < forces.drives.size() && !rows.empty(); ++d) {
    const int column = table.trace.Find(Quantity::kForce, forces.drives[d]);
    if (column < 0) continue;
    ForceComparison drive;
    drive.drive = forces.drives[d];
    drive.unit = forces.units[d];
    drive.time_s = forces.time_s;
    drive.computed = ForceAtTimes(first.trace, drive.drive, forces);
    for (const Eigen::Index row : rows) {
      drive.measured.push_back(table.trace.values(row, column));
      drive.u_data.push_back(table.standard(row, column));
    }
    if (settings.u_num) {
      drive.u_num = *settings.u_num;
    } else if (second != nullptr) {
      drive.u_num = RmsDifference(drive.computed, ForceAtTimes(second->trace, drive.drive, forces));
    }
    measured.drives.push_back(std::move(drive));
    measured.places.push_back(d);
  }
  return measured;
}

StudyValidationResult ValidateStudy(const StudyBench& bench, const std::filesystem::path& file) {
  const MeasuredForces& measured = bench.measured();
  StudyValidationResult result{
      .table = measured.table, .numerical = measured.numerical, .trouble = {}};
  std::vector<ForceComparison> drives = measured.drives;
  if (bench.steps() && !bench.study().validation->u_num) {
    result.numerical = "half the grid convergence index of mbverify converge";
    result.trouble = FillFromSteps(bench, &drives);
    if (!result.trouble.empty()) return result;
  }
  for (size_t k = 0; k < drives.size(); ++k) {
    const std::vector<std::vector<float>> records =
        DriveRecords(bench.forces(), measured.places[k], file);
    drives[k].u_input = DeviationsOverPoints(records, drives[k].time_s.size());
    result.drives.push_back(Validate(std::move(drives[k]), *bench.study().validation));
  }
  return result;
}

}  // namespace mbv
