// Joint reactions of the closed forms of cabin and SCARA robot: by hand, and every component
// against the reference solver.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "analytic/cabin_robot/dynamics.h"
#include "analytic/closed_form.h"
#include "analytic/scara_robot/dynamics.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

ScenarioResult LoadedScenario(const std::string& scenario, const std::vector<SetValue>& set = {}) {
  ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/" + scenario), {.set = set});
  EXPECT_TRUE(loaded.scenario && loaded.mechanism) << loaded.diagnostics.Text();
  return loaded;
}

ClosedFormRun RunForm(const Mechanism& mechanism, const Motion& motion) {
  Diagnostics diagnostics;
  const auto form = FindClosedForm(mechanism.name)->factory(mechanism, motion, {}, &diagnostics);
  EXPECT_NE(form, nullptr) << diagnostics.Text();
  return RunClosedForm(mechanism, motion, form.get());
}

struct Difference {
  std::set<std::string> joints;
  int components = 0;
  double worst = 0.0;  // of the largest force, moments over 1 m
  std::string where;
};

// Reactions of the closed form, made from `analytic`, against the reference's.
Difference CompareReactions(const Mechanism& analytic, const Mechanism& reference,
                            const Motion& motion) {
  const ClosedFormRun form = RunForm(analytic, motion);
  EXPECT_TRUE(form.summary.ok()) << form.summary.message;
  const ReferenceRun truth = RunReference(reference, motion);
  EXPECT_TRUE(truth.summary.ok()) << truth.summary.message;
  Difference difference;
  double scale = 0.0;
  for (size_t k = 0; k < form.trace.channels.size(); ++k) {
    const Channel& channel = form.trace.channels[k];
    const size_t at = channel.name.find(".reaction.");
    if (at == std::string::npos) continue;
    const int other = truth.trace.Find(channel.name);
    EXPECT_GE(other, 0) << channel.name;
    if (other < 0) continue;
    EXPECT_EQ(channel.frame, truth.trace.channels[static_cast<size_t>(other)].frame);
    EXPECT_EQ(channel.unit, truth.trace.channels[static_cast<size_t>(other)].unit);
    difference.joints.insert(channel.name.substr(0, at));
    ++difference.components;
    const VecX own = form.trace.values.col(static_cast<Eigen::Index>(k));
    scale = std::max(scale, truth.trace.values.col(other).cwiseAbs().maxCoeff());
    const double d = (own - truth.trace.values.col(other)).cwiseAbs().maxCoeff();
    if (d > difference.worst || std::isnan(d)) {
      difference.worst = d;
      difference.where = channel.name;
    }
  }
  difference.worst /= scale;
  return difference;
}

// Loops close to 1e-13 of their size; the systems' condition is up to a few hundred.
constexpr double kAgreement = 1e-10;

TEST(CabinReactions, EveryComponentIsTheReferences) {
  for (const char* scenario : {"default.yaml", "wrench.yaml", "sliders.yaml"}) {
    const ScenarioResult loaded =
        LoadedScenario(std::string("cabin_robot/") + scenario, {{"motion.sample_s", "0.25"}});
    const Difference d =
        CompareReactions(*loaded.mechanism, *loaded.mechanism, loaded.scenario->motion);
    EXPECT_LT(d.worst, kAgreement) << scenario << " " << d.where;
    EXPECT_EQ(d.joints, (std::set<std::string>{"A", "B", "C", "D", "E", "F", "d1", "th3", "th4",
                                               "d5", "th6", "payload_mount"}));
    EXPECT_EQ(d.components, 6 * 2 + 5 * 5 + 6);
  }
}

TEST(CabinReactions, APerturbedLinkIsSeen) {
  const ScenarioResult loaded =
      LoadedScenario("cabin_robot/default.yaml", {{"motion.sample_s", "0.25"}});
  for (const char* name : {"m_CD", "c_EF_x", "I_AB_z", "m_payload", "I_slewing_z"}) {
    Mechanism perturbed = *loaded.mechanism;
    for (Parameter& p : perturbed.parameters) {
      if (p.name == name) p.value *= 1 + 1e-4;
    }
    EXPECT_GT(CompareReactions(perturbed, *loaded.mechanism, loaded.scenario->motion).worst,
              2 * kAgreement)
        << name;
  }
}

TEST(CabinReactions, StrutAndHingesOfAMasslessLinkageByHand) {
  // W at K, level: C carries W/2 along CD; B the rest; E the strut's compression.
  cabin_robot::CabinGeometry g;
  g.planar = {0.52, 0.42, 0.5, 0.28};
  g.gravity.setZero();
  cabin_robot::PlanarState s;
  s.X = {0.0, 0.0, 0.0};
  s.Y = {0.36, 0.0, 0.0};
  ASSERT_TRUE(cabin_robot::SolveInverse(g.planar, &s).ok());
  std::array<cabin_robot::FrameMotion, cabin_robot::kBodies> frames;
  cabin_robot::ComputeFrames(g, s, {}, &frames);
  cabin_robot::Demands demands = cabin_robot::DemandsOf(g, frames);
  constexpr double W = 981.0;
  cabin_robot::TakeOff({cabin_robot::kPlatform, Vec3::Zero(), Vec3(0, -W, 0), Vec3::Zero()}, frames,
                       &demands);
  const cabin_robot::HingeForces h = cabin_robot::HingeForcesOf(g, frames, demands);
  const double alpha = s.alpha.p, beta = s.beta.p, epsilon = s.epsilon.p;
  constexpr double kRoundoff = 1e-10;
  EXPECT_LT((h.C - W / 2 * Vec3(-1 / std::tan(beta), 1, 0)).norm(), kRoundoff);
  EXPECT_LT((h.B - W / 2 * Vec3(1 / std::tan(beta), 1, 0)).norm(), kRoundoff);
  const double N =
      W * (std::cos(alpha) - std::sin(alpha) / std::tan(beta)) / std::sin(alpha + epsilon);
  EXPECT_LT((h.E - N * Vec3(-std::cos(epsilon), std::sin(epsilon), 0)).norm(), kRoundoff);
}

TEST(ScaraReactions, EveryComponentIsTheReferences) {
  for (const char* scenario : {"pick_place.yaml", "tool_load.yaml", "default.yaml"}) {
    const ScenarioResult loaded =
        LoadedScenario(std::string("scara_robot/") + scenario, {{"motion.sample_s", "0.01"}});
    Motion motion = loaded.scenario->motion;
    motion.duration_s = std::min(motion.duration_s, 0.4);
    const Difference d = CompareReactions(*loaded.mechanism, *loaded.mechanism, motion);
    EXPECT_LT(d.worst, kAgreement) << scenario << " " << d.where;
    EXPECT_EQ(d.joints.size(), 4u + 2u + 2u * 2u);
    EXPECT_EQ(d.components, 3 * 10);
  }
}

TEST(ScaraReactions, APerturbedConstantIsSeen) {
  const ScenarioResult loaded =
      LoadedScenario("scara_robot/pick_place.yaml", {{"motion.sample_s", "0.01"}});
  for (const char* name : {"m_p", "m_rods", "m_arm", "pivot_mass", "I_p_z"}) {
    Mechanism perturbed = *loaded.mechanism;
    for (Parameter& p : perturbed.parameters) {
      if (p.name == name) p.value *= 1 + 1e-4;
    }
    EXPECT_GT(CompareReactions(perturbed, *loaded.mechanism, loaded.scenario->motion).worst,
              2 * kAgreement)
        << name;
  }
}

TEST(ScaraReactions, RodTensionsAtRestByHand) {
  // Half of each rod's weight goes to each end; force and yaw balance give the four tensions.
  const ScenarioResult loaded = LoadedScenario("scara_robot/static.yaml");
  const scara_robot::Parameters p = scara_robot::ParametersOf(*loaded.mechanism);
  scara_robot::Position position;
  ASSERT_TRUE(scara_robot::InversePosition(p, p.home_X, &position).ok());
  const auto forces = scara_robot::JointForces(p, position, {}, Vec3(0, 0, -5), 0.0);
  const double tension[] = {1.778764, 1.778764, 8.392258, 8.392258};
  const Vec3 half = 0.5 * p.m_rods * p.gravity_W;
  for (int i = 0; i < 4; ++i) {
    const Vec3 along = forces[size_t(i)].on_platform - half;
    EXPECT_NEAR(-along.dot(position.eta[size_t(i)]), tension[i], 1e-6) << i;
    EXPECT_LT(along.cross(position.eta[size_t(i)]).norm(), 1e-12) << i;
  }
}

// The bearing's force and the torque balance the arm: another way to (48).
TEST(ScaraReactions, TorquesFollowFromTheForcesOnTheArms) {
  const ScenarioResult loaded = LoadedScenario("scara_robot/pick_place.yaml");
  const scara_robot::Parameters p = scara_robot::ParametersOf(*loaded.mechanism);
  CommandSample command;
  for (const double share : {0.2, 0.5, 0.9}) {
    EvaluateMotion(loaded.scenario->motion, share * loaded.scenario->motion.duration_s, &command);
    ASSERT_EQ(command.position.size(), 4);
    scara_robot::Position position;
    scara_robot::Rates rates;
    ASSERT_TRUE(scara_robot::InversePosition(p, command.position, &position).ok());
    rates.dX = command.velocity;
    rates.ddX = command.acceleration;
    scara_robot::DriveRates(p, position, &rates);
    const Vec3 F(1, -2, -5);
    const auto forces = scara_robot::JointForces(p, position, rates, F, 0.1);
    const scara_robot::Vec4 M = scara_robot::DriveTorques(p, position, rates, F, 0.1);
    for (int i = 0; i < 4; ++i) {
      const Vec3 &u = position.u[size_t(i)], &a = scara_robot::MotorAxis(i);
      const double I = scara_robot::SolidBar(p.m_arm, p.arm_radius, p.l1).transverse;
      const Vec3 weight = p.m_arm * p.gravity_W;
      // I_A θ̈ = M + (COM × weight)·a − (l1 u × force on the rods)·a
      const double I_A = I + p.m_arm * p.arm_com * p.arm_com * p.l1 * p.l1;
      const double torque = I_A * rates.ddtheta[i] - p.arm_com * p.l1 * u.cross(weight).dot(a) +
                            p.l1 * u.cross(forces[size_t(i)].on_rods).dot(a);
      EXPECT_NEAR(torque, M[i], 1e-12 * M.cwiseAbs().maxCoeff()) << i;
    }
  }
}

}  // namespace
}  // namespace mbv
