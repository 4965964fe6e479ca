// Small mechanisms for pictures.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "mechanism/mechanism.h"
#include "render/render.h"

namespace mbv::test {

/// A ball of 0.1 m radius on one length drive of 1 m over the origin; home is closed by one ball
/// joint that is marked as a loop closure. Up is against `gravity_W`.
inline Mechanism BallOnLeg(const Vec3& gravity_W = Vec3(0, 0, -9.81)) {
  const Vec3 up = gravity_W.norm() > 0.0 ? Vec3(-gravity_W.normalized()) : Vec3::UnitZ();
  Mechanism mechanism;
  mechanism.name = "ball_on_leg";
  mechanism.gravity_W = gravity_W;
  if (gravity_W.norm() > 0.0) mechanism.up_W = -gravity_W.normalized();
  Body world{.name = "world", .frames = {}, .shapes = {}};
  Body ball{.name = "ball", .mass = 1.0, .frames = {}, .shapes = {}};
  ball.shapes.push_back(
      {.geometry = Ball{.p_centre = Vec3::Zero(), .radius = 0.1}, .color = "#20c040"});
  mechanism.bodies = {world, ball};
  Pose X_WBall = Pose::Identity();
  X_WBall.translation() = up;
  mechanism.X_WB_home = {Pose::Identity(), X_WBall};
  mechanism.drives.push_back(
      {.name = "leg",
       .kind =
           DistanceDrive{
               .body_from = 0, .p_from = Vec3::Zero(), .body_to = 1, .p_to = Vec3::Zero()},
       .range = {}});
  Joint joint;
  joint.name = "tip";
  joint.kind = JointKind::kSpherical;
  joint.X_PF.translation() = up;
  joint.child = 1;
  joint.closure = true;
  mechanism.joints.push_back(joint);
  mechanism.outputs.push_back({.name = "ball", .body = 1});
  return mechanism;
}

/// Fast options: small, one pass.
inline PictureOptions Quick() {
  PictureOptions options;
  options.size_px = {320, 240};
  options.passes = 1;
  return options;
}

/// One picture; of the home pose if no frame is given.
inline Picture DrawnPicture(const Mechanism& mechanism, const PictureOptions& options,
                            PictureFrame frame = {}, const Overlay& overlay = {}) {
  if (frame.X_WB.empty()) frame = HomeFrame(mechanism);
  Picture drawn;
  const RunSummary summary =
      RenderPictures(mechanism, {frame}, overlay, options, [&](int index, Picture picture) {
        EXPECT_EQ(index, 0);
        drawn = std::move(picture);
        return true;
      });
  EXPECT_TRUE(summary.ok()) << summary.message;
  return drawn;
}

inline bool Near(const std::uint8_t* pixel, int r, int g, int b, int tolerance) {
  return std::abs(pixel[0] - r) <= tolerance && std::abs(pixel[1] - g) <= tolerance &&
         std::abs(pixel[2] - b) <= tolerance;
}

}  // namespace mbv::test
