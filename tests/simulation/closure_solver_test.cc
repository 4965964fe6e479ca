// Sparse solutions of many loops whose motion nothing prescribes, against dense ones.
#include "simulation/engine/closure_solver.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "reference/forward.h"
#include "simulation/engine/engine_model.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/four_bar_chain.h"

namespace mbv::simulation {
namespace {

VecX Wave(Eigen::Index size, double step) {
  return VecX::NullaryExpr(
      size, [step](Eigen::Index i) { return std::sin(1.0 + step * static_cast<double>(i)); });
}

// A chain of parallelograms in free motion, closed with its rockers at an angle.
struct FreeChain {
  explicit FreeChain(int loops, double angle) : mechanism(FourBarChain(loops)), session(&warnings) {
    EXPECT_TRUE(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok());
    ReleaseForcedDrives(FreeFourBarChainMotion(mechanism), &engine);
    data = MakeData(*engine.m);
    for (int j = 0; j < engine.m->njnt; ++j) {
      const bool rocker = mj_id2name(engine.m.get(), mjOBJ_JOINT, j)[0] == 'D';
      data->qpos[engine.m->jnt_qposadr[j]] = rocker ? angle : -angle;
    }
    system.emplace(engine, data.get());
    solver.emplace(&*system);
    const RunSummary summary = solver->Close(VecX::Constant(1, angle));
    EXPECT_TRUE(summary.ok()) << summary.message;
    dense.compute(system->ScaledJ(), Eigen::ComputeThinU | Eigen::ComputeThinV);
    dense.setThreshold(1e-9);
  }

  Mechanism mechanism;
  std::vector<std::string> warnings;
  EngineSession session;
  EngineModel engine;
  DataHandle data;
  std::optional<ConstraintSystem> system;
  std::optional<ClosureSolver> solver;
  Eigen::BDCSVD<MatX> dense;  // of J'
};

TEST(ClosureSolver, SparseSolutionsOfFreeChainsAreThoseOfSingularValues) {
  constexpr int kLoops = 60;
  FreeChain chain(kLoops, 0.7), other(kLoops, 0.7 + 1e-5);
  ClosureSolver& solver = *chain.solver;
  const VecX &unit = chain.system->row_unit(), &dof = chain.system->dof_unit();
  const int rows = chain.system->rows(), nv = chain.system->nv();
  const MatX J = chain.system->ScaledJ();
  ASSERT_GT(nv, 100);  // fewer are dense
  EXPECT_EQ(solver.undriven(), 1);
  EXPECT_EQ(solver.redundant(), rows - (nv - 1));
  EXPECT_TRUE(solver.DrivenRowsNotUnique().empty());

  // A motion that the loops do not have, and the nearest one that they have.
  const VecX v = VecX::Ones(nv) + Wave(nv, 0.3);
  std::copy(v.begin(), v.end(), chain.data->qvel);
  solver.CorrectVelocity(VecX::Zero(1));
  const VecX scaled = v.cwiseQuotient(dof);
  const VecX nearest = (scaled - chain.dense.solve(J * scaled)).cwiseProduct(dof);
  ASSERT_GT((v - nearest).norm(), 0.1 * v.norm());
  ASSERT_GT(nearest.norm(), 0.01 * v.norm());
  EXPECT_LT((Eigen::Map<const VecX>(chain.data->qvel, nv) - nearest).norm(), 1e-11 * v.norm());

  // Forces that balance what can be balanced, and those that nothing needs.
  const VecX tau = Wave(nv, 0.7), force = Wave(rows, 1.1);
  solver.SolveForces(tau);
  const auto balanced = [&](const FreeChain& at) -> VecX {
    return VecX(at.dense.transpose().solve(tau.cwiseProduct(dof))).cwiseQuotient(unit);
  };
  const VecX least = balanced(chain);
  EXPECT_LT((chain.system->force() - least).norm(), 1e-9 * least.norm());
  EXPECT_GT((balanced(other) - least).norm(), 1e-7 * least.norm());
  VecX left = force;
  solver.RemoveSelfStress(&left);
  const VecX acting = (J * chain.dense.solve(force.cwiseProduct(unit))).cwiseQuotient(unit);
  ASSERT_GT((force - acting).norm(), 0.1 * force.norm());
  ASSERT_GT(acting.norm(), 0.1 * force.norm());
  EXPECT_LT((left - acting).norm(), 1e-11 * force.norm());

  const auto& values = chain.dense.singularValues();
  const double longest = J.rowwise().norm().maxCoeff();
  EXPECT_NEAR(solver.WeakestPivot() * longest / values[nv - 2], 1.0, 0.02);
  EXPECT_LT(values[nv - 1], 1e-12 * values[0]);
}

// Towards the flat pose, where the chain may leave its parallelograms.
TEST(ClosureSolver, APivotThatFadesIsSeenInManyLoops) {
  std::vector<double> pivots;
  for (const double angle : {0.3, 0.03, 0.01}) {
    pivots.push_back(FreeChain(60, angle).solver->WeakestPivot());
  }
  EXPECT_NEAR(pivots[1] / pivots[0], 0.1, 0.02);
  EXPECT_NEAR(pivots[2] / pivots[1], 1.0 / 3.0, 0.02);
}

// All rockers turn alike: (N + 1) I φ̈ + N m l² φ̈ = M − ((N + 1) m_r s + N m l) g cos φ.
TEST(ClosureSolver, FreeChainsMoveAsOnePendulum) {
  for (const int loops : {60, 500}) {
    const Mechanism mechanism = FourBarChain(loops);
    Motion motion = FreeFourBarChainMotion(mechanism);
    motion.duration_s = 0.04;
    const double n = loops, inertia = (n + 1.0) * (1.3e-3 + 0.4 * 0.01) + n * 0.8 * 0.04;
    const double weight = 9.81 * ((n + 1.0) * 0.4 * 0.1 + n * 0.8 * 0.2);
    const auto worst = [&](const Trace& trace, double factor) {
      const int q = trace.Find(Quantity::kPosition, "motor");
      const int a = trace.Find(Quantity::kAcceleration, "motor");
      double most = 0.0;
      for (Eigen::Index i = 0; i < trace.values.rows(); ++i) {
        const double moment = 0.5 - weight * std::cos(trace.values(i, q));
        most = std::max(most, std::abs(trace.values(i, a) * inertia * factor - moment) / weight);
      }
      return most;
    };
    const ForwardRun reference = RunForwardReference(mechanism, motion, {});
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    EXPECT_LT(worst(reference.trace, 1.0), 1e-10) << loops;
    EXPECT_GT(worst(reference.trace, 1.0 + 1e-7), 1e-10) << loops;
    SimulationOptions options;
    ASSERT_TRUE(InitialStates(mechanism, motion, &options.start).ok());
    const auto none = [](double /*t*/, DrivenSample* at) {
      at->position = at->velocity = at->acceleration = VecX::Zero(1);
      return RunSummary::Done();
    };
    const SimulationRun run = Simulate(mechanism, motion, none, options);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(worst(run.trace, 1.0), 1e-8) << loops;
    EXPECT_GT(worst(run.trace, 1.0 + 1e-5), 1e-8) << loops;
  }
}

}  // namespace
}  // namespace mbv::simulation
