// Time per step of the simulation on the stabilizing platform, beside a bare mj_step loop on the
// same model, and time per sample of inverse mode.

#include <benchmark/benchmark.h>

#include <chrono>

#include "analytic/closed_form.h"
#include "core/demand.h"
#include "mjcf/mjcf.h"
#include "scenario/load_scenario.h"
#include "simulation/engine_model.h"
#include "simulation/simulation.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

struct Platform {
  Mechanism mechanism;
  Motion motion;
  std::unique_ptr<ClosedForm> closed_form;
  CommandSample command;

  Platform() {
    ScenarioResult result =
        LoadScenario(std::string(kSourceDir) + "/scenarios/stabilizing_platform/sea_state.yaml");
    MBV_DEMAND(result.mechanism.has_value(), result.diagnostics.Text());
    mechanism = *std::move(result.mechanism);
    motion = result.scenario->motion;
    Diagnostics diagnostics;
    closed_form = FindClosedForm(mechanism.name)->factory(mechanism, motion, {}, &diagnostics);
  }
  DrivenMotion Driven() {
    return [this](double t, DrivenSample* driven) {
      EvaluateMotion(motion, t, &command);
      return closed_form->Kinematics(command, driven);
    };
  }
};

// The loop alone (SimulationRun::loop_wall_s), recording of the samples included.
void Run(benchmark::State& state, const SimulationOptions& options) {
  Platform platform;
  double seconds = 0.0;
  long steps = 0;
  for (auto _ : state) {
    const SimulationRun run =
        Simulate(platform.mechanism, platform.motion, platform.Driven(), options);
    MBV_DEMAND(run.summary.ok(), run.summary.message);
    state.SetIterationTime(run.loop_wall_s);
    seconds += run.loop_wall_s;
    steps += run.steps;
  }
  state.counters["us_per_step"] = 1e6 * seconds / static_cast<double>(steps);
}

void BM_Corrected(benchmark::State& state) { Run(state, {}); }
void BM_Stock(benchmark::State& state) { Run(state, {.engine = Engine::kStock}); }
void BM_Inverse(benchmark::State& state) { Run(state, {.mode = SimulationMode::kInverse}); }

// mj_step and nothing else, sensors off, equalities at home.
void BM_BareMjStep(benchmark::State& state) {
  Platform platform;
  std::vector<std::string> warnings;
  simulation::EngineSession session(&warnings);
  simulation::EngineModel engine;
  MBV_DEMAND(MakeEngineModel(platform.mechanism, WriteMjcf(platform.mechanism), &engine).ok(), 0);
  engine.m->opt.disableflags |= mjDSBL_SENSOR;
  engine.m->opt.enableflags = 0;
  const simulation::DataHandle data = simulation::MakeData(*engine.m);
  constexpr int kSteps = 12000;
  for (auto _ : state) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < kSteps; ++i) mj_step(engine.m.get(), data.get());
    state.SetIterationTime(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }
  state.counters["us_per_step"] = benchmark::Counter(
      kSteps * 1e-6, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}

BENCHMARK(BM_BareMjStep)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Corrected)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Stock)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(BM_Inverse)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mbv
