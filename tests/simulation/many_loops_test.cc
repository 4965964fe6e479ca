// Mechanisms with many loops, whose equations are factored sparse: both witnesses against each
// other and against what dense matrices give.
#include <gtest/gtest.h>

#include <Eigen/QR>
#include <numeric>

#include "kinematics/mobility.h"
#include "mechanism/reach.h"
#include "reference/force_solver.h"
#include "reference/reference.h"
#include "simulation/simulation.h"
#include "tests/four_bar_chain.h"

namespace mbv {
namespace {

DrivenMotion Commanded(const Motion& motion) {
  return [&motion, command = CommandSample()](double t, DrivenSample* at) mutable {
    EvaluateMotion(motion, t, &command);
    at->position = command.position;
    at->velocity = command.velocity;
    at->acceleration = command.acceleration;
    return RunSummary::Done();
  };
}

// Of the motor's torque, relative to its largest.
double WorstDifference(const Trace& a, const Trace& b) {
  const auto column = [](const Trace& trace) -> VecX {
    return trace.values.col(trace.Find("motor.force"));
  };
  return (column(a) - column(b)).cwiseAbs().maxCoeff() / column(b).cwiseAbs().maxCoeff();
}

TEST(ManyLoops, TheWitnessesAgreeOnChainsOfFourBars) {
  for (const int loops : {5, 9, 19, 20, 70}) {  // from 20 on MuJoCo's Jacobians are sparse
    const Mechanism mechanism = FourBarChain(loops);
    Motion motion = FourBarChainMotion(mechanism);
    motion.duration_s = 0.3;
    const Mobility mobility = AnalyseMobility(mechanism);
    EXPECT_EQ(mobility.freedoms, 1);
    EXPECT_EQ(mobility.redundant, 3 * loops);
    EXPECT_TRUE(mobility.drive_forces_unique);
    const ReferenceRun reference = RunReference(mechanism, motion);
    ASSERT_TRUE(reference.summary.ok()) << reference.summary.message;
    const SimulationRun inverse =
        Simulate(mechanism, motion, Commanded(motion), {.mode = SimulationMode::kInverse});
    ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
    EXPECT_LT(WorstDifference(inverse.trace, reference.trace), 1e-12) << loops;
    const SimulationRun forward = Simulate(mechanism, motion, Commanded(motion), {});
    ASSERT_TRUE(forward.summary.ok()) << forward.summary.message;
    EXPECT_LT(WorstDifference(forward.trace, reference.trace), 1e-8) << loops;
    EXPECT_TRUE(inverse.not_unique.empty());

    Mechanism bent = mechanism;
    bent.bodies.back().mass *= 1.0 + 1e-6;
    const SimulationRun wrong =
        Simulate(bent, motion, Commanded(motion), {.mode = SimulationMode::kInverse});
    EXPECT_GT(WorstDifference(wrong.trace, reference.trace), 1e-9) << loops;
  }
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
  (void)internal::FillReactions(mechanism, sample.states, force, &reactions);
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
      Simulate(mechanism, motion, Commanded(motion), {.mode = SimulationMode::kInverse});
  ASSERT_TRUE(inverse.summary.ok()) << inverse.summary.message;
  EXPECT_LT(WorstDifference(inverse.trace, reference.trace), 1e-10);
}

}  // namespace
}  // namespace mbv
