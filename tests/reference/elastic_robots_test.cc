// The elastic models of the shipped robots: poses, numbers of the papers' data, laws.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analytic/stiffness_form.h"
#include "math/spatial.h"
#include "model_file/load_model.h"
#include "reference/frame_stiffness.h"
#include "reference/reference.h"
#include "tests/reference/direct_stiffness.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;
// Relative, of solutions with condition numbers up to 1e5.
constexpr double kRobotAlgebra = 1e6 * kEps;
// Relative, against the displacement method, which loses digits to its stiff members.
constexpr double kDirect = 1e-8;

Mechanism LoadShipped(const std::string& file, const LoadOptions& options = {}) {
  const LoadResult result = LoadModel(std::string(kSourceDir) + "/models/" + file, options);
  EXPECT_EQ(result.diagnostics.Text(), "");
  return result.mechanism.value_or(Mechanism{});
}

Motion MotionOf(const Mechanism& m, const PoseCoordinates& pose) {
  Motion motion;
  for (const auto& [name, value] : pose) {
    Coordinate coordinate{Coordinate::Kind::kDrive, m.FindDrive(name), 0};
    if (coordinate.index < 0) {
      const size_t dot = name.rfind('.');
      const std::vector<std::string> components = {"x", "y", "z", "roll", "pitch", "yaw"};
      const auto at = std::find(components.begin(), components.end(), name.substr(dot + 1));
      coordinate = {Coordinate::Kind::kOutput, m.FindOutput(name.substr(0, dot)),
                    static_cast<int>(at - components.begin())};
    }
    motion.commands.push_back({name, {{coordinate, 1.0}}, Constant(value)});
  }
  return motion;
}

RunSummary Solve(const Mechanism& m, const PoseCoordinates& pose, ReferenceSample* sample) {
  const Motion motion = MotionOf(m, pose);
  CommandSample command;
  EvaluateMotion(motion, 0.0, &command);
  return ReferenceSolver(m, motion).Kinematics(command, sample);
}

std::vector<Pose> PosesAt(const Mechanism& m, const PoseCoordinates& pose) {
  ReferenceSample sample;
  const RunSummary summary = Solve(m, pose, &sample);
  EXPECT_TRUE(summary.ok()) << summary.message;
  if (!summary.ok()) return m.X_WB_home;
  EXPECT_LT(sample.closure_position_m, 1e-13);
  EXPECT_LT(sample.closure_rotation_rad, 1e-13);
  return sample.states.X_WB;
}

StiffnessResult StiffnessAt(const Mechanism& m, const PoseCoordinates& pose,
                            const char* output = "platform") {
  return FrameStiffness(m, PosesAt(m, pose), m.FindOutput(output));
}

PoseCoordinates ScaraPose(double x_mm, double y_mm, double z_mm, double yaw) {
  return {{"platform.x", 1e-3 * x_mm},
          {"platform.y", 1e-3 * y_mm},
          {"platform.z", 1e-3 * z_mm},
          {"platform.yaw", yaw}};
}
const PoseCoordinates kTabulated = ScaraPose(-50, -50, -150, 0.2);

PoseCoordinates CabinPose(double x, double y, double gamma, double th3, double th4, double th6) {
  return {{"d1", 0.5},  {"platform.x", x}, {"platform.y", y}, {"platform.yaw", gamma},
          {"th3", th3}, {"th4", th4},      {"th6", th6}};
}
const PoseCoordinates kCabinFirst = CabinPose(0, 0.36, 0, 90 * kDeg, 0, 0);
const PoseCoordinates kCabinSecond =
    CabinPose(0.03, 0.33, 6 * kDeg, 40 * kDeg, -35 * kDeg, 25 * kDeg);

/// At its second pose the rail is longer.
Mechanism CabinAt(bool second, bool printed_torsion = false) {
  LoadOptions options;
  if (second) options.overrides["d5"] = -0.31;
  if (printed_torsion) options.overrides["torsion_printed"] = 1;
  return LoadShipped("cabin_robot/elastic.yaml", options);
}

double RelativeDifference(const MatX& a, const MatX& b) { return (a - b).norm() / b.norm(); }

TEST(ElasticScara, ClosesAllOverItsWorkspace) {
  for (const char* file : {"scara_robot/elastic.yaml", "scara_robot/elastic_crossbar.yaml"}) {
    const Mechanism m = LoadShipped(file);
    for (const auto& [z, yaw] :
         {std::pair(-100.0, 0.0), {-230.0, 0.0}, {-190.0, 45 * kDeg}, {-190.0, -45 * kDeg}}) {
      for (const double radius : {0.0, 60.0, 99.0}) {
        for (const double azimuth : {20, 110, 200, 290}) {
          (void)PosesAt(m, ScaraPose(radius * std::cos(azimuth * kDeg),
                                     radius * std::sin(azimuth * kDeg), z, yaw));
          if (HasFailure()) FAIL() << file << " " << radius << " " << azimuth << " " << z;
        }
      }
    }
  }
}

TEST(ElasticScara, RefusesTheDeadPointOfAnArm) {
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  ReferenceSample sample;
  const RunSummary summary = Solve(m, ScaraPose(50, 0, -100, 0), &sample);
  EXPECT_EQ(summary.stop, Stop::kSingular);
  EXPECT_EQ(summary.where, "limb1.motor");
}

// K at the tabulated pose, SI, rotation first, as printed with six digits.
const double kPrintedK[6][6] = {{654.142, -194.341, 117.172, -4198.04, -1853.10, -5790.11},
                                {0, 685.658, -179.327, 2631.94, 6142.54, 3497.45},
                                {0, 0, 153.297, 905.136, -4004.81, -1750.16},
                                {0, 0, 0, 162310, 24450, -23469},
                                {0, 0, 0, 0, 153046, -23643},
                                {0, 0, 0, 0, 0, 177328}};

bool IsPrintedK(const Mat6& K) {
  for (int i = 0; i < 6; ++i) {
    for (int j = i; j < 6; ++j) {
      const double size = std::abs(kPrintedK[i][j]);
      const double last_digit = size < 1e3 ? 1e-3 : size < 1e4 ? 1e-2 : 1.0;
      if (!(std::abs(K(i, j) - kPrintedK[i][j]) <= 0.501 * last_digit)) return false;
    }
  }
  return true;
}

double Kappa(const Mat6& K, int first_row) {
  return K.middleRows<3>(first_row).jacobiSvd().singularValues()[0];
}

TEST(ElasticScara, HasTheTabulatedStiffnessToAllPrintedDigits) {
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  const StiffnessResult result = StiffnessAt(m, kTabulated);
  ASSERT_TRUE(result.summary.ok()) << result.summary.message;
  EXPECT_EQ(result.rank, 6);
  EXPECT_TRUE(IsPrintedK(result.K)) << result.K;
  EXPECT_NEAR(Kappa(result.K, 0), 10463.28, 0.005);
  EXPECT_NEAR(Kappa(result.K, 3), 213275.5, 0.05);
}

TEST(ElasticScara, MissesThePrintedDigitsWhenOneSectionIsOnePercentOff) {
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  const std::vector<Pose> X_WB = PosesAt(m, kTabulated);
  for (size_t b = 0; b < m.beams.size(); ++b) {
    Mechanism perturbed = m;
    perturbed.beams[b].section.I_y *= 1.01;
    perturbed.beams[b].section.I_z *= 1.01;
    perturbed.beams[b].section.area *= 1.01;
    perturbed.beams[b].section.torsion *= 1.01;
    EXPECT_FALSE(IsPrintedK(FrameStiffness(perturbed, X_WB, 0).K)) << m.beams[b].name;
  }
  for (size_t d = 0; d < m.drives.size(); ++d) {
    Mechanism soft = m;
    soft.drives[d].stiffness *= 0.99;
    EXPECT_FALSE(IsPrintedK(FrameStiffness(soft, X_WB, 0).K)) << m.drives[d].name;
  }
}

TEST(ElasticScara, HasTheTabulatedIndicesInTheCentreWhereItsYawIsFree) {
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  const struct {
    double z_mm, kappa_m, kappa_f, half_digit;
  } centre[] = {{-100, 14831, 6.861e5, 50}, {-165, 5519, 1.80e5, 500}, {-230, 5949, 2.321e5, 50}};
  for (const auto& at : centre) {
    const StiffnessResult result = StiffnessAt(m, ScaraPose(0, 0, at.z_mm, 0));
    EXPECT_EQ(result.rank, 5);
    EXPECT_EQ(result.summary.stop, Stop::kSingular);
    EXPECT_NEAR(Kappa(result.K, 0), at.kappa_m, 0.51);
    EXPECT_NEAR(Kappa(result.K, 3), at.kappa_f, at.half_digit);
    EXPECT_LT(std::abs(result.K(2, 2)), kRobotAlgebra * result.K.norm());
  }
}

TEST(ElasticScara, IsTheSumOfItsLimbsOfRankTwoAndOne) {
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  const std::vector<Pose> X_WB = PosesAt(m, kTabulated);
  const char* const holds[] = {"limb1.pivot", "limb2.pivot", "limb3.ball_B", "limb4.ball_B"};
  Mat6 sum = Mat6::Zero();
  for (int limb = 0; limb < 4; ++limb) {
    Mechanism alone = m;
    for (int other = 0; other < 4; ++other) {
      if (other != limb) alone.joints[m.FindJoint(holds[other])].kind = JointKind::kFree;
    }
    const StiffnessResult result = FrameStiffness(alone, X_WB, 0);
    EXPECT_EQ(result.rank, limb < 2 ? 2 : 1);
    sum += result.K;
  }
  EXPECT_LT(RelativeDifference(sum, FrameStiffness(m, X_WB, 0).K), kRobotAlgebra);
}

TEST(ElasticScara, WithRigidLinksIsHeldByItsServosThroughTheJacobian) {
  LoadOptions stiff;
  stiff.overrides["E"] = 210e9 * 1e12;
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml", stiff);
  // θ̇ = J Ẋ by unit velocities of the platform.
  MatX J(4, 4);
  Motion motion = MotionOf(m, kTabulated);
  CommandSample command;
  EvaluateMotion(motion, 0.0, &command);
  ReferenceSolver solver(m, motion);
  for (int c = 0; c < 4; ++c) {
    command.velocity = VecX::Unit(4, c);
    ReferenceSample sample;
    ASSERT_TRUE(solver.Kinematics(command, &sample).ok());
    J.col(c) = sample.driven.velocity;
  }
  const MatX wanted = (J.transpose() * 5000.0 * J).inverse();
  // The commands are in alphabetical order: x, y, yaw, z.
  const int rows[4] = {3, 4, 2, 5};
  const Mat6 C = StiffnessAt(m, kTabulated).C;
  MatX got(4, 4);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) got(i, j) = C(rows[i], rows[j]);
  }
  // Links 1e12 times stiffer, whose share is some ten times that of the servos.
  EXPECT_LT(RelativeDifference(got, wanted), 1e-10);
  const double tilt = C.topLeftCorner<2, 2>().norm();
  EXPECT_LT(tilt, 1e-12) << "it cannot tilt";
}

TEST(ElasticScara, WithItsCrossBarsIsSlightlySofter) {
  const Mat6 rpar = StiffnessAt(LoadShipped("scara_robot/elastic.yaml"), kTabulated).K;
  const Mat6 balls = StiffnessAt(LoadShipped("scara_robot/elastic_crossbar.yaml"), kTabulated).K;
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(rpar - balls).eigenvalues()[0],
            -kRobotAlgebra * rpar.norm())
      << "releasing the rods' ends cannot stiffen";
  EXPECT_GT(RelativeDifference(balls, rpar), 4e-4);
  EXPECT_LT(RelativeDifference(balls, rpar), 3.2e-2);
}

TEST(ElasticScara, MirrorsAtThePlaneBetweenLimbs1And2) {
  // (x, y, z, φ) → (y, x, z, −φ): K turns into its mirror image.
  const Mechanism m = LoadShipped("scara_robot/elastic.yaml");
  const Mat6 K = StiffnessAt(m, ScaraPose(-30, 75, -130, 0.5)).K;
  const Mat6 K_mirrored = StiffnessAt(m, ScaraPose(75, -30, -130, -0.5)).K;
  Mat3 swap;
  swap << 0, 1, 0, 1, 0, 0, 0, 0, 1;
  Mat6 mirror = Mat6::Zero();
  mirror.topLeftCorner<3, 3>() = -swap;  // rotations are axial vectors
  mirror.bottomRightCorner<3, 3>() = swap;
  EXPECT_LT(RelativeDifference(K_mirrored, mirror * K * mirror), kRobotAlgebra);
}

TEST(ElasticCabin, HasTheTabulatedComplianceAndFirstDisplacement) {
  const StiffnessResult result =
      StiffnessAt(CabinAt(false, /*printed_torsion=*/true), kCabinFirst, "tool");
  ASSERT_TRUE(result.summary.ok()) << result.summary.message;
  const double diagonal[6] = {1.11e-6, 3.29e-7, 1.05e-6, 9.28e-8, 1.261e-7, 8.09e-8};
  const double last_digit[6] = {1e-8, 1e-9, 1e-8, 1e-10, 1e-10, 1e-10};
  for (int i = 0; i < 6; ++i) {
    EXPECT_NEAR(result.C(i, i), diagonal[i], 0.501 * last_digit[i]) << i;
  }
  Vec6 load;  // the first of the 50: [m; f]
  load << 0.245263, 0.700674, 0.332428, 872.199362, 873.529244, 700.172153;
  const Vec3 displacement_mm = 1e3 * (result.C * load).tail<3>();
  EXPECT_LT((displacement_mm - Vec3(0.078433, 0.163127, 0.127335)).cwiseAbs().maxCoeff(), 0.501e-6);
  // The exact torsion constant shows in the fourth digit.
  const Mat6 exact = StiffnessAt(CabinAt(false), kCabinFirst, "tool").C;
  EXPECT_GT(RelativeDifference(exact, result.C), 1e-5);
  EXPECT_LT(RelativeDifference(exact, result.C), 1e-2);
}

TEST(ElasticCabin, MissesTheFirstDisplacementWhenOneBeamIsOnePercentTooStiff) {
  const Mechanism m = CabinAt(false, true);
  const std::vector<Pose> X_WB = PosesAt(m, kCabinFirst);
  const int tool = m.FindOutput("tool");
  const Mat6 C_direct = fixtures::DirectStiffness(m, X_WB).Compliance(tool);
  Vec6 load;
  load << 0.245263, 0.700674, 0.332428, 872.199362, 873.529244, 700.172153;
  for (size_t b = 0; b < m.beams.size(); ++b) {
    Mechanism perturbed = m;
    perturbed.beams[b].youngs_modulus *= 1.01;
    perturbed.beams[b].shear_modulus *= 1.01;
    const Mat6 C = FrameStiffness(perturbed, X_WB, tool).C;
    EXPECT_GT(RelativeDifference(C, C_direct), kDirect) << m.beams[b].name;
    if (m.beams[b].name == "tool") continue;  // too short and thick for the printed digits
    const Vec3 displacement_mm = 1e3 * (C * load).tail<3>();
    const Vec3 off = displacement_mm - Vec3(0.078433, 0.163127, 0.127335);
    EXPECT_GT(off.cwiseAbs().maxCoeff(), 0.501e-6) << m.beams[b].name;
  }
}

TEST(ElasticCabin, ServosWithComplianceAddToTheLockedOnes) {
  LoadOptions options;
  options.overrides["c_th3"] = 1e-6;
  const Mechanism soft = LoadShipped("cabin_robot/elastic.yaml", options);
  const Mat6 C = StiffnessAt(soft, kCabinFirst, "tool").C;
  const Mat6 locked = StiffnessAt(CabinAt(false), kCabinFirst, "tool").C;
  // Serial: th3 turns about world y through the column, 0.545 m in front of which the tool is.
  Vec6 turn;
  turn << 0, 1, 0, Vec3::UnitY().cross(Vec3(0, 0.461, -0.545));
  EXPECT_LT(RelativeDifference(C - locked, 1e-6 * turn * turn.transpose()), kRobotAlgebra);
}

// Laws on every model and pose.
struct Subject {
  std::string name;
  Mechanism mechanism;
  std::vector<Pose> X_WB;
  int output;
  PoseCoordinates pose;
};

std::vector<Subject> Subjects() {
  std::vector<Subject> subjects;
  const auto add = [&](const std::string& name, const Mechanism& m, const PoseCoordinates& pose,
                       const char* output) {
    subjects.push_back({name, m, PosesAt(m, pose), m.FindOutput(output), pose});
  };
  const Mechanism scara = LoadShipped("scara_robot/elastic.yaml");
  add("scara", scara, kTabulated, "platform");
  add("scara, arm across the rod", scara, ScaraPose(-50, -50, -201.574, 0.2), "platform");
  add("scara, near the rim", scara, ScaraPose(-30, 75, -130, 30 * kDeg), "platform");
  add("cross-bar", LoadShipped("scara_robot/elastic_crossbar.yaml"), kTabulated, "platform");
  add("cabin", CabinAt(false), kCabinFirst, "tool");
  add("cabin, second pose", CabinAt(true), kCabinSecond, "tool");
  add("cabin, platform", CabinAt(true), kCabinSecond, "platform");
  return subjects;
}

TEST(ElasticRobots, AgreeWithTheDirectStiffnessMethod) {
  for (const Subject& s : Subjects()) {
    const StiffnessResult result = FrameStiffness(s.mechanism, s.X_WB, s.output);
    ASSERT_TRUE(result.summary.ok()) << s.name << ": " << result.summary.message;
    const Mat6 C = fixtures::DirectStiffness(s.mechanism, s.X_WB).Compliance(s.output);
    EXPECT_LT(RelativeDifference(result.C, C), kDirect) << s.name;
  }
}

TEST(ElasticRobots, AgreeWithTheClosedForms) {
  for (const Subject& s : Subjects()) {
    const StiffnessFormRow* row = FindStiffnessForm(s.mechanism.name);
    ASSERT_NE(row, nullptr);
    if (s.name == "cross-bar" || s.mechanism.outputs[s.output].name != row->output) continue;
    Diagnostics findings;
    const auto form = row->factory(s.mechanism, s.pose, "", &findings);
    ASSERT_NE(form, nullptr) << findings.Text();
    const StiffnessResult closed = form->Evaluate(s.pose);
    const StiffnessResult result = FrameStiffness(s.mechanism, s.X_WB, s.output);
    EXPECT_LT(RelativeDifference(result.C, closed.C), 1e-10) << s.name;
    EXPECT_LT(RelativeDifference(result.K, closed.K), 1e-10) << s.name;
    // Element by element, found by name.
    for (const ComplianceShare& share : closed.shares) {
      const auto mine =
          std::find_if(result.shares.begin(), result.shares.end(),
                       [&](const ComplianceShare& r) { return r.element == share.element; });
      ASSERT_NE(mine, result.shares.end()) << share.element;
      EXPECT_LT((mine->C - share.C).norm(), 1e-10 * result.C.norm())
          << s.name << " " << share.element;
    }
  }
}

TEST(ElasticRobots, SharesAddUpAndAllAreSymmetricAndPositive) {
  for (const Subject& s : Subjects()) {
    const StiffnessResult result = FrameStiffness(s.mechanism, s.X_WB, s.output);
    Mat6 sum = Mat6::Zero();
    for (const ComplianceShare& share : result.shares) {
      sum += share.C;
      EXPECT_EQ((share.C - share.C.transpose()).norm(), 0.0) << share.element;
      EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(share.C).eigenvalues()[0],
                -64 * kEps * result.C.norm())
          << share.element;
    }
    EXPECT_LT(RelativeDifference(sum, result.C), 64 * kEps) << s.name;
    EXPECT_EQ((result.K - result.K.transpose()).norm(), 0.0);
    EXPECT_GT(Eigen::SelfAdjointEigenSolver<Mat6>(result.K).eigenvalues()[0], 0.0) << s.name;
    EXPECT_LT((result.K * result.C - Mat6::Identity()).cwiseAbs().maxCoeff(), 1e-8) << s.name;
  }
}

TEST(ElasticRobots, DoNotDependOnWhereTheyStand) {
  const Pose X(Eigen::Translation3d(3, -2, 5) * Eigen::Quaterniond(RotRpy({0.7, -1.1, 2.3})));
  for (const Subject& s : Subjects()) {
    Mechanism moved = s.mechanism;
    for (Joint& joint : moved.joints) {
      if (joint.parent == 0) joint.X_PF = X * joint.X_PF;
      if (joint.child == 0) joint.X_CM = X * joint.X_CM;
    }
    std::vector<Pose> X_WB = s.X_WB;
    for (size_t b = 1; b < X_WB.size(); ++b) X_WB[b] = X * X_WB[b];
    Mat6 turn = Mat6::Zero();
    turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = X.linear();
    const Mat6 C = FrameStiffness(s.mechanism, s.X_WB, s.output).C;
    const Mat6 C_moved = FrameStiffness(moved, X_WB, s.output).C;
    EXPECT_LT(RelativeDifference(C_moved, turn * C * turn.transpose()), kRobotAlgebra) << s.name;
  }
}

}  // namespace
}  // namespace mbv
