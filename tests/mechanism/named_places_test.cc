#include "mechanism/named_places.h"

#include <gtest/gtest.h>

namespace mbv {
namespace {

// A slider on a leg between the world and it; the output has the body's name.
Mechanism SliderOnLeg() {
  Mechanism m;
  m.bodies = {Body{.name = "world", .frames = {}, .shapes = {}},
              Body{.name = "slider",
                   .mass = 1.0,
                   .p_BoBcm_B = Vec3(0, 0, 2),
                   .frames = {{.name = "tip", .X_BF = Pose::Identity()}},
                   .shapes = {}}};
  Joint rail, loose;
  rail.name = "rail";
  rail.kind = JointKind::kPrismatic;
  loose.name = "loose";
  loose.kind = JointKind::kFree;
  rail.child = loose.child = 1;
  m.joints = {rail, loose};
  m.drives = {
      {.name = "leg",
       .kind =
           DistanceDrive{
               .body_from = 0, .p_from = Vec3::UnitX(), .body_to = 1, .p_to = Vec3::UnitY()},
       .range = {}}};
  m.outputs = {{.name = "slider", .body = 1}};
  return m;
}

std::vector<std::string> NamesFor(const std::vector<std::string>& words) {
  std::vector<std::string> names;
  for (const NamedPlace& place : PlacesFor(SliderOnLeg(), words)) names.push_back(place.name);
  return names;
}

TEST(PlacesFor, TakesKindsAndNames) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(NamesFor({"usual"}), (Names{"slider", "leg", "rail"}));
  EXPECT_EQ(NamesFor({"joints"}), Names{"rail"});
  EXPECT_EQ(NamesFor({"frames"}), Names{"slider.tip"});
  EXPECT_EQ(NamesFor({"bodies"}), Names{"slider"});
  EXPECT_EQ(NamesFor({"leg", "frames"}), (Names{"leg", "slider.tip"}));
  EXPECT_EQ(NamesFor({"slider"}), Names{"slider"});  // once
  EXPECT_EQ(NamesFor({}), Names{});
}

TEST(PlacesFor, PutsBodiesAtTheirCentresOfMassAndLegsBetweenTheirEnds) {
  const Mechanism m = SliderOnLeg();
  EXPECT_EQ(PlacesFor(m, {"bodies"}).at(0).p_a, Vec3(0, 0, 2));
  const NamedPlace leg = PlacesFor(m, {"leg"}).at(0);
  EXPECT_EQ(leg.body_a, 0);
  EXPECT_EQ(leg.body_b, 1);
  EXPECT_EQ(leg.p_a, Vec3::UnitX());
  EXPECT_EQ(leg.p_b, Vec3::UnitY());
}

}  // namespace
}  // namespace mbv
