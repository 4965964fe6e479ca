// What explains a picture: it casts no shadow, has its own colours and a legend, and hides nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "math/spatial.h"
#include "model_file/load_model.h"
#include "render/annotations.h"
#include "render/camera.h"
#include "render/stage.h"
#include "tests/mechanisms/rendered.h"
#include "tests/support/source_dir.h"

namespace mbv::render {
namespace {

Picture StagePicture(const std::vector<Item>& items, const StageOptions& options) {
  std::unique_ptr<Stage> stage;
  const RunSummary opened = Stage::Open(options, &stage);
  EXPECT_TRUE(opened.ok()) << opened.message;
  const Camera camera{.azimuth_deg = -90.0,
                      .elevation_deg = 40.0,
                      .distance_m = 5.0,
                      .lookat_D = Vec3(0.0, 0.0, 0.3)};
  Picture picture;
  EXPECT_TRUE(stage->Draw({.items = items}, Mat3::Identity(), camera, &picture).ok());
  return picture;
}

const std::uint8_t* PixelAt(const Picture& picture, int x, int y) {
  return &picture.rgb[3UL * (static_cast<std::size_t>(y) * picture.width + x)];
}

// Grey pixels that are clearly darker than in the other picture: shadows.
int ShadowPixels(const Picture& with, const Picture& without) {
  int count = 0;
  for (int y = 0; y < with.height; ++y) {
    for (int x = 0; x < with.width; ++x) {
      const std::uint8_t *p = PixelAt(with, x, y), *q = PixelAt(without, x, y);
      const int colour = *std::max_element(p, p + 3) - *std::min_element(p, p + 3);
      count += colour < 25 && p[1] + 25 < q[1] ? 1 : 0;
    }
  }
  return count;
}

Mechanism ShippedModel(const std::string& name) {
  LoadResult result = LoadModel(SourcePath("/models/" + name + "/model.yaml"));
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return *std::move(result.mechanism);
}

TEST(Stage, DrawsShadowsOfSolidsAndNoneOfMarks) {
  const StageOptions options{.width = 320, .height = 240, .passes = 1, .radius_m = 2.0};
  Item rod = Between(Solid::kArrow, Vec3(0, 0, 0.5), Vec3(0.6, 0, 1.0), 0.05, MaterialOf("push"));
  const Picture bare = StagePicture({}, options);
  EXPECT_GT(ShadowPixels(StagePicture({rod}, options), bare), 100);
  rod.casts_shadow = false;
  EXPECT_EQ(ShadowPixels(StagePicture({rod}, options), bare), 0);
}

TEST(Marks, CastNoShadow) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureFrame frame = HomeFrame(mechanism);
  frame.drive_forces = {10.0};
  const Scale scale = ScaleOf(mechanism, {frame});
  for (const Item& item : Annotate(mechanism, frame, scale, {}, Vec3::UnitX()).items) {
    EXPECT_FALSE(item.casts_shadow);
  }
  Overlay overlay;
  overlay.paths.push_back({.points_W = {Vec3::Zero(), Vec3::UnitX()}});
  for (const Item& item : OverlayAnnotations(overlay, scale, Vec3::UnitX()).items) {
    EXPECT_FALSE(item.casts_shadow);
  }
  int arrows = 0;
  for (const Item& item : MechanismItems(mechanism, frame, scale, {})) {
    arrows += item.solid == Solid::kArrow ? 1 : 0;
    EXPECT_EQ(item.casts_shadow, item.solid != Solid::kArrow);
  }
  EXPECT_EQ(arrows, 3);  // the output's axes
}

TEST(Stage, DrawsShadowsSoftAndInOnePiece) {
  const Item ball = BallAt(Vec3(0, 0, 0.9), 0.3, MaterialOf("push"));
  // Darkness along the row through the shadow's middle.
  const auto darkest_step = [&](int passes) {
    const StageOptions options{.width = 640, .height = 480, .passes = passes, .radius_m = 2.0};
    const Picture with = StagePicture({ball}, options), bare = StagePicture({}, options);
    int best_row = 0, most = 0;
    for (int y = 0; y < with.height; ++y) {
      int sum = 0;
      bool ground_only = true;
      for (int x = 0; x < with.width; ++x) {
        const std::uint8_t* p = PixelAt(with, x, y);
        ground_only = ground_only && *std::max_element(p, p + 3) - *std::min_element(p, p + 3) < 40;
        sum += std::max(0, PixelAt(bare, x, y)[1] - p[1] - 10);
      }
      if (ground_only && sum > most) {
        most = sum;
        best_row = y;
      }
    }
    int depth = 0, step = 0;
    for (int x = 1; x < with.width; ++x) {
      const auto dark = [&](int at) {
        return PixelAt(bare, at, best_row)[1] - PixelAt(with, at, best_row)[1];
      };
      depth = std::max(depth, dark(x));
      step = std::max(step, std::abs(dark(x) - dark(x - 1)));
    }
    EXPECT_GT(depth, 40) << passes;
    return static_cast<double>(step) / std::max(depth, 1);
  };
  EXPECT_GT(darkest_step(1), 0.8);
  EXPECT_LT(darkest_step(PictureOptions{}.passes), 0.5);
}

TEST(Stage, DrawsBallsRound) {
  std::unique_ptr<Stage> stage;
  ASSERT_TRUE(Stage::Open({.width = 480,
                           .height = 480,
                           .passes = 1,
                           .ground = Ground::kNone,
                           .background = std::array<float, 4>{1.0F, 1.0F, 1.0F, 1.0F}},
                          &stage)
                  .ok());
  for (const double elevation : {0.0, 35.0}) {
    const Camera camera{.azimuth_deg = 0.0, .elevation_deg = elevation, .distance_m = 5.0};
    Picture picture;
    ASSERT_TRUE(stage
                    ->Draw({.items = {BallAt(Vec3::Zero(), 0.9, MaterialOf("push"))}},
                           Mat3::Identity(), camera, &picture)
                    .ok());
    // The farthest and the nearest pixel of the outline, from the middle.
    double outer = 0.0, inner = 1e9;
    for (int y = 0; y < 480; ++y) {
      for (int x = 0; x < 480; ++x) {
        const bool inside = PixelAt(picture, x, y)[1] < 200;
        const double r = std::hypot(x - 239.5, y - 239.5);
        if (inside) outer = std::max(outer, r);
        if (!inside) inner = std::min(inner, r);
      }
    }
    EXPECT_GT(inner, 150.0);
    EXPECT_LT(outer / inner, 1.025) << elevation;
  }
}

TEST(MechanismItems, DrawSpringsAsCoilsAndDampersAsPistons) {
  Mechanism mechanism = test::BallOnLeg();
  const PictureFrame frame = HomeFrame(mechanism);
  const auto count = [&] {
    return MechanismItems(mechanism, frame, ScaleOf(mechanism, {frame}), {}).size();
  };
  const std::size_t without = count();
  mechanism.springs.push_back({.name = "s",
                               .p_from = Vec3(0.5, 0, 0),
                               .body_to = 1,
                               .stiffness = 10.0,
                               .damping = 0.0,
                               .free_length_m = 1.0});
  const std::size_t spring = count();
  mechanism.springs[0].damping = 1.0;
  const std::size_t both = count();
  mechanism.springs[0].stiffness = 0.0;
  const std::size_t damper = count();
  EXPECT_GT(spring, without + 60);
  EXPECT_EQ(both, spring + 2);
  EXPECT_GT(damper, without);
  EXPECT_LT(damper, without + 10);
  // Seen in the picture, too.
  mechanism.springs[0].stiffness = 10.0;
  PictureOptions options = test::Quick();
  options.camera = {.azimuth_deg = -90.0, .elevation_deg = 10.0, .distance_m = 4.0};
  options.camera.lookat_W = Vec3(0.2, 0, 0.5);
  const Picture with = test::DrawnPicture(mechanism, options, frame);
  mechanism.springs.clear();
  const Picture bare = test::DrawnPicture(mechanism, options, frame);
  int changed = 0;
  for (std::size_t i = 0; i < with.rgb.size(); i += 3) {
    changed += std::abs(with.rgb[i] - bare.rgb[i]) > 30 ? 1 : 0;
  }
  EXPECT_GT(changed, 300);
}

Mechanism HingedBall() {
  Mechanism mechanism = test::BallOnLeg();
  mechanism.joints[0].kind = JointKind::kRevolute;
  mechanism.joints[0].axis = Vec3::UnitY();
  mechanism.drives[0].kind = JointDrive{.joint = 0};
  return mechanism;
}

TEST(Annotate, DrawsArcsOnlyAboveAFloor) {
  const Mechanism mechanism = HingedBall();
  PictureFrame frame = HomeFrame(mechanism);
  Scale scale = ScaleOf(mechanism, {frame});
  scale.longest_torque_Nm = 100.0;
  PictureOptions options;
  options.closures = false;
  const auto items = [&](double torque) {
    frame.drive_forces = {torque};
    return Annotate(mechanism, frame, scale, options, Vec3::UnitX()).items.size();
  };
  EXPECT_EQ(items(4.0), 0u);
  EXPECT_EQ(items(-4.0), 0u);
  EXPECT_GT(items(6.0), 10u);
}

TEST(ScaleOf, TakesRoundingForNoForce) {
  const Mechanism hinged = HingedBall(), pushed = test::BallOnLeg();
  PictureFrame frame = HomeFrame(hinged);
  frame.drive_forces = {3e-14};
  EXPECT_EQ(ScaleOf(hinged, {frame}).longest_torque_Nm, 0.0);
  EXPECT_EQ(ScaleOf(pushed, {frame}).longest_force_N, 0.0);
  frame.drive_forces = {1e-3};
  EXPECT_EQ(ScaleOf(hinged, {frame}).longest_torque_Nm, 1e-3);
  EXPECT_EQ(ScaleOf(pushed, {frame}).longest_force_N, 1e-3);
}

TEST(Palette, GivesAxesAndPathsColoursThatMeanNoForce) {
  for (const char* mark : {"x_axis", "y_axis", "z_axis", "path"}) {
    for (const char* other : {"push", "pull", "closure", "gap", "x_axis", "y_axis", "z_axis"}) {
      if (std::string(mark) == other) continue;
      const auto a = MaterialOf(mark).rgba, b = MaterialOf(other).rgba;
      EXPECT_GT(std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]), 0.35F) << mark << " " << other;
    }
  }
}

TEST(Legend, NamesAxesAndPath) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureFrame frame = HomeFrame(mechanism);
  frame.drive_forces = {10.0};
  Overlay overlay;
  overlay.paths.push_back({.points_W = {Vec3::Zero(), Vec3::UnitX()}, .name = "path of ball"});
  PictureOptions options;
  const auto texts = [&] {
    std::vector<std::pair<std::string, int>> found;
    const Arrangement set = Arrange(mechanism, {frame}, overlay, options);
    for (const LegendEntry& entry : LegendOf(mechanism, set, overlay, options)) {
      if (entry.color.empty() && !entry.text.starts_with("axes of")) continue;
      found.emplace_back(entry.color + ": " + entry.text, entry.row);
    }
    return found;
  };
  EXPECT_EQ(texts(), (std::vector<std::pair<std::string, int>>{{"push: push (+)", 0},
                                                               {"pull: pull (-)", 0},
                                                               {"closure: loop closure", 1},
                                                               {": axes of ball:", 1},
                                                               {"x_axis: x", 1},
                                                               {"y_axis: y", 1},
                                                               {"z_axis: z", 1},
                                                               {"path: path of ball", 1}}));
  overlay.paths.clear();
  options.output_frames = options.closures = false;
  EXPECT_EQ(texts().size(), 2u);
}

TEST(Pictures, HaveAPlainBackgroundWhenAskedFor) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = test::Quick();
  const auto plain = [&](const Picture& picture) {
    int count = 0;
    for (int y = 0; y < picture.height; ++y) {
      for (const int x : {0, picture.width - 1}) count += PixelAt(picture, x, y)[2] == 255 ? 1 : 0;
    }
    return count;
  };
  EXPECT_LT(plain(test::DrawnPicture(mechanism, options, HomeFrame(mechanism))), 40);
  options.background = "#ffffff";
  EXPECT_EQ(plain(test::DrawnPicture(mechanism, options, HomeFrame(mechanism))), 480);
  options.background = "whitish";
  EXPECT_NE(Check(options).findings().at(0).message.find("neither a colour's name nor #rrggbb"),
            std::string::npos);
}

TEST(Pictures, HaveLabelsWhenAskedFor) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = test::Quick();
  options.size_px = {640, 480};
  options.background = "#ffffff";
  const Picture without = test::DrawnPicture(mechanism, options, HomeFrame(mechanism));
  options.labels = {"usual"};
  const Picture with = test::DrawnPicture(mechanism, options, HomeFrame(mechanism));
  int changed = 0;
  for (std::size_t i = 0; i < with.rgb.size(); i += 3) {
    changed += std::abs(with.rgb[i] - without.rgb[i]) > 60 ? 1 : 0;
  }
  EXPECT_GT(changed, 200);
}

TEST(BestView, StaysWhereNothingHidesAndGoesAroundAWall) {
  Mechanism mechanism = test::BallOnLeg();
  PictureFrame frame = HomeFrame(mechanism);
  const Scale scale = ScaleOf(mechanism, {frame});
  PictureOptions options;
  CameraView view = BestView(mechanism, {frame}, scale, options, Mat3::Identity());
  EXPECT_EQ(*view.azimuth_deg, kUsualAzimuth_deg);
  EXPECT_EQ(*view.elevation_deg, kUsualElevation_deg);
  // A wall before the usual camera.
  const Camera usual{.azimuth_deg = kUsualAzimuth_deg, .elevation_deg = 0.0};
  Box wall;
  wall.size = Vec3(0.05, 4.0, 4.0);
  wall.X_BG.translation() = -0.6 * usual.forward_D();
  wall.X_BG.linear() =
      Eigen::AngleAxisd(kUsualAzimuth_deg / 180.0 * std::numbers::pi, Vec3::UnitZ())
          .toRotationMatrix();
  mechanism.bodies[0].shapes.push_back({.geometry = wall, .color = "base"});
  const auto share = [&](const CameraView& from) {
    const Camera camera{.azimuth_deg = *from.azimuth_deg, .elevation_deg = *from.elevation_deg};
    return VisibleShare(mechanism, {frame}, scale, options, -camera.forward_D());
  };
  EXPECT_EQ(share(view), 0.0);
  view = BestView(mechanism, {frame}, scale, options, Mat3::Identity());
  EXPECT_EQ(share(view), 1.0);
  options.camera.azimuth_deg = 10.0;
  EXPECT_EQ(*BestView(mechanism, {frame}, scale, options, Mat3::Identity()).azimuth_deg, 10.0);
}

TEST(BestView, DoesNotLookAlongThePlaneOfAPlanarMechanism) {
  const Mechanism four_bar = ShippedModel("four_bar");
  const PictureFrame frame = HomeFrame(four_bar);
  // Its plane's normal is z: level with the ground, and upright all around.
  std::vector<Mat3> turns = {Mat3::Identity()};
  for (double turn_deg = 0.0; turn_deg < 180.0; turn_deg += 30.0) {
    turns.emplace_back(Eigen::AngleAxisd(turn_deg / 180.0 * std::numbers::pi, Vec3::UnitZ()) *
                       Eigen::AngleAxisd(std::numbers::pi / 2.0, Vec3::UnitX()));
  }
  for (const Mat3& turn : turns) {
    PictureFrame turned = frame;
    for (Pose& X_WB : turned.X_WB) X_WB = Pose(turn) * X_WB;
    const Scale scale = ScaleOf(four_bar, {turned});
    const CameraView view = BestView(four_bar, {turned}, scale, {}, Mat3::Identity());
    const Camera camera{.azimuth_deg = *view.azimuth_deg, .elevation_deg = *view.elevation_deg};
    EXPECT_GT(std::abs(camera.forward_D().dot(turn.col(2))), 0.5) << turn.col(2).transpose();
  }
}

// Low and wide is not planar: from above, its own load would hide a limb.
TEST(BestView, LooksAtALowMechanismFromTheSide) {
  const Mechanism platform = ShippedModel("stabilizing_platform");
  // The ship rolls and pitches, all bodies with it.
  for (const Vec3& turn : {Vec3(0.1, 0, 0), Vec3(-0.1, 0, 0), Vec3(0, 0.1, 0), Vec3(0, -0.1, 0),
                           Vec3(0.2, 0.1, 0), Vec3(-0.2, 0.1, 0)}) {
    PictureFrame frame = HomeFrame(platform);
    for (Pose& X_WB : frame.X_WB) X_WB = Pose(ExpRotation(turn)) * X_WB;
    const Scale scale = ScaleOf(platform, {frame});
    const CameraView view = BestView(platform, {frame}, scale, {}, Mat3::Identity());
    EXPECT_LE(*view.elevation_deg, 24.0) << turn.transpose();
  }
}

TEST(BestView, ShowsAllThreeLimbsOfThePlatform) {
  const Mechanism platform = ShippedModel("stabilizing_platform");
  const PictureFrame frame = HomeFrame(platform);
  const Scale scale = ScaleOf(platform, {frame});
  const Arrangement set = Arrange(platform, {frame}, {}, PictureOptions{});
  int limbs = 0;
  for (const char* limb : {"limb1.", "limb2.", "limb3."}) {
    // All solids hide, only this limb's joints and drives are asked for.
    const auto share = [&](const Vec3& to_camera_W) {
      double seen = 0.0, all = 0.0;
      for (std::size_t j = 0; j < platform.joints.size(); ++j) {
        if (!platform.joints[j].name.starts_with(limb)) continue;
        Mechanism one = platform;
        for (std::size_t k = 0; k < one.joints.size(); ++k) {
          if (k != j) one.joints[k].kind = JointKind::kFixed;
        }
        const bool has_legs = std::ranges::any_of(one.drives, [](const Drive& drive) {
          return std::holds_alternative<DistanceDrive>(drive.kind);
        });
        if (has_legs) one.drives.clear();
        PictureFrame still = frame;
        still.drive_forces.clear();
        seen += VisibleShare(one, {still}, scale, {}, to_camera_W);
        all += 1.0;
      }
      return all > 0.0 ? seen / all : 0.0;
    };
    EXPECT_GT(share(-set.forward_W), 0.5) << limb;
    ++limbs;
  }
  EXPECT_EQ(limbs, 3);
}

TEST(Arrange, LetsTheMechanismAndNotItsSurroundingsFillThePicture) {
  for (const char* name : {"cabin_robot", "stabilizing_platform", "scara_robot", "spr_tripod"}) {
    const Mechanism mechanism = ShippedModel(name);
    const PictureFrame frame = HomeFrame(mechanism);
    const Arrangement set = Arrange(mechanism, {frame}, {}, PictureOptions{});
    PictureOptions plain;
    plain.output_frames = false;
    Eigen::AlignedBox2d box;
    for (const Item& item : MechanismItems(mechanism, frame, set.scale, plain)) {
      if (item.framing != Framing::kAlways) continue;
      for (const Vec3& p : Corners(item)) box.extend(Project(set.camera, 4.0 / 3.0, set.R_DW * p));
    }
    EXPECT_GT(box.sizes().maxCoeff(), 0.7) << name;
  }
}

}  // namespace
}  // namespace mbv::render
