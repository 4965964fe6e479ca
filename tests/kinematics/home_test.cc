// Spanning tree choices and the home pose of a four-bar, whose closed pose is known.
#include "kinematics/home.h"

#include <gtest/gtest.h>

#include "mechanism/spanning_tree.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

using ::mbv::fixtures::FourBar;
using ::mbv::fixtures::MakeFourBar;

enum { kA, kB, kD, kC };  // joint indices of MakeFourBar: ground A, B, ground D, C

std::vector<std::string> CutJoints(const Mechanism& m) {
  std::vector<std::string> names;
  for (const Joint& joint : m.joints) {
    if (joint.closure) names.push_back(joint.name);
  }
  return names;
}

Mechanism UncutFourBar() {
  Mechanism m = MakeFourBar();
  m.joints[kC].closure = false;
  m.tree_joints.clear();
  m.tree_reversed.clear();
  return m;
}

TEST(SpanningTree, ALoopOfEqualHingesIsCutOppositeTheWorld) {
  Mechanism m = UncutFourBar();
  EXPECT_TRUE(BuildSpanningTree(&m).ok());
  EXPECT_EQ(CutJoints(m), std::vector<std::string>{"C"});
  EXPECT_EQ(m.tree_joints, (std::vector<int>{kA, kD, kB}));
  EXPECT_EQ(m.tree_reversed, (std::vector<bool>{false, false, false}));
}

TEST(SpanningTree, ForceOnlyJointsAndBallsAreCutBeforeHinges) {
  Mechanism m = UncutFourBar();
  m.joints[kB].transmits_force_only = true;
  EXPECT_TRUE(BuildSpanningTree(&m).ok());
  EXPECT_EQ(CutJoints(m), std::vector<std::string>{"B"});
  m = UncutFourBar();
  m.joints[kD].kind = JointKind::kSpherical;
  EXPECT_TRUE(BuildSpanningTree(&m).ok());
  EXPECT_EQ(CutJoints(m), std::vector<std::string>{"D"});
}

TEST(SpanningTree, DrivenJointsStayInTheTree) {
  Mechanism m = UncutFourBar();
  m.drives = {{.name = "motor", .kind = JointDrive{kC, 0}, .range = {}}};
  EXPECT_TRUE(BuildSpanningTree(&m).ok());
  EXPECT_EQ(CutJoints(m), std::vector<std::string>{"B"});
  // The rocker carries the coupler now: its joint is walked from child to parent.
  EXPECT_EQ(m.tree_joints, (std::vector<int>{kA, kD, kC}));
  EXPECT_EQ(m.tree_reversed, (std::vector<bool>{false, false, true}));
}

TEST(SpanningTree, HintsAreObeyedOrReported) {
  Mechanism m = UncutFourBar();
  EXPECT_TRUE(BuildSpanningTree(&m, {true}).ok());
  EXPECT_EQ(CutJoints(m), std::vector<std::string>{"A"});
  const SpanningTreeResult all_kept = BuildSpanningTree(&m, {false, false, false, false});
  EXPECT_EQ(all_kept.hints_broken, std::vector<int>{kC});
}

TEST(SpanningTree, BodiesWithoutAWayToTheWorldAreReported) {
  Mechanism m = UncutFourBar();
  const SpanningTreeResult result = BuildSpanningTree(&m, {{}, true, {}, true});
  EXPECT_EQ(result.unconnected_bodies, std::vector<int>{2});
}

TEST(Home, ClosesAFourBarFromPoorGuessesWithoutMovingItsMotor) {
  Mechanism m = MakeFourBar();
  m.joints[kB].guess[0] += 0.3;
  m.joints[kD].guess[0] -= 0.2;
  const HomeResult home = SolveHome(&m);
  EXPECT_TRUE(home.closed) << home.Text(m);
  EXPECT_FALSE(home.drives_moved);
  EXPECT_GT(home.gap_at_guess, 0.05);
  EXPECT_LT(home.gap, kHomeTolerance);
  const FourBar truth(FourBar::kHomeAngle);
  // Lengths of 0.5 m and a transmission angle far from 0: angles to a few gaps.
  EXPECT_DOUBLE_EQ(m.joints[kA].home[0], truth.t1);
  EXPECT_NEAR(m.joints[kB].home[0], truth.t2 - truth.t1, 1e-11);
  EXPECT_NEAR(m.joints[kD].home[0], truth.t3, 1e-11);
  EXPECT_NEAR(m.joints[kC].home[0], truth.t3 - truth.t2, 1e-11);
}

TEST(Home, AFourBarWithTooFarAGroundStaysOpenByTheMissingLength) {
  Mechanism m = MakeFourBar();
  m.joints[kD].X_PF.translation().x() = 2.0;
  const HomeResult home = SolveHome(&m);
  EXPECT_FALSE(home.closed);
  ASSERT_EQ(home.gaps.size(), 1u);
  EXPECT_EQ(home.gaps[0].joint, kC);
  // Stretched links reach a + b + c of the 2 m.
  EXPECT_NEAR(home.gaps[0].position_m, 2.0 - FourBar::a - FourBar::b - FourBar::c, 1e-3);
  EXPECT_NE(home.Text(m).find("C is open by 0.9"), std::string::npos) << home.Text(m);
}

TEST(Home, TheWayToCloseThatIsNamedIsTaken) {
  const FourBar truth(FourBar::kHomeAngle);
  Mechanism m = MakeFourBar();
  HomeResult home = SolveHome(&m, {{"C", 1}});
  EXPECT_TRUE(home.closed);
  EXPECT_NEAR(m.joints[kD].home[0], truth.t3, 1e-11);
  ASSERT_EQ(home.searched.size(), 1u);
  EXPECT_EQ(home.searched[0].assemblies.size(), 2u);
  // The other one mirrors the dyad of coupler and rocker at the line from B to D.
  m = MakeFourBar();
  home = SolveHome(&m, {{"C", 2}});
  EXPECT_TRUE(home.closed) << home.Text(m);
  EXPECT_FALSE(home.guesses_moved);  // it is the one that is meant
  EXPECT_NEAR(m.joints[kA].home[0], truth.t1, 1e-12);
  const Vec3 B(FourBar::a * std::cos(truth.t1), FourBar::a * std::sin(truth.t1), 0);
  const Vec3 D(FourBar::d, 0, 0), u = (D - B).normalized();
  const Vec3 C = D + FourBar::c * Vec3(std::cos(truth.t3), std::sin(truth.t3), 0);
  const Vec3 mirrored = B + 2.0 * u * u.dot(C - B) - (C - B);
  const Vec3 is =
      D + FourBar::c * Vec3(std::cos(m.joints[kD].home[0]), std::sin(m.joints[kD].home[0]), 0);
  EXPECT_LT((is - mirrored).norm(), 1e-11);
}

TEST(Home, AWayThatIsNotThereIsReportedWithThoseThatAre) {
  Mechanism m = MakeFourBar();
  const HomeResult home = SolveHome(&m, {{"C", 3}, {"X", 1}});
  ASSERT_EQ(home.unmet.size(), 2u);
  EXPECT_EQ(home.unmet[0].closure, "X");
  EXPECT_EQ(home.unmet[0].found, -1);
  EXPECT_EQ(home.unmet[1].closure, "C");
  EXPECT_EQ(home.unmet[1].wanted, 3);
  EXPECT_EQ(home.unmet[1].found, 2);
}

TEST(Home, AMotorGuessThatCannotCloseIsMovedAndReportedSo) {
  Mechanism m = MakeFourBar();
  m.joints[kA].X_PF.translation().x() = -0.35;  // ground distance 0.85: closes near θ1 = 0 only
  m.joints[kA].guess[0] = 2.5;
  const HomeResult home = SolveHome(&m);
  EXPECT_TRUE(home.closed) << home.Text(m);
  EXPECT_TRUE(home.drives_moved);
}

}  // namespace
}  // namespace mbv
