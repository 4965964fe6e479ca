// Cost of all derivatives of inverse dynamics beside one inverse dynamics, and of the second way to
// them. States a little apart from each other, as along a motion.
#include <benchmark/benchmark.h>
#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string>

#include "base/demand.h"
#include "features/certify/certify.h"
#include "kinematics/command_rank.h"
#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

struct Moving {
  explicit Moving(const std::string& name) {
    LoadResult loaded = LoadModel(SourcePath(fmt::format("/models/{}/model.yaml", name)));
    MBV_DEMAND(loaded.mechanism.has_value(), name);
    mechanism = *std::move(loaded.mechanism);
    Diagnostics found;
    const auto chosen = ChooseNamedCoordinates(mechanism, {}, {}, &found);
    MBV_DEMAND(chosen.has_value(), found.Text());
    std::vector<Coordinate> coordinates;
    for (const auto* list : {&chosen->coordinates, &chosen->held}) {
      for (const NamedCoordinate& at : *list) {
        coordinates.push_back(at.coordinate);
        motion.commands.push_back({.name = at.name, .terms = {{at.coordinate, 1.0}}});
      }
    }
    model.emplace(mechanism, coordinates);
    home = model->home();
    v = 0.1 * VecX::Ones(home.size());
  }
  void Step() {
    const VecX q = home + 1e-3 * std::sin(0.1 * ++steps) * VecX::Ones(home.size());
    MBV_DEMAND(model->Move(q, v, v).ok(), mechanism.name);
    MBV_DEMAND(model->Motions(&T).ok(), mechanism.name);
    command.position = q, command.velocity = v, command.acceleration = v;
  }

  Mechanism mechanism;
  Motion motion;
  std::optional<ReducedModel> model;
  VecX home, v;
  MatX T;
  CommandSample command;
  int steps = 0;
};

void InverseDynamics(benchmark::State& state, const std::string& name) {
  Moving moving(name);
  for (auto _ : state) {
    moving.Step();
    benchmark::DoNotOptimize(moving.model->Forces(moving.T, {}));
  }
}

void WithDerivatives(benchmark::State& state, const std::string& name) {
  Moving moving(name);
  ForceDerivatives slopes;
  for (auto _ : state) {
    moving.Step();
    MBV_DEMAND(moving.model->Derivatives(moving.T, {}, &slopes).ok(), name);
  }
}

void OfEveryForce(benchmark::State& state, const std::string& name) {
  Moving moving(name);
  EveryForce every;
  for (auto _ : state) {
    moving.Step();
    MBV_DEMAND(moving.model->AllDerivatives(moving.T, {}, &every).ok(), name);
  }
}

void ByDualNumbers(benchmark::State& state, const std::string& name) {
  Moving moving(name);
  ExactDerivatives slopes;
  for (auto _ : state) {
    moving.Step();
    MBV_DEMAND(DifferentiateExactly(moving.mechanism, moving.motion, moving.model->states(),
                                    moving.command, &slopes)
                   .empty(),
               name);
  }
}

#define MBV_ALL(name)                                                             \
  BENCHMARK_CAPTURE(InverseDynamics, name, #name)->Unit(benchmark::kMicrosecond); \
  BENCHMARK_CAPTURE(WithDerivatives, name, #name)->Unit(benchmark::kMicrosecond); \
  BENCHMARK_CAPTURE(OfEveryForce, name, #name)->Unit(benchmark::kMicrosecond);    \
  BENCHMARK_CAPTURE(ByDualNumbers, name, #name)->Unit(benchmark::kMicrosecond)
MBV_ALL(stabilizing_platform);
MBV_ALL(spr_tripod);
MBV_ALL(cabin_robot);
MBV_ALL(scara_robot);
MBV_ALL(stewart);

}  // namespace
}  // namespace mbv
