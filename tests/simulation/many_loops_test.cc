// Mechanisms with many loops, whose equations are factored sparse: both witnesses against each
// other and against what dense matrices give.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <numbers>
#include <numeric>
#include <utility>

#include "kinematics/mobility.h"
#include "mechanism/reach.h"
#include "reference/force_solver.h"
#include "reference/reference.h"
#include "simulation/engine/simulation.h"
#include "simulation/mjcf/plan.h"
#include "tests/mechanisms/four_bar_chain.h"
#include "tests/mechanisms/loop_shapes.h"

namespace mbv {
namespace {

// Of the motor's torque, relative to its largest.
double WorstDifference(const Trace& a, const Trace& b) {
  const auto column = [](const Trace& trace) -> VecX {
    return trace.values.col(trace.Find("motor.force"));
  };
  return (column(a) - column(b)).cwiseAbs().maxCoeff() / column(b).cwiseAbs().maxCoeff();
}

// A net of n × n parallelograms: long bars from the ground, pinned to long bars along it. One
// DOF, and many redundant constraints in the plane, too.
Mechanism Net(int n, double guess_deg) {
  const auto at = [](int i) { return 0.2 * i + 0.01 * (i * i % 3); };
  std::string world, bodies, joints, on_posts, on_beams;
  for (int i = 0; i <= n; ++i) {
    world += fmt::format("    G{}: [{}, 0, 0]\n", i, at(i));
    on_beams += fmt::format("{}P{}: [{}, 0, 0]", i == 0 ? "" : ", ", i, at(i));
    if (i > 0) on_posts += fmt::format("{}P{}: [{}, 0, 0]", i == 1 ? "" : ", ", i, at(i));
  }
  const auto bar = [](const std::string& name, const std::string& frames) {
    return fmt::format(
        "  {}: {{mass: 0.6, com: [0.4, 0, 0], inertia: [2e-5, 1.3e-2, 1.3e-2], frames: {{{}}}}}\n",
        name, frames);
  };
  for (int i = 0; i <= n; ++i) {
    bodies += bar(fmt::format("post{}", i), on_posts);
    joints += fmt::format(
        "  D{0}: {{kind: revolute, parent: world.G{0}, child: post{0}, axis: z, guess_deg: {1}}}\n",
        i, guess_deg);
    if (i > 0) bodies += bar(fmt::format("beam{}", i), on_beams);
    for (int j = 1; j <= n; ++j) {
      joints += fmt::format(
          "  J{0}{1}: {{kind: revolute, parent: post{0}.P{1}, child: beam{1}.P{0}, axis: z, "
          "guess_deg: {2}}}\n",
          i, j, -guess_deg);
    }
  }
  LoadResult loaded = LoadModelText(
      fmt::format("name: net{}\ngravity: [0, -9.81, 0]\nworld:\n  frames:\n{}bodies:\n{}joints:\n"
                  "{}drives: {{motor: {{kind: joint, joint: D0}}}}\n",
                  n, world, bodies, joints),
      "net.yaml");
  MBV_DEMAND(loaded.mechanism.has_value(), loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

Motion NetMotion(double from_deg, double to_deg) {
  constexpr double kDegree = std::numbers::pi / 180;
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.05;
  motion.commands.push_back(
      {.name = "motor",
       .terms = {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}},
       .profile = {{ConstantTerm{from_deg * kDegree}, RampTerm{(to_deg - from_deg) * kDegree}}}});
  return motion;
}

// Of redundant rows those chosen at one pose may depend on each other at another, where the
// mechanism itself is regular.
TEST(ManyLoops, ARegularPoseOfANetIsNotALossOfControl) {
  for (const double home_deg : {20.0, 60.0, 90.0}) {
    const Mechanism net = Net(4, home_deg);
    const Mobility mobility = AnalyseMobility(net);
    EXPECT_EQ(mobility.dofs, 1);
    EXPECT_TRUE(mobility.drives_not_unique.empty());
    for (const auto& [from, to] : {std::pair(home_deg, 155.0), std::pair(home_deg, 25.0),
                                   std::pair(150.0, 140.0), std::pair(120.0, 30.0)}) {
      const Motion motion = NetMotion(from, to);
      const ReferenceRun reference = RunReference(net, motion);
      ASSERT_TRUE(reference.summary.ok())
          << home_deg << ": " << from << " to " << to << ": " << reference.summary.message;
      const SimulationRun inverse =
          Simulate(net, motion, FollowCommands(motion), {.mode = DriveMode::kInverse});
      ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
      EXPECT_LT(WorstDifference(inverse.trace, reference.trace), 1e-10);
    }
  }
}

ReferenceSample NetSample(const Mechanism& net, double deg) {
  const Motion motion = NetMotion(deg, deg);
  ReferenceSolver solver(net, motion);
  CommandSample command;
  ReferenceSample sample;
  EvaluateMotion(motion, 0.0, &command);
  EXPECT_TRUE(solver.Dynamics(command, &sample).ok()) << deg;
  return sample;
}

// Poses at which the forces chosen at `home_deg` depend on each other.
std::vector<double> StalePoses(const Mechanism& net, double home_deg) {
  internal::SquareSystem system(net.bodies.size(), CharacteristicLength(net));
  internal::RowSet rows;
  const auto fill = [&](double deg) {
    const ReferenceSample sample = NetSample(net, deg);
    rows.Clear();
    internal::AddReactionRows(net, sample.states, &rows);
    rows.Add(DriveRow(net, net.drives[0], sample.states), true);
  };
  fill(home_deg);
  std::vector<int> all(static_cast<size_t>(rows.size()));
  std::iota(all.begin(), all.end(), 0);
  const std::vector<int> basis = system.IndependentRows(rows, all);
  bool first = true;
  const auto sign_at = [&](double deg) {
    fill(deg);
    const bool regular = system.Factor(rows, basis, std::exchange(first, false));
    return regular ? system.determinant_sign() : 0;
  };
  std::vector<double> poses;
  for (double low = 15.0; low < 165.0; low += 5.0) {
    double high = low + 5.0;
    const int before = sign_at(low);
    double from = low;
    if (sign_at(high) == before) continue;
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (from + high);
      (sign_at(middle) == before ? from : high) = middle;
    }
    poses.push_back(high);
  }
  return poses;
}

// Forces chosen at another pose may depend on each other, where others hold the mechanism.
TEST(ManyLoops, ForcesChooseTheirBasisAnewBeforeTheyJudgeControl) {
  const Mechanism net = Net(4, 60.0);
  int tried = 0;
  for (const double home_deg : {20.0, 60.0, 100.0, 150.0}) {
    for (const double deg : StalePoses(net, home_deg)) {
      internal::ForceSolver far(net, 1.0), fresh(net, 1.0);
      ReferenceSample start = NetSample(net, home_deg), sample = NetSample(net, deg);
      ReferenceSample again = sample;
      ASSERT_TRUE(far.Solve({}, &start).ok());
      const RunSummary moved = far.Solve({}, &sample);
      ASSERT_TRUE(moved.ok()) << home_deg << " to " << deg << ": " << moved.message;
      ASSERT_TRUE(fresh.Solve({}, &again).ok());
      EXPECT_NEAR(sample.drive_force[0], again.drive_force[0], 1e-10) << home_deg << " to " << deg;
      ++tried;
    }
  }
  EXPECT_GT(tried, 0);
}

// All bars in one line: the parallelograms are flat.
TEST(ManyLoops, AFlatNetIsALossOfControl) {
  const ReferenceRun through = RunReference(Net(1, 60.0), NetMotion(60.0, -30.0));
  ASSERT_FALSE(through.summary.ok());
  EXPECT_EQ(through.summary.stop, Stop::kSingular) << through.summary.message;
  for (const int n : {1, 2, 3, 4}) {
    const ReferenceRun there = RunReference(Net(n, 60.0), NetMotion(60.0, 0.0));
    EXPECT_FALSE(there.summary.ok()) << n;
  }
  // The forces alone, with a basis that holds elsewhere: at once, and where the bars cross.
  const Mechanism net = Net(4, 60.0);
  internal::ForceSolver forces(net, 1.0);
  ReferenceSample sample = NetSample(net, 60.0);
  ASSERT_TRUE(forces.Solve({}, &sample).ok());
  BodyStates flat = sample.states;
  for (size_t b = 1; b < flat.X_WB.size(); ++b) {
    flat.X_WB[b].linear().setIdentity();
    const int joint = net.FindJoint("D" + net.bodies[b].name.substr(4));
    const bool post = net.bodies[b].name.starts_with("post");
    flat.X_WB[b].translation() =
        post ? Vec3(net.joints[static_cast<size_t>(joint)].X_PF.translation())
             : Vec3(net.bodies[1].frames[net.bodies[b].name[4] - '1'].X_BF.translation());
  }
  sample.states.X_WB = flat.X_WB;
  const RunSummary refused = forces.Solve({}, &sample);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.stop, Stop::kSingular) << refused.message;
}

// Ends of springs hold nothing: how far away they are changes no scale.
TEST(FarFrames, OfSpringsOutputsAndFreeJointsSetNoLength) {
  const Mechanism mechanism = FourBarChain(1);
  const double length = CharacteristicLength(mechanism);
  Mechanism far = mechanism;
  const int coupler = far.FindBody("coupler1");
  const Vec3 away(1e6, 1e5, 0);
  for (const double sign : {1.0, -1.0}) {
    far.springs.push_back({.name = fmt::format("spring{}", sign),
                           .body_from = 0,
                           .p_from = sign * away,
                           .body_to = coupler,
                           .p_to = Vec3(0.1, 0, 0),
                           .stiffness = 1e-9,
                           .free_length_m = away.norm()});
  }
  EXPECT_EQ(CharacteristicLength(far), length);
  EXPECT_EQ(LongestLever(far), LongestLever(mechanism));
  Mechanism others = far;
  others.outputs.push_back({.name = "far",
                            .body = coupler,
                            .X_BO = Pose(Eigen::Translation3d(away)),
                            .X_RbR = Pose::Identity()});
  Bushing bushing;
  bushing.parent = 0;
  bushing.X_PF.translation() = away;
  bushing.child = coupler;
  others.bushings.push_back(bushing);
  Joint free;
  free.kind = JointKind::kFree;
  free.X_PF.translation() = away;
  free.child = coupler;
  others.joints.push_back(free);
  EXPECT_EQ(CharacteristicLength(others), length);
  EXPECT_EQ(LongestLever(others), LongestLever(mechanism));
  EXPECT_EQ(mjcf::Extent(others), mjcf::Extent(mechanism));
  // What constrains does.
  others.joints.back().kind = JointKind::kSpherical;
  EXPECT_GT(CharacteristicLength(others), 1e3 * length);

  const Motion motion = FourBarChainMotion(mechanism);
  const ReferenceRun near_run = RunReference(mechanism, motion), run = RunReference(far, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_LT(WorstDifference(run.trace, near_run.trace), 1e-8);
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun simulated = Simulate(far, motion, FollowCommands(motion), {.mode = mode});
    ASSERT_TRUE(simulated.summary.ok()) << simulated.summary.message;
    EXPECT_LT(WorstDifference(simulated.trace, run.trace), 1e-7);
  }
}

// Point masses on springs alone have no other length.
TEST(FarFrames, OfSpringsCountWhereNothingElseHasALength) {
  Mechanism m;
  m.bodies.resize(2);
  m.bodies[1].mass = 1.0;
  Joint free;
  free.kind = JointKind::kFree;
  free.child = 1;
  m.joints = {free};
  EXPECT_EQ(CharacteristicLength(m), 1.0);
  m.springs = {{.name = "a", .body_to = 1}, {.name = "b", .p_from = Vec3(3, 0, 0), .body_to = 1}};
  // Two points on the world; the body has its centre of mass and two ends in one place.
  EXPECT_NEAR(CharacteristicLength(m), std::sqrt(9.0 / 4.0), 1e-12);
}

TEST(ManyLoops, TheWitnessesAgreeOnChainsOfFourBars) {
  for (const int loops : {5, 9, 19, 20, 70}) {  // from 20 on MuJoCo's Jacobians are sparse
    const Mechanism mechanism = FourBarChain(loops);
    Motion motion = FourBarChainMotion(mechanism);
    motion.duration_s = 0.3;
    const Mobility mobility = AnalyseMobility(mechanism);
    EXPECT_EQ(mobility.dofs, 1);
    EXPECT_EQ(mobility.redundant, 3 * loops);
    EXPECT_TRUE(mobility.drives_not_unique.empty());
    const ReferenceRun reference = RunReference(mechanism, motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    const SimulationRun inverse =
        Simulate(mechanism, motion, FollowCommands(motion), {.mode = DriveMode::kInverse});
    ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
    EXPECT_LT(WorstDifference(inverse.trace, reference.trace), 1e-12) << loops;
    const SimulationRun forward = Simulate(mechanism, motion, FollowCommands(motion), {});
    ASSERT_TRUE(forward.summary.ok()) << forward.summary.message;
    EXPECT_LT(WorstDifference(forward.trace, reference.trace), 1e-8) << loops;
    EXPECT_TRUE(inverse.not_unique.empty());

    Mechanism perturbed = mechanism;
    perturbed.bodies.back().mass *= 1.0 + 1e-6;
    const SimulationRun wrong =
        Simulate(perturbed, motion, FollowCommands(motion), {.mode = DriveMode::kInverse});
    EXPECT_GT(WorstDifference(wrong.trace, reference.trace), 1e-9) << loops;
  }
}

// Loops in a row hardly resist each other: without harder rows the forces that MuJoCo's softness
// returns grow from step to step, whatever the step.
TEST(ManyLoops, ThatStandOnEachOtherDoNotDiverge) {
  const Mechanism lift = MechanismOf(ScissorLiftText(100, true));
  Motion motion = SwingAllDrives(lift, 0.1);
  motion.duration_s = 0.05;
  const ReferenceRun reference = RunReference(lift, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  const SimulationRun run = Simulate(lift, motion, FollowCommands(motion), {});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  constexpr double kForces = 1e-6;  // the limit of a verdict
  EXPECT_LT(WorstDifference(run.trace, reference.trace), kForces);
  Mechanism perturbed = lift;
  for (Body& body : perturbed.bodies) body.mass *= 1.0 + 2.0 * kForces;
  const SimulationRun wrong = Simulate(perturbed, motion, FollowCommands(motion), {});
  EXPECT_GT(WorstDifference(wrong.trace, reference.trace), kForces);
}

// The least forces by sparse factors are those of the dense pseudo-inverse.
TEST(ManyLoops, ReactionsThatStaticsLeavesOpenAreTheLeastOnes) {
  const Mechanism mechanism = FourBarChain(12);
  const Motion motion = FourBarChainMotion(mechanism);
  ReferenceSolver solver(mechanism, motion);
  CommandSample command;
  ReferenceSample sample;
  EvaluateMotion(motion, 0.13, &command);
  ASSERT_TRUE(solver.Dynamics(command, &sample).ok());

  internal::RowSet rows;
  internal::AddReactionRows(mechanism, sample.states, &rows);
  rows.Add(DriveRow(mechanism, mechanism.drives[0], sample.states), true);
  internal::SquareSystem system(mechanism.bodies.size(), CharacteristicLength(mechanism));
  std::vector<int> all(static_cast<size_t>(rows.size()));
  std::iota(all.begin(), all.end(), 0);
  SparseLu::Matrix columns;
  system.MakeColumns(rows, all, &columns);
  std::vector<Vec6> required;
  internal::RequiredWrenches(mechanism, sample.states, {}, {}, &required);
  const VecX wrenches = system.body_scale().cwiseProduct(internal::Stack(required));
  VecX force = Eigen::CompleteOrthogonalDecomposition<MatX>(MatX(columns)).solve(wrenches);
  for (int i = 0; i < rows.size(); ++i) force[i] *= system.RowScale(rows.angular[i]);
  MatX reactions;
  (void)internal::FillReactions(mechanism, sample.states, rows, force, &reactions);
  const double largest = reactions.cwiseAbs().maxCoeff();
  EXPECT_GT(largest, 1.0);
  EXPECT_LT((sample.reactions - reactions).cwiseAbs().maxCoeff(), 1e-11 * largest);
}

TEST(ManyLoops, FiveHundredLoopsRun) {
  const Mechanism mechanism = FourBarChain(500);
  Motion motion = FourBarChainMotion(mechanism);
  motion.duration_s = 0.05;
  const ReferenceRun reference = RunReference(mechanism, motion);
  ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
  const SimulationRun inverse =
      Simulate(mechanism, motion, FollowCommands(motion), {.mode = DriveMode::kInverse});
  ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
  EXPECT_LT(WorstDifference(inverse.trace, reference.trace), 1e-10);
}

}  // namespace
}  // namespace mbv
