// Drive torques of the SCARA robot: numbers by hand, then laws.
#include "analytic/scara_robot/dynamics.h"

#include "analytic/closed_form.h"
#include "analytic/scara_robot/closed_form.h"
#include "tests/analytic/scara_robot_fixture.h"
#include "tests/support/allocation_counter.h"

namespace mbv::scara_robot {
namespace {

const Vec3 kToolForce(0, 0, -5);

Parameters WithGravity() {
  Parameters p = PaperParameters();
  p.gravity_W = Vec3(0, 0, -9.81);
  return p;
}

Instant InstantAt(const Parameters& p, const Vec4& X) {
  Instant at;
  EXPECT_TRUE(InversePosition(p, X, &at.position).ok());
  return at;
}

TEST(ScaraDynamics, StaticTorquesMatchTheHandCalculation) {
  // Half of each rod's weight goes to each end; the rod tensions balance the platform.
  const Parameters p = WithGravity();
  const Instant at = InstantAt(p, PoseOf(-50, -50, -150, 0));
  EXPECT_NEAR(at.position.theta[0] / kDeg, 65.704811, 1e-6);
  EXPECT_NEAR(at.position.theta[2] / kDeg, 1.480306, 1e-6);
  const Vec4 M = DriveTorques(p, at.position, at.rates, kToolForce, 0.0);
  constexpr double kPrintedDigits = 1e-10;
  EXPECT_NEAR(M[0], -0.2363652638, kPrintedDigits);
  EXPECT_NEAR(M[1], -0.2363652638, kPrintedDigits);
  EXPECT_NEAR(M[2], -0.8733697692, kPrintedDigits);
  EXPECT_NEAR(M[3], -0.8733697692, kPrintedDigits);
}

TEST(ScaraDynamics, RodTensionsByHandGiveTheStaticTorques) {
  const Parameters p = WithGravity();
  const Instant at = InstantAt(p, PoseOf(-50, -50, -150, 0));
  // Balance of the platform with half of each rod's weight: Σ N η = load, Σ N η·k = 0.
  Vec4 load;
  load << 0, 0, -(p.m_p * 9.81 + 2 * p.m_rods * 9.81 + 5), 0;
  const Vec4 N = DirectJacobian(at.position).transpose().partialPivLu().solve(load);
  EXPECT_NEAR(N[0], 1.778764, 1e-6);
  EXPECT_NEAR(N[2], 8.392258, 1e-6);
  const Vec4 M = DriveTorques(p, at.position, at.rates, kToolForce, 0.0);
  for (int i = 0; i < kLimbs; ++i) {
    const Vec3& n = at.position.n[i];
    const double by_hand =
        -p.l1 * n.dot(N[i] * at.position.eta[i] - 0.5 * p.m_rods * 9.81 * Vec3::UnitZ()) +
        0.5 * p.l1 * p.m_arm * 9.81 * n.z();
    EXPECT_NEAR(M[i], by_hand, 1e3 * kEps);
  }
}

TEST(ScaraDynamics, NothingActsAtRestWithoutGravityAndForce) {
  Parameters p = PaperParameters();
  p.gravity_W.setZero();
  for (const Vec4& X : QuadrantPoses(10, 41)) {
    const Instant at = InstantAt(p, X);
    EXPECT_EQ(DriveTorques(p, at.position, at.rates, Vec3::Zero(), 0.0).norm(), 0.0);
    const Vec3 F(1, -2, 3);
    Vec4 wrench;
    wrench << F, 0.4;
    const Vec4 expected = -InverseOfJ(p, at.position).transpose() * wrench;
    EXPECT_LT((DriveTorques(p, at.position, at.rates, F, 0.4) - expected).norm(),
              64 * kEps * expected.norm());
  }
}

/// Largest |input power − dE/dt| over a motion, relative to the largest power in the mechanism
/// (largest torque times largest rate). The torques may be perturbed.
template <typename Motion>
double PowerGap(const Parameters& p, const Motion& at_time, const std::vector<double>& times,
                const Vec3& F, double M_z, const Parameters& torque_parameters) {
  double gap = 0.0, torque = 0.0, rate = 0.0;
  for (const double t : times) {
    const Instant at = at_time(t);
    const Vec4 M = DriveTorques(torque_parameters, at.position, at.rates, F, M_z);
    const double input =
        M.dot(at.rates.dtheta) + F.dot(at.rates.dX.head<3>()) + M_z * at.rates.dX[3];
    const double h = 2e-4;
    const auto energy = [&](double step) {
      const Instant moved = at_time(t + step);
      return Energy(p, moved.position, moved.rates);
    };
    const double energy_rate =
        (45 * (energy(h) - energy(-h)) - 9 * (energy(2 * h) - energy(-2 * h)) +
         (energy(3 * h) - energy(-3 * h))) /
        (60 * h);
    gap = std::max(gap, std::abs(input - energy_rate));
    torque = std::max(torque, M.cwiseAbs().maxCoeff());
    rate = std::max(rate, at.rates.dtheta.cwiseAbs().maxCoeff());
  }
  return gap / (torque * rate);
}

// Energies of about 1 J are differenced over 2e-4 s: 90/60·2·eps/h ≈ 3e-12 W in some W … 0.3 W.
constexpr double kPowerTolerance = 1e-10;

TEST(ScaraDynamics, PowerBalancesInTheSlowScenarios) {
  const Parameters p = WithGravity();
  const std::vector<double> times = {0.3, 1.1, 2.4, 3.7, 5.2, 6.6, 7.5, 8.8};
  for (const SineCase& motion : {DefaultCase(), AxisCase()}) {
    const auto at_time = [&](double t) { return SineInstant(p, motion, t); };
    EXPECT_LT(PowerGap(p, at_time, times, kToolForce, 0.0, p), kPowerTolerance);
  }
}

TEST(ScaraDynamics, PowerBalancesInPickAndPlace) {
  const Parameters p = WithGravity();
  // Away from the jumps of the jerk.
  const std::vector<double> times = {0.005, 0.02, 0.04, 0.05, 0.075, 0.1, 0.13, 0.16, 0.21, 0.27};
  const auto at_time = [&](double t) { return PickPlaceInstant(p, t); };
  EXPECT_LT(PowerGap(p, at_time, times, Vec3(1, -2, 3), 0.1, p), 10 * kPowerTolerance);
}

TEST(ScaraDynamics, PowerBalanceDetectsSlightlyWrongMasses) {
  const Parameters p = WithGravity();
  const std::vector<double> times = {0.04, 0.05, 0.075, 0.1, 0.13};
  const auto at_time = [&](double t) { return PickPlaceInstant(p, t); };
  const auto perturbed = [&](double Parameters::*member) {
    Parameters wrong = p;
    wrong.*member *= 1 + 1e-6;
    return PowerGap(p, at_time, times, Vec3::Zero(), 0.0, wrong);
  };
  EXPECT_GT(perturbed(&Parameters::m_p), 20 * kPowerTolerance);
  EXPECT_GT(perturbed(&Parameters::I_pz), 20 * kPowerTolerance);
  EXPECT_GT(perturbed(&Parameters::m_arm), 20 * kPowerTolerance);
  EXPECT_GT(perturbed(&Parameters::m_rods), 20 * kPowerTolerance);
  EXPECT_GT(perturbed(&Parameters::arm_com), 20 * kPowerTolerance);
}

TEST(ScaraDynamics, MirroredMotionExchangesTheTorques) {
  const Parameters p = WithGravity();
  for (double t = 0.01; t < 0.2; t += 0.02) {
    const Instant at = PickPlaceInstant(p, t);
    Instant mirrored;
    ASSERT_TRUE(InversePosition(p, MirrorPose(at.position.X), &mirrored.position).ok());
    mirrored.rates.dX = MirrorPose(at.rates.dX);
    mirrored.rates.ddX = MirrorPose(at.rates.ddX);
    DriveRates(p, mirrored.position, &mirrored.rates);
    const Vec4 M = DriveTorques(p, at.position, at.rates, Vec3(1, 2, 3), 0.2);
    const Vec4 M_mirrored = DriveTorques(p, mirrored.position, mirrored.rates, Vec3(2, 1, 3), -0.2);
    EXPECT_LT((M_mirrored - MirrorLimbs(M)).norm(), 1e4 * kEps * M.norm());
  }
}

TEST(ScaraDynamics, TorqueRangesAreAsDescribed) {
  const struct {
    SineCase motion;
    double g;
    Vec4 low, high;
  } rows[] = {
      {DefaultCase(), 9.81, Vec4(0.05, -1.15, -0.64, -4.06), Vec4(2.29, -0.80, 1.57, -0.37)},
      {DefaultCase(), 0.0, Vec4(0.04, -0.36, -0.16, -1.46), Vec4(0.85, -0.23, 0.65, -0.11)},
      {AxisCase(), 9.81, Vec4(-4.36, 0.47, -4.14, -0.47), Vec4(-0.70, 3.64, -0.93, 2.33)}};
  constexpr double kDigits = 0.011;
  for (const auto& row : rows) {
    Parameters p = PaperParameters();
    p.gravity_W.z() = -row.g;
    Vec4 low = Vec4::Constant(1e9), high = -low;
    for (double t = 0; t < 10; t += 0.02) {
      const Instant at = SineInstant(p, row.motion, t);
      const Vec4 M = DriveTorques(p, at.position, at.rates, kToolForce, 0.0);
      low = low.cwiseMin(M);
      high = high.cwiseMax(M);
    }
    EXPECT_LT((low - row.low).cwiseAbs().maxCoeff(), kDigits) << low.transpose();
    EXPECT_LT((high - row.high).cwiseAbs().maxCoeff(), kDigits) << high.transpose();
  }
}

TEST(ScaraDynamics, PickAndPlacePeaksAreAsDescribed) {
  const Parameters p = WithGravity();
  double acceleration = 0, yaw = 0, rate = 0;
  Vec4 low = Vec4::Constant(1e9), high = -low;
  for (double t = 0; t < 0.4; t += 0.0005) {
    const Instant at = PickPlaceInstant(p, t);
    acceleration = std::max(acceleration, at.rates.ddX.head<2>().norm());
    yaw = std::max(yaw, std::abs(at.rates.ddX[3]));
    rate = std::max(rate, at.rates.dtheta.cwiseAbs().maxCoeff());
    const Vec4 M = DriveTorques(p, at.position, at.rates, Vec3::Zero(), 0.0);
    low = low.cwiseMin(M);
    high = high.cwiseMax(M);
  }
  EXPECT_NEAR(acceleration, 36.9, 0.06);
  EXPECT_NEAR(yaw, 210, 0.6);
  EXPECT_NEAR(rate, 12.9, 0.06);
  EXPECT_LT((low - Vec4(-3.50, -3.50, -6.06, -6.06)).cwiseAbs().maxCoeff(), 0.006);
  EXPECT_LT((high - Vec4(4.65, 4.65, 4.11, 4.11)).cwiseAbs().maxCoeff(), 0.006);
}

TEST(ScaraDynamics, SpinOfTheRodsMattersByTheStatedAmount) {
  const Parameters p = WithGravity();
  double spin = 0, torque = 0;
  for (double t = 0; t < 0.4; t += 0.001) {
    const Instant at = PickPlaceInstant(p, t);
    const Vec4 full = DriveTorques(p, at.position, at.rates, Vec3::Zero(), 0.0);
    const Vec4 thin = DriveTorques(p, at.position, at.rates, Vec3::Zero(), 0.0, RodModel::kThin);
    spin = std::max(spin, (full - thin).cwiseAbs().maxCoeff());
    torque = std::max(torque, full.cwiseAbs().maxCoeff());
  }
  EXPECT_NEAR(spin / torque, 1.3e-5, 0.06e-5);
}

// --- the witness ---------------------------------------------------------------------------

Command CommandOf(const std::string& name, Coordinate coordinate, Profile profile) {
  Command command;
  command.name = name;
  command.terms = {{coordinate, 1.0}};
  command.profile = std::move(profile);
  return command;
}

Motion SineMotion(const Parameters& p, const SineCase& c) {
  const Instant home = InstantAt(p, c.home_X);
  Motion motion;
  motion.duration_s = 10;
  motion.sample_s = 0.1;
  for (int i = 0; i < kLimbs; ++i) {
    motion.commands.push_back(
        CommandOf(std::string(LimbName(i)) + ".drive", {Coordinate::Kind::kDrive, i, 0},
                  {{ConstantTerm{home.position.theta[i]}, SineTerm{c.amplitude[i], 0.1, 0.0}}}));
  }
  return motion;
}

Motion TaskMotion() {
  Motion motion;
  motion.duration_s = 1;
  const struct {
    const char* name;
    int component;
    double value, amplitude;
  } rows[] = {{"platform.x", 0, -0.05, 0.01},
              {"platform.y", 1, -0.05, 0.02},
              {"platform.z", 2, -0.15, 0.01},
              {"platform.yaw", 5, 0.1, 0.2}};
  for (const auto& row : rows) {
    motion.commands.push_back(
        CommandOf(row.name, {Coordinate::Kind::kOutput, 0, row.component},
                  {{ConstantTerm{row.value}, SineTerm{row.amplitude, 1, 0}}}));
  }
  return motion;
}

TEST(ScaraClosedForm, RunsInJointSpaceWithHomeFromTheModel) {
  Mechanism mechanism = PaperMechanism();
  const Motion motion = SineMotion(PaperParameters(), DefaultCase());
  Diagnostics diagnostics;
  const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  ASSERT_TRUE(closed_form) << diagnostics.Text();
  const ClosedFormRun run = RunClosedForm(mechanism, motion, closed_form.get());
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_TRUE(run.trace.values.allFinite());
  Parameters p = WithGravity();
  for (const int row : {0, 17, 63}) {
    const Instant at = SineInstant(p, DefaultCase(), run.trace.time_s[row]);
    const Vec4 M = DriveTorques(p, at.position, at.rates, Vec3::Zero(), 0.0);
    for (int i = 0; i < kLimbs; ++i) {
      const int column = run.trace.Find(std::string(LimbName(i)) + ".drive.force");
      EXPECT_NEAR(run.trace.values(row, column), M[i], 1e5 * kEps);
    }
    EXPECT_NEAR(run.trace.values(row, run.trace.Find("platform.yaw")), at.position.X[3],
                1e4 * kEps);
    EXPECT_NEAR(run.trace.values(row, run.trace.Find("singularity.s_min")),
                Measure(p, at.position).s_min, 1e4 * kEps);
  }
}

TEST(ScaraClosedForm, LoadInBodyAxesAtAPointTurnsWithThePlatform) {
  const Mechanism mechanism = PaperMechanism();
  Motion motion = TaskMotion();
  Load load;
  load.name = "tool";
  load.body = 1;
  load.p_BoQ_B = Vec3(0.02, 0.01, -0.04);
  load.in_body_axes = true;
  load.force = {Constant(3.0), Constant(-1.0), Constant(-5.0)};
  load.moment = {Constant(0.3), Constant(0.1), Constant(0.2)};
  motion.loads = {load};
  Diagnostics diagnostics;
  const auto loaded = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  ASSERT_TRUE(loaded) << diagnostics.Text();
  CommandSample command;
  ClosedFormSample sample;
  EvaluateMotion(motion, 0.15, &command);
  ASSERT_TRUE(loaded->Dynamics(command, &sample).ok());
  // By hand: the force turned by the yaw, its moment about z as a cross product.
  const Parameters p = WithGravity();
  Instant at = InstantAt(p, Vec4(command.position));
  at.rates.dX = command.velocity;
  at.rates.ddX = command.acceleration;
  DriveRates(p, at.position, &at.rates);
  const double c = std::cos(command.position[3]), s = std::sin(command.position[3]);
  const Vec3 F(3 * c + 1 * s, 3 * s - 1 * c, -5);
  const double M_z = 0.2 + 0.02 * -1.0 - 0.01 * 3.0;
  const Vec4 M = DriveTorques(p, at.position, at.rates, F, M_z);
  EXPECT_LT((sample.force - M).norm(), 1e3 * kEps * M.norm());
}

TEST(ScaraClosedForm, SamplesAllocateNothing) {
  const Mechanism mechanism = PaperMechanism();
  for (const Motion& motion : {SineMotion(PaperParameters(), DefaultCase()), TaskMotion()}) {
    Diagnostics diagnostics;
    const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
    ASSERT_TRUE(closed_form);
    CommandSample command;
    ClosedFormSample sample;
    EvaluateMotion(motion, 0.0, &command);
    ASSERT_TRUE(closed_form->Dynamics(command, &sample).ok());
    const std::size_t before = AllocationCount();
    bool ok = true;
    for (int i = 1; i <= 100; ++i) {
      EvaluateMotion(motion, 0.01 * i, &command);
      ok = closed_form->Dynamics(command, &sample).ok() && ok;
    }
    EXPECT_EQ(AllocationCount(), before);
    EXPECT_TRUE(ok);
  }
}

TEST(ScaraClosedForm, PathThroughTheCentreIsReportedWithItsTime) {
  const Mechanism mechanism = PaperMechanism();
  Motion motion = TaskMotion();
  motion.commands[0].profile = {{ConstantTerm{-0.05}, RampTerm{0.1}}};
  motion.commands[1].profile = motion.commands[0].profile;
  motion.commands[3].profile = Constant(0.0);
  Diagnostics diagnostics;
  const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  ASSERT_TRUE(closed_form);
  const ClosedFormRun run = RunClosedForm(mechanism, motion, closed_form.get());
  EXPECT_EQ(run.summary.stop, Stop::kSingular);
  EXPECT_NEAR(run.summary.time_s, 0.5, 1e-9);
  EXPECT_EQ(run.summary.where, "platform");
}

TEST(ScaraClosedForm, PathAcrossASingularLineBetweenSamplesIsReported) {
  const Mechanism mechanism = PaperMechanism();
  Motion motion = TaskMotion();
  motion.sample_s = 0.03;
  motion.commands[0].profile = {{ConstantTerm{-0.05}, RampTerm{0.1}}};
  motion.commands[1].profile = Constant(-0.05);
  motion.commands[3].profile = Constant(0.0);
  Diagnostics diagnostics;
  const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  const ClosedFormRun run = RunClosedForm(mechanism, motion, closed_form.get());
  EXPECT_EQ(run.summary.stop, Stop::kSingular);
  EXPECT_NE(run.summary.message.find("changed its sign"), std::string::npos);
}

TEST(ScaraClosedForm, MarksThePosesNearASingularLine) {
  const Mechanism mechanism = PaperMechanism();
  Motion motion = TaskMotion();
  motion.sample_s = 0.01;
  motion.duration_s = 0.49;
  motion.commands[0].profile = {{ConstantTerm{-0.05}, RampTerm{0.1}}};
  motion.commands[1].profile = Constant(-0.05);
  motion.commands[3].profile = Constant(0.0);
  Diagnostics diagnostics;
  const auto closed_form = MakeClosedForm(mechanism, motion, {}, &diagnostics);
  const ClosedFormRun run = RunClosedForm(mechanism, motion, closed_form.get());
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX near = run.trace.values.col(run.trace.Find("singularity.near"));
  const VecX s_min = run.trace.values.col(run.trace.Find("singularity.s_min"));
  EXPECT_EQ(near[0], 0.0);
  EXPECT_EQ(near[near.size() - 1], 1.0);
  for (Eigen::Index i = 0; i < near.size(); ++i) {
    EXPECT_EQ(near[i] == 1.0, s_min[i] < kNearlySingular) << i;
  }
}

TEST(ScaraClosedForm, RefusesMotionsItCannotTake) {
  const Mechanism mechanism = PaperMechanism();
  Motion incomplete = TaskMotion();
  incomplete.commands.pop_back();
  Diagnostics missing;
  EXPECT_FALSE(MakeClosedForm(mechanism, incomplete, {}, &missing));
  EXPECT_NE(missing.Text().find("platform.yaw is not commanded"), std::string::npos);

  Motion tilted = TaskMotion();
  tilted.commands.push_back(
      CommandOf("platform.roll", {Coordinate::Kind::kOutput, 0, 3}, Constant(0)));
  Diagnostics roll;
  EXPECT_FALSE(MakeClosedForm(mechanism, tilted, {}, &roll));
  EXPECT_NE(roll.Text().find("platform.roll"), std::string::npos);

  Motion mixed = TaskMotion();
  mixed.commands.push_back(CommandOf("limb1.drive", {Coordinate::Kind::kDrive, 0, 0}, Constant(0)));
  Diagnostics both;
  EXPECT_FALSE(MakeClosedForm(mechanism, mixed, {}, &both));
  EXPECT_NE(both.Text().find("both commanded"), std::string::npos);
}

}  // namespace
}  // namespace mbv::scara_robot
