// Stiffness of the SCARA robot in numbers: the tabulated example, singular and dead poses, maps,
// and what the printed forms do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/analytic/scara_robot_stiffness_fixture.h"
#include "tests/support/allocation_counter.h"

namespace mbv::scara_robot {
namespace {

TEST(ScaraStiffness, TheExampleHasTheKnownStiffness) {
  const PlatformStiffness at = At(ExamplePose());
  Mat6 K;  // upper triangle; seven digits of the largest entry of each block
  K << 654.142, -194.341, 117.172, -4198.04, -1853.10, -5790.11,  //
      0, 685.658, -179.327, 2631.94, 6142.54, 3497.45,            //
      0, 0, 153.297, 905.136, -4004.81, -1750.16,                 //
      0, 0, 0, 162310, 24450, -23469,                             //
      0, 0, 0, 0, 153046, -23643,                                 //
      0, 0, 0, 0, 0, 177328;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) {
      const double half_digit = r < 3 ? (c < 3 ? 5.1e-4 : 5.1e-3) : 0.51;
      EXPECT_NEAR(at.K(r, c), K(r, c), half_digit) << r << c;
    }
  }
  const StiffnessIndices k = IndicesOf(at.K, at.C);
  EXPECT_NEAR(k.kappa_m, 10463.28, 5e-3);
  EXPECT_NEAR(k.kappa_f, 213275.5, 5e-2);
  EXPECT_EQ(at.rank, 6);
  EXPECT_LT(RelativeDifference(at.K * at.C, Mat6::Identity()), 1e-10);
}

TEST(ScaraStiffness, CentreIsSingularButTheIndicesDoNotSeeIt) {
  PlatformStiffness at;
  const RunSummary summary = SolveStiffness(PaperStiffness(), {}, Vec4(0, 0, -0.165, 0), &at);
  EXPECT_EQ(summary.stop, Stop::kSingular);
  EXPECT_EQ(at.rank, 5);
  EXPECT_FALSE(at.C.allFinite());
  EXPECT_NEAR(at.K(2, 2), 0.0, kAlgebra * at.K(0, 0));  // no yaw stiffness at all
  const StiffnessIndices k = IndicesOf(at.K, at.C);
  EXPECT_NEAR(k.kappa_m, 5519, 0.5);
  EXPECT_NEAR(k.kappa_f, 1.80e5, 0.005e5);
  EXPECT_TRUE(std::isnan(k.C_translation));
  // Turned by 0.3 rad the platform is held, weakly.
  const PlatformStiffness turned = At(Vec4(0, 0, -0.165, 0.3));
  EXPECT_EQ(turned.rank, 6);
  const StiffnessIndices weak = IndicesOf(turned.K, turned.C);
  const StiffnessIndices good = Indices(ExamplePose());
  EXPECT_GT(weak.C_rotation, 1e3 * good.C_rotation);
}

TEST(ScaraStiffness, CentreValuesOfTheMaps) {
  EXPECT_NEAR(Indices(Vec4(0, 0, -0.1, 0)).kappa_m, 14831, 0.6);
  EXPECT_NEAR(Indices(Vec4(0, 0, -0.1, 0)).kappa_f, 6.861e5, 50);
  EXPECT_NEAR(Indices(Vec4(0, 0, -0.23, 0)).kappa_m, 5949, 0.6);
  EXPECT_NEAR(Indices(Vec4(0, 0, -0.23, 0)).kappa_f, 2.321e5, 50);
}

TEST(ScaraStiffness, DeadPointsTakeTheServoOutOfTheLimb) {
  StiffnessParameters soft = PaperStiffness();
  soft.K_act *= 1e-3;
  for (const auto& [X, limb] :
       {std::pair{Vec4(0.05, 0, -0.1, 0), 0}, {Vec4(0, 0.05, -0.1, 0), 1}}) {
    const PlatformStiffness at = At(X);
    EXPECT_NEAR(at.position.V[limb], 0.0, 1e-7);  // square root of round-off in the folded limb
    EXPECT_LT(RelativeDifference(At(X, {}, soft).limbs[limb].K, at.limbs[limb].K), 1e-6);
    EXPECT_GT(RelativeDifference(At(X, {}, soft).limbs[2].K, at.limbs[2].K), 0.5);
    EXPECT_GT(IndicesOf(at.K, at.C).kappa_m, 1e2 * Indices(Vec4(0, 0, -0.1, 0)).kappa_m);
  }
}

/// Indices over the disc of radius 100 mm on a grid of 6.67 mm.
struct Disc {
  std::vector<Vec4> poses;
  std::vector<double> kappa_m, kappa_f;
};
Disc DiscAt(double z, double phi) {
  Disc disc;
  for (int row = -15; row <= 15; ++row) {
    for (int column = -15; column <= 15; ++column) {
      const Vec4 X(column / 150.0, row / 150.0, z, phi);
      if (X.head<2>().norm() > 0.1 + 1e-9) continue;
      PlatformStiffness at;
      if (SolveStiffness(PaperStiffness(), {}, X, &at).stop == Stop::kUnreachable) continue;
      const StiffnessIndices k = IndicesOf(at.K, at.C);
      disc.poses.push_back(X);
      disc.kappa_m.push_back(k.kappa_m);
      disc.kappa_f.push_back(k.kappa_f);
    }
  }
  return disc;
}
double Median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
  return values[values.size() / 2];
}

TEST(ScaraStiffness, TopOfTheWorkspaceIsStifferThanTheBottom) {
  const Disc top = DiscAt(-0.1, 0), bottom = DiscAt(-0.23, 0);
  EXPECT_NEAR(Median(top.kappa_m), 2.4e4, 0.05e4);
  EXPECT_NEAR(Median(top.kappa_f), 7.9e5, 0.05e5);
  EXPECT_NEAR(Median(bottom.kappa_m), 7.3e3, 0.05e3);
  EXPECT_NEAR(Median(bottom.kappa_f), 3.2e5, 0.05e5);
  const auto peak = [](const Disc& disc) {
    return disc
        .poses[std::max_element(disc.kappa_m.begin(), disc.kappa_m.end()) - disc.kappa_m.begin()];
  };
  // Near the dead points at the top, near the ball limbs at the bottom.
  EXPECT_NEAR((peak(top).head<2>() - Eigen::Vector2d(0.05, 0)).norm(), 0, 0.008);
  const Vec4 low = peak(bottom);
  EXPECT_NEAR(std::min(low[0], low[1]), -0.080, 0.0005);
  EXPECT_NEAR(std::max(low[0], low[1]), -0.060, 0.0005);
}

/// Relative difference that a printed form makes to one limb (or the sum, limb = −1).
double PrintError(const PrintedForms& printed, const Vec4& X, int limb) {
  const PlatformStiffness right = At(X), wrong = At(X, printed);
  return limb < 0 ? RelativeDifference(wrong.K, right.K)
                  : RelativeDifference(wrong.limbs[limb].K, right.limbs[limb].K);
}

TEST(ScaraStiffness, PrintedFormsAreOffByWhatTheyBreak) {
  const Vec4 X = ExamplePose();
  EXPECT_NEAR(PrintError({.rss_rod_frame = true}, X, 2), 0.417, 5e-4);
  EXPECT_LT(PrintError({.rss_passive = true}, X, 2), 1e-12);  // harmless where u·w ≠ 0
  EXPECT_NEAR(PrintError({.motor_axis = true}, X, 0), 0.205, 5e-4);
  EXPECT_NEAR(PrintError({.arm_frame = true}, X, 0), 0.0239, 5e-5);
  EXPECT_NEAR(PrintError({.short_rod_frame = true}, X, 0), 0.388, 5e-4);
  EXPECT_NEAR(PrintError({.parallelogram = true}, X, 0), 0.0034, 5e-5);
  EXPECT_NEAR(PrintError({.passive_columns = true}, X, -1), 0.21, 5e-3);
  EXPECT_NEAR(PrintError({.passive_axes = true}, X, 0), 1.86, 5e-3);
  EXPECT_NEAR(PrintError(AllAsPrinted(), X, -1), 0.148, 5e-4);
}

TEST(ScaraStiffness, PrintedBallLosesAnAxisWhereArmAndRodAreSquare) {
  // x = y = −50 mm, φ = 0.2: limb 3 has u ⟂ w at z = −201.574 mm.
  const auto along = [](double z) {
    const PlatformStiffness at = At(Vec4(-0.05, -0.05, z, 0.2));
    return at.position.u[2].dot(at.position.eta[2]);
  };
  double low = -0.203, high = -0.200;
  for (int k = 0; k < 60; ++k) {
    const double z = (low + high) / 2;
    (along(z) * along(low) > 0 ? low : high) = z;
  }
  EXPECT_NEAR(low, -0.201574, 5e-7);
  const Vec4 X(-0.05, -0.05, low, 0.2);
  EXPECT_EQ(At(X, {.rss_passive = true}).limbs[2].rank, 2);
  EXPECT_EQ(At(X).limbs[2].rank, 1);
  EXPECT_NEAR(PrintError({.rss_passive = true}, X, 2), 0.0596, 5e-5);
}

TEST(ScaraStiffness, PrintedPassiveColumnsMakeTheCentreRigid) {
  const Vec4 centre(0, 0, -0.165, 0);
  const PlatformStiffness printed = At(centre, {.passive_columns = true});
  EXPECT_EQ(printed.limbs[0].rank, 4);
  EXPECT_NEAR(printed.K(2, 2), 1580, 0.6);
}

TEST(ScaraStiffness, UnreachablePosesNameTheLimb) {
  PlatformStiffness at;
  const RunSummary summary = SolveStiffness(PaperStiffness(), {}, Vec4(0.3, 0, -0.2, 0), &at);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "limb1");
  EXPECT_EQ(at.rank, -1);
  EXPECT_FALSE(at.K.allFinite());
}

TEST(ScaraStiffness, EvaluatingAPoseTakesNoMemory) {
  const StiffnessParameters p = PaperStiffness();
  PlatformStiffness at;
  ASSERT_TRUE(SolveStiffness(p, {}, ExamplePose(), &at).ok());
  const std::size_t before = AllocationCount();
  for (int k = 0; k < 100; ++k) {
    ASSERT_TRUE(SolveStiffness(p, {}, ExamplePose() + Vec4(1e-5 * k, 0, 0, 0), &at).ok());
  }
  EXPECT_EQ(AllocationCount(), before);
}

}  // namespace
}  // namespace mbv::scara_robot
