// The rows of the joint kinds against their mathematics: what a row says is what the joint does.
#include "mechanism/joint_kinds.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "math/spatial.h"
#include "mechanism/joint_pose.h"

namespace mbv {
namespace {

class JointKinds : public testing::TestWithParam<JointKindRow> {
 protected:
  Joint joint_{.name = "j",
               .kind = GetParam().kind,
               .axis = Vec3(1, 2, 3).normalized(),
               .axis2 = Vec3(-2, 1, 0.5).normalized(),
               .range = {}};
};

TEST_P(JointKinds, HaveACoordinatePerDegreeOfFreedomThatMovesAsItsLetterSays) {
  ASSERT_EQ(UnitTwists(joint_, Mat3::Identity(), Mat3::Identity()).cols(), DofsOf(joint_.kind));
  for (int c = 0; c < DofsOf(joint_.kind); ++c) {
    std::array<double, 6> q{};
    q[static_cast<size_t>(c)] = 0.1;
    const Pose X_FM = JointPose(joint_, q);
    const double turned = LogRotation(X_FM.linear()).norm();
    EXPECT_NEAR(X_FM.translation().norm(), IsLength(joint_.kind, c) ? 0.1 : 0.0, 8 * kEps) << c;
    EXPECT_NEAR(turned, IsLength(joint_.kind, c) ? 0.0 : 0.1, 8 * kEps) << c;
    EXPECT_NEAR(CoordinatesOf(joint_, X_FM)[static_cast<size_t>(c)], 0.1, 8 * kEps) << c;
  }
}

TEST_P(JointKinds, LockWhatTheyDoNotMove) {
  Mat3 directions;
  std::array<LockedCosine, 3> cosines;
  EXPECT_EQ(LockedDirections(joint_, &directions) + LockedCosines(joint_, &cosines),
            6 - DofsOf(joint_.kind));
}

TEST_P(JointKinds, UseAsManyAxesAsTheRowSays) {
  const int n = DofsOf(joint_.kind);
  std::array<double, 6> q{};
  for (int c = 0; c < n; ++c) q[static_cast<size_t>(c)] = 0.1 * (c + 1);
  const Pose before = JointPose(joint_, q);
  Joint other = joint_, second = joint_;
  other.axis = Vec3(3, -1, 2).normalized();
  second.axis2 = Vec3(1, 1, 4).normalized();
  EXPECT_EQ(!JointPose(other, q).isApprox(before, 1e-9), GetParam().axes > 0);
  EXPECT_EQ(!JointPose(second, q).isApprox(before, 1e-9), GetParam().axes > 1);
}

TEST_P(JointKinds, CanTransmitAForceOnlyWhereABallCanStandForThem) {
  Mat3 directions;
  const bool held = LockedDirections(joint_, &directions) == 3;
  EXPECT_EQ(GetParam().may_transmit_force_only, held && DofsOf(joint_.kind) > 0);
}

TEST_P(JointKinds, TurnAsABallWhereNothingOfTheTurnIsLocked) {
  std::array<LockedCosine, 3> cosines;
  const bool ball = LockedCosines(joint_, &cosines) == 0;
  EXPECT_EQ(HasBall(joint_.kind), ball);
  for (int c = 0; c < DofsOf(joint_.kind); ++c) {
    EXPECT_EQ(IsOfBall(joint_.kind, c), ball && !IsLength(joint_.kind, c)) << c;
  }
}

INSTANTIATE_TEST_SUITE_P(All, JointKinds, testing::ValuesIn(kJointKindRows),
                         [](const auto& row) { return std::string(row.param.word); });

TEST(JointKindWords, Differ) {
  std::set<std::string_view> words;
  for (const JointKindRow& row : kJointKindRows) words.insert(row.word);
  EXPECT_EQ(words.size(), kJointKindRows.size());
}

}  // namespace
}  // namespace mbv
