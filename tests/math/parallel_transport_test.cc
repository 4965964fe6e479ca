// Parallel transport of a line against the motion that it comes from.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "math/spatial.h"

namespace mbv {
namespace {

// A line on a cone of half angle β about z, one turn in a second.
MovingDirection OnCone(double beta, double t) {
  const double w = 2.0 * std::numbers::pi, c = std::cos(w * t), s = std::sin(w * t);
  const double r = std::sin(beta);
  return {{r * c, r * s, std::cos(beta)},
          {-r * w * s, r * w * c, 0.0},
          {-r * w * w * c, -r * w * w * s, 0.0}};
}

// Round the cone in `steps` steps; the angle by which the body comes back turned.
double TurnAfterOneRound(double beta, int steps) {
  Mat3 R = Mat3::Identity();
  const double h = 1.0 / steps;
  for (int k = 0; k < steps; ++k)
    R = Transported(R, OnCone(beta, k * h), OnCone(beta, k * h + h), h);
  return TurnBeyond(Mat3::Identity(), R, OnCone(beta, 0.0).n);
}

// Gauss and Bonnet: the solid angle of the cone, 2π (1 − cos β).
TEST(ParallelTransport, ARoundTurnsByTheSolidAngle) {
  for (const double beta : {0.1, 0.4, 1.0}) {
    const double solid = 2.0 * std::numbers::pi * (1.0 - std::cos(beta));
    EXPECT_NEAR(std::remainder(TurnAfterOneRound(beta, 400) - solid, 2.0 * std::numbers::pi), 0.0,
                1e-11)
        << beta;
  }
}

// h⁷ a step, h⁶ a round: twice as many steps leave a 64th.
TEST(ParallelTransport, ItsErrorIsOfSixthOrder) {
  const double beta = 0.4, solid = 2.0 * std::numbers::pi * (1.0 - std::cos(beta));
  const double coarse = std::abs(TurnAfterOneRound(beta, 10) - solid);
  const double fine = std::abs(TurnAfterOneRound(beta, 20) - solid);
  EXPECT_GT(coarse, 1e-9);
  EXPECT_NEAR(std::log2(coarse / fine), 6.0, 0.5) << coarse << " " << fine;
}

TEST(ParallelTransport, TheLineIsCarriedAlong) {
  const MovingDirection from = OnCone(0.4, 0.1), to = OnCone(0.4, 0.13);
  const Mat3 R = Transported(ExpRotation({0.3, -0.2, 0.5}), from, to, 0.03);
  EXPECT_LT((R * ExpRotation({0.3, -0.2, 0.5}).transpose() * from.n - to.n).norm(), 1e-15);
  EXPECT_NEAR(TurnBeyond(R, ExpRotation(0.25 * to.n) * R, to.n), 0.25, 1e-14);
}

}  // namespace
}  // namespace mbv
