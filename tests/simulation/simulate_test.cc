// The simulation of a four-bar against its closed form, in all modes.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "kinematics/tree_motion.h"
#include "mechanism/joint_pose.h"
#include "simulation/engine/simulation.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

using fixtures::FourBar;

Motion OneSecond() { return {.duration_s = 1.0, .sample_s = 0.01, .commands = {}, .loads = {}}; }

// A crank that swings: θ = 1 + 0.5 t + 0.7 sin 3t.
RunSummary SwingDrive(double t, DrivenSample* driven) {
  driven->position = VecX::Constant(1, 1.0 + 0.5 * t + 0.7 * std::sin(3 * t));
  driven->velocity = VecX::Constant(1, 0.5 + 2.1 * std::cos(3 * t));
  driven->acceleration = VecX::Constant(1, -6.3 * std::sin(3 * t));
  return RunSummary::Done();
}

// RMS of (simulated − closed form) over RMS of the closed form.
double TorqueError(const SimulationRun& run, double factor = 1.0) {
  const int column = run.trace.Find("motor.force");
  double error = 0.0, size = 0.0;
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    DrivenSample at;
    (void)SwingDrive(run.trace.time_s[i], &at);
    const double torque =
        factor * FourBar::Torque(at.position[0], at.velocity[0], at.acceleration[0]);
    const double difference = run.trace.values(static_cast<Eigen::Index>(i), column) - torque;
    error += difference * difference;
    size += torque * torque;
  }
  return std::sqrt(error / size);
}

double Largest(const SimulationRun& run, const std::string& channel) {
  return run.trace.values.col(run.trace.Find(channel)).cwiseAbs().maxCoeff();
}

constexpr JointKind kClosings[] = {JointKind::kRevolute, JointKind::kSpherical};

TEST(FourBarTruth, TorqueAtRestIsTheGradientOfThePotential) {
  // Independent of the loop's rates: gravity torque by moving the whole linkage.
  constexpr double h = 1e-5;
  const double gradient = (FourBar(0.7 + h).V() - FourBar(0.7 - h).V()) / (2 * h);
  EXPECT_NEAR(FourBar::Torque(0.7, 0.0, 0.0), gradient, 1e-8);
  EXPECT_NEAR(FourBar(FourBar::kHomeAngle).k3(),
              (FourBar(1.0 + h).t3 - FourBar(1.0 - h).t3) / (2 * h), 1e-9);
}

TEST(Inverse, AgreesWithTheClosedFormToRoundOff) {
  for (const JointKind closing : kClosings) {
    const SimulationRun run = Simulate(fixtures::MakeFourBar(closing), OneSecond(), SwingDrive,
                                       {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_TRUE(run.warnings.empty());
    // The closed form's differences are good to 1e-12.
    EXPECT_LT(TorqueError(run), 3e-12);
    EXPECT_LT(Largest(run, "closure.position"), 1e-14);
  }
}

TEST(Inverse, NoticesAMassThatIsWrongByOnePartInABillion) {
  Mechanism perturbed = fixtures::MakeFourBar();
  perturbed.bodies[2].mass *= 1.0 + 1e-9;
  const SimulationRun run =
      Simulate(perturbed, OneSecond(), SwingDrive, {.mode = DriveMode::kInverse});
  EXPECT_GT(TorqueError(run), 1e-11);
}

// `turns` turns of the crank at 2π/s, with this many samples each, starting at its home angle and
// `first` turns.
struct Turns {
  double first = 0.0, turns = 1.0;
  int samples = 12;

  [[nodiscard]] Motion Sampled() const {
    return {.duration_s = turns, .sample_s = 1.0 / samples, .commands = {}, .loads = {}};
  }
  [[nodiscard]] double Angle(double t) const {
    return FourBar::kHomeAngle + 2 * std::numbers::pi * (first + t);
  }
  RunSummary operator()(double t, DrivenSample* driven) const {
    driven->position = VecX::Constant(1, Angle(t));
    driven->velocity = VecX::Constant(1, 2 * std::numbers::pi);
    driven->acceleration = VecX::Zero(1);
    return RunSummary::Done();
  }
  // Largest error of the torque over the last turn, over the largest torque.
  [[nodiscard]] double Error(const SimulationRun& run) const {
    const int column = run.trace.Find("motor.force");
    double error = 0.0, size = 0.0;
    for (Eigen::Index i = run.trace.values.rows() - samples; i < run.trace.values.rows(); ++i) {
      const double part = static_cast<double>(i % samples) / samples;
      const double torque = FourBar::Torque(FourBar::kHomeAngle + 2 * std::numbers::pi * part,
                                            2 * std::numbers::pi, 0.0);
      error = std::max(error, std::abs(run.trace.values(i, column) - torque));
      size = std::max(size, std::abs(torque));
    }
    return error / size;
  }
};
// Angles of 6e4 rad have a rounding of 7e-12 rad.
constexpr double kTenThousandTurns = 1e-9;

TEST(Inverse, ACrankTurnsTenThousandTimes) {
  const Turns turns{.turns = 1e4};
  const SimulationRun run = Simulate(fixtures::MakeFourBar(JointKind::kSpherical), turns.Sampled(),
                                     turns, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message << " at " << run.summary.time_s;
  EXPECT_LT(turns.Error(run), kTenThousandTurns);
  EXPECT_LT(Largest(run, "closure.position"), 1e-11);
}

// Prediction from the rates leads far astray there; another assembly would have other torques.
TEST(Inverse, ACrankTurnsOnceFromSampleToSample) {
  for (const JointKind kind : {JointKind::kSpherical, JointKind::kRevolute}) {
    const Turns turns{.turns = 5, .samples = 1};
    const SimulationRun run = Simulate(fixtures::MakeFourBar(kind), turns.Sampled(), turns,
                                       {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message << " at " << run.summary.time_s;
    EXPECT_LT(turns.Error(run), 1e-12);
  }
}

// The hinge as closure is redundant and costs more; it starts 10 000 turns from zero.
Mechanism TurnedFourBar(double turns) {
  Mechanism m = fixtures::MakeFourBar();
  m.joints[0].home[0] += turns * 2 * std::numbers::pi;
  m.joints[0].guess[0] = m.joints[0].home[0];
  return m;
}

TEST(Inverse, ACrankTurnsOnAfterTenThousandTurns) {
  const Turns turns{.first = 1e4};
  const SimulationRun run =
      Simulate(TurnedFourBar(1e4), turns.Sampled(), turns, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message << " at " << run.summary.time_s;
  EXPECT_LT(turns.Error(run), kTenThousandTurns);
}

TEST(Forward, ACrankTurnsOnAfterTenThousandTurns) {
  const Turns turns{.first = 1e4, .samples = 20};
  const SimulationRun run = Simulate(TurnedFourBar(1e4), turns.Sampled(), turns, {.step_s = 1e-3});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message << " at " << run.summary.time_s;
  EXPECT_LT(turns.Error(run), 1e-6);
}

// MuJoCo has room for 500 constraint rows unless the file asks for more; each hinge takes six.
TEST(Inverse, NinetyHingesMayCloseLoops) {
  const int count = 90;
  const Mechanism one = fixtures::MakeFourBar();
  Mechanism m = one;
  for (int k = 1; k < count; ++k) {
    const auto name = [k](const std::string& of) { return of + std::to_string(k); };
    const auto moved = [k](int body) { return body == 0 ? 0 : body + 3 * k; };
    for (int b = 1; b < 4; ++b) {
      m.bodies.push_back(one.bodies[b]);
      m.bodies.back().name = name(one.bodies[b].name);
      m.X_WB_home.push_back(one.X_WB_home[b]);
    }
    for (Joint joint : one.joints) {
      joint.name = name(joint.name);
      joint.parent = moved(joint.parent);
      joint.child = moved(joint.child);
      m.joints.push_back(joint);
    }
    m.drives.push_back({.name = name("motor"), .kind = JointDrive{4 * k, 0}, .range = {}});
  }
  m.tree_joints.clear();
  m.tree_reversed.clear();
  fixtures::AddTree(&m);
  const auto swing = [count](double t, DrivenSample* driven) {
    DrivenSample one_crank;
    (void)SwingDrive(t, &one_crank);
    driven->position = VecX::Constant(count, one_crank.position[0]);
    driven->velocity = VecX::Constant(count, one_crank.velocity[0]);
    driven->acceleration = VecX::Constant(count, one_crank.acceleration[0]);
    return RunSummary::Done();
  };
  const Motion motion{.duration_s = 0.1, .sample_s = 0.1, .commands = {}, .loads = {}};
  const SimulationRun run = Simulate(m, motion, swing, {.mode = DriveMode::kInverse});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_TRUE(run.warnings.empty());
  EXPECT_LT(TorqueError(run), 3e-12);
}

// MuJoCo compiles no such inertia. In the plane only the moment about its normal counts, so that
// forces are those of a body with the same one.
TEST(Inverse, AnImpossibleInertiaIsSteppedAsItIs) {
  const auto force = [](const Vec3& inertia) {
    Mechanism m = fixtures::MakeFourBar();
    m.bodies[2].I_Bcm_B = inertia.asDiagonal();
    const SimulationRun run = Simulate(m, OneSecond(), SwingDrive, {.mode = DriveMode::kInverse});
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    return VecX(run.trace.values.col(run.trace.Find("motor.force")));
  };
  const VecX impossible = force({0.01, 0.01, 0.04}), possible = force({0.03, 0.03, 0.04});
  EXPECT_LT((impossible - possible).cwiseAbs().maxCoeff(), 1e-12 * possible.norm());
  EXPECT_GT((impossible - force({0.01, 0.01, 0.02})).cwiseAbs().maxCoeff(),
            1e-4 * possible.cwiseAbs().maxCoeff());
}

TEST(Inverse, RefusesUndrivenDegreesOfFreedom) {
  Mechanism m = fixtures::MakeFourBar();
  m.joints.pop_back();  // open chain: coupler and rocker swing freely
  const SimulationRun run = Simulate(m, OneSecond(), SwingDrive, {.mode = DriveMode::kInverse});
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_NE(run.summary.message.find("2 degrees of freedom"), std::string::npos)
      << run.summary.message;
}

TEST(Forward, ConvergesWithFourthOrder) {
  double coarse = 0.0, fine = 0.0;
  for (const auto& [step, error] : {std::pair{0.01, &coarse}, std::pair{0.005, &fine}}) {
    const SimulationRun run =
        Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {.step_s = step});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    *error = Largest(run, "closure.position");
  }
  EXPECT_GT(coarse / fine, std::pow(2.0, 3.5));
  EXPECT_LT(fine, 1e-8);
}

TEST(Forward, AgreesWithTheClosedFormAtEveryUsualStep) {
  for (const JointKind closing : kClosings) {
    for (const auto& [step, limit] :
         {std::pair{0.005, 5e-8}, std::pair{0.001, 1e-8}, std::pair{0.0002, 1e-8}}) {
      const SimulationRun run =
          Simulate(fixtures::MakeFourBar(closing), OneSecond(), SwingDrive, {.step_s = step});
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      EXPECT_LT(TorqueError(run), limit) << step;
    }
  }
}

TEST(Forward, NoticesATorqueThatIsWrongByOnePartInAMillion) {
  const SimulationRun run = Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {});
  EXPECT_LT(TorqueError(run), 1e-8);
  EXPECT_GT(TorqueError(run, 1.0 + 1e-6), 0.9e-6);
}

TEST(Forward, StockEngineIsManyTimesWorse) {
  const SimulationRun stock =
      Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {.engine = Engine::kStock});
  ASSERT_TRUE(stock.summary.ok()) << stock.summary.message;
  EXPECT_GT(TorqueError(stock), 1e-4);
  EXPECT_LT(TorqueError(stock), 0.1);
}

// Gravity puts in what the potential loses.
TEST(Forward, PowerOfGravityHasItsSignInBothModes) {
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    const SimulationRun run =
        Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {.mode = mode});
    ASSERT_TRUE(run.summary.ok());
    const VecX power = run.trace.values.col(run.trace.Find("power.gravity"));
    const VecX energy = run.trace.values.col(run.trace.Find("energy.gravity"));
    for (const Eigen::Index i : {10, 50, 90}) {
      DrivenSample at;
      (void)SwingDrive(run.trace.time_s[static_cast<size_t>(i)], &at);
      const double angle = at.position[0], gradient = FourBar::Torque(angle, 0.0, 0.0);
      EXPECT_NEAR(power[i], -gradient * at.velocity[0], 1e-7);
      EXPECT_NEAR(energy[i], FourBar(angle).V(), 1e-7);
    }
    EXPECT_GT(power.cwiseAbs().maxCoeff(), 1.0);
  }
}

TEST(Forward, PowerOfTheDriveIsTheRateOfEnergy) {
  const SimulationRun run = Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {});
  const VecX input = run.trace.values.col(run.trace.Find("power.input"));
  const VecX rate = run.trace.values.col(run.trace.Find("power.energy_rate"));
  EXPECT_GT(input.norm(), 1.0);
  // Closure forces work on the closures' rates, which are not exactly zero.
  EXPECT_LT((input - rate).norm(), 1e-8 * input.norm());
}

TEST(Forward, ClosureReactionsDoNotDependOnHowTheClosureIsRepresented) {
  // In the plane: split hinge (weld of halves) against ball (connect).
  const SimulationRun split =
      Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {.mode = DriveMode::kInverse});
  const SimulationRun ball = Simulate(fixtures::MakeFourBar(JointKind::kSpherical), OneSecond(),
                                      SwingDrive, {.mode = DriveMode::kInverse});
  for (const char* joint : {"A", "B", "C", "D"}) {
    for (const char* c : {".reaction.fx", ".reaction.fy", ".reaction.mz"}) {
      const std::string channel = std::string(joint) + c;
      const VecX x = split.trace.values.col(split.trace.Find(channel));
      const VecX y = ball.trace.values.col(ball.trace.Find(channel));
      EXPECT_LT((x - y).lpNorm<Eigen::Infinity>(), 1e-12) << channel;
    }
  }
}

TEST(Forward, ReactionsCarryTheWeightAtRest) {
  const SimulationRun run =
      Simulate(fixtures::MakeFourBar(), OneSecond(), fixtures::HoldStill({1.0}), {});
  ASSERT_TRUE(run.summary.ok());
  const auto at = [&](const char* channel) {
    return run.trace.values(50, run.trace.Find(channel));
  };
  const double weight = FourBar::g * (FourBar::m1 + FourBar::m2 + FourBar::m3);
  EXPECT_NEAR(at("A.reaction.fy") + at("D.reaction.fy"), weight, 1e-7 * weight);
  EXPECT_NEAR(at("A.reaction.fx") + at("D.reaction.fx"), 0.0, 1e-7 * weight);
  EXPECT_NEAR(at("A.reaction.mz"), 0.0, 1e-9);  // the motor's torque is not the hinge's
  EXPECT_NEAR(at("motor.force"), FourBar::Torque(1.0, 0, 0), 1e-8);
}

TEST(Forward, ALoadActsAtItsPointAndInItsAxes) {
  Motion motion = OneSecond();
  Load load;
  load.name = "tool";
  load.body = 2;
  load.p_BoQ_B = {FourBar::b, 0, 0};
  load.in_body_axes = true;
  load.force[1] = Constant(-3.0);
  motion.loads.push_back(load);
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    const SimulationRun run =
        Simulate(fixtures::MakeFourBar(), motion, fixtures::HoldStill({1.0}), {.mode = mode});
    ASSERT_TRUE(run.summary.ok());
    // Virtual work of the load: its power per crank rate.
    const FourBar at(1.0);
    const Vec3 dp(-FourBar::a * std::sin(at.t1) - FourBar::b * at.k2() * std::sin(at.t2),
                  FourBar::a * std::cos(at.t1) + FourBar::b * at.k2() * std::cos(at.t2), 0);
    const Vec3 f = RotZ(at.t2) * Vec3(0, -3, 0);
    EXPECT_NEAR(run.trace.values(50, run.trace.Find("motor.force")),
                FourBar::Torque(1.0, 0, 0) - f.dot(dp), 1e-8);
  }
}

// A body that hangs crooked on its hinge: the moment about the hinge is that of the body's y axis.
TEST(Forward, AMomentInBodyAxesTurnsWithItsBody) {
  Mechanism m;
  m.name = "arm";
  m.gravity_W.setZero();
  Body world;
  world.name = "world";
  m.bodies = {world, fixtures::MakeBody("arm", 1.0, {0.1, 0, 0}, {0.1, 0.1, 0.1})};
  m.joints = {fixtures::MakeJoint("hinge", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}, 0.3)};
  m.joints[0].X_CM.linear() = RotX(-std::numbers::pi / 2);  // body y along the hinge
  fixtures::AddTree(&m);
  m.X_WB_home = TreePoses(m, {m.joints[0].home});
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  Motion motion = OneSecond();
  motion.sample_s = 0.1;
  Load load;
  load.name = "screw";
  load.body = 1;
  load.in_body_axes = true;
  load.moment = {Constant(1.0), Constant(2.0), Constant(4.0)};
  motion.loads.push_back(load);
  for (const bool in_body_axes : {true, false}) {
    motion.loads[0].in_body_axes = in_body_axes;
    for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
      const SimulationRun run = Simulate(m, motion, fixtures::HoldStill({0.3}), {.mode = mode});
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      EXPECT_NEAR(run.trace.values(5, run.trace.Find("motor.force")), in_body_axes ? -2.0 : -4.0,
                  1e-9);
    }
  }
}

TEST(Forward, ASpringDamperPullsAndDissipates) {
  Mechanism m = fixtures::MakeFourBar();
  m.springs.push_back({.name = "spring",
                       .body_from = 0,
                       .p_from = {FourBar::d, 0, 0},
                       .body_to = 1,
                       .p_to = {FourBar::a, 0, 0},
                       .stiffness = 200.0,
                       .damping = 5.0,
                       .free_length_m = 0.3});
  DrivenSample at;
  (void)SwingDrive(0.5, &at);
  const double angle = at.position[0], rate = at.velocity[0];
  // Length from the rocker's foot to the crank's tip.
  const double L = std::sqrt(FourBar::d * FourBar::d + FourBar::a * FourBar::a -
                             2 * FourBar::a * FourBar::d * std::cos(angle));
  const double dL = FourBar::a * FourBar::d * std::sin(angle) / L;
  const double pull = 200.0 * (L - 0.3), drag = 5.0 * dL * rate;
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    const SimulationRun run = Simulate(m, OneSecond(), SwingDrive, {.mode = mode});
    ASSERT_TRUE(run.summary.ok());
    const auto half_way = [&](const char* channel) {
      return run.trace.values(50, run.trace.Find(channel));
    };
    EXPECT_NEAR(half_way("motor.force"),
                FourBar::Torque(angle, rate, at.acceleration[0]) + (pull + drag) * dL, 1e-8);
    EXPECT_NEAR(half_way("power.springs"), -pull * dL * rate, 1e-8);
    EXPECT_NEAR(half_way("power.dampers"), -drag * dL * rate, 1e-8);
    EXPECT_NEAR(half_way("energy.springs"), 100.0 * (L - 0.3) * (L - 0.3), 1e-8);
    const VecX input = run.trace.values.col(run.trace.Find("power.input"));
    const VecX energy = run.trace.values.col(run.trace.Find("power.energy_rate"));
    EXPECT_LT((input - energy).norm(), 1e-9 * input.norm());
  }
}

// A heavy disk on a ball joint, free to turn: the torque-free top keeps energy and angular
// momentum. Tests the integration of quaternions.
TEST(Forward, AFreeTopKeepsItsMomentum) {
  Mechanism m;
  m.name = "top";
  m.gravity_W.setZero();
  Body world;
  world.name = "world";
  m.bodies = {world, fixtures::MakeBody("arm", 1.0, {0, 0, 0}, {1, 1, 1}),
              fixtures::MakeBody("top", 2.0, {0, 0, 0}, {0.02, 0.03, 0.045})};
  m.joints = {fixtures::MakeJoint("arm_hinge", JointKind::kRevolute, 0, {0, 0, 0}, 1, {0, 0, 0}),
              fixtures::MakeJoint("ball", JointKind::kSpherical, 1, {0, 0, 0}, 2, {0, 0, 0})};
  fixtures::AddTree(&m);
  m.X_WB_home.assign(3, Pose::Identity());
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}});
  m.springs.push_back({.name = "kick",  // sets the top spinning about a skew axis
                       .body_from = 0,
                       .p_from = {0.3, 0.2, 0.1},
                       .body_to = 2,
                       .p_to = {0.1, -0.1, 0.2},
                       .stiffness = 20.0,
                       .damping = 0.0,
                       .free_length_m = 0.1});
  m.outputs.push_back({.name = "top", .body = 2, .X_BO = Pose::Identity(), .X_RbR = {}});
  const auto end = [&](double step) {
    const SimulationRun run =
        Simulate(m, OneSecond(), fixtures::HoldStill({0.0}), {.step_s = step});
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
    return LogRotation(run.X_WB.back()[2].linear());
  };
  const Vec3 exact = end(0.0005);
  const double coarse = (end(0.01) - exact).norm(), fine = (end(0.005) - exact).norm();
  EXPECT_GT(exact.norm(), 0.5);
  EXPECT_GT(coarse / fine, std::pow(2.0, 3.5));
  EXPECT_LT(fine, 1e-4);
}

TEST(Forward, RunsAreIdentical) {
  const SimulationRun a = Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {});
  const SimulationRun b = Simulate(fixtures::MakeFourBar(), OneSecond(), SwingDrive, {});
  EXPECT_EQ(a.trace.values, b.trace.values);
  EXPECT_EQ(a.qpos, b.qpos);
}

}  // namespace
}  // namespace mbv
