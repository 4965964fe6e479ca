// A benchmark with a published solution: Andrews' squeezing mechanism, seven bodies in three loops.
#include <gtest/gtest.h>

#include "base/demand.h"
#include "reference/forward.h"
#include "scenario/load_scenario.h"
#include "simulation/engine/simulation.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// beta, its rate and gamma at 0.03 s [Mazzia, Magherini: Test set for initial value problem
// solvers, release 2.4, University of Bari 2008, II-7], computed there with tolerance 1e-14.
constexpr double kBeta = 15.81077119629904, kBetaRate = 1139.920302151208;
constexpr double kGamma = 0.04082224013073101;
// Loops closed to 1e-13 m leave 1.4e-11 rad of the crank of 7 mm open; the reference finds that
// distances of all bodies together grow 37 times, those of the crank most: ten times that.
constexpr double kAngle = 1.4e-11 * 37 * 10;
constexpr double kRelativeRate = 1e-9;

struct Benchmark {
  Mechanism mechanism;
  Motion motion;
  double step_s;

  Benchmark() {
    ScenarioResult result =
        LoadScenario(std::string(kSourceDir) + "/scenarios/andrews_squeezer/benchmark.yaml");
    MBV_DEMAND(result.scenario.has_value() && result.mechanism.has_value(),
               result.diagnostics.Text());
    mechanism = *std::move(result.mechanism);
    motion = result.scenario->motion;
    step_s = result.scenario->simulation.step_s;
  }
};

double Last(const Trace& trace, const std::string& channel) {
  return trace.values(trace.values.rows() - 1, trace.Find(channel));
}

TEST(AndrewsSqueezer, TheReferenceEndsWhereThePublishedSolutionDoes) {
  Benchmark b;
  const ForwardRun run = RunForwardReference(b.mechanism, b.motion, {.measure_trust = false});
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(Last(run.trace, "motor.position"), kBeta, kAngle);
  EXPECT_NEAR(Last(run.trace, "lever.yaw"), kGamma, kAngle);
  EXPECT_NEAR(Last(run.trace, "motor.velocity"), kBetaRate, kRelativeRate * kBetaRate);
  // Mutation: a millionth more torque is seen.
  b.motion.forces[0].force = Constant(0.033 * (1 + 1e-6));
  const ForwardRun perturbed = RunForwardReference(b.mechanism, b.motion, {.measure_trust = false});
  EXPECT_GT(std::abs(Last(perturbed.trace, "motor.position") - kBeta), 100 * kAngle);
}

TEST(AndrewsSqueezer, TheSimulationEndsThereToo) {
  const Benchmark b;
  SimulationOptions options{.step_s = b.step_s};
  ASSERT_TRUE(InitialStates(b.mechanism, b.motion, &options.start).ok());
  const auto undriven = [](double, DrivenSample* driven) {
    for (VecX* x : {&driven->position, &driven->velocity, &driven->acceleration}) x->setZero(1);
    return RunSummary::Done();
  };
  const SimulationRun run = Simulate(b.mechanism, b.motion, undriven, options);
  ASSERT_TRUE(run.summary.ok()) << run.summary.message;
  EXPECT_NEAR(Last(run.trace, "motor.position"), kBeta, kAngle);
  EXPECT_NEAR(Last(run.trace, "lever.yaw"), kGamma, kAngle);
  EXPECT_NEAR(Last(run.trace, "motor.velocity"), kBetaRate, kRelativeRate * kBetaRate);
}

}  // namespace
}  // namespace mbv
