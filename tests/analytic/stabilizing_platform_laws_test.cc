// Stabilizing platform: special poses, laws of mechanics, and poses that cannot be computed.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "math/spatial.h"
#include "tests/analytic/stabilizing_platform_fixture.h"

namespace mbv::stabilizing_platform {
namespace {

Evaluation At(double t, Model model = Model::kFull) {
  return Evaluate(PlatformEquations(Default(), DrivePairs::kSynchronous, model), SeaState(t));
}

double Yaw(const Evaluation& e) { return std::atan2(e.upper.R_EB(1, 0), e.upper.R_EB(0, 0)); }

constexpr double kPoseRoundoff = 32 * kEps * 7.5;    // sums of a few lengths of 7.5 m
constexpr double kForceRoundoff = 1e5 * kEps * 5e5;  // N; chains of divisions by sines >= 0.1

TEST(StabilizingPlatformSpecialPoses, WithoutRollHaveNoYawAndTwoEqualLimbs) {
  for (double t : {3.0, 9.0}) {
    const Evaluation e = At(t);
    const double beta = SeaState(t).pitch.value, height = 3.5 - SeaState(t).heave.value;
    EXPECT_NEAR(Yaw(e), 0, 4 * kEps);
    EXPECT_NEAR(e.upper.p_EB.y(), 0, kPoseRoundoff);
    EXPECT_NEAR(e.upper.p_EB.x(), std::tan(beta) * height + 3.69 * (1 - 1 / std::cos(beta)),
                kPoseRoundoff);
    EXPECT_NEAR(e.limbs[1].length.value, e.limbs[2].length.value, kPoseRoundoff);
    EXPECT_NEAR(e.limbs[1].side[0].R.value, e.limbs[2].side[0].R.value, kPoseRoundoff);
  }
  EXPECT_NEAR(At(3).upper.p_EB.x(), -0.188491, 0.5e-6);
}

TEST(StabilizingPlatformSpecialPoses, WithoutPitchHaveNoYaw) {
  for (double t : {2.0, 4.0}) {
    const Evaluation e = At(t);
    const double alpha = SeaState(t).roll.value, height = 3.5 - SeaState(t).heave.value;
    EXPECT_NEAR(Yaw(e), 0, 4 * kEps);
    EXPECT_NEAR(e.upper.p_EB.y(), -std::tan(alpha) * height, kPoseRoundoff);
    EXPECT_NEAR(e.upper.p_EB.x(), 3.69 * (1 - std::cos(alpha)), kPoseRoundoff);
  }
  EXPECT_NEAR(At(2).upper.p_EB.x(), 0.015164, 0.5e-6);
}

TEST(StabilizingPlatformLaws, EverythingRepeatsAfterTwelveSeconds) {
  for (double t : {0.0, 1.5, 4.7}) {
    const Evaluation a = At(t), b = At(t + 12);
    for (int d = 0; d < 6; ++d) {
      EXPECT_NEAR(a.forces[d / 2].drive[d % 2], b.forces[d / 2].drive[d % 2], 1e-5);
    }
  }
}

TEST(StabilizingPlatformLaws, ForcesAreLinearInTheLinkMass) {
  auto scaled = [](double t, double scale) {
    std::map<std::string, double> values = DefaultParameters();
    values["link_mass_scale"] = scale;
    return Evaluate(PlatformEquations(ParametersOf(values), DrivePairs::kSynchronous), SeaState(t));
  };
  for (double t : {0.0, 1.5, 7.3}) {
    const Evaluation f0 = scaled(t, 0), f1 = scaled(t, 1), massless = At(t, Model::kMassless);
    for (double k : {0.5, 1.7}) {
      const Evaluation fk = scaled(t, k);
      for (int d = 0; d < 6; ++d) {
        const int i = d / 2, j = d % 2;
        const double expected =
            f0.forces[i].drive[j] + k * (f1.forces[i].drive[j] - f0.forces[i].drive[j]);
        EXPECT_NEAR(fk.forces[i].drive[j], expected, kForceRoundoff);
        EXPECT_NEAR(f0.forces[i].drive[j], massless.forces[i].drive[j], kForceRoundoff);
      }
    }
  }
}

TEST(StabilizingPlatformLaws, LimbForcesCarryThePlatform) {
  for (double t : {0.4, 1.5, 10.9}) {
    const Evaluation e = At(t);
    Vec3 force = Vec3::Zero(), moment_p = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      const Vec3 f = e.limbs[i].R_oA * e.forces[i].on_platform;
      force += f;
      moment_p += (e.limbs[i].p_oB - e.motion.p_op).cross(f);
    }
    const Vec3 expected = 50000 * (e.upper.a + Vec3(0, 0, 9.8));
    EXPECT_LT((e.lower.R_EB * force - expected).norm(), kForceRoundoff);
    // Level platform: I ε about the vertical only.
    const Vec3 moment = e.lower.R_EB * moment_p;
    EXPECT_LT((moment - Vec3(0, 0, 4.3e5 * e.upper.epsilon.z())).norm(), 8 * kForceRoundoff);
  }
}

// Kinetic and potential energy of platform and links, and the power of drives and ship, from the
// forces on the base: reactions at the feet and the drives' base balls.
struct Energy {
  double value = 0, power = 0;
};

double LinkEnergy(const Evaluation& e, int i, int k) {
  const PlatformParameters& p = Default();
  const LimbGeometry& g = e.geometry[i];
  const LimbMotion& m = e.limbs[i];
  const int j = k % 2;
  const double s = kSides[j];
  const SideMotion& side = m.side[j];
  const Jet& q = k < kLink2 ? side.q1 : side.q2;
  const double fraction = p.links[k].com_fraction;
  const Vec3 normal1(0, -g.d1[j].z(), g.d1[j].y()), normal2(0, -g.d2[j].z(), g.d2[j].y());
  Vec3 c, v;  // centre of mass and its velocity in the limb plane
  if (k < kLink2) {
    c = g.U[j] + fraction * p.L1 * g.d1[j];
    v = s * fraction * p.L1 * side.q1.rate * normal1;
  } else {
    c = g.E[j] + fraction * p.L3 * g.d2[j];
    v = s * (p.L1 * side.q1.rate * normal1 + fraction * p.L3 * side.q2.rate * normal2);
  }
  const Mat3 R_eA = e.lower.R_EB * m.R_oA;
  const Vec3 plane = e.lower.omega + m.tilt.rate * R_eA.col(1);
  const Vec3 A = e.lower.R_EB * m.p_oA;
  const Vec3 velocity = e.lower.v + e.lower.omega.cross(A) + plane.cross(R_eA * c) + R_eA * v;
  const Vec3 omega = (R_eA * g.R_AL(k)).transpose() * (plane + s * q.rate * R_eA.col(0));
  const double height = (e.lower.p_EB + A + R_eA * c).z();
  return 0.5 * p.links[k].mass * velocity.squaredNorm() + p.links[k].mass * 9.8 * height +
         0.5 * omega.dot(p.links[k].moments.cwiseProduct(omega));
}

Energy EnergyOf(const PlatformEquations& equations, double t) {
  const Evaluation e = Evaluate(equations, SeaState(t));
  const PlatformParameters& p = Default();
  Energy energy;
  const Vec3 omega_p = e.upper.R_EB.transpose() * e.upper.omega;
  energy.value = 0.5 * p.m_p * e.upper.v.squaredNorm() + p.m_p * 9.8 * e.upper.p_EB.z() +
                 0.5 * omega_p.dot(p.I_p.cwiseProduct(omega_p));
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 4; ++k) energy.value += LinkEnergy(e, i, k);
    const LimbReactions r = ReactionsOf(e.geometry[i], e.required[i], e.forces[i]);
    const Mat3 R_eA = e.lower.R_EB * e.limbs[i].R_oA;
    const Vec3 A = e.lower.R_EB * e.limbs[i].p_oA;
    for (int j = 0; j < 2; ++j) {
      const LimbGeometry& g = e.geometry[i];
      const double drive = e.forces[i].drive[j];
      energy.power += drive * e.limbs[i].side[j].R.rate;
      // The ship acts on the feet and, against the thrust, on the drives' base balls.
      const Vec3 foot = R_eA * r.foot[j].tail<3>(), ball = R_eA * (drive * g.thrust[j]);
      const Vec3 p_ball(0, kSides[j] * p.L4, 0);
      const Vec3 moment = R_eA * r.foot[j].head<3>() + (A + R_eA * g.U[j]).cross(foot) +
                          (A + R_eA * p_ball).cross(ball);
      energy.power += (foot + ball).dot(e.lower.v) + moment.dot(e.lower.omega);
    }
  }
  return energy;
}

TEST(StabilizingPlatformLaws, PowerOfDrivesAndShipIsTheRateOfEnergy) {
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  const double h = 5e-3;
  double worst = 0, largest = 0;
  for (double t : {0.3, 1.5, 4.0, 7.3, 10.8}) {
    auto E = [&](double s) { return EnergyOf(equations, s).value; };
    const double rate = (45 * (E(t + h) - E(t - h)) - 9 * (E(t + 2 * h) - E(t - 2 * h)) +
                         (E(t + 3 * h) - E(t - 3 * h))) /
                        (60 * h);
    const double power = EnergyOf(equations, t).power;
    worst = std::max(worst, std::abs(power - rate));
    largest = std::max(largest, std::abs(power));
  }
  // Differences of 2 MJ with step h: 20 · 2 ε E/h.
  EXPECT_LT(worst, 40 * kEps * 2.5e6 / h);
  EXPECT_GT(largest, 1e4);
}

TEST(StabilizingPlatformLaws, MeanPowerOverAPeriodIsZero) {
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  double sum = 0;
  for (int k = 0; k < 1200; ++k) sum += EnergyOf(equations, 0.01 * k).power;
  EXPECT_NEAR(sum / 1200, 0, 1e-4);  // W, of peaks near 900 kW; smooth periodic integrand
}

TEST(StabilizingPlatformLaws, SumOfTheRatesOfALimbIsAlongZAtTheTip) {
  // ∂(R + R')/∂pose = 2/(dl/dR) (B × Z; Z), ∂(R − R')/∂pose ∥ (B × Y; Y): independent drives
  // whose platform pose is moved along the six directions.
  const PlatformEquations equations(Default(), DrivePairs::kIndependent);
  const Evaluation sync = At(1.5);
  PoseCommand command = SeaState(1.5);
  const Vec3 rpy = RpyOf(sync.upper.R_EB);
  for (int c = 0; c < 3; ++c) {
    command.platform[c] = Jet{sync.upper.p_EB[c], 0, 0};
    command.platform[3 + c] = Jet{rpy[c], 0, 0};
  }
  for (Jet* ship : {&command.roll, &command.pitch, &command.heave}) ship->rate = 0;
  for (int direction = 0; direction < 6; ++direction) {
    PoseCommand moving = command;
    moving.platform[direction].rate = 1;
    Evaluation e;
    ASSERT_TRUE(equations.EvaluateKinematics(moving, &e).ok());
    for (int i = 0; i < 3; ++i) {
      const LimbMotion& m = e.limbs[i];
      const double sum = m.side[0].R.rate + m.side[1].R.rate;
      const double difference = m.side[0].R.rate - m.side[1].R.rate;
      const double along_Z = m.R_oA.col(2).dot(m.v_oB), along_Y = m.R_oA.col(1).dot(m.v_oB);
      EXPECT_NEAR(sum, 2 / LengthPerDrive(Default(), m.side[0]) * along_Z, 1e-11);
      // R' of one side per y: k sin q12 cos q2/(R L1 s12), with opposite signs on both sides.
      const SideMotion& s = m.side[0];
      const double slope = 2 * Default().L2 * (Default().L4 + Default().L5) * s.s12 * s.c2 /
                           (s.R.value * Default().L1 * (s.s2 * s.c1 - s.c2 * s.s1));
      EXPECT_NEAR(difference, slope * along_Y, 1e-11);
    }
  }
}

TEST(StabilizingPlatformLaws, LoadsDoVirtualWorkWithTheDrives) {
  // A load F at Q changes the drives by δf with Σ δf R' = −F · v_Q for every pose rate.
  const PlatformEquations equations(Default(), DrivePairs::kIndependent);
  std::mt19937_64 generator(7);
  std::uniform_real_distribution<double> u(-1, 1);
  auto vector = [&](double size) {
    return Vec3(size * u(generator), size * u(generator), size * u(generator));
  };
  for (int limb : {-1, 0, 2}) {
    for (int link = 0; link < (limb < 0 ? 1 : 4); ++link) {
      for (bool in_body : {false, true}) {
        BodyLoad load{.limb = limb,
                      .link = link,
                      .p_BoQ_B = vector(2),
                      .in_body_axes = in_body,
                      .force = vector(2e4),
                      .moment = vector(3e4)};
        PoseCommand command = SeaState(1.5);
        const Evaluation with = Evaluate(equations, command, std::span(&load, 1));
        const Evaluation without = Evaluate(equations, command);
        // Ship at rest, platform moving: velocities of the loaded body.
        for (Jet* ship : {&command.roll, &command.pitch, &command.heave}) ship->rate = 0;
        for (int c = 0; c < 6; ++c) command.platform[c].rate = u(generator);
        auto body_pose = [&](double dt, Mat3* R, Vec3* p) {
          PoseCommand moved = command;
          for (int c = 0; c < 6; ++c) moved.platform[c].value += dt * command.platform[c].rate;
          const Evaluation e = Evaluate(equations, moved);
          if (limb < 0) {
            *R = e.upper.R_EB;
            *p = e.upper.p_EB;
          } else {
            const Mat3 R_eA = e.lower.R_EB * e.limbs[limb].R_oA;
            *R = R_eA * e.geometry[limb].R_AL(link);
            *p = e.lower.p_EB + e.lower.R_EB * e.limbs[limb].p_oA +
                 R_eA * e.geometry[limb].origin(link);
          }
        };
        const double h = 1e-5;
        Mat3 R, R_a, R_b;
        Vec3 p, p_a, p_b;
        body_pose(0, &R, &p);
        body_pose(h, &R_a, &p_a);
        body_pose(-h, &R_b, &p_b);
        const Vec3 v_Q = ((p_a + R_a * load.p_BoQ_B) - (p_b + R_b * load.p_BoQ_B)) / (2 * h);
        const Vec3 omega = LogRotation(R_a * R_b.transpose()) / (2 * h);
        const Mat3 axes = in_body ? R : Mat3::Identity();
        const double load_power = (axes * load.force).dot(v_Q) + (axes * load.moment).dot(omega);
        const Evaluation moving = Evaluate(equations, command);
        double drive_power = 0;
        for (int d = 0; d < 6; ++d) {
          drive_power += (with.forces[d / 2].drive[d % 2] - without.forces[d / 2].drive[d % 2]) *
                         moving.limbs[d / 2].side[d % 2].R.rate;
        }
        // Central differences: h² f‴/6 of velocities up to 10 m/s near the toggle, times 5e4 N.
        EXPECT_NEAR(drive_power, -load_power, 2e-3)
            << "limb " << limb + 1 << " link " << link << " body axes " << in_body;
        EXPECT_GT(std::abs(load_power), 1) << "a load that does no work tests nothing";
      }
    }
  }
}

TEST(StabilizingPlatformPoses, ReportTheToggleWithLimbAndMissingLength) {
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  PoseCommand command;
  command.platform.fill(Jet{});
  // Level ship: l = hypot(0.12, z − 0.225); the toggle is at √(L1² − (L3 + L5)²) = 0.691014 m.
  const double toggle = std::sqrt(4.8 * 4.8 - 4.75 * 4.75);
  EXPECT_NEAR(toggle, 0.691014, 0.5e-6);
  const double z_toggle = 0.225 + std::sqrt(toggle * toggle - 0.12 * 0.12);
  Evaluation e;
  command.platform[2].value = z_toggle + 1e-4;
  EXPECT_TRUE(equations.EvaluateKinematics(command, &e).ok());
  command.platform[2].value = 0.8;
  const RunSummary beyond = equations.EvaluateKinematics(command, &e);
  EXPECT_EQ(beyond.stop, Stop::kSingular);
  EXPECT_EQ(beyond.where, "limb1");
  EXPECT_EQ(beyond.unit, "m");
  EXPECT_NEAR(beyond.amount, toggle - std::hypot(0.12, 0.575), 1e-12);
  EXPECT_NE(beyond.message.find("beyond their toggle"), std::string::npos) << beyond.message;
}

TEST(StabilizingPlatformPoses, ReportStretchedLimbsWithMissingLength) {
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  PoseCommand command;
  command.platform.fill(Jet{});
  const double stretched = std::sqrt(7.05 * 7.05 - 2.5 * 2.5);
  EXPECT_NEAR(stretched, 6.591851, 0.5e-6);
  Evaluation e;
  command.platform[2].value = 0.225 + std::sqrt(stretched * stretched - 0.12 * 0.12) + 0.3;
  const RunSummary summary = equations.EvaluateKinematics(command, &e);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "limb1");
  EXPECT_NEAR(summary.amount, std::hypot(2.5, 0.12, command.platform[2].value - 0.225) - 7.05,
              1e-12);
  command.platform[2].value -= 0.301;
  EXPECT_TRUE(equations.EvaluateKinematics(command, &e).ok());
}

TEST(StabilizingPlatformPoses, NeverGiveNaNWhereverThePlatformIs) {
  std::mt19937_64 generator(99);
  std::uniform_real_distribution<double> u(-1, 1);
  int computed = 0, refused = 0;
  for (DrivePairs pairs : {DrivePairs::kSynchronous, DrivePairs::kIndependent}) {
    const PlatformEquations equations(Default(), pairs);
    for (int k = 0; k < 2000; ++k) {
      PoseCommand c;
      c.roll = {1.7 * u(generator), u(generator), u(generator)};
      c.pitch = {1.7 * u(generator), u(generator), u(generator)};
      c.heave = {u(generator), u(generator), u(generator)};
      for (Jet& jet : c.platform) jet = {u(generator), u(generator), u(generator)};
      c.platform[2].value = 3.5 + 5 * u(generator);
      Evaluation e;
      RunSummary summary = equations.EvaluateKinematics(c, &e);
      if (summary.ok()) summary = equations.EvaluateDynamics({}, &e);
      if (!summary.ok()) {
        ++refused;
        EXPECT_FALSE(summary.where.empty());
        EXPECT_TRUE(std::isfinite(summary.amount)) << summary.message;
        continue;
      }
      ++computed;
      for (const LimbForces& f : e.forces) {
        EXPECT_TRUE(std::isfinite(f.drive[0]) && std::isfinite(f.drive[1]));
      }
    }
  }
  EXPECT_GT(computed, 100);
  EXPECT_GT(refused, 100);
}

TEST(StabilizingPlatformAmplification, PassesSmoothlyThroughNeutral) {
  const Amplification amplification(Default());
  const PlatformEquations equations(Default(), DrivePairs::kSynchronous);
  double previous = kNan;
  for (double dz = -3e-5; dz <= 3e-5; dz += 5e-7) {
    PoseCommand c;
    c.platform.fill(Jet{});
    c.platform[2].value = 3.5 + dz;
    Evaluation e;
    ASSERT_TRUE(equations.EvaluateKinematics(c, &e).ok());
    const double value = amplification(e.limbs[0]);
    // The ratio falls by 0.17 per metre of height.
    EXPECT_NEAR(value, 2.284130710 - 0.17 * dz, 5e-7);
    // Slope × step, and roundoff 4 ε l/|R − R0| of the secant at the switch.
    if (!std::isnan(previous)) {
      EXPECT_NEAR(value, previous, 2e-7 + 4 * kEps * 3.3 / 1e-5);
    }
    previous = value;
  }
}

}  // namespace
}  // namespace mbv::stabilizing_platform
