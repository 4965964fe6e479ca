// Trees that are too deep for MuJoCo's dense inertia and for its XML reader: they are cut, and
// nothing but the layout of MuJoCo's bodies shows it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "mechanism/spanning_tree.h"
#include "reference/forward.h"
#include "reference/reference.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/plan.h"
#include "tests/mechanisms/loop_shapes.h"

namespace mbv {
namespace {

constexpr int kWhole = 32;  // bodies that nest and stay one tree

int Deepest(const mjcf::Plan& plan) {
  std::vector<int> depth(plan.bodies.size(), 0);
  for (size_t b = 1; b < plan.bodies.size(); ++b) {
    depth[b] = depth[static_cast<size_t>(plan.bodies[b].parent)] + 1;
  }
  return *std::ranges::max_element(depth);
}

// Tree joints that are closed like loops.
std::vector<int> CutJoints(const Mechanism& mechanism, const mjcf::Plan& plan) {
  std::vector<int> cut;
  for (const mjcf::PlannedClosure& closure : plan.closures) {
    if (!mechanism.joints[static_cast<size_t>(closure.joint)].closure) cut.push_back(closure.joint);
  }
  return cut;
}

// An arm of joints of all kinds that a drive can move; `more` are elements.
std::string ArmText(int links, bool driven, const std::string& more = "") {
  const char* kinds[] = {"kind: revolute, axis: z",  "kind: revolute, axis: y",
                         "kind: prismatic, axis: x", "kind: universal, axis: y, axis2: z",
                         "kind: revolute, axis: x",  "kind: cylindrical, axis: x",
                         "kind: revolute, axis: y"};
  std::string bodies, joints, drives;
  const auto drive = [&](int i, int coordinate) {
    if (!driven) return;
    drives +=
        fmt::format("  m{0}_{1}: {{kind: joint, joint: J{0}, coordinate: {1}}}\n", i, coordinate);
  };
  for (int i = 0; i < links; ++i) {
    const char* kind = kinds[i % 7];
    const bool two = i % 7 == 3 || i % 7 == 5;
    // Every fifth joint is stated from the other side.
    const std::string inner = i == 0 ? "world" : fmt::format("link{}.high", i - 1);
    const std::string outer = fmt::format("link{}", i);
    const bool back = i % 5 == 4;
    bodies += fmt::format(
        "  link{0}: {{mass: {1}, com: [0.05, 0.01, {2}], inertia: [1e-4, 4e-4, 3e-4], frames: "
        "{{high: [0.1, 0, 0]}}}}\n",
        i, 0.3 + 0.01 * (i % 4), 0.004 * (i % 3));
    joints += fmt::format("  J{}: {{{}, parent: {}, child: {}, guess: {}}}\n", i, kind,
                          back ? outer : inner, back ? inner : outer,
                          two          ? "[0.02, 0.03]"
                          : i % 7 == 2 ? "0.01"
                                       : "0.05");
    drive(i, 0);
    if (two) drive(i, 1);
  }
  return fmt::format("name: arm\ngravity: [0, 0, -9.81]\nbodies:\n{}joints:\n{}{}{}{}", bodies,
                     joints, driven ? "drives:\n" : "", drives, more);
}

// Every drive swings at its own pace.
Motion SwingEachDrive(const Mechanism& mechanism, double amplitude) {
  Motion motion = SwingAllDrives(mechanism, amplitude);
  for (size_t k = 0; k < motion.commands.size(); ++k) {
    auto& sine = std::get<SineTerm>(motion.commands[k].profile.terms[1]);
    sine.frequency_hz = 0.5 + 0.1 * static_cast<double>(k % 7);
  }
  return motion;
}

// Of all signals of a quantity that both have, relative to the largest.
double LargestDifference(const Trace& a, const Trace& b, Quantity quantity) {
  double worst = 0.0, largest = 0.0;
  for (size_t c = 0; c < b.channels.size(); ++c) {
    const int other = a.Find(b.channels[c].name);
    if (b.channels[c].quantity != quantity || other < 0) continue;
    const auto column = static_cast<Eigen::Index>(c);
    worst = std::max(worst, (a.values.col(other) - b.values.col(column)).cwiseAbs().maxCoeff());
    largest = std::max(largest, b.values.col(column).cwiseAbs().maxCoeff());
  }
  return largest > 0.0 && std::isfinite(worst) ? worst / largest : kNan;
}

TEST(DeepTrees, AreCutWhereTheyNestDeeperThanATreeThatStaysWhole) {
  for (const int links : {kWhole, kWhole + 1, 60, 300}) {
    const Mechanism arm = MechanismOf(ArmText(links, true));
    const mjcf::Plan plan = mjcf::MakePlan(arm);
    const std::vector<int> cut = CutJoints(arm, plan);
    EXPECT_EQ(cut.empty(), links == kWhole) << links;
    EXPECT_LE(Deepest(plan), kWhole);
    EXPECT_EQ(mjcf::NestingTrouble(plan), "");
    // All joints' coordinates are there once, and the mass is.
    std::vector<std::string> names;
    double mass = 0.0, planned = 0.0;
    for (const mjcf::PlannedBody& body : plan.bodies) {
      planned += body.mass;
      for (const mjcf::PlannedJoint& joint : body.joints) {
        if (joint.joint >= 0) names.push_back(joint.name);
      }
    }
    for (const Body& body : arm.bodies) mass += body.mass;
    EXPECT_NEAR(planned, mass, 1e-12 * mass);
    std::ranges::sort(names);
    EXPECT_TRUE(std::ranges::adjacent_find(names) == names.end());
    EXPECT_EQ(names.size(), arm.drives.size());
  }
}

TEST(DeepTrees, PreferCutsAtJointsThatNothingUses) {
  const Mechanism storeys = MechanismOf(StoreysText(40));
  const mjcf::Plan plan = mjcf::MakePlan(storeys);
  const std::vector<int> cut = CutJoints(storeys, plan);
  EXPECT_FALSE(cut.empty());
  for (const int joint : cut) {
    EXPECT_FALSE(HasUsedCoordinate(storeys, joint))
        << storeys.joints[static_cast<size_t>(joint)].name;
  }
}

// Reactions and drive forces of a tree are unique: those of cut joints among them.
TEST(DeepTrees, HaveTheForcesAndReactionsOfTheReference) {
  const std::string elements =
      "elements:\n"
      "  k12: {kind: spring, joint: J12, stiffness: 4, free: 0.1}\n"
      "  c12: {kind: damping, joint: J12, damping: 0.3}\n"
      "  r24: {kind: rotor, joint: J24, coordinate: 1, inertia: 2e-5, ratio: 10}\n"
      "  f24: {kind: friction, joint: J24, coulomb: 0.2}\n";
  for (const bool with_elements : {false, true}) {
    const Mechanism arm = MechanismOf(ArmText(40, true, with_elements ? elements : ""));
    std::vector<std::string> cut;
    for (const int j : CutJoints(arm, mjcf::MakePlan(arm))) {
      cut.push_back(arm.joints[static_cast<size_t>(j)].name);
    }
    EXPECT_EQ(cut, (std::vector<std::string>{"J12", "J24", "J36"}));  // the elements' among them
    const Motion motion = SwingEachDrive(arm, 0.02);
    const ReferenceRun reference = RunReference(arm, motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    // The corrected engine's fourth order at 1 ms; the inverse mode has round-off alone.
    for (const auto& [mode, budget] :
         {std::pair(DriveMode::kInverse, 1e-9), std::pair(DriveMode::kPrescribedMotion, 1e-6)}) {
      const SimulationRun run = Simulate(arm, motion, FollowCommands(motion), {.mode = mode});
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      for (const Quantity of : {Quantity::kForce, Quantity::kReaction, Quantity::kPosition}) {
        EXPECT_LT(LargestDifference(run.trace, reference.trace, of), budget)
            << with_elements << " " << static_cast<int>(of);
      }
      Mechanism perturbed = arm;
      perturbed.bodies.back().mass *= 1.0 + 100.0 * budget;
      const SimulationRun wrong =
          Simulate(perturbed, motion, FollowCommands(motion), {.mode = mode});
      EXPECT_GT(LargestDifference(wrong.trace, reference.trace, Quantity::kReaction), budget);
    }
  }
}

// Of dampers, a spring and dry friction at all joints but a ball and a fixed one, which are cut as
// such closures are; a ball with dampers is cut as well.
TEST(DeepTrees, MoveByForcesAsTheReferenceDoes) {
  std::string bodies, joints, elements;
  for (int i = 0; i < 40; ++i) {
    bodies += fmt::format(
        "  link{}: {{mass: 0.3, com: [0.05, 0, 0], inertia: [1e-4, 4e-4, 4e-4], frames: {{high: "
        "[0.1, 0, 0]}}}}\n",
        i);
    const std::string kind = i == 7 || i == 27 ? "spherical"
                             : i == 14         ? "fixed"
                                               : fmt::format("revolute, axis: {}", "yz"[i % 2]);
    joints += fmt::format("  J{}: {{kind: {}, parent: {}, child: link{}}}\n", i, kind,
                          i == 0 ? "world" : fmt::format("link{}.high", i - 1), i);
    if (i == 7 || i == 14) continue;
    elements += i == 27
                    ? "  c27: {kind: damping, joint: J27, coordinate: rotation, damping: 0.05}\n"
                    : fmt::format("  c{0}: {{kind: damping, joint: J{0}, damping: 0.05}}\n", i);
  }
  elements += "  k26: {kind: spring, joint: J26, stiffness: 2}\n";
  elements += "  f30: {kind: friction, joint: J30, coulomb: 0.01}\n";
  Mechanism chain = MechanismOf("name: chain\ngravity: [0, 0, -9.81]\nbodies:\n" + bodies +
                                "joints:\n" + joints + "elements:\n" + elements);
  const mjcf::Plan plan = mjcf::MakePlan(chain);
  std::vector<mjcf::PlannedClosure::Type> types;
  for (const mjcf::PlannedClosure& closure : plan.closures) types.push_back(closure.type);
  using Type = mjcf::PlannedClosure::Type;
  EXPECT_EQ(types, (std::vector{Type::kConnect, Type::kWeld, Type::kSplit, Type::kSplit}));
  Motion motion;
  motion.duration_s = 0.1;
  motion.sample_s = 0.01;
  for (int j = 0; j < 40; ++j) {
    const Joint& joint = chain.joints[static_cast<size_t>(j)];
    if (joint.kind != JointKind::kRevolute) continue;
    motion.initial.push_back({.name = joint.name,
                              .coordinate = {Coordinate::Kind::kJoint, j, 0},
                              .position = 0.02 * (j % 3),
                              .rate = 0.1 * (j % 2)});
  }
  for (const int ball : {7, 27}) {  // its turn is that of what it carries
    chain.outputs.push_back({.name = fmt::format("turn{}", ball),
                             .body = ball + 1,
                             .X_BO = Pose::Identity(),
                             .reference_body = ball,
                             .X_RbR = Pose::Identity()});
    const int output = static_cast<int>(chain.outputs.size()) - 1;
    for (int component = 3; component < 6; ++component) {
      motion.initial.push_back({.name = "turn",
                                .coordinate = {Coordinate::Kind::kOutput, output, component},
                                .position = 0.01 * component,
                                .rate = 0.2});
    }
  }
  const ForwardRun reference = RunForwardReference(chain, motion, {.measure_trust = false});
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  SimulationOptions options{.step_s = 2.5e-4};
  const RunSummary start = InitialStates(chain, motion, &options.start);
  ASSERT_TRUE(start.ok()) << start.message;
  const auto none = [](double /*t*/, DrivenSample* at) {
    at->position = at->velocity = at->acceleration = VecX::Zero(0);
    return RunSummary::Done();
  };
  const auto worst = [&](const SimulationRun& run) {
    return LargestDifference(run.trace, reference.trace, Quantity::kReaction);
  };
  const SimulationRun run = Simulate(chain, motion, none, options);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  constexpr double kIntegrated = 1e-8;  // fourth order
  EXPECT_LT(worst(run), kIntegrated);
  Mechanism perturbed = chain;
  std::get<DampingLaw>(perturbed.elements[8].law).damping *= 1.001;
  EXPECT_GT(worst(Simulate(perturbed, motion, none, options)), kIntegrated);
}

TEST(DeepTrees, OfLoopsAgreeWithTheReference) {
  const std::pair<std::string, double> shapes[] = {
      {ScissorLiftText(40), 0.1}, {StoreysText(20), 0.1}, {LongLoopText(80), 0.002}};
  for (const auto& [text, amplitude] : shapes) {
    const Mechanism mechanism = MechanismOf(text);
    EXPECT_FALSE(CutJoints(mechanism, mjcf::MakePlan(mechanism)).empty()) << mechanism.name;
    Motion motion = SwingAllDrives(mechanism, amplitude);
    motion.duration_s = 0.05;
    const ReferenceRun reference = RunReference(mechanism, motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    for (const auto& [mode, budget] :
         {std::pair(DriveMode::kInverse, 1e-8), std::pair(DriveMode::kPrescribedMotion, 1e-6)}) {
      const SimulationRun run = Simulate(mechanism, motion, FollowCommands(motion), {.mode = mode});
      ASSERT_TRUE(run.summary.ok()) << mechanism.name << ": " << run.summary.message;
      EXPECT_LT(LargestDifference(run.trace, reference.trace, Quantity::kForce), budget)
          << mechanism.name;
      Mechanism perturbed = mechanism;
      for (Body& body : perturbed.bodies) body.mass *= 1.0 + 10.0 * budget;
      const SimulationRun wrong =
          Simulate(perturbed, motion, FollowCommands(motion), {.mode = mode});
      EXPECT_GT(LargestDifference(wrong.trace, reference.trace, Quantity::kForce), budget);
    }
  }
}

}  // namespace
}  // namespace mbv
