// Many loops that hang together in other ways than a chain.
#include <gtest/gtest.h>

#include <numbers>

#include "reference/reference.h"
#include "tests/mechanisms/loop_shapes.h"

namespace mbv {
namespace {

RunSummary SwingOf(const std::string& text, double amplitude) {
  const Mechanism mechanism = MechanismOf(text);
  Motion motion = SwingAllDrives(mechanism, amplitude);
  motion.sample_s = 0.05;
  const ReferenceRun run = RunReference(mechanism, motion);
  return run.summary;
}

TEST(LoopShapes, AllOfThemMove) {
  EXPECT_TRUE(SwingOf(ScissorLiftText(12), 0.1).ok());
  EXPECT_TRUE(SwingOf(StoreysText(12), 0.1).ok());
  EXPECT_TRUE(SwingOf(NetOfPlatesText(4), 0.3).ok());
  EXPECT_TRUE(SwingOf(HexapodsText(3), 0.01).ok());
  EXPECT_TRUE(SwingOf(LongLoopText(24), 0.01).ok());
}

// From the drive's home to an angle.
RunSummary TurnOfNet(int width, double to_rad) {
  const Mechanism net = MechanismOf(NetOfPlatesText(width));
  const double home = HomeValue(net, {Coordinate::Kind::kDrive, 0, 0});
  Motion motion = SwingAllDrives(net, 0.0);
  motion.sample_s = 0.02;
  motion.commands[0].profile = {{ConstantTerm{home}, RampTerm{(to_rad - home) / 0.1}}};
  return RunReference(net, motion).summary;
}

// Which of a net's redundant rows are taken for the independent ones decides how well they hold it,
// and the wider the net the worse a bad choice: it must not decide what counts as singular.
TEST(LoopShapes, WideNetsAreRegularWhereNarrowOnesAre) {
  for (const int width : {4, 8, 11, 14}) {
    const RunSummary swing = SwingOf(NetOfPlatesText(width), 0.1);
    EXPECT_TRUE(swing.ok()) << width << ": " << swing.message;
    const RunSummary turn = TurnOfNet(width, 0.5);
    EXPECT_TRUE(turn.ok()) << width << ": " << turn.message;
  }
}

// At a right angle all loops are flat.
TEST(LoopShapes, AFlatNetIsSingularHoweverWide) {
  for (const int width : {1, 4, 11}) {
    const RunSummary flat = TurnOfNet(width, -0.5 * std::numbers::pi);
    EXPECT_EQ(flat.stop, Stop::kSingular) << width << ": " << flat.message;
    EXPECT_FALSE(flat.where.empty()) << width;
  }
}

}  // namespace
}  // namespace mbv
