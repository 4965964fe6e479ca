// How fast springs, dampers and servos are, against formulas.
#include "simulation/engine/integrator.h"

#include <gtest/gtest.h>

#include <cmath>

#include "simulation/engine/closure_solver.h"
#include "simulation/mjcf/mjcf.h"
#include "tests/mechanisms/simulated.h"

namespace mbv::simulation {
namespace {

// A body of 2 kg on a rail along x, between a wall at −1 m and itself a spring and a damper.
Mechanism Cart(double stiffness, double damping) {
  Mechanism m;
  m.name = "cart";
  m.gravity_W = Vec3::Zero();
  m.bodies = {Body{}, fixtures::MakeBody("cart", 2.0, Vec3::Zero(), Vec3::Constant(0.01))};
  m.bodies[0].name = "world";
  Joint rail;
  rail.name = "rail";
  rail.kind = JointKind::kPrismatic;
  rail.parent = 0;
  rail.child = 1;
  rail.X_PF = rail.X_CM =
      fixtures::PoseAt(Vec3::Zero(), Mat3(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY())));
  m.joints = {rail};
  m.tree_joints = {0};
  m.tree_reversed = {false};
  m.X_WB_home = {Pose::Identity(), Pose::Identity()};
  SpringDamper spring;
  spring.name = "spring";
  spring.body_from = 0;
  spring.p_from = {-1.0, 0.0, 0.0};
  spring.body_to = 1;
  spring.stiffness = stiffness;
  spring.damping = damping;
  spring.free_length_m = 1.0;
  m.springs = {spring};
  return m;
}

FastestRate RateOf(const Mechanism& m) {
  std::vector<std::string> warnings;
  const EngineSession session(&warnings);
  EngineModel engine;
  EXPECT_TRUE(MakeEngineModel(m, WriteMjcf(m), &engine).ok());
  const DataHandle data = MakeData(*engine.m);
  ConstraintSystem system(engine, data.get());
  system.EvaluatePosition();
  return FastestRateOf(system, {}, 6.0);
}

// A rotor of 6 kg makes the cart heavier; a spring is as stiff as its slope at the start.
TEST(FastestRate, OfForceElementsIsThatOfTheirSlopes) {
  Mechanism m = Cart(0.0, 0.0);
  m.springs.clear();
  m.elements = {{.name = "k", .joint = 0, .law = SpringLaw{{1e4, 1e5}, -1.0, 0.0}},
                {.name = "J", .joint = 0, .law = RotorLaw{6e-4, 100.0}}};
  const FastestRate rate = RateOf(m);
  EXPECT_NEAR(rate.per_s, std::sqrt((1e4 + 2e5) / 8.0), 1e-6);
  EXPECT_EQ(rate.part, "element 'k'");
}

TEST(FastestRate, OfASpringIsTheSquareRootOfStiffnessOverMass) {
  const FastestRate rate = RateOf(Cart(8e4, 0.0));
  EXPECT_NEAR(rate.per_s, 200.0, 1e-6);
  EXPECT_EQ(rate.part, "spring 'spring'");
}

// The drift that a cart on a spring of 200 rad/s was measured to have in 6 s at 1 ms.
TEST(FastestRate, ReportsHowFarASpringDrifts) {
  const FastestRate rate = RateOf(Cart(8e4, 0.0));
  EXPECT_NEAR(rate.drift * 1e-12, 1.9e-3, 1e-4);
  EXPECT_EQ(rate.drift_part, "spring 'spring'");
}

TEST(FastestRate, OfAStrongDamperIsDampingOverMass) {
  // λ² + 1000 λ + 4 = 0.
  EXPECT_NEAR(RateOf(Cart(8.0, 2000.0)).per_s, 500.0 + std::sqrt(250000.0 - 4.0), 1e-5);
}

TEST(FastestRate, IsZeroWithoutAnything) { EXPECT_EQ(RateOf(Cart(0.0, 0.0)).per_s, 0.0); }

}  // namespace
}  // namespace mbv::simulation
