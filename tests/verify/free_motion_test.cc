// Verdicts of free motions through all stages: right models agree, models that are wrong by a
// thousandth do not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "features/run/run_scenario.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using testing::HasSubstr;
using testing::Not;

struct Written {
  std::string model, scenario;
};

Comparison RunWritten(const Written& files, std::vector<SetValue> set) {
  const test::TestFolder folder("free_motion");
  folder.Write("model.yaml", files.model);
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  const RunOutcome outcome =
      RunScenario(folder.Write("run.yaml", "mechanism: ./model.yaml\n" + files.scenario), options);
  EXPECT_TRUE(outcome.report) << outcome.diagnostics.Text();
  return outcome.report ? outcome.report->comparison : Comparison{};
}

std::string TextOf(const Comparison& comparison) {
  std::string text = comparison.reason + "\n";
  for (const CheckResult& check : comparison.checks) {
    if (!check.pass) text += check.name + " at " + check.channel + "\n";
  }
  return text;
}

// Crank and rocker swing each for itself: the coupler, massless or nearly so, transmits nothing but
// round-off.
Written Parallelogram(const std::string& coupler) {
  return {R"(name: parallelogram
parameters: {m: 1}
gravity: [0, -9.81, 0]
world: {frames: {A: [0, 0, 0], D: [0.5, 0, 0]}}
bodies:
  crank: {mass: 1, com: [0.1, 0, 0], inertia: [0.01, 0.01, 0.01], frames: {end: [0.2, 0, 0]}}
  coupler: {)" +
              coupler +
              R"(, frames: {end: [0.5, 0, 0]}}
  rocker: {mass: m, com: [0.1, 0, 0], inertia: [0.01, 0.01, 0.01], frames: {end: [0.2, 0, 0]}}
joints:
  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess_deg: 60}
  B: {kind: revolute, parent: crank.end, child: coupler, axis: z, guess_deg: -60}
  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z}
  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess_deg: 60}
drives: {motor: {kind: joint, joint: A}}
)",
          R"(motion:
  duration_s: 0.3
  sample_s: 0.01
  initial: {motor: {value_deg: 60}}
  initial_rates: {motor: 2}
forces: {motor: 0}
analytic: none
simulation: {mode: forward, step_s: 0.001}
)"};
}

TEST(FreeMotionVerdicts, ARodThatTransmitsNothingIsJudgedByTheLoadsOfItsLoop) {
  for (const char* coupler : {"mass: 0, inertia: [0, 0, 0]",
                              "mass: 1e-9, com: [0.25, 0, 0], inertia: [1e-11, 1e-11, 1e-11]"}) {
    const Written files = Parallelogram(coupler);
    for (const char* step : {"0.001", "0.0001"}) {
      const Comparison right = RunWritten(files, {{"simulation.step_s", step}});
      EXPECT_EQ(right.verdict, Verdict::kAgree) << TextOf(right);
    }
    const Comparison wrong = RunWritten(files, {{"simulation.parameters.m", "1.001"}});
    EXPECT_EQ(wrong.verdict, Verdict::kDisagree);
    const CheckResult* own = wrong.FindCheck("simulated_vs_reference.reaction_nrmse_own");
    ASSERT_NE(own, nullptr);
    EXPECT_FALSE(own->pass);
  }
}

// The simulation's own step is found by a run with a quarter of it, and a wrong mass is not
// mistaken for the step.
void ExpectTheStepIsToBlame(const Written& files, const std::string& parameter,
                            const std::string& wrong) {
  const Comparison coarse = RunWritten(files, {{"simulation.step_s", "0.001"}});
  EXPECT_EQ(coarse.verdict, Verdict::kDisagree);
  EXPECT_EQ(coarse.attribution.odd_one_out, "simulated");
  EXPECT_THAT(coarse.attribution.text,
              HasSubstr("simulation.step_s = 0.001 is too coarse for this motion: with 0.00025 "
                        "all checks pass"));
  const Comparison other = RunWritten(
      files, {{"simulation.step_s", "0.001"}, {"simulation.parameters." + parameter, wrong}});
  EXPECT_EQ(other.verdict, Verdict::kDisagree);
  EXPECT_THAT(other.attribution.text, Not(HasSubstr("too coarse for this motion")));
}

// Behind a singular pose loops are open by 1e-12 m until their stabilisation has closed them, which
// takes some steps; near that pose it shows in the reactions.
TEST(FreeMotionVerdicts, BehindASingularPoseTheStepIsNamed) {
  Written files = Parallelogram("mass: 0, inertia: [0, 0, 0]");
  files.scenario.replace(files.scenario.find("0.3"), 3, "0.6");
  ExpectTheStepIsToBlame(files, "m", "1.001");
}

// A bar on a pivot, let go, with a moment.
Comparison RunBar(const std::string& moment) {
  return RunWritten({R"(name: bar
gravity: [0, -9.81, 0]
bodies:
  bar: {mass: 1.3, com: [0.2, 0, 0], inertia: [0.01, 0.02, 0.02]}
joints:
  pivot: {kind: revolute, parent: world, child: bar, axis: z}
drives: {motor: {kind: joint, joint: pivot}}
outputs: {tip: bar}
)",
                     R"(motion:
  duration_s: 3
  sample_s: 0.01
  initial: {motor: {value_deg: 20}}
  initial_rates: {motor: 1}
forces: {motor: 0}
loads:
  stop: {on: bar, moment: [0, 0, ")" +
                         moment + R"("]}
analytic: none
simulation: {mode: forward, step_s: 0.001}
)"},
                    {});
}

// A body swings at 10 m/s on a leg of constant length.
Written HeldLeg() {
  return {R"(name: held
parameters: {i: 0.1}
gravity: [0, 0, -9.81]
world: {frames: {O: [0, 0, 0]}}
bodies:
  body: {mass: 1, com: [0, 0, 0], inertia: [0.04, i, 0.1], frames: {P: [0.3, 0.1, 0]}}
joints:
  float: {kind: free, parent: world, child: body, guess: [1, 0, 0, 0, 0, 0]}
drives: {leg: {kind: distance, from: world.O, to: body.P}}
outputs: {body: body}
)",
          R"(motion:
  duration_s: 2
  sample_s: 0.01
  commands: {leg: home}
  initial: {body.y: 0, body.z: 0, body.roll: 0, body.pitch: 0.1, body.yaw: 0}
  initial_rates: {body.roll: 5, body.y: 8, body.z: 5, body.pitch: 20, body.yaw: 15}
analytic: none
simulation: {mode: forward, step_s: 0.0002}
)"};
}

TEST(FreeMotionVerdicts, ALegThatIsHeldIsJudgedByHowItsEndsMove) {
  const Written files = HeldLeg();
  const Comparison right = RunWritten(files, {});
  EXPECT_EQ(right.verdict, Verdict::kAgree) << TextOf(right);
  EXPECT_EQ(RunWritten(files, {{"simulation.parameters.i", "0.1001"}}).verdict, Verdict::kDisagree);
}

TEST(FreeMotionVerdicts, OfAViolentMotionTheStepIsNamed) {
  ExpectTheStepIsToBlame(HeldLeg(), "i", "0.1001");
}

// Samples of 5 rad hide what gravity does within a turn: rates are not judged by them.
TEST(FreeMotionVerdicts, SamplesThatAMotionTurnsTooFarBetweenJudgeNoRates) {
  const Comparison fast = RunBar("-0.3*abs(motor.position + 1)");
  const CheckResult* rates = fast.FindCheck("reference.derivatives");
  ASSERT_NE(rates, nullptr);  // by the slower half
  EXPECT_TRUE(rates->pass) << rates->value;
  EXPECT_THAT(fast.attribution.text, Not(HasSubstr("not the time derivatives")));
}

// Where a moment jumps by an angle or by time, steps end; what decides is of the moment alone.
TEST(FreeMotionVerdicts, ALoadThatJumpsIsFollowedAcross) {
  for (const char* moment :
       {"2*(motor.position > -1) - 0.03*motor.velocity", "0.5*(t > 1.23456) + 0*motor.velocity",
        "-0.3*abs(motor.position + 0.2) - 0.1*motor.velocity", "max(-1, -3*motor.position)",
        "motor.position < -1 ? -2 - 0.1*motor.velocity : 0.3*min(t, 1)"}) {
    const Comparison jumps = RunBar(moment);
    EXPECT_EQ(jumps.verdict, Verdict::kAgree) << moment << ": " << TextOf(jumps);
  }
}

// Both branches push the bar back: no step of the reference is small enough. No verdict rather than
// a wrong motion, and it says what jumps.
TEST(FreeMotionVerdicts, ALoadThatJumpsBackAndForthIsNamed) {
  const Comparison by_rate = RunBar("1 - 2*(motor.velocity > 0)");
  EXPECT_EQ(by_rate.verdict, Verdict::kNotRun);
  EXPECT_THAT(by_rate.reason, HasSubstr("loads.stop.moment[2] jumps from"));
}

// What changes within a short way is followed.
TEST(FreeMotionVerdicts, WhatChangesQuicklyIsFollowed) {
  const Comparison quick = RunBar("1 + tanh((motor.position + 1)/0.01) - 0.03*motor.velocity");
  EXPECT_NE(quick.verdict, Verdict::kNotRun) << TextOf(quick);
}

// Damping that grows until the step cannot follow it: what a quarter of the step does is tried.
TEST(FreeMotionVerdicts, AStepThatIsTooLargeIsReportedFromAMotionThatCannotBeFollowed) {
  const Comparison coarse = RunBar("-7*t*motor.velocity");
  EXPECT_EQ(coarse.verdict, Verdict::kNotRun) << TextOf(coarse);
  EXPECT_THAT(coarse.reason,
              HasSubstr("simulation.step_s = 0.00025 follows the motion to its end"));
  const Comparison hopeless = RunBar("-60*t*motor.velocity");
  EXPECT_EQ(hopeless.verdict, Verdict::kNotRun) << TextOf(hopeless);
  EXPECT_THAT(hopeless.reason,
              HasSubstr("a quarter of the step, 0.00025 s, does not reach the end"));
}

}  // namespace
}  // namespace mbv
