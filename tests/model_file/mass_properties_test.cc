// Mass properties of meshes against solids that can be computed by hand.
#include "model_file/mesh/mass_properties.h"

#include <gtest/gtest.h>

#include "tests/support/solids.h"

namespace mbv {
namespace {

using test::At;
using test::BoxMesh;
using test::Moved;

Mat3 BoxInertia(double a, double b, double c) {
  return Vec3(b * b + c * c, a * a + c * c, a * a + b * b).asDiagonal() * Mat3(Mat3::Identity()) /
         12.0;
}

TEST(MassProperties, OfABoxAreThoseOfTheTextbook) {
  const TriangleMesh box = BoxMesh(0.1, 0.2, 0.3);
  const MassShape solid = SolidShape(box);
  EXPECT_NEAR(solid.amount, 0.006, 1e-15);
  EXPECT_TRUE(solid.p_cm.isApprox(Vec3(0.05, 0.1, 0.15), 1e-13));
  EXPECT_TRUE(solid.G_cm.isApprox(BoxInertia(0.1, 0.2, 0.3), 1e-13));
  EXPECT_EQ(OpenEdges(box), 0U);
}

TEST(MassProperties, TurnWithTheBoxAndDoNotCareWhereItLies) {
  const Mat3 R = Eigen::AngleAxisd(0.7, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const MassShape solid = SolidShape(Moved(BoxMesh(0.1, 0.2, 0.3), At(Vec3(900, -40, 7), R)));
  EXPECT_TRUE(solid.G_cm.isApprox(R * BoxInertia(0.1, 0.2, 0.3) * R.transpose(), 1e-10))
      << solid.G_cm;
  EXPECT_TRUE(solid.p_cm.isApprox(Vec3(900, -40, 7) + R * Vec3(0.05, 0.1, 0.15), 1e-14));
}

TEST(MassProperties, ASurfaceTurnedInsideOutIsTakenAsMeant) {
  TriangleMesh box = BoxMesh(0.1, 0.2, 0.3);
  for (auto& t : box.triangles) std::swap(t[0], t[1]);
  const MassShape solid = SolidShape(box);
  EXPECT_NEAR(solid.amount, 0.006, 1e-15);
  EXPECT_TRUE(solid.G_cm.isApprox(BoxInertia(0.1, 0.2, 0.3), 1e-13));
}

TEST(MassProperties, OfATubeAreThoseOfTheOuterLessTheInnerCylinder) {
  const double R = 0.05, r = 0.04, h = 0.2;
  const MassShape tube = SolidShape(test::TubeMesh(R, r, h, 720));
  // m (R² + r²) / 2 about its axis, m (3 (R² + r²) + h²) / 12 across; 720 corners miss 1e-5 of it.
  EXPECT_NEAR(tube.G_cm(2, 2), (R * R + r * r) / 2, 1e-4 * R * R);
  EXPECT_NEAR(tube.G_cm(0, 0), (3 * (R * R + r * r) + h * h) / 12, 1e-4 * h * h);
  EXPECT_NEAR(tube.amount, std::numbers::pi * (R * R - r * r) * h, 1e-4 * tube.amount);
}

TEST(MassProperties, OfAShellAreThoseOfItsSixFaces) {
  // Each face: its own inertia, and Steiner's term; together about the middle of a cube of edge 1.
  const MassShape shell = ShellShape(BoxMesh(1, 1, 1));
  EXPECT_NEAR(shell.amount, 6.0, 1e-13);
  EXPECT_TRUE(shell.G_cm.isApprox(5.0 / 18.0 * Mat3::Identity(), 1e-13)) << shell.G_cm;
}

TEST(MassProperties, SteinersTermIsThatOfAPointMass) {
  Mat3 expected;
  expected << 13, -2, -3, -2, 10, -6, -3, -6, 5;
  EXPECT_EQ(PointInertia(Vec3(1, 2, 3)), expected);
}

TEST(Weld, OpenEdgesAreCountedAndSmallGapsAreClosed) {
  TriangleMesh box = BoxMesh(1, 1, 1);
  box.triangles.pop_back();
  EXPECT_EQ(OpenEdges(box), 3U);
  // Each triangle for itself, a little apart, as rounded files have them.
  const TriangleMesh whole = BoxMesh(1, 1, 1);
  TriangleMesh soup;
  for (const auto& t : whole.triangles) {
    std::array<int, 3> moved{};
    for (int k = 0; k < 3; ++k) {
      moved[k] = static_cast<int>(soup.vertices.size());
      soup.vertices.push_back(whole.vertices[t[k]] + 1e-7 * moved[k] * Vec3::Ones());
    }
    soup.triangles.push_back(moved);
  }
  EXPECT_EQ(OpenEdges(soup), 36U);
  EXPECT_EQ(OpenEdges(Welded(soup, 0.0)), 36U);
  const TriangleMesh welded = Welded(soup, 1e-5);
  EXPECT_EQ(OpenEdges(welded), 0U);
  EXPECT_EQ(welded.vertices.size(), 8U);
}

TEST(Weld, PartsThatDoNotTouchAreReported) {
  const TriangleMesh two =
      test::Together(BoxMesh(1, 1, 1), Moved(BoxMesh(1, 2, 1), At(Vec3(5, 0, 0))));
  const std::vector<TriangleMesh> parts = PartsOf(two);
  ASSERT_EQ(parts.size(), 2U);
  EXPECT_NEAR(SolidShape(parts[0]).amount, 1.0, 1e-14);
  EXPECT_NEAR(SolidShape(parts[1]).amount, 2.0, 1e-14);
}

}  // namespace
}  // namespace mbv
