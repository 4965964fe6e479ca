// Conventions of MuJoCo 2.2.2 that this program relies on, each pinned by the smallest model.
#include <gtest/gtest.h>

#include <cmath>

#include "simulation/engine/engine.h"

namespace mbv::simulation {
namespace {

struct World {
  std::vector<std::string> warnings;
  EngineSession session{&warnings};
  ModelHandle m;
  DataHandle d;

  explicit World(const std::string& content, const std::string& option = "timestep='0.001'")
      : m(CompileMjcf("<mujoco><compiler angle='radian' autolimits='false'/><option " + option +
                      " jacobian='dense' solver='Newton' tolerance='1e-14'/>" + content +
                      "</mujoco>")),
        d(MakeData(*m)) {}
};

const std::string kStiff = "solref='0.002 1' solimp='0.9999 0.9999 0.001 0.5 2'";
const std::string kSlider =
    "<worldbody><body name='b'><inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/>"
    "<joint name='x' type='slide' axis='0 0 1' ref='0.5'/></body></worldbody>";

TEST(Conventions, ConstraintForceOfAJointRowActsAlongTheCoordinate) {
  World w(kSlider + "<equality><joint joint1='x' " + kStiff + "/></equality>");
  mj_forward(w.m.get(), w.d.get());
  // It carries the weight: up, positive.
  EXPECT_NEAR(w.d->efc_force[0], 2 * 9.81, 2e-4 * 2 * 9.81);
  EXPECT_EQ(w.d->efc_pos[0], 0.0);
  w.m->eq_data[0] = 0.25;
  mj_forward(w.m.get(), w.d.get());
  EXPECT_DOUBLE_EQ(w.d->efc_pos[0], -0.25);  // position − ref − first coefficient
}

TEST(Conventions, PositionOfASlideCountsFromItsReference) {
  World w(kSlider);
  EXPECT_EQ(w.d->qpos[0], 0.5);
  w.d->qpos[0] = 0.8;
  mj_kinematics(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->xpos[3 + 2], 0.3, 1e-15);
}

TEST(Conventions, ImpedanceIsClampedAndStiffnessFollowsItsFormula) {
  World w(kSlider +
          "<equality><joint joint1='x' solref='0.01 1' "
          "solimp='0.9999999 0.9999999 0.001 0.5 2'/></equality>");
  mj_forward(w.m.get(), w.d.get());
  const double d = 0.9999, tc = 0.01;
  EXPECT_DOUBLE_EQ(w.d->efc_KBIP[0], 1 / (d * d * tc * tc));
  EXPECT_DOUBLE_EQ(w.d->efc_KBIP[1], 2 / (d * tc));
  EXPECT_DOUBLE_EQ(w.d->efc_KBIP[2], d);
  EXPECT_NEAR(w.d->efc_R[0], (1 - d) / d / 2.0, 1e-15);  // inverse mass 1/2
  EXPECT_DOUBLE_EQ(w.d->efc_D[0], 1 / w.d->efc_R[0]);
  w.d->qvel[0] = 0.3;
  w.d->qpos[0] += 0.01;
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->efc_aref[0], -0.3 * 2 / (d * tc) - d * 0.01 / (d * d * tc * tc), 1e-12);
}

TEST(Conventions, ReferenceTimeConstantIsAtLeastTwoSteps) {
  World w(kSlider + "<equality><joint joint1='x' solref='0.0001 1'/></equality>");
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->efc_KBIP[1], 2 / (0.95 * 0.002), 1e-9);
}

TEST(Conventions, EulerVelocityBelongsToHalfAStepEarlier) {
  World w(kSlider, "timestep='0.01' gravity='0 0 3'");
  for (int i = 0; i < 100; ++i) mj_step(w.m.get(), w.d.get());
  const double t = 1.0, a = 3.0, h = 0.01;
  EXPECT_NEAR(w.d->qvel[0], a * t, 1e-12);
  // Position is that of velocities sampled at the ends of the steps: ½ a t² + ½ a h t.
  EXPECT_NEAR(w.d->qpos[0] - 0.5, 0.5 * a * t * t + 0.5 * a * h * t, 1e-12);
}

TEST(Conventions, TendonForceIsThrust) {
  World w(
      "<worldbody><site name='s'/><body name='b' pos='0 0 1'>"
      "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/>"
      "<joint name='x' type='slide' axis='0 0 1'/><site name='e'/></body></worldbody>"
      "<tendon><spatial name='t'><site site='s'/><site site='e'/></spatial></tendon>"
      "<equality><tendon tendon1='t' " +
      kStiff +
      "/></equality>"
      "<actuator><motor tendon='t' ctrllimited='false'/></actuator>");
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->efc_force[0], 2 * 9.81, 2e-4 * 2 * 9.81);
  EXPECT_EQ(w.d->ten_J[0], 1.0);  // lengthens with the coordinate
  EXPECT_EQ(w.d->actuator_moment[0], 1.0);
}

TEST(Conventions, ConnectForceActsOnTheFirstBody) {
  World w(
      "<worldbody><body name='b'><freejoint/>"
      "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/></body></worldbody>"
      "<equality><connect body1='b' anchor='0 0 0' " +
      kStiff + "/></equality>");
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->efc_force[2], 2 * 9.81, 2e-4 * 2 * 9.81);
}

TEST(Conventions, ConnectFreezesTheGapOfTheReferencePose) {
  World w(
      "<worldbody><body name='b' pos='0 0 0.1'><freejoint/>"
      "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/></body></worldbody>"
      "<equality><connect body1='b' anchor='0 0 0.02'/></equality>");
  EXPECT_DOUBLE_EQ(w.m->eq_data[5], 0.12);  // in the world, from the pose of body 1
}

TEST(Conventions, FreeJointTurnsInBodyAxesAndMovesInWorldAxes) {
  World w(
      "<worldbody><body><freejoint/><inertial pos='0 0 0' mass='1' diaginertia='1 1 1'/>"
      "</body></worldbody>");
  // Body turned by 90° about z: its x axis is the world's y axis.
  const double quat[4] = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  mju_copy(w.d->qpos + 3, quat, 4);
  const double v[6] = {1, 0, 0, 2, 0, 0};
  mju_copy(w.d->qvel, v, 6);
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->cvel[6 + 1], 2.0, 1e-15);  // angular velocity about world y
  EXPECT_NEAR(w.d->cvel[6 + 3], 1.0, 1e-15);  // linear velocity along world x
}

TEST(Conventions, VelocityTermIsMissingFromConnectRows) {
  // A point mass on a link, circling about a connect: it needs ω² r towards the centre, but the
  // reference acceleration does not know; one forward evaluation therefore misses the force.
  World w(
      "<worldbody><body name='b' pos='1 0 0'><freejoint/>"
      "<inertial pos='0 0 0' mass='2' diaginertia='1e-3 1e-3 1e-3'/></body></worldbody>"
      "<equality><connect body1='b' anchor='-1 0 0' " +
          kStiff + "/></equality>",
      "timestep='0.001' gravity='0 0 0'");
  const double v[6] = {0, 3, 0, 0, 0, 3};
  mju_copy(w.d->qvel, v, 6);
  mj_forward(w.m.get(), w.d.get());
  EXPECT_NEAR(w.d->efc_force[0], 0.0, 1e-9);  // should be −2·9·1 = −18 N
}

}  // namespace
}  // namespace mbv::simulation
