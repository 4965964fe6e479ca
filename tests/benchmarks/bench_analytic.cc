// Cost per sample of the closed forms (goals: platform 4 µs).
#include <benchmark/benchmark.h>

#include "core/demand.h"
#include "mechanism/load_model.h"
#include "tests/analytic/stabilizing_platform_fixture.h"

namespace mbv {
namespace {

Mechanism Shipped(const std::string& name) {
  LoadResult loaded = LoadModel(MBV_SOURCE_DIR "/models/" + name + "/model.yaml");
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  return std::move(*loaded.mechanism);
}

// Evaluates a closed form at 100 instants of its motion, over and over.
void RunSamples(benchmark::State& state, ClosedForm* closed_form, const Motion& motion,
                bool with_forces) {
  std::vector<CommandSample> commands(100);
  for (size_t k = 0; k < commands.size(); ++k) {
    EvaluateMotion(motion, motion.duration_s * static_cast<double>(k) / 100.0, &commands[k]);
  }
  ClosedFormSample sample;
  size_t k = 0;
  for (auto _ : state) {
    const CommandSample& command = commands[k++ % commands.size()];
    const RunSummary summary = with_forces ? closed_form->Dynamics(command, &sample)
                                           : closed_form->Kinematics(command, &sample.driven);
    if (!summary.ok()) state.SkipWithError(summary.message.c_str());
    benchmark::DoNotOptimize(sample.force.data());
  }
}

void StabilizingPlatform(benchmark::State& state, const char* model, bool with_forces,
                         bool with_reactions, bool hold_still) {
  using namespace stabilizing_platform;
  // The bare names have no joints, hence no reaction channels.
  const Mechanism shipped = Shipped("stabilizing_platform");
  const Mechanism mechanism = with_reactions ? shipped : MechanismOfNames(DefaultParameters());
  const Motion motion = SeaStateMotion(mechanism, hold_still);
  Diagnostics diagnostics;
  const auto closed_form =
      MakeClosedForm(mechanism, motion, {.model = model, .as_printed = {}}, &diagnostics);
  MBV_DEMAND(closed_form != nullptr, diagnostics.Text());
  RunSamples(state, closed_form.get(), motion, with_forces);
}

BENCHMARK_CAPTURE(StabilizingPlatform, kinematics, "full", false, false, false);
BENCHMARK_CAPTURE(StabilizingPlatform, full, "full", true, false, false);
BENCHMARK_CAPTURE(StabilizingPlatform, full_reactions, "full", true, true, false);
BENCHMARK_CAPTURE(StabilizingPlatform, massless, "massless", true, false, false);
BENCHMARK_CAPTURE(StabilizingPlatform, hold_still, "full", true, false, true);

}  // namespace
}  // namespace mbv
