// Distances from singular poses, against a slider-crank's and a parallelogram's by hand.
#include "kinematics/singularity.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "kinematics/constraints.h"
#include "kinematics/home.h"
#include "mechanism/reach.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/loop_shapes.h"
#include "tests/support/source_dir.h"

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

// Of dense matrices and of sparse ones, at the pose to which all joint drives lead from home.
struct BothWays {
  std::vector<SingularityMeter::Distance> dense, sparse;
};

Mechanism DrivenOn(const Mechanism& mechanism, double by) {
  Mechanism moved = mechanism;
  for (Joint& joint : moved.joints) joint.guess = joint.home;
  for (const Drive& drive : moved.drives) {
    if (const auto* on = std::get_if<JointDrive>(&drive.kind)) {
      moved.joints[static_cast<size_t>(on->joint)].guess[static_cast<size_t>(on->coordinate)] += by;
    }
  }
  SolveHome(&moved);
  return moved;
}

// Of all coordinates but those driven: more than it takes.
std::vector<Command> OthersOf(const Mechanism& m) {
  std::vector<Command> commands;
  for (const NamedCoordinate& named : NamedMotionCoordinates(m)) {
    if (named.coordinate.kind == Coordinate::Kind::kDrive ||
        named.coordinate.kind == Coordinate::Kind::kPrescribed) {
      continue;
    }
    commands.push_back({named.name, {{named.coordinate, 1.0}}, {}});
  }
  return commands;
}

BothWays DistancesAt(const Mechanism& m, double by, const std::vector<Command>& x) {
  const Mechanism moved = DrivenOn(m, by);
  BodyStates states;
  states.Resize(m.bodies.size());
  states.X_WB = moved.X_WB_home;
  FollowCouplings(m, &states);
  const std::vector<std::vector<Pose>> beside = {DrivenOn(m, 0.013).X_WB_home};
  const SingularityMeter dense(m, x, beside, std::numeric_limits<int>::max());
  const SingularityMeter sparse(m, x, beside, 0);
  return {dense.At(states), sparse.At(states)};
}

// Squares of singular values have the rounding of the largest, which is of the order one.
double RoundingOf(double distance) { return 1e-9 * distance + 1e-14 / std::max(distance, 1e-8); }

void ExpectSame(const BothWays& at, const std::string& where) {
  for (size_t kind = 0; kind < 3; ++kind) {
    const double dense = at.dense[kind].value, sparse = at.sparse[kind].value;
    ASSERT_EQ(std::isnan(dense), std::isnan(sparse)) << where << " " << kind;
    if (std::isnan(dense)) continue;
    EXPECT_NEAR(sparse, dense, RoundingOf(dense)) << where << " " << kind;
  }
}

TEST(SparseSingularity, DistancesAreThoseOfDenseMatricesForManyLoops) {
  for (const std::string& text :
       {ScissorLiftText(9), ScissorLiftText(5, true), StoreysText(5), StoreysText(3, true),
        NetOfPlatesText(4), HexapodsText(2), LongLoopText(14), LongLoopText(11, true)}) {
    const Mechanism m = MechanismOf(text);
    for (const double by : {0.0, 0.02, -0.05}) {
      ExpectSame(DistancesAt(m, by, OthersOf(m)), m.name + fmt::format(" {}", by));
    }
    // A pose beside it has other distances.
    const BothWays here = DistancesAt(m, 0.02, {}), beside = DistancesAt(m, 0.02 + 1e-4, {});
    EXPECT_GT(std::abs(beside.sparse[2].value - here.dense[2].value),
              10 * RoundingOf(here.dense[2].value))
        << m.name;
  }
}

TEST(SparseSingularity, DistancesAreThoseOfDenseMatricesForShippedModels) {
  int models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const LoadResult loaded = LoadModel((entry.path() / "model.yaml").string());
    if (!loaded.mechanism) continue;
    ++models;
    ExpectSame(DistancesAt(*loaded.mechanism, 0.01, OthersOf(*loaded.mechanism)),
               loaded.mechanism->name);
  }
  EXPECT_GE(models, 20);
}

TEST(SparseSingularity, DistancesAreThoseOfDenseMatricesNearSingularPoses) {
  const auto at = [](const Mechanism& m, const std::vector<Command>& x, int most_dense,
                     const Mechanism& beside) {
    const SingularityMeter meter(m, x, {beside.X_WB_home}, most_dense);
    BodyStates states;
    states.Resize(m.bodies.size());
    states.X_WB = m.X_WB_home;
    return meter.At(states);
  };
  const int all = std::numeric_limits<int>::max();
  for (const double from_singular : {1e-2, 1e-4, 1e-6, 0.0}) {
    // The drives lose hold, the output loses a direction.
    for (const bool slider_driven : {true, false}) {
      const Mechanism m = SliderCrank(from_singular, slider_driven);
      const Mechanism beside = SliderCrank(0.6, slider_driven);
      const std::vector<Command> x = OfJoint(m, slider_driven ? "A" : "D");
      ExpectSame({at(m, x, all, beside), at(m, x, 0, beside)}, m.name);
    }
    // Loops lose a constraint: at the very pose what moves has no meaning.
    const Mechanism m = Parallelogram(from_singular), beside = Parallelogram(0.5);
    const auto dense = at(m, {}, all, beside), sparse = at(m, {}, 0, beside);
    EXPECT_NEAR(sparse[2].value, dense[2].value, 1e-8 + 1e-9 * dense[2].value) << from_singular;
    if (from_singular > 1e-5) {
      EXPECT_NEAR(sparse[1].value, dense[1].value, 1e-7) << from_singular;
    }
  }
}

}  // namespace
}  // namespace mbv
