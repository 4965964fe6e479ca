// Cost of a state by the solver object: rows of a motion (also on all cores: real time), and single
// calls.
#include <benchmark/benchmark.h>

#include <cmath>

#include <string>
#include <vector>

#include "base/demand.h"
#include "base/types.h"
#include "mbverify/solver.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

constexpr Eigen::Index kRows = 4096;

Model ModelOf(const std::string& name) {
  return Model::Load(SourcePath("/models/" + name + "/model.yaml"));
}

// All that is driven.
Solver SolverOf(const Model& model) {
  std::vector<std::string> names = model.drives();
  for (const std::string& prescribed : model.prescribed()) names.push_back(prescribed);
  return Solver(model, names);
}

// Positions, rates and accelerations of an oscillation about home.
struct Oscillation {
  explicit Oscillation(const Solver& solver) {
    const Eigen::Index n = solver.size();
    q.resize(kRows, n), v.resize(kRows, n), a.resize(kRows, n);
    for (Eigen::Index i = 0; i < kRows; ++i) {
      for (Eigen::Index k = 0; k < n; ++k) {
        const double t = 5e-4 * static_cast<double>(i) + static_cast<double>(k);
        q(i, k) = solver.home()[k] + 0.02 * std::sin(t);
        v(i, k) = 0.02 * std::cos(t);
        a(i, k) = -0.02 * std::sin(t);
      }
    }
  }
  MatX q, v, a;
};

void Rows(benchmark::State& state, const char* name, int threads) {
  const Solver solver = SolverOf(ModelOf(name));
  const Oscillation motion(solver);
  MatX forces;
  for (auto _ : state) {
    const BatchStatus status =
        solver.InverseDynamicsRows(motion.q, motion.v, motion.a, &forces, threads);
    MBV_DEMAND(status.ok(), status.failed.front().second.message);
  }
  state.SetItemsProcessed(state.iterations() * kRows);
}

void Equations(benchmark::State& state, const char* scenario) {
  const PaperEquations equations =
      PaperEquations::Load(SourcePath(std::string("/scenarios/") + scenario));
  MatX q, v, a, forces;
  equations.MotionAt(VecX::LinSpaced(kRows, 0.0, equations.duration_s()), &q, &v, &a);
  for (auto _ : state) {
    const BatchStatus status = equations.InverseDynamicsRows(q, v, a, &forces, 0);
    MBV_DEMAND(status.ok(), status.failed.front().second.message);
  }
  state.SetItemsProcessed(state.iterations() * kRows);
}

void SingleCalls(benchmark::State& state, const char* name) {
  Solver solver = SolverOf(ModelOf(name));
  const Oscillation motion(solver);
  Forces forces;
  Eigen::Index i = 0;
  for (auto _ : state) {
    i = (i + 1) % kRows;
    const Status status =
        solver.InverseDynamics(motion.q.row(i).transpose(), motion.v.row(i).transpose(),
                               motion.a.row(i).transpose(), {}, &forces);
    MBV_DEMAND(status.ok(), status.message);
  }
  state.SetItemsProcessed(state.iterations());
}

BENCHMARK_CAPTURE(Rows, stewart, "stewart", 1);
BENCHMARK_CAPTURE(Rows, stewart_all_cores, "stewart", 0)->UseRealTime();
BENCHMARK_CAPTURE(Rows, platform, "stabilizing_platform", 1);
BENCHMARK_CAPTURE(Rows, platform_all_cores, "stabilizing_platform", 0)->UseRealTime();
BENCHMARK_CAPTURE(Equations, platform_all_cores, "stabilizing_platform/sea_state.yaml")
    ->UseRealTime();
BENCHMARK_CAPTURE(SingleCalls, stewart, "stewart");
BENCHMARK_CAPTURE(SingleCalls, platform, "stabilizing_platform");

}  // namespace
}  // namespace mbv
