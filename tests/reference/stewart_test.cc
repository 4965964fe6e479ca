// The Stewart platform's inverse kinematics by hand: leg i has the length |p + R A_i − B_i|, with
// B_i on the base, A_i on the platform in its own axes, p and R the platform's pose.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <numbers>
#include <random>

#include "math/spatial.h"
#include "model_file/load_model.h"
#include "reference/reference.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// The model's numbers, written down once more.
constexpr double kBase_m = 0.48, kTop_m = 0.30, kHeight_m = 0.40;

struct Leg {
  Vec3 base, top;
};

std::array<Leg, 6> Legs() {
  const double pi = std::numbers::pi;
  const double gap = pi / 3 - std::acos(4.0 / 5.0);
  const auto on = [](double radius, double azimuth) {
    return Vec3(radius * std::cos(azimuth), radius * std::sin(azimuth), 0.0);
  };
  std::array<Leg, 6> legs;
  for (int k = 0; k < 3; ++k) {
    // Base joints in pairs about 0°, 120°, 240°; platform joints in pairs about 60°, 180°, 300°.
    const double base = 2 * pi * k / 3, top = base + pi / 3;
    legs[static_cast<size_t>(2 * k)] = {on(kBase_m, base + gap / 2), on(kTop_m, top - gap / 2)};
    const double next = base + 2 * pi / 3;
    legs[static_cast<size_t>(2 * k + 1)] = {on(kBase_m, next - gap / 2), on(kTop_m, top + gap / 2)};
  }
  return legs;
}

Mechanism Stewart() {
  LoadResult loaded = LoadModel(SourcePath("/models/stewart/model.yaml"));
  if (!loaded.mechanism.has_value()) throw std::runtime_error(loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

// Six constant commands of the platform's pose: x, y, z, roll, pitch, yaw.
Motion At(const std::array<double, 6>& pose) {
  Motion motion;
  motion.duration_s = 0.0;
  motion.sample_s = 0.01;
  for (int c = 0; c < 6; ++c) {
    motion.commands.push_back({"pose" + std::to_string(c),
                               {{{Coordinate::Kind::kOutput, 0, c}, 1.0}},
                               {{ConstantTerm{pose[static_cast<size_t>(c)]}}}});
  }
  return motion;
}

// By hand, about the fixed axes: R = Rz(yaw) Ry(pitch) Rx(roll).
double Length(const Leg& leg, const std::array<double, 6>& pose) {
  const Mat3 R =
      (Eigen::AngleAxisd(pose[5], Vec3::UnitZ()) * Eigen::AngleAxisd(pose[4], Vec3::UnitY()) *
       Eigen::AngleAxisd(pose[3], Vec3::UnitX()))
          .toRotationMatrix();
  return (Vec3(pose[0], pose[1], pose[2]) + R * leg.top - leg.base).norm();
}

// The reference stops at a loop gap of 1e-13 m; a leg takes at most that, and rounding.
constexpr double kTolerance_m = 1e-12;

VecX LegsByReference(const Mechanism& mechanism, const std::array<double, 6>& pose) {
  const ReferenceRun run = RunReference(mechanism, At(pose));
  EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  VecX lengths = VecX::Constant(6, kNan);
  for (int i = 0; i < 6; ++i) {
    const int column = run.trace.Find("leg" + std::to_string(i + 1) + ".length.position");
    if (column >= 0 && run.trace.values.rows() > 0) lengths(i) = run.trace.values(0, column);
  }
  return lengths;
}

TEST(Stewart, AtHomeAllLegsHaveTheLengthOfPythagoras) {
  // Base and platform joint of a leg stand acos(4/5) apart: d² = R² + r² − 2 R r · 4/5.
  const double d2 = kBase_m * kBase_m + kTop_m * kTop_m - 1.6 * kBase_m * kTop_m;
  const double length = std::sqrt(d2 + kHeight_m * kHeight_m);
  const std::array<double, 6> home = {0, 0, kHeight_m, 0, 0, 0};
  const VecX legs = LegsByReference(Stewart(), home);
  for (const Leg& leg : Legs()) EXPECT_NEAR(Length(leg, home), length, kTolerance_m);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(legs(i), length, kTolerance_m) << "leg " << i + 1;
}

TEST(Stewart, AtRandomPosesTheLegsHaveTheLengthsOfTheFormula) {
  const Mechanism mechanism = Stewart();
  std::mt19937_64 random(1965);
  std::uniform_real_distribution<double> shift(-0.06, 0.06), turn(-0.25, 0.25);
  for (int k = 0; k < 40; ++k) {
    const std::array<double, 6> pose = {shift(random), shift(random), kHeight_m + shift(random),
                                        turn(random),  turn(random),  turn(random)};
    const VecX legs = LegsByReference(mechanism, pose);
    for (int i = 0; i < 6; ++i) {
      EXPECT_NEAR(legs(i), Length(Legs()[static_cast<size_t>(i)], pose), kTolerance_m)
          << "pose " << k << ", leg " << i + 1 << ", seed 1965";
    }
  }
}

TEST(Stewart, APlatformJointOffByAMicrometreWouldBeNoticed) {
  const std::array<double, 6> pose = {0.02, -0.03, 0.42, 0.1, -0.05, 0.2};
  const VecX legs = LegsByReference(Stewart(), pose);
  Leg perturbed = Legs()[0];
  perturbed.top.x() += 1e-6;
  EXPECT_GT(std::abs(legs(0) - Length(perturbed, pose)), 1e3 * kTolerance_m);
}

// The six legs with balls at both ends, and the same with one end universal, where a leg's turn
// about its line is what the universal joint makes of it: with next to no inertia about the line
// that is the same mechanism.
Mechanism WithLegs(bool balls, const std::string& along) {
  const std::string leg = ", lower: {mass: 1.5, com: 0.125, along: " + along +
                          ", across: 0.006}, upper: {mass: 1, com: 0.11, along: " + along +
                          ", across: 0.004}}\n";
  std::string world = "world: {frames: {", platform;
  const auto legs = Legs();
  for (int i = 0; i < 6; ++i) {
    const Leg& at = legs[static_cast<size_t>(i)];
    const auto point = [&](const char* name, const Vec3& p) {
      return fmt::format("{}{}: [{:.17g}, {:.17g}, {:.17g}], ", name, i + 1, p.x(), p.y(), p.z());
    };
    world += point("B", at.base);
    platform += point("A", at.top);
  }
  std::string text =
      "name: six\n" + world + "}}\n" +
      "bodies:\n  platform: {mass: 12, com: [0, 0, 0.01], inertia: [0.3, 0.3, 0.5], frames: {" +
      platform + "}}\n" +
      "joints:\n  float: {kind: free, parent: world, child: platform, guess: [0, 0, 0.4, 0, 0, 0],"
      " closure: false}\noutputs: {platform: platform}\nlegs:\n";
  for (int i = 1; i <= 6; ++i) {
    text += fmt::format("  leg{0}: {{from: world.B{0}, to: platform.A{0}, length: 0.5{1}{2}", i,
                        balls ? ", ends: [spherical, spherical]" : "", leg);
  }
  LoadResult loaded = LoadModelText(text, "six.yaml");
  if (!loaded.mechanism.has_value()) throw std::runtime_error(loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

ReferenceRun Dance(const Mechanism& mechanism) {
  Motion motion = At({0.0, 0.0, kHeight_m, 0.0, 0.0, 0.0});
  motion.duration_s = 1.0;
  for (size_t c = 0; c < 6; ++c) {
    const double size = c < 3 ? 0.03 : 0.2;
    motion.commands[c].profile.terms.push_back(
        SineTerm{.amplitude = size,
                 .frequency_hz = 1.0 + 0.2 * static_cast<double>(c),
                 .phase_rad = static_cast<double>(c)});
  }
  ReferenceRun run = RunReference(mechanism, motion);
  EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  return run;
}

double LargestForceDifference(const ReferenceRun& a, const ReferenceRun& b) {
  double largest = 0.0;
  for (int i = 1; i <= 6; ++i) {
    const std::string name = "leg" + std::to_string(i) + ".length.force";
    const VecX difference =
        a.trace.values.col(a.trace.Find(name)) - b.trace.values.col(b.trace.Find(name));
    largest = std::max(largest, difference.cwiseAbs().maxCoeff());
  }
  return largest;
}

TEST(Stewart, LegsWithTwoBallsAreLegsWithOneWhereNothingHasInertiaAboutTheLine) {
  const ReferenceRun balls = Dance(WithLegs(true, "1e-10"));
  EXPECT_LT(LargestForceDifference(balls, Dance(WithLegs(false, "1e-10"))), 1e-8);
  // An inertia about the line is felt by the universal joint alone.
  EXPECT_LT(LargestForceDifference(balls, Dance(WithLegs(true, "0.001"))), 1e-10);
  EXPECT_GT(LargestForceDifference(balls, Dance(WithLegs(false, "0.001"))), 1e-3);
}

// What turns the leg about its line is reported: the spin would not stay what it was.
TEST(Stewart, AMomentAboutALegsLineIsNotAnIdleSpin) {
  Mechanism mechanism = WithLegs(true, "0.001");
  Motion motion = At({0.0, 0.0, kHeight_m, 0.0, 0.0, 0.0});
  Load load;
  load.body = mechanism.FindBody("leg3.upper");
  load.moment[2].terms.push_back(ConstantTerm{1e-3});
  motion.loads.push_back(load);
  const ReferenceRun run = RunReference(mechanism, motion);
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_NE(run.summary.message.find("about the line through both balls of leg3 changes its spin"),
            std::string::npos)
      << run.summary.message;
}

}  // namespace
}  // namespace mbv
