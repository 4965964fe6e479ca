// `mbverify benchmark`: engines on published cases of closed loops.
//
// A case is a scenario with numbers from a publication: a column of a table or a single
// value, with its uncertainty. Every engine computes it; each series of published numbers is either
// met within its uncertainty or not. The generic reference, the corrected simulation and, where
// there is one, the closed form judge the case together (Judge()); the other engines are ranked by
// it and decide nothing.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "base/diagnostics.h"
#include "base/types.h"

namespace mbv {

/// Numbers of one signal, as published.
struct PublishedSeries {
  std::string channel;              ///< of a trace: "crank.position"; or, as a label, …
  std::string spins;                ///< … the output whose angular velocity, in its own axes, …
  int axis = -1;                    ///< … it is about this one
  std::string called;               ///< in the source: "j1.phi"
  std::vector<double> time_s;       ///< each one a sample of the scenario
  std::vector<double> values;       ///< as many, in the channel's SI unit
  std::vector<double> uncertainty;  ///< of each value, > 0, in that unit
  std::string uncertainty_why;      ///< where it is from, one sentence
  bool proved = false;              ///< an enclosure of the value is known
};

struct BenchmarkSource {
  std::string work, item, licence, url;
  std::string sha256;  ///< of the file that the numbers were taken from; "" without one
};

struct BenchmarkCase {
  std::string file, name, title, suite;
  BenchmarkSource source;
  std::string scenario;  ///< path; "" where the case is not expressible
  std::vector<PublishedSeries> published;
  std::string published_is_wrong;  ///< why, where the case is known to contradict its source
  std::string not_expressible;     ///< why no scenario computes it; "" if one does
};

/// Reads one case.yaml (docs/how-to/benchmark_cases.md) and its table. Empty after findings.
[[nodiscard]] std::optional<BenchmarkCase> ReadBenchmarkCase(const std::string& file,
                                                             Diagnostics* diagnostics);
/// Those below a folder, or a file itself, sorted by suite and name; names must differ.
[[nodiscard]] std::vector<BenchmarkCase> ReadBenchmarkCases(const std::vector<std::string>& paths,
                                                            Diagnostics* diagnostics);
[[nodiscard]] Diagnostics CheckBenchmarkCase(const std::string& file);

/// An engine that computes cases. Those without a command are mbverify's own and MuJoCo 2.2.2.
struct BenchmarkEngine {
  std::string name, about;
  std::string command = {};  ///< of an external witness
  bool judges = false;       ///< see Judge()
};
/// All that come with mbverify, in the order in which they are shown.
[[nodiscard]] const std::vector<BenchmarkEngine>& BenchmarkEngines();

/// How far an engine is from one published series.
struct SeriesError {
  double largest = kNan;  ///< |computed − published|, in the channel's unit; NaN: not recorded
  double time_s = kNan;   ///< of the largest share
  double ratio = kNan;    ///< largest share of the uncertainty of its instant

  [[nodiscard]] bool inside() const { return ratio <= 1.0; }
};

/// One engine on one case. Errors but those of `series` are against the generic reference.
struct EngineOnCase {
  std::string engine, program;      ///< program: of an external witness, as it calls itself
  std::string why;                  ///< why it gives nothing; "" if it computed the case
  std::vector<SeriesError> series;  ///< of the case's published series
  std::vector<std::vector<double>> computed;  ///< by series, at its instants; NaN: not recorded
  double motion = kNan;     ///< largest error of drives and outputs [rad, characteristic lengths]
  double force = kNan;      ///< all drive forces, RMS error over RMS
  double reaction = kNan;   ///< all unique joint reactions, RMS error over RMS
  double closure_m = kNan;  ///< largest loop gap; NaN of a tree
  double energy = kNan;     ///< largest drift over the energy turned over
  double cpu_s = kNan;      ///< processor time of the computation, without start-up

  [[nodiscard]] bool ran() const { return why.empty(); }
};

enum class CaseVerdict {
  kNotExpressible,
  kNotRun,        ///< fewer than two judging engines gave all published signals
  kConfirmed,     ///< all of them meet every published value
  kContradicted,  ///< they agree with each other, and some published value is wrong
  kDisagree,      ///< they do not agree with each other
};
[[nodiscard]] const char* ToText(CaseVerdict verdict);  ///< "confirmed", "not expressible", …

struct BenchmarkResult {
  std::string name, suite, title;
  CaseVerdict verdict = CaseVerdict::kNotRun;
  std::string reason = {};    ///< one sentence
  std::string settings = {};  ///< step, samples and duration
  std::vector<EngineOnCase> engines = {};
};

/// From what the judging engines gave. `spread`: by series, the largest difference between two of
/// them as a share of the uncertainty of its instant; they agree where it is at most 1.
void Judge(const BenchmarkCase& benchmark, const std::vector<double>& spread,
           BenchmarkResult* result);

/// Whether a result is what the case states: confirmed, or contradicted where its source is known
/// to be wrong; not expressible where it says so.
[[nodiscard]] bool AsStated(const BenchmarkCase& benchmark, const BenchmarkResult& result);

/// Runs a case by these engines, in this process, with `step_factor` times the step that its
/// scenario states.
[[nodiscard]] BenchmarkResult RunBenchmarkCase(const BenchmarkCase& benchmark,
                                               const std::vector<BenchmarkEngine>& engines,
                                               double step_factor = 1.0);

struct Benchmark {
  std::vector<BenchmarkCase> cases;
  std::vector<BenchmarkEngine> engines;
  std::vector<BenchmarkResult> results;  ///< of `cases`
  /// Work and precision: the stepping engines at multiples of each scenario's step; by multiple,
  /// results of `cases`. Empty unless asked for.
  std::vector<std::pair<double, std::vector<BenchmarkResult>>> at_steps;

  [[nodiscard]] size_t Count(CaseVerdict verdict) const;
  [[nodiscard]] size_t series() const;  ///< published series of cases that were run
  /// 1 where some result is not as its case states, 3 where none was run, else 0.
  [[nodiscard]] int exit_code() const;
};

[[nodiscard]] std::string ToText(const Benchmark& benchmark, bool color, size_t columns);
/// One row a case and engine; without times, so that two runs write the same bytes.
[[nodiscard]] std::string ErrorsCsv(const Benchmark& benchmark);
[[nodiscard]] std::string CostCsv(const Benchmark& benchmark);
/// The ranking, and errors by case and engine.
[[nodiscard]] std::string ToLatex(const Benchmark& benchmark);
[[nodiscard]] std::string ToMarkdown(const Benchmark& benchmark);
/// Each number leads to its case's page, CasePage() below cases/.
[[nodiscard]] std::string ToHtml(const Benchmark& benchmark);
/// The run of one case: source, settings, engines, errors by series, and where they are largest.
[[nodiscard]] std::string CasePage(const Benchmark& benchmark, size_t index);
/// A row a published value: signal, time_s, published, uncertainty, then what each engine computed.
[[nodiscard]] std::string CaseCsv(const Benchmark& benchmark, size_t index);
/// `schema: mbverify.benchmark/1`.
[[nodiscard]] nlohmann::ordered_json ToJson(const Benchmark& benchmark);

// A child process' result.
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SeriesError>& error) {
  visit(error.largest), visit(error.time_s), visit(error.ratio);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<EngineOnCase>& engine) {
  visit(engine.engine), visit(engine.program), visit(engine.why), visit(engine.series);
  visit(engine.computed);
  visit(engine.motion), visit(engine.force), visit(engine.reaction), visit(engine.closure_m);
  visit(engine.energy), visit(engine.cpu_s);
}
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<BenchmarkResult>& result) {
  visit(result.name), visit(result.suite), visit(result.title), visit(result.verdict);
  visit(result.reason), visit(result.settings), visit(result.engines);
}

}  // namespace mbv
