// The 3-SPR mechanism's positions: hand-checkable home pose, tabulated poses, then laws.
#include "analytic/spr_tripod/position.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "math/spatial.h"

namespace mbv::spr_tripod {
namespace {

using std::numbers::pi;

constexpr double kDeg = pi / 180.0;
// Lengths are of order 1 m and pass through fewer than 50 roundings.
constexpr double kRoundoff_m = 50 * kEps;
// Tabulated values carry 13 decimals.
constexpr double kTable = 6e-14;

Posture InverseAt(const Vec3& r, const Geometry& g = PaperGeometry()) {
  Posture p;
  const RunSummary summary = SolveInverse(g, r, &p);
  EXPECT_TRUE(summary.ok()) << summary.message;
  return p;
}

// Largest violation of (2), w_i·c_i = 0 times q_i [m].
double ConstraintGap(const Posture& p) {
  double gap = 0.0;
  for (int i = 0; i < 3; ++i) gap = std::max(gap, std::abs(p.q[i] * p.w[i].dot(p.c[i])));
  return gap;
}

// Tilts up to 25 deg in every direction at heights 0.45…0.68 m.
template <typename Body>
void ForRandomTilts(int count, Body body) {
  std::mt19937_64 random(20120215);
  std::uniform_real_distribution<double> psi(-pi, pi), theta(2 * kDeg, 25 * kDeg), z(0.45, 0.68);
  for (int k = 0; k < count; ++k) body(psi(random), theta(random), z(random));
}

TEST(SprTripodPosition, UntiltedPlatformHasLegsByPythagoras) {
  const double z = 0.57;
  const Posture p = InverseAt({0, 0, z});
  EXPECT_TRUE(p.R.isApprox(Mat3::Identity(), kEps));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(p.q[i], std::hypot(0.455 - 0.210, z), kRoundoff_m);
  EXPECT_NEAR(InverseAt({0, 0, 0.574978260458602}).q[0], 0.625, kRoundoff_m);
}

TEST(SprTripodPosition, GeneralPoseMatchesTabulatedValues) {
  const Tilt tilt = Tilt::FromEuler(40 * kDeg, 15 * kDeg);
  const Vec3 r = CentreOf(PaperGeometry(), tilt, 0.55);
  EXPECT_NEAR(r.x(), 0.0932306074699, kTable);
  EXPECT_NEAR(r.y(), -0.1050780234458, kTable);
  const Posture p = InverseAt(r);
  EXPECT_NEAR(p.q[0], 0.7189319479389, kTable);
  EXPECT_NEAR(p.q[1], 0.5832115217055, kTable);
  EXPECT_NEAR(p.q[2], 0.5473057176922, kTable);
  EXPECT_NEAR(p.tilt.Azimuth(), 40 * kDeg, 100 * kEps);
  EXPECT_NEAR(p.tilt.Angle(), 15 * kDeg, 100 * kEps);
}

TEST(SprTripodPosition, InverseOfAnOffAxisPoseMatchesTabulatedValues) {
  const Posture p = InverseAt({0.1, 0.05, 0.575});
  EXPECT_NEAR(p.tilt.Angle() / kDeg, 10.968094600864, 6e-13);
  EXPECT_NEAR(p.tilt.Azimuth() / kDeg, 118.690188238668, 6e-13);
  EXPECT_NEAR(p.q[0], 0.6383604838659, kTable);
  EXPECT_NEAR(p.q[1], 0.7010028034004, kTable);
  EXPECT_NEAR(p.q[2], 0.5619404918586, kTable);
}

TEST(SprTripodPosition, CornersOfThePathMatchTabulatedLengthsAndTilts) {
  struct Row {
    Vec3 r;
    double q12, q3, tilt_deg;
  };
  for (const Row& row : {Row{{-0.12, 0, 0.54}, 0.558055, 0.694793, 13.14637},
                         Row{{-0.12, 0, 0.60}, 0.616299, 0.741376, 11.75684},
                         Row{{0.12, 0, 0.60}, 0.699303, 0.574821, 10.92392},
                         Row{{0.12, 0, 0.54}, 0.648556, 0.512935, 12.01278}}) {
    const Posture p = InverseAt(row.r);
    EXPECT_NEAR(p.q[0], row.q12, 6e-7);
    EXPECT_NEAR(p.q[1], row.q12, 6e-7);
    EXPECT_NEAR(p.q[2], row.q3, 6e-7);
    EXPECT_NEAR(p.tilt.Angle() / kDeg, row.tilt_deg, 6e-6);
  }
}

TEST(SprTripodPosition, TiltCoordinatesAreZxzAnglesWithOppositeTorsion) {
  ForRandomTilts(200, [](double psi, double theta, double) {
    const Mat3 R = RotZ(psi) * RotX(theta) * RotZ(-psi);
    EXPECT_LT((Tilt::FromEuler(psi, theta).Rotation() - R).cwiseAbs().maxCoeff(), 10 * kEps);
  });
}

TEST(SprTripodPosition, CorrectedCentreMeetsTheConstraints) {
  const Geometry g = PaperGeometry();
  ForRandomTilts(200, [&](double psi, double theta, double z) {
    const Tilt tilt = Tilt::FromEuler(psi, theta);
    Posture p;
    FillPosture(g, CentreOf(g, tilt, z), tilt, &p);
    EXPECT_LT(ConstraintGap(p), kRoundoff_m);
    // Perturbed by the printed torsion δ = +ψ, the gap must show.
    Posture perturbed = p;
    perturbed.R = RotZ(psi) * RotX(theta) * RotZ(psi);
    for (int i = 0; i < 3; ++i) perturbed.c[i] = perturbed.R * g.c[i];
    if (std::abs(std::sin(2 * psi)) > 0.1) {
      EXPECT_GT(ConstraintGap(perturbed), 1e-3);
    }
  });
}

TEST(SprTripodPosition, CompactFormsOfTheCentreAgree) {
  const Geometry g = PaperGeometry();
  ForRandomTilts(200, [&](double psi, double theta, double z) {
    const Vec3 r = CentreOf(g, Tilt::FromEuler(psi, theta), z);
    const double k = 0.5 * g.b * (1 - std::cos(theta));
    const double rho_n = -k * std::cos(3 * psi);
    const double rho_m = k / std::cos(theta) * std::sin(3 * psi) - z * std::tan(theta);
    EXPECT_NEAR(r.x(), rho_n * std::cos(psi) - rho_m * std::sin(psi), kRoundoff_m);
    EXPECT_NEAR(r.y(), rho_n * std::sin(psi) + rho_m * std::cos(psi), kRoundoff_m);
    const Mat3 R = Tilt::FromEuler(psi, theta).Rotation();
    EXPECT_NEAR(R.col(0).dot(r), 0.5 * g.b * (R(1, 1) - R(0, 0)), kRoundoff_m);
    EXPECT_NEAR(R.col(1).dot(r), g.b * R(0, 1), kRoundoff_m);
  });
}

TEST(SprTripodPosition, SquaredLengthsAreDistancesOfTheJoints) {
  for (const Geometry& g : {PaperGeometry(), PaperGeometry(0.3, 0.4)}) {
    ForRandomTilts(200, [&](double psi, double theta, double z) {
      const Tilt tilt = Tilt::FromEuler(psi, theta);
      Posture p;
      FillPosture(g, CentreOf(g, tilt, z), tilt, &p);
      const PerLeg<double> q2 = SquaredLengths(g, p.r, p.R);
      for (int i = 0; i < 3; ++i) {
        EXPECT_NEAR(std::sqrt(q2[i]), p.q[i], kRoundoff_m);
        // (1)
        EXPECT_LT((p.b[i] + p.q[i] * p.w[i] - p.a[i] - p.r).norm(), kRoundoff_m);
      }
      // A platform 1 mm too large is seen.
      EXPECT_GT(std::abs(SquaredLengths(PaperGeometry(g.a + 1e-3, g.b), p.r, p.R)[0] - q2[0]),
                1e-6);
    });
  }
}

TEST(SprTripodPosition, InverseUndoesTheCorrectedCentre) {
  const Geometry g = PaperGeometry();
  ForRandomTilts(200, [&](double psi, double theta, double z) {
    const Tilt tilt = Tilt::FromEuler(psi, theta);
    const Posture p = InverseAt(CentreOf(g, tilt, z));
    EXPECT_NEAR(p.tilt.X, tilt.X, kRoundoff_m);
    EXPECT_NEAR(p.tilt.Y, tilt.Y, kRoundoff_m);
  });
}

TEST(SprTripodPosition, InverseConvergesEverywhereInTheBox) {
  int count = 0;
  for (double x = -0.27; x < 0.271; x += 0.03) {
    for (double y = -0.27; y < 0.271; y += 0.03) {
      for (double z = 0.43; z < 0.716; z += 0.0285) {
        const Posture p = InverseAt({x, y, z});
        ASSERT_LT(ConstraintGap(p), kRoundoff_m) << x << " " << y << " " << z;
        ++count;
      }
    }
  }
  EXPECT_EQ(count, 19 * 19 * 11);
}

TEST(SprTripodPosition, SymmetryPlaneHasAnExplicitTilt) {
  const double b = 0.455;
  for (double x : {-0.2, -0.05, 1e-9, 0.1, 0.24}) {
    for (double z : {0.45, 0.6}) {
      const Posture p = InverseAt({x, 0, z});
      EXPECT_NEAR(p.tilt.X, 0.0, kEps);
      EXPECT_NEAR(p.tilt.Y, (-z + std::sqrt(z * z + x * (b + x))) / (b + x), kRoundoff_m);
      EXPECT_NEAR(p.q[0], p.q[1], kRoundoff_m);
    }
  }
}

TEST(SprTripodPosition, ForwardUndoesInverse) {
  const Geometry g = PaperGeometry();
  ForRandomTilts(200, [&](double psi, double theta, double z) {
    const Posture p = InverseAt(CentreOf(g, Tilt::FromEuler(psi, theta), z));
    Posture forward;
    ASSERT_TRUE(SolveForward(g, p.q, &forward).ok());
    // The forward map stretches by less than 1/0.74 (smallest singular value of J).
    EXPECT_LT((forward.r - p.r).norm(), 10 * kRoundoff_m);
  });
}

TEST(SprTripodPosition, ForwardFindsTheHomeBranchForEveryLegTripleInFewSteps) {
  const Geometry g = PaperGeometry();
  std::mt19937_64 random(1208);
  std::uniform_real_distribution<double> length(0.5, 0.75);
  int most = 0;
  for (int k = 0; k < 2000; ++k) {
    const PerLeg<double> q = {length(random), length(random), length(random)};
    Posture p;
    int iterations = 0;
    ASSERT_TRUE(SolveForward(g, q, &p, &iterations).ok()) << q[0] << " " << q[1] << " " << q[2];
    most = std::max(most, iterations);
    for (int i = 0; i < 3; ++i) ASSERT_NEAR(p.q[i], q[i], 1e-12);
    ASSERT_LT(ConstraintGap(p), kRoundoff_m);
    ASSERT_LT((InverseAt(p.r).R - p.R).norm(), 10 * kRoundoff_m);
  }
  EXPECT_LE(most, 5);  // four to 1e-12, one to notice
}

TEST(SprTripodPosition, ForwardRefusesLegsThatDoNotMeet) {
  Posture p;
  const RunSummary summary = SolveForward(PaperGeometry(), {0.1, 0.1, 0.75}, &p);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_NE(summary.message.find("0.75"), std::string::npos);
}

TEST(SprTripodPosition, EightAssembliesShareAPositionAndOneIsTheHomeBranch) {
  const Geometry g = PaperGeometry();
  ForRandomTilts(200, [&](double psi, double theta, double z) {
    const Vec3 r = CentreOf(g, Tilt::FromEuler(psi, theta), z);
    const std::vector<Assembly> assemblies = AllAssemblies(g, r);
    ASSERT_EQ(assemblies.size(), 8u);
    int home = 0;
    for (const Assembly& assembly : assemblies) {
      EXPECT_LT((assembly.R.transpose() * assembly.R - Mat3::Identity()).norm(), 20 * kEps);
      for (int i = 0; i < 3; ++i) {
        const Vec3 c = assembly.R * g.c[i];
        EXPECT_NEAR(c.dot(r - g.b * g.f[i]), 0.0, 1e-13);  // (2)
      }
      if (assembly.upright && !assembly.turned) {
        ++home;
        EXPECT_LT((assembly.R - InverseAt(r).R).norm(), 1e-13);
      }
    }
    EXPECT_EQ(home, 1);
    for (size_t i = 0; i < 8; ++i) {
      for (size_t j = 0; j < i; ++j) EXPECT_GT((assemblies[i].R - assemblies[j].R).norm(), 1e-3);
    }
  });
}

TEST(SprTripodPosition, SeveralUprightAssembliesExistLowDownAndAreRefused) {
  const Geometry g = PaperGeometry();
  int upright = 0;
  for (const Assembly& assembly : AllAssemblies(g, {0.02, 0.01, 0.2})) {
    upright += assembly.upright && !assembly.turned;
  }
  EXPECT_GT(upright, 1);
  Posture p;
  const RunSummary summary = SolveInverse(g, {0.02, 0.01, 0.2}, &p);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_NEAR(summary.amount, 0.0275, 1e-15);
}

TEST(SprTripodPosition, ThreefoldAndMirrorSymmetryPermuteTheLegs) {
  const Vec3 r(0.08, -0.05, 0.56);
  const Posture p = InverseAt(r);
  const Posture turned = InverseAt(RotZ(2 * pi / 3) * r);
  // Turning by +120 deg takes B3 to B1, B1 to B2, B2 to B3.
  EXPECT_NEAR(turned.q[0], p.q[2], kRoundoff_m);
  EXPECT_NEAR(turned.q[1], p.q[0], kRoundoff_m);
  EXPECT_NEAR(turned.q[2], p.q[1], kRoundoff_m);
  const Posture mirrored = InverseAt({r.x(), -r.y(), r.z()});
  EXPECT_NEAR(mirrored.q[0], p.q[1], kRoundoff_m);
  EXPECT_NEAR(mirrored.q[1], p.q[0], kRoundoff_m);
  EXPECT_NEAR(mirrored.q[2], p.q[2], kRoundoff_m);
}

}  // namespace
}  // namespace mbv::spr_tripod
