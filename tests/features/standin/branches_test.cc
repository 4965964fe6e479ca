// Ways to put limbs together, poses of the same drives, ends of joints alone, against rods' lengths
// by hand; robots of every format and kind of joint.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "base/files.h"
#include "features/standin/standin.h"
#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "scenario/find_model.h"
#include "tests/support/source_dir.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180.0;
const std::vector<std::string> kAxes = {"upper", "lower"};

Mechanism FromText(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "branches.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// Two servos at unequal heights, by hand [mm]; the numbers of the three public versions.
struct ServoAnkle {
  Vec3 low{12.5, 27.5, 73}, high{12.5, -27.5, 108}, ball{14.5, 26.5, 2.5};
  double crank = 18, low_rod = 80, high_rod = 115, offset = 7.924;
  bool pitch_above = true;

  [[nodiscard]] Vec3 Ball(int limb, const VecX& q) const {
    const Vec3 pitch = Vec3::UnitY(), roll = Vec3::UnitX();
    const Vec3 b(ball.x(), limb == 0 ? ball.y() : -ball.y(), ball.z());
    return Eigen::AngleAxisd(q[0], pitch_above ? pitch : roll) *
           (Vec3(0, 0, -offset) + Eigen::AngleAxisd(q[1], pitch_above ? roll : pitch) * b);
  }
  // |ball − crank's end|² − rod².
  [[nodiscard]] double Off(int limb, const VecX& q, double m) const {
    const Vec3 end = (limb == 0 ? low : high) + crank * Vec3(std::cos(m), 0, std::sin(m));
    const double rod = limb == 0 ? low_rod : high_rod;
    return (Ball(limb, q) - end).squaredNorm() - rod * rod;
  }
  // By sign changes over a turn, in steps of a quarter degree.
  [[nodiscard]] std::vector<double> Ways(int limb, const VecX& q) const {
    std::vector<double> ways;
    for (int k = -720; k < 720; ++k) {
      double a = k * kDegree / 4, b = a + kDegree / 4;
      const double off = Off(limb, q, a);
      if ((off < 0) == (Off(limb, q, b) < 0)) continue;
      for (int i = 0; i < 60; ++i) {
        const double middle = 0.5 * (a + b);
        ((off < 0) == (Off(limb, q, middle) < 0) ? a : b) = middle;
      }
      ways.push_back(a);
    }
    return ways;
  }
  [[nodiscard]] MatX ByJoints(const VecX& q, const VecX& m) const {
    MatX J(2, 2);
    for (int i = 0; i < 2; ++i) {
      for (int k = 0; k < 2; ++k) {
        const VecX step = 1e-6 * VecX::Unit(2, k);
        J(i, k) = (Off(i, q + step, m[i]) - Off(i, q - step, m[i])) / 2e-6;
      }
    }
    return J;
  }
  // Newton from 30 × 30 starts.
  [[nodiscard]] std::vector<VecX> Poses(const VecX& m) const {
    std::vector<VecX> poses;
    for (int s = 0; s < 30 * 30; ++s) {
      VecX q = Eigen::Vector2d(s % 30, s / 30) * (2 * std::numbers::pi / 30);
      for (int i = 0; i < 40; ++i) {
        const VecX step = ByJoints(q, m).fullPivLu().solve(
            VecX(Eigen::Vector2d(Off(0, q, m[0]), Off(1, q, m[1]))));
        q -= step * std::min(1.0, 0.5 / step.norm());
      }
      if (std::hypot(Off(0, q, m[0]), Off(1, q, m[1])) > 1e-6) continue;
      const auto same = [&](const VecX& other) {
        return (q - other)
                   .unaryExpr([](double x) { return std::remainder(x, 2 * std::numbers::pi); })
                   .norm() < 1e-5;
      };
      if (std::ranges::none_of(poses, same)) poses.push_back(q);
    }
    return poses;
  }
  [[nodiscard]] Mechanism Model() const {
    LoadOptions options;
    options.overrides = {{"crank", crank / 1e3},       {"low_rod", low_rod / 1e3},
                         {"high_rod", high_rod / 1e3}, {"servo_x", low.x() / 1e3},
                         {"servo_y", low.y() / 1e3},   {"low_z", low.z() / 1e3},
                         {"high_z", high.z() / 1e3},   {"ball_x", ball.x() / 1e3},
                         {"ball_y", ball.y() / 1e3},   {"ball_z", ball.z() / 1e3},
                         {"offset", offset / 1e3},     {"pitch_above", pitch_above ? 1.0 : 0.0}};
    LoadResult loaded = LoadModel(SourcePath("/tests/mechanisms/servo_ankle.yaml"), options);
    EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
    return loaded.mechanism.value_or(Mechanism());
  }
};

ServoAnkle RollAbove() {
  ServoAnkle ankle;
  ankle.offset = 8;
  ankle.pitch_above = false;
  return ankle;
}
// The first version, its axes turned to x forward: rods as long as the level foot needs.
ServoAnkle LongCranks() {
  ServoAnkle ankle = {.low = {-8, -26, 70}, .high = {-8, 26, 50}, .ball = {22, -32, -6}};
  ankle.crank = 34;
  ankle.offset = 6;
  ankle.pitch_above = false;
  for (double* rod : {&ankle.low_rod, &ankle.high_rod}) *rod = 0.0;
  const VecX level = VecX::Zero(2);
  ankle.low_rod = std::sqrt(ankle.Off(0, level, 0.0));
  ankle.high_rod = std::sqrt(ankle.Off(1, level, 0.0));
  return ankle;
}

StandinSettings Over(double degrees, int resolution) {
  return {.ranges = {{"upper", -degrees * kDegree, degrees * kDegree},
                     {"lower", -degrees * kDegree, degrees * kDegree}},
          .resolution = resolution};
}

TEST(StandinBranches, BothWaysOfEachCrankAreThoseOfTheRods) {
  for (const ServoAnkle& hand : {ServoAnkle(), RollAbove(), LongCranks()}) {
    const StandinResult result = ComputeStandin(hand.Model(), kAxes, Over(30, 5));
    ASSERT_EQ(result.limbs.size(), 2u) << result.diagnostics.Text();
    EXPECT_LT(result.home.norm(), 1e-12);
    for (int limb = 0; limb < 2; ++limb) {
      const StandinLimb& found = result.limbs[static_cast<size_t>(limb)];
      EXPECT_EQ(found.kind, "crank and rod");
      EXPECT_EQ(found.other_way, 0u);
      const std::vector<double> ways = hand.Ways(limb, VecX::Zero(2));
      ASSERT_EQ(ways.size(), 2u);
      const bool first = std::abs(ways[0] - result.drives_home[limb]) < 1e-9;
      EXPECT_NEAR(ways[first ? 0 : 1], result.drives_home[limb], 1e-9);
      EXPECT_NEAR(ways[first ? 1 : 0], found.other_home, 1e-9);
      double apart = 1e9;
      for (const StandinPose& pose : result.poses) {
        if (pose.status != PoseStatus::kUsable) continue;
        EXPECT_EQ(pose.ways, 4);
        const std::vector<double> at = hand.Ways(limb, pose.q);
        const double between = at[1] - at[0];
        apart = std::min({apart, between, 2 * std::numbers::pi - between});
      }
      EXPECT_NEAR(found.apart, apart, 1e-9);
    }
  }
  ServoAnkle longer;
  longer.low_rod += 1e-5;
  const StandinResult other = ComputeStandin(longer.Model(), kAxes, Over(30, 2));
  EXPECT_GT(std::abs(other.limbs[0].other_home - ServoAnkle().Ways(0, VecX::Zero(2))[0]), 1e-7);
}

// Poses that are out of reach are those where a limb has no way; no others are.
TEST(StandinBranches, OutOfReachIsWhereARodDoesNotReach) {
  const ServoAnkle hand;
  const StandinResult result = ComputeStandin(hand.Model(), kAxes, Over(60, 13));
  size_t out = 0;
  for (const StandinPose& pose : result.poses) {
    const bool reach = hand.Ways(0, pose.q).size() == 2 && hand.Ways(1, pose.q).size() == 2;
    EXPECT_EQ(pose.status != PoseStatus::kOpen, reach) << pose.q.transpose();
    out += reach ? 0 : 1;
  }
  EXPECT_GT(out, 40u);
  EXPECT_LT(out, 130u);
}

// The ends that the public sources print, in degrees: ±35.8, −65.6 and 112.0 of the version with
// roll above; ±41.1, −65.8 and 88.0 (to a degree) of the newest. Its −85.0 is no pose of it.
TEST(StandinBranches, EndsOfJointsAloneAreDeadCentresAndTypeTwo) {
  using Kind = StandinEnd::Kind;
  const auto ends = [](const ServoAnkle& hand) {
    return ComputeStandin(hand.Model(), kAxes, Over(20, 3)).ends;
  };
  const auto expect = [](const StandinEnd& end, double degrees, double within, Kind kind,
                         const std::string& where) {
    EXPECT_NEAR(end.at / kDegree, degrees, within);
    EXPECT_EQ(end.kind, kind);
    EXPECT_EQ(end.where, where);
  };
  const ServoAnkle newest;
  const std::vector<StandinEnd> now = ends(newest);
  ASSERT_EQ(now.size(), 4u);
  expect(now[0], -65.8, 0.1, Kind::kDeadCentre, "high");
  expect(now[1], 88.0, 1.0, Kind::kType2, "");
  expect(now[2], -41.1, 0.1, Kind::kDeadCentre, "high");
  expect(now[3], 41.7, 0.1, Kind::kDeadCentre, "low");
  const std::vector<StandinEnd> before = ends(RollAbove());
  expect(before[0], -35.8, 0.1, Kind::kDeadCentre, "high");
  expect(before[1], 35.9, 0.1, Kind::kDeadCentre, "low");
  expect(before[2], -65.6, 0.1, Kind::kType2, "");
  expect(before[3], 112.0, 0.3, Kind::kType2, "");

  // By hand: no way beyond the dead centre, and det of the rods' rows changes its sign at type 2.
  const auto pose = [](size_t joint, double at) { return VecX(at * VecX::Unit(2, joint)); };
  for (const size_t k : {size_t{0}, size_t{2}, size_t{3}}) {
    const double out = now[k].up ? 1e-4 : -1e-4;
    const int limb = now[k].where == "low" ? 0 : 1;
    EXPECT_EQ(newest.Ways(limb, pose(now[k].joint, now[k].at + out)).size(), 0u);
    double apart = newest.Ways(limb, pose(now[k].joint, now[k].at - out))[1];
    apart -= newest.Ways(limb, pose(now[k].joint, now[k].at - out))[0];
    EXPECT_LT(apart, 0.1);
  }
  const auto det = [&](double at) {
    const VecX q = pose(0, at);
    VecX m(2);
    for (int limb = 0; limb < 2; ++limb) {
      const std::vector<double> ways = newest.Ways(limb, q);
      m[limb] = std::abs(ways[0]) < std::abs(ways[1]) ? ways[0] : ways[1];
    }
    return newest.ByJoints(q, m).determinant();
  };
  EXPECT_LT(det(now[1].at - 1e-4) * det(now[1].at + 1e-4), 0);
  EXPECT_GT(det(now[1].at - 1e-4) * det(0), 0);
  for (int degrees = -66; degrees > -135; --degrees) {
    EXPECT_TRUE(newest.Ways(0, pose(0, degrees * kDegree)).empty()) << degrees;
  }
  // A solver whose cosine is clamped where the rods do not reach has a zero there.
  const auto clamped = [&](double degrees) {
    const VecX q = pose(0, degrees * kDegree);
    VecX m(2);
    for (int limb = 0; limb < 2; ++limb) {
      const double mean = 0.5 * (newest.Off(limb, q, 0) + newest.Off(limb, q, std::numbers::pi));
      const double x = newest.Off(limb, q, 0) - mean,
                   z = newest.Off(limb, q, 0.5 * std::numbers::pi) - mean;
      const double cosine = -mean / std::hypot(x, z);
      EXPECT_GT(std::abs(cosine), 1.0);
      m[limb] = std::atan2(z, x) + std::acos(std::clamp(cosine, -1.0, 1.0));
    }
    return newest.ByJoints(q, m).determinant();
  };
  EXPECT_LT(clamped(-85.5) * clamped(-84.9), 0);
  ServoAnkle longer;
  longer.high_rod += 0.01;
  EXPECT_GT(std::abs(ends(longer)[0].at - now[0].at), 1e-5);
}

// Printed for the first version: two, four or six poses of the foot for the same cranks.
TEST(StandinBranches, PosesOfTheSameCranksAreAllThatNewtonFinds) {
  for (const ServoAnkle& hand : {ServoAnkle(), LongCranks()}) {
    const Mechanism model = hand.Model();
    const StandinResult result = ComputeStandin(model, kAxes, Over(35, 11));
    std::map<size_t, int> counts;
    for (size_t i = 0; i < result.poses.size(); i += 8) {
      const StandinPose& pose = result.poses[i];
      if (pose.status != PoseStatus::kUsable) continue;
      const std::vector<VecX> poses = hand.Poses(pose.drives);
      EXPECT_EQ(static_cast<size_t>(pose.joint_poses), poses.size()) << pose.q.transpose();
      ++counts[poses.size()];
    }
    EXPECT_GT(counts[4], 4);
    ASSERT_EQ(result.poses_at_home.size(), hand.Poses(result.drives_home).size());
    EXPECT_LT((result.poses_at_home[0] - result.home).norm(), 1e-9);
    for (const VecX& q : result.poses_at_home) {
      for (int limb = 0; limb < 2; ++limb) {
        EXPECT_NEAR(hand.Off(limb, q, result.drives_home[limb]), 0, 1e-8);
        EXPECT_GT(std::abs(hand.Off(limb, q, result.drives_home[limb] + 1e-6)), 1e-8);
      }
    }
  }
}

// A thigh and a shin at a knee, and what else is in a section.
struct Leg {
  std::string bodies, joints, drives, more = "";

  [[nodiscard]] std::string Text() const {
    return "name: leg\nbodies:\n"
           "  thigh: {mass: 3, com: [0, 0, -0.2], inertia: [0.05, 0.05, 0.01], frames: {motor: "
           "[0, 0, -0.1], screw: [-0.06, 0, -0.15], pivot: [0, 0, -0.2], knee: [0, 0, -0.4]}}\n"
           "  shin: {mass: 2, com: [0.02, 0, -0.2], inertia: [0.03, 0.03, 0.005], "
           "frames: {lever: [-0.04, 0, 0], ankle: [0, 0, -0.4]}}\n" +
           bodies +
           "joints:\n"
           "  hip: {kind: revolute, parent: world, child: thigh, axis: y}\n"
           "  knee: {kind: revolute, parent: thigh.knee, child: shin, axis: y}\n" +
           joints + "drives:\n  hip_motor: {kind: joint, joint: hip}\n" + drives + more;
  }
};
// Of a symmetric ankle some are half a turn of roll away; by Newton's method from 900 starts.
TEST(StandinBranches, SymmetricAnkleHasFourPosesAtHome) {
  LoadResult ankle = LoadModel(SourcePath("/tests/mechanisms/parallel_ankle.yaml"), {});
  ASSERT_TRUE(ankle.mechanism.has_value());
  const StandinResult result =
      ComputeStandin(*ankle.mechanism, {"ankle.0", "ankle.1"}, {.ranges = {}, .resolution = 7});
  ASSERT_EQ(result.poses_at_home.size(), 4u);
  for (const StandinPose& pose : result.poses) EXPECT_EQ(pose.joint_poses % 2, 0);
  std::vector<double> pitch;
  for (const VecX& q : result.poses_at_home) {
    pitch.push_back(q[0] / kDegree);
    const bool flat = std::abs(std::remainder(q[1], std::numbers::pi)) < 1e-9;
    EXPECT_TRUE(flat) << q.transpose();
  }
  std::ranges::sort(pitch);
  const std::vector<double> newton = {-162.0057, -28.4632, 0.0, 139.2519};
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(pitch[k], newton[k], 1e-4);
}

constexpr const char* kCrankBody =
    "  crank: {mass: 0.1, com: [-0.02, 0, 0], inertia: [1e-5, 3e-5, 3e-5], "
    "frames: {end: [-0.05, 0, 0]}}\n";
constexpr const char* kHinge =
    "  hinge: {kind: revolute, parent: thigh.motor, child: crank, axis: y}\n";
constexpr const char* kMotor = "  motor: {kind: joint, joint: hinge}\n";

// What is still is part of the world, and nothing along the joints changes by that.
TEST(StandinBranches, MovingPartHasTheSameRatiosAndInertia) {
  const Mechanism robot =
      FromText(Leg{.bodies = std::string(kCrankBody) + R"(
  rod: {mass: 0.2, com: [0, 0, -0.15], inertia: [2e-3, 2e-3, 2e-3], frames: {end: [0.01, 0, -0.3]}}
  arm: {mass: 1, com: [0.1, 0, 0], inertia: [1e-2, 1e-2, 1e-2]}
)",
                   .joints = std::string(kHinge) + R"(
  upper: {kind: spherical, parent: crank.end, child: rod}
  lower: {kind: spherical, parent: shin.lever, child: rod.end}
  shoulder: {kind: revolute, parent: world, child: arm, axis: x}
)",
                   .drives = std::string(kMotor) + "  arm_motor: {kind: joint, joint: shoulder}\n",
                   .more = R"(
motors: {motor: {peak: 1, rotor_inertia: 1e-4, gear_ratio: 6}}
elements:
  stop: {kind: spring, joint: knee, stiffness: 4}
  tension: {kind: spring, joint: hip, stiffness: 9}
)"}
                   .Text());
  Diagnostics diagnostics;
  const auto whole = FindTransmission(robot, {"knee"}, &diagnostics);
  ASSERT_TRUE(whole.has_value()) << diagnostics.Text();
  const Mechanism part = MovingPart(robot, *whole);
  EXPECT_EQ(part.bodies.size(), 4u);  // world, shin, crank, rod
  EXPECT_EQ(part.elements.size(), 1u);
  const auto moving = FindTransmission(part, {"knee"}, &diagnostics);
  ASSERT_TRUE(moving.has_value()) << diagnostics.Text();
  const auto state = [](const Transmission& transmission, double off) {
    ReducedModel model(transmission.full, transmission.coordinates());
    VecX q = model.home(), v = VecX::Zero(q.size()), a = v;
    q[0] = 0.4 + off;
    v[0] = 2;
    a[0] = -7;
    EXPECT_TRUE(model.Move(q, v, a).ok());
    MatX T;
    EXPECT_TRUE(model.Motions(&T).ok());
    const MatX along = T.leftCols(1);
    VecX numbers(3);
    numbers << model.MassMatrix(along)(0, 0), model.Forces(along, {})[0],
        model.DriveRates(along)(transmission.drives[0], 0);
    return numbers;
  };
  EXPECT_LT((state(*whole, 0) - state(*moving, 0)).norm(), 1e-9);
  EXPECT_GT((state(*whole, 0) - state(*moving, 1e-6)).norm(), 1e-8);
}

// A rod past the knee: with the knee's drive at home the ankle has one drive; together they have
// two.
TEST(StandinBranches, DriveAboveStaysAtHome) {
  const Mechanism leg = FromText(Leg{.bodies = std::string(kCrankBody) + R"(
  foot: {mass: 1, com: [0.05, 0, -0.03], inertia: [1e-3, 2e-3, 2e-3], frames: {heel: [-0.05, 0, 0]}}
  rod: {mass: 0.2, com: [0, 0, -0.3], inertia: [2e-3, 2e-3, 2e-3], frames: {end: [0, 0, -0.7]}}
)",
                                     .joints = std::string(kHinge) + R"(
  ankle: {kind: revolute, parent: shin.ankle, child: foot, axis: y}
  upper: {kind: spherical, parent: crank.end, child: rod}
  lower: {kind: spherical, parent: foot.heel, child: rod.end}
)",
                                     .drives = "  knee_motor: {kind: joint, joint: knee}\n"
                                               "  ankle_motor: {kind: joint, joint: hinge}\n"}
                                     .Text());
  const StandinResult alone = ComputeStandin(leg, {"ankle"}, {.ranges = {}, .resolution = 5});
  ASSERT_FALSE(alone.diagnostics.has_errors()) << alone.diagnostics.Text();
  EXPECT_THAT(alone.drives, ElementsAre("ankle_motor"));
  EXPECT_THAT(alone.held, ElementsAre("hip_motor", "knee_motor"));
  ASSERT_EQ(alone.notes.size(), 1u);
  EXPECT_EQ(alone.notes[0],
            "knee_motor moves the chosen joints, too, and stays at home: choose knee as well to "
            "have both move");
  const StandinResult both =
      ComputeStandin(leg, {"knee", "ankle"}, {.ranges = {}, .resolution = 3});
  ASSERT_EQ(both.drives.size(), 2u) << both.diagnostics.Text();
  EXPECT_NEAR(both.J_home(1, 1), alone.J_home(0, 0), 1e-9);
  EXPECT_GT(std::abs(both.J_home(1, 0)), 0.1);
  EXPECT_TRUE(both.notes.empty());
}

TEST(StandinBranches, WhatMovesTheJointsAndIsNotDrivenIsNamed) {
  const auto text = [](const std::string& model) {
    return ComputeStandin(FromText(model), {"knee"}, {}).diagnostics.Text();
  };
  const std::string knee = Leg{}.Text();
  EXPECT_THAT(text(knee.substr(0, knee.find("drives:"))),
              testing::AllOf(HasSubstr("the robot has no drive"), HasSubstr("<actuator> in MJCF")));
  EXPECT_THAT(text(knee), testing::AllOf(HasSubstr("no drive holds knee, which moves the chosen"),
                                         testing::Not(HasSubstr("closure is"))));
  EXPECT_THAT(text(Leg{.bodies = kCrankBody, .joints = kHinge, .drives = kMotor}.Text()),
              HasSubstr("motor moves no loop and no chosen joint: is a loop closure missing"));
}

// A slider and a cylinder; the foot of a slide; two stages of loops, which have no closed form.
TEST(StandinBranches, OtherLimbs) {
  const Mechanism screwed = FromText(Leg{.bodies = R"(
  nut: {mass: 0.1, inertia: [1e-5, 3e-5, 3e-5]}
  rod: {mass: 0.2, com: [0, 0, -0.1], inertia: [2e-3, 2e-3, 2e-3], frames: {end: [0, 0, -0.2]}}
)",
                                         .joints = R"(
  slide: {kind: prismatic, parent: thigh.screw, child: nut, axis: z, guess: -0.05}
  upper: {kind: revolute, parent: nut, child: rod, axis: y}
  lower: {kind: revolute, parent: shin.lever, child: rod.end, axis: y}
)",
                                         .drives = "  screw: {kind: joint, joint: slide}\n"}
                                         .Text());
  const StandinResult screw = ComputeStandin(screwed, {"knee"}, {.ranges = {}, .resolution = 9});
  ASSERT_EQ(screw.usable(), 9u) << screw.diagnostics.Text();
  EXPECT_EQ(screw.limbs[0].kind, "slider and rod");
  EXPECT_EQ(screw.drive_units[0], "m");
  for (const StandinPose& pose : screw.poses) {
    EXPECT_EQ(pose.ways, 2);
    // The nut above the lever's eye by what the rod leaves.
    const double x = -0.04 * std::cos(pose.q[0]), z = -0.4 + 0.04 * std::sin(pose.q[0]);
    EXPECT_NEAR(pose.drives[0], z + std::sqrt(0.04 - std::pow(x + 0.06, 2)) + 0.15, 1e-10);
    EXPECT_TRUE(pose.joint_poses == -1 || pose.joint_poses == 2);
  }
  const double aside = 0.06 - 0.04 * std::cos(screw.home[0]);
  EXPECT_NEAR(screw.limbs[0].other_home - screw.drives_home[0],
              -2 * std::sqrt(0.04 - aside * aside), 1e-9);

  const Mechanism cylinder =
      FromText(Leg{.bodies = "  tube: {mass: 0.3, inertia: [1e-4, 1e-4, 1e-4]}\n"
                             "  piston: {mass: 0.2, inertia: [1e-4, 1e-4, 1e-4]}\n",
                   .joints = R"(
  top: {kind: revolute, parent: thigh.motor, child: tube, axis: y}
  stroke: {kind: prismatic, parent: tube, child: piston, axis: -z, guess: 0.3}
  eye: {kind: revolute, parent: shin.lever, child: piston, axis: y}
)",
                   .drives = "  ram: {kind: joint, joint: stroke}\n"}
                   .Text());
  const StandinResult ram = ComputeStandin(cylinder, {"knee"}, {.ranges = {}, .resolution = 9});
  ASSERT_EQ(ram.usable(), 9u) << ram.diagnostics.Text();
  EXPECT_EQ(ram.limbs[0].kind, "cylinder");
  for (const StandinPose& pose : ram.poses) {
    EXPECT_EQ(pose.ways, 1);
    EXPECT_NEAR(pose.drives[0],
                std::hypot(0.04 * std::cos(pose.q[0]), 0.3 - 0.04 * std::sin(pose.q[0])), 1e-10);
  }

  const Mechanism staged = FromText(Leg{.bodies = std::string(kCrankBody) + R"(
  first: {mass: 0.1, inertia: [1e-4, 1e-4, 1e-4], frames: {end: [0, 0, -0.1]}}
  bell: {mass: 0.1, inertia: [1e-5, 3e-5, 3e-5], frames: {end: [-0.045, 0, 0]}}
  second: {mass: 0.1, inertia: [1e-4, 1e-4, 1e-4], frames: {end: [0, 0, -0.2]}}
)",
                                        .joints = std::string(kHinge) + R"(
  pivot: {kind: revolute, parent: thigh.pivot, child: bell, axis: y}
  a: {kind: revolute, parent: crank.end, child: first, axis: y}
  b: {kind: revolute, parent: bell.end, child: first.end, axis: y}
  c: {kind: revolute, parent: bell.end, child: second, axis: y}
  d: {kind: revolute, parent: shin.lever, child: second.end, axis: y}
)",
                                        .drives = kMotor}
                                        .Text());
  const StandinResult stages = ComputeStandin(staged, {"knee"}, {.ranges = {}, .resolution = 9});
  ASSERT_EQ(stages.usable(), 9u) << stages.diagnostics.Text();
  EXPECT_EQ(stages.limbs[0].kind, "");
  EXPECT_EQ(stages.poses[4].ways, -1);
  EXPECT_TRUE(stages.poses_at_home.empty());
  ASSERT_EQ(stages.ends.size(), 2u);
  for (const StandinEnd& end : stages.ends) {
    EXPECT_THAT(end.kind, testing::AnyOf(StandinEnd::Kind::kDeadCentre, StandinEnd::Kind::kType2));
  }
  EXPECT_THAT(StandinPage(stages, "leg"), HasSubstr("of another kind"));
}

// Two ankles of a biped: four joints, each limb with its own ankle.
TEST(StandinBranches, TwoAnklesAtOnce) {
  const std::string one =
      ReadWholeFile(SourcePath("/tests/mechanisms/parallel_ankle.yaml")).value_or("");
  std::string both = one;
  // Each entry of bodies, joints and drives once more, with "b_" before names of ours.
  for (const char* section : {"\nbodies:\n", "\njoints:\n", "\ndrives:\n"}) {
    const size_t begin = both.find(section) + std::string(section).size();
    const size_t end = both.find("\n\n", begin) + 1;
    std::string copy = both.substr(begin, end - begin);
    for (const char* name :
         {"foot", "left_crank", "right_crank", "left_rod", "right_rod", "ankle", "left_hinge",
          "right_hinge", "left_top", "right_top", "left_heel", "right_heel"}) {
      for (const auto& [before, after] : {std::pair("  ", ":"),
                                          {" child: ", ","},
                                          {" child: ", "}"},
                                          {" child: ", "."},
                                          {" parent: ", "."},
                                          {" joint: ", "}"}}) {
        const std::string from = before + std::string(name) + after;
        for (size_t at = copy.find(from); at != std::string::npos; at = copy.find(from, at + 4)) {
          copy.replace(at, from.size(), before + ("b_" + std::string(name)) + after);
        }
      }
    }
    for (const auto& [from, to] : {std::pair(": &crank", ": &b_crank"),
                                   {": *crank", ": *b_crank"},
                                   {": &rod", ": &b_rod"},
                                   {": *rod", ": *b_rod"},
                                   {"  left: {kind", "  b_left: {kind"},
                                   {"  right: {kind", "  b_right: {kind"}}) {
      if (const size_t at = copy.find(from); at != std::string::npos) {
        copy.replace(at, std::string(from).size(), to);
      }
    }
    both.insert(end, copy);
  }
  const std::vector<std::string> joints = {"ankle.0", "ankle.1", "b_ankle.0", "b_ankle.1"};
  const StandinResult result =
      ComputeStandin(FromText(both), joints, {.ranges = {}, .resolution = 3});
  ASSERT_EQ(result.usable(), 81u) << result.diagnostics.Text();
  const StandinResult single =
      ComputeStandin(FromText(one), {"ankle.0", "ankle.1"}, {.ranges = {}, .resolution = 3});
  EXPECT_THAT(result.drives, ElementsAre("left", "right", "b_left", "b_right"));
  for (size_t i = 0; i < 81; ++i) {
    const MatX& J = result.poses[i].J;
    EXPECT_LT((J.topLeftCorner(2, 2) - single.poses[i / 9].J).norm(), 1e-9);
    EXPECT_LT((J.bottomRightCorner(2, 2) - single.poses[i % 9].J).norm(), 1e-9);
    EXPECT_LT(J.topRightCorner(2, 2).norm() + J.bottomLeftCorner(2, 2).norm(), 1e-9);
    EXPECT_EQ(result.poses[i].ways, 16);
    EXPECT_EQ(result.poses[i].joint_poses, -1);
  }
}

// The same linkage of equal cranks in MJCF and SDF, and one that a coupling drives.
TEST(StandinBranches, RobotsOfOtherFormats) {
  const auto compute = [](const std::string& file, const std::string& joint) {
    LoadResult loaded = LoadRobot(file, {});
    EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
    if (!loaded.mechanism) return StandinResult();
    return ComputeStandin(*loaded.mechanism, {joint}, {.ranges = {}, .resolution = 5});
  };
  const StandinResult mjcf = compute(SourcePath("/tests/fuzz/seeds/mjcf/linkage.xml"), "D");
  ASSERT_EQ(mjcf.usable(), 5u) << mjcf.diagnostics.Text();
  EXPECT_NEAR(mjcf.J_home(0, 0), 1, 1e-12);
  EXPECT_EQ(mjcf.limbs[0].kind, "crank and rod");
  EXPECT_LT(mjcf.map_error.worst, 1e-9);
  // b = 0.1 − 2 a + 0.3 a²; home a = 0: one drive, no limb.
  const StandinResult coupled = compute(SourcePath("/tests/fuzz/seeds/mjcf/coupled.xml"), "b");
  ASSERT_EQ(coupled.usable(), 5u) << coupled.diagnostics.Text();
  EXPECT_NEAR(coupled.J_home(0, 0), -0.5, 1e-9);
  EXPECT_EQ(coupled.limbs[0].kind, "");
  for (const StandinPose& pose : coupled.poses) {
    EXPECT_NEAR(pose.J(0, 0), 1 / (-2 + 0.6 * pose.drives[0]), 1e-9);
  }
}

}  // namespace
}  // namespace mbv
