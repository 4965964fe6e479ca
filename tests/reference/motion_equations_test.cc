// Accelerations by one sparse factorisation against those by an orthogonal basis of the motions.
#include "reference/motion_equations.h"

#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "reference/closure_solver.h"
#include "reference/forward.h"
#include "reference/free_dynamics.h"
#include "tests/support/source_dir.h"

namespace mbv::internal {
namespace {

Mechanism Shipped(const std::string& name) {
  LoadResult loaded = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return *std::move(loaded.mechanism);
}

// Every drive pushed from home with a rate of its own.
Motion Pushed(const Mechanism& mechanism) {
  Motion motion{.duration_s = 1.0, .sample_s = 0.01, .commands = {}, .loads = {}};
  for (int d = 0; d < static_cast<int>(mechanism.drives.size()); ++d) {
    const Coordinate drive{Coordinate::Kind::kDrive, d, 0};
    motion.initial.push_back({.name = mechanism.drives[static_cast<size_t>(d)].name,
                              .coordinate = drive,
                              .position = HomeValue(mechanism, drive),
                              .rate = 0.1 + 0.05 * d});
    motion.forces.push_back({.drive = d, .force = Constant(1.0 + d)});
  }
  return motion;
}

VecX Accelerations(const BodyStates& states) { return Stack(states.A_WB); }

TEST(MotionEquations, AccelerationsWithinAStepAreThoseOfTheFullEquations) {
  for (const char* name : {"scara_robot", "spr_tripod", "stewart", "four_bar", "slider_crank"}) {
    const Mechanism mechanism = Shipped(name);
    const Motion motion = Pushed(mechanism);
    BodyStates states;
    ASSERT_TRUE(InitialStates(mechanism, motion, &states).ok()) << name;
    FreeDynamics dynamics(mechanism, motion);
    ASSERT_TRUE(dynamics.Project(0.0, &states).ok()) << name;
    // A pose of a stage of the next step.
    MoveBodies(0.01 * Stack(states.V_WB), &states);
    BodyStates near = states, full = states;
    ASSERT_TRUE(dynamics.AccelerateNear(0.01, &near).ok()) << name;
    ASSERT_TRUE(dynamics.Accelerate(0.01, &full).ok()) << name;
    const VecX a = Accelerations(full);
    EXPECT_GT(a.norm(), 0.1) << name;
    // Rows that are redundant may be others: off the loops by the step's square they differ by it.
    EXPECT_LT((Accelerations(near) - a).norm(), 1e-3 * a.norm()) << name;

    ASSERT_TRUE(dynamics.Project(0.01, &states).ok()) << name;
    near = full = states;
    ASSERT_TRUE(dynamics.AccelerateNear(0.01, &near).ok()) << name;
    ASSERT_TRUE(dynamics.Accelerate(0.01, &full).ok()) << name;
    EXPECT_LT((Accelerations(near) - Accelerations(full)).norm(), 1e-11 * a.norm()) << name;

    Mechanism perturbed = mechanism;
    perturbed.bodies.back().mass *= 1.0 + 1e-6;
    FreeDynamics other(perturbed, motion);
    BodyStates wrong = states;
    ASSERT_TRUE(other.Project(0.01, &wrong).ok()) << name;
    ASSERT_TRUE(other.AccelerateNear(0.01, &wrong).ok()) << name;
    EXPECT_GT((Accelerations(wrong) - Accelerations(full)).norm(), 1e-10 * a.norm()) << name;
  }
}

TEST(MotionEquations, RowsThatAreNotIndependentAreGivenBack) {
  const Mechanism mechanism = Shipped("slider_crank");
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  RowSet rows;
  for (const Joint& joint : mechanism.joints) {
    const ConstraintRows of = RowsOf(joint, states, false);
    rows.Add(of, of.rows);
    rows.Add(of, of.rows);  // once more
  }
  MotionEquations equations(mechanism, 1.0);
  std::vector<int> all;
  for (int i = 0; i < rows.size(); ++i) all.push_back(i);
  equations.Choose(all);
  VecX A;
  const auto size = 6 * static_cast<Eigen::Index>(mechanism.bodies.size() - 1);
  EXPECT_FALSE(equations.Solve(states, rows, VecX::Ones(size), VecX::Zero(rows.size()), &A));
  EXPECT_FALSE(equations.chosen());
}

// What reports a row from one nearly like it may be round-off, though it can be solved for.
TEST(MotionEquations, RowsThatAreNearlyDependentAreGivenBack) {
  const Mechanism mechanism = Shipped("slider_crank");
  BodyStates states;
  states.Resize(mechanism.bodies.size());
  states.X_WB = mechanism.X_WB_home;
  const auto size = 6 * static_cast<Eigen::Index>(mechanism.bodies.size() - 1);
  for (const auto& [apart, independent] : {std::pair{1e-2, true}, {1e-11, false}}) {
    RowSet rows;
    for (const Joint& joint : mechanism.joints) {
      if (joint.closure) continue;
      const ConstraintRows of = RowsOf(joint, states, false);
      rows.Add(of, of.rows);
    }
    rows.Add(RowsOf(mechanism.joints[0], states, false), 1);
    rows.J.back() += apart * (Vec6() << 1, 2, 3, 4, 5, 6).finished();
    MotionEquations equations(mechanism, 1.0);
    std::vector<int> all;
    for (int i = 0; i < rows.size(); ++i) all.push_back(i);
    equations.Choose(all);
    VecX A;
    EXPECT_EQ(equations.Solve(states, rows, VecX::Ones(size), VecX::Zero(rows.size()), &A),
              independent)
        << apart;
  }
}

}  // namespace
}  // namespace mbv::internal
