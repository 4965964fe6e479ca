#include "features/paper/packed_run.h"

#include <fmt/format.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "base/files.h"
#include "base/inputs.h"
#include "base/output_folder.h"
#include "base/text.h"
#include "base/worker_pool.h"
#include "comparison/compare_stiffness.h"
#include "features/benchmark/benchmark.h"
#include "features/paper/figures.h"
#include "features/paper/rerun_report.h"
#include "features/run/run_scenario.h"
#include "features/stiffness/stiffness.h"
#include "features/study/study.h"
#include "features/study/study_file.h"
#include "math/bytes.h"
#include "mechanism/channels.h"
#include "model_file/mesh/read_mesh.h"
#include "scenario/tables/table.h"
#include "scenario/tables/text.h"
#include "verify/check_file.h"
#include "verify/prepare.h"
#include "verify/run_witnesses.h"

namespace mbv {

namespace {

// Tables of numbers among results, an archive's against those of its repetition.

constexpr const char* kTraces = "traces.csv";
constexpr const char* kStiffness = "stiffness.csv";
constexpr const char* kLoads = "loads.csv";
constexpr const char* kPoints = "points.csv";
constexpr const char* kValues = "values.csv";
constexpr const char* kBenchmark = "benchmark";

// A CSV file of ours: a heading, then rows of as many cells. Refers to its text.
struct OwnTable {
  std::vector<std::string> heading;
  std::vector<std::vector<std::string>> rows;

  [[nodiscard]] std::vector<double> Column(size_t c) const {
    std::vector<double> values;
    for (const auto& row : rows) {
      const CellNumber cell = ReadCell(row[c], false);
      values.push_back(cell.kind == CellNumber::Kind::kNumber ? cell.value : kNan);
    }
    return values;
  }
};

std::optional<OwnTable> CutOwn(const std::string& text) {
  OwnTable table;
  CutLine cut;
  for (size_t from = 0; from < text.size();) {
    const size_t to = std::min(text.find('\n', from), text.size());
    CutCells(std::string_view(text).substr(from, to - from), ',', &cut);
    std::vector<std::string> cells;
    for (const TableCell& cell : cut.cells) cells.emplace_back(cell.text);
    from = to + 1;
    if (table.heading.empty()) {
      table.heading = std::move(cells);
    } else if (cells.size() == table.heading.size()) {
      table.rows.push_back(std::move(cells));
    } else {
      return {};
    }
  }
  return table;
}

// Both sides of one file, with the same heading and number of rows.
struct BothTables {
  OwnTable packed, rerun;
};
std::optional<BothTables> CutBoth(const std::string& path, const PackedResults& packed,
                                  const PackedResults& rerun, std::string* why) {
  const auto before = packed.find(path), now = rerun.find(path);
  if (before == packed.end() || now == rerun.end()) return {};
  auto a = CutOwn(before->second), b = CutOwn(now->second);
  if (!a || !b) {
    *why = "is not a table: rows of other lengths than the heading";
  } else if (a->heading != b->heading) {
    *why = "has other columns";
  } else if (a->rows.size() != b->rows.size()) {
    *why = fmt::format("has {} rows in the archive, {} now", a->rows.size(), b->rows.size());
  }
  if (!why->empty()) return {};
  return BothTables{*std::move(a), *std::move(b)};
}

// The channel that a column shows, by its name without the witness.
std::map<std::string, Channel> ChannelsOf(const Mechanism& mechanism) {
  std::map<std::string, Channel> known;
  const auto add = [&](std::vector<Channel> channels) {
    for (Channel& channel : channels) known.emplace(channel.name, channel);
  };
  add(TableSignals(mechanism));
  for (const Output& output : mechanism.outputs) add(OutputRateChannels(mechanism, output));
  add(AuditChannels());
  add(EnergyChannels());
  add(WorkChannels(mechanism));
  return known;
}

class TraceComparison {
 public:
  TraceComparison(const Prepared& prepared, const BothTables& tables)
      : input_(InputOf(prepared)), tables_(tables), known_(ChannelsOf(prepared.base)) {
    for (const ForeignWitness& witness : prepared.scenario.witnesses) {
      foreign_.emplace(witness.name, witness.limits);
    }
  }

  std::vector<RerunSignal> Compare(std::string* why) {
    if (tables_.packed.Column(0) != tables_.rerun.Column(0)) *why = "has other times";
    SortColumns();
    std::vector<RerunSignal> signals;
    for (const auto& [witness, columns] : columns_) {
      const auto more = CompareReruns(input_, TraceOf(tables_.packed, witness, columns),
                                      TraceOf(tables_.rerun, witness, columns), LimitsOf(witness));
      signals.insert(signals.end(), more.begin(), more.end());
    }
    return signals;
  }

 private:
  // By witness, the last word of a column's name.
  void SortColumns() {
    for (size_t c = 1; c < tables_.packed.heading.size(); ++c) {
      const std::string& name = tables_.packed.heading[c];
      columns_[name.substr(name.rfind('.') + 1)].push_back(c);
    }
  }

  [[nodiscard]] Trace TraceOf(const OwnTable& table, const std::string& witness,
                              const std::vector<size_t>& columns) const {
    Trace trace;
    trace.witness = witness;
    std::vector<Channel> channels;
    for (const size_t c : columns) {
      const std::string& name = table.heading[c];
      const std::string signal = name.substr(0, name.size() - witness.size() - 1);
      channels.push_back(ChannelOf(signal));
    }
    trace.Reset(table.Column(0), std::move(channels));
    for (size_t k = 0; k < columns.size(); ++k) {
      const std::vector<double> values = table.Column(columns[k]);
      trace.values.col(static_cast<Eigen::Index>(k)) =
          Eigen::Map<const VecX>(values.data(), static_cast<Eigen::Index>(values.size()));
    }
    return trace;
  }

  // Ends of an open force are forces; what a closed form alone knows has no unit here.
  [[nodiscard]] Channel ChannelOf(const std::string& signal) const {
    const bool end = signal.ends_with(".lower") || signal.ends_with(".upper");
    const auto found = known_.find(end ? signal.substr(0, signal.rfind('.')) : signal);
    Channel channel =
        found == known_.end() ? Channel{.name = "", .unit = "", .frame = ""} : found->second;
    channel.name = signal;
    return channel;
  }

  [[nodiscard]] LimitColumn LimitsOf(const std::string& witness) const {
    const auto foreign = foreign_.find(witness);
    if (foreign != foreign_.end()) return foreign->second;
    return IsEngine(witness) ? input_.simulation_limits : LimitColumn::kReference;
  }

  const ComparisonInput input_;
  const BothTables& tables_;
  const std::map<std::string, Channel> known_;
  std::map<std::string, LimitColumn> foreign_;
  std::map<std::string, std::vector<size_t>> columns_;
};

// The stiffnesses of a result's files, by witness.
std::map<std::string, StiffnessWitness> StiffnessesOf(const OwnTable& matrices,
                                                      const OwnTable* loads) {
  std::map<std::string, StiffnessWitness> witnesses;
  std::map<std::string, int> filled;  // entries of K, then of C
  for (const auto& row : matrices.rows) {
    StiffnessWitness& witness = witnesses[row[0]];
    witness.name = row[0];
    const int entry = filled[row[0]]++;
    if (entry >= 72) continue;
    Mat6& M = entry < 36 ? witness.result.K : witness.result.C;
    const CellNumber cell = ReadCell(row.back(), false);
    M(entry % 36 / 6, entry % 6) = cell.kind == CellNumber::Kind::kNumber ? cell.value : kNan;
  }
  if (loads == nullptr) return witnesses;
  for (auto& [name, witness] : witnesses) {
    std::vector<std::vector<double>> columns;
    for (size_t c = 0; c < loads->heading.size(); ++c) {
      if (loads->heading[c].ends_with("." + name)) columns.push_back(loads->Column(c));
    }
    if (columns.size() != 6) continue;
    for (size_t k = 0; k < loads->rows.size(); ++k) {
      Vec6& displacement = witness.displacements.emplace_back();
      for (size_t i = 0; i < 6; ++i) displacement[static_cast<int>(i)] = columns[i][k];
    }
  }
  return witnesses;
}

bool IsOfLoads(Metric metric) {
  return metric == Metric::kDisplacementAxis || metric == Metric::kDisplacementVector ||
         metric == Metric::kRotationAxis;
}

std::vector<RerunSignal> CompareStiffnesses(const PackedScenario& scenario, bool of_loads,
                                            const BothTables& matrices, const BothTables* loads) {
  Diagnostics diagnostics;
  const auto prepared = PrepareStiffnessFile(scenario.file, {}, &diagnostics);
  if (!prepared) return {};
  const CheckLimits limits = RerunLimits(prepared->scenario.checks);
  const auto before = StiffnessesOf(matrices.packed, loads == nullptr ? nullptr : &loads->packed);
  const auto now = StiffnessesOf(matrices.rerun, loads == nullptr ? nullptr : &loads->rerun);
  std::vector<RerunSignal> signals;
  for (const auto& [name, witness] : before) {
    const auto found = now.find(name);
    if (found == now.end()) continue;
    const PairComparison pair = CompareStiffnesses(AsWitness(found->second), AsWitness(witness));
    for (const auto& [metric, worst] : pair.metrics) {
      if (IsOfLoads(metric) != of_loads) continue;
      const auto allowed =
          limits[metric].Of(IsEngine(name) ? LimitColumn::kForward : LimitColumn::kReference);
      signals.push_back(
          {.signal = fmt::format("{}.{} ({})", name, RowOf(metric).key, worst.channel),
           .relative = worst.value,
           .use = worst.value == 0.0 ? 0.0 : worst.value / allowed.value_or(0.0)});
    }
  }
  return signals;
}

// Words, counts and numbers of a study's points.
std::vector<RerunSignal> ComparePoints(const PackedScenario& scenario, const BothTables& tables,
                                       std::string* why) {
  constexpr size_t kHead = 4;  // point, seed, exit, reason
  for (size_t i = 0; i < tables.packed.rows.size(); ++i) {
    const auto &a = tables.packed.rows[i], &b = tables.rerun.rows[i];
    if (std::equal(a.begin(), a.begin() + kHead, b.begin())) continue;
    *why = fmt::format("point {} ended otherwise: exit {} in the archive, {} now", i, a[2], b[2]);
    return {};
  }
  const StudyResult read = LoadStudy(scenario.file, {.many = true});
  if (!read.study) return {};
  const ScenarioResult varied = LoadScenario(read.study->scenario);
  const CheckLimits limits = RerunLimits(varied.scenario ? varied.scenario->checks : CheckLimits());
  const bool engine = std::ranges::any_of(read.study->witnesses, [](const std::string& word) {
    return word == "forward" || word == "simulation";
  });
  const LimitColumn column = engine ? LimitColumn::kForward : LimitColumn::kReference;
  std::vector<RerunSignal> signals;
  for (size_t c = kHead; c < tables.packed.heading.size(); ++c) {
    const std::string& name = tables.packed.heading[c];
    const MetricRow* check = FindMetric(name);
    const auto limit = limits[check == nullptr ? Metric::kForceNrmse : check->metric].Of(column);
    signals.push_back(CompareColumns(name, tables.packed.Column(c), tables.rerun.Column(c),
                                     limit.value_or(0.0), check != nullptr));
  }
  return signals;
}

// The files of a kind of scenario that are judged number by number; all else follows from them.
// What engines computed of a case's published values (CaseCsv()): by their uncertainties.
std::vector<RerunSignal> CompareValues(const BothTables& tables, std::string* why) {
  constexpr size_t kHead = 4;  // signal, time_s, published, uncertainty
  const OwnTable &packed = tables.packed, &rerun = tables.rerun;
  for (size_t i = 0; i < packed.rows.size() && why->empty(); ++i) {
    const auto &a = packed.rows[i], &b = rerun.rows[i];
    if (!std::equal(a.begin(), a.begin() + kHead, b.begin())) {
      *why = fmt::format("has another published value in line {}", i + 2);
    }
  }
  const std::vector<double> uncertainty = packed.Column(kHead - 1);
  std::vector<RerunSignal> signals;
  for (size_t c = kHead; c < packed.heading.size() && why->empty(); ++c) {
    RerunSignal& worst = signals.emplace_back();
    worst.signal = packed.heading[c];
    worst.relative = worst.use = 0.0;
    const std::vector<double> a = packed.Column(c), b = rerun.Column(c);
    for (size_t i = 0; i < a.size(); ++i) {
      if (std::isnan(a[i]) && std::isnan(b[i])) continue;  // it records no such signal
      const double moved = std::abs(a[i] - b[i]), use = moved / (kRerunShare * uncertainty[i]);
      if (use <= worst.use) continue;
      worst.relative = moved / std::abs(a[i]);
      worst.use = use;
    }
  }
  return signals;
}

const std::vector<const char*>& NumberFiles(const std::string& kind) {
  static const std::vector<const char*> motion = {kTraces}, stiffness = {kStiffness, kLoads},
                                        study = {kPoints}, benchmark = {kValues};
  return kind == "study"       ? study
         : kind == "stiffness" ? stiffness
         : kind == kBenchmark  ? benchmark
                               : motion;
}

// Signals of one of those; a sentence in `why` where the tables have other columns, rows or words.
std::vector<RerunSignal> CompareTables(const PackedScenario& scenario, const std::string& name,
                                       const PackedResults& packed, const PackedResults& rerun,
                                       std::string* why) {
  const auto both = CutBoth(scenario.results + "/" + name, packed, rerun, why);
  if (!both) return {};
  if (scenario.kind == "study") return ComparePoints(scenario, *both, why);
  if (scenario.kind == kBenchmark) return CompareValues(*both, why);
  if (scenario.kind == "stiffness") {
    std::string also;
    const auto matrices = CutBoth(scenario.results + "/" + kStiffness, packed, rerun, &also);
    const auto loads = CutBoth(scenario.results + "/" + kLoads, packed, rerun, &also);
    if (!matrices) return {};
    return CompareStiffnesses(scenario, name == kLoads, *matrices, loads ? &*loads : nullptr);
  }
  Diagnostics diagnostics;
  const auto prepared = Prepare(scenario.file, {}, &diagnostics);
  return prepared ? TraceComparison(*prepared, *both).Compare(why) : std::vector<RerunSignal>();
}

}  // namespace
namespace {

constexpr const char* kSummary = "summary.json";

class RerunJudge {
 public:
  RerunJudge(const PackedScenario& scenario, const PackedResults& packed,
             const PackedResults& rerun, bool same_versions)
      : scenario_(scenario), packed_(packed), rerun_(rerun), same_versions_(same_versions) {}

  std::vector<RerunFile> Judge() {
    std::set<std::string> paths;
    for (const auto* side : {&packed_, &rerun_}) {
      for (const auto& [path, content] : *side) paths.insert(path);
    }
    // Numbers first: what else there is follows from them.
    for (const std::string& path : paths) {
      if (IsNumbers(path)) files_.push_back(JudgeNumbers(path));
    }
    exact_ = same_versions_ && std::ranges::all_of(files_, [](const RerunFile& file) {
               return file.outcome == RerunOutcome::kSame;
             });
    for (const std::string& path : paths) {
      if (!IsNumbers(path)) files_.push_back(JudgeRest(path));
    }
    std::ranges::sort(files_, {}, &RerunFile::path);
    return std::move(files_);
  }

 private:
  [[nodiscard]] bool IsResult(const std::string& path, const char* name) const {
    return path == scenario_.results + "/" + name;
  }
  [[nodiscard]] bool IsNumbers(const std::string& path) const {
    const auto& names = NumberFiles(scenario_.kind);
    return std::ranges::any_of(names, [&](const char* name) { return IsResult(path, name); });
  }
  [[nodiscard]] bool IsFigure(const std::string& path) const {
    return !scenario_.figures.empty() && path.starts_with(scenario_.figures + "/");
  }

  // Decides what needs no look inside; false: both are there and differ.
  bool Settled(RerunFile* file) const {
    const auto before = packed_.find(file->path), now = rerun_.find(file->path);
    if (now == rerun_.end()) {
      file->why = "is in the archive and is not made any more";
    } else if (before == packed_.end()) {
      file->why = "is made, but is not in the archive";
    } else if (before->second == now->second) {
      file->outcome = RerunOutcome::kSame;
    } else {
      return false;
    }
    return true;
  }

  RerunFile JudgeNumbers(const std::string& path) {
    RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = ""};
    if (Settled(&file)) return file;
    const std::string name = std::filesystem::path(path).filename();
    file.signals = CompareTables(scenario_, name, packed_, rerun_, &file.why);
    const bool inside = file.why.empty() && !file.signals.empty() &&
                        std::ranges::all_of(file.signals, &RerunSignal::inside);
    if (inside) file.outcome = RerunOutcome::kWithin;
    return file;
  }

  RerunFile JudgeRest(const std::string& path) {
    RerunFile file{.path = path, .outcome = RerunOutcome::kDiffers, .why = ""};
    if (Settled(&file)) return file;
    if (IsResult(path, kSummary) && (exact_ || scenario_.kind != "study")) {
      return CompareSummaries(path, packed_.at(path), rerun_.at(path), exact_);
    }
    if (IsFigure(path)) {
      file.outcome = RerunOutcome::kNotJudged;
      file.why = "is drawn otherwise: fonts and libraries of drawing decide, too";
    } else if (exact_) {
      file.why = "though the numbers that it is made of are the same";
    } else {
      file.outcome = RerunOutcome::kNotJudged;
      file.why = "follows from numbers or versions that have changed";
    }
    return file;
  }

  const PackedScenario& scenario_;
  const PackedResults& packed_;
  const PackedResults& rerun_;
  bool same_versions_, exact_ = false;
  std::vector<RerunFile> files_;
};

}  // namespace

std::vector<RerunFile> JudgeReruns(const PackedScenario& scenario, const PackedResults& packed,
                                   const PackedResults& rerun, bool same_versions) {
  return RerunJudge(scenario, packed, rerun, same_versions).Judge();
}

namespace {

namespace fs = std::filesystem;

constexpr double kLongestRun_s = 1e6;

// In the child, whose current folder is the archive's.
class PackedRunner {
 public:
  PackedRunner(const std::string& file, const PackedRunOptions& options) : options_(options) {
    run_.scenario.file = file;
  }

  PackedRun Run() {
    std::vector<MeshPackage> packages;
    for (const PackedMeshes& meshes : options_.meshes) {
      packages.push_back({meshes.name, meshes.folder});
    }
    UseMeshPackages(std::move(packages));
    const ScenarioHead head = ReadScenarioHead(run_.scenario.file);
    run_.scenario.description = head.description;
    const DocumentKind& kind = KindOf(run_.scenario.file);
    run_.scenario.kind = kind.name;
    if (!MayCallPrograms()) return std::move(run_);
    const bool benchmark = IsBenchmarkCase(kind);
    const bool study = kind.run == nullptr && !benchmark;
    if (ReadsOutside(study)) return std::move(run_);
    benchmark ? RunAsBenchmark() : study ? RunAsStudy() : RunAsScenario();
    return std::move(run_);
  }

 private:
  // Lists the programs it names; false if they may not run.
  bool MayCallPrograms() {
    if (run_.scenario.kind != "motion") return true;
    const ScenarioResult loaded = LoadScenario(run_.scenario.file);
    if (!loaded.scenario) return true;
    const ProgramList list = ProgramsOf(*loaded.scenario, options_.programs.archived);
    run_.programs = list.Lines();
    if (options_.programs.Allows(list)) return true;
    run_.refused = true;
    Refuse("calls programs (" + Joined(run_.programs) + ")",
           "read what they are; --trust lets them run as you");
    return false;
  }

  void RunAsStudy() {
    RunStudyOptions study;
    study.out_dir = kResultsFolder;
    study.points.jobs = AllCores();
    const StudyOutcome outcome = RunStudy(run_.scenario.file, study);
    Report(outcome.diagnostics, outcome.exit_code, outcome.folder);
    if (!outcome.report) return;
    run_.scenario.description = outcome.report->study.description;
    run_.scenario.verdict = outcome.exit_code == 0   ? "limits kept"
                            : outcome.exit_code == 1 ? "limits broken"
                                                     : "not run";
    run_.scenario.reason = fmt::format("{} points", outcome.report->study.Points().count());
  }

  // Without programs outside, and without times: another machine has others.
  void RunAsBenchmark() {
    Benchmark benchmark;
    Diagnostics diagnostics;
    auto one = ReadBenchmarkCase(run_.scenario.file, &diagnostics);
    if (!one) return Report(diagnostics, 2, "");
    for (const BenchmarkEngine& engine : BenchmarkEngines()) {
      if (engine.command.empty()) benchmark.engines.push_back(engine);
    }
    benchmark.cases.push_back(*std::move(one));
    benchmark.results.push_back(RunBenchmarkCase(benchmark.cases.front(), benchmark.engines));
    BenchmarkResult& result = benchmark.results.front();
    for (EngineOnCase& engine : result.engines) engine.cpu_s = kNan;
    std::vector<std::pair<std::string, std::string>> files = {{"errors.csv", ErrorsCsv(benchmark)},
                                                              {kValues, CaseCsv(benchmark, 0)}};
    if (options_.page) files.emplace_back("report.html", CasePage(benchmark, 0));
    OutputFolder folder(kResultsFolder, fmt::format("{}/{}", kBenchmark, result.name));
    if (const std::string trouble = folder.WriteAll(files); !trouble.empty()) {
      return Refuse(trouble, "");
    }
    Report(diagnostics, benchmark.exit_code(), folder.target().string());
    run_.scenario.description = result.title;
    run_.scenario.verdict = ToText(result.verdict);
    run_.scenario.reason = result.reason;
  }

  void RunAsScenario() {
    RunOptions run;
    run.out_dir = kResultsFolder;
    run.pictures = run.timed = false;
    run.page = options_.page;
    run.programs = options_.programs;
    const RunOutcome outcome = RunScenario(run_.scenario.file, run);
    Report(outcome.diagnostics, outcome.exit_code, outcome.folder);
    const std::optional<ResultView> view = outcome.View();
    if (!view) return;
    run_.scenario.verdict = ToText(view->verdict);
    run_.scenario.reason = view->reason;
    if (options_.figures) Draw(outcome);
  }

  void Draw(const RunOutcome& outcome) {
    FigureOptions figures;
    figures.formats = {"pdf", "svg"};
    const FigureOutcome drawn = MakeFigures(run_.scenario.file, figures, &outcome);
    if (drawn.files.empty()) return;
    OutputFolder folder(kFiguresFolder, drawn.mechanism + "/" + drawn.scenario);
    if (const std::string trouble = folder.WriteAll(drawn.files); !trouble.empty()) {
      return Refuse(trouble, "");
    }
    run_.scenario.figures = folder.target().generic_string();
  }

  void Report(const Diagnostics& diagnostics, int exit_code, const std::string& folder) {
    for (const Finding& finding : diagnostics.findings()) run_.findings.push_back(finding);
    run_.scenario.exit_code = exit_code;
    run_.scenario.results = fs::path(folder).generic_string();
    if (folder.empty()) run_.failure = "gave no result";
  }

  // Another machine may have other files there, or none. (The models of papers whose equations a
  // page audits come with the program.)
  bool ReadsOutside(bool study) {
    const InputWatch watch;
    (void)(study ? CheckStudy(run_.scenario.file) : CheckFile(run_.scenario.file));
    for (const InputFile& input : watch.files()) {
      const fs::path path = fs::path(input.file).lexically_normal();
      if (path.is_relative() && path.generic_string().starts_with("inputs/")) continue;
      Refuse(fmt::format("reads {}, which is not in the archive", input.file),
             "name files relative to the scenario and its model");
    }
    return !run_.failure.empty();
  }

  void Refuse(const std::string& message, const std::string& hint) {
    run_.failure = message;
    run_.findings.push_back({.severity = Severity::kError,
                             .file = run_.scenario.file,
                             .line = 0,
                             .column = 0,
                             .message = message,
                             .hint = hint});
  }

  const PackedRunOptions& options_;
  PackedRun run_;
};

PackedRun RunHere(const std::string& file, const PackedRunOptions& options,
                  const PackedTruth* truth) {
  fs::current_path(options.folder);
  PackedRun run = PackedRunner(file, options).Run();
  if (truth == nullptr || !run.failure.empty()) return run;
  if (run.scenario.kind != truth->scenario.kind) {
    run.failure = fmt::format("is of the kind '{}', not '{}' as the manifest says",
                              run.scenario.kind, truth->scenario.kind);
    return run;
  }
  std::map<std::string, std::string> now = FilesOf(".", truth->scenario.results);
  now.merge(FilesOf(".", run.scenario.results));
  if (!truth->scenario.figures.empty()) now.merge(FilesOf(".", truth->scenario.figures));
  std::map<std::string, std::string> packed;
  for (const std::string& path : truth->files) {
    packed[path] = ReadWholeFile(truth->folder / path).value_or("");
  }
  run.files = JudgeReruns(truth->scenario, packed, now, truth->same_versions);
  return run;
}

}  // namespace

bool IsBenchmarkCase(const DocumentKind& kind) { return kind.name == std::string(kBenchmark); }

PackedRun RunPacked(const std::string& file, const PackedRunOptions& options,
                    const PackedTruth* truth) {
  const auto texts =
      InChildren(1, kLongestRun_s, [&](size_t) { return ToBytes(RunHere(file, options, truth)); });
  auto run = texts.front() ? FromBytes<PackedRun>(*texts.front()) : std::nullopt;
  if (run) return *std::move(run);
  PackedRun lost;
  lost.scenario.file = file;
  lost.failure = "the process that ran it died (out of memory?)";
  return lost;
}

std::map<std::string, std::string> FilesOf(const fs::path& archive, const std::string& folder) {
  std::map<std::string, std::string> files;
  std::vector<std::string> unread;
  if (folder.empty()) return files;
  for (const std::string& file : FilesBelow(archive / folder, "", &unread)) {
    const fs::path path = fs::path(file).lexically_relative(archive).lexically_normal();
    const bool hidden = std::any_of(path.begin(), path.end(), [](const fs::path& part) {
      return part.string().starts_with('.');
    });
    if (hidden) continue;
    if (auto content = ReadWholeFile(file)) files[path.generic_string()] = *std::move(content);
  }
  return files;
}

}  // namespace mbv
