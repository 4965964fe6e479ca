// Serial stand-ins of joints driven through rods, against lengths, ratios and torques by hand.
#include "features/standin/standin.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

#include "base/files.h"
#include "model_file/load_model.h"
#include "reference/reduced_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kDeg = std::numbers::pi / 180.0;

// A file's text with pieces of it replaced.
using Changes = std::vector<std::pair<std::string, std::string>>;
std::string Changed(std::string text, const Changes& changes) {
  for (const auto& [from, to] : changes) {
    const size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    if (at != std::string::npos) text.replace(at, from.size(), to);
  }
  return text;
}

Mechanism Loaded(const std::string& text) {
  LoadResult loaded = LoadModelText(text, "standin.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism.value_or(Mechanism());
}

// Two cranks and rods with ball ends; coordinates of the universal joint: pitch, then roll.
Mechanism Ankle(const Changes& changes = {}, const std::string& more = "") {
  const auto text = ReadWholeFile(SourcePath("/tests/mechanisms/parallel_ankle.yaml"));
  return Loaded(Changed(text.value_or(""), changes) + more);
}
const std::vector<std::string> kPitchRoll = {"ankle.0", "ankle.1"};

// Rotors of both kinds, and forces on joints that a serial model has and has not.
constexpr const char* kRotors = R"(
motors:
  left: {peak: 2, max_speed: 500, gear_ratio: 5, efficiency: 0.8, rotor_inertia: 2.0e-6}
  right: {peak: 2, max_speed: 500, gear_ratio: 5, efficiency: 0.8, rotor_inertia: 2.0e-6}
elements:
  left_rotor: {kind: rotor, joint: left_hinge, inertia: 1.0e-5, ratio: 10}
  right_rotor: {kind: rotor, joint: right_hinge, inertia: 1.0e-5, ratio: 10}
)";
constexpr double kRotor = 1e-5 * 100 + 2e-6 * 25;  // both, at the drive

constexpr const char* kForces = R"(  oil: {kind: damping, joint: left_hinge, damping: 0.02}
  dry: {kind: friction, joint: right_hinge, coulomb: 0.01, breakaway: 0.02, stribeck_rate: 0.1}
  tendon: {kind: spring, joint: ankle, coordinate: 0, stiffness: 3}
springs:
  elastic: {from: world.left_motor, to: left_rod.end, stiffness: 20, damping: 2, free_length: 0.1}
)";

constexpr double kCrank = 0.05, kRod = 0.24, kWidth = 0.04, kBack = 0.05;

// The ankle by hand: of each rod |h(q) − c(m)|² = rod², h = Ry(q0) Rx(q1) (−back, ±width, −0.02),
// c = (−crank cos m, ±width, rod − 0.02 + crank sin m).
struct AnkleByHand {
  explicit AnkleByHand(const VecX& q) : drives(2), J(2, 2) {
    for (int side = 0; side < 2; ++side) {
      const double y = side == 0 ? kWidth : -kWidth;
      const Mat3 pitch = Eigen::AngleAxisd(q[0], Vec3::UnitY()).toRotationMatrix();
      const Mat3 roll = Eigen::AngleAxisd(q[1], Vec3::UnitX()).toRotationMatrix();
      const Vec3 h = pitch * roll * Vec3(-kBack, y, -0.02), hinge(0, y, kRod - 0.02);
      const Vec3 e = h - hinge;
      const double K = (kRod * kRod - e.squaredNorm() - kCrank * kCrank) / (2 * kCrank);
      const double m = -std::atan2(e.z(), e.x()) - std::acos(K / std::hypot(e.x(), e.z()));
      const Vec3 arm(-kCrank * std::cos(m), 0, kCrank * std::sin(m)), rod = e - arm;
      const double along = rod.dot(Vec3::UnitY().cross(arm));
      drives[side] = m;
      J(side, 0) = rod.dot(Vec3::UnitY().cross(h)) / along;
      J(side, 1) = rod.dot((pitch * Vec3::UnitX()).cross(h)) / along;
    }
  }
  VecX drives;
  MatX J;
};

StandinSettings Grid(int resolution, double deg = 30.0) {
  return {.ranges = {{"ankle.0", -deg * kDeg, deg * kDeg}, {"ankle.1", -deg * kDeg, deg * kDeg}},
          .resolution = resolution};
}

double LargestOff(const StandinResult& result, bool ratio) {
  double off = 0.0;
  for (const StandinPose& pose : result.poses) {
    const AnkleByHand hand(pose.q);
    off = std::max(off, ratio ? (pose.J - hand.J).cwiseAbs().maxCoeff()
                              : (pose.drives - hand.drives).cwiseAbs().maxCoeff());
  }
  return off;
}

TEST(Standin, AnkleIsAsTheRodsLengthsSay) {
  const StandinResult result = ComputeStandin(Ankle(), kPitchRoll, Grid(9));
  ASSERT_FALSE(result.diagnostics.has_errors()) << result.diagnostics.Text();
  EXPECT_EQ(result.usable(), 81u);
  EXPECT_LT(LargestOff(result, false), 1e-10);
  EXPECT_LT(LargestOff(result, true), 1e-10);
  EXPECT_THAT(result.drives, ElementsAre("left", "right"));
  EXPECT_THAT(result.loop_bodies,
              ElementsAre("left_crank", "right_crank", "left_rod", "right_rod"));
  EXPECT_TRUE(result.held.empty());

  const StandinResult longer =
      ComputeStandin(Ankle({{"frames: {end: [0, 0, -rod]}", "frames: {end: [0, 0, -rod - 1e-6]}"}}),
                     kPitchRoll, Grid(9));
  EXPECT_GT(LargestOff(longer, false), 1e-5);
  EXPECT_GT(LargestOff(longer, true), 1e-6);
}

// |J⁻ᵀ J₀ᵀ − 1| of every pose, and its ranks.
TEST(Standin, TorqueMapErrorIsOfTheRatiosByHand) {
  const StandinResult result = ComputeStandin(Ankle(), kPitchRoll, Grid(9));
  const MatX J_home = AnkleByHand(VecX::Zero(2)).J;
  EXPECT_LT((result.J_home - J_home).norm(), 1e-10);
  std::vector<double> errors;
  for (const StandinPose& pose : result.poses) {
    const MatX off =
        AnkleByHand(pose.q).J.transpose().inverse() * J_home.transpose() - MatX::Identity(2, 2);
    // Largest singular value of a 2 × 2 matrix.
    const double s = off.squaredNorm(), d = off.determinant();
    errors.push_back(std::sqrt(0.5 * (s + std::sqrt(std::max(s * s - 4 * d * d, 0.0)))));
    EXPECT_NEAR(pose.map_error, errors.back(), 1e-9);
  }
  std::ranges::sort(errors);
  EXPECT_NEAR(result.map_error.median, errors[40], 1e-9);
  EXPECT_NEAR(result.map_error.p95, errors[76], 1e-9);
  EXPECT_NEAR(result.map_error.worst, errors[80], 1e-9);
  EXPECT_GT(result.map_error.p95, 1.5 * result.map_error.median);
}

// The nearest poses to both kinds of singularity.
TEST(Standin, SingularValuesAreOfTheRatiosByHand) {
  const StandinResult result = ComputeStandin(Ankle(), kPitchRoll, Grid(9));
  EXPECT_EQ(result.unit, "1");
  EXPECT_NEAR(result.largest_home, std::sqrt(2.0), 1e-10);
  EXPECT_NEAR(result.least_home, 0.8 * std::sqrt(2.0), 1e-10);
  double least = 10.0, largest = 0.0;
  for (const StandinPose& pose : result.poses) {
    const MatX J = AnkleByHand(pose.q).J;
    const double s = J.squaredNorm(), d = J.determinant(), r = std::sqrt(s * s - 4 * d * d);
    EXPECT_NEAR(pose.least, std::sqrt(0.5 * (s - r)), 1e-9);
    EXPECT_NEAR(pose.largest, std::sqrt(0.5 * (s + r)), 1e-9);
    least = std::min(least, pose.least);
    largest = std::max(largest, pose.largest);
  }
  const auto json = ToJson(result, "ankle")["singularities"];
  EXPECT_EQ(json["type2"], least);
  EXPECT_EQ(json["type1"], 1.0 / largest);
  EXPECT_EQ(ToJson(result, "ankle")["drives"][1]["ratio"][1], result.J_home(1, 1));
}

TEST(Standin, SpreadTakesNearestRanks) {
  std::vector<double> values(20);
  for (size_t i = 0; i < 20; ++i) values[i] = 20.0 - static_cast<double>(i);
  const Spread spread = SpreadOf(values);
  EXPECT_EQ(spread.median, 10);
  EXPECT_EQ(spread.p95, 19);
  EXPECT_EQ(spread.worst, 20);
  EXPECT_EQ(spread.at, 0u);
  EXPECT_TRUE(std::isnan(SpreadOf({}).worst));
}

TEST(Standin, CausesAddUpToTheBalanceOfAllBodies) {
  const StandinResult result =
      ComputeStandin(Ankle({}, std::string(kRotors) + kForces), kPitchRoll, Grid(9));
  ASSERT_EQ(result.scenes.size(), 3u);
  for (const StandinScene& scene : result.scenes) {
    EXPECT_GT(scene.states, 80u) << scene.name;
    EXPECT_LT(scene.sum_off, 1e-10) << scene.name;
    EXPECT_EQ(scene.left_out, 0u) << scene.name;
  }
  for (const StandinPose& pose : result.poses) {
    // Each cause is there, none of rest but gravity's and that of springs.
    for (size_t c = 0; c <= kWhole; ++c) {
      if (c > 0 || pose.q.norm() > 1e-9) {
        EXPECT_GT(pose.moving.errors[c].norm(), 1e-9) << kCauseNames[c];
      }
      EXPECT_EQ(pose.rest.errors[c].norm() > 1e-9 * pose.rest.full.norm(),
                (c == 0 && pose.q.norm() > 1e-9) || c == 3 || c == kWhole)
          << kCauseNames[c] << pose.q.transpose();
    }
  }

  // A part in a million of a rod's mass would be seen.
  const StandinResult heavier = ComputeStandin(
      Ankle({{"m_rod: {value: 0.08, unit: kg}", "m_rod: {value: 0.08000008, unit: kg}"}},
            std::string(kRotors) + kForces),
      kPitchRoll, Grid(9));
  for (size_t i = 0; i < result.poses.size(); ++i) {
    const StandinState& state = result.poses[i].moving;
    VecX off = heavier.poses[i].moving.full - state.serial;
    for (size_t c = 0; c < kCauses; ++c) off -= state.errors[c];
    EXPECT_GT(off.norm(), 1e-9 * state.full.norm());
    EXPECT_LT(off.norm(), 1e-5 * state.full.norm());
  }
}

// The ankle with the loops cut by hand, driven at its universal joint.
Mechanism CutAnkle(const std::string& more = "") {
  std::string text = *ReadWholeFile(SourcePath("/tests/mechanisms/parallel_ankle.yaml"));
  const auto part = [&](const char* from, const char* to) {
    return text.substr(text.find(from), text.find(to) - text.find(from));
  };
  return Loaded(Changed(text, {{part("  left_crank: &crank", "joints:"), ""},
                               {part("  left_hinge:", "outputs:"),
                                "drives:\n  pitch: {kind: joint, joint: ankle, coordinate: 0}\n"
                                "  roll: {kind: joint, joint: ankle, coordinate: 1}\n"}}) +
                more);
}

// Forces along its joints [N m].
VecX JointForces(ReducedModel* model, const VecX& q, const VecX& v, const VecX& a) {
  EXPECT_TRUE(model->Move(q, v, a).ok());
  MatX T;
  EXPECT_TRUE(model->Motions(&T).ok());
  return model->Forces(T, {});
}
ReducedModel ModelOf(const Mechanism& mechanism) {
  return {mechanism, std::vector<Coordinate>{{Coordinate::Kind::kJoint, 0, 0},
                                             {Coordinate::Kind::kJoint, 0, 1}}};
}

TEST(Standin, SerialModelIsTheRobotWithItsLoopsCut) {
  const Mechanism cut =
      CutAnkle("elements:\n  tendon: {kind: spring, joint: ankle, coordinate: 0, stiffness: 3}\n");
  ReducedModel serial = ModelOf(cut);
  const StandinResult result =
      ComputeStandin(Ankle({}, std::string(kRotors) + kForces), kPitchRoll, Grid(5));
  for (const StandinPose& pose : result.poses) {
    for (const StandinState* state : {&pose.rest, &pose.moving}) {
      const VecX joint =
          JointForces(&serial, pose.q, state->v, state->a) + result.armature.cwiseProduct(state->a);
      const VecX by_hand = AnkleByHand(VecX::Zero(2)).J.transpose().inverse() * joint;
      EXPECT_LT((state->serial - by_hand).norm(), 1e-10 * by_hand.norm());
      EXPECT_GT((state->serial - joint).norm(), 1e-3 * by_hand.norm());
    }
  }
}

// What the rods add to the cut ankle: at rest or accelerated without a rate their mass and weight,
// the rest is of rates.
TEST(Standin, LoopBodiesByTheirMassAndByTheirRates) {
  const Mechanism ankle = Ankle(), cut = CutAnkle();
  ReducedModel full = ModelOf(ankle), serial = ModelOf(cut);
  const StandinResult result = ComputeStandin(ankle, kPitchRoll, Grid(5));
  for (const StandinPose& pose : result.poses) {
    const StandinState& state = pose.moving;
    const auto added = [&](const VecX& v) {
      const VecX more =
          JointForces(&full, pose.q, v, state.a) - JointForces(&serial, pose.q, v, state.a);
      return VecX(AnkleByHand(pose.q).J.transpose().inverse() * more);
    };
    const VecX still = added(VecX::Zero(2)), moving = added(state.v);
    EXPECT_LT((state.errors[3] - still).norm(), 1e-9 * still.norm());
    EXPECT_LT((state.errors[2] - (moving - still)).norm(), 1e-9 * still.norm());
    EXPECT_GT((moving - still).norm(), 1e-7 * still.norm());
  }
}

// Without masses of cranks and rods: rotors turn with m̈ = J a + J̇ v.
TEST(Standin, RotorsAreCountedAtTheDrives) {
  const Mechanism ankle =
      Ankle({{"m_rod: {value: 0.08, unit: kg}", "m_rod: {value: 0, unit: kg}"},
             {"m_crank: {value: 0.06, unit: kg}", "m_crank: {value: 0, unit: kg}"},
             {"inertia: [4.0e-6, m_crank", "inertia: [0, m_crank"},
             {"m_rod*rod^2/12, 2.0e-6]", "m_rod*rod^2/12, 0]"}},
            kRotors);
  const StandinResult result = ComputeStandin(ankle, kPitchRoll, Grid(5));
  ASSERT_EQ(result.usable(), 25u) << result.diagnostics.Text();
  MatX mean = MatX::Zero(2, 2);
  for (const StandinPose& pose : result.poses) {
    const MatX J = AnkleByHand(pose.q).J;
    EXPECT_LT((pose.R - kRotor * J.transpose() * J).norm(), 1e-10 * pose.R.norm());
    mean += kRotor * J.transpose() * J / 25.0;
    const StandinState& state = pose.moving;
    constexpr double kStep = 1e-6;  // central differences: 1e-9 of J̇
    const MatX J_rate =
        (AnkleByHand(pose.q + kStep * state.v).J - AnkleByHand(pose.q - kStep * state.v).J) /
        (2 * kStep);
    const MatX to_drives = J.transpose().inverse();
    const VecX rotors = kRotor * (J * state.a),
               armature = to_drives * result.armature.asDiagonal() * state.a;
    EXPECT_LT((state.errors[1] - (rotors - armature)).norm(), 1e-9 * rotors.norm());
    EXPECT_LT((state.errors[2] - kRotor * J_rate * state.v).norm(),
              1e-7 * (kRotor * J_rate * state.v).norm());
    EXPECT_LT(state.errors[3].norm(), 1e-10 * state.full.norm());
  }
  EXPECT_LT((result.armature - mean.diagonal()).norm(), 1e-10 * mean.norm());
  EXPECT_GT(result.inertia_off.worst, 0.1);
}

constexpr const char* kGeared = R"(name: geared
bodies:
  link: {mass: 2, com: [0.1, 0, -0.2], inertia: [0.02, 0.03, 0.01]}
joints:
  hip: {kind: revolute, parent: world, child: link, axis: y}
drives:
  motor: {kind: joint, joint: hip, range_deg: [-90, 90]}
motors:
  motor: {peak: 1.5, max_speed: 300, gear_ratio: 20, efficiency: 0.9, rotor_inertia: 3.0e-5}
elements:
  rotor: {kind: rotor, joint: hip, inertia: 1.0e-4, ratio: 9}
  oil: {kind: damping, joint: hip, damping: 0.4}
  dry: {kind: friction, joint: hip, coulomb: 0.2, breakaway: 0.3, stribeck_rate: 0.1}
)";

void ExpectNoError(const StandinResult& result) {
  ASSERT_GT(result.usable(), 100u) << result.diagnostics.Text();
  EXPECT_LT(result.map_error.worst, 1e-12);
  EXPECT_LT(result.inertia_off.worst, 1e-12);
  for (const StandinScene& scene : result.scenes) {
    EXPECT_GT(scene.full_p95[0], 0.1) << scene.name;
    for (const Spread& error : scene.errors[0]) EXPECT_LT(error.worst, 1e-12 * scene.full_p95[0]);
  }
  EXPECT_THAT(AdviceOf(result).front(), HasSubstr("a constant gear does"));
}

TEST(Standin, GearedJointHasNoError) {
  const StandinResult direct = ComputeStandin(Loaded(kGeared), {"hip"}, {});
  ExpectNoError(direct);
  EXPECT_NEAR(direct.armature[0], 3e-5 * 400 + 1e-4 * 81, 1e-15);
  EXPECT_TRUE(direct.loop_bodies.empty());
  // The same over a gear pair with a massless wheel, and what belongs to the motor on its shaft.
  const std::string wheel =
      Changed(kGeared, {{"bodies:\n", "bodies:\n  wheel: {}\n"},
                        {"joints:\n",
                         "couplings:\n  pair: {joint: shaft, follows: hip, ratio: -3}\njoints:\n  "
                         "shaft: {kind: revolute, parent: world, child: wheel, axis: y}\n"},
                        {"joint: hip, range_deg: [-90, 90]", "joint: shaft"}});
  const StandinResult geared = ComputeStandin(Loaded(wheel), {"hip"}, {});
  ExpectNoError(geared);
  EXPECT_NEAR(geared.J_home(0, 0), -3.0, 1e-12);
  EXPECT_NEAR(geared.armature[0], 3e-5 * 400 * 9 + 1e-4 * 81, 1e-13);
  EXPECT_THAT(geared.loop_bodies, ElementsAre("wheel"));
  // A wheel that weighs is a loop body's error.
  const StandinResult heavy = ComputeStandin(
      Loaded(Changed(wheel, {{"wheel: {}", "wheel: {mass: 1, inertia: [1e-3, 1e-3, 1e-3]}"}})),
      {"hip"}, {});
  EXPECT_GT(heavy.scenes[1].errors[0][3].worst, 1e-4);
  EXPECT_LT(heavy.scenes[1].errors[0][2].worst, 1e-12);
}

// τ = I q̈ + c q̇ + dV/dq along q = 15° sin ωt.
TEST(Standin, MotionIsASine) {
  const std::string smooth = Changed(
      kGeared,
      {{"  dry: {kind: friction, joint: hip, coulomb: 0.2, breakaway: 0.3, stribeck_rate: 0.1}\n",
        ""}});
  StandinSettings settings;
  settings.frequency_hz = 3.0;
  const StandinResult result = ComputeStandin(Loaded(smooth), {"hip"}, settings);
  const double omega = 6 * std::numbers::pi;
  std::vector<double> torques;
  for (int i = 0; i < 400; ++i) {
    const double phase = 2 * std::numbers::pi * i / 400, q = 15 * kDeg * std::sin(phase);
    const double inertia = 0.03 + 2 * 0.05 + 3e-5 * 400 + 1e-4 * 81;
    torques.push_back(std::abs(-inertia * omega * omega * q +
                               0.4 * omega * 15 * kDeg * std::cos(phase) +
                               2 * 9.81 * (0.2 * std::sin(q) - 0.1 * std::cos(q))));
  }
  ASSERT_EQ(result.scenes.size(), 3u) << result.diagnostics.Text();
  EXPECT_EQ(result.scenes[1].states, 400u);
  EXPECT_NEAR(result.scenes[1].full_p95[0], SpreadOf(torques).p95, 1e-9);
  // What is drawn fills the motion's rates and accelerations.
  double v = 0.0, a = 0.0;
  for (const StandinPose& pose : result.poses) {
    v = std::max(v, std::abs(pose.moving.v[0]));
    a = std::max(a, std::abs(pose.moving.a[0]));
  }
  for (const double share : {v / (omega * 15 * kDeg), a / (omega * omega * 15 * kDeg)}) {
    EXPECT_GT(share, 0.95);
    EXPECT_LE(share, 1.0);
  }
}

TEST(Standin, LimitsOfADrivesJointAreItsRange) {
  const Mechanism limited = Loaded(
      Changed(kGeared, {{"child: link, axis: y", "child: link, axis: y, range_deg: [-25, 15]"}}));
  EXPECT_EQ(ComputeStandin(limited, {"hip"}, {.ranges = {}, .resolution = 9}).usable(), 9u);
  const StandinResult wide = ComputeStandin(
      limited, {"hip"}, {.ranges = {{"hip", -30 * kDeg, 30 * kDeg}}, .resolution = 7});
  EXPECT_EQ(wide.usable(), 4u);  // −20 … 10
  EXPECT_EQ(wide.CountOf(PoseStatus::kDriveRange), 3u);
}

// A knee below a hip that another drive holds: crank and rod on the thigh.
constexpr const char* kKnee = R"(name: knee
bodies:
  thigh:
    mass: 3
    com: [0, 0, -0.2]
    inertia: [0.05, 0.05, 0.01]
    frames: {motor: [0, 0, -0.1], knee: [0, 0, -0.4]}
  shin:
    mass: 2
    com: [0.02, 0, -0.2]
    inertia: [0.03, 0.03, 0.005]
    frames: {lever: [-0.04, 0, 0], ankle: [0, 0, -0.4]}
  crank: {mass: 0.1, com: [-0.02, 0, 0], inertia: [1e-5, 3e-5, 3e-5], frames: {end: [-0.05, 0, 0]}}
  rod: {mass: 0.2, com: [0.005, 0, -0.15], inertia: [2e-3, 2e-3, 2e-3], frames: {end: [0.01, 0, -0.3]}}
  foot: {mass: 1, com: [0.05, 0, -0.03], inertia: [1e-3, 2e-3, 2e-3]}
joints:
  hip: {kind: revolute, parent: world, child: thigh, axis: y}
  knee: {kind: revolute, parent: thigh.knee, child: shin, axis: y}
  ankle: {kind: revolute, parent: shin.ankle, child: foot, axis: y}
  hinge: {kind: revolute, parent: thigh.motor, child: crank, axis: y}
  upper: {kind: spherical, parent: crank.end, child: rod}
  lower: {kind: spherical, parent: shin.lever, child: rod.end}
drives:
  hip_motor: {kind: joint, joint: hip}
  knee_motor: {kind: joint, joint: hinge}
  ankle_motor: {kind: joint, joint: ankle}
)";

TEST(Standin, KneeBelowADrivenHip) {
  const StandinResult result = ComputeStandin(
      Loaded(kKnee), {"knee"}, {.ranges = {{"knee", -60 * kDeg, 40 * kDeg}}, .resolution = 21});
  ASSERT_EQ(result.usable(), 21u) << result.diagnostics.Text();
  EXPECT_THAT(result.drives, ElementsAre("knee_motor"));
  EXPECT_THAT(result.held, ElementsAre("hip_motor", "ankle_motor"));
  EXPECT_THAT(result.loop_bodies, ElementsAre("crank", "rod"));
  for (const StandinPose& pose : result.poses) {
    // In the x-z plane about y: the rod between the lever and the crank's end of known angle.
    const auto turned = [](double angle, double x) {
      return Vec3(x * std::cos(angle), 0, -x * std::sin(angle));
    };
    const Vec3 lever = turned(pose.q[0], -0.04), crank = turned(pose.drives[0], -0.05);
    const Vec3 rod = Vec3(0, 0, -0.4) + lever - Vec3(0, 0, -0.1) - crank;
    EXPECT_NEAR(rod.norm(), std::hypot(0.01, 0.3), 1e-12);
    EXPECT_NEAR(pose.J(0, 0),
                rod.dot(Vec3::UnitY().cross(lever)) / rod.dot(Vec3::UnitY().cross(crank)), 1e-10);
  }
  for (const StandinScene& scene : result.scenes) EXPECT_LT(scene.sum_off, 1e-10);

  // A rod that is not symmetric about its line: its spin is held, though no drive holds it.
  const StandinResult heavy = ComputeStandin(
      Loaded(Changed(kKnee, {{"inertia: [2e-3, 2e-3, 2e-3]", "inertia: [2e-3, 2e-3, 1e-3]"}})),
      {"knee"}, {.ranges = {{"knee", -60 * kDeg, 40 * kDeg}}, .resolution = 21});
  ASSERT_EQ(heavy.usable(), 21u) << heavy.diagnostics.Text();
  ASSERT_EQ(heavy.held.size(), 3u);
  EXPECT_THAT(heavy.notes.back(), HasSubstr("forces along the joints alone"));
  for (size_t i = 0; i < 21; ++i) {
    EXPECT_NEAR(heavy.poses[i].rest.full[0], result.poses[i].rest.full[0], 1e-9);
    EXPECT_NEAR(heavy.poses[i].rest.serial[0], result.poses[i].rest.serial[0], 1e-9);
    EXPECT_NEAR(heavy.poses[i].J(0, 0), result.poses[i].J(0, 0), 1e-9);
  }
  EXPECT_TRUE(std::isnan(heavy.scenes[0].sum_off));
}

// By J₀ = [1 0.8; 1 −0.8], and the motors' limits behind gears: 2·5·0.8 N m, 500/5 rad/s.
TEST(Standin, LimitsOfTheMotorsAtHome) {
  const StandinResult result = ComputeStandin(Ankle({}, kRotors), kPitchRoll, Grid(5));
  ASSERT_TRUE(result.torque_limits && result.speed_limits);
  const StandinPose& home = result.poses[12];
  ASSERT_LT(home.q.norm(), 1e-12);
  EXPECT_NEAR(home.torque_alone[0], 8 / 0.5, 1e-9);
  EXPECT_NEAR(home.torque_alone[1], 8 / 0.625, 1e-9);
  EXPECT_NEAR(home.torque_any, 8 / std::hypot(0.5, 0.625), 1e-9);
  EXPECT_NEAR(home.speed_alone[0], 100, 1e-9);
  EXPECT_NEAR(home.speed_alone[1], 125, 1e-9);
  EXPECT_NEAR(home.speed_any, 100 / std::hypot(1, 0.8), 1e-9);
  // Half of a corner's torque is within the limits in every direction, all of it is not.
  for (const StandinPose& pose : result.poses) {
    EXPECT_GE(pose.torque_any, result.poses[result.worst_torque].torque_any);
    const MatX back = pose.J.transpose().inverse();
    double most = 0.0;
    for (int k = 0; k < 720; ++k) {
      const VecX joint =
          pose.torque_any * Eigen::Vector2d(std::cos(k * kDeg / 2), std::sin(k * kDeg / 2));
      most = std::max(most, (back * joint).cwiseAbs().maxCoeff());
    }
    EXPECT_LE(most, 8 * (1 + 1e-12));
    EXPECT_GT(most, 8 * 0.9999);
  }
  EXPECT_FALSE(ComputeStandin(Ankle(), kPitchRoll, Grid(2)).torque_limits);
}

// In the table of all poses, too: Jᵀ (8, 8) and Jᵀ (−8, 8) at home.
TEST(Standin, TableHasTheCornersOfThePolygons) {
  const std::string csv = StandinCsv(ComputeStandin(Ankle({}, kRotors), kPitchRoll, Grid(3)));
  std::vector<std::vector<std::string>> rows;
  for (size_t at = 0; at < csv.size();) {
    const size_t end = csv.find('\n', at);
    rows.emplace_back(1);
    for (; at < end; ++at) {
      if (csv[at] == ',')
        rows.back().emplace_back();
      else
        rows.back().back() += csv[at];
    }
    ++at;
  }
  ASSERT_EQ(rows.size(), 10u);
  const auto home = [&](const std::string& heading) {
    const auto at = std::ranges::find(rows[0], heading);
    EXPECT_NE(at, rows[0].end()) << heading;
    return at == rows[0].end() ? kNan : std::stod(rows[5][size_t(at - rows[0].begin())]);
  };
  EXPECT_NEAR(home("ankle.0 torque corner 1 [N m]"), 16, 1e-9);
  EXPECT_NEAR(home("ankle.1 torque corner 1 [N m]"), 0, 1e-9);
  EXPECT_NEAR(home("ankle.0 torque corner 2 [N m]"), 0, 1e-9);
  EXPECT_NEAR(home("ankle.1 torque corner 2 [N m]"), -12.8, 1e-9);
  EXPECT_NEAR(home("ankle.0 rate corner 1 [rad/s]"), 100, 1e-9);
  EXPECT_NEAR(home("ankle.1 rate corner 2 [rad/s]"), -125, 1e-9);
  EXPECT_NEAR(home("d right / d ankle.1 [rad/rad]"), -0.8, 1e-9);
}

// A flap on a cylinder: length and ratio of the triangle, forces in N, rates in m/rad.
TEST(Standin, CylinderOfAFlap) {
  const Mechanism flap = Loaded(R"(name: flap
bodies:
  flap: {mass: 4, com: [0.3, 0, 0], inertia: [0.1, 0.2, 0.2], frames: {eye: [0.25, 0, 0.05]}}
joints:
  hinge: {kind: revolute, parent: world, child: flap, axis: y, range_deg: [-50, 40]}
drives:
  cylinder: {kind: distance, from: world.foot, to: flap.eye, range: [0.2, 0.9]}
world: {frames: {foot: [0, 0, -0.4]}}
elements:
  seal: {kind: damping, drive: cylinder, damping: 30}
)");
  const StandinResult result = ComputeStandin(flap, {"hinge"}, {.ranges = {}, .resolution = 31});
  ASSERT_EQ(result.usable(), 31u) << result.diagnostics.Text();
  EXPECT_EQ(result.unit, "m/rad");
  EXPECT_NEAR(result.poses.front().q[0], -50 * kDeg, 1e-12);
  EXPECT_NEAR(result.poses.back().q[0], 40 * kDeg, 1e-12);
  const auto ratio = [](double q) {
    const Vec3 eye(0.25 * std::cos(q) + 0.05 * std::sin(q), 0,
                   -0.25 * std::sin(q) + 0.05 * std::cos(q));
    const Vec3 way = eye - Vec3(0, 0, -0.4);
    return way.dot(Vec3::UnitY().cross(eye)) / way.norm();
  };
  for (const StandinPose& pose : result.poses) {
    EXPECT_NEAR(pose.J(0, 0), ratio(pose.q[0]), 1e-10);
    EXPECT_NEAR(pose.map_error, std::abs(ratio(0) / ratio(pose.q[0]) - 1), 1e-9);
    const double weight = -4 * 9.81 * 0.3 * std::cos(pose.q[0]);
    EXPECT_NEAR(pose.rest.full[0], weight / ratio(pose.q[0]), 1e-8);
    EXPECT_NEAR(pose.rest.serial[0], weight / ratio(0), 1e-8);
    // What damps the cylinder is no part of the serial model.
    EXPECT_NEAR(pose.moving.errors[3][0], 30 * pose.J(0, 0) * pose.moving.v[0], 1e-8);
  }
}

// A slide and a hinge on it, each with its motor: no ratio, no error, units that differ.
TEST(Standin, JointsOfDifferentUnits) {
  const Mechanism cart = Loaded(R"(name: cart
bodies:
  cart: {mass: 3, inertia: [0.1, 0.1, 0.1]}
  arm: {mass: 1, com: [0.3, 0, 0], inertia: [0.01, 0.02, 0.02]}
joints:
  slide: {kind: prismatic, parent: world, child: cart, axis: x, range_mm: [-200, 200]}
  turn: {kind: revolute, parent: cart, child: arm, axis: y}
drives:
  belt: {kind: joint, joint: slide, range_mm: [-160, 300]}
  motor: {kind: joint, joint: turn}
motors:
  belt: {peak: 2, max_speed: 400, lead: 0.1}
  motor: {peak: 1, max_speed: 300, gear_ratio: 6}
)");
  const StandinResult result =
      ComputeStandin(cart, {"slide", "turn"}, {.ranges = {}, .resolution = 9});
  ASSERT_EQ(result.usable(), 8u * 9u) << result.diagnostics.Text();
  EXPECT_THAT(result.unit, testing::StartsWith("1, lengths in "));
  EXPECT_THAT(result.drive_units, ElementsAre("m", "rad"));
  EXPECT_LT(result.map_error.worst, 1e-12);
  const StandinPose& pose = result.poses[40];
  EXPECT_NEAR(pose.torque_alone[0], 2 * 2 * std::numbers::pi / 0.1, 1e-9);
  EXPECT_NEAR(pose.torque_alone[1], 6, 1e-12);
  EXPECT_TRUE(std::isnan(pose.torque_any));
  const auto json = ToJson(result, "cart");
  EXPECT_TRUE(json["torque_limits"]["any"].is_null());
  EXPECT_NEAR(json["torque_limits"]["alone"][1]["least"].get<double>(), 6.0, 1e-12);
  EXPECT_THAT(StandinPage(result, "cart"), HasSubstr("slide [mm]"));
}

TEST(Standin, ThreeJointsOfALeg) {
  const StandinResult result =
      ComputeStandin(Loaded(kKnee), {"hip", "knee", "ankle"}, {.ranges = {}, .resolution = 3});
  ASSERT_EQ(result.usable(), 27u) << result.diagnostics.Text();
  const StandinResult knee =
      ComputeStandin(Loaded(kKnee), {"knee"}, {.ranges = {}, .resolution = 3});
  for (size_t i = 0; i < 27; ++i) {
    const MatX& J = result.poses[i].J;
    EXPECT_NEAR(J(0, 0), 1, 1e-12);
    EXPECT_NEAR(J(1, 1), knee.poses[i / 3 % 3].J(0, 0), 1e-10);
    EXPECT_NEAR(J(2, 2), 1, 1e-12);
    EXPECT_LT((J - MatX(J.diagonal().asDiagonal())).norm(), 1e-10);
  }
  for (const StandinScene& scene : result.scenes) EXPECT_LT(scene.sum_off, 1e-10);
  EXPECT_THAT(StandinPage(result, "leg"), HasSubstr("Error of the serial model"));
}

// A cylinder whose line goes through the hinge holds nothing, whatever round-off makes of the
// ratio.
TEST(Standin, PoseThatIsSingularIsNotUsed) {
  const std::string flap = R"(name: flap
bodies:
  flap: {mass: 4, com: [0.3, 0, 0], inertia: [0.1, 0.2, 0.2], frames: {eye: [0.25, 0, 0]}}
joints:
  hinge: {kind: revolute, parent: world, child: flap, axis: y, range_deg: [-50, 90]}
drives:
  cylinder: {kind: distance, from: world.foot, to: flap.eye}
world: {frames: {foot: [0, 0, -0.4]}}
)";
  const StandinResult result =
      ComputeStandin(Loaded(flap), {"hinge"}, {.ranges = {}, .resolution = 15});
  ASSERT_EQ(result.poses.size(), 15u) << result.diagnostics.Text();
  EXPECT_EQ(result.usable(), 14u);
  EXPECT_EQ(result.poses.back().status, PoseStatus::kBeyond);
  EXPECT_LT(std::abs(result.poses.back().J(0, 0)), 1e-12);
  const StandinResult at_home = ComputeStandin(
      Loaded(Changed(flap, {{"range_deg: [-50, 90]", "guess_deg: 90"}})), {"hinge"}, {});
  EXPECT_THAT(at_home.diagnostics.Text(), HasSubstr("no drive holds"));
}

TEST(Standin, PrescribedJointsStayAtHome) {
  const StandinResult result =
      ComputeStandin(Loaded(Changed(kKnee, {{"  hip_motor: {kind: joint, joint: hip}\n", ""}}) +
                            "prescribed: {sway: {joint: hip}}\n"),
                     {"knee"}, {.ranges = {}, .resolution = 5});
  ASSERT_EQ(result.usable(), 5u) << result.diagnostics.Text();
  EXPECT_THAT(result.held, ElementsAre("ankle_motor"));
  EXPECT_THAT(result.notes, ElementsAre("prescribed 'sway' stays at home"));
  EXPECT_TRUE(
      ComputeStandin(Loaded(Changed(kKnee, {{"  hip_motor: {kind: joint, joint: hip}\n", ""}}) +
                            "prescribed: {sway: {joint: hip}}\n"),
                     {"hip"}, {})
          .diagnostics.has_errors());
}

TEST(Standin, DriveRangesEndTheRange) {
  const Mechanism narrow =
      Ankle({{"left: {kind: joint, joint: left_hinge}",
              "left: {kind: joint, joint: left_hinge, range_deg: [-20, 25]}"}});
  StandinSettings settings = Grid(11);
  settings.amplitude = 0.9;
  const StandinResult result = ComputeStandin(narrow, kPitchRoll, settings);
  size_t beyond = 0;
  for (const StandinPose& pose : result.poses) {
    const double left = AnkleByHand(pose.q).drives[0];
    const bool out = left < -20 * kDeg || left > 25 * kDeg;
    EXPECT_EQ(pose.status, out ? PoseStatus::kDriveRange : PoseStatus::kUsable);
    EXPECT_EQ(pose.where, out ? "left" : "");
    beyond += out ? 1 : 0;
  }
  EXPECT_GT(beyond, 20u);
  // Of the motion, too: 27° sin and 27° cos.
  const StandinScene& motion = result.scenes[1];
  size_t left_out = 0;
  for (int i = 0; i < 400; ++i) {
    const double phase = 2 * std::numbers::pi * i / 400;
    const double left =
        AnkleByHand(27 * kDeg * Eigen::Vector2d(std::sin(phase), std::cos(phase))).drives[0];
    left_out += left < -20 * kDeg || left > 25 * kDeg ? 1 : 0;
  }
  EXPECT_GT(left_out, 10u);
  EXPECT_EQ(motion.left_out, left_out);
  EXPECT_EQ(motion.states + left_out, 400u);
  EXPECT_EQ(result.usable() + beyond, 121u);
  EXPECT_THAT(AdviceOf(result)[1], HasSubstr("range of drive left"));
}

// The knee's lever lies along the rod at q = atan2(0.3, …): beyond it the drive pushes the other
// way; where the rod does not reach, the loop stays open.
TEST(Standin, SingularAndOpenPosesAreNotUsed) {
  const StandinResult result = ComputeStandin(
      Loaded(kKnee), {"knee"}, {.ranges = {{"knee", -170 * kDeg, 170 * kDeg}}, .resolution = 341});
  ASSERT_GT(result.usable(), 50u) << result.diagnostics.Text();
  for (const StandinPose& pose : result.poses) {
    if (pose.status == PoseStatus::kOpen) continue;
    const Vec3 lever(-0.04 * std::cos(pose.q[0]), 0, 0.04 * std::sin(pose.q[0]));
    const Vec3 crank(-0.05 * std::cos(pose.drives[0]), 0, 0.05 * std::sin(pose.drives[0]));
    const Vec3 rod = Vec3(0, 0, -0.3) + lever - crank;
    const double ratio = rod.dot(Vec3::UnitY().cross(lever)) / rod.dot(Vec3::UnitY().cross(crank));
    EXPECT_EQ(pose.status == PoseStatus::kBeyond, ratio < 0) << pose.q;
  }
  EXPECT_GT(result.CountOf(PoseStatus::kBeyond), 10u);
}

TEST(Standin, RefusesWhatHasNoSerialModel) {
  const auto text = [](const Mechanism& mechanism, const std::vector<std::string>& joints,
                       const StandinSettings& settings = {}) {
    const StandinResult result = ComputeStandin(mechanism, joints, settings);
    EXPECT_TRUE(result.diagnostics.has_errors());
    EXPECT_TRUE(result.poses.empty() || result.usable() == 0);
    return result.diagnostics.Text();
  };
  const Mechanism ankle = Ankle();
  // A triangle of three hinges beside it.
  const std::string locked =
      "bodies:\n  a: {mass: 1, inertia: [1, 1, 1], frames: {end: [1, 0, 0]}}\n"
      "  b: {mass: 1, inertia: [1, 1, 1], frames: {end: [-1, 0, 1]}}\n"
      "  c: {mass: 1, inertia: [1, 1, 1]}\njoints:\n"
      "  A: {kind: revolute, parent: world, child: a, axis: y}\n"
      "  B: {kind: revolute, parent: a.end, child: b, axis: y}\n"
      "  C: {kind: revolute, parent: world.top, child: b.end, axis: y}\n"
      "  D: {kind: revolute, parent: world, child: c, axis: y}\n"
      "world: {frames: {top: [0, 0, 1]}}\ndrives: {motor: {kind: joint, joint: D}}\n";
  EXPECT_THAT(text(Loaded("name: locked\n" + locked), {"A"}), HasSubstr("'A' cannot move at home"));
  EXPECT_THAT(text(ankle, {"ankle.0", "ankel.1"}), HasSubstr("did you mean 'ankle.1'?"));
  EXPECT_THAT(text(ankle, {"ankle.0", "ankle.0"}), HasSubstr("chosen twice"));
  EXPECT_THAT(text(ankle, {"ankle.0"}),
              testing::AllOf(HasSubstr("2 drives move the 1 chosen joint: left, right"),
                             HasSubstr("a set that does: ankle.0, ankle.1")));
  EXPECT_THAT(text(ankle, {"ankle.0", "ankle.1", "left_hinge"}),
              HasSubstr("depend on each other at home: left_hinge"));
  EXPECT_THAT(text(ankle, {"left_heel.0", "ankle.0"}), HasSubstr("is of a spherical joint"));
  EXPECT_THAT(text(ankle, {}), HasSubstr("no joints are chosen"));
  EXPECT_THAT(text(ankle, kPitchRoll, {.ranges = {{"ankle.0", 0.1, 0.1}}}), HasSubstr("is empty"));
  EXPECT_THAT(text(ankle, kPitchRoll, {.ranges = {{"hip", 0.1, 0.2}}}), HasSubstr("not chosen"));
  EXPECT_THAT(text(ankle, kPitchRoll, {.ranges = {}, .resolution = 1000}), HasSubstr("too many"));
  EXPECT_THAT(text(Loaded(kKnee), {"knee"}, {.ranges = {{"knee", 130 * kDeg, 140 * kDeg}}}),
              HasSubstr("no pose of the range can be used: type 2"));
  EXPECT_THAT(
      text(Loaded(Changed(kKnee, {{"knee_motor: {kind: joint, joint: hinge",
                                   "knee_motor: {kind: joint, joint: hinge, range: [2, 3]"}})),
           {"knee"}),
      HasSubstr("at home already, knee_motor is beyond its range"));
}

// A page's numbers are those of the result, and other ones where the result is another.
TEST(Standin, SentencesFollowTheNumbers) {
  StandinResult result = ComputeStandin(Ankle({}, kRotors), kPitchRoll, Grid(5));
  result.map_error = {.median = 0.11, .p95 = 0.53, .worst = 1.25, .at = 12};
  const std::string first = AdviceOf(result).front();
  EXPECT_EQ(first,
            "With the neutral ratio motor torques are wrong by 11 % in the median, by more than "
            "53 % in 5 % of the range (worst 125 %, at ankle.0 0°, ankle.1 0°).");
  for (const char* number : {"53 %", "125 %"}) {
    EXPECT_THAT(StandinPage(result, "ankle"), HasSubstr(number));
  }
  EXPECT_THAT(ToText(result, {}), testing::ContainsRegex("neutral ratio +11 % +53 % +125 %"));
  EXPECT_EQ(ToJson(result, "ankle")["torque_map"]["p95"], 0.53);
  result.map_error.worst = 0.009;
  EXPECT_THAT(AdviceOf(result).front(), HasSubstr("a constant gear does"));
  StandinScene& scene = result.scenes[0];
  scene.full_p95 = {2.0, 2.0};
  for (size_t c = 0; c <= kWhole; ++c) {
    scene.errors[0][c] = scene.errors[1][c] = {.median = 0.0, .p95 = 0.0, .worst = 0.0};
  }
  EXPECT_THAT(AdviceOf(result)[2], HasSubstr("are right within 0 %"));
  result.scenes[1].states = 0;
  EXPECT_THAT(AdviceOf(result)[3], HasSubstr("In motion: no state can be used"));
  scene.errors[1][kWhole] = {.median = 0.2, .p95 = 0.6, .worst = 1.0};
  scene.errors[1][2].p95 = 0.5;
  EXPECT_THAT(AdviceOf(result)[2],
              testing::AllOf(HasSubstr("of right is wrong by 10 % in the median"),
                             HasSubstr("by more than 30 % in 5 % of the states, of the 2 N m"),
                             HasSubstr("by velocity (25 %)")));
  EXPECT_THAT(ToText(result, {}),
              testing::ContainsRegex("right +all +0.2 +0.6 +1 +N m +10 % +30 % +50 %"));
}

}  // namespace
}  // namespace mbv
