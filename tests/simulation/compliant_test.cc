// The compliant simulation against hand calculations: cantilever, truss, parallelogram, servo,
// idle and free motions, large loads.
#include "simulation/engine/compliant.h"

#include <gtest/gtest.h>

#include <cmath>

#include "math/spatial.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

using fixtures::MakeBody;
using fixtures::MakeJoint;
using fixtures::PoseAt;

constexpr double kE = 210e9, kG = 80e9;

// The smallest displacements are 1e-6 m to 1e-5 m, differences of positions of 1 m: round-off is
// 1e-10 of them, and the extrapolation multiplies it by less than 10.
constexpr double kMeasured = 1e-9;

Section TestSection() { return {.area = 4e-4, .I_y = 2.5e-8, .I_z = 1.2e-8, .torsion = 3.1e-8}; }

Beam MakeBeam(const std::string& name, int body, const Vec3& from, const Vec3& to,
              const Vec3& z = Vec3::UnitZ()) {
  Beam beam{.name = name, .body = body, .p_from = from, .p_to = to, .section = TestSection()};
  const Vec3 x = (to - from).normalized(), y = z.cross(x).normalized();
  beam.R_BE << x, y, x.cross(y);

  beam.youngs_modulus = kE;
  beam.shear_modulus = kG;
  return beam;
}

Body MassBody(const std::string& name) { return MakeBody(name, 1, {0, 0, 0}, {1, 1, 1}); }

Mechanism WorldOnly() {
  Mechanism m;
  m.name = "frame";
  m.bodies.emplace_back().name = "world";
  m.X_WB_home.push_back(Pose::Identity());
  return m;
}

int Add(Mechanism* m, const std::string& name, const Pose& X_WB) {
  m->bodies.push_back(MassBody(name));
  m->X_WB_home.push_back(X_WB);
  return static_cast<int>(m->bodies.size()) - 1;
}

void AddOutput(Mechanism* m, int body, const Pose& X_BO) {
  Output output;
  output.name = "tip";
  output.body = body;
  output.X_BO = X_BO;
  m->outputs.push_back(output);
}

// A beam of length L along x of its body, fixed at the origin of a body that stands askew.
Mechanism Cantilever(double L, const Pose& X_WB = Pose::Identity()) {
  Mechanism m = WorldOnly();
  const int arm = Add(&m, "arm", X_WB);
  Joint joint = MakeJoint("clamp", JointKind::kFixed, 0, {0, 0, 0}, arm, {0, 0, 0});
  joint.X_PF = X_WB;
  m.joints.push_back(joint);
  m.beams.push_back(MakeBeam("arm", arm, {0, 0, 0}, {L, 0, 0}));
  AddOutput(&m, arm, PoseAt({L, 0, 0}));
  return m;
}

// Tip flexibility of a cantilever in beam axes, [Δγ; Δε] per [m; f].
Mat6 CantileverFlexibility(double L) {
  const Section s = TestSection();
  Mat6 C = Mat6::Zero();
  C(0, 0) = L / (kG * s.torsion);
  C(1, 1) = L / (kE * s.I_y);
  C(2, 2) = L / (kE * s.I_z);
  C(3, 3) = L / (kE * s.area);
  C(4, 4) = L * L * L / (3 * kE * s.I_z);
  C(5, 5) = L * L * L / (3 * kE * s.I_y);
  C(2, 4) = C(4, 2) = L * L / (2 * kE * s.I_z);
  C(1, 5) = C(5, 1) = -L * L / (2 * kE * s.I_y);
  return C;
}

Mat6 Rotated(const Mat3& R, const Mat6& A) {
  Mat6 RR = Mat6::Zero();
  RR.topLeftCorner<3, 3>() = RR.bottomRightCorner<3, 3>() = R;
  return RR * A * RR.transpose();
}

// Largest difference of two compliances, each entry against the diagonal entries it belongs to.
double Difference(const Mat6& A, const Mat6& B) {
  const Vec6 s = B.diagonal().cwiseAbs().cwiseSqrt().cwiseInverse();
  return (s.asDiagonal() * (A - B) * s.asDiagonal()).cwiseAbs().maxCoeff();
}

CompliantRun Simulated(const Mechanism& m, const std::vector<Vec6>& wrenches = {}) {
  return SimulateStiffness(m, m.X_WB_home, 0, wrenches);
}

Vec6 Force(double x, double y, double z) { return (Vec6() << 0, 0, 0, x, y, z).finished(); }

TEST(CompliantSimulation, CantileverHasTheTextbookFlexibilityInAllAxes) {
  const CompliantRun run = Simulated(Cantilever(0.7));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  EXPECT_EQ(run.result.rank, 6);
  EXPECT_LT(Difference(run.result.C, CantileverFlexibility(0.7)), kMeasured);
  EXPECT_LT((run.result.K * run.result.C - Mat6::Identity()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT(run.residual, 1e-9);
  EXPECT_LT(run.extrapolation_error, kMeasured);
}

TEST(CompliantSimulation, AxesOfABeamTurnWithItsBody) {
  const Pose X_WB = PoseAt({0.3, -0.2, 0.5}, RotRpy({0.4, -0.7, 1.1}));
  const CompliantRun run = Simulated(Cantilever(0.7, X_WB));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  EXPECT_LT(Difference(run.result.C, Rotated(X_WB.linear(), CantileverFlexibility(0.7))),
            kMeasured);
}

TEST(CompliantSimulation, TwoHalvesOfABeamAreTheWholeBeam) {
  Mechanism m = Cantilever(0.7);
  m.beams = {MakeBeam("inner", 1, {0, 0, 0}, {0.3, 0, 0}),
             MakeBeam("outer", 1, {0.3, 0, 0}, {0.7, 0, 0})};
  const CompliantRun run = Simulated(m);
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  EXPECT_LT(Difference(run.result.C, CantileverFlexibility(0.7)), kMeasured);
}

TEST(CompliantSimulation, SharesOfTheElementsAddUpToTheCompliance) {
  Mechanism m = Cantilever(0.7);
  m.beams = {MakeBeam("inner", 1, {0, 0, 0}, {0.3, 0, 0}),
             MakeBeam("outer", 1, {0.3, 0, 0}, {0.7, 0, 0})};
  const CompliantRun run = Simulated(m);
  ASSERT_EQ(run.result.shares.size(), 2u);
  EXPECT_EQ(run.result.shares[0].element, "inner");
  EXPECT_EQ(run.result.shares[1].element, "outer");
  EXPECT_LT(Difference(run.result.shares[0].C + run.result.shares[1].C, run.result.C), kMeasured);
  // The outer half alone is a cantilever of its own length.
  EXPECT_LT(Difference(run.result.shares[1].C, CantileverFlexibility(0.4)), kMeasured);
}

TEST(CompliantSimulation, OnePercentOfOneSectionIsSeen) {
  Mechanism m = Cantilever(0.7);
  const Mat6 C = Simulated(m).result.C;
  m.beams[0].section.I_y *= 1.01;
  EXPECT_NEAR(Simulated(m).result.C(5, 5) / C(5, 5), 1 / 1.01, kMeasured);
  EXPECT_GT(Difference(Simulated(m).result.C, C), 100 * kMeasured);
}

// Two bars from (0, 0) and (2 a, 0) meet at (a, h) in a hinge about z.
Mechanism Truss(double a, double h) {
  Mechanism m = WorldOnly();
  const double L = std::hypot(a, h), angle = std::atan2(h, a);
  const int left = Add(&m, "left", PoseAt({0, 0, 0}, RotZ(angle)));
  const int right = Add(&m, "right", PoseAt({2 * a, 0, 0}, RotZ(M_PI - angle)));
  m.joints = {MakeJoint("A", JointKind::kRevolute, 0, {0, 0, 0}, left, {0, 0, 0}, angle),
              MakeJoint("B", JointKind::kRevolute, 0, {2 * a, 0, 0}, right, {0, 0, 0}),
              MakeJoint("C", JointKind::kRevolute, left, {L, 0, 0}, right, {L, 0, 0})};
  m.beams = {MakeBeam("left", left, {0, 0, 0}, {L, 0, 0}),
             MakeBeam("right", right, {0, 0, 0}, {L, 0, 0})};
  AddOutput(&m, left, PoseAt({L, 0, 0}));
  return m;
}

TEST(CompliantSimulation, HingedBarsCarryForcesAlongTheirAxesOnly) {
  const double a = 0.3, h = 0.4, L = 0.5;
  const CompliantRun run = Simulated(Truss(a, h));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  const double axial = kE * TestSection().area / L;
  EXPECT_NEAR(run.result.C(3, 3) * 2 * axial * (a / L) * (a / L), 1.0, kMeasured);
  EXPECT_NEAR(run.result.C(4, 4) * 2 * axial * (h / L) * (h / L), 1.0, kMeasured);
  EXPECT_NEAR(run.result.C(3, 4) * axial, 0.0, kMeasured);
}

// Two cranks of length L from the ground to a coupler of length d, all hinges about z; the left
// crank is held by a servo. Elastic cranks along y.
Mechanism Parallelogram(double servo) {
  constexpr double L = 0.4, d = 0.3;
  Mechanism m = WorldOnly();
  const Mat3 up = RotZ(M_PI / 2);
  const int left = Add(&m, "left", PoseAt({0, 0, 0}, up));
  const int right = Add(&m, "right", PoseAt({d, 0, 0}, up));
  const int coupler = Add(&m, "coupler", PoseAt({0, L, 0}));
  m.joints = {
      MakeJoint("A", JointKind::kRevolute, 0, {0, 0, 0}, left, {0, 0, 0}, M_PI / 2),
      MakeJoint("B", JointKind::kRevolute, 0, {d, 0, 0}, right, {0, 0, 0}, M_PI / 2),
      MakeJoint("C", JointKind::kRevolute, left, {L, 0, 0}, coupler, {0, 0, 0}, -M_PI / 2),
      MakeJoint("D", JointKind::kRevolute, right, {L, 0, 0}, coupler, {d, 0, 0}, -M_PI / 2)};
  m.beams = {MakeBeam("left", left, {0, 0, 0}, {L, 0, 0}),
             MakeBeam("right", right, {0, 0, 0}, {L, 0, 0})};
  m.drives.push_back({.name = "motor", .kind = JointDrive{0, 0}, .range = {}, .stiffness = servo});
  AddOutput(&m, coupler, PoseAt({d / 2, 0, 0}));
  return m;
}

TEST(CompliantSimulation, ParallelogramCarriesBendingOutOfItsPlaneThroughAllFourHinges) {
  constexpr double L = 0.4, d = 0.3;
  const CompliantRun run = Simulated(Parallelogram(std::numeric_limits<double>::infinity()));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  const Section s = TestSection();
  const Mat6& K = run.result.K;
  // In the plane: a locked crank deflects, the other one swings; both are struts along y.
  EXPECT_NEAR(run.result.C(3, 3) * 3 * kE * s.I_z / (L * L * L), 1.0, 10 * kMeasured);
  EXPECT_NEAR(K(4, 4) * L / (2 * kE * s.area), 1.0, 10 * kMeasured);
  EXPECT_NEAR(K(2, 2) * L / (2 * kE * s.area * d * d / 4), 1.0, 10 * kMeasured);
  // Across the plane the hinges clamp: 12 EI/L³ each; tilting the coupler about x, 4 EI/L.
  EXPECT_NEAR(K(5, 5) * L * L * L / (2 * 12 * kE * s.I_y), 1.0, 10 * kMeasured);
  EXPECT_NEAR(K(0, 0) * L / (2 * 4 * kE * s.I_y), 1.0, 10 * kMeasured);
  // About y: torsion of both and their couple across the plane.
  const double twist = 2 * kG * s.torsion / L + 2 * 12 * kE * s.I_y / (L * L * L) * d * d / 4;
  EXPECT_NEAR(K(1, 1) / twist, 1.0, 10 * kMeasured);
}

TEST(CompliantSimulation, AServoAddsItsSpringToTheCrank) {
  constexpr double L = 0.4, servo = 900.0;
  const Mat6 locked = Simulated(Parallelogram(std::numeric_limits<double>::infinity())).result.C;
  const CompliantRun run = Simulated(Parallelogram(servo));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  EXPECT_NEAR((run.result.C(3, 3) - locked(3, 3)) * servo / (L * L), 1.0, 10 * kMeasured);
  EXPECT_EQ(run.result.shares.back().element, "motor (servo)");
  EXPECT_NEAR(run.result.shares.back().C(3, 3) * servo / (L * L), 1.0, 10 * kMeasured);
}

TEST(CompliantSimulation, TheAngleOfAServoDoesNotRoundSmallLoadsAway) {
  // An arm of 39 N/m behind a servo of 1e5 N m/rad allows loads of 1e-3 N. Rounding the servo's
  // angle of 1.57 rad would unbalance them by 1e-11 N m, 1e-8 of the load; counted from the given
  // pose the angle is its deformation.
  Mechanism m = Parallelogram(1e5);
  const int arm = Add(&m, "arm", PoseAt({0.3, 0.4, 0}));
  m.joints.push_back(MakeJoint("mount", JointKind::kFixed, 3, {0.3, 0, 0}, arm, {0, 0, 0}));
  m.beams.push_back(MakeBeam("arm", arm, {0, 0, 0}, {0.2, 0, 0}));
  m.beams.back().section = {.area = 4e-4, .I_y = 5e-13, .I_z = 5e-13, .torsion = 1e-12};
  m.outputs.clear();
  AddOutput(&m, arm, PoseAt({0.2, 0, 0}));
  const CompliantRun run = Simulated(m);
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  EXPECT_LT(run.residual, 1e-10);
  // The arm deflects; the cranks stretch and let the coupler turn about its middle, 0.35 m away.
  const double bending = 0.2 * 0.2 * 0.2 / (3 * kE * 5e-13);
  const double cranks = 0.4 / (2 * kE * TestSection().area) * (1 + std::pow(0.35 / 0.15, 2));
  EXPECT_NEAR(run.result.C(4, 4) / (bending + cranks), 1.0, 1e-8);
}

TEST(CompliantSimulation, WithoutMotorTheParallelogramHasNoStiffnessAlongItsMotion) {
  Mechanism m = Parallelogram(1.0);
  m.drives.clear();
  const CompliantRun run = Simulated(m);
  EXPECT_EQ(run.result.summary.stop, Stop::kSingular);
  EXPECT_EQ(run.result.rank, 5);
  EXPECT_TRUE(run.result.C.hasNaN());
  const Section s = TestSection();
  EXPECT_NEAR(run.result.K(4, 4) * 0.4 / (2 * kE * s.area), 1.0, 10 * kMeasured);
  EXPECT_LT(std::abs(run.result.K(3, 3)), kMeasured * run.result.K(5, 5));
}

// A leg between two balls under a mass that slides along the leg's line.
Mechanism Leg(double servo, bool elastic_rod) {
  Mechanism m = WorldOnly();
  const int head = Add(&m, "head", PoseAt({0, 0, 0.6}));
  m.joints = {MakeJoint("guide", JointKind::kPrismatic, 0, {0, 0, 0.6}, head, {0, 0, 0})};
  if (elastic_rod) {
    const int rod = Add(&m, "rod", PoseAt({0, 0, 0}));
    m.joints.push_back(MakeJoint("foot", JointKind::kSpherical, 0, {0, 0, 0}, rod, {0, 0, 0}));
    m.joints.push_back(MakeJoint("top", JointKind::kSpherical, rod, {0, 0, 0.6}, head, {0, 0, 0}));
    m.beams.push_back(MakeBeam("rod", rod, {0, 0, 0}, {0, 0, 0.6}, Vec3::UnitX()));
  } else {
    m.drives.push_back({.name = "leg",
                        .kind = DistanceDrive{0, {0, 0, 0}, head, {0, 0, 0}},
                        .range = {},
                        .stiffness = servo});
  }
  // The elastic arm makes the other directions finite.
  const int arm = Add(&m, "arm", PoseAt({0, 0, 0.6}));
  m.joints.push_back(MakeJoint("mount", JointKind::kFixed, head, {0, 0, 0}, arm, {0, 0, 0}));
  m.beams.push_back(MakeBeam("arm", arm, {0, 0, 0}, {0.2, 0, 0}));
  AddOutput(&m, arm, PoseAt({0.2, 0, 0}));
  return m;
}

TEST(CompliantSimulation, ALegsServoIsASpringBetweenItsEnds) {
  const CompliantRun run = Simulated(Leg(4e5, false));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  Mat6 expected = CantileverFlexibility(0.2);
  expected(5, 5) += 1 / 4e5;
  EXPECT_LT(Difference(run.result.C, expected), kMeasured);
}

TEST(CompliantSimulation, TheIdleSpinOfARodBetweenBallsDoesNotDisturb) {
  const CompliantRun run = Simulated(Leg(0, true));
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  Mat6 expected = CantileverFlexibility(0.2);
  expected(5, 5) += 0.6 / (kE * TestSection().area);
  EXPECT_LT(Difference(run.result.C, expected), kMeasured);
}

TEST(CompliantSimulation, NonLinearityGrowsInProportionToTheLoad) {
  const Mechanism m = Truss(0.3, 0.4);
  const double full = 50e3;
  const CompliantRun run = Simulated(m, {Force(full, full, 0), Force(full / 2, full / 2, 0)});
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  const auto nonlinear = [&](int k, double load) {
    const Vec6 linear = run.result.C * Force(load, load, 0);
    return (run.loaded[k].displacement - linear).tail<3>().norm() / linear.tail<3>().norm();
  };
  EXPECT_GT(nonlinear(0, full), 1e-5);
  EXPECT_NEAR(nonlinear(0, full) / nonlinear(1, full / 2), 2.0, 1e-2);
}

TEST(CompliantSimulation, ALongCantileverUnderALargeLoadFollowsTheElastica) {
  // 16 beams of equal length; end load with F L²/(E I) = 1: tip at 0.30172 L, shortened by
  // 0.05643 L [Bisshopp and Drucker 1945].
  Mechanism m = Cantilever(1.0);
  m.beams.clear();
  constexpr int n = 16;
  for (int k = 0; k < n; ++k) {
    Beam beam = MakeBeam("piece" + std::to_string(k), 1, {k / double(n), 0, 0},
                         {(k + 1) / double(n), 0, 0});
    beam.section.I_z = 1e-10;
    m.beams.push_back(beam);
  }
  const CompliantRun run = Simulated(m, {Force(0, kE * 1e-10, 0)});
  ASSERT_TRUE(run.result.summary.ok()) << run.result.summary.message;
  const Vec6 D = run.loaded[0].displacement;
  // Chords for arcs: an error of order 1/n² of the shortening.
  EXPECT_NEAR(D[4], 0.30172, 5e-4);
  EXPECT_NEAR(D[3], -0.05643, 2e-4);
  EXPECT_LT(run.loaded[0].residual, 1e-9);
}

TEST(CompliantSimulation, ARingOfBeamsIsClosed) {
  // A square frame clamped at one corner: its two sides act in parallel. By symmetry about the
  // diagonal a force across the plane at the opposite corner moves it only across the plane and
  // about the other diagonal.
  Mechanism m = Cantilever(0.5);
  m.outputs[0].X_BO = PoseAt({0.5, 0.5, 0});
  m.beams = {
      MakeBeam("s1", 1, {0, 0, 0}, {0.5, 0, 0}), MakeBeam("s2", 1, {0.5, 0, 0}, {0.5, 0.5, 0}),
      MakeBeam("s3", 1, {0, 0, 0}, {0, 0.5, 0}), MakeBeam("s4", 1, {0, 0.5, 0}, {0.5, 0.5, 0})};
  const CompliantRun ring = Simulated(m);
  ASSERT_TRUE(ring.result.summary.ok()) << ring.result.summary.message;
  m.beams.resize(2);
  const Mat6 one = Simulated(m).result.K;
  m.beams = {MakeBeam("s3", 1, {0, 0, 0}, {0, 0.5, 0}),
             MakeBeam("s4", 1, {0, 0.5, 0}, {0.5, 0.5, 0})};
  const Mat6 other = Simulated(m).result.K;
  EXPECT_LT(Difference(ring.result.C, (one + other).inverse()), kMeasured);
}

TEST(CompliantSimulation, AJointOffTheBeamsIsRefused) {
  Mechanism m = Cantilever(0.7);
  m.outputs[0].X_BO = PoseAt({0.35, 0, 0});
  const CompliantRun run = Simulated(m);
  EXPECT_EQ(run.result.summary.stop, Stop::kUnsupported);
  EXPECT_NE(run.result.summary.message.find("output 'tip'"), std::string::npos);
  EXPECT_EQ(run.result.rank, -1);
}

TEST(CompliantSimulation, ARigidOutputHasInfiniteStiffness) {
  Mechanism m = Cantilever(0.7);
  m.outputs[0].X_BO = Pose::Identity();
  EXPECT_EQ(Simulated(m).result.summary.stop, Stop::kSingular);
}

}  // namespace
}  // namespace mbv
