#include "render/render.h"

#include <gtest/gtest.h>
#include <png.h>

#include <cstdio>
#include <cstdlib>
#include <set>

#include "render/camera.h"
#include "render/gl_objects.h"
#include "render/scene.h"
#include "render/stage.h"
#include "tests/mechanisms/rendered.h"

namespace mbv {
namespace {

using test::BallOnLeg;
using test::DrawnPicture;
using test::Quick;

// Bounds of the pixels that satisfy a test, as (left, top, right, bottom); empty: left > right.
struct Bounds {
  int left = 1 << 20, top = 1 << 20, right = -1, bottom = -1, count = 0;
};
template <typename Test>
Bounds BoundsOf(const Picture& picture, const Test& test) {
  Bounds bounds;
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      if (!test(&picture.rgb[3UL * (static_cast<std::size_t>(y) * picture.width + x)])) continue;
      bounds = {.left = std::min(bounds.left, x),
                .top = std::min(bounds.top, y),
                .right = std::max(bounds.right, x),
                .bottom = std::max(bounds.bottom, y),
                .count = bounds.count + 1};
    }
  }
  return bounds;
}

bool IsRed(const std::uint8_t* p) { return p[0] > 150 && p[1] < 90 && p[2] < 90; }
bool IsBlue(const std::uint8_t* p) { return p[2] > 150 && p[0] < 90 && p[1] < 130; }
bool IsGreen(const std::uint8_t* p) { return p[1] > 80 && p[1] > 2 * p[0] && p[1] > 2 * p[2]; }
bool IsMagenta(const std::uint8_t* p) { return p[0] > 150 && p[1] < 90 && p[2] > 90; }

PictureFrame FrameWithForce(const Mechanism& mechanism, double force) {
  PictureFrame frame = HomeFrame(mechanism);
  frame.drive_forces = {force};
  return frame;
}

// Triads are red and blue, too.
PictureOptions QuickWithoutTriads() {
  PictureOptions options = Quick();
  options.output_frames = false;
  return options;
}

TEST(Pictures, HaveTheSizeAskedForAndAreNotBlank) {
  PictureOptions options = Quick();
  options.size_px = {200, 136};
  const Mechanism mechanism = BallOnLeg();
  const Picture picture = DrawnPicture(mechanism, options);
  ASSERT_EQ(picture.width, 200);
  ASSERT_EQ(picture.height, 136);
  ASSERT_EQ(picture.rgb.size(), 3U * 200 * 136);
  const std::set<std::uint8_t> values(picture.rgb.begin(), picture.rgb.end());
  EXPECT_GT(values.size(), 50U);
}

TEST(Pictures, AreTheSameBytesForTheSameInput) {
  const Mechanism mechanism = BallOnLeg();
  PictureOptions options = Quick();
  options.passes = 3;
  PictureFrame frame = FrameWithForce(mechanism, 10.0);
  frame.caption = {.title = "title", .detail = "detail", .status = "agree"};
  EXPECT_EQ(DrawnPicture(mechanism, options, frame).rgb,
            DrawnPicture(mechanism, options, frame).rgb);
}

TEST(Pictures, ShowTheMechanismInsideTheFrameWithAMargin) {
  const Mechanism mechanism = BallOnLeg();
  const Picture picture = DrawnPicture(mechanism, Quick());
  const Bounds green = BoundsOf(picture, IsGreen);
  ASSERT_GT(green.count, 200);
  EXPECT_GT(green.left, 0.03 * picture.width);
  EXPECT_LT(green.right, 0.97 * picture.width);
  EXPECT_GT(green.top, 0.02 * picture.height);
  // The ball is the top fifth of the mechanism: it must not fill the frame, nor be tiny.
  EXPECT_LT(green.bottom, 0.6 * picture.height);
  EXPECT_GT(green.bottom - green.top, 0.1 * picture.height);
}

TEST(Pictures, AreUprightForAnyGravity) {
  for (const Vec3& g :
       {Vec3(0, 0, -9.81), Vec3(0, 0, 9.81), Vec3(0, -9.81, 0), Vec3(9.81, 0, 0), Vec3(1, 2, -3)}) {
    const Mechanism mechanism = BallOnLeg(g);
    const Picture picture = DrawnPicture(mechanism, Quick());
    const Bounds green = BoundsOf(picture, IsGreen);
    ASSERT_GT(green.count, 200) << g.transpose();
    // The ball stands on its leg: above the middle of the picture.
    EXPECT_LT(green.bottom, 0.6 * picture.height) << g.transpose();
  }
}

TEST(Pictures, HaveAnArrowInTheColourOfTheSignOnlyWhenThereIsAForce) {
  const Mechanism mechanism = BallOnLeg();
  const PictureOptions options = QuickWithoutTriads();
  const Picture none = DrawnPicture(mechanism, options);
  const Picture push = DrawnPicture(mechanism, options, FrameWithForce(mechanism, 20.0));
  const Picture pull = DrawnPicture(mechanism, options, FrameWithForce(mechanism, -20.0));
  const Picture nan = DrawnPicture(mechanism, options, FrameWithForce(mechanism, kNan));
  EXPECT_EQ(BoundsOf(none, IsRed).count, 0);
  EXPECT_EQ(BoundsOf(nan, IsRed).count, 0);
  EXPECT_GT(BoundsOf(push, IsRed).count, 30);
  EXPECT_EQ(BoundsOf(pull, IsRed).count, 0);
  EXPECT_GT(BoundsOf(pull, IsBlue).count, BoundsOf(none, IsBlue).count);
  // Thrust points on along the leg, out of the ball's top.
  EXPECT_LT(BoundsOf(push, IsRed).top, BoundsOf(push, IsGreen).top);
}

TEST(Stage, DrawsAnArrowAsLongAsACylinderOfTheSameLength) {
  std::unique_ptr<render::Stage> stage;
  const RunSummary opened =
      render::Stage::Open({.width = 320, .height = 240, .passes = 1, .ground_m = -1.0}, &stage);
  ASSERT_TRUE(opened.ok()) << opened.message;
  render::Camera camera;
  camera.azimuth_deg = -90.0;
  camera.distance_m = 4.0;
  camera.lookat_D = Vec3(0.0, 0.0, 0.5);
  const auto draw = [&](render::Solid solid) {
    Picture picture;
    const RunSummary drawn =
        stage->Draw({.items = {render::Between(solid, Vec3::Zero(), Vec3::UnitZ(), 0.05,
                                               render::MaterialOf("push"))}},
                    Mat3::Identity(), camera, &picture);
    EXPECT_TRUE(drawn.ok()) << drawn.message;
    return BoundsOf(picture, IsRed);
  };
  const Bounds arrow = draw(render::Solid::kArrow), cylinder = draw(render::Solid::kCylinder);
  EXPECT_NEAR(arrow.top, cylinder.top, 3);  // the tip is thinner than a pixel
  EXPECT_NEAR(arrow.bottom, cylinder.bottom, 1);
}

TEST(Pictures, DrawArrowsToOneScaleOverAllFrames) {
  const Mechanism mechanism = BallOnLeg();
  std::vector<Bounds> red;
  const RunSummary summary =
      RenderPictures(mechanism, {FrameWithForce(mechanism, 100.0), FrameWithForce(mechanism, 60.0)},
                     {}, QuickWithoutTriads(), [&](int, const Picture& picture) {
                       red.push_back(BoundsOf(picture, IsRed));
                       return true;
                     });
  ASSERT_TRUE(summary.ok()) << summary.message;
  ASSERT_EQ(red.size(), 2U);
  EXPECT_GT(red[1].top, red[0].top + 5);
}

TEST(Pictures, RingTheClosuresUnlessSwitchedOff) {
  Mechanism mechanism = BallOnLeg();
  std::get<Ball>(mechanism.bodies[1].shapes[0].geometry).radius = 0.01;
  PictureOptions options = Quick();
  EXPECT_GT(BoundsOf(DrawnPicture(mechanism, options), IsMagenta).count, 4);
  options.closures = false;
  EXPECT_EQ(BoundsOf(DrawnPicture(mechanism, options), IsMagenta).count, 0);
}

TEST(Pictures, ShowARedBarWhereAClosureCameApart) {
  const Mechanism mechanism = BallOnLeg();
  PictureFrame apart = HomeFrame(mechanism);
  apart.X_WB[1].translation() += Vec3(0.0, 0.0, -0.5);
  const PictureOptions options = QuickWithoutTriads();
  const auto is_bar = [](const std::uint8_t* p) { return p[0] > 170 && p[1] < 60 && p[2] < 60; };
  EXPECT_EQ(BoundsOf(DrawnPicture(mechanism, options), is_bar).count, 0);
  EXPECT_GT(BoundsOf(DrawnPicture(mechanism, options, apart), is_bar).count, 15);
}

TEST(Pictures, ChangeWithTheCamera) {
  const Mechanism mechanism = BallOnLeg();
  PictureOptions options = Quick();
  const Picture automatic = DrawnPicture(mechanism, options);
  options.camera.distance_m = 20.0;
  const Picture far = DrawnPicture(mechanism, options);
  EXPECT_LT(BoundsOf(far, IsGreen).count, BoundsOf(automatic, IsGreen).count / 4);
  options.camera = {.azimuth_deg = 0.0, .elevation_deg = 80.0};
  const Picture above = DrawnPicture(mechanism, options);
  EXPECT_NE(above.rgb, automatic.rgb);
  options.camera = {.lookat_W = Vec3(0, 0, 1)};
  const Bounds centred = BoundsOf(DrawnPicture(mechanism, options), IsGreen);
  // The leg hides little of the ball, whose middle is now the middle of the picture.
  EXPECT_NEAR(0.5 * (centred.left + centred.right), 160.0, 4.0);
  EXPECT_NEAR(0.5 * (centred.top + centred.bottom), 120.0, 6.0);
}

TEST(Pictures, WriteTheCaptionIntoABarOnWhiteAndNoneWithoutText) {
  Mechanism mechanism = BallOnLeg();
  PictureOptions options = Quick();
  options.size_px = {640, 480};
  PictureFrame frame = HomeFrame(mechanism);
  const auto bar = [](const Picture& picture) {
    int white = 0, dark = 0;
    for (int x = 0; x < picture.width; ++x) {
      for (int y = picture.height - 40; y < picture.height; ++y) {
        const std::uint8_t* p =
            &picture.rgb[3UL * (static_cast<std::size_t>(y) * picture.width + x)];
        white += p[0] == 255 && p[1] == 255 && p[2] == 255;
        dark += p[0] < 150;
      }
    }
    return std::pair(white, dark);
  };
  EXPECT_LT(bar(DrawnPicture(mechanism, options, frame)).first, 100);
  // The verdict is the only green thing.
  std::get<Ball>(mechanism.bodies[1].shapes[0].geometry).radius = 1e-3;
  options.output_frames = false;
  frame.caption = {.title = "ball_on_leg / test",
                   .detail = "t = 1.5 s",
                   .status = "agree",
                   .mood = Caption::Mood::kGood};
  const Picture with_text = DrawnPicture(mechanism, options, frame);
  const auto [white, dark] = bar(with_text);
  EXPECT_GT(white, 640 * 20 / 2);
  EXPECT_GT(dark, 10);  // the legend's letters
  const auto is_verdict = [](const std::uint8_t* p) {
    return p[0] < 60 && p[1] > 110 && p[2] < 80;
  };
  const Bounds verdict = BoundsOf(with_text, is_verdict);
  ASSERT_GT(verdict.count, 20);
  EXPECT_GT(verdict.left, 400);
  EXPECT_GT(verdict.top, 400);
}

TEST(Pictures, ShowPathsAndTranslucentMeshes) {
  const Mechanism mechanism = BallOnLeg();
  const PictureOptions options = QuickWithoutTriads();
  Overlay path;
  path.paths.push_back({.points_W = {Vec3(0.4, -0.4, 0.1), Vec3(0.4, 0.4, 0.6)},
                        .color = "#ff0000",
                        .radius_m = 0.02});
  EXPECT_GT(BoundsOf(DrawnPicture(mechanism, options, HomeFrame(mechanism), path), IsRed).count,
            50);
  // Inside the green ball it shows through.
  const auto is_mixed = [](const std::uint8_t* p) {
    return p[0] > 90 && p[0] < 2 * p[1] && p[2] < 80;
  };
  const int without = BoundsOf(DrawnPicture(mechanism, options), is_mixed).count;
  path.paths[0].points_W = {Vec3(-0.06, 0, 1), Vec3(0.06, 0, 1)};
  EXPECT_GT(BoundsOf(DrawnPicture(mechanism, options, HomeFrame(mechanism), path), is_mixed).count,
            without + 30);
  // A pane before the ball tints it, but lets its green through.
  Overlay pane;
  const Vec3 c(0.4, -0.7, 1.1), x(0.6, 0.35, 0.0), z(0, 0, 0.7);
  pane.meshes.push_back({.vertices_W = {c - x - z, c + x - z, c + x + z, c - x + z},
                         .triangles = {{0, 1, 2}, {0, 2, 3}},
                         .color = "#0000ff60"});
  const Picture tinted = DrawnPicture(mechanism, options, HomeFrame(mechanism), pane);
  const auto is_both = [](const std::uint8_t* p) { return p[1] > 70 && p[2] > 70 && p[0] < 60; };
  EXPECT_GT(BoundsOf(tinted, is_both).count, 100);
}

TEST(Pictures, DrawTheSeaOnlyWhereTheWorldHasOne) {
  Mechanism mechanism = BallOnLeg();
  const auto is_water = [](const std::uint8_t* p) { return p[2] > p[0] + 30 && p[1] > p[0] + 10; };
  EXPECT_LT(BoundsOf(DrawnPicture(mechanism, Quick()), is_water).count, 3000);
  Box water;
  water.size = Vec3(10, 10, 0.02);
  mechanism.bodies[0].shapes.push_back({.geometry = water, .color = "sea"});
  EXPECT_GT(BoundsOf(DrawnPicture(mechanism, Quick()), is_water).count, 20000);
}

TEST(Pictures, ShowTheMechanismFromBelowTheGroundUnveiled) {
  const Mechanism mechanism = BallOnLeg();
  PictureOptions options = Quick();
  options.camera.elevation_deg = -30.0;
  const Picture below = DrawnPicture(mechanism, options);
  EXPECT_GT(BoundsOf(below, IsGreen).count, 100);
}

TEST(Pictures, StopWhenTheSinkHasEnough) {
  const Mechanism mechanism = BallOnLeg();
  int drawn = 0;
  const RunSummary summary =
      RenderPictures(mechanism, std::vector<PictureFrame>(5, HomeFrame(mechanism)), {}, Quick(),
                     [&](int, const Picture&) { return ++drawn < 2; });
  EXPECT_TRUE(summary.ok());
  EXPECT_EQ(drawn, 2);
}

TEST(Pictures, RefuseWhatDoesNotFitTheMechanismAndQuoteTheRule) {
  const Mechanism mechanism = BallOnLeg();
  const auto message = [&](const PictureFrame& frame, const PictureOptions& options,
                           const Overlay& overlay = {}) {
    const RunSummary summary = RenderPictures(mechanism, {frame}, overlay, options,
                                              [](int, const Picture&) { return true; });
    EXPECT_EQ(summary.stop, Stop::kUnsupported);
    return summary.message;
  };
  PictureFrame frame = HomeFrame(mechanism);
  frame.X_WB.pop_back();
  EXPECT_EQ(message(frame, Quick()), "pictures: frame 0 has 1 poses for 2 bodies");
  frame = FrameWithForce(mechanism, 1.0);
  frame.drive_forces.push_back(2.0);
  EXPECT_EQ(message(frame, Quick()), "pictures: frame 0 has 2 forces for 1 drives");
  frame = HomeFrame(mechanism);
  frame.X_WB[1].translation().x() = kNan;
  EXPECT_EQ(message(frame, Quick()), "pictures: frame 0: the pose of body 'ball' is not finite");
  Overlay overlay;
  overlay.meshes.push_back({.vertices_W = {Vec3::Zero()}, .triangles = {{0, 0, 1}}});
  EXPECT_EQ(message(HomeFrame(mechanism), Quick(), overlay),
            "pictures: a mesh triangle refers to vertex 1 of 1");
  PictureOptions options = Quick();
  options.passes = 0;
  EXPECT_EQ(message(HomeFrame(mechanism), options),
            "pictures: passes = 0 violates 1 <= passes <= 64");
  options = Quick();
  options.size_px = {10, 240};
  options.camera.distance_m = -1.0;
  EXPECT_EQ(Check(options).findings().size(), 2U);
}

TEST(Pictures, DrawBodiesWithoutShapesAsRods) {
  Mechanism mechanism = BallOnLeg();
  mechanism.bodies[1].shapes.clear();
  mechanism.bodies[1].p_BoBcm_B = Vec3(0.0, 0.4, 0.0);  // the rod goes from the joint to here
  const PictureOptions options = QuickWithoutTriads();
  const Picture with_rod = DrawnPicture(mechanism, options);
  const auto is_accent = [](const std::uint8_t* p) {
    return p[0] > 100 && p[1] < 0.75 * p[0] && p[2] < 0.4 * p[0];
  };
  EXPECT_GT(BoundsOf(with_rod, is_accent).count, 100);
}

// In a process of its own, where nothing has been drawn yet.
TEST(OpenGl, ThatIsMissingIsNamedWithItsPackage) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto ask = [](const char* library) {
    std::fputs(render::LoadGl(library).c_str(), stderr);
    std::exit(0);
  };
  EXPECT_EXIT(ask("libNoMesa.so.8"), testing::ExitedWithCode(0),
              "libNoMesa.so.8.*package libosmesa6");
  EXPECT_EXIT(ask("libz.so.1"), testing::ExitedWithCode(0),
              "libz.so.1 has no OSMesaCreateContextAttribs, ");
  EXPECT_EQ(render::LoadGl(), "");
}

TEST(Png, IsReadBackPixelForPixel) {
  Picture picture{.width = 3, .height = 2, .rgb = {}};
  for (int i = 0; i < 18; ++i) picture.rgb.push_back(static_cast<std::uint8_t>(13 * i));
  const std::string png = EncodePng(picture);
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_memory(&image, png.data(), png.size()), 0);
  EXPECT_EQ(image.width, 3U);
  EXPECT_EQ(image.height, 2U);
  image.format = PNG_FORMAT_RGB;
  std::vector<std::uint8_t> rgb(PNG_IMAGE_SIZE(image));
  ASSERT_NE(png_image_finish_read(&image, nullptr, rgb.data(), 0, nullptr), 0);
  EXPECT_EQ(rgb, picture.rgb);
}

}  // namespace
}  // namespace mbv
