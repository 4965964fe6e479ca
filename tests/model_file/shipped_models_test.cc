// The shipped models against numbers of the papers' data.
#include <gtest/gtest.h>

#include <fstream>
#include <iterator>

#include "kinematics/constraints.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

Mechanism LoadShipped(const std::string& name, const LoadOptions& options = {}) {
  const LoadResult result =
      LoadModel(std::string(kSourceDir) + "/models/" + name + "/model.yaml", options);
  EXPECT_EQ(result.diagnostics.Text(), "");
  return result.mechanism.value_or(Mechanism{});
}

std::vector<double> DrivesAtHome(const Mechanism& m) {
  BodyStates states;
  states.Resize(m.bodies.size());
  states.X_WB = m.X_WB_home;
  std::vector<double> positions;
  for (const Drive& drive : m.drives) positions.push_back(DriveRow(m, drive, states).value);
  return positions;
}

// Numbers are given with 12 decimals.
constexpr double kPrinted = 1e-12;

TEST(StabilizingPlatformModel, IsInItsNeutralPose) {
  const Mechanism m = LoadShipped("stabilizing_platform");
  EXPECT_NEAR(m.ParameterValue("l_0"), 3.277197735871, kPrinted);
  EXPECT_NEAR(m.ParameterValue("lambda_0") * 180 / M_PI, -2.098448566, 1e-9);
  EXPECT_NEAR(m.ParameterValue("q1_0"), 0.432001041535, kPrinted);
  EXPECT_NEAR(m.ParameterValue("q2_0"), 2.543182675966, kPrinted);
  const std::vector<double> lengths = DrivesAtHome(m);
  ASSERT_EQ(lengths.size(), 6u);
  for (const double length : lengths) EXPECT_NEAR(length, 2.818013474642, kPrinted);
  const Pose X_WP = m.X_WB_home[m.FindBody("platform")];
  EXPECT_LT((X_WP.translation() - Vec3(0, 0, 3.5)).norm(), 1e-12);
  EXPECT_LT((X_WP.linear() - Mat3::Identity()).norm(), 1e-12);
  // The elbows cross the limb's plane: link 1 from -L5 ends on the far side.
  const Pose X_WA = m.X_WB_home[m.FindBody("lower_platform")] *
                    m.FindFrame(m.FindBody("lower_platform"), "limb1.A")->X_BF;
  const int link1 = m.FindBody("limb1.link1");
  const Vec3 elbow = X_WA.inverse() * m.X_WB_home[link1] * Vec3(0, 4.8, 0);
  EXPECT_GT(elbow.y(), 0.0);
}

TEST(StabilizingPlatformModel, KeepsTheNamesAndOrderOfItsDrives) {
  const Mechanism m = LoadShipped("stabilizing_platform");
  std::string names;
  for (const Drive& drive : m.drives) names += drive.name + " ";
  EXPECT_EQ(names,
            "limb1.drive limb1.drive_p limb2.drive limb2.drive_p limb3.drive "
            "limb3.drive_p ");
  for (const char* joint : {"limb1.U1", "limb2.U1_p", "limb3.R12", "limb1.R12_p", "limb2.R22",
                            "limb3.S", "heave", "roll", "pitch"}) {
    EXPECT_GE(m.FindJoint(joint), 0) << joint;
  }
  EXPECT_TRUE(m.joints[m.FindJoint("limb1.R22")].transmits_force_only);
  EXPECT_EQ(m.prescribed.size(), 3u);
  EXPECT_EQ(m.bodies[m.FindBody("ship_roll")].mass, 0.0);
}

TEST(StabilizingPlatformModel, HasSixDegreesOfFreedomOnTheShipAndTwoRedundantConstraintsPerLimb) {
  const Mobility mobility = AnalyseMobility(LoadShipped("stabilizing_platform"));
  EXPECT_EQ(mobility.dofs, 6 + 3);  // and the ship's three
  EXPECT_EQ(mobility.redundant, 6);
  EXPECT_EQ(mobility.undriven, 0);
  EXPECT_TRUE(mobility.drives_not_unique.empty());
}

TEST(StabilizingPlatformModel, LoadsWithMasslessLinks) {
  const Mechanism m = LoadShipped("stabilizing_platform", {.overrides = {{"link_mass_scale", 0.0}},
                                                           .override_places = {},
                                                           .gravity_W = {},
                                                           .literals = {}});
  for (const Body& body : m.bodies) {
    if (body.name.find("link") == std::string::npos) continue;
    EXPECT_EQ(body.mass, 0.0) << body.name;
  }
}

TEST(SprTripodModel, IsLevelAtMidStroke) {
  const Mechanism m = LoadShipped("spr_tripod");
  const Pose X_WP = m.X_WB_home[m.FindBody("platform")];
  EXPECT_NEAR(X_WP.translation().z(), 0.574978260458602, 1e-15);
  EXPECT_LT(X_WP.translation().head<2>().norm(), 1e-15);
  for (const double length : DrivesAtHome(m)) EXPECT_NEAR(length, 0.625, 1e-15);
  EXPECT_EQ(m.drives[2].name, "leg3");
  // Seen from the platform's normal, a leg leans inward by 23.079003 deg at home.
  const Vec3 w = m.X_WB_home[m.FindBody("leg3.cyl")].linear().col(2);
  EXPECT_NEAR(std::atan2(-w.x(), w.z()) * 180 / M_PI, 23.079003, 1e-6);
  double weight = 0.0;
  for (const Body& body : m.bodies) weight += body.mass;
  EXPECT_DOUBLE_EQ(weight, 60.0);
  EXPECT_GT(m.gravity_W.z(), 0.0);  // z points down
}

TEST(SprTripodModel, LegAxesFollowThePrintedAzimuths) {
  const Mechanism m = LoadShipped("spr_tripod");
  // x of a leg frame is c_i = (cos theta_i, sin theta_i, 0).
  const double theta[] = {M_PI / 6, 5 * M_PI / 6, M_PI / 2};
  for (int i = 0; i < 3; ++i) {
    const Vec3 c(std::cos(theta[i]), std::sin(theta[i]), 0);
    for (const char* body : {"cyl", "rod"}) {
      const int index = m.FindBody("leg" + std::to_string(i + 1) + "." + body);
      EXPECT_LT((m.X_WB_home[index].linear().col(0) - c).norm(), 1e-14) << i << body;
    }
  }
}

TEST(SprTripodModel, HasThreeDegreesOfFreedomAndNothingRedundant) {
  const Mobility mobility = AnalyseMobility(LoadShipped("spr_tripod"));
  EXPECT_EQ(mobility.dofs, 3);
  EXPECT_EQ(mobility.redundant, 0);
  EXPECT_EQ(mobility.undriven, 0);
}

TEST(ModelFormatDocument, ItsExampleLoads) {
  const std::string file = std::string(kSourceDir) + "/docs/reference/model_file.md";
  std::ifstream stream(file);
  const std::string text(std::istreambuf_iterator<char>(stream), {});
  const std::string fence = "```yaml\n";
  const size_t start = text.find(fence);
  ASSERT_NE(start, std::string::npos);
  const size_t begin = start + fence.size();
  const LoadResult result =
      LoadModelText(text.substr(begin, text.find("```", begin) - begin), file);
  EXPECT_EQ(result.diagnostics.Text(), "");
  ASSERT_TRUE(result.mechanism);
  EXPECT_EQ(AnalyseMobility(*result.mechanism).dofs, 1);
}

}  // namespace
}  // namespace mbv
