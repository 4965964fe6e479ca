// Stiffness of the SCARA robot: every equation of (11)–(21), the paper's example numbers, laws, and
// what the printed forms do.
#include "analytic/scara_robot/stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "analytic/scara_robot/stiffness_form.h"
#include "analytic/scara_robot/velocity.h"
#include "tests/analytic/allocation_counter.h"
#include "tests/analytic/scara_robot_stiffness_fixture.h"

namespace mbv::scara {
namespace {

/// 6 × 6 algebra with condition numbers up to 1e5.
constexpr double kAlgebra = 1e-11;

PlatformStiffness At(const Vec4& X, const PrintedForms& printed = {},
                     const StiffnessParameters& p = PaperStiffness()) {
  PlatformStiffness at;
  const RunSummary summary = SolveStiffness(p, printed, X, &at);
  EXPECT_TRUE(summary.ok() || summary.stop == Stop::kSingular) << summary.message;
  return at;
}

StiffnessIndices Indices(const Vec4& X, const StiffnessParameters& p = PaperStiffness()) {
  const PlatformStiffness at = At(X, {}, p);
  return IndicesOf(at.K, at.C);
}

const Mat6 kAll = Mat6::Identity();

/// Stations of a limb in the order of the columns of J_d; their freedoms give all columns.
std::vector<Station> DeformingStations(const StiffnessParameters& p, const Position& at, int i) {
  const Vec3 a = MotorAxis(i), u = at.u[i], w = at.eta[i], P = at.X.head<3>();
  const Vec3 A = p.geometry.R * Radial(i), C = A + p.geometry.l1 * u, B = P + at.s[i];
  std::vector<Station> stations = {{FrameAt(u, a, A), kAll.col(1)}, {FrameAt(u, a, C), kAll}};
  if (i < 2) {
    const Vec3 D = C + p.geometry.l2 * w, h = a.cross(w).normalized();
    stations.push_back({FrameAt(w, h, D), kAll.leftCols<5>()});
    stations.push_back({FrameAt(-Vec3::UnitZ(), a, B), kAll});
  } else {
    const Vec3 y = (a - a.dot(w) * w).normalized();
    stations.push_back({FrameAt(w, y, B), kAll});
  }
  return stations;
}

std::vector<Station> PassiveStations(const StiffnessParameters& p, const Position& at, int i) {
  const Vec3 a = MotorAxis(i), w = at.eta[i], P = at.X.head<3>();
  const Vec3 C = p.geometry.R * Radial(i) + p.geometry.l1 * at.u[i], B = P + at.s[i];
  const auto turns = [](const Vec3& axis, const Vec3& Q) {
    return Station{FrameAt(axis, axis.unitOrthogonal(), Q), kAll.col(0)};
  };
  if (i < 2) {
    const Vec3 D = C + p.geometry.l2 * w, h = a.cross(w).normalized();
    return {turns(a, C), turns(a, D), {FrameAt(w, h, D), kAll.col(5)}, turns(Vec3::UnitZ(), B)};
  }
  const Vec3 y = (a - a.dot(w) * w).normalized();
  return {{FrameAt(w, y, C), kAll.middleCols<2>(1)}, {FrameAt(w, y, B), kAll.leftCols<3>()}};
}

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
  EXPECT_LT(RelativeDifference(at.K * at.C, kAll), 1e-10);
}

TEST(ScaraStiffness, ColumnsAreDerivativesOfTheLimbsEnd) {  // (11)
  // Differences with steps of 1e-5: see DifferentiatedColumns().
  constexpr double kDifferences = 1e-9;
  const StiffnessParameters p = PaperStiffness();
  for (const Vec4& X : QuadrantPoses(10, 20240601)) {
    const PlatformStiffness at = At(X);
    for (int i = 0; i < kLimbs; ++i) {
      const LimbSprings& limb = at.springs[i];
      const std::vector<Station> deforming = DeformingStations(p, at.position, i);
      ASSERT_EQ(static_cast<int>(deforming.size()), limb.count);
      for (int k = 0; k < limb.count; ++k) {
        EXPECT_LT(
            RelativeDifference(limb.springs[k].J, DifferentiatedColumns(deforming[k], X.head<3>())),
            kDifferences)
            << "limb " << i + 1 << ", member " << k;
      }
      MatX J_p(6, 0);
      for (const Station& station : PassiveStations(p, at.position, i)) {
        const MatX columns = DifferentiatedColumns(station, X.head<3>());
        J_p.conservativeResize(6, J_p.cols() + columns.cols());
        J_p.rightCols(columns.cols()) = columns;
      }
      ASSERT_EQ(J_p.cols(), limb.J_p.cols());
      EXPECT_LT(RelativeDifference(limb.J_p, J_p), kDifferences) << "limb " << i + 1;
      // A bent column is seen.
      MatX bent = limb.J_p;
      bent(4, 1) += 1e-8;
      EXPECT_GT(RelativeDifference(bent, J_p), kDifferences);
    }
  }
}

TEST(ScaraStiffness, TipStiffnessIsTheInverseOfTheIntegratedFlexibility) {  // (12)
  const StiffnessParameters p = PaperStiffness();
  for (const double length : {0.05, 0.1, 0.15, 0.185}) {
    const Mat6 k = TipStiffness(p, length);
    const Mat6 flexibility = IntegratedFlexibility(p, length);
    EXPECT_LT(RelativeDifference(k * flexibility, kAll), kAlgebra);
    StiffnessParameters bent = p;
    bent.diameter *= 1 + 1e-10;
    EXPECT_GT(RelativeDifference(TipStiffness(bent, length) * flexibility, kAll), kAlgebra);
    Mat6 left_handed = k;  // what (12) would be in the axes x, z, y
    left_handed(2, 4) = left_handed(4, 2) = -k(2, 4);
    EXPECT_GT(RelativeDifference(left_handed * flexibility, kAll), 0.1);
  }
}

/// Two rods between rigid bars, pinned at all ends about the normal of their plane: stiffness for
/// motions of the bar at D, the ends' own turns eliminated. Rotations first, axes w, h, q.
Mat6 TwoRodFrame(const StiffnessParameters& p, double sin_q, double cos_q) {
  const double l = p.geometry.l2;
  const Mat6 k = IntegratedFlexibility(p, l).inverse();
  Eigen::Matrix<double, 10, 10> energy = Eigen::Matrix<double, 10, 10>::Zero();
  for (const int side : {1, -1}) {
    // Deformation of a rod: its tip's motion less what the turn at its root makes of it.
    Eigen::Matrix<double, 6, 10> B = Eigen::Matrix<double, 6, 10>::Zero();
    const Vec3 offset = side * p.d / 2 * Vec3(cos_q, 0, sin_q);
    B.topLeftCorner<3, 3>().setIdentity();
    B.block<3, 3>(3, 0) = -Skew(offset);
    B.block<3, 3>(3, 3).setIdentity();
    const int own = side > 0 ? 6 : 8;
    B(1, own) = 1.0;       // turn at the tip
    B(1, own + 1) = -1.0;  // turn at the root: rotation −1 and displacement −(h × l w) = l q
    B(5, own + 1) = l;
    energy += B.transpose() * k * B;
  }
  const Eigen::Matrix4d turns = energy.bottomRightCorner<4, 4>();
  return energy.topLeftCorner<6, 6>() -
         energy.topRightCorner<6, 4>() * turns.inverse() * energy.bottomLeftCorner<4, 6>();
}

TEST(ScaraStiffness, ParallelogramIsTwoPinnedRodsBetweenRigidBars) {  // K_D1
  const StiffnessParameters p = PaperStiffness();
  for (const double angle : {1.57, 1.2, 0.9, 2.0}) {
    const double s = std::sin(angle), c = std::cos(angle);
    const Mat6 frame = TwoRodFrame(p, s, c);
    const double scale = frame.norm();
    EXPECT_LT(frame.row(5).norm(), 1e-9 * scale);  // the parallelogram's own motion
    const Mat6 k = TipStiffness(p, p.geometry.l2);
    const Mat5 K = ParallelogramStiffness(k, p.d, s, c);
    const Mat5 truth = frame.topLeftCorner<5, 5>();
    for (int r = 0; r < 5; ++r) {
      for (int col = 0; col < 5; ++col) {
        EXPECT_NEAR(K(r, col), truth(r, col), kAlgebra * std::sqrt(K(r, r) * K(col, col)));
      }
    }
    // The print: exactly half, and the other sign between the rotations about w and q.
    Mat5 half = 0.5 * K;
    half(0, 2) = half(2, 0) = -half(0, 2);
    EXPECT_LT(RelativeDifference(ParallelogramStiffness(k, p.d, s, c, true), half), kAlgebra);
  }
}

/// (13), (14) word by word: the upper left block of the inverse. Lengths in units of R and
/// flexibilities of the servo, so that the inverse is well scaled.
Mat6 LiteralBlock(const LimbSprings& limb, double length, double stiffness) {
  Vec6 scale;
  scale << Vec3::Ones(), Vec3::Constant(1 / length);
  const Eigen::Index n = limb.J_p.cols();
  MatX saddle = MatX::Zero(6 + n, 6 + n);
  saddle.topLeftCorner<6, 6>() =
      stiffness * scale.asDiagonal() * SpringCompliance(limb) * scale.asDiagonal();
  saddle.topRightCorner(6, n) = scale.asDiagonal() * limb.J_p;
  saddle.bottomLeftCorner(n, 6) = saddle.topRightCorner(6, n).transpose();
  const MatX inverse = saddle.fullPivLu().inverse();
  return stiffness * scale.asDiagonal() * inverse.topLeftCorner<6, 6>() * scale.asDiagonal();
}

TEST(ScaraStiffness, LimbsFollowTheSaddleEquations) {  // (13), (14)
  const StiffnessParameters p = PaperStiffness();
  for (const Vec4& X : QuadrantPoses(20, 20240602)) {
    const PlatformStiffness at = At(X);
    for (int i = 0; i < kLimbs; ++i) {
      const LimbStiffness& limb = at.limbs[i];
      EXPECT_EQ(limb.rank, i < 2 ? 2 : 1);
      EXPECT_LT(RelativeDifference(limb.K, LiteralBlock(at.springs[i], p.geometry.R, p.K_act)),
                1e-9);
      // Passive motions cost nothing, and what the springs give is the rest of ΔT: K S K = K.
      EXPECT_LT((limb.K * at.springs[i].J_p).norm(), kAlgebra * limb.K.norm());
      EXPECT_LT(RelativeDifference(limb.K * SpringCompliance(at.springs[i]) * limb.K, limb.K),
                kAlgebra);
      LimbSprings bent = at.springs[i];
      bent.springs[0].flexibility *= 1 + 1e-5;
      EXPECT_GT(RelativeDifference(limb.K, LiteralBlock(bent, p.geometry.R, p.K_act)), 1e-9);
    }
  }
}

TEST(ScaraStiffness, BallLimbIsAPureForceAlongItsRod) {
  for (const Vec4& X : QuadrantPoses(20, 20240603)) {
    const PlatformStiffness at = At(X);
    for (int i = 2; i < kLimbs; ++i) {
      const Vec3& w = at.position.eta[i];
      Vec6 line;
      line << at.position.s[i].cross(w), w;
      // Series of rod, arm bending and servo, each by hand: 1/k = l/EA + v²·(arm + servo) + …
      const StiffnessParameters p = PaperStiffness();
      const double EA = p.E * std::numbers::pi * p.diameter * p.diameter / 4;
      const double EI = p.E * std::numbers::pi * std::pow(p.diameter, 4) / 64;
      const double l1 = p.geometry.l1, along = w.dot(at.position.u[i]);
      const double across2 = 1 - along * along, V = at.position.V[i];
      const double flexibility = p.geometry.l3 / EA + along * along * l1 / EA +
                                 across2 * l1 * l1 * l1 / (3 * EI) + V * V * l1 * l1 / p.K_act;
      EXPECT_LT(RelativeDifference(at.limbs[i].K, line * line.transpose() / flexibility), kAlgebra);
    }
  }
}

TEST(ScaraStiffness, PlatformIsTheSumOfItsLimbs) {  // (15)
  for (const Vec4& X : QuadrantPoses(10, 20240604)) {
    const PlatformStiffness at = At(X);
    Mat6 sum = Mat6::Zero();
    for (const LimbStiffness& limb : at.limbs) sum += limb.K;
    EXPECT_LT(RelativeDifference(at.K, sum), 4 * kEps);
    EXPECT_LT(RelativeDifference(at.K, at.K.transpose()), kAlgebra);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(at.K).eigenvalues()[0], 0.0);
  }
}

TEST(ScaraStiffness, IndicesAreTheNormsInTheEigenvectorBases) {  // (16)–(21)
  const auto basis = [](const Mat3& K) {
    return Mat3(Eigen::SelfAdjointEigenSolver<Mat3>(K.transpose() * K).eigenvectors());
  };
  const auto norm = [](const MatX& G) { return Eigen::JacobiSVD<MatX>(G).singularValues()[0]; };
  for (const Vec4& X : QuadrantPoses(10, 20240605)) {
    const PlatformStiffness at = At(X);
    const Mat3 K_mr = at.K.topLeftCorner<3, 3>(), K_mt = at.K.topRightCorner<3, 3>();
    const Mat3 K_fr = at.K.bottomLeftCorner<3, 3>(), K_ft = at.K.bottomRightCorner<3, 3>();
    const Mat3 basis_r = basis(K_mr), basis_t = basis(K_mt);
    MatX G_m(3, 6), G_f(3, 6);
    G_m << K_mr * basis_r, K_mt * basis_t;
    G_f << K_fr * basis(K_fr), K_ft * basis(K_ft);
    // (18)–(20): coordinates λ of a displacement give its moment.
    const Vec3 turn(1e-3, -2e-3, 3e-3), shift(4e-4, 5e-4, -6e-4);
    Vec6 lambda, displacement;
    lambda << basis_r.transpose() * turn, basis_t.transpose() * shift;
    displacement << turn, shift;
    EXPECT_LT((G_m * lambda - (at.K * displacement).head<3>()).norm(), kAlgebra * G_m.norm());
    // (21)
    const StiffnessIndices k = IndicesOf(at.K, at.C);
    EXPECT_NEAR(k.kappa_m, norm(G_m), kAlgebra * k.kappa_m);
    EXPECT_NEAR(k.kappa_f, norm(G_f), kAlgebra * k.kappa_f);
    EXPECT_GT(std::abs(k.kappa_m * (1 + 1e-10) - norm(G_m)), kAlgebra * k.kappa_m);
    EXPECT_NEAR(k.K_mr, norm(K_mr), kAlgebra * k.K_mr);
    EXPECT_NEAR(k.K_mt, norm(K_mt), kAlgebra * k.K_mt);
    EXPECT_NEAR(k.K_fr, k.K_mt, kAlgebra * k.K_mt);
    EXPECT_NEAR(k.K_ft, norm(K_ft), kAlgebra * k.K_ft);
    EXPECT_NEAR(k.C_translation, norm(at.C.bottomRightCorner<3, 3>()), kAlgebra * k.C_translation);
  }
}

TEST(ScaraStiffness, IndicesDependOnTheUnitOfLength) {
  const PlatformStiffness at = At(ExamplePose());
  // Forces in N, lengths in mm: K_mr · 1e3 per rad, K_mt stays; moments in N mm → N m.
  Vec6 units;
  units << Vec3::Ones(), Vec3::Constant(1e-3);
  const Mat6 K_mm = 1e3 * units.asDiagonal() * at.K * units.asDiagonal();
  EXPECT_NEAR(IndicesOf(K_mm, at.C).kappa_m / 1e3, 923.1, 0.05);
  EXPECT_NEAR(IndicesOf(at.K, at.C).kappa_m, 10463.28, 5e-3);
}

TEST(ScaraStiffness, RigidLinksLeaveTheServos) {
  const auto against_servos = [](double factor, const Vec4& X) {
    StiffnessParameters p = PaperStiffness();
    p.E *= factor;
    p.G *= factor;
    const PlatformStiffness at = At(X, {}, p);
    const Mat4 J = InverseJacobian(p.geometry, at.position).cwiseInverse().asDiagonal() *
                   DirectJacobian(at.position);
    const Mat4 servos = (p.K_act * J.transpose() * J).inverse();
    const Eigen::Array4i block(3, 4, 5, 2);
    return RelativeDifference(at.C(block, block), servos);
  };
  for (const Vec4& X : QuadrantPoses(5, 20240606)) {
    // The links' part falls as 1/E.
    const double soft = against_servos(1e3, X), stiff = against_servos(1e6, X);
    EXPECT_LT(stiff, 1e-4);
    EXPECT_NEAR(soft / stiff, 1e3, 10);
  }
}

TEST(ScaraStiffness, MirroredPosesHaveMirroredStiffness) {
  Mat3 M;  // mirror at y = x; moments turn the other way
  M << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  Mat6 mirror = Mat6::Zero();
  mirror.topLeftCorner<3, 3>() = -M;
  mirror.bottomRightCorner<3, 3>() = M;
  for (const Vec4& X : QuadrantPoses(20, 20240607)) {
    const PlatformStiffness at = At(X), other = At(MirrorPose(X));
    EXPECT_LT(RelativeDifference(mirror * at.K * mirror.transpose(), other.K), kAlgebra);
    EXPECT_LT(RelativeDifference(mirror * at.limbs[0].K * mirror, other.limbs[1].K), kAlgebra);
    EXPECT_GT(RelativeDifference(at.K, other.K), 1e-2);
  }
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
}  // namespace mbv::scara
