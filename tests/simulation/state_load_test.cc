// Loads that follow the mechanism's state, in MuJoCo, against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reference/forward.h"
#include "simulation/engine/simulation.h"
#include "tests/mechanisms/simulated.h"

namespace mbv::fixtures {
namespace {

using std::numbers::pi;

SimulationRun RunFree(const Mechanism& m, const Motion& motion) {
  SimulationOptions options;
  EXPECT_TRUE(InitialStates(m, motion, &options.start).ok());
  return Simulate(m, motion, HoldStill(std::vector<double>(m.drives.size(), 0.0)), options);
}

// The motor turns evenly.
DrivenMotion Turning(double start, double rate) {
  return [=](double t_s, DrivenSample* driven) {
    driven->position = VecX::Constant(1, start + rate * t_s);
    driven->velocity = VecX::Constant(1, rate);
    driven->acceleration = VecX::Zero(1);
    return RunSummary::Done();
  };
}

double At(const SimulationRun& run, size_t i, const std::string& channel) {
  return run.trace.values(static_cast<Eigen::Index>(i), run.trace.Find(channel));
}

// Through three rotations, in both modes.
TEST(StateLoads, CountRotationsOfWhatTheyFollowInCommandedMotion) {
  const Mechanism m = MakePivotedBar(0.0);
  const double rate = 6.0 * pi;
  for (const DriveMode mode : {DriveMode::kPrescribedMotion, DriveMode::kInverse}) {
    for (const Coordinate& coordinate : kAnglesOfBar) {
      Motion motion{.duration_s = 1.0, .sample_s = 0.05, .commands = {}, .loads = {}};
      motion.loads = {SpringOn(coordinate, 3.0)};
      const SimulationRun run = Simulate(m, motion, Turning(0.3, rate), {.mode = mode});
      ASSERT_TRUE(run.summary.ok()) << run.summary.message;
      for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
        EXPECT_NEAR(At(run, i, "motor.force"), 3.0 * (rate * run.trace.time_s[i] - 0.1), 1e-8) << i;
      }
    }
  }
}

// J q̈ = −k (q − 0.4), far beyond half a rotation: a count that misses one by a whole rotation
// would be 2π k/J off in q̈.
TEST(StateLoads, CountRotationsOfWhatTheyFollowInFreeMotion) {
  const Mechanism m = MakePivotedBar(0.0);
  const double k = 0.5, w = std::sqrt(k / 0.072);
  for (const Coordinate& coordinate : kAnglesOfBar) {
    Motion motion = FreeMotion(m, 0.4, 40.0, 2.0);
    motion.loads = {SpringOn(coordinate, k)};
    const SimulationRun run = RunFree(m, motion);
    ASSERT_TRUE(run.summary.ok()) << run.summary.message;
    double most = 0.0;
    for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
      const double angle = At(run, i, "motor.position");
      EXPECT_NEAR(angle, 0.4 + 40.0 / w * std::sin(w * run.trace.time_s[i]), 1e-8) << i;
      most = std::max(most, angle);
    }
    EXPECT_GT(most, 4.0 * pi);
  }
}

TEST(StateLoads, ThatAreNotFiniteAreNamedInEveryMode) {
  const Mechanism m = MakePivotedBar();
  for (const bool infinite : {false, true}) {
    Motion commanded{.duration_s = 1.0, .sample_s = 0.05, .commands = {}, .loads = {}};
    commanded.loads = {NotFiniteBeyond(0.9, infinite)};
    Motion free = FreeMotion(m, 0.3, 6.0, 1.0);
    free.loads = commanded.loads;
    const auto run = [&](DriveMode mode, Engine engine) {
      return Simulate(m, commanded, Turning(0.3, 1.0), {.mode = mode, .engine = engine}).summary;
    };
    for (const RunSummary& summary :
         {run(DriveMode::kPrescribedMotion, Engine::kCorrected),
          run(DriveMode::kPrescribedMotion, Engine::kDefaults),
          run(DriveMode::kInverse, Engine::kCorrected), RunFree(m, free).summary}) {
      EXPECT_TRUE(NamesTheLoad(summary, infinite)) << summary.message;
      EXPECT_GT(summary.time_s, 0.05);
    }
  }
}

}  // namespace
}  // namespace mbv::fixtures
