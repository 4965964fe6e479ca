// Meshes for pictures keep their shape with fewer triangles.
#include "model_file/mesh/decimate.h"

#include <gtest/gtest.h>

#include "model_file/mesh/mass_properties.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

TEST(Decimate, KeepsTheShapeOfABallWithATenthOfItsTriangles) {
  const TriangleMesh ball = test::EllipsoidMesh(Vec3(0.3, 0.2, 0.1), 100);
  ASSERT_GT(ball.triangles.size(), 39000U);
  const TriangleMesh few = Decimated(ball, 4000);
  EXPECT_LE(few.triangles.size(), 4000U);
  EXPECT_GT(few.triangles.size(), 1000U);
  EXPECT_EQ(OpenEdges(few), 0U);
  const double volume = SolidShape(ball).amount;
  EXPECT_NEAR(SolidShape(few).amount, volume, 0.02 * volume);
  EXPECT_NEAR(DiagonalOf(few), DiagonalOf(ball), 0.02 * DiagonalOf(ball));
}

TEST(Decimate, LeavesSmallMeshesAsTheyAre) {
  const TriangleMesh box = test::BoxMesh(1, 2, 3);
  EXPECT_EQ(Decimated(box, 12).triangles, box.triangles);
  EXPECT_TRUE(Decimated(box, 0).triangles.empty());
}

TEST(Decimate, SharesGoToLargeMeshesAfterSmallOnesHaveAllTheyNeed) {
  const TriangleMesh box = test::BoxMesh(1, 2, 3), ball = test::EllipsoidMesh(Vec3::Ones(), 20);
  EXPECT_EQ(SharesOf({&ball, &box, &ball}, 1012), (std::vector<size_t>{500, 12, 500}));
  EXPECT_EQ(SharesOf({&box}, 1000), std::vector<size_t>{12});
}

TEST(Decimate, SurfacesThatAreShownTwiceAreThereOnce) {
  Mechanism m;
  m.bodies = {test::SoundBody(test::BoxMesh(1, 2, 3), 1.0),
              test::SoundBody(test::EllipsoidMesh(Vec3::Ones(), 20), 1.0)};
  m.bodies[0].shapes.push_back(m.bodies[1].shapes[0]);
  const DrawnSurfaces surfaces(m, 200);
  ASSERT_EQ(surfaces.drawn().size(), 2U);
  EXPECT_EQ(surfaces.IndexOf(std::get<Mesh>(m.bodies[0].shapes[1].geometry)), 1);
  EXPECT_EQ(surfaces.IndexOf(std::get<Mesh>(m.bodies[1].shapes[0].geometry)), 1);
  EXPECT_LE(surfaces.drawn()[0]->triangles.size() + surfaces.drawn()[1]->triangles.size(), 200U);
  EXPECT_EQ(DrawnSurfaces(m, 200).drawn(), surfaces.drawn());  // decimated once
  EXPECT_EQ(surfaces.IndexOf(Mesh{.file = "", .surface = std::make_shared<TriangleMesh>()}), -1);
}

TEST(Decimate, EdgesOfABoxGetVerticesOfTheirOwnAndThoseOfABallDoNot) {
  EXPECT_EQ(WithSharpEdges(test::BoxMesh(1, 2, 3), 0.6).vertices.size(), 24U);
  const TriangleMesh ball = test::EllipsoidMesh(Vec3::Ones(), 20);
  const TriangleMesh same = WithSharpEdges(ball, 0.6);
  EXPECT_EQ(same.vertices.size(), ball.vertices.size());
  EXPECT_NEAR(SolidShape(same).amount, SolidShape(ball).amount, 1e-12);
}

}  // namespace
}  // namespace mbv
