// Damping, armature, dry friction, springs and ranges of MJCF's ball and free joints: import,
// reference and MuJoCo against Newton and Euler by hand.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "math/spatial.h"
#include "mechanism/spanning_tree.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"
#include "simulation/engine/simulation.h"
#include "tests/reference/fixture.h"
#include "tests/support/test_folder.h"
#include "verify/model_text.h"
#include "verify/ranges.h"

namespace mbv {
namespace {

// What the joint of the plate exerts.
struct Laws {
  double damping = 0.3, armature = 0.05, friction = 0.2, stiffness = 1.7;
};

constexpr double kMass = 1.5;
const Vec3 kCentre(0.02, -0.03, 0.05), kMoments(0.03, 0.02, 0.04), kAnchor(0.02, 0.01, -0.1);
const std::array kFrom = {Vec3(0.4, 0, 0.1), Vec3(-0.2, 0.35, 0.1), Vec3(-0.2, -0.35, 0.1)};
const std::array kTo = {Vec3(0.1, 0.28, 0), Vec3(-0.3, -0.05, 0), Vec3(0.19, -0.23, 0)};

// A turntable that carries a plate on a ball, which three legs turn (`free` false); or an arm to
// which a plate on a free joint is connected, with legs from the arm.
std::string Plate(const Laws& laws, bool free) {
  const auto three = [](const Vec3& p) { return fmt::format("{} {} {}", p.x(), p.y(), p.z()); };
  std::string from, to, tendons, motors;
  for (size_t k = 0; k < 3; ++k) {
    from += fmt::format(R"(<site name="a{}" pos="{}"/>)", k, three(kFrom[k]));
    to += fmt::format(R"(<site name="b{}" pos="{}"/>)", k, three(kTo[k]));
    tendons += fmt::format(
        R"(<spatial name="leg{0}"><site site="a{0}"/><site site="b{0}"/></spatial>)", k);
    motors += fmt::format(R"(<motor name="leg{0}" tendon="leg{0}"/>)", k);
  }
  const std::string joint = fmt::format(
      R"(<joint name="round" type="{}" damping="{}" armature="{}" frictionloss="{}" stiffness="{}"/>)",
      free ? "free" : fmt::format(R"(ball" pos="{})", three(kAnchor)), laws.damping, laws.armature,
      laws.friction, laws.stiffness);
  const std::string plate = fmt::format(
      R"(<body name="plate" pos="0.05 0 0.5" euler="0.1 -0.2 0.3">{}<inertial pos="{}" mass="{}" diaginertia="{}"/>{}</body>)",
      joint, three(kCentre), kMass, three(kMoments), to);
  return R"(<mujoco model="plate"><compiler angle="radian"/><worldbody>
<body name="table"><joint name="turn" axis="0 0.6 0.8"/>
<inertial pos="0 0.1 0" mass="2" diaginertia="0.1 0.1 0.1"/>)" +
         from + (free ? "</body>" + plate : plate + "</body>") + "</worldbody>" +
         (free
              ? fmt::format(
                    R"(<equality><connect name="hook" body1="plate" body2="table" anchor="{}"/></equality>)",
                    three(kAnchor))
              : "") +
         "<tendon>" + tendons + R"(</tendon><actuator><motor name="turn" joint="turn"/>)" + motors +
         "</actuator></mujoco>\n";
}

Mechanism Loaded(const Laws& laws, bool free) {
  const test::TestFolder folder("round_joints");
  LoadResult loaded = LoadRobot(folder.Write("plate.xml", Plate(laws, free)));
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_TRUE(TextsOf(loaded.caveats, ModelCaveat::Kind::kLeftOut).empty());
  return std::move(*loaded.mechanism);
}

Motion Wobble(const Mechanism& m) {
  std::vector<Profile> profiles = {{{SineTerm{0.7, 0.9, 0.4}}}};
  for (size_t k = 0; k < 3; ++k) {
    const auto& leg = std::get<DistanceDrive>(m.drives[k + 1].kind);
    const Vec3 from = m.X_WB_home[static_cast<size_t>(leg.body_from)] * leg.p_from;
    const Vec3 to = m.X_WB_home[static_cast<size_t>(leg.body_to)] * leg.p_to;
    const double home = (to - from).norm(), phase = 0.3 + static_cast<double>(k);
    profiles.push_back({{ConstantTerm{home - 0.03 * std::sin(phase)},
                         SineTerm{0.03, 0.8 + 0.3 * static_cast<double>(k), phase}}});
  }
  return fixtures::DriveMotion(m, profiles, 1.0, 0.02);
}

// Largest difference, over the largest moment, between what the legs' moments about the ball's or
// the connection's centre are and what the plate needs by hand.
// `R_PM`: axes about which friction is limited.
double ErrorByHand(const Mechanism& m, const Laws& laws, bool free,
                   const Mat3& R_PM = Mat3::Identity()) {
  const Motion motion = Wobble(m);
  ReferenceSolver solver(m, motion);
  ReferenceSample sample;
  const auto plate = static_cast<size_t>(m.FindBody("plate"));
  const auto table = static_cast<size_t>(m.FindBody("table"));
  double error = 0.0, size = 0.0;
  for (int i = 0; i <= 50; ++i) {
    const double t = 0.02 * i;
    CommandSample command;
    EvaluateMotion(motion, t, &command);
    const RunSummary summary = solver.Dynamics(command, &sample);
    EXPECT_TRUE(summary.ok()) << summary.message;
    if (!summary.ok()) return kNan;
    const Pose &X_P = sample.states.X_WB[plate], &X_T = sample.states.X_WB[table];
    const Mat3 R = X_P.linear();
    const Vec3 w = sample.states.V_WB[plate].head<3>(), e = sample.states.A_WB[plate].head<3>();
    const Vec3 v_O = sample.states.V_WB[plate].tail<3>(), a_O = sample.states.A_WB[plate].tail<3>();
    // The joint's inboard side: the table, or the world.
    const Vec3 w_T = free ? Vec3::Zero() : Vec3(sample.states.V_WB[table].head<3>());
    const Vec3 e_T = free ? Vec3::Zero() : Vec3(sample.states.A_WB[table].head<3>());
    const Vec3 p = X_P * kAnchor, c = X_P * kCentre;
    Vec3 by_legs = Vec3::Zero();
    for (size_t k = 0; k < 3; ++k) {
      const Vec3 to = X_P * kTo[k], from = X_T * kFrom[k];
      by_legs += (to - p).cross(sample.drive_force[static_cast<Eigen::Index>(k) + 1] *
                                (to - from).normalized());
    }
    // Euler's equation about the centre of mass, and its moment about p.
    const Vec3 a_c = a_O + e.cross(c - X_P.translation()) + w.cross(w.cross(c - X_P.translation()));
    const Mat3 I = R * kMoments.asDiagonal() * R.transpose();
    Vec3 needed = I * e + w.cross(I * w) + (c - p).cross(kMass * (a_c - m.gravity_W));
    // The joint: in MuJoCo's coordinates, which are the plate's angular velocity in its own axes …
    const Mat3 R_home = free ? Mat3(m.X_WB_home[plate].linear())
                             : Mat3(X_T.linear() * m.X_WB_home[table].linear().transpose() *
                                    m.X_WB_home[plate].linear());
    const Vec3 rate = R.transpose() * (w - w_T),
               rate_rate = R.transpose() * (e - e_T + w.cross(w_T));
    const Vec3 sign = R_PM * (R_PM.transpose() * rate).cwiseSign();
    needed += R * (laws.damping * rate + laws.armature * rate_rate + laws.friction * sign) +
              laws.stiffness * R_home * LogRotation(R_home.transpose() * R);
    // … and of a free joint its origin's velocity in the world's axes.
    if (free) {
      const Vec3 away = X_P.translation() - m.X_WB_home[plate].translation();
      needed += (X_P.translation() - p)
                    .cross(laws.damping * v_O + laws.armature * a_O +
                           laws.friction * v_O.cwiseSign() + laws.stiffness * away);
    }
    // Where a rate passes through zero within a sample its sign is not known.
    error = std::max(error, (by_legs - needed).norm());
    size = std::max(size, needed.norm());
  }
  return error / size;
}

TEST(RoundJoints, LegForcesAreThoseByHand) {
  for (const bool free : {false, true}) {
    const Laws laws;
    const Mechanism m = Loaded(laws, free);
    EXPECT_LT(ErrorByHand(m, laws, free), 1e-11) << free;
    for (double Laws::*number :
         {&Laws::damping, &Laws::armature, &Laws::friction, &Laws::stiffness}) {
      Laws perturbed = laws;
      perturbed.*number *= 1.0 + 1e-6;
      EXPECT_GT(ErrorByHand(m, perturbed, free), 1e-10) << free;
    }
  }
}

TEST(RoundJoints, TheReferenceBalancesPowerAndHasNoReactionInTheBall) {
  const Mechanism m = Loaded({}, false);
  const ReferenceRun run = RunReference(m, Wobble(m));
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const VecX in = fixtures::ColumnOf(run.trace, "power.input");
  EXPECT_LT((in - fixtures::ColumnOf(run.trace, "power.energy_rate")).cwiseAbs().maxCoeff(),
            1e-12 * in.cwiseAbs().maxCoeff());
  for (const char* moment : {"round.reaction.mx", "round.reaction.my", "round.reaction.mz"}) {
    EXPECT_LT(fixtures::ColumnOf(run.trace, moment).cwiseAbs().maxCoeff(), 1e-11) << moment;
  }
}

// Largest difference of drive forces and of the ball's reactions, of the largest.
double Difference(const Trace& a, const Trace& b, const Mechanism& m) {
  double error = 0.0, size = 0.0;
  std::vector<std::string> channels;
  for (const Drive& drive : m.drives) channels.push_back(drive.name + ".force");
  for (const char* component : {"fx", "fy", "fz", "mx", "my", "mz"}) {
    channels.push_back(fmt::format("round.reaction.{}", component));
  }
  for (const std::string& channel : channels) {
    if (a.Find(channel) < 0) continue;
    const VecX x = fixtures::ColumnOf(a, channel), y = fixtures::ColumnOf(b, channel);
    error = std::max(error, (x - y).cwiseAbs().maxCoeff());
    size = std::max(size, x.cwiseAbs().maxCoeff());
  }
  return error / size;
}

DrivenMotion Following(const Motion& motion) {
  return [motion](double t, DrivenSample* driven) {
    CommandSample command;
    EvaluateMotion(motion, t, &command);
    *driven = {command.position, command.velocity, command.acceleration};
    return RunSummary::Done();
  };
}

TEST(RoundJoints, MuJoCoFindsTheSameForces) {
  for (const bool free : {false, true}) {
    Laws smooth;
    smooth.friction = 0.0;  // which jumps within a step
    for (const Laws& laws : {Laws{}, smooth}) {
      const Mechanism m = Loaded(laws, free);
      const Motion motion = Wobble(m);
      const ReferenceRun reference = RunReference(m, motion);
      ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
      const auto run = [&](const Mechanism& of, DriveMode mode) {
        return Simulate(of, motion, Following(motion), {.mode = mode});
      };
      const SimulationRun inverse = run(m, DriveMode::kInverse);
      ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
      EXPECT_LT(Difference(reference.trace, inverse.trace, m), 1e-10) << free;
      for (double Laws::*number :
           {&Laws::damping, &Laws::armature, &Laws::friction, &Laws::stiffness}) {
        if (laws.*number == 0.0) continue;
        Laws perturbed = laws;
        perturbed.*number *= 1.0 + 1e-6;
        const Mechanism other = Loaded(perturbed, free);
        EXPECT_GT(Difference(reference.trace, run(other, DriveMode::kInverse).trace, m), 1e-9);
      }
      if (laws.friction > 0.0) continue;
      const SimulationRun forward = run(m, DriveMode::kPrescribedMotion);
      ASSERT_TRUE(forward.summary.ok()) << forward.summary.message;
      EXPECT_LT(Difference(reference.trace, forward.trace, m), 1e-5) << free;
    }
  }
}

// Friction is limited about the axes of the joint's frame on its child, whichever body that is.
TEST(RoundJoints, FrictionIsAboutTheAxesOfTheChildsFrame) {
  const Mat3 R = RotRpy({0.5, -0.8, 1.1});
  const Mechanism straight = Loaded({}, false);
  const Motion motion = Wobble(straight);
  const Trace of_straight = RunReference(straight, motion).trace;
  for (const bool reversed : {false, true}) {
    Mechanism m = straight;
    Joint& ball = m.joints[static_cast<size_t>(m.FindJoint("round"))];
    ball.X_PF.linear() *= R;
    ball.X_CM.linear() *= R;
    if (!reversed) {
      EXPECT_LT(ErrorByHand(m, {}, false, R), 1e-11);
    } else {
      std::swap(ball.parent, ball.child);
      std::swap(ball.X_PF, ball.X_CM);
      ASSERT_TRUE(BuildSpanningTree(&m).ok());
    }
    const ReferenceRun reference = RunReference(m, motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    const SimulationRun run = Simulate(m, motion, Following(motion), {.mode = DriveMode::kInverse});
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    EXPECT_LT(Difference(reference.trace, run.trace, m), 1e-10) << reversed;
    EXPECT_GT(Difference(of_straight, run.trace, m), 1e-3) << reversed;
    const SimulationRun forward =
        Simulate(m, motion, Following(motion), {.mode = DriveMode::kPrescribedMotion});
    ASSERT_TRUE(forward.summary.ok()) << forward.summary.message;
    // It jumps within a step.
    EXPECT_LT(Difference(reference.trace, forward.trace, m), 0.2) << reversed;
  }
}

TEST(RoundJoints, TheWrittenModelIsTheSame) {
  for (const bool free : {false, true}) {
    const Mechanism m = Loaded({}, free);
    const LoadResult again = LoadModelText(WriteModel(m), "plate.yaml");
    ASSERT_TRUE(again.mechanism) << again.diagnostics.Text();
    ASSERT_EQ(again.mechanism->elements.size(), m.elements.size());
    const auto forces = [](const Mechanism& of) { return RunReference(of, Wobble(of)).trace; };
    EXPECT_LT(Difference(forces(m), forces(*again.mechanism), m), 1e-12);
  }
}

// A ball with forces is a closure beside a free joint there.
TEST(RoundJoints, TheUrdfFileWithItsCompanionIsTheSame) {
  for (const bool free : {false, true}) {
    const test::TestFolder folder("round_joints_urdf");
    const Mechanism m = Loaded({}, free);
    const std::string file = folder.Write("plate.urdf", WriteUrdf(m));
    folder.Write("plate.mbverify.yaml", WriteUrdfCompanion(m, "plate.urdf"));
    const LoadResult again = LoadRobot(file);
    ASSERT_TRUE(again.mechanism) << again.diagnostics.Text();
    EXPECT_EQ(again.mechanism->elements.size(), m.elements.size());
    const auto forces = [](const Mechanism& of) { return RunReference(of, Wobble(of)).trace; };
    const Trace a = forces(m), b = forces(*again.mechanism);
    for (const Drive& drive : m.drives) {
      const VecX truth = fixtures::ColumnOf(a, drive.name + ".force");
      EXPECT_LT((fixtures::ColumnOf(b, drive.name + ".force") - truth).cwiseAbs().maxCoeff(),
                1e-9 * truth.cwiseAbs().maxCoeff())
          << drive.name;
    }
  }
}

TEST(RoundJoints, TheRangeOfABallIsALargestRotation) {
  const test::TestFolder folder("ball_range");
  std::string text = Plate({}, false);
  const std::string ball = R"(type="ball")";
  text.insert(text.find(ball) + ball.size(), R"( limited="true" range="0 0.4" margin="0.01")");
  const LoadResult loaded = LoadRobot(folder.Write("plate.xml", text));
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const Joint& joint = m.joints[static_cast<size_t>(m.FindJoint("round"))];
  EXPECT_DOUBLE_EQ(joint.max_rotation, 0.39);
  ASSERT_TRUE(HasRanges(m));
  // Turned by a little less and a little more about any axis.
  for (const Vec3& axis : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0.48, 0.6, 0.64)}) {
    for (const double beyond : {-1e-6, 1e-6}) {
      std::vector<Pose> X_WB = m.X_WB_home;
      const auto child = static_cast<size_t>(joint.child);
      X_WB[child].linear() *= Eigen::AngleAxisd(0.39 + beyond, axis).toRotationMatrix();
      const auto found = JointViolations(m, {0.0}, {X_WB});
      ASSERT_EQ(found.size(), beyond > 0.0 ? 1u : 0u);
      EXPECT_EQ(IsWithinRanges(m, X_WB), beyond < 0.0);
      if (!found.empty()) {
        EXPECT_NEAR(found[0].amount, 1e-6, 1e-12);
      }
    }
  }
  const LoadResult again = LoadModelText(WriteModel(m), "plate.yaml");
  ASSERT_TRUE(again.mechanism) << again.diagnostics.Text();
  EXPECT_EQ(again.mechanism->joints[static_cast<size_t>(m.FindJoint("round"))].max_rotation, 0.39);
}

}  // namespace
}  // namespace mbv
