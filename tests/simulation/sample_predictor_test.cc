// Predictions along smooth motions against motions integrated in small steps.
#include "simulation/engine/closure_solver.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "simulation/engine/session.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/support/source_dir.h"

namespace mbv::simulation {
namespace {

// All velocities of a model are sines; where that leads is integrated.
struct SmoothMotion {
  EngineModel engine;
  DataHandle data;

  explicit SmoothMotion(const Mechanism& mechanism) {
    EXPECT_TRUE(MakeEngineModel(mechanism, WriteMjcf(mechanism), &engine).ok());
    data = MakeData(*engine.m);
  }
  [[nodiscard]] VecX Velocity(double t, bool derivative = false) const {
    VecX v(engine.m->nv);
    for (Eigen::Index i = 0; i < v.size(); ++i) {
      const double w = 1.0 + 0.1 * static_cast<double>(i % 7), phase = static_cast<double>(i);
      v[i] = derivative ? w * std::cos(w * t + phase) : std::sin(w * t + phase);
    }
    return v;
  }
  // From t to t + h, in steps whose error is round-off.
  void Integrate(double t, double h, std::vector<double>* qpos) const {
    constexpr int kSteps = 2000;
    const double dt = h / kSteps;
    VecX work;
    for (int i = 0; i < kSteps; ++i) {
      const double from = t + i * dt;
      const VecX v_0 = Velocity(from), v_1 = Velocity(from + dt);
      const VecX mean = (v_0 + 4.0 * Velocity(from + 0.5 * dt) + v_1) / 6.0;
      AdvancePositions(engine, dt, mean, v_0, v_1, &work, qpos->data());
    }
  }
  // Of the prediction from the n-th sample.
  [[nodiscard]] double Error(double h, int samples, double perturbation = 0.0) {
    SamplePredictor predictor(engine);
    mjData* d = data.get();
    std::vector<double> qpos(engine.m->qpos0, engine.m->qpos0 + engine.m->nq);
    for (int i = 0; i < samples; ++i) {
      const double t = i * h;
      std::copy(qpos.begin(), qpos.end(), d->qpos);
      const VecX v = Velocity(t), a = Velocity(t, true);
      std::copy(v.begin(), v.end(), d->qvel);
      std::copy(a.begin(), a.end(), d->qacc);
      d->qacc[0] *= 1.0 + perturbation;
      predictor.Predict(h, d);
      Integrate(t, h, &qpos);
    }
    double error = 0.0;
    for (size_t i = 0; i < qpos.size(); ++i)
      error = std::max(error, std::abs(d->qpos[i] - qpos[i]));
    return error;
  }
};

Mechanism Load(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/") + name + "/model.yaml");
  EXPECT_TRUE(result.mechanism.has_value());
  return *std::move(result.mechanism);
}

// Of hinges and slides with n samples the order of the error is 2n + 1: at half the interval it is
// 2^(2n + 1) times as small.
TEST(SamplePredictor, GainsTwoOrdersWithEverySample) {
  const Mechanism mechanism = Load("cabin_robot");
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  SmoothMotion motion(mechanism);
  for (const int samples : {1, 2, 3, 4}) {
    const double gain = motion.Error(0.4, samples) / motion.Error(0.2, samples);
    EXPECT_GT(std::log2(gain), 2 * samples + 0.5) << samples;
    EXPECT_LT(std::log2(gain), 2 * samples + 2.0) << samples;
  }
  EXPECT_LT(motion.Error(0.05, 5), 1e-14);
  EXPECT_GT(motion.Error(0.05, 5, 1e-6), 1e-10);
}

// Balls turn about axes that turn: seventh order at most.
TEST(SamplePredictor, TurnsBallsWithAnErrorOfSeventhOrder) {
  const Mechanism mechanism = Load("spr_tripod");
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  SmoothMotion motion(mechanism);
  ASSERT_NE(std::ranges::count(motion.engine.dof_is_rotation3, true), 0);
  const double gain = motion.Error(0.2, 5) / motion.Error(0.1, 5);
  EXPECT_NEAR(std::log2(gain), 7.0, 0.5);
  EXPECT_LT(motion.Error(0.02, 5), 1e-14);
}

}  // namespace
}  // namespace mbv::simulation
