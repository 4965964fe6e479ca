#include "render/scene.h"

#include <gtest/gtest.h>

#include "mechanism/named_places.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "tests/mechanisms/rendered.h"

namespace mbv::render {
namespace {

Camera FitCamera(const std::vector<Vec3>& points_D, const CameraView& view, double aspect,
                 const Margins& margins, const Mat3& R_DW) {
  CameraFit fit(view, aspect, margins, R_DW);
  for (const Vec3& p_D : points_D) fit.Include(p_D);
  return fit.Fit();
}

constexpr double kRoundoff = 64 * kEps;

TEST(UprightRotation, IsTheIdentityForGravityAlongMinusZ) {
  EXPECT_TRUE(UprightRotation(Vec3(0, 0, -9.81)).isIdentity(kRoundoff));
  EXPECT_TRUE(UprightRotation(Vec3::Zero()).isIdentity(kRoundoff));
}

TEST(UprightRotation, TurnsUpToZAndKeepsXLevel) {
  for (const Vec3& g : {Vec3(0, 0, 9.81), Vec3(0, -9.81, 0), Vec3(3, 4, -12), Vec3(-1, 0, 0)}) {
    const Mat3 R_DW = UprightRotation(g);
    EXPECT_TRUE((R_DW * R_DW.transpose()).isIdentity(kRoundoff));
    EXPECT_NEAR(R_DW.determinant(), 1.0, kRoundoff);
    EXPECT_TRUE((R_DW * -g.normalized()).isApprox(Vec3::UnitZ(), kRoundoff));
  }
  // Gravity -Y: the world's x stays x, its z comes towards -y.
  const Mat3 R_DW = UprightRotation(Vec3(0, -9.81, 0));
  EXPECT_TRUE((R_DW * Vec3::UnitX()).isApprox(Vec3::UnitX(), kRoundoff));
  EXPECT_TRUE((R_DW * Vec3::UnitZ()).isApprox(-Vec3::UnitY(), kRoundoff));
}

TEST(CameraFit, TouchesTheMarginsAndCrossesNone) {
  std::vector<Vec3> points;
  points.reserve(8);
  for (int i = 0; i < 8; ++i) {
    points.emplace_back((i & 1) != 0 ? 2.0 : -0.5, (i & 2) != 0 ? 1.0 : 0.0,
                        (i & 4) != 0 ? 3.0 : 0.2);
  }
  const double aspect = 4.0 / 3.0, slack = 1e-9;
  const Margins margins{.side = 0.05, .top = 0.03, .bottom = 0.2};
  for (const double azimuth : {-60.0, 10.0, 200.0}) {
    for (const double elevation : {-20.0, 0.0, 16.0, 89.0}) {
      const Camera camera = FitCamera(points, {.azimuth_deg = azimuth, .elevation_deg = elevation},
                                      aspect, margins, Mat3::Identity());
      Eigen::AlignedBox2d box;
      for (const Vec3& p : points) box.extend(Project(camera, aspect, p));
      EXPECT_GE(box.min().x(), margins.side - slack);
      EXPECT_LE(box.max().x(), 1.0 - margins.side + slack);
      EXPECT_GE(box.min().y(), margins.top - slack);
      EXPECT_LE(box.max().y(), 1.0 - margins.bottom + slack);
      // The nearest such camera: it touches both margins of one direction.
      const double across = box.sizes().x() - (1.0 - 2.0 * margins.side);
      const double along = box.sizes().y() - (1.0 - margins.top - margins.bottom);
      EXPECT_NEAR(std::max(across, along), 0.0, slack);
    }
  }
}

TEST(CameraFit, LooksAtTheGivenPoint) {
  const std::vector<Vec3> points = {Vec3(1, 0, 0), Vec3(0, 0, 1)};
  const Mat3 R_DW = UprightRotation(Vec3(0, -9.81, 0));
  const CameraView view{
      .azimuth_deg = 0.0, .elevation_deg = 0.0, .distance_m = 5.0, .lookat_W = Vec3(0, 1, 0)};
  const Camera camera = FitCamera(points, view, 1.0, {}, R_DW);
  EXPECT_TRUE(camera.lookat_D.isApprox(Vec3(0, 0, 1), kRoundoff));
  EXPECT_TRUE(camera.position_D().isApprox(Vec3(5, 0, 1), kRoundoff));
  const Eigen::Vector2d centre = Project(camera, 1.0, camera.lookat_D);
  EXPECT_NEAR(centre.x(), 0.5, kRoundoff);
  EXPECT_NEAR(centre.y(), 0.5, kRoundoff);
}

TEST(ScaleOf, TakesTheLongestForceOfAllFrames) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureFrame a = HomeFrame(mechanism), b = a;
  a.drive_forces = {3.0};
  b.drive_forces = {-7.0};
  const Scale scale = ScaleOf(mechanism, {a, b});
  EXPECT_EQ(scale.longest_force_N, 7.0);
  EXPECT_EQ(scale.longest_torque_Nm, 0.0);
  EXPECT_NEAR(scale.extent_m, 1.0, kRoundoff);
}

TEST(MechanismItems, MakeALegTelescopeBetweenItsEnds) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureFrame shorter = HomeFrame(mechanism), longer = shorter;
  shorter.X_WB[1].translation() = Vec3(0, 0, 0.8);
  longer.X_WB[1].translation() = Vec3(0, 0, 1.3);
  const Scale scale = ScaleOf(mechanism, {shorter, longer});
  const auto cylinders = [&](const PictureFrame& frame) {
    std::vector<double> lengths;
    for (const Item& item : MechanismItems(mechanism, frame, scale, PictureOptions{})) {
      if (item.solid == Solid::kCylinder) lengths.push_back(2.0 * item.size.z());
    }
    return lengths;
  };
  const std::vector<double> a = cylinders(shorter), b = cylinders(longer);
  ASSERT_EQ(a.size(), 3U);  // barrel, collar, rod
  EXPECT_NEAR(a[0], b[0], kRoundoff);
  EXPECT_NEAR(a[0] + a[2], 0.8, kRoundoff);
  EXPECT_NEAR(b[0] + b[2], 1.3, kRoundoff);
}

// A body without shapes through whose points no rod goes.
TEST(MechanismItems, ShowABodyBetweenPointsInAPlaneAsAPlate) {
  const std::vector<Vec3> square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0.4, 0.5, 0}};
  const auto plate = [&](const Vec3& off, double width) {
    Mechanism m;
    m.bodies = {{.name = "world", .frames = {}, .shapes = {}},
                {.name = "table", .mass = 1.0, .frames = {}, .shapes = {}}};
    for (const Vec3& p : square) {
      Joint joint;
      joint.kind = JointKind::kSpherical;
      joint.child = 1;
      joint.X_PF = joint.X_CM = Pose(Eigen::Translation3d(p.cwiseProduct(Vec3(1, width, 1)) +
                                                          (p.x() == 0.4 ? off : Vec3::Zero())));
      m.joints.push_back(joint);
    }
    m.X_WB_home.assign(2, Pose::Identity());
    const Scale scale = ScaleOf(m, {HomeFrame(m)});
    const std::vector<Item> items = MechanismItems(m, HomeFrame(m), scale, PictureOptions{});
    const auto found = std::ranges::find(items, Solid::kMesh, &Item::solid);
    return found == items.end() ? std::pair(0.0, scale)
                                : std::pair(PropertiesOf(*found->mesh).volume, scale);
  };
  const auto [volume, scale] = plate(Vec3::Zero(), 1.0);
  EXPECT_NEAR(volume, 0.8 * scale.leg_m, 64 * kEps);  // its area times its thickness
  EXPECT_EQ(plate(Vec3(0, 0, 0.5), 1.0).first, 0.0);  // not in a plane
  EXPECT_EQ(plate(Vec3::Zero(), 0.01).first, 0.0);    // next to a line
}

TEST(Annotate, GivesArrowsWhoseLengthFollowsTheForce) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureFrame frame = HomeFrame(mechanism);
  Scale scale = ScaleOf(mechanism, {frame});
  scale.longest_force_N = 100.0;
  PictureOptions options;
  options.closures = false;
  const auto arrow = [&](double force) {
    frame.drive_forces = {force};
    return Annotate(mechanism, frame, scale, options, Vec3::UnitX()).items;
  };
  ASSERT_EQ(arrow(100.0).size(), 1U);
  EXPECT_NEAR(arrow(100.0)[0].size.z(), scale.arrow_m, kRoundoff);
  EXPECT_NEAR(arrow(-25.0)[0].size.z(), 0.25 * scale.arrow_m, kRoundoff);
  // Thrust on the ball points up from it, tension down to it.
  const Item push = arrow(50.0)[0], pull = arrow(-50.0)[0];
  EXPECT_TRUE(push.X_WG.linear().col(2).isApprox(Vec3::UnitZ(), kRoundoff));
  EXPECT_TRUE(push.X_WG.translation().isApprox(Vec3::UnitZ(), kRoundoff));
  EXPECT_TRUE(pull.X_WG.linear().col(2).isApprox(-Vec3::UnitZ(), kRoundoff));
  EXPECT_TRUE((pull.X_WG * Vec3(0, 0, pull.size.z())).isApprox(Vec3::UnitZ(), kRoundoff));
  EXPECT_TRUE(arrow(0.5).empty());
}

TEST(Annotate, DrawsOneRingForClosuresAtOnePlace) {
  Mechanism mechanism = test::BallOnLeg();
  mechanism.joints.push_back(mechanism.joints[0]);
  const PictureFrame frame = HomeFrame(mechanism);
  const Scale scale = ScaleOf(mechanism, {frame});
  const Annotations marks = Annotate(mechanism, frame, scale, PictureOptions{}, Vec3::UnitX());
  EXPECT_EQ(marks.flats.size(), 2U);  // what is visible and what shows through
}

TEST(OverlayAnnotations, ThinsPathsWithoutMovingThem) {
  const double radius = 0.01;
  Overlay overlay;
  PolylineOverlay line{.points_W = {}, .radius_m = radius}, circle = line;
  for (int i = 0; i <= 1000; ++i) {
    line.points_W.emplace_back(i <= 500 ? Vec3(i * 1e-3, 0, 0) : Vec3(0.5, (i - 500) * 1e-3, 0));
    circle.points_W.emplace_back(std::cos(i * 1e-2), std::sin(i * 1e-2), 0.0);
  }
  overlay.paths = {line};
  const Annotations angle = OverlayAnnotations(overlay, Scale{}, Vec3::UnitZ());
  EXPECT_EQ(angle.items.size(), 2U);  // two legs
  ASSERT_EQ(angle.flats.size(), 1U);  // what shows through bodies: a ribbon of two pieces
  EXPECT_EQ(angle.flats[0].triangles.size(), 4U);
  EXPECT_EQ(angle.flats[0].depth, FlatMesh::Depth::kHidden);
  // On a circle of 1 m a chord with a sagitta of a tenth of the radius spans 0.09 rad.
  overlay.paths = {circle};
  const std::vector<Item> items = OverlayAnnotations(overlay, Scale{}, Vec3::UnitZ()).items;
  EXPECT_GT(items.size(), 10.0 / 0.09);
  EXPECT_LT(items.size(), 3 * 10.0 / 0.09);
}

TEST(Palette, TakesTheShapeColoursAndKeepsItsMarksApart) {
  EXPECT_EQ(MaterialOf("#ff8000").rgba, (std::array<float, 4>{1.0F, 128 / 255.0F, 0.0F, 1.0F}));
  EXPECT_EQ(MaterialOf("no such colour").rgba, MaterialOf("grey").rgba);
  EXPECT_GT(MaterialOf("steel").specular, MaterialOf("wood").specular);
  for (const char* mark : {"push", "pull", "closure", "gap", "x_axis", "y_axis", "z_axis"}) {
    EXPECT_FALSE(IsShapeColor(mark)) << mark;
    EXPECT_GT(MaterialOf(mark).emission, 0.0F) << mark;
  }
}

}  // namespace
}  // namespace mbv::render
