// Cost of the reference witness per sample: kinematics alone and with all forces.
#include <benchmark/benchmark.h>

#include <string>

#include "kinematics/mobility.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

ScenarioResult Load(benchmark::State& state, const std::string& scenario) {
  ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/") + scenario);
  if (!loaded.scenario || !loaded.mechanism) state.SkipWithError("scenario does not load");
  return loaded;
}

// Walks through the scenario's samples, again from the start at its end.
void FollowScenario(benchmark::State& state, const std::string& scenario, bool forces) {
  const ScenarioResult loaded = Load(state, scenario);
  if (!loaded.scenario || !loaded.mechanism) return;
  const Motion& motion = loaded.scenario->motion;
  const std::vector<double> times = SampleTimes(motion.duration_s, motion.sample_s);
  ReferenceSolver solver(*loaded.mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  size_t next = 0;
  for (auto _ : state) {
    EvaluateMotion(motion, times[next], &command);
    const RunSummary summary =
        forces ? solver.Dynamics(command, &sample) : solver.Kinematics(command, &sample);
    if (!summary.ok()) state.SkipWithError(summary.message.c_str());
    next = (next + 1) % times.size();
  }
}

void Kinematics(benchmark::State& state, const std::string& scenario) {
  FollowScenario(state, scenario, false);
}
void Forces(benchmark::State& state, const std::string& scenario) {
  FollowScenario(state, scenario, true);
}
constexpr auto kUnit = benchmark::kMicrosecond;
BENCHMARK_CAPTURE(Kinematics, platform, "stabilizing_platform/sea_state.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Kinematics, tripod, "spr_tripod/harmonic.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Kinematics, scara, "scara_robot/default.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Kinematics, cabin, "cabin_robot/default.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Forces, platform, "stabilizing_platform/sea_state.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Forces, tripod, "spr_tripod/harmonic.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Forces, scara, "scara_robot/default.yaml")->Unit(kUnit);
BENCHMARK_CAPTURE(Forces, cabin, "cabin_robot/default.yaml")->Unit(kUnit);

void Mobility(benchmark::State& state) {
  const ScenarioResult loaded = Load(state, "stabilizing_platform/sea_state.yaml");
  if (!loaded.mechanism) return;
  for (auto _ : state) benchmark::DoNotOptimize(AnalyseMobility(*loaded.mechanism));
}
BENCHMARK(Mobility)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mbv
