// Idle spins in the simulation: a rate of zero about each line, forces as with a universal joint,
// and moments that would turn them reported.
#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <string>

#include "base/demand.h"
#include "mechanism/idle_spins.h"
#include "reference/reference.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

struct SpinningLegs {
  Mechanism mechanism;
  Motion motion;
  std::optional<ReferenceSolver> solver;

  SpinningLegs() {
    ScenarioResult loaded = LoadScenario(SourcePath("/scenarios/stewart_balls/dance_inverse.yaml"));
    MBV_DEMAND(loaded.scenario && loaded.mechanism, loaded.diagnostics.Text());
    mechanism = *std::move(loaded.mechanism);
    motion = loaded.scenario->motion;
    motion.duration_s = 0.5;
  }

  SimulationRun Run(const SimulationOptions& options) {
    solver.emplace(mechanism, motion);
    const auto driven = [this, sample = ReferenceSample(), command = CommandSample()](
                            double t_s, DrivenSample* at) mutable {
      EvaluateMotion(motion, t_s, &command);
      RunSummary summary = solver->Kinematics(command, &sample);
      *at = sample.driven;
      return summary;
    };
    return Simulate(mechanism, motion, driven, options);
  }
};

Load TurnOfLeg3(const Mechanism& mechanism, double moment_Nm) {
  Load load;
  load.body = mechanism.FindBody("leg3.upper");
  load.moment[2].terms.push_back(ConstantTerm{moment_Nm});
  return load;
}

TEST(SimulatedIdleSpins, AMomentAboutALineIsReportedInInverseMode) {
  SpinningLegs legs;
  legs.motion.loads.push_back(TurnOfLeg3(legs.mechanism, 1e-3));
  const SimulationRun run = legs.Run({.mode = DriveMode::kInverse});
  EXPECT_EQ(run.summary.stop, Stop::kUnsupported);
  EXPECT_NE(run.summary.message.find("about the line through both balls of leg3 changes its spin"),
            std::string::npos)
      << run.summary.message;
}

TEST(SimulatedIdleSpins, WithoutOneTheRunIsWhole) {
  SpinningLegs legs;
  ASSERT_EQ(IdleSpins(legs.mechanism).size(), 6u);
  for (const DriveMode mode : {DriveMode::kInverse, DriveMode::kPrescribedMotion}) {
    const SimulationRun run = legs.Run({.mode = mode});
    EXPECT_TRUE(run.summary.ok()) << run.summary.message;
  }
}

}  // namespace
}  // namespace mbv
