// J̇q̇ of every kind of row against differences of MuJoCo's own J q̇ along the motion.
#include "simulation/engine/constraint_system.h"

#include <gtest/gtest.h>

#include <random>

#include "model_file/load_model.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/simulated.h"
#include "tests/support/source_dir.h"

namespace mbv::simulation {
namespace {

// Connect, tendon and joint rows with balls, free and merged joints (platform, tripod, SCARA), and
// welds between turning bodies (four-bar), couplings of joints (geared press).
std::vector<Mechanism> Mechanisms() {
  std::vector<Mechanism> all{fixtures::MakeFourBar()};
  for (const char* name : {"stabilizing_platform", "spr_tripod", "scara_robot", "geared_press"}) {
    LoadResult result = LoadModel(std::string(kSourceDir) + "/models/" + name + "/model.yaml");
    if (result.mechanism.has_value()) all.push_back(*std::move(result.mechanism));
  }
  EXPECT_EQ(all.size(), 5u);
  return all;
}

TEST(ConstraintSystem, BiasIsTheRateOfChangeOfTheJacobian) {
  for (const Mechanism& mechanism : Mechanisms()) {
    std::vector<std::string> warnings;
    EngineSession session(&warnings);
    EngineModel engine;
    ASSERT_TRUE(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok());
    const DataHandle data = MakeData(*engine.m);
    mjData* d = data.get();
    ConstraintSystem system(engine, d);
    std::mt19937_64 random(20220809);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    VecX v(engine.m->nv);
    for (double& x : v) x = uniform(random);
    // Off the manifold too: loops open, welds twisted by small amounts.
    VecX offset = 0.02 * v.reverse();
    mj_integratePos(engine.m.get(), d->qpos, offset.data(), 1.0);
    const VecX q0 = Eigen::Map<const VecX>(d->qpos, engine.m->nq);
    const auto J_v_at = [&](double t) -> VecX {
      std::copy(q0.begin(), q0.end(), d->qpos);
      mj_integratePos(engine.m.get(), d->qpos, v.data(), t);
      system.EvaluatePosition();
      return system.J() * v;
    };
    constexpr double h = 1e-3;
    const VecX difference =
        (8.0 * (J_v_at(h) - J_v_at(-h)) - (J_v_at(2 * h) - J_v_at(-2 * h))) / (12.0 * h);
    (void)J_v_at(0.0);
    std::copy(v.begin(), v.end(), d->qvel);
    mj_comVel(engine.m.get(), d);
    VecX bias;
    system.Bias(&bias);
    // Fourth-order difference: h⁴ times fifth derivatives of order one to ten, and ε/h.
    EXPECT_LT((bias - difference).lpNorm<Eigen::Infinity>(), 1e-9 * (1.0 + bias.norm()))
        << mechanism.name;
    EXPECT_GT(bias.norm(), 0.1) << mechanism.name;
  }
}

// MuJoCo's own rows, dense and sparse, off the home pose.
TEST(ConstraintSystem, TheJacobianIsThatOfMuJoCoInBothFormats) {
  for (const Mechanism& mechanism : Mechanisms()) {
    std::vector<std::string> warnings;
    EngineSession session(&warnings);
    MatX J[2], tendons[2];
    for (const bool sparse : {false, true}) {
      EngineModel engine;
      ASSERT_TRUE(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok());
      EXPECT_FALSE(engine.sparse) << mechanism.name;
      engine.sparse = sparse;
      const DataHandle data = MakeData(*engine.m);
      ConstraintSystem system(engine, data.get());
      VecX offset = VecX::LinSpaced(engine.m->nv, -0.05, 0.04);
      mj_integratePos(engine.m.get(), data->qpos, offset.data(), 1.0);
      system.EvaluatePosition();
      J[sparse] = MatX(system.J());
      tendons[sparse] = Eigen::Map<const RowMajor>(data->ten_J, engine.m->ntendon, engine.m->nv);
      if (sparse) continue;
      const Eigen::Map<const RowMajor> dense(data->efc_J, system.rows(), engine.m->nv);
      EXPECT_EQ(J[0], MatX(dense)) << mechanism.name;
    }
    EXPECT_LT((J[1] - J[0]).cwiseAbs().maxCoeff(), 1e-15) << mechanism.name;
    EXPECT_EQ(tendons[0], tendons[1]) << mechanism.name;
  }
}

TEST(ConstraintSystem, ResidualOfADrivenRowIsPositionMinusTarget) {
  const Mechanism mechanism = fixtures::MakeFourBar();
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  EngineModel engine;
  ASSERT_TRUE(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok());
  const DataHandle data = MakeData(*engine.m);
  ConstraintSystem system(engine, data.get());
  system.SetTargets(VecX::Constant(1, 0.9));
  data->qpos[0] = 1.2;
  system.EvaluatePosition();
  EXPECT_EQ(system.rows(), 7);
  EXPECT_EQ(system.closure_rows(), 6);
  EXPECT_NEAR(system.residual()[6], 0.3, 1e-15);
  // The crank tip moved by 2·0.2·sin(0.1) and took the coupler's end with it.
  EXPECT_GT(system.LargestGap().position_m, 0.03);
  EXPECT_NEAR(system.LargestGap().rotation_rad, 0.2, 1e-12);
}

}  // namespace
}  // namespace mbv::simulation
