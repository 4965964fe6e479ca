// Ways to put loops together.
#include "kinematics/assembly.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include "math/spatial.h"
#include "mechanism/joint_pose.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

constexpr double kPi = std::numbers::pi;

Joint JointOf(JointKind kind) {
  Joint joint;
  joint.kind = kind;
  joint.axis = Vec3(1, 2, 2) / 3;
  joint.axis2 = Vec3(2, 1, -2) / 3;
  joint.X_PF.linear() = RotRpy({0.3, -0.2, 0.5});
  joint.X_PF.translation() = Vec3(0.1, 0.2, -0.3);
  joint.X_CM.linear() = RotRpy({-0.7, 0.4, 0.1});
  joint.X_CM.translation() = Vec3(-0.2, 0.1, 0.4);
  return joint;
}

// The child's pose at which M is turned against F by `turn`.
Pose ChildAt(const Joint& joint, const Mat3& turn, const Vec3& shift) {
  Pose X_FM = Pose::Identity();
  X_FM.linear() = turn;
  X_FM.translation() = shift;
  return joint.X_PF * X_FM * joint.X_CM.inverse();
}

std::vector<JointKind> Kinds() {
  std::vector<JointKind> kinds;
  for (const JointKindRow& row : kJointKindRows) {
    if (row.kind != JointKind::kFree) kinds.push_back(row.kind);  // it locks nothing
  }
  return kinds;
}

TEST(AssemblyResidual, VanishesOnTheJointsOwnMotions) {
  for (const JointKind kind : Kinds()) {
    const Joint joint = JointOf(kind);
    if (kind == JointKind::kUniversal) continue;  // JointPose needs perpendicular axes
    const Pose X_FM = JointPose(joint, {0.3, -0.4, 0.7, 0, 0, 0});
    const auto gap = internal::AssemblyResidual(
        joint, {Pose::Identity(), joint.X_PF * X_FM * joint.X_CM.inverse()}, 2.0);
    EXPECT_LT(gap.residual.norm(), 1e-14) << static_cast<int>(kind);
  }
}

TEST(AssemblyResidual, ItsDerivativeIsThatOfDifferences) {
  const Vec3 turns[] = {{0.4, -0.3, 0.9}, {1e-5, 0, 2e-5}, {2.0, 1.5, -0.8}};
  for (const JointKind kind : Kinds()) {
    for (const Vec3& turn : turns) {
      const Joint joint = JointOf(kind);
      const Pose X_WC = ChildAt(joint, ExpRotation(turn), {0.3, 0.1, -0.2});
      const auto gap = internal::AssemblyResidual(joint, {Pose::Identity(), X_WC}, 2.0);
      for (int k = 0; k < 6; ++k) {
        constexpr double h = 1e-6;
        const auto moved = [&](double step) {
          Pose X = X_WC;
          if (k < 3) {
            X.linear() = ExpRotation(step * Vec3::Unit(k)) * X.linear();
          } else {
            X.translation() += step * Vec3::Unit(k - 3);
          }
          return internal::AssemblyResidual(joint, {Pose::Identity(), X}, 2.0).residual;
        };
        const VecX difference = (moved(h) - moved(-h)) / (2 * h);
        EXPECT_LT((difference - gap.J_child.col(k)).norm(), 1e-7)
            << "kind " << static_cast<int>(kind) << ", column " << k;
      }
    }
  }
}

// Half a turn is where direction cosines vanish; here some turn still narrows the gap.
TEST(AssemblyResidual, HasADescentDirectionAtHalfATurn) {
  for (const JointKind kind : Kinds()) {
    if (HasBall(kind) || kind == JointKind::kUniversal) continue;
    const Joint joint = JointOf(kind);
    const Vec3 about = joint.axis.unitOrthogonal();
    for (const double short_of : {0.0, 1e-13, 1e-9, 1e-3}) {
      const Pose X_WC = ChildAt(joint, ExpRotation((kPi - short_of) * about), Vec3::Zero());
      const auto gap = internal::AssemblyResidual(joint, {Pose::Identity(), X_WC}, 1.0);
      EXPECT_NEAR(gap.residual.norm(), kPi, 2e-3);
      const VecX slope = gap.J_child.transpose() * gap.residual;
      EXPECT_GT(slope.head<3>().norm(), 1.0) << static_cast<int>(kind);
      // A step along it does narrow the gap.
      Pose X = X_WC;
      X.linear() = ExpRotation(-0.1 * slope.head<3>().normalized()) * X.linear();
      EXPECT_LT(internal::AssemblyResidual(joint, {Pose::Identity(), X}, 1.0).residual.norm(),
                kPi - 0.05)
          << static_cast<int>(kind) << " " << short_of;
    }
  }
}

std::string FourBarText(const std::string& prefix, double x) {
  return fmt::format(
      "  {0}crank: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [0.2, 0, 0]}}}}\n"
      "  {0}coupler: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [0.5, 0, 0]}}}}\n"
      "  {0}rocker: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [0.4, 0, 0]}}}}\n",
      prefix, x);
}
std::string FourBarJoints(const std::string& p, double crank) {
  return fmt::format(
      "  {0}A: {{kind: revolute, parent: world.A, child: {0}crank, axis: z, guess: {1}}}\n"
      "  {0}B: {{kind: revolute, parent: {0}crank.end, child: {0}coupler, axis: z, guess: {2}}}\n"
      "  {0}D: {{kind: revolute, parent: world.D, child: {0}rocker, axis: z, guess: 0.0}}\n"
      "  {0}C: {{kind: fixed, parent: {0}rocker.end, child: {0}coupler.end, closure: true}}\n",
      p, crank, -crank);
}

// Two four-bars whose closures weld a hinge's frames: cut so that they cannot close …
Mechanism TwoFourBars(double crank) {
  std::string text = "name: m\nworld: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}\nbodies:\n" +
                     FourBarText("l_", 0) + FourBarText("r_", 1) + "joints:\n" +
                     FourBarJoints("l_", crank) + FourBarJoints("r_", crank) +
                     "drives: {m: {kind: joint, joint: l_A}, n: {kind: joint, joint: r_A}}\n";
  // … but with a hinge they do.
  for (size_t at; (at = text.find("kind: fixed")) != std::string::npos;) {
    text.replace(at, 11, "axis: z, kind: revolute");
  }
  const LoadResult loaded = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism{});
}

TEST(LoopGroups, LoopsThatShareNoJointAreSeparate) {
  const Mechanism m = TwoFourBars(1.2);
  const std::vector<LoopGroup> groups = LoopGroups(m);
  ASSERT_EQ(groups.size(), 2u);
  for (const LoopGroup& group : groups) {
    EXPECT_EQ(group.closures.size(), 1u);
    ASSERT_EQ(group.joints.size(), 3u);
    const char side = m.joints[group.closures[0]].name[0];
    for (const int j : group.joints) EXPECT_EQ(m.joints[j].name[0], side);
  }
}

TEST(FindAssemblies, AFourBarWithItsCrankHeldClosesInTwoWaysTheNearestFirst) {
  const Mechanism m = TwoFourBars(1.2);
  const LoopGroup group = LoopGroups(m)[0];
  std::vector<bool> driven(m.joints.size(), false);
  driven[m.FindJoint("l_A")] = true;
  JointCoordinates guess;
  for (const Joint& joint : m.joints) guess.push_back(joint.guess);
  for (const double rocker : {2.0, -2.5}) {
    guess[m.FindJoint("l_D")][0] = rocker;
    const GroupAssemblies found = FindAssemblies(m, group, driven, guess);
    ASSERT_EQ(found.assemblies.size(), 2u);
    EXPECT_FALSE(found.drives_moved);
    EXPECT_LT(found.assemblies[0].distance, found.assemblies[1].distance);
    const auto at = std::find(group.joints.begin(), group.joints.end(), m.FindJoint("l_D"));
    const auto k = static_cast<size_t>(at - group.joints.begin());
    // Above the ground link, or below it.
    EXPECT_GT(std::sin(found.assemblies[0].q[k][0]) * std::sin(rocker), 0.0) << rocker;
    EXPECT_LT(std::sin(found.assemblies[1].q[k][0]) * std::sin(rocker), 0.0) << rocker;
    const std::string said = AssemblyText(m, found);
    EXPECT_NE(said.find("2 ways to close found"), std::string::npos) << said;
  }
}

TEST(FindAssemblies, WhatCannotCloseFindsNothingButItsBestPose) {
  Mechanism m = TwoFourBars(1.2);
  for (Joint& joint : m.joints) {
    if (joint.name == "l_B") joint.X_PF.translation().x() = 5.0;  // a crank far too long
  }
  JointCoordinates guess;
  for (const Joint& joint : m.joints) guess.push_back(joint.guess);
  const GroupAssemblies found =
      FindAssemblies(m, LoopGroups(m)[0], std::vector<bool>(m.joints.size(), false), guess);
  EXPECT_TRUE(found.assemblies.empty());
  EXPECT_EQ(found.best.size(), 3u);
}

// A rod whose end points the wrong way by half a turn.
TEST(FindAssemblies, ALoopHalfATurnOffIsClosed) {
  const std::string text =
      "name: m\nworld: {frames: {A: [0, 0, 0], E: {position: [1, 0, 0], rotation: {rpy: [0, 0, "
      "pi]}}}}\nbodies:\n"
      "  a: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.5, 0, 0]}}\n"
      "  b: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.5, 0, 0]}}\n"
      "  c: {mass: 1, inertia: [1, 1, 1]}\n"
      "joints:\n"
      "  A: {kind: revolute, parent: world.A, child: a, axis: z}\n"
      "  B: {kind: revolute, parent: a.end, child: b, axis: z}\n"
      "  C: {kind: revolute, parent: b.end, child: c, axis: z}\n"
      "  weld: {kind: fixed, parent: world.E, child: c, closure: true}\n";
  const LoadResult loaded = LoadModelText(text, "m.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_NEAR(std::abs(loaded.mechanism->joints[2].home[0]), kPi, 1e-5);
}

}  // namespace
}  // namespace mbv
