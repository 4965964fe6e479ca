// Which turn angles are in that no command counts: of a motor behind a screw, whose nut is
// prescribed.
#include <gtest/gtest.h>

#include <numbers>

#include "model_file/load_model.h"
#include "reference/forward.h"
#include "tests/reference/fixture.h"

namespace mbv::fixtures {
namespace {

constexpr double kLead = 0.005, kStiffness = 2e-4;
constexpr double kPerMetre = 2 * std::numbers::pi / kLead;  // the motor's angle [rad/m]

// The motor turns the screw in its bearing, against the turn of the screw in the nut; a spring
// winds up between screw and nut.
Mechanism Jack() {
  LoadResult loaded = LoadModelText(
      "name: jack\n"
      "gravity: [0, 0, 0]\n"
      "bodies: {screw: {mass: 1, inertia: [1e-4, 1e-4, 1e-4]}, nut: {mass: 2, inertia: [1, 1, "
      "1]}}\n"
      "joints:\n"
      "  bearing: {kind: revolute, parent: world, child: screw, axis: x}\n"
      "  thread: {kind: helical, parent: screw, child: nut, axis: x, lead: 0.005}\n"
      "  key: {kind: prismatic, parent: world, child: nut, axis: x, closure: true}\n"
      "drives: {motor: {kind: joint, joint: bearing}}\n"
      "elements: {wound: {kind: spring, joint: thread, coordinate: 1, stiffness: 2e-4}}\n"
      "outputs: {nut: nut}\n",
      "jack.yaml");
  if (!loaded.mechanism) throw std::runtime_error(loaded.diagnostics.Text());
  return *std::move(loaded.mechanism);
}

// From six turns beside home, by up to three turns and more from sample to sample.
TEST(Turns, OfAMotorWhoseNutCannotTurnAreCounted) {
  const Mechanism m = Jack();
  Motion motion;
  motion.duration_s = 2.0;
  motion.sample_s = 0.1;
  motion.commands = {Commanded("nut.x", Coordinate::Kind::kOutput, 0, 0,
                               Profile{{ConstantTerm{0.03}, SineTerm{0.05, 0.5, 0}}})};
  const ReferenceRun run = RunReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  double farthest = 0.0;
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double x = At(run.trace, i, "nut.x"), q = At(run.trace, i, "motor.position");
    EXPECT_NEAR(q, -kPerMetre * x, 1e-10) << i;
    EXPECT_NEAR(At(run.trace, i, "energy.springs"), 0.5 * kStiffness * q * q, 1e-11) << i;
    if (i > 0) farthest = std::max(farthest, std::abs(q - At(run.trace, i - 1, "motor.position")));
  }
  EXPECT_GT(farthest, 3 * 2 * std::numbers::pi);
}

// The spring unwinds: m ẍ = −k (2π/h)² x with the screw's inertia, reduced to the nut.
TEST(Turns, OfAMotorThatRunsFreeAreCounted) {
  const Mechanism m = Jack();
  Motion motion;
  motion.duration_s = 1.0;
  motion.sample_s = 0.1;
  motion.initial = {{"nut.x", {Coordinate::Kind::kOutput, 0, 0}, 0.04, 0.0}};
  motion.forces = {{.drive = 0, .force = Constant(0.0)}};
  const ForwardRun run = RunForwardReference(m, motion);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  const double inertia = 2.0 / (kPerMetre * kPerMetre) + 1e-4;
  const double rate = std::sqrt(kStiffness / inertia);
  for (Eigen::Index i = 0; i < run.trace.values.rows(); ++i) {
    const double q = -kPerMetre * 0.04 * std::cos(rate * 0.1 * static_cast<double>(i));
    EXPECT_NEAR(At(run.trace, i, "motor.position"), q, 1e-9) << i;
  }
}

}  // namespace
}  // namespace mbv::fixtures
