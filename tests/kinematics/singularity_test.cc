// Distances from singular poses, against a slider-crank's and a parallelogram's by hand.
#include "kinematics/singularity.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "kinematics/home.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"

namespace mbv {
namespace {

struct Look {
  double scale = 1.0;                  // of all lengths
  std::string rotation = "[0, 0, 0]";  // of the whole in the world
  double shift = 0.0;                  // of the rod's origin along it, in units of its length
};

// Crank 1, rod 3 at this crank angle; the drive is on the slider or on the crank.
Mechanism SliderCrank(double theta, bool slider_driven, const Look& look = {}) {
  const double r = look.scale, l = 3 * look.scale;
  const double phi = -std::asin(r * std::sin(theta) / l);
  const double x = r * std::cos(theta) + l * std::cos(phi);
  LoadResult result =
      LoadModelText(fmt::format(R"(
name: slider_crank
world: {{frames: {{O: {{position: [0, 0, 0], rotation: {{rpy: {0}}}}}}}}}
bodies:
  crank: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [{1:.17g}, 0, 0]}}}}
  rod: {{mass: 1, inertia: [1, 1, 1], frames: {{start: [{2:.17g}, 0, 0], end: [{3:.17g}, 0, 0]}}}}
  slider: {{mass: 1, inertia: [1, 1, 1]}}
joints:
  A: {{kind: revolute, parent: world.O, child: crank, axis: z, guess: {4:.17g}}}
  B: {{kind: revolute, parent: crank.end, child: rod.start, axis: z, guess: {5:.17g}}}
  C: {{kind: revolute, parent: rod.end, child: slider, axis: z, guess: {6:.17g}}}
  D: {{kind: prismatic, parent: world.O, child: slider, axis: x, guess: {7:.17g}}}
drives: {{motor: {{kind: joint, joint: {8}}}}}
)",
                                look.rotation, r, -look.shift * l, (1 - look.shift) * l, theta,
                                phi - theta, -phi, x, slider_driven ? "D" : "A"),
                    "slider_crank.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}

std::vector<Command> OfJoint(const Mechanism& m, const std::string& name) {
  return {{name, {{{Coordinate::Kind::kJoint, m.FindJoint(name), 0}, 1.0}}, {}}};
}

std::vector<SingularityMeter::Distance> AtHome(const Mechanism& m, const std::vector<Command>& x,
                                               const std::vector<std::vector<Pose>>& beside = {}) {
  // What drives hold is found at another pose, too.
  const SingularityMeter meter(m, x, beside);
  BodyStates states;
  states.Resize(m.bodies.size());
  states.X_WB = m.X_WB_home;
  return meter.At(states);
}

// Rates by that of the crank: |ẋ|, L, and V of (1), by hand for r = 1, l = 3.
struct ByHand {
  double slider, crank, V;
  ByHand(double theta, double L) {
    const double phi = -std::asin(std::sin(theta) / 3),
                 phi_rate = -std::cos(theta) / (3 * std::cos(phi));
    const Eigen::Vector2d A_rate(-std::sin(theta), std::cos(theta));
    slider = A_rate[0] - 3 * std::sin(phi) * phi_rate;
    crank = L;
    const Eigen::Vector2d middle = 0.5 * (A_rate + Eigen::Vector2d(slider, 0));
    V = std::sqrt(
        (0.25 + L * L + middle.squaredNorm() + L * L * phi_rate * phi_rate + slider * slider) / 3);
  }
};

TEST(Singularity, DistancesOfASliderCrankAreThoseByHand) {
  for (const double theta : {0.02, 0.4, 1.3, 2.9}) {
    const Mechanism by_slider = SliderCrank(theta, true), by_crank = SliderCrank(theta, false);
    const ByHand hand(theta, CharacteristicLength(by_slider));
    const double slider = std::abs(hand.slider) / hand.V, crank = hand.crank / hand.V;
    // Kinds in turn: commanded, drive. What the one calls inverse is forward of the other.
    const auto a = AtHome(by_slider, OfJoint(by_slider, "A"));
    const auto b = AtHome(by_crank, OfJoint(by_crank, "D"));
    EXPECT_NEAR(a[0].value, crank, 1e-9);
    EXPECT_NEAR(a[1].value, slider, 1e-9);
    EXPECT_NEAR(b[0].value, slider, 1e-9);
    EXPECT_NEAR(b[1].value, crank, 1e-9);
    EXPECT_GT(a[2].value, 0.1);  // loops close everywhere
    // Another angle is another distance.
    const ByHand other(theta + 1e-3, CharacteristicLength(by_slider));
    EXPECT_GT(std::abs(a[1].value - std::abs(other.slider) / other.V), 1e-6);
  }
  EXPECT_LT(AtHome(SliderCrank(0.0, true), {}, {SliderCrank(0.6, true).X_WB_home})[1].value, 1e-9);
  EXPECT_TRUE(std::isnan(AtHome(SliderCrank(0.4, true), {})[0].value));
}

TEST(Singularity, DistancesDependNeitherOnUnitsNorOnFrames) {
  const Mechanism usual = SliderCrank(0.4, true);
  const auto expected = AtHome(usual, OfJoint(usual, "A"));
  for (const Look& look :
       {Look{.scale = 1000.0}, Look{.rotation = "[0.3, -1.1, 2]"}, Look{.shift = 0.7}}) {
    const Mechanism m = SliderCrank(0.4, true, look);
    const auto distances = AtHome(m, OfJoint(m, "A"));
    for (size_t kind = 0; kind < 3; ++kind) {
      EXPECT_NEAR(distances[kind].value, expected[kind].value, 1e-9) << kind;
    }
  }
}

// Both ways on from a flat parallelogram are open: its joints lose a constraint.
Mechanism Parallelogram(double angle) {
  LoadResult result = LoadModelText(fmt::format(R"(
name: parallelogram
world: {{frames: {{A: [0, 0, 0], D: [2, 0, 0]}}}}
bodies:
  left: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [1, 0, 0]}}}}
  top: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [2, 0, 0]}}}}
  right: {{mass: 1, inertia: [1, 1, 1], frames: {{end: [1, 0, 0]}}}}
joints:
  A: {{kind: revolute, parent: world.A, child: left, axis: z, guess: {0:.17g}}}
  B: {{kind: revolute, parent: left.end, child: top, axis: z, guess: {1:.17g}}}
  C: {{kind: revolute, parent: top.end, child: right.end, axis: z, guess: {0:.17g}}}
  D: {{kind: revolute, parent: world.D, child: right, axis: z, guess: {0:.17g}}}
drives: {{motor: {{kind: joint, joint: A}}}}
)",
                                                angle, -angle),
                                    "parallelogram.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.mechanism.value_or(Mechanism());
}

TEST(Singularity, AFlatParallelogramIsAConstraintSingularity) {
  // The rank is that of a pose beside it.
  const auto distance = [](double angle) {
    const Mechanism m = Parallelogram(angle);
    const SingularityMeter meter(m, {}, {Parallelogram(0.5).X_WB_home});
    BodyStates states;
    states.Resize(m.bodies.size());
    states.X_WB = m.X_WB_home;
    return meter.At(states)[2].value;
  };
  EXPECT_LT(distance(0.0), 1e-8);
  const double d = distance(0.01);
  EXPECT_GT(d, 1e-3);
  EXPECT_NEAR(distance(0.02) / d, 2.0, 2e-3);
  EXPECT_NEAR(distance(-0.01), d, 1e-6);
}

// Turned evenly through the slider's dead centre, between two samples.
TEST(Singularity, AMotionsNearestSampleIsFoundWithItsForces) {
  Motion motion{.duration_s = 10.0, .sample_s = 0.02, .commands = {}, .loads = {}};
  const Mechanism m = SliderCrank(0.4, true);
  motion.commands = {{"motor", {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}}, {}}};
  const std::vector<double> time_s = SampleTimes(motion.duration_s, motion.sample_s);
  std::vector<std::vector<Pose>> X_WB;
  Trace trace;
  trace.Reset(time_s, {MakeChannel(Quantity::kForce, "N", "motor")});
  const double dead_s = 6.2034;
  for (size_t i = 0; i < time_s.size(); ++i) {
    const double theta = 0.1 * (time_s[i] - dead_s);
    X_WB.push_back(SliderCrank(theta, true).X_WB_home);
    trace.values(static_cast<Eigen::Index>(i), 0) = 1.0 / std::sin(theta);
  }
  const SingularApproaches found = ApproachesOf(m, motion, time_s, X_WB, &trace);
  ASSERT_EQ(found.of.size(), 2u);  // no output: nothing is inverse
  const SingularApproach& forward = found.of[0];
  EXPECT_EQ(forward.kind, SingularityKind::kForward);
  EXPECT_TRUE(forward.asked && forward.close());
  EXPECT_NEAR(forward.time_s, 6.2, 1e-9);
  const ByHand hand(0.1 * (6.2 - dead_s), found.length_m);
  EXPECT_NEAR(forward.distance, std::abs(hand.slider) / hand.V, 1e-9);
  EXPECT_EQ(forward.drive, "motor");
  EXPECT_NEAR(forward.force_near, 1.0 / std::sin(0.00034), 1e-6);
  EXPECT_GT(forward.force_near, 100 * forward.force_median);
  EXPECT_LT(found.poses, 200u);
  EXPECT_FALSE(found.of[1].close());
  // Away from it nothing is close.
  const size_t half = X_WB.size() / 2;
  const SingularApproaches away = ApproachesOf(
      m, motion, time_s, {X_WB.begin(), X_WB.begin() + static_cast<std::ptrdiff_t>(half)}, &trace);
  EXPECT_FALSE(away.of[0].close());
  EXPECT_GT(away.of[0].distance, kCloseToSingular);
}

}  // namespace
}  // namespace mbv
