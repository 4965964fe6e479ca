// Stiffness of the cabin robot: every equation of (54)–(75), numbers of the load set, laws, and
// what the printed limb does.
#include "analytic/cabin_robot/stiffness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/spatial.h"
#include "tests/analytic/allocation_counter.h"

namespace mbv::cabin {
namespace {

constexpr double kDeg = std::numbers::pi / 180;
constexpr double kAlgebra = 1e-11;

/// Constants of models/cabin_robot/elastic.yaml, with the paper's torsion constant.
StiffnessParameters Paper() {
  StiffnessParameters p;
  p.planar = {0.52, 0.42, 0.5, 0.28};
  p.wrist = {0.0, 0.261, 0.485, 0.05, 0.01};
  p.w = 0.24;
  p.E = 71e9;
  p.G = 26.7e9;
  p.torsion_printed = true;
  p.sections = {{{0.08, 0.07},
                 {0.06, 0.05},
                 {0.06, 0.05},
                 {0.32, 0.12},
                 {0.32, 0.07},
                 {0.3, 0.08},
                 {0.24, 0.2}}};
  return p;
}

StiffnessPose FirstPose() { return {0.0, 0.36, 0.0, 90 * kDeg, 0.0, -0.2}; }
StiffnessPose SecondPose() { return {0.03, 0.33, 6 * kDeg, 40 * kDeg, -35 * kDeg, -0.31}; }

std::vector<StiffnessPose> RandomPoses(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  std::vector<StiffnessPose> poses;
  for (int k = 0; k < count; ++k) {
    poses.push_back({uniform(-0.06, 0.06), uniform(0.30, 0.40), uniform(-8, 8) * kDeg,
                     uniform(-100, 100) * kDeg, uniform(-80, 15) * kDeg, uniform(-0.5, -0.05)});
  }
  return poses;
}

ToolStiffness At(const StiffnessPose& pose, LimbForm form = LimbForm::kCorrected,
                 const StiffnessParameters& p = Paper()) {
  ToolStiffness tool;
  const RunSummary summary = SolveStiffness(p, pose, form, &tool);
  EXPECT_TRUE(summary.ok()) << summary.message;
  return tool;
}

double RelativeDifference(const MatX& A, const MatX& B) { return (A - B).norm() / B.norm(); }

/// The part of A − B in entry (r, c), relative to the diagonal of B: blind to the entries' units.
double ScaledDifference(const MatX& A, const MatX& B) {
  double largest = 0.0;
  for (Eigen::Index r = 0; r < B.rows(); ++r) {
    for (Eigen::Index c = 0; c < B.cols(); ++c) {
      largest = std::max(largest, std::abs(A(r, c) - B(r, c)) / std::sqrt(B(r, r) * B(c, c)));
    }
  }
  return largest;
}

/// Three Gauss points on 0 … 1: exact for the squares of linear moments.
template <typename F>
auto Integrate(const F& f) -> decltype(f(0.0)) {
  const double node = std::sqrt(0.15);
  return (5 * f(0.5 - node) + 8 * f(0.5) + 5 * f(0.5 + node)) / 18;
}

/// Flexibility at the tip by unit loads; forces first, x along the beam, b along z.
Mat6 IntegratedFlexibility(const StiffnessParameters& p, StiffBeam beam, double length) {
  const RectSection& s = p.sections[beam];
  const double I_y = s.h * std::pow(s.b, 3) / 12, I_z = s.b * std::pow(s.h, 3) / 12;
  const double I_p = s.b * std::pow(s.h, 3) * (1.0 / 3 - 0.21 * s.h / s.b);
  const Eigen::Vector4d soft(1 / (p.E * s.b * s.h), 1 / (p.G * I_p), 1 / (p.E * I_y),
                             1 / (p.E * I_z));
  return length * Integrate([&](double x) {
           Eigen::Matrix<double, 4, 6> N = Eigen::Matrix<double, 4, 6>::Zero();
           N(0, 0) = 1;
           N.block<3, 3>(1, 0) = Skew(Vec3((1 - x) * length, 0, 0));
           N.block<3, 3>(1, 3).setIdentity();
           return Mat6(N.transpose() * soft.asDiagonal() * N);
         });
}

TEST(CabinStiffness, BeamComplianceIsTheIntegratedFlexibility) {  // (54)
  const StiffnessParameters p = Paper();
  for (int beam = 0; beam < kStiffBeams; ++beam) {
    const Mat6 truth = IntegratedFlexibility(p, StiffBeam(beam), 0.3);
    EXPECT_LT(ScaledDifference(BeamCompliance(p, StiffBeam(beam), 0.3), truth), 1e-14);
    StiffnessParameters bent = p;
    bent.sections[beam].h *= 1 + 1e-12;
    EXPECT_GT(ScaledDifference(BeamCompliance(bent, StiffBeam(beam), 0.3), truth), 1e-14);
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

/// The strut limb by unit loads: in the plane from statics, across it from what meets at E.
struct LimbTruth {
  Mat3 in_plane, out_of_plane;
};
LimbTruth IntegratedLimb(const StiffnessParameters& p, double alpha, double epsilon) {
  const double L1 = p.planar.L1, L4 = p.planar.L4, psi = alpha + epsilon;
  const RectSection &s1 = p.sections[kBeamAB], &s4 = p.sections[kBeamEF];
  const double EA1 = p.E * s1.b * s1.h, EI1 = p.E * s1.b * std::pow(s1.h, 3) / 12;
  // Reactions at A (x, y) and strut force for loads (F_x, F_y, M_z) at B.
  Mat3 balance, loads;
  balance << 1, 0, -std::cos(psi), 0, 1, std::sin(psi), 0, 0, std::sin(psi) * L1 / 2;
  loads << 1, 0, 0, 0, 1, 0, 0, L1, 1;
  const Mat3 reaction = -balance.inverse() * loads;
  const auto energy = [&](double x) {
    // Axial force and moment at x·L1 from A, from the side of A.
    Eigen::RowVector3d N = -reaction.row(0), M = reaction.row(1) * x * L1;
    if (x > 0.5) {
      N += std::cos(psi) * reaction.row(2);
      M += std::sin(psi) * reaction.row(2) * (x - 0.5) * L1;
    }
    return Mat3(N.transpose() * N / EA1 + M.transpose() * M / EI1);
  };
  LimbTruth truth;
  truth.in_plane = L1 / 2 *
                       (Integrate([&](double x) { return energy(x / 2); }) +
                        Integrate([&](double x) { return energy(0.5 + x / 2); })) +
                   reaction.row(2).transpose() * reaction.row(2) * L4 / (p.E * s4.b * s4.h);

  // Across: stiffnesses of AE and EF at E add up; then EB.
  const std::array<int, 3> across = {2, 3, 4};
  const auto block = [&](const Mat6& C) { return Mat3(C(across, across)); };
  Mat3 turn = Mat3::Identity();  // (z, x, y) of EF → of AB
  turn.bottomRightCorner<2, 2>() =
      Eigen::Rotation2Dd(std::numbers::pi - epsilon - alpha).toRotationMatrix();
  const Mat3 C_half = block(IntegratedFlexibility(p, kBeamAB, L1 / 2));
  const Mat3 at_E =
      (C_half.inverse() +
       turn * block(IntegratedFlexibility(p, kBeamEF, L4)).inverse() * turn.transpose())
          .inverse();
  Mat3 lever = Mat3::Identity();  // load at B → at E: M_y = −F_z L1/2
  lever(2, 0) = -L1 / 2;
  truth.out_of_plane = C_half + lever.transpose() * at_E * lever;
  return truth;
}

TEST(CabinStiffness, StrutLimbIsWhatUnitLoadsGive) {  // replaces (56)–(61)
  const StiffnessParameters p = Paper();
  for (const auto& [alpha, epsilon] :
       {std::pair{40 * kDeg, 38 * kDeg}, {48 * kDeg, 50 * kDeg}, {35 * kDeg, 55 * kDeg}}) {
    const LimbTruth truth = IntegratedLimb(p, alpha, epsilon);
    const StrutLimb limb = StrutLimbCompliance(p, alpha, epsilon);
    EXPECT_LT(ScaledDifference(limb.in_plane, truth.in_plane), 1e-13);
    EXPECT_LT(ScaledDifference(limb.out_of_plane, truth.out_of_plane), 1e-13);
    StiffnessParameters bent = p;
    bent.planar.L4 *= 1 + 1e-10;
    const StrutLimb wrong = StrutLimbCompliance(bent, alpha, epsilon);
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

/// The 50 loads: 0 … 1000 N and 0 … 1 N m from a 64-bit linear congruential generator.
std::vector<Vec6> Loads() {
  std::uint64_t x = 20250201;
  std::vector<Vec6> loads(50);
  for (Vec6& F : loads) {
    for (int c = 0; c < 6; ++c) {
      x = x * 6364136223846793005u + 1442695040888963407u;
      F[c] = static_cast<double>(x >> 11) * 0x1.0p-53 * (c < 3 ? 1000.0 : 1.0);
    }
  }
  return loads;
}

struct LoadSet {
  Vec3 low = Vec3::Constant(1e9), high = Vec3::Constant(-1e9), mean = Vec3::Zero();
};
LoadSet Range(const Mat6& C) {
  LoadSet range;
  for (const Vec6& F : Loads()) {
    const Vec3 d = 1e3 * (C * F).head<3>();
    range.low = range.low.cwiseMin(d.cwiseAbs());
    range.high = range.high.cwiseMax(d.cwiseAbs());
    range.mean += d / 50;
  }
  return range;
}

/// Largest difference over the loads per axis, over the axis' largest displacement; mean of the
/// vectors' relative differences.
struct LoadError {
  Vec3 axis = Vec3::Zero();
  double vector = 0.0;
};
LoadError Compare(const Mat6& C, const Mat6& truth) {
  LoadError error;
  Vec3 largest = Vec3::Zero();
  for (const Vec6& F : Loads()) {
    const Vec3 d = (C * F).head<3>(), t = (truth * F).head<3>();
    error.axis = error.axis.cwiseMax((d - t).cwiseAbs());
    largest = largest.cwiseMax(t.cwiseAbs());
    error.vector += (d - t).norm() / t.norm() / 50;
  }
  error.axis = error.axis.cwiseQuotient(largest);
  return error;
}

TEST(CabinStiffness, FirstPoseHasTheKnownCompliance) {
  const ToolStiffness tool = At(FirstPose());
  Vec6 diagonal;
  diagonal << 9.28e-8, 1.261e-7, 8.09e-8, 1.11e-6, 3.29e-7, 1.05e-6;
  for (int c = 0; c < 6; ++c) EXPECT_NEAR(tool.C(c, c) / diagonal[c], 1.0, 4e-3) << c;
  const Vec6 F = Loads().front();
  EXPECT_NEAR(F[0], 872.199362, 5e-7);
  EXPECT_NEAR(F[5], 0.332428, 5e-7);
  const Vec3 d = 1e3 * (tool.C * F).head<3>();
  EXPECT_NEAR(d[0], 0.078433, 5.1e-7);
  EXPECT_NEAR(d[1], 0.163127, 5.1e-7);
  EXPECT_NEAR(d[2], 0.127335, 5.1e-7);
}

TEST(CabinStiffness, LoadSetDisplacesAsInThePapersTable) {
  const Mat6 C = At(FirstPose()).C;
  const LoadSet range = Range(C);
  EXPECT_LT((range.low - Vec3(0.0001, 0.0075, 0.0054)).cwiseAbs().maxCoeff(), 5.1e-5);
  EXPECT_LT((range.high - Vec3(0.089, 0.174, 0.138)).cwiseAbs().maxCoeff(), 5.1e-4);
  EXPECT_LT((range.mean - Vec3(0.046, 0.092, 0.073)).cwiseAbs().maxCoeff(), 5.1e-4);
  // Correlation of Δy and Δz: one rotation dominates.
  double yy = 0, zz = 0, yz = 0;
  for (const Vec6& F : Loads()) {
    const Vec3 d = 1e3 * (C * F).head<3>() - range.mean;
    yy += d[1] * d[1];
    zz += d[2] * d[2];
    yz += d[1] * d[2];
  }
  EXPECT_NEAR(yz / std::sqrt(yy * zz), 0.976, 5.1e-4);
  // Moments of at most 1 N m do not matter.
  Vec3 moments = Vec3::Zero();
  for (const Vec6& F : Loads()) {
    moments = moments.cwiseMax(1e3 * (C.topRightCorner<3, 3>() * F.tail<3>()).cwiseAbs());
  }
  EXPECT_LT(moments.cwiseQuotient(range.high).maxCoeff(), 3.6e-3);
}

TEST(CabinStiffness, SecondPoseHasTheKnownCompliance) {
  Vec6 diagonal;
  diagonal << 1.46633e-7, 4.62551e-8, 1.26465e-7, 9.77971e-7, 3.27143e-7, 1.34999e-6;
  EXPECT_LT((At(SecondPose()).C.diagonal().cwiseQuotient(diagonal).array() - 1).abs().maxCoeff(),
            1e-5);
}

TEST(CabinStiffness, PrintedLimbMissesTheTrueOne) {  // (60), (61)
  const StiffnessParameters p = Paper();
  const PlanarState s = At(FirstPose()).planar;
  const LimbTruth truth = IntegratedLimb(p, s.alpha.p, s.epsilon.p);
  const Mat6 C = PrintedLimbCompliance(p, s.alpha.p + s.epsilon.p - 90 * kDeg);
  EXPECT_NEAR(C(0, 0) / truth.in_plane(0, 0), 3.00, 5.1e-3);
  EXPECT_NEAR(C(1, 1) / truth.in_plane(1, 1), 3.72, 5.1e-3);
  EXPECT_NEAR(C(1, 5) / truth.in_plane(1, 2), 2.84, 5.1e-3);
  EXPECT_NEAR(C(5, 1) / truth.in_plane(2, 1), 2.33, 5.1e-3);
  EXPECT_NEAR(C(5, 5) / truth.in_plane(2, 2), 1.49, 5.1e-3);
  EXPECT_NEAR(C(2, 2) / truth.out_of_plane(0, 0), 1.50, 5.1e-3);
  EXPECT_NEAR(C(3, 3) / truth.out_of_plane(1, 1), 1.40, 5.1e-3);
  EXPECT_NEAR(C(4, 4) / truth.out_of_plane(2, 2), 1.21, 5.1e-3);
  EXPECT_NEAR(C(1, 0) / truth.in_plane(1, 0), -441, 0.6);
  EXPECT_EQ(C(0, 1), 0.0);  // not symmetric
}

TEST(CabinStiffness, PrintedPlatformViolatesReciprocity) {
  const auto platform = [](const StiffnessPose& pose, LimbForm form) {
    return Mat6(At(pose, form).K_platform.inverse());
  };
  const Mat6 first = platform(FirstPose(), LimbForm::kAsPrinted);
  const Vec6 ratio =
      first.diagonal().cwiseQuotient(platform(FirstPose(), LimbForm::kCorrected).diagonal());
  EXPECT_NEAR(ratio.minCoeff(), 0.07, 5.1e-3);
  EXPECT_NEAR(ratio.maxCoeff(), 2.2, 0.051);
  EXPECT_NEAR((first - first.transpose()).cwiseAbs().maxCoeff() / first.cwiseAbs().maxCoeff(), 0.71,
              5.1e-3);
  const Mat6 second = platform(SecondPose(), LimbForm::kAsPrinted);
  EXPECT_LT(second(1, 1), 0.0);  // indefinite
  EXPECT_LT(second(4, 4), 0.0);
}

TEST(CabinStiffness, PrintedModelFailsThePapersOwnLimitOf15Percent) {
  const LoadError first = Compare(At(FirstPose(), LimbForm::kAsPrinted).C, At(FirstPose()).C);
  EXPECT_LT((first.axis - Vec3(0.39, 0.03, 0.22)).cwiseAbs().maxCoeff(), 5.1e-3);
  EXPECT_NEAR(first.vector, 0.16, 5.1e-3);
  const LoadError second = Compare(At(SecondPose(), LimbForm::kAsPrinted).C, At(SecondPose()).C);
  EXPECT_LT((second.axis - Vec3(1.22, 2.57, 1.92)).cwiseAbs().maxCoeff(), 5.1e-3);
  EXPECT_NEAR(second.vector, 1.95, 5.1e-3);
}

TEST(CabinStiffness, RetractedRailIsNoBeam) {
  StiffnessPose pose = FirstPose();
  pose.d5 = 0.0;
  const ToolStiffness tool = At(pose);
  EXPECT_TRUE(tool.C.allFinite());
  EXPECT_EQ(tool.elements[10].C.norm(), 0.0);
}

TEST(CabinStiffness, UnreachablePosesNameTheLink) {
  ToolStiffness tool;
  StiffnessPose pose = FirstPose();
  pose.Y = 0.6;
  const RunSummary summary = SolveStiffness(Paper(), pose, LimbForm::kCorrected, &tool);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "link AB");
  EXPECT_FALSE(tool.K.allFinite());
}

TEST(CabinStiffness, EvaluatingAPoseTakesNoMemory) {
  const StiffnessParameters p = Paper();
  StiffnessPose pose = FirstPose();
  ToolStiffness tool;
  ASSERT_TRUE(SolveStiffness(p, pose, LimbForm::kCorrected, &tool).ok());
  const std::size_t before = AllocationCount();
  for (int k = 0; k < 100; ++k) {
    pose.X = 1e-5 * k;
    ASSERT_TRUE(SolveStiffness(p, pose, LimbForm::kCorrected, &tool).ok());
  }
  EXPECT_EQ(AllocationCount(), before);
}

}  // namespace
}  // namespace mbv::cabin
