// Sets that end where bodies touch, and where a ball joint's range does, against areas by hand.
#include "features/workspace/interference.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "features/workspace/reachable_set.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

using std::numbers::pi;

TEST(Interference, GapsAreThoseByHand) {
  const Pose here = Pose::Identity();
  Pose there = here;
  there.translation() = Vec3(0.5, 0, 0);
  const ConvexShape ball{.points = {Vec3(0, 0.3, 0)}, .radius = 0.1};
  ConvexShape box;
  for (int k = 0; k < 8; ++k) {
    box.points.emplace_back((k & 1) != 0 ? 0.1 : -0.1, (k & 2) != 0 ? 0.1 : -0.1,
                            (k & 4) != 0 ? 0.1 : -0.1);
  }
  EXPECT_NEAR(GapOf(ball, here, box, here), 0.1, 1e-15);                          // a face
  EXPECT_NEAR(GapOf(ball, here, box, there), std::hypot(0.4, 0.2) - 0.1, 1e-15);  // an edge
  EXPECT_NEAR(GapOf(box, here, box, there), 0.3, 1e-15);
  Pose turned = there;
  turned.rotate(Eigen::AngleAxisd(pi / 4, Vec3::UnitZ()));
  EXPECT_NEAR(GapOf(box, here, box, turned), 0.4 - 0.1 * std::sqrt(2.0), 1e-15);
  turned.translation() = Vec3(0.01, 0.02, 0);
  EXPECT_NEAR(GapOf(box, here, box, turned), 0.0, 1e-15);  // they overlap
  // A segment's middle as a third point of it: hulls instead of the closed form.
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  const auto point = [&] { return Vec3(normal(random), normal(random), normal(random)); };
  for (int i = 0; i < 500; ++i) {
    const ConvexShape a{.points = {point(), point()}, .radius = 0.1};
    const ConvexShape b{.points = {point(), point()}};
    ConvexShape hull = a;
    hull.points.emplace_back(0.5 * (a.points[0] + a.points[1]));
    Pose X = Pose::Identity();
    X.rotate(Eigen::AngleAxisd(normal(random), point().normalized()));
    const double gap = GapOf(a, X, b, here);
    EXPECT_NEAR(GapOf(hull, X, b, here), gap, 1e-12) << i;
    // No two points are nearer, and some are as near.
    double least = 1e9;
    for (int s = 0; s <= 100; ++s) {
      for (int t = 0; t <= 100; ++t) {
        least = std::min(least, (X * Vec3(a.points[0] + 0.01 * s * (a.points[1] - a.points[0])) -
                                 b.points[0] - 0.01 * t * (b.points[1] - b.points[0]))
                                        .norm() -
                                    0.1);
      }
    }
    EXPECT_GE(least, gap - 1e-12);
    EXPECT_LT(least, gap + 0.05);
  }
}

ReachableSet Ask(const std::string& model, const SetArguments& arguments) {
  LoadResult loaded = LoadModelText(model, "set.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  Diagnostics diagnostics;
  const auto question = ReadQuestion(*loaded.mechanism, arguments, &diagnostics);
  EXPECT_TRUE(question.has_value()) << diagnostics.Text();
  ReachableSet set = ComputeReachableSet(*question, arguments);
  EXPECT_FALSE(set.diagnostics.has_errors()) << set.diagnostics.Text();
  return set;
}

// A ball of 0.02 m on two slides, 0.6 × 0.4 m, beside an obstacle.
std::string Gantry(const std::string& obstacle) {
  return fmt::format(R"(
name: gantry
bodies:
  bridge: {{mass: 1, inertia: [1, 1, 1]}}
  tool: {{mass: 1, inertia: [1, 1, 1], shapes: [{{ball: {{radius: 0.02}}}}]}}
  post: {{mass: 1, inertia: [1, 1, 1], shapes: [{}]}}
joints:
  x: {{kind: prismatic, parent: world, child: bridge, axis: x, guess: -0.15, range: [-0.3, 0.3]}}
  y: {{kind: prismatic, parent: bridge, child: tool, axis: y, guess: 0.02, range: [-0.2, 0.2]}}
  foot: {{kind: fixed, parent: world, child: post}}
drives:
  x: {{kind: joint, joint: x}}
  y: {{kind: joint, joint: y}}
outputs: {{tool: tool}}
)",
                     obstacle);
}

TEST(Interference, ASetEndsAtItsClearanceFromAnObstacle) {
  SetArguments arguments;
  arguments.over = {"x", "y"};
  arguments.flood.resolution = 80;
  arguments.clearance = 0.01;
  const auto expect = [&](const std::string& obstacle, const auto& excluded) {
    const ReachableSet set = Ask(Gantry(obstacle), arguments);
    ASSERT_TRUE(set.agree) << set.verdict;
    const double area = 0.24 - excluded(0.03);
    EXPECT_NEAR(set.traced.measure, area, 1e-7) << obstacle;
    // A clearance of 0.1 mm more shows.
    EXPECT_GT(excluded(0.0301) - excluded(0.03), 10 * (set.traced.error + 1e-7));
    ASSERT_FALSE(set.shares.empty());
    EXPECT_TRUE(std::ranges::any_of(set.shares, [&](const BoundShare& share) {
      return share.bound >= 0 &&
             set.bounds[static_cast<size_t>(share.bound)].name == "tool to post";
    }));
    SetArguments without = arguments;
    without.clearance = kNan;
    EXPECT_NEAR(Ask(Gantry(obstacle), without).traced.measure, 0.24, 1e-9);
  };
  expect("{capsule: {from: [0.1, 0, -0.3], to: [0.1, 0, 0.3], radius: 0.05}}",
         [](double r) { return pi * std::pow(0.05 + r, 2); });
  expect("{box: {size: [0.1, 0.06, 0.2], at: [0.1, 0.01, 0]}}",
         [](double r) { return 0.1 * 0.06 + 2 * 0.16 * r + pi * r * r; });
}

// Shapes that overlap at home, as pictures do, end nothing, and are named.
TEST(Interference, ShapesThatTouchAtHomeAreNamed) {
  SetArguments arguments;
  arguments.over = {"x", "y"};
  arguments.flood.resolution = 40;
  arguments.clearance = 0.01;
  const ReachableSet set = Ask(Gantry("{ball: {at: [-0.15, 0, 0], radius: 0.05}}"), arguments);
  EXPECT_NEAR(set.traced.measure, 0.24, 1e-9);
  EXPECT_THAT(set.notes, testing::Contains(testing::HasSubstr("end nothing: tool to post")));
}

// A ball joint's range is one of the whole rotation: cos ½r cos ½p ≥ cos ½α without yaw.
TEST(Interference, ASphericalJointsRangeEndsItsSet) {
  const std::string model = R"(
name: ball
bodies:
  rod: {mass: 1, com: [0, 0, 0.1], inertia: [0.01, 0.01, 0.01]}
joints:
  s: {kind: spherical, parent: world, child: rod, range_deg: [0, 40]}
outputs: {rod: rod}
)";
  SetArguments arguments;
  arguments.over = {"roll", "pitch"};
  arguments.flood.resolution = 60;
  const ReachableSet set = Ask(model, arguments);
  ASSERT_TRUE(set.agree) << set.verdict;
  const double alpha = 40 * pi / 180;
  double area = 0.0;
  constexpr int n = 2000;  // r = α sin φ: smooth to the ends
  for (int i = 0; i < n; ++i) {
    const double phi = pi / 2 * (i + 0.5) / n, r = alpha * std::sin(phi);
    area += 4 * 2 * std::acos(std::cos(alpha / 2) / std::cos(r / 2)) * alpha * std::cos(phi) * pi /
            2 / n;
  }
  EXPECT_NEAR(set.traced.measure, area, 1e-6);
  EXPECT_EQ(set.bounds[static_cast<size_t>(set.shares[0].bound)].name, "rotation of s at 40°");
}

}  // namespace
}  // namespace mbv
