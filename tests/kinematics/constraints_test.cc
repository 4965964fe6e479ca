// Constraint rows and coordinates: values by hand, then Jacobians and biases against differences of
// the value along a curved motion of both bodies.
#include "kinematics/constraints.h"

#include <gtest/gtest.h>

#include <functional>
#include <numbers>
#include <random>

#include "math/spatial.h"
#include "mechanism/joint_pose.h"

namespace mbv {
namespace {

std::vector<JointKind> EveryKind() {
  std::vector<JointKind> kinds;
  for (const JointKindRow& row : kJointKindRows) kinds.push_back(row.kind);
  return kinds;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  Vec3 Vector(double size) {
    std::uniform_real_distribution<double> u(-size, size);
    return {u(engine_), u(engine_), u(engine_)};
  }
  Pose MakePose(double distance, double angle) {
    Pose X = Pose::Identity();
    X.linear() = ExpRotation(Vector(angle));
    X.translation() = Vector(distance);
    return X;
  }
  Vec6 Twist() {
    Vec6 V;
    V << Vector(1.0), Vector(1.0);
    return V;
  }

 private:
  std::mt19937_64 engine_;
};

Joint MakeJoint(JointKind kind, Random* random) {
  Joint joint;
  joint.name = "joint";
  joint.kind = kind;
  joint.parent = 1;
  joint.child = 2;
  joint.X_PF = random->MakePose(0.5, 1.0);
  joint.X_CM = random->MakePose(0.5, 1.0);
  joint.axis = random->Vector(1.0).normalized();
  joint.axis2 = joint.axis.cross(random->Vector(1.0)).normalized();
  return joint;
}

// Two moving bodies, the second displaced from the joint's coordinates q by `off` (m, rad).
BodyStates MakeStates(const Joint& joint, const std::array<double, 6>& q, double off,
                      Random* random) {
  BodyStates s;
  s.Resize(3);
  s.X_WB[1] = random->MakePose(2.0, 1.0);
  s.X_WB[2] = s.X_WB[1] * joint.X_PF * JointPose(joint, q) * random->MakePose(off, off) *
              joint.X_CM.inverse();
  for (int b : {1, 2}) {
    s.V_WB[b] = random->Twist();
    s.A_WB[b] = random->Twist();
  }
  return s;
}

// States at time t of the motion whose twist and acceleration at t = 0 are those of `s`:
// R(t) = exp(ω t + ½ ε t²) R has ω(0) = ω and ω̇(0) = ε.
BodyStates Moved(const BodyStates& s, double t) {
  BodyStates out = s;
  for (size_t b = 1; b < s.X_WB.size(); ++b) {
    const Vec6 step = t * s.V_WB[b] + 0.5 * t * t * s.A_WB[b];
    out.X_WB[b].linear() = ExpRotation(step.head<3>()) * s.X_WB[b].linear();
    out.X_WB[b].translation() += step.tail<3>();
  }
  return out;
}

// First and second derivative at 0 by sixth-order differences.
std::pair<double, double> Derivatives(const std::function<double(double)>& f) {
  constexpr double h = 4e-3;
  const auto at = [&](int k) { return f(k * h); };
  return {(45 * (at(1) - at(-1)) - 9 * (at(2) - at(-2)) + (at(3) - at(-3))) / (60 * h),
          (-490 * at(0) + 270 * (at(1) + at(-1)) - 27 * (at(2) + at(-2)) + 2 * (at(3) + at(-3))) /
              (180 * h * h)};
}

// Truncation h⁶ f⁽⁷⁾/140 ≈ 4e-15·f⁽⁷⁾ resp. round-off 1e-16·500/(180 h²) ≈ 2e-11; values are O(1)
// and their seventh derivatives below 1e4.
constexpr double kRateTolerance = 1e-9;
constexpr double kAccelerationTolerance = 1e-8;

double RateOf(const Vec6& J_parent, const Vec6& J_child, int parent, int child,
              const std::vector<Vec6>& motion) {
  return J_parent.dot(motion[parent]) + J_child.dot(motion[child]);
}

void ExpectDerivatives(const ScalarRow& row, const BodyStates& s,
                       const std::function<double(const BodyStates&)>& value,
                       const std::string& what) {
  const auto [rate, acceleration] = Derivatives([&](double t) { return value(Moved(s, t)); });
  EXPECT_NEAR(RateOf(row.J_parent, row.J_child, row.parent, row.child, s.V_WB), rate,
              kRateTolerance)
      << what;
  EXPECT_NEAR(RateOf(row.J_parent, row.J_child, row.parent, row.child, s.A_WB) + row.bias,
              acceleration, kAccelerationTolerance)
      << what;
}

std::pair<Joint, BodyStates> HingeOnTheWorld() {
  Joint joint;
  joint.kind = JointKind::kRevolute;
  joint.child = 1;
  BodyStates states;
  states.Resize(2);
  return {joint, states};
}

TEST(Constraints, RowsCountWhatTheJointLocks) {
  Random random(1);
  for (const JointKind kind : EveryKind()) {
    const Joint joint = MakeJoint(kind, &random);
    const ConstraintRows rows = RowsOf(joint, MakeStates(joint, {}, 0.0, &random), false);
    EXPECT_EQ(rows.rows, 6 - DofsOf(kind));
  }
}

TEST(Constraints, AForceOnlyJointReactsWithThreeForcesButStillGuides) {
  Random random(2);
  Joint joint = MakeJoint(JointKind::kRevolute, &random);
  joint.transmits_force_only = true;
  const BodyStates s = MakeStates(joint, {0.3}, 0.0, &random);
  EXPECT_EQ(RowsOf(joint, s, false).rows, 5);
  EXPECT_EQ(RowsOf(joint, s, true).rows, 3);
  EXPECT_EQ(RowsOf(joint, s, true).translation_rows, 3);
}

TEST(Constraints, AHingeOpenedByAMillimetreShowsAMillimetre) {
  const auto [joint, at_home] = HingeOnTheWorld();
  BodyStates s = at_home;
  s.X_WB[1].translation() = Vec3(0, 1e-3, 0);
  const ConstraintRows rows = RowsOf(joint, s, false);
  EXPECT_EQ(rows.translation_rows, 3);
  EXPECT_DOUBLE_EQ(rows.residual.head<3>().norm(), 1e-3);
  EXPECT_DOUBLE_EQ(rows.residual.tail<3>().norm(), 0.0);
}

TEST(Constraints, RowsVanishExactlyOnTheJointsOwnMotions) {
  Random random(3);
  for (const JointKind kind : EveryKind()) {
    for (int trial = 0; trial < 10; ++trial) {
      const Joint joint = MakeJoint(kind, &random);
      std::array<double, 6> q{};
      for (double& c : q) c = random.Vector(1.4).x();
      const BodyStates s = MakeStates(joint, q, 0.0, &random);
      // A few products of rotations and sums of lengths up to 5 m.
      EXPECT_LT(RowsOf(joint, s, false).residual.cwiseAbs().maxCoeff(), 64 * 5 * kEps);
    }
  }
}

TEST(Constraints, RowsMoveAsTheirJacobianAndBiasSay) {
  Random random(4);
  for (const JointKind kind : EveryKind()) {
    for (int trial = 0; trial < 5; ++trial) {
      const Joint joint = MakeJoint(kind, &random);
      const BodyStates s = MakeStates(joint, {0.3, -0.2, 0.4, 0.1, 0.2, -0.5}, 0.3, &random);
      const ConstraintRows rows = RowsOf(joint, s, false);
      for (int i = 0; i < rows.rows; ++i) {
        const ScalarRow row{.parent = 1,
                            .child = 2,
                            .value = rows.residual[i],
                            .J_parent = rows.J_parent.row(i),
                            .J_child = rows.J_child.row(i),
                            .bias = rows.bias[i]};
        ExpectDerivatives(
            row, s, [&](const BodyStates& at) { return RowsOf(joint, at, false).residual[i]; },
            "kind " + std::to_string(static_cast<int>(kind)) + " row " + std::to_string(i));
      }
    }
  }
}

TEST(Constraints, AWrongBiasWouldBeSeen) {
  Random random(5);
  const Joint joint = MakeJoint(JointKind::kRevolute, &random);
  const BodyStates s = MakeStates(joint, {0.3}, 0.0, &random);
  const ConstraintRows rows = RowsOf(joint, s, false);
  EXPECT_GT(rows.bias.cwiseAbs().maxCoeff(), 100 * kAccelerationTolerance);
}

TEST(Constraints, CoordinatesUndoTheJointPose) {
  Random random(6);
  for (const JointKind kind : EveryKind()) {
    const Joint joint = MakeJoint(kind, &random);
    const std::array<double, 6> q = {0.7, -0.4, 1.1, 0.3, -0.9, 2.0};
    const std::array<double, 6> back = CoordinatesOf(joint, JointPose(joint, q));
    for (int c = 0; c < DofsOf(kind); ++c) EXPECT_NEAR(back[c], q[c], 16 * kEps);
  }
}

TEST(Constraints, JointCoordinatesMoveAsTheirJacobianAndBiasSay) {
  Random random(7);
  for (const JointKind kind : EveryKind()) {
    const Joint joint = MakeJoint(kind, &random);
    const BodyStates s = MakeStates(joint, {0.3, -0.2, 0.4, 0.1, 0.2, -0.5}, 0.2, &random);
    for (int c = 0; c < DofsOf(kind); ++c) {
      ExpectDerivatives(
          JointCoordinateRow(joint, c, s), s,
          [&](const BodyStates& at) { return JointCoordinateRow(joint, c, at).value; },
          "kind " + std::to_string(static_cast<int>(kind)) + " coordinate " + std::to_string(c));
    }
  }
}

TEST(Constraints, AnglesAreCountedNearTheGivenValue) {
  Random random(8);
  const Joint joint = MakeJoint(JointKind::kRevolute, &random);
  const BodyStates s = MakeStates(joint, {0.25}, 0.0, &random);
  constexpr double kTurn = 2 * std::numbers::pi;
  EXPECT_NEAR(JointCoordinateRow(joint, 0, s, 3 * kTurn).value, 0.25 + 3 * kTurn, 1e-13);
  EXPECT_NEAR(JointCoordinateRow(joint, 0, s, -2.89).value, 0.25, 1e-13);
  EXPECT_NEAR(JointCoordinateRow(joint, 0, s, -2.90).value, 0.25 - kTurn, 1e-13);
}

TEST(Constraints, DistancesAndOutputsMoveAsTheirJacobianAndBiasSay) {
  Random random(9);
  Mechanism m;
  m.bodies.resize(3);
  Drive drive;
  drive.name = "leg";
  drive.kind = DistanceDrive{1, random.Vector(0.5), 2, random.Vector(0.5)};
  const Output output{.name = "tool",
                      .body = 2,
                      .X_BO = random.MakePose(0.5, 1.0),
                      .reference_body = 1,
                      .X_RbR = random.MakePose(0.5, 1.0)};
  Joint joint = MakeJoint(JointKind::kFree, &random);
  const BodyStates s = MakeStates(joint, {2.0, 1.0, 0.5, 0.4, 0.3, -0.6}, 0.1, &random);
  ExpectDerivatives(
      DriveRow(m, drive, s), s, [&](const BodyStates& at) { return DriveRow(m, drive, at).value; },
      "distance");
  for (int c = 0; c < 6; ++c) {
    ExpectDerivatives(
        OutputRow(output, c, s), s,
        [&](const BodyStates& at) { return OutputRow(output, c, at).value; },
        "output " + std::to_string(c));
  }
}

TEST(Constraints, APointTwoMetresAboveAnotherIsTwoMetresAway) {
  Mechanism m;
  m.bodies.resize(2);
  Drive drive;
  drive.kind = DistanceDrive{0, Vec3(1, 0, 0), 1, Vec3(0, 0, 0.5)};
  BodyStates s;
  s.Resize(2);
  s.X_WB[1].translation() = Vec3(1, 0, 1.5);
  const ScalarRow row = DriveRow(m, drive, s);
  EXPECT_DOUBLE_EQ(row.value, 2.0);
  // A unit of thrust pushes the upper body up.
  EXPECT_TRUE(row.J_child.tail<3>().isApprox(Vec3::UnitZ()));
}

TEST(Constraints, ACouplingIsTheSumOfItsPieces) {
  Mechanism m;
  m.bodies.resize(2);
  Joint hinge;
  hinge.kind = JointKind::kRevolute;
  hinge.child = 1;
  m.joints = {hinge};
  m.couplings = {{.name = "cam", .terms = {{0, 0, {2.0, 0.5}}}, .constant = -0.7}};
  BodyStates states;
  states.Resize(2);
  states.X_WB[1].linear() = RotZ(0.3);
  const CouplingRow row = CouplingRows(m, states).at(0);
  EXPECT_NEAR(row.value, 2.0 * 0.3 + 0.5 * 0.09 - 0.7, 1e-15);
  ASSERT_EQ(row.pieces.size(), 1u);
  EXPECT_NEAR(row.pieces[0].value, row.value, 1e-15);
}

TEST(Constraints, TheRotationGapSeesABackwardAxisThatTheCosinesMiss) {
  const auto [joint, at_home] = HingeOnTheWorld();
  BodyStates s = at_home;
  s.X_WB[1].linear() = RotX(std::numbers::pi);
  EXPECT_LT(RowsOf(joint, s, false).residual.norm(), 1e-15);
  EXPECT_NEAR(RotationGap(joint, s.X_WB[1]), std::numbers::pi, 1e-12);
}

TEST(Constraints, AReversedTreeJointPlacesTheSameBodies) {
  Random random(10);
  Mechanism m;
  m.bodies.resize(2);
  Joint joint = MakeJoint(JointKind::kCylindrical, &random);
  joint.parent = 0;
  joint.child = 1;
  m.joints = {joint};
  m.tree_joints = {0};
  m.tree_reversed = {false};
  const std::vector<std::array<double, 6>> q = {{0.4, -0.7}};
  const Pose X_forward = TreePoses(m, q)[1];
  std::swap(m.joints[0].parent, m.joints[0].child);
  m.tree_reversed = {true};
  EXPECT_TRUE(TreePoses(m, q)[1].isApprox(X_forward.inverse(), 1e-14));
}

}  // namespace
}  // namespace mbv
