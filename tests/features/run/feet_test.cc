// Feet on the ground: what the ground bears, by hand and by the ZMP formula, and when it cannot.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/files.h"
#include "comparison/contact_load.h"
#include "features/run/default_setup.h"
#include "features/run/run_scenario.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "reference/reference.h"
#include "report/report.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/check_file.h"
#include "verify/model_text.h"

namespace mbv {
namespace {

using Limit = ContactLoad::Limit;

constexpr double kGravity = 9.81;

std::string Fixture(const std::string& name) {
  return ReadWholeFile(SourcePath("/tests/mechanisms/" + name + ".yaml")).value_or("");
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  if (at != std::string::npos) text.replace(at, from.size(), to);
  return text;
}

// The trunk of standing_slider at x = A sin ωt, z = z_0 + B sin νt.
struct Slides {
  double A = 0.015, omega = 2.0 * std::numbers::pi / 0.8;
  double B = 0.01, nu = 2.0 * std::numbers::pi / 0.5;
  [[nodiscard]] std::string Commands() const {
    return fmt::format(
        "{{x: {{sine: {{amplitude: {}, frequency_hz: {}}}}}, z: {{sine: {{amplitude: {}, "
        "frequency_hz: {}}}}}}}",
        A, omega / (2.0 * std::numbers::pi), B, nu / (2.0 * std::numbers::pi));
  }
};

// What the ground bears, worked out by hand: Newton's law, and the moment about the middle of the
// sole. Trunk at (x, s, h + z), its centre; the foot's centre at (0.01, 0, 0.05).
struct ByHand {
  double N, f_x, c_x, c_y, lever;

  ByHand(const Slides& motion, double t, double shift = 0.0) {
    constexpr double m = 20.0, m_foot = 4.0, h = 0.8, s = 0.02;
    const double x = shift + motion.A * std::sin(motion.omega * t);
    const double a_x = -motion.A * motion.omega * motion.omega * std::sin(motion.omega * t);
    const double z = h + motion.B * std::sin(motion.nu * t);
    const double a_z = -motion.B * motion.nu * motion.nu * std::sin(motion.nu * t);
    N = m_foot * kGravity + m * (kGravity + a_z);
    f_x = m * a_x;
    c_x = (m_foot * kGravity * 0.01 + m * (kGravity + a_z) * x - m * a_x * z) / N;
    c_y = m * (kGravity + a_z) * s / N;
    lever = std::abs(m * a_x * (c_y - s)) / N;
  }
};

class Feet : public testing::Test {
 protected:
  [[nodiscard]] std::string Write(const std::string& model, const std::string& commands,
                                  const std::string& more = "", double duration_s = 0.8) const {
    (void)folder_.Write("model.yaml", model);
    return folder_.Write("scenario.yaml",
                         fmt::format("mechanism: ./model.yaml\nanalytic: none\nmotion: "
                                     "{{duration_s: {}, sample_s: 0.01, commands: {}}}\n{}",
                                     duration_s, commands, more));
  }
  [[nodiscard]] RunOutcome Run(const std::string& model, const std::string& commands,
                               std::vector<SetValue> set = {}, const std::string& more = "") const {
    RunOptions options;
    options.pictures = false;
    options.out_dir = "";
    options.scenario.set = std::move(set);
    return RunScenario(Write(model, commands, more), options);
  }

  const test::TestFolder folder_{"feet"};
};

const ContactLoad* LoadOf(const RunOutcome& outcome, const std::string& witness,
                          const std::string& contact) {
  for (const ContactLoad& load : outcome.report->contact_loads) {
    if (load.witness == witness && load.contact == contact) return &load;
  }
  return nullptr;
}

std::vector<std::string> ContactCaveatsOf(const RunOutcome& outcome) {
  std::vector<std::string> texts;
  for (const Caveat& caveat : outcome.report->comparison.caveats) {
    if (caveat.kind == CaveatKind::kContact) texts.push_back(caveat.text);
  }
  return texts;
}

bool Exceeds(const RunOutcome& outcome, Limit limit) {
  const ContactLoad* load = LoadOf(outcome, "reference", "sole");
  const ContactLoad::Use* use = load == nullptr ? nullptr : load->Find(limit);
  return use != nullptr && use->exceeded();
}

TEST_F(Feet, TheGroundBearsWhatNewtonsLawSays) {
  const Slides motion;
  for (const auto& [mode, tolerance] : {std::pair("inverse", 1e-9), {"forward", 1e-5}}) {
    const RunOutcome outcome =
        Run(Fixture("standing_slider"), motion.Commands(), {{"simulation.mode", mode}});
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    EXPECT_EQ(outcome.exit_code, 0) << ToTable(*outcome.report, {});
    for (const char* witness : {"reference", "simulated"}) {
      const ContactLoad* load = LoadOf(outcome, witness, "sole");
      ASSERT_NE(load, nullptr) << witness;
      EXPECT_TRUE(load->unique());
      ASSERT_EQ(load->pressure.size(), 81U);
      double friction = 0.0, least = INFINITY, lever = 0.0, inside = INFINITY;
      for (size_t i = 0; i < load->pressure.size(); ++i) {
        const ByHand hand(motion, 0.01 * static_cast<double>(i));
        EXPECT_NEAR(load->pressure[i].x(), hand.c_x, tolerance) << witness << i;
        EXPECT_NEAR(load->pressure[i].y(), hand.c_y, tolerance) << witness << i;
        friction = std::max(friction, std::abs(hand.f_x) / hand.N);
        least = std::min(least, hand.N);
        lever = std::max(lever, hand.lever);
        inside = std::min({inside, 0.12 - std::abs(hand.c_x), 0.06 - std::abs(hand.c_y)});
      }
      EXPECT_NEAR(load->Find(Limit::kSlip)->worst, friction, tolerance) << witness;
      EXPECT_NEAR(load->Find(Limit::kLift)->worst, least, 100 * tolerance) << witness;
      EXPECT_NEAR(load->Find(Limit::kTip)->worst, inside, tolerance) << witness;
      EXPECT_NEAR(load->Find(Limit::kTwist)->worst, lever, tolerance) << witness;
    }
  }
}

TEST_F(Feet, AMassMovedByAMillimetreMovesTheCentreOfPressureByItsShare) {
  const Slides motion;
  const RunOutcome moved = Run(
      Replaced(Fixture("standing_slider"), "com: [0, side, height]", "com: [0.001, side, height]"),
      motion.Commands());
  ASSERT_TRUE(moved.report) << moved.diagnostics.Text();
  const ContactLoad* load = LoadOf(moved, "reference", "sole");
  ASSERT_NE(load, nullptr);
  const ByHand before(motion, 0.0), after(motion, 0.0, 0.001);
  EXPECT_NEAR(after.c_x - before.c_x, 0.001 * 20.0 / 24.0, 1e-12);
  EXPECT_NEAR(load->pressure[0].x(), after.c_x, 1e-10);
  EXPECT_GT(std::abs(load->pressure[0].x() - before.c_x), 8e-4);
}

// Each limit a ten-thousandth inside and outside what the motion needs.
TEST_F(Feet, EachLimitIsExceededJustBeyondWhatTheMotionNeeds) {
  const Slides motion;
  const std::string model = Fixture("standing_slider");
  const RunOutcome outcome = Run(model, motion.Commands());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const ContactLoad* load = LoadOf(outcome, "reference", "sole");
  ASSERT_NE(load, nullptr);
  double reach = 0.0;
  for (const Eigen::Vector2d& c : load->pressure) reach = std::max(reach, std::abs(c.x()));
  struct Case {
    Limit limit;
    const char* parameter;
    double needed;
  };
  const Case cases[] = {{Limit::kSlip, "friction", load->Find(Limit::kSlip)->worst},
                        {Limit::kTwist, "torsion", load->Find(Limit::kTwist)->worst},
                        {Limit::kTip, "length", 2.0 * reach}};
  for (const Case& with : cases) {
    for (const double factor : {1.0 - 1e-4, 1.0 + 1e-4}) {
      const RunOutcome run = Run(
          model, motion.Commands(),
          {{std::string("parameters.") + with.parameter, fmt::format("{}", factor * with.needed)},
           {"simulation.mode", "inverse"}});
      ASSERT_TRUE(run.report) << run.diagnostics.Text();
      EXPECT_EQ(run.exit_code, 0);  // a caveat, no disagreement
      EXPECT_EQ(Exceeds(run, with.limit), factor < 1.0) << with.parameter << " " << factor;
      EXPECT_EQ(ContactCaveatsOf(run).size(), factor < 1.0 ? 1U : 0U) << with.parameter;
    }
  }
}

// N = m_foot g + m (g − B ν²) at its least.
// Rounding is no force: on ice a robot at rest stands.
TEST_F(Feet, AtRestNoFrictionIsNeeded) {
  for (const char* mode : {"inverse", "forward"}) {
    const RunOutcome run =
        Run(Fixture("standing_slider"), "{x: 0.01, z: 0}",
            {{"parameters.friction", "0"}, {"parameters.torsion", "0"}, {"simulation.mode", mode}});
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    EXPECT_TRUE(ContactCaveatsOf(run).empty()) << ContactCaveatsOf(run).front();
  }
}

TEST_F(Feet, ItLiftsWhereTheGroundWouldHaveToPull) {
  for (const double factor : {1.0 - 1e-6, 1.0 + 1e-6}) {
    Slides motion{.A = 0.0};
    motion.B = factor * (1.0 + 4.0 / 20.0) * kGravity / (motion.nu * motion.nu);
    // The crest at 0.125 s is a sample only every 5 ms.
    const RunOutcome run =
        Run(Fixture("standing_slider"), motion.Commands(), {{"motion.sample_s", "0.005"}});
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    EXPECT_EQ(Exceeds(run, Limit::kLift), factor > 1.0) << factor;
  }
}

// Of a body at rest on a slope, the friction needed is the slope's tangent, whatever its mass.
TEST_F(Feet, OnASlopeTheFrictionNeededIsItsTangent) {
  for (const double slope : {0.0, 0.2, 0.5}) {
    const std::string model =
        Replaced(Fixture("standing_slider"), "kind: sole,",
                 fmt::format("kind: sole, normal: [{}, 0, {}],", std::sin(slope), std::cos(slope)));
    const RunOutcome run = Run(model, "{x: 0, z: 0}");
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    for (const char* witness : {"reference", "simulated"}) {
      const ContactLoad* load = LoadOf(run, witness, "sole");
      ASSERT_NE(load, nullptr);
      EXPECT_NEAR(load->Find(Limit::kSlip)->worst, std::tan(slope), 1e-9) << slope;
      EXPECT_NEAR(load->Find(Limit::kLift)->worst, 24.0 * kGravity * std::cos(slope), 1e-7);
    }
  }
}

// The same place, stated and found.
TEST_F(Feet, AStatedPlaceOnTheGroundIsTheOneWhereTheFootStands) {
  const Slides motion;
  const std::string stated =
      Replaced(Fixture("standing_slider"), "kind: sole,", "to: world.spot, kind: sole,") +
      "world: {frames: {spot: [0, 0, 0]}}\n";
  const RunOutcome a = Run(Fixture("standing_slider"), motion.Commands());
  const RunOutcome b = Run(stated, motion.Commands());
  ASSERT_TRUE(a.report && b.report) << b.diagnostics.Text();
  EXPECT_EQ(LoadOf(a, "reference", "sole")->Find(Limit::kTip)->worst,
            LoadOf(b, "reference", "sole")->Find(Limit::kTip)->worst);
}

// A line bears no moment about itself, so what it carries must balance on it; three points bear
// what a sole does. The trunk of 20 kg stands on its own feet.
TEST_F(Feet, PointsAndLinesBearForcesInBalance) {
  const std::string table = R"(
name: table
bodies:
  top: {mass: 12, com: [0.05, 0.02, 0.6], inertia: [1, 1, 1], frames: {a: [0.3, 0, 0], b: [-0.2, 0.25, 0], c: [-0.2, -0.25, 0]}}
  load: {mass: 3, com: [0, 0, 0.1], inertia: [0.1, 0.1, 0.1]}
joints:
  float: {kind: free, parent: world, child: top}
  slide: {kind: prismatic, parent: top, child: load, axis: x}
drives: {x: {kind: joint, joint: slide}}
contacts: {a: {on: top.a, kind: point, friction: 0.5}, b: {on: top.b, kind: point, friction: 0.5}, c: {on: top.c, kind: point, friction: 0.5}}
)";
  const RunOutcome run = Run(table, "{x: {sine: {amplitude: 0.1, period_s: 0.8}}}");
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
  // Normal forces at t = 0 by lever arms; what the points share along the ground stays open.
  const double W = 12.0 * kGravity, w = 3.0 * kGravity;
  const double a = (W * 0.25 + w * 0.2) / 0.5;
  const ContactLoad* all = LoadOf(run, "reference", "");
  ASSERT_NE(all, nullptr);
  EXPECT_NEAR(all->mean_normal, W + w, 1e-9);
  EXPECT_NEAR(all->pressure[0].x() + 0.3, 0.05 * W / (W + w), 1e-10);
  EXPECT_NEAR(all->pressure[0].y(), 0.02 * W / (W + w), 1e-10);
  EXPECT_FALSE(LoadOf(run, "reference", "a")->unique());
  EXPECT_TRUE(all->unique());
  const WitnessRecord* record = nullptr;
  for (const WitnessRecord& each : run.report->witnesses) {
    if (each.name == "reference") record = &each;
  }
  ASSERT_NE(record, nullptr);
  EXPECT_NEAR(record->trace.values(0, record->trace.Find("a.reaction.fz")), a, 1e-9);
}

// Two skis: what each is pressed with follows from lever arms across them, what they share along
// themselves does not.
TEST_F(Feet, TwoLinesBearWhatLeverArmsSay) {
  const std::string skis = R"(
name: skis
bodies:
  top: {mass: 12, com: [0.03, 0.05, 0.6], inertia: [1, 1, 1], frames: {a: [0, 0.2, 0], b: [0, -0.2, 0]}}
  load: {mass: 3, com: [0, 0, 0.1], inertia: [0.1, 0.1, 0.1]}
joints:
  float: {kind: free, parent: world, child: top}
  slide: {kind: prismatic, parent: top, child: load, axis: y}
drives: {y: {kind: joint, joint: slide}}
contacts: {a: {on: top.a, kind: line, length: 0.5, friction: 0.5}, b: {on: top.b, kind: line, length: 0.5, friction: 0.5}}
)";
  const RunOutcome run = Run(skis, "{y: {sine: {amplitude: 0.05, period_s: 0.8}}}");
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
  const double W = 12.0 * kGravity, w = 3.0 * kGravity;
  for (const char* witness : {"reference", "simulated"}) {
    const ContactLoad *a = LoadOf(run, witness, "a"), *all = LoadOf(run, witness, "");
    ASSERT_TRUE(a != nullptr && all != nullptr);
    EXPECT_TRUE(a->Find(Limit::kLift)->unique);
    EXPECT_FALSE(a->Find(Limit::kTip)->unique);
    // The load's moment about the line of b, at rest in the middle and at its crests.
    const double omega = 2.0 * std::numbers::pi / 0.8, y = 0.05, a_y = omega * omega * y;
    const double least = (W * 0.25 + w * (0.2 - y) - 3.0 * a_y * 0.1) / 0.4;
    EXPECT_NEAR(a->Find(Limit::kLift)->worst, least, 1e-5) << witness;
    EXPECT_NEAR(all->pressure[0].x(), 0.03 * W / (W + w), 1e-8) << witness;
    EXPECT_NEAR(all->pressure[0].y() + 0.2, 0.05 * W / (W + w), 1e-8) << witness;
  }
}

TEST_F(Feet, ALineBearsNoMomentAboutItself) {
  const Slides motion{.B = 0.0};
  const std::string model =
      Replaced(Replaced(Fixture("standing_slider"), "kind: sole, length: length, width: width,",
                        "kind: line, length: length,"),
               "com: [0, side, height]", "com: [0, 0, height]");
  // No drive holds the rotation about the line: it needs a command.
  const std::string file = Write(model, motion.Commands());
  EXPECT_NE(CheckFile(file).Text().find("3 degrees of freedom"), std::string::npos)
      << CheckFile(file).Text();
}

TEST_F(Feet, LiftedFeetDoNotHold) {
  const std::string commands =
      "{pelvis.x: {sine: {amplitude: 0.01, period_s: 0.8}}, pelvis.y: home, pelvis.z: home, "
      "pelvis.roll: 0, pelvis.pitch: 0, pelvis.yaw: 0, right.yaw_m: home, right.roll_m: home, "
      "right.pitch_m: home, right.knee_m: home, right.ankle_pitch_m: home, right.ankle_roll_m: "
      "home}";
  const RunOutcome run = Run(Fixture("biped"), commands, {}, "contacts: [left.sole]\n");
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
  EXPECT_EQ(LoadOf(run, "reference", "right.sole"), nullptr);
  const ContactLoad* left = LoadOf(run, "reference", "left.sole");
  ASSERT_NE(left, nullptr);
  EXPECT_TRUE(left->unique());
  EXPECT_NEAR(left->mean_normal, 48.0 * kGravity, 0.5);
  // The pelvis stands between its feet, not over the left one.
  EXPECT_TRUE(left->Find(Limit::kTip)->exceeded());
  EXPECT_EQ(ContactCaveatsOf(run).size(), 1U);

  const std::string flight = Write(Fixture("biped"), commands, "contacts: []\n");
  EXPECT_NE(CheckFile(flight).Text().find("all feet are lifted"), std::string::npos)
      << CheckFile(flight).Text();
  const std::string wrong = Write(Fixture("biped"), commands, "contacts: [left.sol]\n");
  EXPECT_NE(CheckFile(wrong).Text().find("biped has no contact 'left.sol'"), std::string::npos)
      << CheckFile(wrong).Text();
}

// Zero-moment point of all bodies [Vukobratović, Borovac 2004] by the poses and accelerations of
// the reference alone: c = (n × M_O)/(n·F) of the rate of momentum less weight.
TEST_F(Feet, BothFeetTogetherBearTheRateOfMomentum) {
  const std::string commands =
      "{pelvis.x: {sine: {amplitude: 0.03, period_s: 0.8}}, pelvis.y: {sine: {amplitude: 0.04, "
      "period_s: 0.8}}, pelvis.z: [home, {bump: {start_s: 0, duration_s: 0.8, height: -0.03}}], "
      "pelvis.roll: 0, pelvis.pitch: {sine: {amplitude: 0.05, period_s: 0.8}}, pelvis.yaw: 0}";
  for (const char* mode : {"inverse", "forward"}) {
    const RunOutcome run = Run(Fixture("biped"), commands, {{"simulation.mode", mode}});
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
    EXPECT_EQ(run.report->drives_not_unique.size(), 12U);

    const ScenarioResult loaded = LoadScenario(Write(Fixture("biped"), commands));
    ASSERT_TRUE(loaded.mechanism);
    const Mechanism& m = *loaded.mechanism;
    ReferenceSolver solver(m, loaded.scenario->motion);
    for (const char* witness : {"reference", "simulated"}) {
      const ContactLoad* all = LoadOf(run, witness, "");
      ASSERT_NE(all, nullptr);
      ASSERT_EQ(all->pressure.size(), 81U);
      EXPECT_TRUE(all->unique());
      EXPECT_FALSE(LoadOf(run, witness, "left.sole")->unique());
      const Pose& X_WF = m.joints[static_cast<size_t>(m.FindJoint("left.sole"))].X_PF;
      CommandSample command;
      ReferenceSample sample;
      for (size_t i = 0; i < 81; ++i) {
        EvaluateMotion(loaded.scenario->motion, 0.01 * static_cast<double>(i), &command);
        ASSERT_TRUE(solver.Kinematics(command, &sample).ok());
        Vec3 force = Vec3::Zero(), moment = Vec3::Zero();  // about F's origin
        for (size_t b = 1; b < m.bodies.size(); ++b) {
          const Body& body = m.bodies[b];
          const Mat3 R = sample.states.X_WB[b].linear();
          const Vec3 w = sample.states.V_WB[b].head<3>(), e = sample.states.A_WB[b].head<3>();
          const Vec3 r = R * body.p_BoBcm_B;
          const Vec3 a = sample.states.A_WB[b].tail<3>() + e.cross(r) + w.cross(w.cross(r));
          const Mat3 I = R * body.I_Bcm_B * R.transpose();
          const Vec3 f = body.mass * (a - m.gravity_W);
          force += f;
          moment += (sample.states.X_WB[b].translation() + r - X_WF.translation()).cross(f) +
                    I * e + w.cross(I * w);
        }
        const double tolerance = std::string(mode) == "inverse" ? 1e-9 : 1e-5;
        EXPECT_NEAR(all->pressure[i].x(), -moment.y() / force.z(), tolerance) << witness << i;
        EXPECT_NEAR(all->pressure[i].y(), moment.x() / force.z(), tolerance) << witness << i;
      }
    }
  }
}

TEST_F(Feet, WhatFeetShareIsMarkedAndWhatTheyBearTogetherIsNot) {
  const RunOutcome run = Run(Fixture("biped"),
                             "{pelvis.x: {sine: {amplitude: 0.01, period_s: 0.8}}, pelvis.y: home, "
                             "pelvis.z: home, pelvis.roll: 0, pelvis.pitch: 0, pelvis.yaw: 0}",
                             {{"parameters.friction", "0.001"}, {"simulation.mode", "inverse"}});
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 0);
  size_t marked = 0, together = 0;
  for (const std::string& caveat : ContactCaveatsOf(run)) {
    const bool shared = caveat.find("one share of many") != std::string::npos;
    const bool all = caveat.starts_with("all feet together slip:");
    EXPECT_NE(shared, all) << caveat;
    marked += shared ? 1 : 0;
    together += all ? 1 : 0;
  }
  EXPECT_EQ(marked, 2U);
  EXPECT_EQ(together, 1U);
}

// On two lines at different heights everything happens in one plane: with T on the upper line the
// other forces follow, and one search over T gives the least friction.
class Stairs : public Feet {
 protected:
  static constexpr double kDepth = 0.4, kStep = 0.15, kMiddle = 0.2, kAmplitude = 0.1;

  [[nodiscard]] static std::string Model(double friction, double com_x) {
    return fmt::format(R"(
name: stairs
bodies:
  top: {{mass: 12, com: [{}, 0, 0.6], inertia: [1, 1, 1], frames: {{a: [0, 0, 0], b: [-{}, 0, {}]}}}}
  load: {{mass: 3, com: [0, 0, 0.5], inertia: [0.1, 0.1, 0.1]}}
joints:
  float: {{kind: free, parent: world, child: top}}
  slide: {{kind: prismatic, parent: top, child: load, axis: x}}
drives: {{x: {{kind: joint, joint: slide}}}}
contacts:
  a: {{on: top.a, kind: line, axis: [0, 1, 0], length: 0.5, friction: {}}}
  b: {{on: top.b, kind: line, axis: [0, 1, 0], length: 0.5, friction: {}}}
)",
                       com_x, kDepth, kStep, friction, friction);
  }
  [[nodiscard]] static std::string Commands(double period_s) {
    return fmt::format("{{x: {{sine: {{amplitude: {}, period_s: {}}}}}}}", kAmplitude, period_s);
  }
  // Needed at t, infinite where the lines would have to pull.
  [[nodiscard]] static double NeededByHand(double t, double period_s, double com_x) {
    const double omega = 2.0 * std::numbers::pi / period_s;
    const double x = kAmplitude * std::sin(omega * t);
    const double F = -3.0 * omega * omega * x, N = 15.0 * kGravity;
    // About a's line: M = Σ z F_x − x F_z.
    const double M = 0.5 * F - x * 3.0 * kGravity - com_x * 12.0 * kGravity;
    const auto needed = [&](double T) {
      const double N_b = (M - kStep * T) / kDepth;
      return std::max(std::abs(T) / N_b, std::abs(F - T) / (N - N_b));
    };
    // Both push between these; the larger of two such quotients has one minimum.
    double low = (M - kDepth * N) / kStep + 1e-6, high = M / kStep - 1e-6;
    for (int i = 0; i < 200; ++i) {
      const double third = (high - low) / 3.0;
      if (needed(low + third) < needed(high - third)) {
        high -= third;
      } else {
        low += third;
      }
    }
    return needed(low);
  }
};

TEST_F(Stairs, FeetAtDifferentHeightsAreJudgedTogether) {
  for (const double period_s : {1.0, 0.6}) {
    double most = 0.0;
    for (int i = 0; i <= 80; ++i) {
      most = std::max(most, NeededByHand(0.01 * i, period_s, -kMiddle));
    }
    ASSERT_TRUE(std::isfinite(most));
    for (const double share : {0.99, 1.01}) {
      const RunOutcome run = Run(Model(share * most, -kMiddle), Commands(period_s));
      ASSERT_TRUE(run.report) << run.diagnostics.Text();
      EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
      for (const char* witness : {"reference", "simulated"}) {
        const ContactLoad* all = LoadOf(run, witness, "");
        ASSERT_NE(all, nullptr) << witness;
        const ContactLoad::Use* fall = all->Find(Limit::kFall);
        ASSERT_NE(fall, nullptr);
        EXPECT_GE(fall->worst, 0.999 / share) << witness;
        EXPECT_LE(fall->worst, 1.006 / share) << witness;
        EXPECT_NEAR(NeededByHand(fall->time_s, period_s, -kMiddle), most, 1e-3 * most);
        EXPECT_EQ(fall->exceeded(), share < 1.0) << witness;
      }
      const auto caveats = ContactCaveatsOf(run);
      const auto together = std::ranges::count_if(caveats, [](const std::string& text) {
        return text.starts_with("all feet together fall");
      });
      EXPECT_EQ(together, share < 1.0 ? 1 : 0);
    }
  }
}

// The load is thrown up and down: where it falls faster than all weigh, no friction helps.
TEST_F(Stairs, GroundThatWouldHaveToPullHoldsWithNoFriction) {
  for (const double period_s : {0.6, 0.2}) {
    const RunOutcome run =
        Run(Replaced(Model(5.0, -kMiddle), "child: load, axis: x", "child: load, axis: z"),
            Commands(period_s));
    ASSERT_TRUE(run.report) << run.diagnostics.Text();
    const ContactLoad* all = LoadOf(run, "reference", "");
    ASSERT_NE(all, nullptr);
    const ContactLoad::Use* fall = all->Find(Limit::kFall);
    ASSERT_NE(fall, nullptr);
    EXPECT_EQ(std::isinf(fall->worst), period_s < 0.5);
    EXPECT_EQ(fall->exceeded(), period_s < 0.5);
  }
}

TEST_F(Feet, AWrittenModelReadsBackToTheSameContacts) {
  const LoadResult loaded = LoadModelText(Fixture("biped"), "biped.yaml");
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  const LoadResult again = LoadModelText(WriteModel(*loaded.mechanism), "again.yaml");
  ASSERT_TRUE(again.mechanism) << again.diagnostics.Text();
  const Mechanism &a = *loaded.mechanism, &b = *again.mechanism;
  ASSERT_EQ(b.contacts.size(), 2U);
  EXPECT_EQ(CountDofs(b), 6);
  for (size_t k = 0; k < 2; ++k) {
    ASSERT_GE(b.contacts[k].joint, 0);
    const Joint& x = a.joints[static_cast<size_t>(a.contacts[k].joint)];
    const Joint& y = b.joints[static_cast<size_t>(b.contacts[k].joint)];
    EXPECT_EQ(x.X_PF.matrix(), y.X_PF.matrix());
    EXPECT_EQ(x.X_CM.matrix(), y.X_CM.matrix());
    EXPECT_TRUE(y.closure);
    EXPECT_EQ(a.contacts[k].friction, b.contacts[k].friction);
    EXPECT_EQ(a.contacts[k].outline, b.contacts[k].outline);
  }
}

TEST_F(Feet, FaultsOfAContactAreFoundAtTheirPlace) {
  const std::string model = Fixture("standing_slider");
  const size_t at = model.find("  sole: {");
  const std::pair<const char*, const char*> cases[] = {
      {"{kind: sole}", "'on' is missing"},
      {"{on: feet}", "there is no body 'feet'"},
      {"{on: world}", "is the world"},
      {"{on: foot, kind: heel}", "kind"},
      {"{on: foot, friction: -0.1}", "violates friction >= 0"},
      {"{on: foot, torsion: -1}", "violates torsion >= 0"},
      {"{on: foot, kind: point, torsion: 1}", "a point bears no moment"},
      {"{on: foot, kind: point, length: 1}", "a point has none"},
      {"{on: foot, kind: line, width: 1}", "only a sole has one"},
      {"{on: foot, length: 0.2}", "a length and a width, or an outline"},
      {"{on: foot, length: 0, width: 1}", "violates length > 0"},
      {"{on: foot, outline: [[0, 0], [1, 0], [2, 0]]}", "encloses no area"},
      {"{on: foot, outline: [[0, 0], [1]]}", "outline[1]"},
      {"{on: foot, axis: z}", "points into the ground"},
      {"{on: foot, to: foot}", "is on the foot itself"},
      {"{on: foot, to: world.spot, normal: z}", "spot"},
      {"{on: foot, fricton: 1}", "friction"},
  };
  for (const auto& [contact, finding] : cases) {
    const LoadResult loaded =
        LoadModelText(model.substr(0, at) + "  sole: " + contact + "\n", "model.yaml");
    EXPECT_FALSE(loaded.mechanism) << contact;
    EXPECT_NE(loaded.diagnostics.Text().find(finding), std::string::npos)
        << contact << ":\n"
        << loaded.diagnostics.Text();
    EXPECT_NE(loaded.diagnostics.Text().find("model.yaml:23:"), std::string::npos)
        << loaded.diagnostics.Text();
  }
  const LoadResult twice = LoadModelText(model + "  along: {on: foot}\n", "model.yaml");
  EXPECT_NE(twice.diagnostics.Text().find("there is a joint 'along' already"), std::string::npos);
}

// A trunk that carries its foot on two slides, in each format; the trunk is the root.
const char* const kUrdf = R"(<robot name="hopper">
  <link name="trunk"><inertial><origin xyz="0 0.02 0.8"/><mass value="20"/><inertia ixx="1.2" iyy="1.1" izz="0.4" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="carriage"><inertial><mass value="1"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <link name="foot"><inertial><origin xyz="0.01 0 0.05"/><mass value="4"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="up" type="prismatic"><parent link="trunk"/><child link="carriage"/><axis xyz="0 0 1"/><limit lower="-0.1" upper="0.1" effort="500" velocity="5"/></joint>
  <joint name="along" type="prismatic"><parent link="carriage"/><child link="foot"/><axis xyz="1 0 0"/><limit lower="-0.1" upper="0.1" effort="500" velocity="5"/></joint>
</robot>
)";
const char* const kMjcf = R"(<mujoco model="hopper">
  <worldbody>
    <body name="trunk"><freejoint/><inertial pos="0 0.02 0.8" mass="20" diaginertia="1.2 1.1 0.4"/>
      <body name="carriage"><joint name="up" type="slide" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
        <body name="foot"><joint name="along" type="slide" axis="1 0 0"/><inertial pos="0.01 0 0.05" mass="4" diaginertia="0.01 0.02 0.02"/></body>
      </body>
    </body>
  </worldbody>
  <actuator><motor name="up_motor" joint="up"/><motor name="along_motor" joint="along"/></actuator>
</mujoco>
)";

// Largest drive forces of a robot's own first motion, commanded in its drives.
std::vector<double> PeakForces(const Mechanism& mechanism, const test::TestFolder& folder) {
  Mechanism m = mechanism;
  if (m.drives.empty()) {
    m.drives = {{.name = "up", .kind = JointDrive{m.FindJoint("up"), 0}, .range = {}},
                {.name = "along", .kind = JointDrive{m.FindJoint("along"), 0}, .range = {}}};
  }
  (void)folder.Write("model.yaml", WriteModel(m));
  const std::string commands = fmt::format(
      "{{{}: {{sine: {{amplitude: 0.02, period_s: 0.4}}}}, {}: {{sine: {{amplitude: "
      "0.05, period_s: 0.8}}}}}}",
      m.drives[0].name, m.drives[1].name);
  RunOptions options;
  options.pictures = false;
  options.out_dir = "";
  const RunOutcome run = RunScenario(
      folder.Write("scenario.yaml",
                   "mechanism: ./model.yaml\nanalytic: none\nmotion: {duration_s: 0.8, sample_s: "
                   "0.01, commands: " +
                       commands + "}\n"),
      options);
  EXPECT_EQ(run.exit_code, 0) << run.diagnostics.Text();
  std::vector<double> peaks;
  if (!run.report) return peaks;
  for (const WitnessRecord& record : run.report->witnesses) {
    for (const Drive& drive : m.drives) {
      const int column = record.trace.Find(drive.name + ".force");
      if (column >= 0) peaks.push_back(record.trace.values.col(column).cwiseAbs().maxCoeff());
    }
  }
  return peaks;
}

// On one sole the drives bear what they bear when the foot is held.
TEST_F(Feet, OnOneFootARobotsDrivesBearWhatTheyDoWithTheFootHeld) {
  for (const auto& [name, text] : {std::pair("hopper.urdf", kUrdf), {"hopper.xml", kMjcf}}) {
    const std::string file = folder_.Write(name, text);
    LoadOptions held, free;
    held.base = "foot";
    free.free_base = true;
    free.plants = {"foot:sole@0,0,-0.01"};
    const LoadResult a = LoadRobot(file, held), b = LoadRobot(file, free);
    ASSERT_TRUE(a.mechanism) << a.diagnostics.Text();
    ASSERT_TRUE(b.mechanism) << b.diagnostics.Text();
    ASSERT_EQ(b.mechanism->contacts.size(), 1U);
    EXPECT_EQ(b.mechanism->contacts[0].name, "foot_contact");
    EXPECT_EQ(CountDofs(*b.mechanism), 2);
    // Nothing of the robot is left out any more.
    for (const ModelCaveat& caveat : b.caveats) EXPECT_NE(caveat.source, "body/freejoint");
    const std::vector<double> x = PeakForces(*a.mechanism, folder_);
    const std::vector<double> y = PeakForces(*b.mechanism, folder_);
    ASSERT_EQ(x.size(), 4U) << name;
    ASSERT_EQ(y.size(), 4U) << name;
    for (size_t k = 0; k < x.size(); ++k) EXPECT_NEAR(x[k], y[k], 1e-5 * x[k]) << name << k;
  }
}

TEST_F(Feet, ARobotsFirstMotionOnItsFeetMovesItsBase) {
  const std::string file = folder_.Write("hopper.xml", kMjcf);
  LoadOptions options;
  options.free_base = true;
  options.plants = {"{on: foot, kind: sole, length: 0.3, width: 0.2, friction: 0.8}"};
  const DefaultSetupResult made = MakeDefaultSetup(file, "", "./model.yaml", options);
  ASSERT_TRUE(made.setup) << made.diagnostics.Text();
  EXPECT_NE(made.setup->scenario.find("trunk.x: [home, {bump:"), std::string::npos)
      << made.setup->scenario;
  EXPECT_NE(made.setup->scenario.find("trunk.z: [home, {bump:"), std::string::npos);
  (void)folder_.Write("model.yaml", made.setup->model);
  RunOptions run_options;
  run_options.pictures = false;
  run_options.out_dir = "";
  const RunOutcome run =
      RunScenario(folder_.Write("first.yaml", made.setup->scenario), run_options);
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  EXPECT_EQ(run.exit_code, 0) << ToTable(*run.report, {});
  const ContactLoad* load = LoadOf(run, "simulated", "foot_contact");
  ASSERT_NE(load, nullptr);
  EXPECT_NEAR(load->mean_normal, 25.0 * kGravity, 0.05 * 25.0 * kGravity);
}

TEST_F(Feet, WrongFeetOfARobotAreFound) {
  const std::string file = folder_.Write("hopper.urdf", kUrdf);
  for (const auto& [plant, finding] : {std::pair("fot", "there is no body 'fot'"),
                                       {"foot:shoe", "kind"},
                                       {"foot@0,0", "at"},
                                       {"{on: foot, kind: }}", "--plant"}}) {
    LoadOptions options;
    options.free_base = true;
    options.plants = {plant};
    const LoadResult loaded = LoadRobot(file, options);
    EXPECT_FALSE(loaded.mechanism) << plant;
    EXPECT_NE(loaded.diagnostics.Text().find(finding), std::string::npos)
        << plant << ": " << loaded.diagnostics.Text();
  }
}

}  // namespace
}  // namespace mbv
