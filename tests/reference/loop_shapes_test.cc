// Many loops that hang together in other ways than a chain.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace mbv
