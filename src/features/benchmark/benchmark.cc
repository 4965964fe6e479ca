#include "features/benchmark/benchmark.h"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/text.h"
#include "comparison/verdict.h"
#include "features/engines/crosscheck.h"
#include "kinematics/mobility.h"
#include "mechanism/reach.h"
#include "verify/prepare.h"
#include "verify/run_witnesses.h"

namespace mbv {
namespace {

constexpr const char* kClosedForm = "closed_form";
constexpr const char* kReference = "reference";
constexpr const char* kSimulation = "simulation";
constexpr const char* kMujoco = "mujoco";
constexpr const char* kMujocoDefault = "mujoco_default";
constexpr const char* kMujocoRk4 = "mujoco_rk4";

// A computed trace, or why there is none.
struct Computed {
  std::string engine;
  const Trace* trace = nullptr;
  std::string program = {}, why = {};
  double cpu_s = kNan;
};

Computed ComputedBy(const std::string& engine, const WitnessRecord* record) {
  Computed computed{.engine = engine};
  if (record == nullptr) {
    computed.why = "takes no part in this scenario";
    return computed;
  }
  computed.cpu_s = record->summary.cpu_s;
  if (record->foreign) {
    computed.program = record->foreign->program;
    computed.cpu_s = record->foreign->compute_s;
  }
  if (record->summary.ok()) {
    computed.trace = &record->trace;
  } else {
    computed.why = record->summary.message;
  }
  return computed;
}

// The row of an instant; −1 where no sample is within 1e-9 s of it.
Eigen::Index RowAt(const Trace& trace, double time_s) {
  constexpr double kSameTime = 1e-9;
  const auto next = std::lower_bound(trace.time_s.begin(), trace.time_s.end(), time_s - kSameTime);
  if (next == trace.time_s.end() || *next > time_s + kSameTime) return -1;
  return next - trace.time_s.begin();
}

// The angular velocity of an output in its own axes, about one of them, by its roll, pitch and yaw
// and their rates; empty where the trace lacks one.
Eigen::ArrayXd SpinOf(const std::string& output, int axis, const Trace& trace) {
  std::array<Eigen::ArrayXd, 3> angle, rate;
  for (size_t k = 0; k < 3; ++k) {
    const int component = static_cast<int>(k) + 3;
    const int a = trace.Find(Quantity::kPose, output, component);
    const int r = trace.Find(Quantity::kPoseVelocity, output, component);
    if (a < 0 || r < 0) return {};
    angle[k] = trace.values.col(a);
    rate[k] = trace.values.col(r);
  }
  const auto& [roll, pitch, yaw] = angle;
  const auto& [roll_rate, pitch_rate, yaw_rate] = rate;
  if (axis == 0) return roll_rate - yaw_rate * pitch.sin();
  if (axis == 1) return pitch_rate * roll.cos() + yaw_rate * roll.sin() * pitch.cos();
  return yaw_rate * roll.cos() * pitch.cos() - pitch_rate * roll.sin();
}

// By sample; empty where the trace has none.
Eigen::ArrayXd SignalOf(const PublishedSeries& series, const Trace& trace) {
  if (!series.spins.empty()) return SpinOf(series.spins, series.axis, trace);
  const int column = trace.Find(series.channel);
  if (column < 0) return {};
  return trace.values.col(column);
}

// What a trace has of a series, by instant; NaN where it has nothing.
std::vector<double> ComputedValues(const PublishedSeries& series, const Trace& trace) {
  std::vector<double> values(series.time_s.size(), kNan);
  const Eigen::ArrayXd signal = SignalOf(series, trace);
  if (signal.size() == 0) return values;
  for (size_t k = 0; k < values.size(); ++k) {
    const Eigen::Index row = RowAt(trace, series.time_s[k]);
    if (row >= 0) values[k] = signal(row);
  }
  return values;
}

// Computed less published, by instant. Angles of a pose are the same after a turn; those of drives
// count their turns.
std::vector<double> DifferencesOf(const PublishedSeries& series, const Trace& trace,
                                  const std::vector<double>& computed) {
  const int column = trace.Find(series.channel);
  const Channel channel = column < 0 ? Channel() : trace.channels[static_cast<size_t>(column)];
  const bool angle = channel.quantity == Quantity::kPose && channel.component >= 3;
  std::vector<double> differences;
  for (size_t k = 0; k < computed.size(); ++k) {
    differences.push_back(angle ? AngleDifference(computed[k], series.values[k])
                                : computed[k] - series.values[k]);
  }
  return differences;
}

SeriesError ErrorOf(const PublishedSeries& series, const std::vector<double>& differences) {
  SeriesError error{.largest = 0.0};
  for (size_t k = 0; k < differences.size(); ++k) {
    const double difference = std::abs(differences[k]);
    if (std::isnan(difference)) return {};
    error.largest = std::max(error.largest, difference);
    const double ratio = difference / series.uncertainty[k];
    if (!(ratio <= error.ratio)) error.ratio = ratio, error.time_s = series.time_s[k];
  }
  return error;
}

double LargestOf(std::initializer_list<double> values) {
  double largest = kNan;
  for (const double value : values) {
    if (!(value <= largest) && !std::isnan(value)) largest = value;
  }
  return largest;
}

// One case: prepared, computed by all engines that are asked for, and measured.
class CaseRun {
 public:
  CaseRun(const BenchmarkCase& benchmark, const std::vector<BenchmarkEngine>& engines,
          Prepared* prepared)
      : benchmark_(benchmark), engines_(engines), prepared_(*prepared), runner_(*prepared) {}

  void Run(BenchmarkResult* result) {
    for (const Role* role : {&role::kAnalytic, &role::kReference}) {
      if (runner_.TakesPart(*role)) runner_.Run(*role);
    }
    RunSimulations();
    runner_.RunForeign();
    const WitnessRuns& runs = runner_.runs();
    std::vector<Computed> all;
    for (const BenchmarkEngine& engine : engines_) {
      if (engine.name == kClosedForm) {
        all.push_back(ComputedBy(engine.name, runs.Find(role::kAnalytic)));
      } else if (engine.name == kReference) {
        all.push_back(ComputedBy(engine.name, runs.Find(role::kReference)));
      } else if (engine.command.empty()) {
        all.push_back(Simulation(engine.name));
      } else {
        const auto found = std::ranges::find(runs.records, engine.name, &WitnessRecord::name);
        all.push_back(ComputedBy(engine.name, found == runs.records.end() ? nullptr : &*found));
      }
    }
    Measure(runs, all, result);
  }

 private:
  [[nodiscard]] bool Wants(const char* engine) const {
    return std::ranges::find(engines_, engine, &BenchmarkEngine::name) != engines_.end();
  }

  void RunSimulations() {
    const bool driven = runner_.runs().Find(prepared_.driver()) != nullptr &&
                        runner_.runs().Find(prepared_.driver())->summary.ok();
    const bool steps = prepared_.scenario.simulation.mode != DriveMode::kInverse;
    const bool within = driven && runner_.CheckStrokes();
    const Motion& motion = prepared_.scenario.motion;
    for (const auto& [name, engine] :
         {std::pair(kSimulation, Engine::kCorrected), std::pair(kMujoco, Engine::kStock),
          std::pair(kMujocoRk4, Engine::kStock), std::pair(kMujocoDefault, Engine::kDefaults)}) {
      if (!Wants(name)) continue;
      Simulated& simulated = simulations_.emplace_back();
      simulated.name = name;
      if (!within) {
        simulated.why = driven ? "the drives cannot go there" : "there is no drive motion";
      } else if (!steps && engine != Engine::kCorrected) {
        simulated.why = "the motion is evaluated by inverse dynamics and not stepped";
      } else if (simulated.name == kMujocoRk4 && (!motion.free() || !motion.commands.empty())) {
        simulated.why = "its targets stand still within a step: it is for motions without commands";
      } else {
        SimulationOptions options = OptionsOf(prepared_.scenario, prepared_.base, engine);
        options.runge_kutta = simulated.name == kMujocoRk4;
        SimulatedWitness witness =
            options.runge_kutta ? runner_.Simulate(options, name) : runner_.Simulate(engine, name);
        if (!witness.run.summary.ok()) simulated.why = witness.run.summary.message;
        simulated.run = std::move(witness.run);
      }
    }
  }

  [[nodiscard]] Computed Simulation(const std::string& name) const {
    const auto found = std::ranges::find(simulations_, name, &Simulated::name);
    Computed computed{.engine = name};
    if (found == simulations_.end()) {
      computed.why = "is no engine";
      return computed;
    }
    computed.why = found->why;
    computed.cpu_s = found->run.loop_cpu_s;
    if (computed.why.empty()) computed.trace = &found->run.trace;
    return computed;
  }
  [[nodiscard]] bool Judges(const std::string& engine) const {
    const auto found = std::ranges::find(engines_, engine, &BenchmarkEngine::name);
    return found != engines_.end() && found->judges;
  }

  void Measure(const WitnessRuns& runs, const std::vector<Computed>& all, BenchmarkResult* result) {
    ComparisonInput input = InputOf(prepared_);
    runs.HandOver(&input);
    const auto bodies = std::ranges::find(simulations_, kSimulation, &Simulated::name);
    input.reactions_not_unique = ReactionsNotUnique(
        prepared_.base,
        bodies == simulations_.end() ? std::vector<std::vector<Pose>>() : bodies->run.X_WB);
    const WitnessRecord* reference = runs.Find(role::kReference);
    const Trace* truth =
        reference != nullptr && reference->summary.ok() ? &reference->trace : nullptr;
    const double length = CharacteristicLength(prepared_.base);
    const bool loops = std::ranges::any_of(prepared_.base.joints, &Joint::closure);
    // By series: the differences of the judging engines.
    std::vector<std::vector<std::vector<double>>> judged(benchmark_.published.size());
    for (const Computed& computed : all) {
      EngineOnCase& row = result->engines.emplace_back();
      row.engine = computed.engine;
      row.program = computed.program;
      row.why = computed.why;
      if (computed.trace == nullptr) continue;
      row.cpu_s = computed.cpu_s;
      const Trace& trace = *computed.trace;
      for (size_t k = 0; k < benchmark_.published.size(); ++k) {
        const PublishedSeries& series = benchmark_.published[k];
        row.computed.push_back(ComputedValues(series, trace));
        std::vector<double> differences = DifferencesOf(series, trace, row.computed.back());
        row.series.push_back(ErrorOf(series, differences));
        if (Judges(row.engine) && std::isfinite(row.series.back().largest)) {
          judged[k].push_back(std::move(differences));
        }
      }
      const WitnessMetrics own = MeasureWitness(input, trace);
      if (loops) row.closure_m = ValueOf(own.metrics, Metric::kClosureM);
      row.energy = ValueOf(own.metrics, Metric::kEnergy);
      if (truth == nullptr || &trace == truth) continue;
      const PairComparison pair = ComparePair(input, trace, *truth);
      const auto value = [&](Metric metric) { return ValueOf(pair.metrics, metric); };
      row.motion = LargestOf({value(Metric::kPositionM) / length, value(Metric::kPositionRad),
                              value(Metric::kPoseM) / length, value(Metric::kPoseRad)});
      row.force = value(Metric::kForceNrmse);
      row.reaction = value(Metric::kReaction);
    }
    Judge(benchmark_, SpreadOf(benchmark_, judged), result);
  }

  static std::vector<double> SpreadOf(const BenchmarkCase& benchmark,
                                      const std::vector<std::vector<std::vector<double>>>& judged) {
    std::vector<double> spread;
    for (size_t s = 0; s < judged.size(); ++s) {
      double largest = judged[s].size() < 2 ? kNan : 0.0;
      for (size_t k = 0; k < benchmark.published[s].values.size() && judged[s].size() > 1; ++k) {
        double low = judged[s].front()[k], high = low;
        for (const std::vector<double>& differences : judged[s]) {
          low = std::min(low, differences[k]);
          high = std::max(high, differences[k]);
        }
        largest = std::max(largest, (high - low) / benchmark.published[s].uncertainty[k]);
      }
      spread.push_back(largest);
    }
    return spread;
  }

  struct Simulated {
    std::string name, why;
    SimulationRun run;
  };

  const BenchmarkCase& benchmark_;
  const std::vector<BenchmarkEngine>& engines_;
  const Prepared& prepared_;
  WitnessRunner runner_;
  std::vector<Simulated> simulations_;
};

std::string FirstError(const Diagnostics& diagnostics) {
  for (const Finding& finding : diagnostics.findings()) {
    if (finding.severity == Severity::kError) return finding.message;
  }
  return "";
}

bool IsJudging(const std::string& name) {
  const auto& engines = BenchmarkEngines();
  const auto found = std::ranges::find(engines, name, &BenchmarkEngine::name);
  return found != engines.end() && found->judges;
}

}  // namespace

const std::vector<BenchmarkEngine>& BenchmarkEngines() {
  static const std::vector<BenchmarkEngine> engines = {
      {.name = kClosedForm, .about = "the mechanism's equations", .judges = true},
      {.name = kReference, .about = "the generic reference", .judges = true},
      {.name = kSimulation, .about = "MuJoCo 2.2.2 with the terms that it omits", .judges = true},
      {.name = kMujoco, .about = "MuJoCo 2.2.2 by the best settings that a user can choose"},
      {.name = kMujocoRk4, .about = "MuJoCo 2.2.2 by those settings and its Runge–Kutta method"},
      {.name = kMujocoDefault, .about = "MuJoCo 2.2.2 with its default settings"},
      {.name = "simbody", .about = "Simbody", .command = "mbverify-witness-simbody"},
      {.name = "ode",
       .about = "the Open Dynamics Engine by its default settings",
       .command = "mbverify-witness-ode"},
      {.name = "mujoco_newest",
       .about = "the newest MuJoCo by the best settings",
       .command = "mbverify-witness-mujoco"},
      {.name = "mujoco_newest_default",
       .about = "the newest MuJoCo with its default settings",
       .command = "mbverify-witness-mujoco --defaults"},
      {.name = "mujoco_newest_inverse",
       .about = "the newest MuJoCo's inverse dynamics",
       .command = "mbverify-witness-mujoco --inverse"}};
  return engines;
}

const char* ToText(CaseVerdict verdict) {
  switch (verdict) {
    case CaseVerdict::kNotExpressible:
      return "not expressible";
    case CaseVerdict::kNotRun:
      return "not run";
    case CaseVerdict::kConfirmed:
      return "confirmed";
    case CaseVerdict::kContradicted:
      return "contradicted";
    case CaseVerdict::kDisagree:
      return "disagree";
  }
  return "";
}

void Judge(const BenchmarkCase& benchmark, const std::vector<double>& spread,
           BenchmarkResult* result) {
  const auto end = [&](CaseVerdict verdict, std::string reason) {
    result->verdict = verdict;
    result->reason = std::move(reason);
  };
  double worst = 0.0;
  std::string outside;
  for (size_t k = 0; k < benchmark.published.size(); ++k) {
    const PublishedSeries& series = benchmark.published[k];
    size_t have = 0, inside = 0;
    double least = std::numeric_limits<double>::infinity();
    for (const EngineOnCase& engine : result->engines) {
      if (!engine.ran() || !IsJudging(engine.engine)) continue;
      const SeriesError& error = engine.series[k];
      if (std::isnan(error.largest)) continue;
      ++have;
      if (error.inside()) ++inside;
      worst = std::max(worst, error.ratio);
      least = std::min(least, error.ratio);
    }
    if (have < 2) {
      std::string why;
      for (const EngineOnCase& engine : result->engines) {
        if (!engine.ran() && IsJudging(engine.engine))
          why += "; " + engine.engine + " " + engine.why;
      }
      return end(CaseVerdict::kNotRun,
                 fmt::format("{} of two judging engines recorded {}{}", have, series.channel, why));
    }
    if (!(spread[k] <= 1.0)) {
      return end(CaseVerdict::kDisagree,
                 fmt::format("the judging engines differ by {:.2g} times the uncertainty of {}",
                             spread[k], series.called));
    }
    if (inside == have) continue;
    if (inside > 0) {
      return end(CaseVerdict::kDisagree,
                 fmt::format("{} of {} judging engines meet {}", inside, have, series.called));
    }
    if (!outside.empty()) outside += ", ";
    outside += fmt::format("{} ({:.3g} times its uncertainty)", series.called, least);
  }
  std::string without;
  for (const EngineOnCase& engine : result->engines) {
    const bool missing = !engine.ran() && IsJudging(engine.engine) && engine.engine != kClosedForm;
    if (missing) without += "; without " + engine.engine + ": " + engine.why;
  }
  if (outside.empty()) {
    return end(CaseVerdict::kConfirmed,
               fmt::format("all of {} within their uncertainty, at most {:.2g} of it{}",
                           benchmark.published.size(), worst, without));
  }
  end(CaseVerdict::kContradicted,
      "the judging engines agree with each other and not with " + outside + without);
}

bool AsStated(const BenchmarkCase& benchmark, const BenchmarkResult& result) {
  if (!benchmark.not_expressible.empty()) return result.verdict == CaseVerdict::kNotExpressible;
  return result.verdict == (benchmark.published_is_wrong.empty() ? CaseVerdict::kConfirmed
                                                                 : CaseVerdict::kContradicted);
}

BenchmarkResult RunBenchmarkCase(const BenchmarkCase& benchmark,
                                 const std::vector<BenchmarkEngine>& engines, double step_factor) {
  BenchmarkResult result{
      .name = benchmark.name, .suite = benchmark.suite, .title = benchmark.title};
  if (!benchmark.not_expressible.empty()) {
    result.verdict = CaseVerdict::kNotExpressible;
    result.reason = benchmark.not_expressible;
    return result;
  }
  std::vector<std::string> commands;
  for (const BenchmarkEngine& engine : engines) {
    if (!engine.command.empty()) commands.push_back(engine.name + "=" + engine.command);
  }
  ScenarioOptions options;
  options.set.push_back(*WitnessesOf(commands));
  Diagnostics diagnostics;
  std::optional<Prepared> prepared = Prepare(benchmark.scenario, options, &diagnostics);
  if (!prepared) {
    result.reason = FirstError(diagnostics);
    return result;
  }
  if (prepared->has_table()) {
    result.reason = "the scenario has a table in the reference's place";
    return result;
  }
  prepared->scenario.simulation.step_s *= step_factor;
  result.settings = fmt::format(
      "steps of {:g} s, a sample every {:g} s, {:g} s in all", prepared->scenario.simulation.step_s,
      prepared->scenario.motion.sample_s, prepared->scenario.motion.duration_s);
  CaseRun(benchmark, engines, &*prepared).Run(&result);
  return result;
}

size_t Benchmark::Count(CaseVerdict verdict) const {
  return static_cast<size_t>(std::ranges::count(results, verdict, &BenchmarkResult::verdict));
}

size_t Benchmark::series() const {
  size_t count = 0;
  for (size_t k = 0; k < results.size(); ++k) {
    if (results[k].verdict != CaseVerdict::kNotRun) count += cases[k].published.size();
  }
  return count;
}

int Benchmark::exit_code() const {
  bool any = false, as_stated = true;
  for (size_t k = 0; k < results.size(); ++k) {
    any = any || results[k].verdict != CaseVerdict::kNotRun;
    as_stated = as_stated && AsStated(cases[k], results[k]);
  }
  return !any ? 3 : as_stated ? 0 : 1;
}

}  // namespace mbv
