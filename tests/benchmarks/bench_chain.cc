// Cost per sample and per step of chains of N four-bars: how it grows with the number of loops.
#include <benchmark/benchmark.h>

#include "reference/forward.h"
#include "reference/reference.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/four_bar_chain.h"

namespace mbv {
namespace {

void Reference(benchmark::State& state) {
  const Mechanism mechanism = FourBarChain(static_cast<int>(state.range(0)));
  const Motion motion = FourBarChainMotion(mechanism);
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  int next = 0;
  const auto solve = [&] {
    EvaluateMotion(motion, motion.sample_s * next++, &command);
    const RunSummary summary = solver.Dynamics(command, &sample);
    if (!summary.ok()) state.SkipWithError(summary.message.c_str());
  };
  solve();  // chooses rows and pivots
  for (auto _ : state) solve();
  state.SetComplexityN(state.range(0));
}

// The loop alone, per sample or step.
void Simulation(benchmark::State& state, const SimulationOptions& options) {
  const Mechanism mechanism = FourBarChain(static_cast<int>(state.range(0)));
  const Motion motion = FourBarChainMotion(mechanism);
  CommandSample command;
  const auto driven = [&](double t, DrivenSample* at) {
    EvaluateMotion(motion, t, &command);
    at->position = command.position;
    at->velocity = command.velocity;
    at->acceleration = command.acceleration;
    return RunSummary::Done();
  };
  for (auto _ : state) {
    const SimulationRun run = Simulate(mechanism, motion, driven, options);
    if (!run.summary.ok()) state.SkipWithError(run.summary.message.c_str());
    state.SetIterationTime(run.loop_cpu_s / static_cast<double>(run.steps));
  }
  state.SetComplexityN(state.range(0));
}

// Per sample, with the integration steps between and the forces there.
void FreeReference(benchmark::State& state) {
  const Mechanism mechanism = FourBarChain(static_cast<int>(state.range(0)));
  const Motion motion = FreeFourBarChainMotion(mechanism);
  for (auto _ : state) {
    const ForwardRun run = RunForwardReference(mechanism, motion, {.measure_trust = false});
    if (!run.summary.ok()) state.SkipWithError(run.summary.message.c_str());
    state.SetIterationTime(run.summary.cpu_s / static_cast<double>(run.trace.time_s.size()));
  }
  state.SetComplexityN(state.range(0));
}

// Per step, as Simulation.
void FreeSimulation(benchmark::State& state) {
  const Mechanism mechanism = FourBarChain(static_cast<int>(state.range(0)));
  const Motion motion = FreeFourBarChainMotion(mechanism);
  SimulationOptions options;
  if (RunSummary start = InitialStates(mechanism, motion, &options.start); !start.ok()) {
    state.SkipWithError(start.message.c_str());
  }
  const auto none = [](double /*t*/, DrivenSample* at) {
    at->position = at->velocity = at->acceleration = VecX::Zero(1);
    return RunSummary::Done();
  };
  for (auto _ : state) {
    const SimulationRun run = Simulate(mechanism, motion, none, options);
    if (!run.summary.ok()) state.SkipWithError(run.summary.message.c_str());
    state.SetIterationTime(run.loop_cpu_s / static_cast<double>(run.steps));
  }
  state.SetComplexityN(state.range(0));
}

void BareMjStep(benchmark::State& state) {
  const Mechanism mechanism = FourBarChain(static_cast<int>(state.range(0)));
  std::vector<std::string> warnings;
  simulation::EngineSession session(&warnings);
  simulation::EngineModel engine;
  MBV_DEMAND(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok(), 0);
  engine.m->opt.disableflags |= mjDSBL_SENSOR;
  engine.m->opt.enableflags = 0;
  const simulation::OwnJacobians jacobians(engine);
  const simulation::DataHandle data = simulation::MakeData(*engine.m);
  for (auto _ : state) mj_step(engine.m.get(), data.get());
  state.SetComplexityN(state.range(0));
}

void Loops(benchmark::internal::Benchmark* benchmark) {
  for (const int loops : {10, 20, 50, 100, 200, 500}) benchmark->Arg(loops);
  benchmark->Unit(benchmark::kMicrosecond)->Complexity();
}
BENCHMARK(Reference)->Apply(Loops);
BENCHMARK_CAPTURE(Simulation, inverse, {.mode = DriveMode::kInverse})
    ->Apply(Loops)
    ->UseManualTime()
    ->Iterations(1);
BENCHMARK_CAPTURE(Simulation, forward, {})->Apply(Loops)->UseManualTime()->Iterations(1);
BENCHMARK(FreeReference)->Apply(Loops)->UseManualTime()->Iterations(1);
BENCHMARK(FreeSimulation)->Apply(Loops)->UseManualTime()->Iterations(1);
BENCHMARK(BareMjStep)->Apply(Loops);

}  // namespace
}  // namespace mbv
