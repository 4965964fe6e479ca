// Places reached with all, or some, of a range of orientations, against areas by hand.
#include "features/workspace/fibre.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "features/workspace/reachable_set.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

using std::numbers::pi;
using testing::HasSubstr;
using Vec2 = Eigen::Vector2d;

Mechanism RobotFrom(const std::string& text) {
  LoadResult result = LoadModelText(text, "range.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}

// Three struts from feet on a circle of 0.5 m to a platform of 0.1 m; nothing is symmetric.
constexpr std::array<double, 3> kFoot = {0.2, 2.2, 4.4}, kBall = {0.0, 2.1, 4.2};
constexpr double kShort = 0.25, kLong = 0.62;
const std::string k3Rpr = R"(
name: planar_3rpr
parameters: {R: {value: 0.5, unit: m}, r: {value: 0.1, unit: m}}
gravity: [0, 0, 0]
bodies:
  platform: {mass: 1, inertia: [0.01, 0.01, 0.01]}
parts:
  limb:
    parameters: {phi: 0, psi: 0}
    attach:
      world: {A: {position: [R*cos(phi), R*sin(phi), 0]}}
      platform: {B: {position: [r*cos(psi), r*sin(psi), 0]}}
    bodies:
      base: {mass: 0.2, inertia: [0.001, 0.001, 0.001]}
      rod: {mass: 0.2, inertia: [0.001, 0.001, 0.001]}
    joints:
      A: {kind: revolute, parent: world.A, child: base, axis: z, guess: phi + 3.1}
      slide: {kind: prismatic, parent: base, child: rod, axis: x, guess: 0.4, range: [0.25, 0.62]}
      B: {kind: revolute, parent: platform.B, child: rod, axis: z, closure: true}
    drives:
      strut: {kind: joint, joint: slide}
instances:
  a: {part: limb, phi: 0.2, psi: 0}
  b: {part: limb, phi: 2.2, psi: 2.1}
  c: {part: limb, phi: 4.4, psi: 4.2}
joints:
  base: {kind: planar, parent: world, child: platform, axis: z, guess: [0.01, 0.02, 0.05], closure: false}
outputs: {platform: platform}
)";

// Distance of a strut's ends: √(|d|² + r² + 2 |d| r cos(φ − δ)), d from the foot to the platform.
struct Strut {
  double d, delta;
};
Strut StrutAt(const Vec2& p, size_t i) {
  const Vec2 d = p - 0.5 * Vec2(std::cos(kFoot.at(i)), std::sin(kFoot.at(i)));
  return {d.norm(), std::atan2(d[1], d[0]) - kBall.at(i)};
}
double LengthAt(const Strut& strut, double phi) {
  return std::sqrt(strut.d * strut.d + 0.01 + 0.2 * strut.d * std::cos(phi - strut.delta));
}

// The least of all struts' margins over all φ: at the ends, or where the cosine is ±1.
double AllOf(const Vec2& p, double low, double high) {
  double least = 1.0;
  for (size_t i = 0; i < 3; ++i) {
    const Strut strut = StrutAt(p, i);
    const auto offer = [&](double phi) {
      const double length = LengthAt(strut, phi);
      least = std::min({least, length - kShort, kLong - length});
    };
    offer(low);
    offer(high);
    for (int k = -4; k <= 4; ++k) {
      const double phi = strut.delta + k * pi;
      if (phi > low && phi < high) offer(phi);
    }
  }
  return least;
}

// Whether there is a φ: the cosines between their bounds give intervals.
double SomeOf(const Vec2& p, double low, double high) {
  std::vector<std::pair<double, double>> open = {{low, high}};
  for (size_t i = 0; i < 3; ++i) {
    const Strut strut = StrutAt(p, i);
    const auto cosine = [&](double length) {
      return (length * length - strut.d * strut.d - 0.01) / (0.2 * strut.d);
    };
    const double a = cosine(kShort), b = cosine(kLong);
    if (a > 1.0 || b < -1.0) return -1.0;
    const double from = std::acos(std::min(b, 1.0)), to = std::acos(std::max(a, -1.0));
    std::vector<std::pair<double, double>> kept;
    for (const auto& [l, h] : open) {
      for (int k = -2; k <= 2; ++k) {
        for (const double sign : {-1.0, 1.0}) {
          const double centre = strut.delta + 2 * pi * k;
          const double x = centre + std::min(sign * from, sign * to),
                       y = centre + std::max(sign * from, sign * to);
          if (std::max(l, x) < std::min(h, y)) kept.emplace_back(std::max(l, x), std::min(h, y));
        }
      }
    }
    open = kept;
  }
  return open.empty() ? -1.0 : 1.0;
}

// ½ ∮ r² dα about a place inside, r by halving.
double AreaOf(const std::function<double(const Vec2&)>& margin, const Vec2& centre) {
  constexpr int n = 6000;
  double sum = 0.0;
  for (int i = 0; i < n; ++i) {
    const double angle = 2 * pi * (i + 0.5) / n;
    const Vec2 way(std::cos(angle), std::sin(angle));
    double in = 0.0, out = 1.0;
    for (int k = 1; k <= 400 && out == 1.0; ++k) {
      const double r = 0.0025 * k;
      (margin(centre + r * way) >= 0.0 ? in : out) = r;
    }
    for (int k = 0; k < 40; ++k) {
      const double r = 0.5 * (in + out);
      (margin(centre + r * way) >= 0.0 ? in : out) = r;
    }
    sum += pi / n * in * in;
  }
  return sum;
}

struct RangeAnswer {
  std::optional<SetQuestion> question;
  ReachableSet set;
  Diagnostics diagnostics;
};
RangeAnswer AskRange(const std::string& model, const SetArguments& arguments) {
  RangeAnswer answer;
  answer.question = ReadQuestion(RobotFrom(model), arguments, &answer.diagnostics);
  if (!answer.question) return answer;
  answer.set = ComputeReachableSet(*answer.question, arguments);
  answer.diagnostics.Append(answer.set.diagnostics);
  return answer;
}
SetArguments OverRange(const std::vector<std::string>& over, int resolution) {
  SetArguments arguments;
  arguments.over = over;
  arguments.flood.resolution = resolution;
  arguments.cross_singularities = true;
  return arguments;
}
void ExpectArea(const RangeAnswer& answer, double area, double within) {
  ASSERT_TRUE(answer.set.summary.ok()) << answer.diagnostics.Text() << answer.set.verdict;
  EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
  EXPECT_NEAR(answer.set.traced.measure, area, answer.set.traced.error);
  EXPECT_NEAR(answer.set.flooded.measure, area, answer.set.flooded.error);
  EXPECT_LT(answer.set.traced.error, within * area);
  EXPECT_LT(answer.set.flooded.error, 10 * within * area);
  EXPECT_GT(answer.set.checked, 0u);
  EXPECT_LT(answer.set.checked_off, 1e-9);
}

TEST(Fibre, PlacesWithAllOfARangeAreThoseByHand) {
  SetArguments arguments = OverRange({"x", "y"}, 80);
  arguments.for_all = {"yaw_deg=-15:20"};
  const RangeAnswer answer = AskRange(k3Rpr, arguments);
  const auto area = [](double low, double high) {
    return AreaOf([=](const Vec2& p) { return AllOf(p, low, high); }, Vec2(0.01, 0.02));
  };
  const double truth = area(-pi / 12, pi / 9);
  ExpectArea(answer, truth, 3e-4);
  // A range that is wider by 5° shows.
  EXPECT_GT(truth - area(-pi / 12, pi / 9 + pi / 36),
            3 * (answer.set.traced.error + answer.set.flooded.error));
  // A lattice that goes through another range disagrees.
  RangeAnswer wrong = answer;
  arguments.flood.resolution = 40;
  SpaceSettings other = answer.question->settings;
  other.ranged[0].range.upper = pi / 9 + pi / 22.5;
  PoseSpace counted(answer.question->mechanism, other);
  PlacedPose home, start;
  ASSERT_TRUE(counted.Home(&home));
  counted.CountFrom(&home);
  ASSERT_TRUE(counted.Close(home, answer.question->start, &start));
  wrong.set.flooded =
      FloodSet(counted, start, arguments.flood, PlanFlood(counted, start, arguments.flood));
  JudgeSet(&wrong.set);
  EXPECT_FALSE(wrong.set.agree) << wrong.set.verdict;
}

TEST(Fibre, PlacesWithSomeOfARangeAreThoseByHand) {
  SetArguments arguments = OverRange({"x", "y"}, 80);
  arguments.for_some = {"yaw_deg=-15:20"};
  const RangeAnswer answer = AskRange(k3Rpr, arguments);
  const auto area = [](double low, double high) {
    return AreaOf([=](const Vec2& p) { return SomeOf(p, low, high); }, Vec2(0.01, 0.02));
  };
  const double truth = area(-pi / 12, pi / 9);
  ExpectArea(answer, truth, 3e-4);
  EXPECT_GT(area(-pi / 12, pi / 9 + pi / 36) - truth,
            3 * (answer.set.traced.error + answer.set.flooded.error));
}

// A path: the ends that all orientations share, and those of the farthest.
TEST(Fibre, APathEndsWhereTheFirstOrTheLastOrientationDoes) {
  SetArguments arguments = OverRange({"x"}, 200);
  arguments.for_all = {"yaw_deg=-15:20"};
  arguments.at = {"y=0.02"};
  const auto end = [](auto margin) {
    double in = 0.01, out = 0.01;
    while (margin(Vec2(out, 0.02)) >= 0.0) out += 0.001;
    for (int k = 0; k < 50; ++k) {
      const double x = 0.5 * (in + out);
      (margin(Vec2(x, 0.02)) >= 0.0 ? in : out) = x;
    }
    return in;
  };
  const RangeAnswer all = AskRange(k3Rpr, arguments);
  ASSERT_EQ(all.set.traced.ends.size(), 2u) << all.diagnostics.Text() << all.set.verdict;
  EXPECT_TRUE(all.set.agree) << all.set.verdict;
  EXPECT_NEAR(all.set.traced.ends[1].first,
              end([](const Vec2& p) { return AllOf(p, -pi / 12, pi / 9); }), 1e-5);
  arguments.for_some = std::exchange(arguments.for_all, {});
  const RangeAnswer some = AskRange(k3Rpr, arguments);
  EXPECT_TRUE(some.set.agree) << some.set.verdict;
  EXPECT_NEAR(some.set.traced.ends[1].first,
              end([](const Vec2& p) { return SomeOf(p, -pi / 12, pi / 9); }), 1e-5);
}

// Two ranges at once: places along x outside of a ball for all, or some, y and z of a box.
TEST(Fibre, TwoRangesAreABox) {
  const std::string gantry = R"(
name: gantry
bodies:
  bridge: {mass: 1, inertia: [1, 1, 1]}
  trolley: {mass: 1, inertia: [1, 1, 1]}
  tool: {mass: 1, inertia: [1, 1, 1]}
world: {frames: {centre: [0, 0, -0.2]}}
joints:
  x: {kind: prismatic, parent: world, child: bridge, axis: x, guess: 0.27, range: [-0.3, 0.3]}
  y: {kind: prismatic, parent: bridge, child: trolley, axis: y, guess: 0.01}
  z: {kind: prismatic, parent: trolley, child: tool, axis: z, guess: -0.12}
drives:
  x: {kind: joint, joint: x}
  y: {kind: joint, joint: y}
  z: {kind: joint, joint: z}
  strut: {kind: distance, from: world.centre, to: tool, range: [0.25, 2]}
outputs: {tool: tool}
)";
  SetArguments arguments = OverRange({"x"}, 200);
  arguments.for_all = {"y=-0.05:0.08", "z=-0.15:-0.1"};
  // Nearest at (0, −0.15), farthest at (0.08, −0.1).
  const double all = std::sqrt(0.0625 - 0.0025), some = std::sqrt(0.0625 - 0.0064 - 0.01);
  for (const double end : {all, some}) {
    const RangeAnswer answer = AskRange(gantry, arguments);
    ASSERT_EQ(answer.set.traced.ends.size(), 2u) << answer.diagnostics.Text() << answer.set.verdict;
    EXPECT_TRUE(answer.set.agree) << answer.set.verdict;
    EXPECT_NEAR(answer.set.traced.ends[0].first, end, 1e-5);
    EXPECT_NEAR(answer.set.traced.ends[1].first, 0.3, 1e-9);
    arguments.for_some = std::exchange(arguments.for_all, {});
  }
}

// An arm of r turns at the end of a gantry, its tip within L of a centre.
std::string TurningArm(double r, double L) {
  return fmt::format(R"(
name: arm
bodies:
  bridge: {{mass: 1, inertia: [1, 1, 1]}}
  trolley: {{mass: 1, inertia: [1, 1, 1]}}
  quill: {{mass: 1, inertia: [1, 1, 1]}}
  arm: {{mass: 1, inertia: [1, 1, 1], frames: {{tip: [{}, 0, 0]}}}}
world: {{frames: {{centre: [{}, 0.02, 0.03]}}}}
joints:
  x: {{kind: prismatic, parent: world, child: bridge, axis: x}}
  y: {{kind: prismatic, parent: bridge, child: trolley, axis: y}}
  z: {{kind: prismatic, parent: trolley, child: quill, axis: z}}
  turn: {{kind: revolute, parent: quill, child: arm, axis: z}}
drives:
  x: {{kind: joint, joint: x}}
  y: {{kind: joint, joint: y}}
  z: {{kind: joint, joint: z}}
  turn: {{kind: joint, joint: turn}}
  reach: {{kind: distance, from: world.centre, to: arm.tip, range: [-1, {}]}}
outputs: {{hub: arm}}
)",
                     r, r > L ? r : 0.02, L);
}
void ExpectVolume(const RangeAnswer& answer, double volume, double other) {
  ExpectArea(answer, volume, 1e-2);
  EXPECT_LT(answer.set.traced.error, 4e-3 * volume);
  // An arm that is a hundredth longer shows.
  EXPECT_GT(std::abs(volume - other), 2 * answer.set.traced.error);
}

// At each height z from the centre the whole turn has a disc of R − r, R² = L² − z², up to z = h.
TEST(Fibre, ASolidOfAllOfATurnIsThatByHand) {
  SetArguments arguments = OverRange({"x", "y", "z"}, 16);
  arguments.for_all = {"turn_deg=-180:180"};
  const auto volume = [](double r, double L) {
    const double h = std::sqrt(L * L - r * r);
    return 2 * pi * (h * L * L - h * h * h / 3 - r * L * L * std::asin(h / L));
  };
  const RangeAnswer answer = AskRange(TurningArm(0.1, 0.2), arguments);
  ExpectVolume(answer, volume(0.1, 0.2), volume(0.101, 0.2));
  const double h = std::sqrt(0.2 * 0.2 - 0.1 * 0.1);
  EXPECT_NEAR(answer.set.traced.low, 0.03 - h, 1e-4);
  EXPECT_NEAR(answer.set.traced.high, 0.03 + h, 1e-4);
}

// What a ball sweeps along an arc [Pappus], and its halves at both ends.
TEST(Fibre, ASolidOfSomeOfATurnIsThatByHand) {
  SetArguments arguments = OverRange({"x", "y", "z"}, 16);
  arguments.for_some = {"turn_deg=-20:25"};
  const auto volume = [](double r, double L) { return pi * L * L * (pi / 4 * r + 4.0 / 3.0 * L); };
  const RangeAnswer answer = AskRange(TurningArm(0.3, 0.1), arguments);
  ExpectVolume(answer, volume(0.3, 0.1), volume(0.303, 0.1));
  EXPECT_NEAR(answer.set.traced.high, 0.13, 1e-4);
}

TEST(Fibre, WhatCannotBeAskedIsRefused) {
  SetArguments arguments = OverRange({"x", "y"}, 20);
  arguments.for_all = {"yaw_deg=-15:20"};
  arguments.for_some = {"yaw=1", "x=0:1"};
  EXPECT_THAT(AskRange(k3Rpr, arguments).diagnostics.Text(),
              testing::AllOf(HasSubstr("--for-all is stated, too"), HasSubstr("two numbers"),
                             HasSubstr("'platform.x' is stated twice")));
  // No place turns by so much.
  arguments.for_some = {};
  arguments.for_all = {"yaw_deg=-80:80"};
  for (const char* strut : {"a", "b", "c"}) {
    arguments.ranges.push_back(fmt::format("{}.strut=0.3:0.45", strut));
  }
  EXPECT_THAT(AskRange(k3Rpr, arguments).set.verdict, HasSubstr("has all of the range"));
}

}  // namespace
}  // namespace mbv
