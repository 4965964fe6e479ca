// The stabilizing platform and the 3-SPR tripod at poses whose values were computed independently
// (vector loops, virtual power and a 78-equation Newton–Euler solution).
#include <gtest/gtest.h>

#include <numbers>

#include "math/spatial.h"
#include "model_file/load_model.h"
#include "tests/reference/fixture.h"
#include "tests/support/source_dir.h"

namespace mbv::fixtures {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

Mechanism LoadModelOf(const std::string& name, std::map<std::string, double> overrides = {}) {
  LoadOptions options;
  options.overrides = std::move(overrides);
  LoadResult loaded = LoadModel(SourcePath("/models/") + name + "/model.yaml", options);
  if (!loaded.mechanism.has_value()) throw std::runtime_error(loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

// Roll 6° in 6 s, pitch 3° in 4 s, heave 1.5 m in 6 s (scaled by `sea`); platform level at z0,
// drives of a limb equally long.
Motion SeaState(const Mechanism& m, double sea, double duration_s, double sample_s) {
  using Kind = Coordinate::Kind;
  Motion motion;
  motion.duration_s = duration_s;
  motion.sample_s = sample_s;
  const auto sine = [&](double amplitude, double period_s) {
    return Profile{{SineTerm{sea * amplitude, 1 / period_s, 0}}};
  };
  for (size_t p = 0; p < m.prescribed.size(); ++p) {
    const std::string& name = m.prescribed[p].name;
    const Profile profile = name == "roll"    ? sine(6 * kDegree, 6)
                            : name == "pitch" ? sine(3 * kDegree, 4)
                                              : sine(1.5, 6);
    motion.commands.push_back(Commanded(name, Kind::kPrescribed, static_cast<int>(p), 0, profile));
  }
  const int output = m.FindOutput("platform");
  motion.commands.push_back(Commanded("platform.z", Kind::kOutput, output, 2, Constant(3.5)));
  motion.commands.push_back(Commanded("platform.roll", Kind::kOutput, output, 3, Constant(0)));
  motion.commands.push_back(Commanded("platform.pitch", Kind::kOutput, output, 4, Constant(0)));
  for (int limb = 0; limb < 3; ++limb) {
    Command pair = Commanded("pair", Kind::kDrive, 2 * limb, 0, Constant(0));
    pair.terms.push_back({{.kind = Kind::kDrive, .index = 2 * limb + 1, .component = 0}, -1.0});
    motion.commands.push_back(pair);
  }
  return motion;
}

Eigen::VectorXd Forces(const Mechanism& m, const Trace& trace, Eigen::Index sample) {
  Eigen::VectorXd forces(m.drives.size());
  for (size_t d = 0; d < m.drives.size(); ++d) {
    forces[static_cast<Eigen::Index>(d)] = At(trace, sample, m.drives[d].name + ".force");
  }
  return forces;
}

TEST(ReferencePlatform, HoldsItsLoadWithTheForceComputedByHand) {
  const Mechanism m = LoadModelOf("stabilizing_platform", {{"link_mass_scale", 0.0}});
  const ReferenceRun run = RunReference(m, SeaState(m, 0.0, 0.0, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::VectorXd forces = Forces(m, run.trace, 0);
  for (Eigen::Index d = 0; d < 6; ++d) EXPECT_NEAR(forces[d], 186662.5199, 1e-4);
  EXPECT_NEAR(At(run.trace, 0, "limb1.drive.position"), 2.818013474642, 1e-12);
}

TEST(ReferencePlatform, StandsStillWithItsLinksWeights) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  const ReferenceRun run = RunReference(m, SeaState(m, 0.0, 0.0, 0.1));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::VectorXd forces = Forces(m, run.trace, 0);
  constexpr double kPrinted = 6e-5;  // half of the last printed digit
  for (Eigen::Index d = 0; d < 6; d += 2) {
    EXPECT_NEAR(forces[d], 211431.5987, kPrinted);
    EXPECT_NEAR(forces[d + 1], 211778.5751, kPrinted);
  }
  // Reactions of limb 1 by the isostatic rule, in the limb's tilted plane.
  const double tilt = -2.098448566 * kDegree;
  const auto in_limb = [&](const std::string& joint, const char* kind, const Mat3& R_AF) {
    const std::string name = joint + ".reaction." + kind;
    return Vec3(R_AF * Vec3(At(run.trace, 0, name + "x"), At(run.trace, 0, name + "y"),
                            At(run.trace, 0, name + "z")));
  };
  const Mat3 R_AU = RotY(tilt).transpose();
  const Vec3 U1 = in_limb("limb1.U1", "f", R_AU);
  EXPECT_TRUE(U1.isApprox(Vec3(476.552, -173326.127, -100116.457), 1e-8)) << U1.transpose();
  EXPECT_NEAR(in_limb("limb1.U1", "m", R_AU).z(), -1246.791, 6e-4);
  const Mat3 R_AE = RotX(0.432001041535);  // link 1 lies at q1 in the limb plane, y along it
  const Vec3 R12 = in_limb("limb1.R12", "f", R_AE);
  EXPECT_TRUE(R12.isApprox(Vec3(-135.276, -125229.313, 89074.109), 1e-8)) << R12.transpose();
  EXPECT_NEAR(in_limb("limb1.R12", "m", R_AE).y(), -342.932, 6e-4);
  EXPECT_NEAR(in_limb("limb1.R12", "m", R_AE).z(), -502.977, 6e-4);
}

TEST(ReferencePlatform, RidesTheSeaWithTheForcesOfTheIndependentModel) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  const ReferenceRun run = RunReference(m, SeaState(m, 1.0, 1.5, 0.02));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::Index last = run.trace.values.rows() - 1;
  const Eigen::VectorXd forces = Forces(m, run.trace, last);
  const double expected[] = {219071.860, 283191.986, 443530.049,
                             443038.605, 274127.772, 206593.123};
  for (Eigen::Index d = 0; d < 6; ++d) EXPECT_NEAR(forces[d], expected[d], 6e-4);
  EXPECT_NEAR(At(run.trace, last, "limb1.drive.position"), 2.334365482, 6e-10);
  EXPECT_NEAR(At(run.trace, last, "limb2.drive.position"), 2.014160412, 6e-10);
  EXPECT_NEAR(At(run.trace, last, "limb3.drive_p.position"), 2.430366775, 6e-10);
  EXPECT_NEAR(At(run.trace, last, "limb1.drive.acceleration"), 0.354878138, 6e-10);
  EXPECT_NEAR(At(run.trace, last, "limb2.drive.acceleration"), 0.571156250, 6e-10);
  EXPECT_NEAR(At(run.trace, last, "limb3.drive.acceleration"), 0.462641777, 6e-10);
}

TEST(ReferencePlatform, BalancesPowerClosesLoopsAndRepeatsAfterItsPeriod) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  const ReferenceRun run = RunReference(m, SeaState(m, 1.0, 12.0, 0.05));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::VectorXd input = ColumnOf(run.trace, "power.input");
  const Eigen::VectorXd rate = ColumnOf(run.trace, "power.energy_rate");
  EXPECT_LT((input - rate).cwiseAbs().maxCoeff(), 1e-13 * input.cwiseAbs().maxCoeff());
  // Coordinates of up to 10 m, a few operations each.
  EXPECT_LT(ColumnOf(run.trace, "closure.position").maxCoeff(), 32 * kEps * 10);
  EXPECT_LT(ColumnOf(run.trace, "closure.rotation").maxCoeff(), 32 * kEps);
  const Eigen::VectorXd first = Forces(m, run.trace, 0);
  const Eigen::VectorXd last = Forces(m, run.trace, run.trace.values.rows() - 1);
  EXPECT_LT((first - last).cwiseAbs().maxCoeff(), 1e-12 * first.maxCoeff());
}

TEST(ReferencePlatform, ForcesAreLinearInTheLinkMasses) {
  const Motion motion = SeaState(LoadModelOf("stabilizing_platform"), 1.0, 1.0, 0.1);
  const auto forces = [&](double scale) {
    const Mechanism m = LoadModelOf("stabilizing_platform", {{"link_mass_scale", scale}});
    return Forces(m, RunReference(m, motion).trace, 10);
  };
  const Eigen::VectorXd none = forces(0.0), half = forces(0.5), full = forces(1.0);
  EXPECT_LT((none + 0.5 * (full - none) - half).norm(), 1e-12 * full.norm());
  EXPECT_GT((forces(0.501) - half).norm(), 1e-5 * full.norm());
}

// Seconds after which a level raised (or lowered) by 1 m/s from 3.5 m brings the limbs to `l`.
double TimeAtLimbLength(double l, double direction) {
  return direction * (std::sqrt(l * l - 0.12 * 0.12) + 0.225 - 3.5);
}

TEST(ReferencePlatform, WhenElbowsMeetTheLimbsTurnAboutThem) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  Motion motion = SeaState(m, 0.0, 4.0, 0.02);
  motion.commands[3].profile = Profile{{ConstantTerm{3.5}, RampTerm{1.0}}};
  const RunSummary summary = RunReference(m, motion).summary;
  EXPECT_EQ(summary.stop, Stop::kSingular) << summary.message;
  // Both elbows on the limb's axis: L1 cos q1 = L5, before the limb is stretched at 6.592 m.
  const double l = std::sqrt(4.8 * 4.8 - 2.5 * 2.5) + 2.25;
  EXPECT_NEAR(summary.time_s, TimeAtLimbLength(l, 1.0), 0.02);
  EXPECT_EQ(summary.where.substr(0, 4), "limb") << summary.where;
}

TEST(ReferencePlatform, AtTheToggleTheDrivesLoseControl) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  Motion motion = SeaState(m, 0.0, 4.0, 0.02);
  motion.commands[3].profile = Profile{{ConstantTerm{3.5}, RampTerm{-1.0}}};
  const RunSummary summary = RunReference(m, motion).summary;
  EXPECT_EQ(summary.stop, Stop::kSingular) << summary.message;
  EXPECT_NEAR(summary.time_s, TimeAtLimbLength(0.691014, -1.0), 0.02);
  EXPECT_EQ(summary.where.substr(0, 4), "limb") << summary.where;
}

TEST(ReferencePlatform, ATiltTheLimbsCannotReachNamesALimb) {
  const Mechanism m = LoadModelOf("stabilizing_platform");
  Motion motion = SeaState(m, 0.0, 4.0, 0.02);
  motion.commands[5].profile = Profile{{RampTerm{0.4}}};
  const RunSummary summary = RunReference(m, motion).summary;
  EXPECT_FALSE(summary.ok());
  EXPECT_EQ(summary.where.substr(0, 4), "limb") << summary.message;
}

TEST(ReferenceTripod, MeetsAGeneralPoseWithVelocityAndAcceleration) {
  const Mechanism m = LoadModelOf("spr_tripod");
  Motion motion;
  for (int c = 0; c < 3; ++c) {
    motion.commands.push_back(
        Commanded("platform." + std::string(1, "xyz"[c]), Coordinate::Kind::kOutput, 0, c, {}));
  }
  CommandSample command;
  command.time_s = 0.0;
  command.position = Vec3(0.0932306074699, -0.1050780234458, 0.55);
  command.velocity = Vec3(0.3, -0.2, 0.1);
  command.acceleration = Vec3(1, 2, -3);
  ReferenceSolver solver(m, motion);
  ReferenceSample sample;
  const RunSummary summary = solver.Dynamics(command, &sample);
  ASSERT_TRUE(summary.ok()) << summary.message;
  // r is given to 1e-13 m only.
  constexpr double kGiven = 1e-12;
  const Vec3 q(0.7189319479389, 0.5832115217055, 0.5473057176922);
  const Vec3 rate(0.3767360357474, 0.1497982994607, -0.0446012201923);
  const Vec3 acceleration(-3.2561743710981, -1.1940738385573, -3.6260442804258);
  const Vec3 force(-127.525396142175, -140.041348371558, -312.417078548095);
  EXPECT_LT((sample.driven.position - q).norm(), kGiven);
  EXPECT_LT((sample.driven.velocity - rate).norm(), 10 * kGiven);
  EXPECT_LT((sample.driven.acceleration - acceleration).norm(), 100 * kGiven);
  EXPECT_LT((sample.drive_force - force).norm(), 3e-12 * force.norm());
  const int S1 = m.FindJoint("leg1.S");
  const Joint& joint = m.joints[S1];
  const Vec3 on_leg_W = joint.X_PF.linear() * sample.reactions.row(S1).head<3>().transpose();
  EXPECT_LT((on_leg_W - Vec3(-16.3146233303746, 70.992607711643, -166.9800346342791)).norm(), 1e-9);
}

TEST(ReferenceTripod, HangsStillOnThePrintedTension) {
  const Mechanism m = LoadModelOf("spr_tripod");
  Motion motion;
  motion.duration_s = 0.0;
  const double home[] = {0, 0, 0.57};
  for (int c = 0; c < 3; ++c) {
    motion.commands.push_back(
        Commanded("platform", Coordinate::Kind::kOutput, 0, c, Constant(home[c])));
  }
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  for (int leg = 1; leg <= 3; ++leg) {
    const std::string name = "leg" + std::to_string(leg);
    EXPECT_NEAR(At(run.trace, 0, name + ".position"), 0.6204232426336, 1e-13);
    EXPECT_NEAR(At(run.trace, 0, name + ".force"), -149.972431679261, 1e-12 * 150);
  }
}

// Points on planes and on a line, and a screw, by plane trigonometry: the pin gives the lever's
// angle, which sinks the nut by the lead per turn, and the nut's hole the pointer's direction.
TEST(SlottedScrew, MovesAsItsTrigonometrySays) {
  const Mechanism m = LoadModelOf("slotted_screw");
  Motion motion;
  motion.duration_s = 2.0;
  motion.sample_s = 0.05;
  motion.commands = {Commanded("motor", Coordinate::Kind::kDrive, 0, 0,
                               Profile{{SineTerm{3.2, 1.0, 0}, ConstantTerm{1.2}}})};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double crank = 0.05, distance = 0.12, lead = 0.06, arm = 0.09;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double q = At(run.trace, i, "motor.position");
    const double lever = std::atan2(crank * std::sin(q), distance + crank * std::cos(q));
    const double height = 0.02 + lead * (1.0 - lever / (2 * std::numbers::pi));
    EXPECT_NEAR(At(run.trace, i, "lever.yaw"), lever, 1e-13);
    EXPECT_NEAR(At(run.trace, i, "nut.z"), height, 1e-13);
    EXPECT_NEAR(At(run.trace, i, "nut.yaw"), 0.0, 1e-13);
    EXPECT_NEAR(At(run.trace, i, "pointer.pitch"), -std::atan2(height - 0.05, 0.3), 1e-13);
    EXPECT_NEAR(At(run.trace, i, "nut.y") + arm, arm, 1e-13);
  }
}

}  // namespace
}  // namespace mbv::fixtures
