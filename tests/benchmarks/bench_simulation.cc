// Time per step of the simulation of the four papers' mechanisms beside a bare mj_step loop on the
// same model, and time per sample of inverse mode; of both what MuJoCo's own stages take that no
// implementation on MuJoCo can leave out. Ratios: scripts/performance.

#include <benchmark/benchmark.h>

#include "analytic/closed_form.h"
#include "base/demand.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

struct Case {
  Mechanism mechanism;
  Motion motion;
  double step_s = 1e-3;
  std::unique_ptr<ClosedForm> closed_form;
  CommandSample command;

  explicit Case(const std::string& scenario) {
    ScenarioResult result = LoadScenario(SourcePath("/scenarios/") + scenario + ".yaml");
    MBV_DEMAND(result.mechanism.has_value(), result.diagnostics.Text());
    mechanism = *std::move(result.mechanism);
    motion = result.scenario->motion;
    motion.duration_s = std::min(motion.duration_s, 2.0);
    step_s = result.scenario->simulation.step_s;
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

// The loop alone (SimulationRun::loop_cpu_s), recording of the samples included.
void Run(benchmark::State& state, const std::string& scenario, SimulationOptions options) {
  Case of(scenario);
  options.step_s = of.step_s;
  for (auto _ : state) {
    const SimulationRun run = Simulate(of.mechanism, of.motion, of.Driven(), options);
    MBV_DEMAND(run.summary.ok(), run.summary.message);
    state.SetIterationTime(run.loop_cpu_s / static_cast<double>(run.steps));
  }
}

// MuJoCo and nothing else on the model of a scenario, sensors off, equalities at home.
template <typename Stages>
void Bare(benchmark::State& state, const std::string& scenario, const Stages& stages) {
  Case of(scenario);
  std::vector<std::string> warnings;
  simulation::EngineSession session(&warnings);
  simulation::EngineModel engine;
  MBV_DEMAND(MakeEngineModel(of.mechanism, WriteMjcf(of.mechanism), &engine).ok(), 0);
  engine.m->opt.disableflags |= mjDSBL_SENSOR;
  engine.m->opt.enableflags = 0;
  const simulation::DataHandle data = simulation::MakeData(*engine.m);
  mj_step(engine.m.get(), data.get());
  for (auto _ : state) stages(engine.m.get(), data.get());
}

// An inverse sample whose predicted positions need no second look.
void StagesOfInverse(const mjModel* m, mjData* d) {
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_tendon(m, d);
  mj_makeConstraint(m, d);
  mj_comVel(m, d);
  mj_rnePostConstraint(m, d);
}

// A forward step without contacts, actuators and MuJoCo's own integration.
void StagesOfForward(const mjModel* m, mjData* d) {
  mj_kinematics(m, d);
  mj_comPos(m, d);
  mj_tendon(m, d);
  mj_makeConstraint(m, d);
  mj_crb(m, d);
  mj_factorM(m, d);
  mj_comVel(m, d);
  mj_rne(m, d, 0, d->qfrc_bias);
  mj_fwdAcceleration(m, d);
  mj_fwdConstraint(m, d);
}

const SimulationOptions kForward = {};
const SimulationOptions kStock = {.engine = Engine::kStock};
const SimulationOptions kInverse = {.mode = DriveMode::kInverse};

const int kRegistered = [] {
  for (const auto& row :
       {std::pair<std::string, std::string>{"platform", "stabilizing_platform/sea_state"},
        {"tripod", "spr_tripod/harmonic"},
        {"scara", "scara_robot/default"},
        {"cabin", "cabin_robot/default"}}) {
    const std::string &name = row.first, &scenario = row.second;
    const auto add = [&](const std::string& what, const SimulationOptions& options) {
      benchmark::RegisterBenchmark((what + "/" + name).c_str(),
                                   [=](benchmark::State& state) { Run(state, scenario, options); })
          ->UseManualTime()
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(2);
    };
    const auto add_bare = [&](const std::string& what, void (*stages)(const mjModel*, mjData*)) {
      benchmark::RegisterBenchmark((what + "/" + name).c_str(),
                                   [=](benchmark::State& state) { Bare(state, scenario, stages); })
          ->Unit(benchmark::kMicrosecond)
          ->Iterations(4000);
    };
    add_bare("mj_step", &mj_step);
    add_bare("stages_inverse", &StagesOfInverse);
    add_bare("stages_forward", &StagesOfForward);
    add("forward", kForward);
    add("stock", kStock);
    add("inverse", kInverse);
  }
  return 0;
}();

}  // namespace
}  // namespace mbv
