// Cost per sample and per step of chains of N four-bars: how it grows with the number of loops.
#include <benchmark/benchmark.h>

#include <cmath>

#include "reference/forward.h"
#include "reference/reference.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/four_bar_chain.h"
#include "tests/mechanisms/loop_shapes.h"

namespace mbv {
namespace {

// A mechanism by its number of loops, and how it moves.
struct Shape {
  Mechanism (*make)(int loops);
  Motion (*move)(const Mechanism& mechanism);
};
Motion Swing(const Mechanism& mechanism) { return SwingAllDrives(mechanism, 0.1); }
// In proportion to what the angles of a polygon are.
Motion SwingLoop(const Mechanism& mechanism) {
  return SwingAllDrives(mechanism, 0.2 / static_cast<double>(mechanism.bodies.size()));
}
Motion SwingLegs(const Mechanism& mechanism) { return SwingAllDrives(mechanism, 0.01); }
constexpr Shape kChain{FourBarChain, FourBarChainMotion};
constexpr Shape kScissors{[](int n) { return MechanismOf(ScissorLiftText(n)); }, Swing};
constexpr Shape kStoreys{[](int n) { return MechanismOf(StoreysText(n)); }, Swing};
constexpr Shape kPlacedScissors{[](int n) { return MechanismOf(ScissorLiftText(n, true)); }, Swing};
constexpr Shape kPlacedStoreys{[](int n) { return MechanismOf(StoreysText(n, true)); }, Swing};
constexpr Shape kPlacedLoop{[](int n) { return MechanismOf(LongLoopText(n, true)); }, SwingLoop};
constexpr Shape kNet{
    [](int n) { return MechanismOf(NetOfPlatesText(static_cast<int>(std::lround(std::sqrt(n))))); },
    Swing};
constexpr Shape kHexapods{[](int n) { return MechanismOf(HexapodsText(n / 5)); }, SwingLegs};
constexpr Shape kLoop{[](int n) { return MechanismOf(LongLoopText(n)); }, SwingLoop};

void Reference(benchmark::State& state, const Shape& shape) {
  const Mechanism mechanism = shape.make(static_cast<int>(state.range(0)));
  const Motion motion = shape.move(mechanism);
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
void Simulation(benchmark::State& state, const Shape& shape, DriveMode mode) {
  const Mechanism mechanism = shape.make(static_cast<int>(state.range(0)));
  const Motion motion = shape.move(mechanism);
  const SimulationOptions options{.mode = mode};
  const DrivenMotion driven = FollowCommands(motion);
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

void BareMjStep(benchmark::State& state, const Shape& shape) {
  const Mechanism mechanism = shape.make(static_cast<int>(state.range(0)));
  std::vector<std::string> warnings;
  simulation::EngineSession session(&warnings);
  simulation::EngineModel engine;
  const RunSummary made = MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine);
  if (!made.ok()) {  // nested too deep, for one
    state.SkipWithError(made.message.c_str());
    return;
  }
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

// From some 20 to some 200 loops; of nets, of which a square number is.
void FewLoops(benchmark::internal::Benchmark* benchmark) {
  for (const int loops : {20, 60, 200}) benchmark->Arg(loops);
  benchmark->Unit(benchmark::kMicrosecond);
}
void Squares(benchmark::internal::Benchmark* benchmark) {
  for (const int loops : {25, 64, 121}) benchmark->Arg(loops);
  benchmark->Unit(benchmark::kMicrosecond);
}

#define MBV_SHAPE(name, shape, sizes)                                            \
  BENCHMARK_CAPTURE(Reference, name, shape)->Apply(sizes);                       \
  BENCHMARK_CAPTURE(Simulation, name##_inverse, shape, DriveMode::kInverse)      \
      ->Apply(sizes)                                                             \
      ->UseManualTime()                                                          \
      ->Iterations(1);                                                           \
  BENCHMARK_CAPTURE(Simulation, name##_forward, shape, SimulationOptions{}.mode) \
      ->Apply(sizes)                                                             \
      ->UseManualTime()                                                          \
      ->Iterations(1);                                                           \
  BENCHMARK_CAPTURE(BareMjStep, name, shape)->Apply(sizes)

MBV_SHAPE(chain, kChain, Loops);
MBV_SHAPE(scissors, kScissors, FewLoops);
MBV_SHAPE(storeys, kStoreys, FewLoops);
MBV_SHAPE(net, kNet, Squares);
MBV_SHAPE(hexapods, kHexapods, FewLoops);
MBV_SHAPE(loop, kLoop, FewLoops);
MBV_SHAPE(placed_scissors, kPlacedScissors, FewLoops);
MBV_SHAPE(placed_storeys, kPlacedStoreys, FewLoops);
MBV_SHAPE(placed_loop, kPlacedLoop, FewLoops);
BENCHMARK(FreeReference)->Apply(Loops)->UseManualTime()->Iterations(1);
BENCHMARK(FreeSimulation)->Apply(Loops)->UseManualTime()->Iterations(1);

}  // namespace
}  // namespace mbv
