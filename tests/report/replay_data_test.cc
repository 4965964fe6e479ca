// What the page's script draws: shapes, drives, closures and springs with their places, signals
// with their scales.
#include <algorithm>

#include "report/html_report.h"
#include "tests/support/golden_file.h"
#include "tests/support/reports.h"
#include "tests/support/solids.h"

namespace mbv {
namespace {

Pose PoseAt(double x, double y, double z) {
  Pose X = Pose::Identity();
  X.translation() = Vec3(x, y, z);
  return X;
}

// Everything that has a place, each at another one.
Mechanism Furnished() {
  Mechanism m = synthetic::TwoSliders();
  m.up_W = Vec3(0, 1, 0);
  m.bodies[1].shapes = {{Capsule{Vec3(1, 2, 3), Vec3(4, 5, 6), 0.125}, "steel"},
                        {Cylinder{Vec3(7, 8, 9), Vec3(10, 11, 12), 0.25}, "accent"},
                        {Box{PoseAt(13, 14, 15), Vec3(16, 17, 18)}, "#102030"},
                        {Ball{Vec3(19, 20, 21), 0.5}, "grey"}};
  m.joints[1].X_PF = PoseAt(0.5, 0, 0);
  m.joints[1].X_CM = PoseAt(0, 0, 0.25);
  m.tree_joints = {0};
  Joint cardan;
  cardan.name = "cardan";
  cardan.kind = JointKind::kUniversal;
  cardan.parent = 1;
  cardan.child = 2;
  cardan.X_PF = PoseAt(0, 3, 4);  // 5 m from the slider's frame at the origin
  cardan.X_CM = PoseAt(31, 32, 33);
  cardan.axis = Vec3::UnitY();
  cardan.axis2 = Vec3::UnitZ();
  m.joints.push_back(cardan);
  Drive turn, leg;
  turn.name = "turn";
  turn.kind = JointDrive{2, 1};
  leg.name = "leg";
  leg.kind = DistanceDrive{0, Vec3(41, 42, 43), 2, Vec3(44, 45, 46)};
  leg.radius = 0.0625;
  m.drives.push_back(turn);
  m.drives.push_back(leg);
  SpringDamper spring;
  spring.name = "coil";
  spring.body_from = 1;
  spring.p_from = Vec3(51, 52, 53);
  spring.body_to = 2;
  spring.p_to = Vec3(54, 55, 56);
  m.springs = {spring};
  m.outputs[0].X_BO = PoseAt(61, 62, 63);
  m.X_WB_home = {Pose::Identity(), PoseAt(71, 72, 73), PoseAt(74, 75, 76)};
  return m;
}

nlohmann::ordered_json DataOf(const Mechanism& mechanism, const Report& report) {
  HtmlInput input;
  input.report = &report;
  input.mechanism = &mechanism;
  input.paints["steel"] = {.rgba = {0.125F, 0.25F, 0.5F, 1.0F}, .scenery = true};
  return nlohmann::ordered_json::parse(PageData(input));
}

TEST(ReplayData, IsAsWritten) {
  ExpectGolden("replay.json", DataOf(Furnished(), Report())["replay"].dump(2) + "\n");
}

TEST(ReplayData, MeshesAreDecimatedAndThoseShownTwiceAreThereOnce) {
  Mechanism m = Furnished();
  const auto ball =
      std::make_shared<const TriangleMesh>(test::EllipsoidMesh(Vec3(0.1, 0.2, 0.3), 300));
  ASSERT_GT(ball->triangles.size(), 300000U);
  const auto box = std::make_shared<const TriangleMesh>(test::BoxMesh(1, 2, 3));
  const Pose X_BG = PoseAt(1, 2, 3);
  m.bodies[1].shapes = {{Mesh{.X_BG = X_BG, .file = "ball.stl", .surface = ball}, "steel"},
                        {Mesh{.X_BG = X_BG, .file = "box.stl", .surface = box}, "accent"}};
  m.bodies[2].shapes = {{Mesh{.file = "ball.stl", .surface = ball}, "steel"}};
  const auto replay = DataOf(m, Report())["replay"];
  ASSERT_EQ(replay["surfaces"].size(), 2U);
  const auto& shape = replay["bodies"][1]["shapes"][0];
  EXPECT_EQ(shape["type"], "mesh");
  EXPECT_EQ(shape["surface"], 0);
  EXPECT_EQ(shape["pose"], nlohmann::ordered_json({1.0, 2.0, 3.0, 0.0, 0.0, 0.0, 1.0}));
  EXPECT_EQ(replay["bodies"][1]["shapes"][1]["surface"], 1);
  EXPECT_EQ(replay["bodies"][2]["shapes"][0]["surface"], 0);
  // Three numbers of four bytes as base64.
  EXPECT_EQ(replay["surfaces"][1]["triangles"].get<std::string>().size(), 12U * 16U);
  EXPECT_EQ(replay["surfaces"][1]["vertices"].get<std::string>().size(), 8U * 16U);
  EXPECT_GT(replay["surfaces"][0]["triangles"].get<std::string>().size(), 10000U * 16U);
  EXPECT_LT(replay.dump().size(), 1.5e6);
  // The page with its script stays below 5 MB whatever the meshes.
  test::FullPage full;
  full.mechanism.bodies[1].shapes = m.bodies[1].shapes;
  EXPECT_LT(ToHtml(full.input()).size(), 5e6);
}

TEST(ReplayData, SignalsHaveTheLimitsAndScalesOfTheirKind) {
  const test::FullPage full;
  const auto data = DataOf(full.mechanism, full.report);
  EXPECT_EQ(data["schema"], "mbverify.page/1");
  EXPECT_EQ(data["verdict"], "disagree");
  ASSERT_EQ(data["drives"].size(), 2U);
  EXPECT_EQ(data["drives"][1]["name"], "d2");
  EXPECT_EQ(data["drives"][1]["unit"], "N");
  EXPECT_EQ(data["drives"][1]["position_unit"], "m");
  EXPECT_EQ(data["time"], nlohmann::ordered_json({0.0, 0.01, 0.02}));
  ASSERT_EQ(data["witnesses"].size(), 3U);
  const auto& simulated = data["witnesses"][2];
  EXPECT_EQ(simulated["name"], "simulated");
  EXPECT_EQ(simulated["force"].size(), 2U);
  EXPECT_EQ(simulated["outputs"][0]["name"], "plate");
  EXPECT_EQ(simulated["outputs"][0]["frame"], "world");
  EXPECT_EQ(simulated["outputs"][0]["values"].size(), 6U);
  EXPECT_EQ(simulated["limits"]["closure_m"], 1e-8);
  EXPECT_EQ(data["witnesses"][1]["limits"]["power_balance"], 1e-4);
  const auto& pairs = data["pairs"];
  const auto pair = std::find_if(pairs.begin(), pairs.end(), [](const auto& one) {
    return one["name"] == "simulated_vs_analytic";
  });
  ASSERT_NE(pair, pairs.end());
  EXPECT_EQ((*pair)["measured"], "simulated");
  EXPECT_EQ((*pair)["truth"], "analytic");
  // The largest force of any drive of the unit within the samples that there are.
  EXPECT_DOUBLE_EQ((*pair)["scale"][0].get<double>(), 40.0);
  EXPECT_EQ((*pair)["scale"][0], (*pair)["scale"][1]);
  EXPECT_EQ((*pair)["worst"]["drive"], 0);
  EXPECT_EQ((*pair)["worst"]["time"], 0.25);
  EXPECT_NEAR((*pair)["worst"]["value"].get<double>(), 0.01, 1e-12);
}

}  // namespace
}  // namespace mbv
