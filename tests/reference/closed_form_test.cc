// The reference against mechanisms with textbook answers.
#include <gtest/gtest.h>

#include <numbers>

#include "mechanism/reach.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

using std::cos;
using std::sin;

// A few hundred operations on numbers of the size of the largest force.
constexpr double kForceTolerance = 1e-12;

constexpr double kMass = 2.0, kCom = 0.3, kLength = 0.5, kInertia = 0.05, kG = 9.81;

// Pendulum about −y, hanging along −z at zero angle, so that a positive angle swings to +x.
Mechanism MakePendulum(double mass = kMass) {
  Mechanism m;
  m.name = "pendulum";
  m.gravity_W = Vec3(0, 0, -kG);
  m.bodies = {MakeWorld(), MakeBody("bob", mass, {0, 0, -kCom}, {kInertia, kInertia, 0.01})};
  m.joints = {MakeJoint("hinge", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0})};
  m.joints[0].axis = -Vec3::UnitY();
  m.drives = {{.name = "motor", .kind = JointDrive{0, 0}, .range = {}}};
  FinishTree(&m);
  return m;
}

TEST(Reference, APendulumHeldLevelNeedsItsWeightTimesItsArm) {
  const Mechanism m = MakePendulum();
  const ReferenceRun run =
      RunReference(m, DriveMotion(m, {Constant(std::numbers::pi / 2)}, 0.0, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(At(run.trace, 0, "motor.force"), kMass * kG * kCom, kForceTolerance * kMass * kG);
  EXPECT_NEAR(At(run.trace, 0, "hinge.reaction.fz"), kMass * kG, kForceTolerance * kMass * kG);
}

TEST(Reference, ASwingingPendulumFollowsItsEquation) {
  const Mechanism m = MakePendulum();
  const Profile swing{{SineTerm{1.2, 0.8, 0.3}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {swing}, 2.0, 0.01));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double J = kInertia + kMass * kCom * kCom;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const Jet q = Evaluate(swing, run.trace.time_s[i]);
    const auto row = static_cast<Eigen::Index>(i);
    const double torque = J * q.acceleration + kMass * kG * kCom * sin(q.value);
    EXPECT_NEAR(At(run.trace, row, "motor.force"), torque, kForceTolerance * 30.0);
    // Along the rod: weight and centripetal force.
    const Vec3 force(At(run.trace, row, "hinge.reaction.fx"), 0,
                     At(run.trace, row, "hinge.reaction.fz"));
    const Vec3 up_the_rod(-sin(q.value), 0, cos(q.value));
    EXPECT_NEAR(force.dot(up_the_rod), kMass * (kG * cos(q.value) + kCom * q.rate * q.rate),
                kForceTolerance * 60.0);
    // Energy rate from E = ½ J θ̇² − m g l cos θ.
    EXPECT_NEAR(At(run.trace, row, "power.energy_rate"), torque * q.rate, kForceTolerance * 200.0);
  }
}

TEST(Reference, AThousandthMoreMassIsAThousandthMoreTorque) {
  const Motion still = DriveMotion(MakePendulum(), {Constant(0.7)}, 0.0, 0.1);
  const double torque = At(RunReference(MakePendulum(), still).trace, 0, "motor.force");
  const double heavier =
      At(RunReference(MakePendulum(1.001 * kMass), still).trace, 0, "motor.force");
  EXPECT_NEAR(heavier / torque - 1.0, 1e-3, 1e-12);
}

TEST(Reference, AnglesCountFullTurns) {
  const Mechanism m = MakePendulum();
  const ReferenceRun run = RunReference(m, DriveMotion(m, {{{RampTerm{10.0}}}}, 2.0, 0.01));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(At(run.trace, 200, "motor.position"), 20.0, 1e-11);
}

// Two equal links in the xz plane; τ from the manipulator equations [Spong 2006, ch. 7] with
// absolute angle of link 1 and relative angle of link 2 from the hanging pose.
TEST(Reference, ACrankTurnsTenThousandTimes) {
  const Mechanism m = MakeFourBar();
  const int samples = 10;
  const double rate = 2 * std::numbers::pi;
  const Motion motion =
      DriveMotion(m, {{{ConstantTerm{FourBar::kHomeAngle}, RampTerm{rate}}}}, 1e4, 1.0 / samples);
  ReferenceSolver solver(m, motion);
  CommandSample command;
  ReferenceSample sample;
  double worst = 0.0, gap = 0.0;
  for (int i = 0; i <= 10000 * samples; ++i) {
    EvaluateMotion(motion, static_cast<double>(i) / samples, &command);
    // Forces now and then, at all angles.
    const bool forces = i % 999 == 0;
    const RunSummary summary =
        forces ? solver.Dynamics(command, &sample) : solver.Kinematics(command, &sample);
    ASSERT_TRUE(summary.ok()) << summary.message << " at " << command.time_s;
    gap = std::max(gap, sample.closure_position_m);
    if (!forces) continue;
    const double in_turn = FourBar::kHomeAngle + rate * (i % samples) / samples;
    const double torque = FourBar::Torque(in_turn, rate, 0.0);
    worst = std::max(worst, std::abs(sample.drive_force[0] - torque));
  }
  // Torques reach 7 N m; angles of 6e4 rad have a rounding of 7e-12 rad.
  EXPECT_LT(worst, 1e-9);
  EXPECT_LT(gap, 1e-13);
}

TEST(Reference, ADoublePendulumFollowsItsTwoEquations) {
  Mechanism m;
  m.name = "double_pendulum";
  m.gravity_W = Vec3(0, 0, -kG);
  const Body link = MakeBody("link1", kMass, {0, 0, -kCom}, {kInertia, kInertia, 0.01});
  m.bodies = {MakeWorld(), link, link};
  m.bodies[2].name = "link2";
  m.joints = {MakeJoint("j1", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}),
              MakeJoint("j2", JointKind::kRevolute, 1, {0, 0, -kLength}, 2, {0, 0, 0})};
  for (Joint& joint : m.joints) joint.axis = -Vec3::UnitY();
  m.drives = {{.name = "m1", .kind = JointDrive{0, 0}, .range = {}},
              {.name = "m2", .kind = JointDrive{1, 0}, .range = {}}};
  FinishTree(&m);
  const Profile p1{{SineTerm{0.9, 0.7, 0.2}}}, p2{{ConstantTerm{0.4}, SineTerm{1.4, 1.1, -0.5}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {p1, p2}, 1.0, 0.02));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const Jet a = Evaluate(p1, run.trace.time_s[i]), b = Evaluate(p2, run.trace.time_s[i]);
    const double k = kMass * kLength * kCom, c = k * cos(b.value), h = k * sin(b.value);
    const double J = kInertia + kMass * kCom * kCom;
    const double m11 = 2 * J + kMass * kLength * kLength + 2 * c, m12 = J + c;
    const double g2 = kMass * kG * kCom * sin(a.value + b.value);
    const double g1 = kMass * kG * (kCom + kLength) * sin(a.value) + g2;
    const double t1 = m11 * a.acceleration + m12 * b.acceleration -
                      h * (2 * a.rate * b.rate + b.rate * b.rate) + g1;
    const double t2 = m12 * a.acceleration + J * b.acceleration + h * a.rate * a.rate + g2;
    const auto row = static_cast<Eigen::Index>(i);
    EXPECT_NEAR(At(run.trace, row, "m1.force"), t1, kForceTolerance * 100.0);
    EXPECT_NEAR(At(run.trace, row, "m2.force"), t2, kForceTolerance * 100.0);
  }
}

// A wheel spinning about a horizontal axle that is carried round a vertical axis: the axle's
// bearing turns the wheel's spin with the moment I_spin · spin · precession.
TEST(Reference, ATurnedGyroscopePressesOnItsBearing) {
  constexpr double kSpin = 40.0, kTurn = 3.0, kAxial = 0.02;
  Mechanism m;
  m.name = "gyroscope";
  m.gravity_W = Vec3::Zero();
  m.bodies = {MakeWorld(), MakeBody("fork", 0.0, {0, 0, 0}, {0, 0, 0}),
              MakeBody("wheel", 1.0, {0, 0, 0}, {kAxial, 0.012, 0.012})};
  m.joints = {MakeJoint("turn", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}),
              MakeJoint("axle", JointKind::kRevolute, 1, {0, 0, 0}, 2, {0, 0, 0})};
  m.joints[1].axis = Vec3::UnitX();
  m.drives = {{.name = "turn_motor", .kind = JointDrive{0, 0}, .range = {}},
              {.name = "spin_motor", .kind = JointDrive{1, 0}, .range = {}}};
  FinishTree(&m);
  const ReferenceRun run =
      RunReference(m, DriveMotion(m, {{{RampTerm{kTurn}}}, {{RampTerm{kSpin}}}}, 0.5, 0.01));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    // d/dt (I ω_x x) = I ω_x Ω (z × x) = I ω_x Ω y in the fork's axes.
    EXPECT_NEAR(At(run.trace, i, "axle.reaction.my"), kAxial * kSpin * kTurn, kForceTolerance * 40);
    EXPECT_NEAR(At(run.trace, i, "axle.reaction.mz"), 0.0, kForceTolerance * 40);
    EXPECT_NEAR(At(run.trace, i, "turn_motor.force"), 0.0, kForceTolerance * 40);
  }
}

TEST(Reference, ADrivenFourBarNeedsTheTorqueOfItsLagrangeEquation) {
  const Mechanism m = MakeFourBar();
  const Profile turn{{ConstantTerm{FourBar::kHomeAngle}, RampTerm{5.0}, SineTerm{0.3, 2.0, 0.0}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {turn}, 1.5, 0.01));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  // The differences in FourBar::Torque: truncation h⁸ f⁽⁹⁾/630 with h = 4e-3 and round-off 1e-15/h.
  constexpr double kDifferences = 1e-10;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    const Jet q = Evaluate(turn, run.trace.time_s[i]);
    EXPECT_NEAR(At(run.trace, static_cast<Eigen::Index>(i), "motor.force"),
                FourBar::Torque(q.value, q.rate, q.acceleration), kDifferences);
  }
}

// Two massless bars lean on each other at angle φ and carry a load P at the top: each bar pushes
// with P/(2 sin φ). Every joint is a hinge, so the out-of-plane reactions are redundant.
TEST(Reference, TwoLeaningBarsShareALoadAsATriangleDoes) {
  const double phi = 0.6, P = 120.0, length = 1.0;
  Mechanism m;
  m.name = "truss";
  m.gravity_W = Vec3(0, -kG, 0);
  m.bodies = {MakeWorld(), MakeBody("left", 0, {0, 0, 0}, {0, 0, 0}),
              MakeBody("right", 0, {0, 0, 0}, {0, 0, 0})};
  const double half = length * cos(phi);
  m.joints = {
      MakeJoint("A", JointKind::kRevolute, 0, {-half, 0, 0}, 1, {0, 0, 0}),
      MakeJoint("B", JointKind::kRevolute, 0, {half, 0, 0}, 2, {0, 0, 0}),
      MakeJoint("top", JointKind::kRevolute, 1, {length, 0, 0}, 2, {-length, 0, 0}, 0.0, true)};
  m.joints[0].guess[0] = phi;
  m.joints[1].guess[0] = -phi;
  FinishTree(&m);
  Motion motion;
  motion.duration_s = 0.0;
  Load load{.name = "load", .body = 1, .p_BoQ_B = {length, 0, 0}, .force = {}, .moment = {}};
  load.force[1] = Constant(-P);
  motion.loads = {load};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double push = P / (2 * sin(phi));
  EXPECT_NEAR(At(run.trace, 0, "A.reaction.fx"), push * cos(phi), kForceTolerance * P);
  EXPECT_NEAR(At(run.trace, 0, "A.reaction.fy"), P / 2, kForceTolerance * P);
  EXPECT_NEAR(At(run.trace, 0, "B.reaction.fx"), -push * cos(phi), kForceTolerance * P);
  EXPECT_NEAR(At(run.trace, 0, "B.reaction.fy"), P / 2, kForceTolerance * P);
}

// A door on two coaxial hinges ±h apart from its centre height, its weight W at arm e. Least norm
// (moments divided by L): each hinge carries W/2, and the overturning moment W e is shared by
// forces ∝ h and moments ∝ L².
TEST(Reference, AnOverconstrainedDoorGetsTheReactionsOfLeastNorm) {
  constexpr double h = 0.8, e = 0.4, mass = 25.0;
  Mechanism m;
  m.name = "door";
  m.gravity_W = Vec3(0, 0, -kG);
  m.bodies = {MakeWorld(), MakeBody("door", mass, {e, 0, 0}, {1, 1, 1})};
  m.joints = {MakeJoint("upper", JointKind::kRevolute, 0, {0, 0, h}, 1, {0, 0, h}),
              MakeJoint("lower", JointKind::kRevolute, 0, {0, 0, -h}, 1, {0, 0, -h}, 0.0, true)};
  m.drives = {{.name = "closer", .kind = JointDrive{0, 0}, .range = {}}};
  FinishTree(&m);
  const ReferenceRun run = RunReference(m, DriveMotion(m, {Constant(0.0)}, 0.0, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double weight = mass * kG, overturning = weight * e, L = CharacteristicLength(m);
  EXPECT_DOUBLE_EQ(L, 2 * h);  // from hinge to hinge
  const double share = overturning / (2 * (h * h + L * L));
  const double tolerance = kForceTolerance * weight;
  EXPECT_NEAR(At(run.trace, 0, "upper.reaction.fz"), weight / 2, tolerance);
  EXPECT_NEAR(At(run.trace, 0, "lower.reaction.fz"), weight / 2, tolerance);
  EXPECT_NEAR(At(run.trace, 0, "upper.reaction.fx"), -share * h, tolerance);
  EXPECT_NEAR(At(run.trace, 0, "lower.reaction.fx"), share * h, tolerance);
  EXPECT_NEAR(At(run.trace, 0, "upper.reaction.my"), -share * L * L, tolerance);
  EXPECT_NEAR(At(run.trace, 0, "lower.reaction.my"), -share * L * L, tolerance);
}

TEST(Reference, SpringDamperAndGravityPowersHaveTheirSigns) {
  Mechanism m = MakeFourBar();
  m.springs.push_back({.name = "spring",
                       .body_from = 0,
                       .p_from = {FourBar::d, 0, 0},
                       .body_to = 1,
                       .p_to = {FourBar::a, 0, 0},
                       .stiffness = 200.0,
                       .damping = 5.0,
                       .free_length_m = 0.3});
  const Profile swing{{ConstantTerm{FourBar::kHomeAngle}, SineTerm{0.7, 0.9, 0.4}}};
  const ReferenceRun run = RunReference(m, DriveMotion(m, {swing}, 0.5, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (const Eigen::Index row : {1, 3, 5}) {
    const Jet q = Evaluate(swing, run.trace.time_s[static_cast<size_t>(row)]);
    // Length from the rocker's foot to the crank's tip.
    const double L = std::sqrt(FourBar::d * FourBar::d + FourBar::a * FourBar::a -
                               2 * FourBar::a * FourBar::d * cos(q.value));
    const double dL = FourBar::a * FourBar::d * sin(q.value) / L;
    const double pull = 200.0 * (L - 0.3), drag = 5.0 * dL * q.rate;
    const double torque = FourBar::Torque(q.value, q.rate, q.acceleration) + (pull + drag) * dL;
    EXPECT_NEAR(At(run.trace, row, "motor.force"), torque, 1e-8);  // by differences
    EXPECT_NEAR(At(run.trace, row, "power.springs"), -pull * dL * q.rate, 1e-11);
    EXPECT_NEAR(At(run.trace, row, "power.dampers"), -drag * dL * q.rate, 1e-11);
    EXPECT_NEAR(At(run.trace, row, "power.gravity"), -FourBar::Torque(q.value, 0.0, 0.0) * q.rate,
                1e-8);
    EXPECT_NEAR(At(run.trace, row, "energy.gravity"), FourBar(q.value).V(), 1e-11);
    EXPECT_NEAR(At(run.trace, row, "energy.springs"), 100.0 * (L - 0.3) * (L - 0.3), 1e-11);
  }
}

// A body that hangs crooked on its hinge: the moment about the hinge is that of the body's y axis.
TEST(Reference, AMomentInBodyAxesTurnsWithItsBody) {
  Mechanism m;
  m.name = "arm";
  m.gravity_W.setZero();
  m.bodies = {MakeWorld(), MakeBody("arm", 1.0, {0.1, 0, 0}, {0.1, 0.1, 0.1})};
  m.joints = {MakeJoint("hinge", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, 0.3)};
  m.joints[0].X_CM.linear() = RotX(-std::numbers::pi / 2);  // body y along the hinge
  m.drives = {{.name = "motor", .kind = JointDrive{0, 0}, .range = {}}};
  FinishTree(&m);
  Motion motion = DriveMotion(m, {Constant(0.3)}, 0.0, 0.1);
  motion.loads = {{.name = "screw",
                   .body = 1,
                   .p_BoQ_B = {0.5, 0, 0},
                   .in_body_axes = true,
                   .force = {Constant(0), Constant(0), Constant(10)},
                   .moment = {Constant(1), Constant(2), Constant(4)}}};
  // The body's z axis points along −y of the hinge's frame: the force turns by −10 N · 0.5 m.
  EXPECT_NEAR(At(RunReference(m, motion).trace, 0, "motor.force"), -2.0 + 5.0, 1e-12);
  motion.loads[0].in_body_axes = false;
  EXPECT_NEAR(At(RunReference(m, motion).trace, 0, "motor.force"), -4.0, 1e-12);
}

TEST(Reference, PowerBalancesWithSpringsDampersAndLoads) {
  Mechanism m = MakeFourBar();
  m.springs = {{.name = "spring",
                .body_from = 0,
                .p_from = {0.1, 0.9, 0.1},
                .body_to = 2,
                .p_to = {0.2, 0.05, 0.0},
                .stiffness = 300,
                .damping = 12,
                .free_length_m = 0.4}};
  Motion motion =
      DriveMotion(m, {{{ConstantTerm{FourBar::kHomeAngle}, SineTerm{2.0, 0.9, 0.0}}}}, 1.0, 0.01);
  Load load{.name = "tool",
            .body = 3,
            .p_BoQ_B = {0.3, 0.1, 0},
            .in_body_axes = true,
            .force = {Constant(20), Profile{{SineTerm{30, 1.0, 0}}}, Constant(5)},
            .moment = {Constant(1), Constant(-2), Constant(4)}};
  motion.loads = {load};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::VectorXd input = ColumnOf(run.trace, "power.input");
  const Eigen::VectorXd rate = ColumnOf(run.trace, "power.energy_rate");
  const double scale = rate.cwiseAbs().maxCoeff();
  EXPECT_GT(scale, 100.0);
  EXPECT_LT((input - rate).cwiseAbs().maxCoeff(), kForceTolerance * scale);

  // The balance of a coupler that is a thousandth heavier is another one.
  m.bodies[2].mass *= 1.001;
  const Eigen::VectorXd perturbed = ColumnOf(RunReference(m, motion).trace, "power.energy_rate");
  EXPECT_GT((perturbed - input).cwiseAbs().maxCoeff(), 1e-6 * scale);
}

}  // namespace
}  // namespace mbv::fixtures
