// Cost per sample of the closed forms (goals: platform 4 µs), and per pose of the stiffness forms.
#include <benchmark/benchmark.h>

#include "analytic/stiffness_form.h"
#include "base/demand.h"
#include "model_file/load_model.h"
#include "tests/analytic/stabilizing_platform_fixture.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

Mechanism Shipped(const std::string& name, const std::string& file = "model.yaml") {
  LoadResult loaded = LoadModel(SourcePath("/models/") + name + "/" + file);
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

// One pose of a map: matrices and indices; with_shares: what a single pose is asked.
void Stiffness(benchmark::State& state, const char* name, const PoseCoordinates& start,
               bool with_shares) {
  const Mechanism mechanism = Shipped(name, "elastic.yaml");
  Diagnostics diagnostics;
  PoseCoordinates pose = start;
  const auto form = FindStiffnessForm(name)->factory(mechanism, pose, "", &diagnostics);
  MBV_DEMAND(form != nullptr, diagnostics.Text());
  std::vector<double> values(form->indices().size());
  double& x = pose.at("platform.x");
  size_t k = 0;
  for (auto _ : state) {
    x = start.at("platform.x") + 1e-4 * static_cast<double>(k++ % 100);
    const StiffnessResult result =
        with_shares ? form->Evaluate(pose) : form->EvaluateMatrices(pose);
    if (!result.summary.ok()) state.SkipWithError(result.summary.message.c_str());
    form->IndexValues(result, values);
    benchmark::DoNotOptimize(values.data());
  }
}

const PoseCoordinates kScaraPose = {
    {"platform.x", -0.05}, {"platform.y", -0.05}, {"platform.z", -0.15}, {"platform.yaw", 0.2}};
const PoseCoordinates kCabinPose = {{"platform.x", -0.005}, {"platform.y", 0.36},
                                    {"platform.yaw", 0.0},  {"th3", 1.57},
                                    {"th4", 0.0},           {"d5", -0.2}};
BENCHMARK_CAPTURE(Stiffness, scara_map, "scara_robot", kScaraPose, false);
BENCHMARK_CAPTURE(Stiffness, scara_pose, "scara_robot", kScaraPose, true);
BENCHMARK_CAPTURE(Stiffness, cabin_map, "cabin_robot", kCabinPose, false);
BENCHMARK_CAPTURE(Stiffness, cabin_pose, "cabin_robot", kCabinPose, true);

}  // namespace
}  // namespace mbv
