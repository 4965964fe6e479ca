// Stiffness of the SCARA robot: every equation of (11)–(21) and laws.
#include "analytic/scara_robot/stiffness.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analytic/scara_robot/velocity.h"
#include "tests/analytic/scara_robot_stiffness_fixture.h"

namespace mbv::scara_robot {
namespace {

const Mat6 kAll = Mat6::Identity();

/// Stations of a limb in the order of the columns of J_d; their DOFs give all columns.
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
      // A perturbed column is seen.
      MatX perturbed = limb.J_p;
      perturbed(4, 1) += 1e-8;
      EXPECT_GT(RelativeDifference(perturbed, J_p), kDifferences);
    }
  }
}

TEST(ScaraStiffness, TipStiffnessIsTheInverseOfTheIntegratedFlexibility) {  // (12)
  const StiffnessParameters p = PaperStiffness();
  for (const double length : {0.05, 0.1, 0.15, 0.185}) {
    const Mat6 k = TipStiffness(p, length);
    const Mat6 flexibility = IntegratedFlexibility(p, length);
    EXPECT_LT(RelativeDifference(k * flexibility, kAll), kAlgebra);
    StiffnessParameters perturbed = p;
    perturbed.diameter *= 1 + 1e-10;
    EXPECT_GT(RelativeDifference(TipStiffness(perturbed, length) * flexibility, kAll), kAlgebra);
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
      LimbSprings perturbed = at.springs[i];
      perturbed.springs[0].flexibility *= 1 + 1e-5;
      EXPECT_GT(RelativeDifference(limb.K, LiteralBlock(perturbed, p.geometry.R, p.K_act)), 1e-9);
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

}  // namespace
}  // namespace mbv::scara_robot
