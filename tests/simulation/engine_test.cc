// MuJoCo's errors and warnings, and what becomes of them.

#include "simulation/engine/engine.h"

#include <gtest/gtest.h>

#include "simulation/engine/simulation.h"
#include "tests/mechanisms/simulated.h"

namespace mbv {
namespace {

using simulation::EngineError;
using simulation::EngineSession;

TEST(Engine, AnErrorOfMuJoCoIsThrownAndNotWaitedFor) {
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  EXPECT_THROW(mju_error("the end"), EngineError);
}

TEST(Engine, WarningsAreCollectedByTheInnermostSession) {
  std::vector<std::string> outer, inner;
  EngineSession session(&outer);
  {
    EngineSession nested(&inner);
    mju_warning("first");
  }
  mju_warning("second");
  EXPECT_EQ(inner, std::vector<std::string>{"first"});
  EXPECT_EQ(outer, std::vector<std::string>{"second"});
}

TEST(Engine, ARefusedModelSaysWhy) {
  std::vector<std::string> warnings;
  EngineSession session(&warnings);
  try {
    (void)simulation::CompileMjcf("<mujoco><worldbody><body><joint/></body></worldbody></mujoco>");
    FAIL() << "a moving body without mass was accepted";
  } catch (const EngineError& error) {
    EXPECT_NE(std::string(error.what()).find("mass"), std::string::npos) << error.what();
  }
}

TEST(Engine, AModelThatMuJoCoRefusesIsAnEngineFailure) {
  Mechanism m = fixtures::MakeFourBar();
  m.bodies[1].mass = 1e-16;  // less than it takes for a mass
  const SimulationRun run = Simulate(m, {}, fixtures::HoldStill({1.0}), {});
  EXPECT_EQ(run.summary.stop, Stop::kEngineFailure);
  EXPECT_NE(run.summary.message.find("mass"), std::string::npos) << run.summary.message;
}

TEST(Engine, MotionThatIsNotANumberIsAnEngineFailureAndLeavesNoNumbersBehind) {
  const Mechanism m = fixtures::MakeFourBar();
  Motion motion{.duration_s = 0.1, .sample_s = 0.01, .commands = {}, .loads = {}};
  const DrivenMotion broken = [](double t, DrivenSample* driven) {
    driven->position = VecX::Constant(1, 1.0);
    driven->velocity = VecX::Zero(1);
    driven->acceleration = VecX::Constant(1, t > 0.05 ? kNan : 0.0);
    return RunSummary::Done();
  };
  for (const Engine engine : {Engine::kCorrected, Engine::kStock}) {
    const SimulationRun run = Simulate(m, motion, broken, {.engine = engine});
    EXPECT_EQ(run.summary.stop, Stop::kEngineFailure);
    EXPECT_NEAR(run.summary.time_s, 0.051, 0.0011);
    EXPECT_TRUE(run.trace.values.row(4).allFinite());
    EXPECT_TRUE(run.trace.values.row(7).array().isNaN().all());
  }
}

TEST(Engine, AnExplodingSpringIsAnEngineFailure) {
  // A free coupler tip on a spring far too stiff for the step: h ω is about 1000.
  Mechanism m = fixtures::MakeFourBar();
  m.joints.pop_back();
  m.springs.push_back({.name = "spring",
                       .body_from = 0,
                       .p_from = {0, 0.5, 0},
                       .body_to = 2,
                       .p_to = {0.3, 0, 0},
                       .stiffness = 1e12,
                       .damping = 0.0,
                       .free_length_m = 0.1});
  Motion motion{.duration_s = 1.0, .sample_s = 0.01, .commands = {}, .loads = {}};
  const SimulationRun run = Simulate(m, motion, fixtures::HoldStill({1.0}), {});
  EXPECT_EQ(run.summary.stop, Stop::kEngineFailure) << run.summary.message;
}

TEST(Engine, ADriveThatCannotBeReachedIsNotAConvergence) {
  // The crank of a four-bar that is a double rocker cannot turn to this angle.
  Mechanism m = fixtures::MakeFourBar();
  m.drives[0].kind = JointDrive{2, 0};  // drive the rocker instead
  const SimulationRun run = Simulate(m, {}, fixtures::HoldStill({0.2}), {});
  EXPECT_EQ(run.summary.stop, Stop::kNoConvergence);
  EXPECT_EQ(run.summary.time_s, 0.0);
}

TEST(Engine, TroubleOfTheCommandedMotionIsPassedOn) {
  const DrivenMotion unreachable = [](double t, DrivenSample*) {
    return RunSummary{
        .stop = Stop::kUnreachable, .message = "too far", .time_s = t, .where = {}, .unit = {}};
  };
  const SimulationRun run = Simulate(fixtures::MakeFourBar(), {}, unreachable, {});
  EXPECT_EQ(run.summary.stop, Stop::kUnreachable);
  EXPECT_EQ(run.summary.message, "too far");
}

TEST(Engine, OptionsQuoteTheBrokenRule) {
  EXPECT_TRUE(Check(SimulationOptions{}).empty());
  EXPECT_NE(Check({.step_s = -1.0}).Text().find("-1 violates step_s > 0"), std::string::npos);
  EXPECT_TRUE(Check({.guidance_steps = 5.0}).has_errors());
}

}  // namespace
}  // namespace mbv
