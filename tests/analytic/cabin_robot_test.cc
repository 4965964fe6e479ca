// The cabin robot's closed form: hand-checkable cases first, then laws.
#include "analytic/cabin_robot/closed_form.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analytic/cabin_robot/dynamics.h"
#include "math/spatial.h"
#include "model_file/load_model.h"
#include "tests/support/source_dir.h"

namespace mbv::cabin_robot {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;

constexpr PlanarGeometry kLinks{0.520, 0.420, 0.500, 0.280};

Mechanism LoadCabin(std::map<std::string, double> overrides = {}) {
  LoadOptions options;
  options.overrides = std::move(overrides);
  LoadResult result = LoadModel(SourcePath("/models/cabin_robot/model.yaml"), options);
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return *result.mechanism;
}

Profile Law(double u0, double delta, double bump, double T = 6.0) {
  return {{ConstantTerm{u0}, CycloidStepTerm{0.0, T, delta}, BumpTerm{0.0, T, bump}}};
}

void Add(const std::string& name, const Profile& profile, Motion* motion) {
  motion->commands.push_back({name, {}, profile});
}

// The default motion: installing a cabinet with all eight drives.
Motion DefaultMotion() {
  Motion motion;
  motion.duration_s = 6.0;
  Add("d1", Law(0.20, 0.60, 0.0), &motion);
  Add("platform.x", Law(-0.06, 0.12, 0.03), &motion);
  Add("platform.y", Law(0.30, 0.08, 0.06), &motion);
  Add("platform.yaw", Law(-5 * kDeg, 9 * kDeg, 6 * kDeg), &motion);
  Add("th3", Law(90 * kDeg, -70 * kDeg, 0.0), &motion);
  Add("th4", Law(-70 * kDeg, 65 * kDeg, 0.0), &motion);
  Add("d5", Law(-0.08, -0.30, 0.04), &motion);
  Add("th6", Law(-30 * kDeg, 120 * kDeg, 20 * kDeg), &motion);
  return motion;
}

Motion HoldMotion(double X, double Y, double gamma) {
  Motion motion;
  Add("d1", Constant(0.5), &motion);
  Add("platform.x", Constant(X), &motion);
  Add("platform.y", Constant(Y), &motion);
  Add("platform.yaw", Constant(gamma), &motion);
  Add("th3", Constant(90 * kDeg), &motion);
  Add("th4", Constant(0.0), &motion);
  Add("d5", Constant(-0.2), &motion);
  Add("th6", Constant(0.0), &motion);
  return motion;
}

ClosedFormSample Evaluate(const Mechanism& mechanism, const Motion& motion, double t) {
  Diagnostics diagnostics;
  const auto form = cabin_robot::MakeClosedForm(mechanism, motion, {}, &diagnostics);
  EXPECT_NE(form, nullptr) << diagnostics.Text();
  CommandSample command;
  EvaluateMotion(motion, t, &command);
  ClosedFormSample sample;
  const RunSummary summary = form->Dynamics(command, &sample);
  EXPECT_TRUE(summary.ok()) << summary.message;
  return sample;
}

TEST(CabinRobot, PayloadAloneLoadsTheFlipAndTheSlide) {
  // 100 kg, 0.30 m out, th4 = 0: th4 torque −m g (a4 + d6 + 0.30), d5 force −m g.
  std::map<std::string, double> only_payload;
  for (const char* body : {"carriage", "sliderA", "sliderD", "sliderF", "AB", "CD", "EF",
                           "platform", "support", "flip", "table", "slewing"}) {
    only_payload["m_" + std::string(body)] = 1e-9;
    for (const char* axis : {"x", "y", "z"}) {
      only_payload["I_" + std::string(body) + "_" + axis] = 1e-9;
    }
  }
  only_payload["c_payload_x"] = 0.0;
  only_payload["c_payload_y"] = 0.0;
  const auto sample = Evaluate(LoadCabin(only_payload), HoldMotion(0.0, 0.36, 0.0), 0.0);
  EXPECT_NEAR(sample.force[kTh4], -353.16, 1e-6);
  EXPECT_NEAR(sample.force[kD5], -981.0, 1e-6);
}

TEST(CabinRobot, MasslessLinkageCarriesAPlatformLoadByHand) {
  // W at K, γ = 0: f2 = −(W/2) cot β; strut force N = W (cos α − sin α cot β)/sin(α+ε);
  // f3 = −N cos ε; f1 = −f2 − f3.
  Mechanism mechanism = LoadCabin({{"g", 0.0}});
  Motion motion = HoldMotion(0.0, 0.36, 0.0);
  Load load;
  load.name = "W";
  load.body = mechanism.FindBody("platform");
  load.force[1] = Constant(-981.0);
  motion.loads.push_back(load);
  const auto sample = Evaluate(mechanism, motion, 0.0);
  EXPECT_NEAR(sample.force[kX1], 513.826118, 1e-6);
  EXPECT_NEAR(sample.force[kX2], -472.769830, 1e-6);
  EXPECT_NEAR(sample.force[kX3], -41.056287, 1e-6);
  EXPECT_NEAR(sample.force.segment<3>(kX1).sum(), 0.0, 1e-10);
}

TEST(CabinRobot, DefaultMotionAtThreeSecondsMatchesTheCheckedNumbers) {
  const auto sample = Evaluate(LoadCabin(), DefaultMotion(), 3.0);
  const double q[] = {0.5,         -0.534134547, 0.510128744, -0.150855312,
                      0.959931089, -0.654498469, -0.19,       0.872664626};
  const double tau[] = {12.737042,  90.745588,   -1043.984748, 956.746470,
                        -74.681542, -112.634848, -860.138593,  25.048219};
  for (int d = 0; d < kDrives; ++d) {
    EXPECT_NEAR(sample.driven.position[d], q[d], 1e-9) << d;
    EXPECT_NEAR(sample.force[d], tau[d], 1e-6) << d;
  }
  EXPECT_NEAR(sample.extra[6], 0.225079905, 1e-9);
  EXPECT_NEAR(sample.extra[7], 0.869120137, 1e-9);
  EXPECT_NEAR(sample.extra[8], 0.158465590, 1e-9);
}

TEST(CabinRobot, ZeroGravityShowsTheInertiaTerms) {
  const auto sample = Evaluate(LoadCabin({{"g", 0.0}}), DefaultMotion(), 2.0);
  const double tau[] = {41.590579,  37.652981, 21.392282,  -40.960290,
                        -11.405846, -4.441989, -15.401294, 1.563732};
  for (int d = 0; d < kDrives; ++d) EXPECT_NEAR(sample.force[d], tau[d], 1e-6) << d;
  // One tenth of a percent of one link's inertia is far above these digits.
  const auto perturbed = Evaluate(LoadCabin({{"g", 0.0}, {"m_AB", 7.007}}), DefaultMotion(), 2.0);
  EXPECT_GT((perturbed.force - sample.force).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(CabinRobot, ForwardUndoesInverseWithBothDerivatives) {
  const Motion motion = DefaultMotion();
  for (double t = 0.1; t < 6.0; t += 0.37) {
    CommandSample c;
    EvaluateMotion(motion, t, &c);
    PlanarState inverse;
    inverse.X = {c.position[1], c.velocity[1], c.acceleration[1]};
    inverse.Y = {c.position[2], c.velocity[2], c.acceleration[2]};
    inverse.gamma = {c.position[3], c.velocity[3], c.acceleration[3]};
    ASSERT_TRUE(SolveInverse(kLinks, &inverse).ok());
    PlanarState forward;
    forward.X1 = inverse.X1;
    forward.X2 = inverse.X2;
    forward.X3 = inverse.X3;
    ASSERT_TRUE(SolveForward(kLinks, &forward).ok());
    constexpr double kTolerance = 256 * kEps;  // lengths, speeds and accelerations below 1
    EXPECT_NEAR(forward.X.p, inverse.X.p, kTolerance);
    EXPECT_NEAR(forward.Y.v, inverse.Y.v, kTolerance);
    EXPECT_NEAR(forward.gamma.a, inverse.gamma.a, kTolerance);
    EXPECT_NEAR(forward.beta.a, inverse.beta.a, kTolerance);
    EXPECT_NEAR(forward.epsilon.a, inverse.epsilon.a, kTolerance);
  }
}

TEST(CabinRobot, OnlySliderDMovingLeavesLinkABAtRest) {
  PlanarState s;
  s.X = {0.02, 0, 0};
  s.Y = {0.33, 0, 0};
  s.gamma = {0.05, 0, 0};
  ASSERT_TRUE(SolveInverse(kLinks, &s).ok());
  s.X1.v = 0.0;
  s.X3.v = 0.0;
  s.X2.v = 0.1;
  ASSERT_TRUE(SolveForward(kLinks, &s).ok());
  EXPECT_EQ(s.alpha.v, 0.0);
  EXPECT_EQ(s.epsilon.v, 0.0);
  EXPECT_NEAR(s.Y.v, 0.21 * s.gamma.v * std::cos(s.gamma.p), 1e-15);
  EXPECT_NEAR(s.X.v, -0.21 * s.gamma.v * std::sin(s.gamma.p), 1e-15);
  EXPECT_GT(std::abs(s.gamma.v), 0.01);
}

TEST(CabinRobot, StrutOfHalfTheLengthKeepsBAboveF) {
  PlanarGeometry links = kLinks;
  links.L4 = links.L1 / 2.0;
  PlanarState s;
  s.X = {0.04, 0, 0};
  s.Y = {0.31, 0, 0};
  s.gamma = {0.08, 0, 0};
  ASSERT_TRUE(SolveInverse(links, &s).ok());
  EXPECT_NEAR(s.epsilon.p, s.alpha.p, 1e-15);
  EXPECT_NEAR(s.X3.p, s.X.p - links.L2 / 2.0 * std::cos(s.gamma.p), 1e-15);
}

TEST(CabinRobot, MassMatrixIsSymmetricPositiveWithTheKnownSums) {
  const Mechanism mechanism = LoadCabin();
  CabinGeometry geometry;
  geometry.planar = kLinks;
  geometry.wrist = {0.0, 0.261, 0.485, 0.050, 0.010};
  for (int b = 0; b < kBodies; ++b) {
    const int index = mechanism.FindBody(std::array{"carriage", "sliderA", "sliderD", "sliderF",
                                                    "AB", "CD", "EF", "platform", "support", "flip",
                                                    "table", "slewing", "payload"}[b]);
    ASSERT_GE(index, 0);
    const Body& body = mechanism.bodies[index];
    geometry.bodies[b] = {body.mass, body.p_BoBcm_B, body.I_Bcm_B};
  }
  PlanarState s;
  s.X = {0.01, 0, 0};
  s.Y = {0.35, 0, 0};
  s.gamma = {0.03, 0, 0};
  ASSERT_TRUE(SolveInverse(kLinks, &s).ok());
  OuterDrives outer{{0.4, 0, 0}, {0.9, 0, 0}, {-0.4, 0, 0}, {-0.2, 0, 0}, {0.3, 0, 0}};
  std::array<FrameMotion, kBodies> frames;
  ComputeFrames(geometry, s, outer, &frames);
  const auto M = MassMatrix(geometry, frames);
  EXPECT_NEAR((M - M.transpose()).cwiseAbs().maxCoeff(), 0.0, 1e-12);
  EXPECT_NEAR(M(kRail, kRail), 377.6, 1e-10);
  EXPECT_NEAR((M.block<3, 3>(kX1, kX1).sum()), 227.6, 1e-10);
  EXPECT_GT(M.ldlt().vectorD().minCoeff(), 0.0);
}

TEST(CabinRobot, PowerBalancesAlongTheDefaultMotion) {
  // Σ τ q̇ = d/dt (T + U): integrate the power over the motion with Simpson's rule; start and end at
  // rest, so it must equal the change of potential energy.
  const Mechanism mechanism = LoadCabin();
  const Motion motion = DefaultMotion();
  constexpr int kIntervals = 1200;
  double work = 0.0;
  for (int i = 0; i <= kIntervals; ++i) {
    const auto sample = Evaluate(mechanism, motion, 6.0 * i / kIntervals);
    const double weight = (i == 0 || i == kIntervals) ? 1 : (i % 2 ? 4 : 2);
    work += weight * sample.force.dot(sample.driven.velocity.head<kDrives>());
  }
  work *= 6.0 / kIntervals / 3.0;
  // Static drive forces at both ends give the potential only through heights; take them from the
  // platform, payload and link heights of the model itself.
  Mechanism still = mechanism;
  const auto potential = [&](double t) {
    CommandSample c;
    EvaluateMotion(motion, t, &c);
    CabinGeometry g;
    g.planar = kLinks;
    g.wrist = {0.0, 0.261, 0.485, 0.050, 0.010};
    PlanarState s;
    s.X = {c.position[1], 0, 0};
    s.Y = {c.position[2], 0, 0};
    s.gamma = {c.position[3], 0, 0};
    EXPECT_TRUE(SolveInverse(kLinks, &s).ok());
    std::array<FrameMotion, kBodies> frames;
    ComputeFrames(g, s,
                  {{c.position[0], 0, 0},
                   {c.position[4], 0, 0},
                   {c.position[5], 0, 0},
                   {c.position[6], 0, 0},
                   {c.position[7], 0, 0}},
                  &frames);
    double U = 0.0;
    const char* names[] = {"carriage", "sliderA", "sliderD", "sliderF", "AB",      "CD",     "EF",
                           "platform", "support", "flip",    "table",   "slewing", "payload"};
    for (int b = 0; b < kBodies; ++b) {
      const Body& body = still.bodies[still.FindBody(names[b])];
      U += body.mass * 9.81 * (frames[b].p + frames[b].R * body.p_BoBcm_B).y();
    }
    return U;
  };
  EXPECT_NEAR(work, potential(6.0) - potential(0.0), 1e-7);
}

TEST(CabinRobot, UnreachableHeightNamesTheLinkAndTheMissingLength) {
  PlanarState s;
  s.Y = {0.60, 0, 0};
  const RunSummary summary = SolveInverse(kLinks, &s);
  EXPECT_EQ(summary.stop, Stop::kUnreachable);
  EXPECT_EQ(summary.where, "link AB");
  EXPECT_NEAR(summary.amount, 0.08, 1e-12);
}

TEST(CabinRobot, StrutInLineWithABIsSingular) {
  PlanarState s;  // Y = 0: α = ε = 0
  const RunSummary summary = SolveInverse(kLinks, &s);
  EXPECT_EQ(summary.stop, Stop::kSingular);
  EXPECT_EQ(summary.where, "strut EF");
}

// Fits commands that hold the tool's pose of another motion at t, with both derivatives.
CommandSample ToolCommandsOf(const Mechanism& mechanism, const Motion& joint_motion, double t) {
  const auto value = [&](double s) {
    const ClosedFormSample at = Evaluate(mechanism, joint_motion, s);
    Eigen::Matrix<double, 8, 1> v;  // tool pose, platform.yaw, d1
    v << at.extra.segment<6>(6), at.extra[5], at.driven.position[0];
    return v;
  };
  constexpr double h = 1e-3;
  CommandSample c;
  c.time_s = t;
  c.position = value(t);
  c.velocity = (45 * (value(t + h) - value(t - h)) - 9 * (value(t + 2 * h) - value(t - 2 * h)) +
                (value(t + 3 * h) - value(t - 3 * h))) /
               (60 * h);
  c.acceleration =
      (270 * (value(t + h) + value(t - h)) - 27 * (value(t + 2 * h) + value(t - 2 * h)) +
       2 * (value(t + 3 * h) + value(t - 3 * h)) - 490 * value(t)) /
      (180 * h * h);
  return c;
}

TEST(CabinRobot, ToolPoseWithGivenRailLeadsBackToTheSameDrives) {
  const Mechanism mechanism = LoadCabin();
  const Motion joint_motion = DefaultMotion();
  Motion tool_motion;
  for (const char* name : {"tool.x", "tool.y", "tool.z", "tool.roll", "tool.pitch", "tool.yaw",
                           "platform.yaw", "d1"}) {
    Add(name, Constant(0.0), &tool_motion);
  }
  Diagnostics diagnostics;
  const auto form = cabin_robot::MakeClosedForm(mechanism, tool_motion, {}, &diagnostics);
  ASSERT_NE(form, nullptr) << diagnostics.Text();
  for (double t : {1.1, 2.0, 3.3}) {
    const ClosedFormSample truth = Evaluate(mechanism, joint_motion, t);
    ClosedFormSample sample;
    const RunSummary summary = form->Dynamics(ToolCommandsOf(mechanism, joint_motion, t), &sample);
    ASSERT_TRUE(summary.ok()) << summary.message;
    // Differences of the pose: 1e-12 in rates, 1e-9 in accelerations; forces scale with 377 kg.
    for (int d = 0; d < kDrives; ++d) {
      EXPECT_NEAR(sample.driven.position[d], truth.driven.position[d], 1e-12) << d;
      EXPECT_NEAR(sample.driven.velocity[d], truth.driven.velocity[d], 1e-10) << d;
      EXPECT_NEAR(sample.driven.acceleration[d], truth.driven.acceleration[d], 1e-7) << d;
      EXPECT_NEAR(sample.force[d], truth.force[d], 1e-4) << d;
    }
  }
}

TEST(CabinRobot, AMotionThatCommandsHalfOfASetIsExplained) {
  Motion motion = HoldMotion(0.0, 0.36, 0.0);
  motion.commands.erase(motion.commands.begin() + 3);
  Diagnostics diagnostics;
  EXPECT_EQ(cabin_robot::MakeClosedForm(LoadCabin(), motion, {}, &diagnostics), nullptr);
  EXPECT_NE(diagnostics.Text().find("platform.yaw"), std::string::npos);
}

}  // namespace
}  // namespace mbv::cabin_robot
