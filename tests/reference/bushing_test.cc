// Bushings in the reference: their coordinates against differences, their moments against the
// slope of their energy.
#include <gtest/gtest.h>

#include "kinematics/constraints.h"
#include "math/spatial.h"
#include "model_file/load_model.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

const char* const kGimbal =
    "name: gimbal\n"
    "gravity: [0, 0, 0]\n"
    "world: {frames: {F: {position: [0.1, 0.2, 0.3], rotation: {rpy: [0.4, -0.2, 0.9]}}}}\n"
    "bodies:\n"
    "  a: {mass: 1, inertia: [0.01, 0.01, 0.01]}\n"
    "  b: {mass: 1, inertia: [0.01, 0.01, 0.01]}\n"
    "  c: {mass: 1, inertia: [0.01, 0.01, 0.01],"
    " frames: {M: {position: [0.2, 0.1, 0.05], rotation: {rpy: [0.1, 0.3, 0]}}}}\n"
    "joints:\n"
    "  z: {kind: revolute, parent: world, child: a, axis: z}\n"
    "  y: {kind: revolute, parent: a, child: b, axis: y}\n"
    "  x: {kind: revolute, parent: b, child: c, axis: x}\n"
    "drives: {z: {kind: joint, joint: z}, y: {kind: joint, joint: y}, x: {kind: joint, joint: x}}\n"
    "elements:\n"
    "  rubber: {kind: bushing, parent: world.F, child: c.M, stiffness: [40, 70, 0, 3, 5, 8]";

Mechanism Gimbal(const std::string& damping = "") {
  LoadResult loaded = LoadModelText(std::string(kGimbal) + damping + "}\n", "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism{});
}

// From poses alone, with Eigen's angle and axis.
double EnergyAt(const Mechanism& m, const Vec3& q) {
  const std::vector<Pose> X = TreePoses(m, {{q[0]}, {q[1]}, {q[2]}});
  const Bushing& bushing = m.bushings.at(0);
  const Pose X_FM = (X[0] * bushing.X_PF).inverse() * X[3] * bushing.X_CM;
  const Eigen::AngleAxisd turn(X_FM.linear());
  const Vec3 p = X_FM.translation(), phi = turn.angle() * turn.axis();
  return 0.5 * (p.dot(Vec3(40, 70, 0).cwiseProduct(p)) + phi.dot(Vec3(3, 5, 8).cwiseProduct(phi)));
}

TEST(Bushings, TorquesAreTheSlopeOfTheEnergy) {
  const Mechanism m = Gimbal();
  constexpr double h = 1e-3;
  for (const Vec3& q :
       {Vec3(0.9, -0.2, 0.4), Vec3(-1.2, 0.7, 0.3), Vec3(0.95, -0.5, 0.45), Vec3(2.9, -0.4, 0.8)}) {
    const ReferenceRun run =
        RunReference(m, DriveMotion(m, {Constant(q[0]), Constant(q[1]), Constant(q[2])}, 0.1, 0.1));
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_NEAR(At(run.trace, 0, "energy.springs"), EnergyAt(m, q), 1e-13 * EnergyAt(m, q));
    for (int i = 0; i < 3; ++i) {
      const Vec3 step = h * Vec3::Unit(i);
      const auto difference = [&](int k) {
        return EnergyAt(m, q + k * step) - EnergyAt(m, q - k * step);
      };
      const double slope =
          (672 * difference(1) - 168 * difference(2) + 32 * difference(3) - 3 * difference(4)) /
          (840 * h);
      EXPECT_NEAR(At(run.trace, 0, m.drives[static_cast<size_t>(i)].name + ".force"), slope, 1e-10);
    }
  }
}

TEST(Bushings, PowerBalancesAndDampersTakeIt) {
  const Mechanism m = Gimbal(", damping: [2, 0, 1, 0.1, 0.2, 0.3]");
  const ReferenceRun run = RunReference(m, DriveMotion(m,
                                                       {{{SineTerm{0.8, 0.7, 0.3}}},
                                                        {{SineTerm{0.6, 1.1, 1.0}}},
                                                        {{SineTerm{0.9, 0.9, 0.2}}}},
                                                       2.0, 0.05));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX in = ColumnOf(run.trace, "power.input");
  EXPECT_LT((in - ColumnOf(run.trace, "power.energy_rate")).cwiseAbs().maxCoeff(),
            1e-13 * in.cwiseAbs().maxCoeff());
  EXPECT_LT(ColumnOf(run.trace, "power.dampers").maxCoeff(), 0.0);
}

// Both bodies turn about fixed directions and move straight: A = 0, and c̈ is the bias.
TEST(Bushings, RatesAndBiasAreDerivatives) {
  const Bushing bushing{.name = "b",
                        .parent = 1,
                        .X_PF = PoseAt({0.1, 0.2, -0.1}, RotRpy({0.3, 0.2, 0.1})),
                        .child = 2,
                        .X_CM = PoseAt({0.3, -0.1, 0.2}, RotRpy({-0.2, 0.5, 0.4}))};
  // Also where the rotation is small, by the power series.
  for (const Vec3& turn : {Vec3(0.7, -0.4, 1.1), Vec3(0.02, 0.05, -0.03)}) {
    const auto at = [&](double t) {
      BodyStates states;
      states.Resize(3);
      const Vec3 w1(0.3, 0.7, -0.5), w2(-0.6, 0.4, 0.9), v1(0.2, 0.1, 0.4), v2(-0.3, 0.5, 0.2);
      states.X_WB[1] = PoseAt(t * v1, ExpRotation(t * w1));
      states.X_WB[2] = PoseAt(Vec3(0.4, 0.3, 0.2) + t * v2,
                              ExpRotation(t * w2) * bushing.X_PF.linear() * ExpRotation(turn) *
                                  bushing.X_CM.linear().transpose());
      states.V_WB[1] << w1, v1;
      states.V_WB[2] << w2, v2;
      states.A_WB[1].setZero();
      states.A_WB[2].setZero();
      return states;
    };
    constexpr double h = 1e-3;
    for (int k = 0; k < 6; ++k) {
      const auto value = [&](double t) { return BushingRow(bushing, k, at(t)).value; };
      const auto rate = [&](double t) {
        const BodyStates states = at(t);
        return RateOf(BushingRow(bushing, k, states), states.V_WB);
      };
      const auto slope = [&](const auto& f) {
        return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h);
      };
      EXPECT_NEAR(rate(0), slope(value), 1e-10) << k;
      EXPECT_NEAR(BushingRow(bushing, k, at(0)).bias, slope(rate), 1e-9) << k;
    }
  }
}

}  // namespace
}  // namespace mbv::fixtures
