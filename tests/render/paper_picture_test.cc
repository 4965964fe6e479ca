// Pictures for papers: grounds, labels, scales, other instants, outlines, tiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "render/annotations.h"
#include "render/stage.h"
#include "tests/mechanisms/rendered.h"

namespace mbv::render {
namespace {

PictureOptions Plain() {
  PictureOptions options = test::Quick();
  options.output_frames = options.closures = false;
  options.passes = 8;
  return options;
}

std::size_t PixelsWhere(const Picture& picture, const auto& test) {
  std::size_t count = 0;
  for (std::size_t k = 0; 3 * k < picture.rgb.size(); ++k) {
    count += test(&picture.rgb[3 * k], picture.alpha.empty() ? 255 : picture.alpha[k]) ? 1 : 0;
  }
  return count;
}

int GreatestGap(const Picture& a, const Picture& b) {
  int most = a.rgb.size() == b.rgb.size() && a.alpha == b.alpha ? 0 : 255;
  for (std::size_t i = 0; i < std::min(a.rgb.size(), b.rgb.size()); ++i) {
    most = std::max(most, std::abs(a.rgb[i] - b.rgb[i]));
  }
  return most;
}

TEST(PaperPictures, AreTransparentWithoutADarkFringe) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  EXPECT_TRUE(test::DrawnPicture(mechanism, options).alpha.empty());
  options.background = "transparent";
  options.shadows = false;
  const Picture clear = test::DrawnPicture(mechanism, options);
  ASSERT_EQ(clear.alpha.size(), 320U * 240U);
  EXPECT_EQ(clear.alpha.front(), 0);
  const auto part = [&](int low, int high) {
    return PixelsWhere(clear, [&](const std::uint8_t*, int a) { return a >= low && a <= high; });
  };
  EXPECT_GT(part(0, 0), 40000U);
  EXPECT_GT(part(255, 255), 1000U);
  EXPECT_GT(part(60, 200), 50U);  // edges
  // Laid on white it is the white picture: colours are not multiplied by their opacity.
  options.background = "#ffffff";
  const Picture white = test::DrawnPicture(mechanism, options);
  const Picture laid = OnWhite(clear);
  std::size_t off = 0;
  for (std::size_t i = 0; i < white.rgb.size(); ++i) {
    off += std::abs(white.rgb[i] - laid.rgb[i]) > 3 ? 1 : 0;
  }
  EXPECT_LT(off, white.rgb.size() / 2000);
  // A colour multiplied twice would be this dark.
  const auto fringe = [](const std::uint8_t* p, int a) {
    return a > 60 && a < 130 && p[0] < 20 && p[1] < 40 && p[2] < 20;
  };
  EXPECT_EQ(PixelsWhere(clear, fringe), 0U);
}

TEST(PaperPictures, KeepSoftShadowsOnWhiteAndOnNothing) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  options.background = "transparent";
  const auto shadow = [](const std::uint8_t* p, int a) {
    return p[0] < 5 && p[1] < 5 && p[2] < 5 && a > 20 && a < 160;
  };
  EXPECT_GT(PixelsWhere(test::DrawnPicture(mechanism, options), shadow), 100U);
  options.background = "white";
  const auto grey = [](const std::uint8_t* p, int) {
    return p[0] > 100 && p[0] < 240 && p[0] == p[1] && p[1] == p[2];
  };
  const std::size_t with = PixelsWhere(test::DrawnPicture(mechanism, options), grey);
  options.background = "#ffffff";
  EXPECT_GT(with, PixelsWhere(test::DrawnPicture(mechanism, options), grey) + 100);
}

TEST(PaperPictures, AreTheSameInTilesAsInOnePiece) {
  const std::vector<Item> items = {
      BallAt(Vec3(0, 0, 0.6), 0.3, MaterialOf("push")),
      Between(Solid::kCylinder, Vec3(-0.6, 0, 0.1), Vec3(0.5, 0.2, 1), 0.05, MaterialOf("steel"))};
  for (const bool line_art : {false, true}) {
    for (const Ground ground : {Ground::kGrid, Ground::kSea}) {
      StageOptions options{.width = 300, .height = 220, .radius_m = 2.0, .ground = ground};
      options.line_art = line_art;
      const auto draw = [&](int tile_px) {
        options.tile_px = tile_px;
        std::unique_ptr<Stage> stage;
        EXPECT_TRUE(Stage::Open(options, &stage).ok());
        const Camera camera{.azimuth_deg = -70.0,
                            .elevation_deg = 25.0,
                            .distance_m = 5.0,
                            .lookat_D = Vec3(0.0, 0.0, 0.4)};
        Picture picture;
        EXPECT_TRUE(stage->Draw({.items = items}, Mat3::Identity(), camera, &picture).ok());
        return picture;
      };
      const Picture whole = draw(2048);
      for (const int tile_px : {64, 117}) {
        const Picture tiled = draw(tile_px);
        std::size_t off = 0;
        ASSERT_EQ(whole.rgb.size(), tiled.rgb.size());
        for (std::size_t i = 0; i < whole.rgb.size(); ++i) {
          off += std::abs(whole.rgb[i] - tiled.rgb[i]) > 1 ? 1 : 0;
        }
        // Along edges the tiles' rounding may decide otherwise about a sample.
        EXPECT_LT(off, whole.rgb.size() / 1000) << tile_px << line_art;
      }
    }
  }
}

TEST(PaperPictures, DrawOutlinesOfFacesInBlackOnWhite) {
  Mechanism mechanism = test::BallOnLeg();
  mechanism.bodies[1].shapes[0].geometry = Box{.X_BG = Pose::Identity(), .size = Vec3(.3, .3, .3)};
  PictureOptions options = Plain();
  options.line_art = true;
  const Picture art = test::DrawnPicture(mechanism, options);
  const auto black = [](const std::uint8_t* p, int) { return p[0] < 60; };
  const auto white = [](const std::uint8_t* p, int) { return p[0] == 255; };
  const auto coloured = [](const std::uint8_t* p, int) { return p[0] != p[1] || p[1] != p[2]; };
  EXPECT_EQ(PixelsWhere(art, coloured), 0U);
  EXPECT_GT(PixelsWhere(art, white), 60000U);
  const std::size_t lines = PixelsWhere(art, black);
  EXPECT_GT(lines, 300U);
  EXPECT_LT(lines, 8000U);
  // A ball has an outline, a box has edges inside of it, too.
  mechanism.bodies[1].shapes[0].geometry = Ball{.p_centre = Vec3::Zero(), .radius = 0.15};
  EXPECT_GT(lines, PixelsWhere(test::DrawnPicture(mechanism, options), black) + 50);
}

TEST(PaperPictures, ShowGhostsPalerThanTheInstantItself) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  options.background = "#ffffff";
  options.camera = {
      .azimuth_deg = -90.0, .elevation_deg = 5.0, .distance_m = 5.0, .lookat_W = Vec3(0, 0, 1)};
  PictureFrame frame = HomeFrame(mechanism);
  const auto strong = [](const std::uint8_t* p, int) { return p[1] > 80 && p[1] > 2 * p[0]; };
  const auto pale = [](const std::uint8_t* p, int) {
    return p[0] > 150 && p[1] > p[0] + 15 && p[1] > p[2] + 8;
  };
  const Picture alone = test::DrawnPicture(mechanism, options, frame);
  EXPECT_LT(PixelsWhere(alone, pale), 60U);
  frame.X_WB_ghosts = {frame.X_WB};
  frame.X_WB_ghosts[0][1].translation() += Vec3(0.6, 0.0, 0.0);
  const Picture both = test::DrawnPicture(mechanism, options, frame);
  EXPECT_GT(PixelsWhere(both, pale), 200U);
  EXPECT_NEAR(static_cast<double>(PixelsWhere(both, strong)),
              static_cast<double>(PixelsWhere(alone, strong)), 60.0);
  // What stands still is not drawn twice.
  frame.X_WB_ghosts = {frame.X_WB};
  EXPECT_LE(GreatestGap(test::DrawnPicture(mechanism, options, frame), alone), 1);
}

TEST(PaperPictures, MoveBodiesApart) {
  Mechanism mechanism = test::BallOnLeg();
  mechanism.bodies.push_back({.name = "other", .mass = 1.0, .frames = {}, .shapes = {}});
  mechanism.X_WB_home.push_back(Pose::Identity());
  const PictureFrame frame = HomeFrame(mechanism);
  PictureOptions options = Plain();
  const Camera before = Arrange(mechanism, {frame}, {}, options).camera;
  options.exploded = 0.5;
  EXPECT_EQ(Check(options).findings().size(), 1U);
  options.exploded = 3.0;
  EXPECT_TRUE(Check(options).findings().empty());
  EXPECT_NE(test::DrawnPicture(mechanism, options).rgb, test::DrawnPicture(mechanism, Plain()).rgb);
  EXPECT_GT(before.distance_m, 0.0);
}

// Width of what is green at a distance before and behind the look-at point.
TEST(PaperPictures, ShowEqualLengthsEquallyLongWithParallelRays) {
  Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  options.size_px = {640, 480};
  options.camera = {
      .azimuth_deg = -90.0, .elevation_deg = 0.0, .distance_m = 3.0, .lookat_W = Vec3(0, 0, 1)};
  const auto width = [&](double y) {
    PictureFrame frame = HomeFrame(mechanism);
    frame.X_WB[1].translation() = Vec3(0, y, 1);
    const Picture picture = test::DrawnPicture(mechanism, options, frame);
    int left = 640, right = -1;
    for (int x = 0; x < 640; ++x) {
      const std::uint8_t* p = &picture.rgb[3UL * (240 * 640 + x)];
      if (!(p[1] > 60 && p[1] > 1.6 * p[0])) continue;
      left = std::min(left, x);
      right = x;
    }
    return right - left + 1;
  };
  EXPECT_GT(width(-0.8), width(0.8) + 20);
  options.camera.orthographic = true;
  // The ball is 0.2 m across; the picture's height shows 2 · 3 m · tan(13°).
  const double expected = 0.2 * 480 / (6.0 * std::tan(13.0 / 180.0 * M_PI));
  for (const double y : {-0.8, 0.0, 0.8}) EXPECT_NEAR(width(y), expected, 2.0) << y;
}

TEST(CameraFit, FitsParallelRaysToTheMargins) {
  CameraFit fit({.azimuth_deg = 20.0, .elevation_deg = 30.0, .orthographic = true}, 4.0 / 3.0, {},
                Mat3::Identity());
  std::vector<Vec3> points;
  for (int i = 0; i < 8; ++i) points.emplace_back(i & 1, (i & 2) / 2, (i & 4) / 4);
  for (const Vec3& p : points) fit.Include(p);
  const Camera camera = fit.Fit();
  Eigen::AlignedBox2d box;
  for (const Vec3& p : points) box.extend(Project(camera, 4.0 / 3.0, p));
  EXPECT_GE(box.min().minCoeff(), 0.05 - 1e-9);
  EXPECT_LE(box.max().maxCoeff(), 0.95 + 1e-9);
  EXPECT_NEAR(box.sizes().maxCoeff(), 0.9, 1e-9);
}

Picture Paper(int width, int height) {
  return {.width = width,
          .height = height,
          .rgb = std::vector<std::uint8_t>(3UL * width * height, 255)};
}

// Length of the longest dark row [px].
int LongestRow(const Picture& picture) {
  int longest = 0;
  for (int y = 0; y < picture.height; ++y) {
    int run = 0;
    for (int x = 0; x < picture.width; ++x) {
      run = picture.rgb[3UL * (y * picture.width + x)] < 60 ? run + 1 : 0;
      longest = std::max(longest, run);
    }
  }
  return longest;
}

TEST(ScaleBar, IsOfARoundLengthAndAsLongAsItSays) {
  EXPECT_EQ(RoundLength(0.0399), 0.02);
  EXPECT_NEAR(RoundLength(7.3), 5.0, 1e-12);
  EXPECT_NEAR(RoundLength(1.99), 1.0, 1e-12);
  Picture picture = Paper(800, 600);
  PaintScaleBar(1.2, true, 600, &picture);  // 0.5 m per 250 px; a quarter of the width is 0.4 m
  EXPECT_EQ(LongestRow(picture), 100);      // 0.2 m
  // Perspective is reported in words.
  Picture other = Paper(800, 600);
  PaintScaleBar(1.2, false, 600, &other);
  EXPECT_EQ(LongestRow(other), 100);
  EXPECT_NE(picture.rgb, other.rgb);
}

TEST(ScaleBar, IsInThePicture) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  options.background = "#ffffff";
  options.camera.orthographic = true;
  const Picture without = test::DrawnPicture(mechanism, options);
  options.scale_bar = true;
  const Picture with = test::DrawnPicture(mechanism, options);
  const Camera camera = Arrange(mechanism, {HomeFrame(mechanism)}, {}, options).camera;
  const double per_px = HeightAtLookat(camera) / 240.0;
  EXPECT_NE(with.rgb, without.rgb);
  EXPECT_EQ(LongestRow(with), std::lround(RoundLength(80.0 * per_px) / per_px));
}

TEST(Labels, LieOverNoOtherAndLeaveNoneOut) {
  std::vector<Label> labels;
  for (int k = 0; k < 12; ++k) {
    labels.push_back({.x = 0.5 + 1e-3 * k, .y = 0.5, .text = "joint_" + std::to_string(k)});
  }
  Picture picture = Paper(640, 480);
  EXPECT_EQ(PaintLabels(labels, 480, &picture), 0);
  const auto ink = [](const std::uint8_t* p, int) { return p[0] < 200; };
  const std::size_t all = PixelsWhere(picture, ink);
  std::size_t each = 0;
  for (const Label& label : labels) {
    Picture one = Paper(640, 480);
    EXPECT_EQ(PaintLabels({label}, 480, &one), 0);
    each += PixelsWhere(one, ink);
  }
  EXPECT_GT(all, each - each / 10);
  // Crowded into a corner, some find no room, and that is reported.
  Picture strip = Paper(640, 480);
  for (Label& label : labels) label = {.x = 0.5, .y = 0.02, .text = "a_very_long_name"};
  EXPECT_GT(PaintLabels(labels, 20, &strip), 0);
  // What is outside is not named.
  Picture bare = Paper(640, 480);
  EXPECT_EQ(PaintLabels({{.x = 1.2, .y = 0.5, .text = "far"}}, 480, &bare), 0);
  EXPECT_EQ(bare.rgb, Paper(640, 480).rgb);
}

TEST(Labels, NameWhatIsAskedForAndNothingElse) {
  const Mechanism mechanism = test::BallOnLeg();
  PictureOptions options = Plain();
  const Picture bare = test::DrawnPicture(mechanism, options);
  options.labels = {"joints"};
  const Picture joints = test::DrawnPicture(mechanism, options);
  options.labels = {"tip"};  // the only joint
  EXPECT_EQ(test::DrawnPicture(mechanism, options).rgb, joints.rgb);
  EXPECT_NE(joints.rgb, bare.rgb);
  options.labels = {"bodies"};
  EXPECT_NE(test::DrawnPicture(mechanism, options).rgb, joints.rgb);
  options.labels = {"frames"};  // it has none
  EXPECT_EQ(test::DrawnPicture(mechanism, options).rgb, bare.rgb);
}

}  // namespace
}  // namespace mbv::render
