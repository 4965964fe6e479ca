#include "render/scene.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mbv::render {
namespace {

// Enclosed volume: positive if all triangles turn counter-clockwise from outside.
double Volume(const Facets& facets) {
  double volume = 0.0;
  for (const auto& [i, j, k] : facets.triangles) {
    volume += facets.points_G[i].dot(facets.points_G[j].cross(facets.points_G[k])) / 6.0;
  }
  return volume;
}

TEST(FacetsOf, EncloseTheVolumeOfTheSolidAndLookOutwards) {
  constexpr double pi = std::numbers::pi;
  const double r = 0.5, h = 0.8;
  const auto item = [&](Solid solid) {
    Item of = BallAt(Vec3::Zero(), r, {});
    of.solid = solid;
    of.size = Vec3(r, r, h);
    return of;
  };
  const struct {
    Solid solid;
    double volume;
  } cases[] = {{Solid::kBall, 4.0 / 3.0 * pi * r * r * r},
               {Solid::kCapsule, 4.0 / 3.0 * pi * r * r * r + pi * r * r * 2.0 * h},
               {Solid::kCylinder, pi * r * r * 2.0 * h},
               {Solid::kBox, 8.0 * r * r * h},
               // A shaft of half the length and a head of twice its radius.
               {Solid::kArrow, pi * r * r * h / 2.0 + pi * 4.0 * r * r * h / 6.0}};
  for (const auto& [solid, volume] : cases) {
    const Facets facets = FacetsOf(item(solid), 128);
    EXPECT_NEAR(Volume(facets) / volume, 1.0, 2e-3) << static_cast<int>(solid);
    for (const auto& corner : facets.triangles) {
      const Vec3 &a = facets.points_G[corner[0]], &b = facets.points_G[corner[1]],
                 &c = facets.points_G[corner[2]];
      const Vec3 normal = (b - a).cross(c - a);
      if (normal.norm() < 1e-12) continue;
      for (const int i : corner) {
        EXPECT_NEAR(facets.normals_G[i].norm(), 1.0, 1e-9);
        EXPECT_GT(facets.normals_G[i].dot(normal.normalized()), 0.9);
      }
    }
  }
  EXPECT_TRUE(FacetsOf(item(Solid::kMesh), 8).triangles.empty());
}

TEST(SidesFor, KeepsTheSagittaBelowAPartOfAPixel) {
  for (const double radius_px : {2.0, 20.0, 200.0}) {
    const double sagitta = radius_px * (1.0 - std::cos(std::numbers::pi / SidesFor(radius_px)));
    EXPECT_LE(sagitta, 0.16) << radius_px;
  }
  EXPECT_EQ(SidesFor(0.0), 8);
  EXPECT_LE(SidesFor(1e9), 160);
}

}  // namespace
}  // namespace mbv::render
