#include "math/spatial.h"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace mbv {
namespace {

constexpr double kRoundoff = 16 * kEps;

TEST(RollPitchYaw, IsYawAfterPitchAfterRoll) {
  // Roll 90° turns y to z; yaw 90° afterwards turns x to y and leaves z.
  const Mat3 R = RotRpy({std::numbers::pi / 2, 0, std::numbers::pi / 2});
  EXPECT_TRUE((R * Vec3::UnitY()).isApprox(Vec3::UnitZ(), kRoundoff));
  EXPECT_TRUE((R * Vec3::UnitX()).isApprox(Vec3::UnitY(), kRoundoff));
}

TEST(RollPitchYaw, ReturnsTheAnglesAwayFromTheSingularity) {
  std::mt19937_64 random(20180601);
  std::uniform_real_distribution<double> angle(-1.5, 1.5);
  for (int i = 0; i < 100; ++i) {
    const Vec3 rpy(2 * angle(random), angle(random), 2 * angle(random));
    // Near pitch = π/2 the angles lose digits as 1/cos(pitch).
    EXPECT_LT((RpyOf(RotRpy(rpy)) - rpy).norm(), kRoundoff / std::cos(rpy.y())) << rpy.transpose();
  }
}

TEST(RollPitchYaw, ReproducesTheRotationAtAPitchOfNinetyDegrees) {
  for (const double pitch : {-std::numbers::pi / 2, std::numbers::pi / 2}) {
    for (const double noise : {0.0, 1e-17, -1e-12, 1e-9}) {
      const Mat3 R = RotRpy({0.7, pitch + noise, -1.9});
      EXPECT_LT((RotRpy(RpyOf(R)) - R).norm(), kRoundoff) << pitch << " " << noise;
    }
  }
}

}  // namespace
}  // namespace mbv
