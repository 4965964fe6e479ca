// A force that carries a share of a body's weight, in the reference and in MuJoCo.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "mechanism/spanning_tree.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "reference/forward.h"
#include "reference/reference.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/mjcf.h"

namespace mbv {
namespace {

Mechanism LoadedText(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism{});
}

// A slide that lifts a hinge with two more bodies beyond it, whose end slides on a plane.
// `reversed`: the joint of the arm is stated from the arm to the cart, as the child.
struct Lifted {
  bool slide_exerts = false, hinge_exerts = false, reversed = false;
  double cart = 0.3, arm = 0.6, hand = 1.2;

  [[nodiscard]] Mechanism Make() const {
    const char* exerts = ", gravity_compensation: true";
    return LoadedText(fmt::format(
        R"(
name: lifted
gravity: [1.5, 0.4, -9.5]
world: {{frames: {{table: [0.6, 0, -0.1]}}}}
bodies:
  cart: {{mass: 3, com: [0.1, 0, 0.05], inertia: [0.1, 0.1, 0.1], gravity_compensation: {}}}
  arm:
    mass: 2
    com: [0.2, 0.03, 0.01]
    inertia: [0.01, 0.05, 0.05]
    gravity_compensation: {}
    frames: {{end: [0.4, 0, 0]}}
  hand:
    mass: 1
    com: [0.1, 0, 0]
    inertia: [0.01, 0.02, 0.02]
    gravity_compensation: {}
    frames: {{end: [0.3, 0, 0]}}
joints:
  slide: {{kind: prismatic, parent: world, child: cart, axis: [0.1, 0, 1], closure: false}}
  hinge: {{kind: revolute, parent: {}, child: {}, axis: y, closure: false, guess: {}}}
  wrist: {{kind: revolute, parent: arm.end, child: hand, axis: y, closure: false, guess: 0.3}}
  end: {{kind: point_on_plane, parent: world.table, child: hand.end, axis: z, closure: true}}
drives:
  lift: {{kind: joint, joint: slide{}}}
  turn: {{kind: joint, joint: hinge{}}}
)",
        cart, arm, hand, reversed ? "arm" : "cart", reversed ? "cart" : "arm",
        reversed ? 0.2 : -0.2, slide_exerts ? exerts : "", hinge_exerts ? exerts : ""));
  }
};

// Both drives swing about home.
Motion Swung(const Mechanism& m) {
  Motion motion{.duration_s = 1.0, .sample_s = 0.05, .commands = {}, .loads = {}};
  for (int d = 0; d < 2; ++d) {
    const auto& on = std::get<JointDrive>(m.drives[static_cast<size_t>(d)].kind);
    const double home = m.joints[static_cast<size_t>(on.joint)].home[0];
    motion.commands.push_back(
        {.name = m.drives[static_cast<size_t>(d)].name,
         .terms = {{.coordinate = {Coordinate::Kind::kDrive, d, 0}}},
         .profile = {{ConstantTerm{home}, SineTerm{d == 0 ? 0.03 : 0.2, 0.8, 0.0}}}});
  }
  return motion;
}

SimulationRun SimulatedLift(const Mechanism& m, DriveMode mode,
                            Engine engine = Engine::kCorrected) {
  const Motion motion = Swung(m);
  const auto driven = [&](double t_s, DrivenSample* at) {
    CommandSample command;
    EvaluateMotion(motion, t_s, &command);
    *at = {command.position, command.velocity, command.acceleration};
    return RunSummary::Done();
  };
  return Simulate(m, motion, driven, {.mode = mode, .engine = engine});
}

double RelativeGap(const Trace& a, const Trace& b, const std::string& channel) {
  const VecX x = a.values.col(a.Find(channel)), y = b.values.col(b.Find(channel));
  return (x - y).cwiseAbs().maxCoeff() / (1.0 + y.cwiseAbs().maxCoeff());
}

const char* const kForces[] = {"lift.force",        "turn.force",        "slide.reaction.fx",
                               "slide.reaction.my", "hinge.reaction.fx", "hinge.reaction.fz",
                               "hinge.reaction.my", "wrist.reaction.fz", "end.reaction.fz",
                               "power.loads",       "power.input",       "power.energy_rate"};

TEST(GravityCompensation, ActsAlikeInReferenceAndSimulation) {
  for (int which = 0; which < 8; ++which) {
    const Lifted lifted{(which & 1) != 0, (which & 2) != 0, (which & 4) != 0};
    const Mechanism m = lifted.Make();
    const ReferenceRun truth = RunReference(m, Swung(m));
    ASSERT_TRUE(truth.summary.ok()) << truth.summary.message;
    const SimulationRun inverse = SimulatedLift(m, DriveMode::kInverse);
    const SimulationRun forward = SimulatedLift(m, DriveMode::kPrescribedMotion);
    ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
    ASSERT_TRUE(forward.summary.ok()) << forward.summary.message;
    for (const char* channel : kForces) {
      EXPECT_LT(RelativeGap(inverse.trace, truth.trace, channel), 1e-11) << which << " " << channel;
      EXPECT_LT(RelativeGap(forward.trace, truth.trace, channel), 1e-6) << which << " " << channel;
    }
    // A share of 1 % more is seen.
    Lifted wrong = lifted;
    wrong.arm *= 1.01;
    const SimulationRun other = SimulatedLift(wrong.Make(), DriveMode::kInverse);
    EXPECT_GT(RelativeGap(other.trace, truth.trace, "hinge.reaction.fz"), 1e-4);
  }
}

// By principle: without masses' other forces a drive holds what is left of the weight, and one that
// exerts the compensation of the bodies beyond holds all of it.
TEST(GravityCompensation, LeavesTheRestOfTheWeightToADrive) {
  for (const bool exerts : {false, true}) {
    const Mechanism m = LoadedText(fmt::format(
        "name: held\nbodies:\n  arm: {{mass: 2, com: [0.3, 0, 0], inertia: [0.1, 0.1, 0.1], "
        "gravity_compensation: 0.75}}\njoints:\n  hinge: {{kind: revolute, parent: world, child: "
        "arm, axis: y}}\ndrives:\n  turn: {{kind: joint, joint: hinge{}}}\n",
        exerts ? ", gravity_compensation: true" : ""));
    Motion still{.duration_s = 0.1, .sample_s = 0.05, .commands = {}, .loads = {}};
    still.commands.push_back({.name = "turn",
                              .terms = {{.coordinate = {Coordinate::Kind::kDrive, 0, 0}}},
                              .profile = {{ConstantTerm{0.0}}}});
    const ReferenceRun run = RunReference(m, still);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    const double needed = -2 * 9.81 * 0.3 * (exerts ? 1.0 : 0.25);
    EXPECT_NEAR(run.trace.values(0, run.trace.Find("turn.force")), needed, 1e-12);
    // The joint carries the rest, whoever exerts the force.
    EXPECT_NEAR(run.trace.values(0, run.trace.Find("hinge.reaction.fz")), 2 * 9.81 * 0.25, 1e-12);
  }
}

// Beyond a joint: what its child carries, wherever the world holds the tree.
TEST(GravityCompensation, CountsTheBodiesBeyondAJoint) {
  for (const bool reversed : {false, true}) {
    const Mechanism m = Lifted{.reversed = reversed}.Make();
    const auto names = [&](const char* joint) {
      std::string text;
      for (const int b : BodiesBeyond(m, m.FindJoint(joint))) {
        text += m.bodies[static_cast<size_t>(b)].name + " ";
      }
      return text;
    };
    EXPECT_EQ(names("slide"), "cart arm hand ");
    EXPECT_EQ(names("hinge"), reversed ? "cart " : "arm hand ");
    EXPECT_EQ(names("wrist"), "hand ");
  }
}

// As a falling body with a part of its weight; MuJoCo's own step, too.
TEST(GravityCompensation, LetsABodyFallMoreSlowly) {
  const Mechanism m = LoadedText(
      "name: falls\nbodies:\n  box: {mass: 2, com: [0.1, 0, 0.2], inertia: [0.1, 0.1, 0.1], "
      "gravity_compensation: 0.75}\njoints:\n  slide: {kind: prismatic, parent: world, child: box, "
      "axis: z}\ndrives:\n  lift: {kind: joint, joint: slide}\n");
  Motion motion{.duration_s = 1.0, .sample_s = 0.1, .commands = {}, .loads = {}};
  motion.forces.push_back({.drive = 0, .force = {{ConstantTerm{0.0}}}});
  motion.initial.push_back({.name = "lift",
                            .coordinate = {Coordinate::Kind::kDrive, 0, 0},
                            .position = 0.0,
                            .rate = 0.0});
  SimulationOptions options;
  ASSERT_TRUE(InitialStates(m, motion, &options.start).ok());
  const auto nothing = [](double, DrivenSample* at) {
    at->position = at->velocity = at->acceleration = VecX::Zero(1);
    return RunSummary::Done();
  };
  const SimulationRun run = Simulate(m, motion, nothing, options);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const Eigen::Index last = run.trace.values.rows() - 1;
  EXPECT_NEAR(run.trace.values(last, run.trace.Find("lift.position")), -0.5 * 9.81 * 0.25, 1e-9);
}

TEST(GravityCompensation, IsWrittenAndReadBack) {
  const Mechanism m = Lifted{.hinge_exerts = true}.Make();
  const Mechanism again = LoadedText(WriteModel(m));
  EXPECT_EQ(again.bodies[2].gravity_compensation, 0.6);
  EXPECT_FALSE(again.drives[0].compensates_gravity);
  EXPECT_TRUE(again.drives[1].compensates_gravity);
  EXPECT_NE(WriteMjcf(m).find("arm: a force carries 0.6 of its weight"), std::string::npos);
}

TEST(GravityCompensation, OfADriveNeedsAnAxisAndBodiesBeyond) {
  const auto trouble = [](const std::string& kind, const std::string& more) {
    return LoadModelText(
               "name: m\nbodies:\n  arm: {mass: 1, inertia: [1, 1, 1]}\njoints:\n  j: "
               "{kind: " +
                   kind + ", parent: world, child: arm}\n" + more +
                   "drives:\n  d: {kind: joint, joint: j, gravity_compensation: true}\n",
               "m.yaml")
        .diagnostics.Text();
  };
  EXPECT_NE(trouble("cylindrical, axis: z", "").find("needs a revolute or prismatic one"),
            std::string::npos);
  EXPECT_NE(trouble("revolute, axis: z, closure: true",
                    "  k: {kind: revolute, parent: world, child: arm, axis: z, closure: false}\n")
                .find("joint 'j' closes a loop"),
            std::string::npos);
  EXPECT_EQ(trouble("revolute, axis: z", ""), "");
}

}  // namespace
}  // namespace mbv
