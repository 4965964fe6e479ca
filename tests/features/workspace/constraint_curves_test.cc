// Singularities inside a set, by closed form.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "features/workspace/reachable_set.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// Tsai's translational robot: each leg's two universal joints hold one couple, along what is left
// of the leg d_i = p − δ u_i when its part along the outer axis is taken away. With three legs at
// equal azimuths their determinant is z (√3/2) (3 δ² − 3/4 (x² + y²)): it vanishes on a circle of
// radius 2 δ, whatever z is.
Mechanism ThreeUpu(double delta) {
  LoadResult result = LoadModelText(
      R"yaml(
name: upu
parameters:
  R: {value: 0.3, unit: m}
  r: {value: )yaml" +
          std::to_string(0.3 - delta) + R"yaml(, unit: m}
  h: {value: 0.4, unit: m}
gravity: [0, 0, -9.81]
bodies:
  platform: {mass: 2, inertia: [0.02, 0.02, 0.03]}
parts:
  leg:
    parameters:
      at: {value: 0, unit: rad}
    attach:
      world: {U: {position: [R*cos(at), R*sin(at), 0], rotation: {axis: z, angle: at}}}
      platform: {S: {position: [r*cos(at), r*sin(at), 0], rotation: {axis: z, angle: at}}}
    bodies:
      cyl: {mass: 1, com: [0, 0, 0.1], inertia: [0.01, 0.01, 0.001]}
      rod: {mass: 1, com: [0, 0, -0.1], inertia: [0.01, 0.01, 0.001]}
    joints:
      U: {kind: universal, parent: world.U, child: cyl, axis: y, axis2: x, guess: ["-asin((R - r)/sqrt(h^2 + (R - r)^2))", 0]}
      P: {kind: prismatic, parent: cyl, child: rod, axis: z, guess: "sqrt(h^2 + (R - r)^2)", range: [0.25, 0.75]}
      V: {kind: universal, parent: rod, child: platform.S, axis: x, axis2: y, guess: [0, "asin((R - r)/sqrt(h^2 + (R - r)^2))"]}
    drives:
      length: {kind: joint, joint: P}
instances:
  leg1: {part: leg, at: 0}
  leg2: {part: leg, at: 2*pi/3}
  leg3: {part: leg, at: 4*pi/3}
outputs: {platform: platform}
)yaml",
      "upu.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}

std::vector<TracedArc> CurvesOf(const Mechanism& mechanism, const std::vector<std::string>& at) {
  SetArguments arguments;
  arguments.over = {"x", "y"};
  arguments.at = at;
  arguments.flood.resolution = 48;
  Diagnostics diagnostics;
  const auto question = ReadQuestion(mechanism, arguments, &diagnostics);
  EXPECT_TRUE(question.has_value()) << diagnostics.Text();
  const ReachableSet set = ComputeReachableSet(*question, arguments);
  EXPECT_TRUE(set.agree) << set.verdict;
  return ConstraintCurves(*question, set);
}

TEST(ConstraintCurves, OfATranslationalRobotAreTheCircleOfItsClosedForm) {
  for (const double delta : {0.15, 0.12}) {
    for (const char* z : {"z=0.4", "z=0.5"}) {
      const std::vector<TracedArc> arcs = CurvesOf(ThreeUpu(delta), {z});
      double length = 0.0, off = 0.0, half = 0.0;
      for (const TracedArc& arc : arcs) {
        ASSERT_EQ(arc.points.size(), 2u);
        length += (arc.points[1] - arc.points[0]).norm();
        for (const Eigen::Vector2d& p : arc.points) {
          off = std::max(off, std::abs(p.norm() - 2 * delta));
          half = std::max(half, std::abs(p.norm() - 2 * delta * 1.0001));
        }
      }
      EXPECT_LT(off, 1e-7) << delta << z;
      EXPECT_GT(half, 1e-5);  // another circle would be noticed
      // All around: chords are shorter than the circle.
      const double circle = 4 * std::numbers::pi * delta;
      EXPECT_LT(length, circle);
      EXPECT_GT(length, 0.98 * circle);
    }
  }
}

// The same circle at every height: a part of its cylinder.
TEST(ConstraintCurves, OfASolidAreTheSurfaceOfTheClosedForm) {
  const Mechanism mechanism = ThreeUpu(0.15);
  SetArguments arguments;
  arguments.over = {"x=0.2:0.38", "y=-0.1:0.1", "z=0.38:0.44"};
  arguments.flood.resolution = 24;
  Diagnostics diagnostics;
  const auto question = ReadQuestion(mechanism, arguments, &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  const ReachableSet set =
      ComputeReachableSet(*question, arguments, {}, nullptr, {.boundary = false});
  ASSERT_TRUE(set.summary.ok()) << set.diagnostics.Text() << set.verdict;
  const TriangleMesh surface = SingularSurface(*question, set, SetBound::Kind::kConstraint);
  double off = 0.0, other = 1.0;
  for (const Vec3& p : surface.vertices) {
    off = std::max(off, std::abs(p.head<2>().norm() - 0.3));
    other = std::min(other, std::abs(p.head<2>().norm() - 0.3 * 1.0001));
  }
  EXPECT_LT(off, 1e-7);
  EXPECT_GT(other, 1e-5);  // another cylinder would be noticed
  // Within the box, but for the cells at its sides.
  const double whole = 2 * 0.3 * std::asin(0.1 / 0.3) * 0.06;
  const double area = AreaOf(surface, 0, surface.triangles.size());
  EXPECT_LT(area, whole);
  EXPECT_GT(area, 0.5 * whole);
  EXPECT_TRUE(ConstraintCurves(*question, set).empty());
}

// Three struts hold a platform in the plane: its drives lose their hold where their lines meet.
constexpr std::array<double, 6> kFeet = {0.5, 0.1, -0.3, 0.45, -0.2, -0.5},
                                kEnds = {0.12, 0.0, -0.05, 0.1, -0.06, -0.11};
double LinesOf(const Vec3& at, double end) {
  const Mat3 R = Eigen::AngleAxisd(at[2], Vec3::UnitZ()).toRotationMatrix();
  Mat3 lines;
  for (int i = 0; i < 3; ++i) {
    const auto k = size_t{2} * static_cast<size_t>(i);
    const Vec3 b = R * Vec3(kEnds.at(k) + (i == 0 ? end : 0.0), kEnds.at(k + 1), 0.0);
    const Vec3 d = Vec3(at[0], at[1], 0.0) + b - Vec3(kFeet.at(k), kFeet.at(k + 1), 0.0);
    lines.row(i) << d[0], d[1], b.cross(d)[2];
  }
  return lines.determinant();
}
// How far a pose is from where the lines meet, about [m or rad].
double OffLines(const Vec3& at, double end) {
  constexpr double step = 1e-6;
  Vec3 slope;
  for (int c = 0; c < 3; ++c) {
    const Vec3 h = step * Vec3::Unit(c);
    slope[c] = (LinesOf(at + h, end) - LinesOf(at - h, end)) / (2 * step);
  }
  return std::abs(LinesOf(at, end)) / slope.norm();
}

TEST(SingularSurface, OfDrivesInsideASolidIsWhereTheirLinesMeet) {
  const LoadResult result = LoadModelText(R"yaml(
name: struts
gravity: [0, 0, 0]
world: {frames: {A1: [0.5, 0.1, 0], A2: [-0.3, 0.45, 0], A3: [-0.2, -0.5, 0]}}
bodies:
  platform:
    mass: 1
    inertia: [0.01, 0.01, 0.01]
    frames: {B1: [0.12, 0, 0], B2: [-0.05, 0.1, 0], B3: [-0.06, -0.11, 0]}
joints:
  base: {kind: planar, parent: world, child: platform, axis: z, guess: [0.01, 0.02, 0.5]}
drives:
  a: {kind: distance, from: world.A1, to: platform.B1}
  b: {kind: distance, from: world.A2, to: platform.B2}
  c: {kind: distance, from: world.A3, to: platform.B3}
outputs: {platform: platform}
)yaml",
                                          "struts.yaml");
  ASSERT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  SetArguments arguments;
  arguments.over = {"x=-0.1:0.12", "y=-0.09:0.1", "yaw_deg=-50:45"};
  arguments.flood.resolution = 24;
  arguments.cross_singularities = true;
  Diagnostics diagnostics;
  const auto question = ReadQuestion(*result.mechanism, arguments, &diagnostics);
  ASSERT_TRUE(question.has_value()) << diagnostics.Text();
  const ReachableSet set =
      ComputeReachableSet(*question, arguments, {}, nullptr, {.boundary = false});
  ASSERT_TRUE(set.summary.ok()) << set.diagnostics.Text() << set.verdict;
  const TriangleMesh surface = SingularSurface(*question, set, SetBound::Kind::kType2);
  ASSERT_GT(surface.triangles.size(), 100u);
  double off = 0.0, other = 0.0;
  for (const Vec3& p : surface.vertices) {
    off = std::max(off, OffLines(p, 0.0));
    other = std::max(other, OffLines(p, 1e-5));
  }
  EXPECT_LT(off, 1e-8);
  EXPECT_GT(other, 1e-6);  // an end that is 10 µm elsewhere would be noticed
  // It ends at the sides of the box alone.
  std::map<std::pair<int, int>, int> edges;
  for (const auto& triangle : surface.triangles) {
    for (size_t k = 0; k < 3; ++k) ++edges[std::minmax(triangle.at(k), triangle.at((k + 1) % 3))];
  }
  for (const auto& [edge, count] : edges) {
    if (count != 1) continue;
    for (const int v : {edge.first, edge.second}) {
      const Vec3& p = surface.vertices[static_cast<size_t>(v)];
      double side = 1.0;
      for (size_t c = 0; c < 3; ++c) {
        const double x = p[static_cast<Eigen::Index>(c)], cell = set.flooded.lattice_step.at(c);
        side = std::min({side, (x - set.box[c].lower) / cell, (set.box[c].upper - x) / cell});
      }
      EXPECT_LT(side, 1.0) << p.transpose();
    }
  }
  EXPECT_TRUE(SingularSurface(*question, set, SetBound::Kind::kConstraint).triangles.empty());
}

TEST(ConstraintCurves, AreNoneOfRobotsThatHaveNone) {
  LoadResult result = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"));
  EXPECT_TRUE(CurvesOf(*result.mechanism, {}).empty());
}

}  // namespace
}  // namespace mbv
