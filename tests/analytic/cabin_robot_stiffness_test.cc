// Stiffness of the cabin robot: every equation of (54)–(75) and laws.
#include "analytic/cabin_robot/stiffness.h"

#include <gtest/gtest.h>

#include "tests/analytic/cabin_robot_stiffness_fixture.h"

namespace mbv::cabin_robot {
namespace {

TEST(CabinStiffness, BeamComplianceIsTheIntegratedFlexibility) {  // (54)
  const StiffnessParameters p = Paper();
  for (int beam = 0; beam < kStiffBeams; ++beam) {
    const Mat6 truth = IntegratedFlexibility(p, StiffBeam(beam), 0.3);
    EXPECT_LT(ScaledDifference(BeamCompliance(p, StiffBeam(beam), 0.3), truth), 1e-14);
    StiffnessParameters perturbed = p;
    perturbed.sections[beam].h *= 1 + 1e-12;
    EXPECT_GT(ScaledDifference(BeamCompliance(perturbed, StiffBeam(beam), 0.3), truth), 1e-14);
  }
}

TEST(CabinStiffness, TorsionConstantIsSaintVenants) {
  // Timoshenko's table of I_t/(b h³).
  for (const auto& [ratio, table] : {std::pair{1.0, 0.1406},
                                     {1.2, 0.1661},
                                     {1.5, 0.1958},
                                     {2.0, 0.2287},
                                     {3.0, 0.2633},
                                     {5.0, 0.2913},
                                     {10.0, 0.3123}}) {
    EXPECT_NEAR(TorsionConstant(ratio, 1, false) / ratio, table, 6e-5) << ratio;
    EXPECT_EQ(TorsionConstant(ratio, 1, false), TorsionConstant(1, ratio, false));
  }
  // The printed constant, up to 12 % low.
  for (const auto& [ratio, printed] :
       {std::pair{1.0, 0.877}, {1.25, 0.963}, {1.5, 0.988}, {2.0, 0.998}, {3.0, 1.0000}}) {
    EXPECT_NEAR(TorsionConstant(ratio, 1, true) / TorsionConstant(ratio, 1, false), printed, 5.1e-4)
        << ratio;
  }
}

TEST(CabinStiffness, StrutForceBalancesTheLinkAboutItsSlider) {  // (55)
  const double L1 = 0.52;
  EXPECT_DOUBLE_EQ(StrutForce(L1, 0.0, 1.0, 0.0), 2.0);  // strut square to the link
  for (const double psi : {60 * kDeg, 84 * kDeg, 110 * kDeg}) {
    // Axes of AB: strut direction (−cos ψ, sin ψ); transverse force −F_x2 along y at B.
    const double F_x2 = 3.0, M_z = -0.7;
    const double N = StrutForce(L1, psi - 90 * kDeg, F_x2, M_z);
    EXPECT_NEAR(-F_x2 * L1 + M_z + N * std::sin(psi) * L1 / 2, 0.0, 1e-14 * L1 * N);
    EXPECT_GT(std::abs(StrutForce(L1 * (1 + 1e-9), psi - 90 * kDeg, F_x2, M_z) - N), 1e-14 * N);
  }
}

TEST(CabinStiffness, StrutLimbIsWhatUnitLoadsGive) {  // replaces (56)–(61)
  const StiffnessParameters p = Paper();
  for (const auto& [alpha, epsilon] :
       {std::pair{40 * kDeg, 38 * kDeg}, {48 * kDeg, 50 * kDeg}, {35 * kDeg, 55 * kDeg}}) {
    const LimbTruth truth = IntegratedLimb(p, alpha, epsilon);
    const StrutLimb limb = StrutLimbCompliance(p, alpha, epsilon);
    EXPECT_LT(ScaledDifference(limb.in_plane, truth.in_plane), 1e-13);
    EXPECT_LT(ScaledDifference(limb.out_of_plane, truth.out_of_plane), 1e-13);
    StiffnessParameters perturbed = p;
    perturbed.planar.L4 *= 1 + 1e-10;
    const StrutLimb wrong = StrutLimbCompliance(perturbed, alpha, epsilon);
    EXPECT_GT(ScaledDifference(wrong.in_plane, truth.in_plane), 1e-13);
    EXPECT_GT(ScaledDifference(wrong.out_of_plane, truth.out_of_plane), 1e-13);
  }
}

TEST(CabinStiffness, SquareStrutCouplesNothing) {
  const StrutLimb limb = StrutLimbCompliance(Paper(), 40 * kDeg, 50 * kDeg);
  EXPECT_NEAR(limb.in_plane(0, 1) / limb.in_plane(0, 0), 0.0, 1e-15);
  EXPECT_NEAR(limb.in_plane(0, 2) / limb.in_plane(0, 0), 0.0, 1e-15);
}

TEST(CabinStiffness, HingesLeaveTheLimbsRankFiveAndFour) {
  const StiffnessParameters p = Paper();
  const auto rank = [](const Mat6& K) {
    const Vec6 size =
        K.diagonal().cwiseSqrt().unaryExpr([](double x) { return x > 0 ? 1 / x : 0; });
    Eigen::FullPivLU<Mat6> lu(Mat6(size.asDiagonal() * K * size.asDiagonal()));
    lu.setThreshold(1e-12);
    return lu.rank();
  };
  EXPECT_EQ(rank(StrutLimbStiffness(StrutLimbCompliance(p, 44 * kDeg, 40 * kDeg))), 5);
  EXPECT_EQ(rank(LinkLimbStiffness(p)), 4);
}

TEST(CabinStiffness, LimbEndsFollowThePlatform) {  // (62)–(64), (66)
  const Mat3 R = RotZ(0.7);
  const Vec3 r(-0.2, 0.05, 0.12);
  const Mat6 J = LimbTransform(R, r);
  // A small platform motion [Δ; φ] about K moves the limb's end by Δ + φ × r, in its own axes.
  Vec6 X;
  X << 1e-3, -2e-3, 3e-3, 4e-3, 5e-3, -6e-3;
  Vec6 end;
  end << R.transpose() * (X.head<3>() + X.tail<3>().cross(r)), R.transpose() * X.tail<3>();
  EXPECT_LT((J * end - X).norm(), 1e-15);
  EXPECT_LT(RelativeDifference(LimbForceTransform(R, r), J.inverse().transpose()), 1e-15);
}

TEST(CabinStiffness, PlatformStoresTheEnergyOfItsLimbs) {  // (65), (67), (68)
  const StiffnessParameters p = Paper();
  for (const StiffnessPose& pose : RandomPoses(10, 20250301)) {
    const ToolStiffness tool = At(pose);
    const PlanarState& s = tool.planar;
    const Mat6 K_AB = StrutLimbStiffness(StrutLimbCompliance(p, s.alpha.p, s.epsilon.p));
    const Mat6 K_CD = LinkLimbStiffness(p);
    Vec6 X;
    X << 1e-4, -2e-4, 3e-4, 4e-4, 5e-4, -6e-4;
    double energy = 0.0;
    for (const double z : {p.w / 2, -p.w / 2}) {
      for (const int side : {-1, 1}) {
        const Vec3 r = RotZ(pose.gamma) * Vec3(side * p.planar.L2 / 2, 0, z);
        const Mat3 R = RotZ(side < 0 ? s.alpha.p : std::numbers::pi - s.beta.p);
        Vec6 end;
        end << R.transpose() * (X.head<3>() + X.tail<3>().cross(r)), R.transpose() * X.tail<3>();
        energy += end.dot((side < 0 ? K_AB : K_CD) * end);
      }
    }
    EXPECT_NEAR(X.dot(tool.K_platform * X) / energy, 1.0, kAlgebra);
    EXPECT_LT(RelativeDifference(tool.K_platform, tool.K_platform.transpose()), kAlgebra);
    EXPECT_GT(std::abs(X.dot(tool.K_platform * X) * (1 + 1e-10) / energy - 1.0), kAlgebra);
  }
}

/// Frames of the wrist by elementary transforms, {2} → {3}, {4}, end of the rail, {6}.
std::array<Pose, 4> WristFrames(const StiffnessParameters& p, const StiffnessPose& pose) {
  const auto link = [](double alpha, double a, double theta, double d) {
    Pose X = Pose::Identity();
    X.linear() = RotX(alpha) * RotZ(theta);
    X.translation() = Vec3(a, 0, 0) + RotX(alpha) * Vec3(0, 0, d);
    return X;
  };
  const WristGeometry& g = p.wrist;
  Pose X_2 = Pose::Identity();
  X_2.linear() = RotZ(pose.gamma);
  X_2.translation() = Vec3(pose.X, pose.Y, 0);
  const Pose X_3 = X_2 * link(-90 * kDeg, g.a2, pose.th3, g.d3);
  const Pose X_4 = X_3 * link(-90 * kDeg, g.a3, pose.th4, 0);
  const Pose X_5 = X_4 * link(-90 * kDeg, g.a4, -90 * kDeg, pose.d5);
  const Pose X_6 = X_5 * link(-90 * kDeg, 0, 0.3, g.d6);
  Pose rail_end = X_4;
  rail_end.translation() += pose.d5 * X_4.linear().col(1);
  return {X_3, X_4, rail_end, X_6};
}

TEST(CabinStiffness, BeamTransformsAreDerivativesOfTheEndEffector) {  // (69)–(71)
  constexpr double h = 1e-6, kDifferences = 1e-9;
  const StiffnessParameters p = Paper();
  for (const StiffnessPose& pose : RandomPoses(5, 20250302)) {
    const std::array<Pose, 4> ends = WristFrames(p, pose);
    const Mat3 R_3 = ends[0].linear(), R_4 = ends[1].linear();
    const std::array<std::pair<Vec3, Vec3>, 4> axes = {{{R_3.col(2), R_3.col(1)},
                                                        {R_3.col(0), R_3.col(1)},
                                                        {-R_4.col(1), R_4.col(2)},
                                                        {R_4.col(0), R_4.col(2)}}};
    const ToolStiffness tool = At(pose);
    for (int j = 0; j < 4; ++j) {
      Mat3 R;
      R << axes[j].first, axes[j].second.cross(axes[j].first), axes[j].second;
      const Vec3 p_end = ends[j].translation(), p_6 = ends[3].translation();
      Mat6 J;  // what the tip's small motions make of the end effector
      for (int c = 0; c < 6; ++c) {
        const auto moved = [&](double t) {
          const Vec6 tip = t * Vec6::Unit(c);
          const Vec3 shift = R * tip.head<3>();
          return Vec3(p_end + shift + ExpRotation(R * tip.tail<3>()) * (p_6 - p_end));
        };
        J.col(c) << (moved(h) - moved(-h)) / (2 * h), c < 3 ? Vec3::Zero() : Vec3(R.col(c - 3));
      }
      EXPECT_LT(RelativeDifference(tool.elements[8 + j].G, J.transpose()), kDifferences) << j;
      EXPECT_GT(RelativeDifference(1.0001 * tool.elements[8 + j].G, J.transpose()), kDifferences);
    }
  }
}

TEST(CabinStiffness, ToolComplianceIsTheSumOfFiveParts) {  // (72)–(75)
  const StiffnessParameters p = Paper();
  for (const StiffnessPose& pose : RandomPoses(10, 20250303)) {
    const ToolStiffness tool = At(pose);
    // The linkages' part: a rigid wrist on the platform.
    const Vec3 r = WristFrames(p, pose)[3].translation() - Vec3(pose.X, pose.Y, 0);
    Mat6 T = Mat6::Identity();
    T.topRightCorner<3, 3>() = -Skew(r);
    Mat6 sum = T * tool.K_platform.inverse() * T.transpose();
    for (int j = 8; j < kStiffElements; ++j) {
      const StiffElement& beam = tool.elements[j];
      sum += beam.G.transpose() * beam.C * beam.G;
    }
    EXPECT_LT(ScaledDifference(tool.C, sum), kAlgebra);
    EXPECT_GT(ScaledDifference(tool.C, sum * (1 + 1e-10)), kAlgebra);
    EXPECT_LT(RelativeDifference(tool.K * tool.C, Mat6::Identity()), 1e-9);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(tool.C).eigenvalues()[0], 0.0);
    EXPECT_LT(ScaledDifference(tool.C, tool.C.transpose()), kAlgebra);
  }
}

TEST(CabinStiffness, SharesOfTheBeamsAddUp) {
  for (const StiffnessPose& pose : RandomPoses(10, 20250304)) {
    const ToolStiffness tool = At(pose);
    Mat6 sum = Mat6::Zero();
    for (const StiffElement& e : tool.elements) sum += e.G.transpose() * e.C * e.G;
    EXPECT_LT(ScaledDifference(sum, tool.C), kAlgebra);
  }
}

TEST(CabinStiffness, ShareOfABeamIsWhatItsSofteningAdds) {
  // dC/dln(1/E of one beam) = its share, by scaling its section's width and depth alike: all
  // entries of (54) but the axial one fall as 1/s⁴ — use the tool, one beam of its own.
  const StiffnessPose pose = SecondPose();
  const ToolStiffness tool = At(pose);
  const StiffElement& beam = tool.elements[11];
  const auto with_tool = [&](double scale) {
    StiffnessParameters p = Paper();
    p.sections[kBeamTool].b *= scale;
    p.sections[kBeamTool].h *= scale;
    ToolStiffness at = At(pose, LimbForm::kCorrected, p);
    return at;
  };
  const ToolStiffness thick = with_tool(2.0);
  const Mat6 change = tool.C - thick.C;
  const Mat6 shares = beam.G.transpose() * (beam.C - thick.elements[11].C) * beam.G;
  EXPECT_LT(ScaledDifference(change, shares), 1e-9);
  // A limb's beam: the derivative of C, not the difference.
  constexpr double h = 1e-4;
  const auto with_link = [&](double scale) {
    StiffnessParameters p = Paper();
    p.sections[kBeamCD].b *= scale;
    p.sections[kBeamCD].h *= scale;
    return At(pose, LimbForm::kCorrected, p);
  };
  Mat6 derivative = (with_link(1 + h).C - with_link(1 - h).C) / (2 * h);
  Mat6 expected = Mat6::Zero();
  for (const int k : {3, 7}) {
    const StiffElement& e = tool.elements[k];
    Mat6 C = -4 * e.C;  // bending and torsion fall as s⁻⁴, the axial compliance as s⁻²
    C(0, 0) = -2 * e.C(0, 0);
    expected += e.G.transpose() * C * e.G;
  }
  EXPECT_LT((derivative - expected).norm(), 1e-6 * expected.norm());
}

}  // namespace
}  // namespace mbv::cabin_robot
