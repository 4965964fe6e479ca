// Loads as expressions in scenario files.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"

namespace mbv {
namespace {

using std::numbers::pi;

ScenarioResult WithLoad(const std::string& moment) {
  const std::string text = std::string("mechanism: ") + kSourceDir +
                           "/models/four_bar/model.yaml\n"
                           "motion: {duration_s: 1, commands: {motor: home}}\n"
                           "loads: {l: {on: crank, moment: [0, 0, \"" +
                           moment + "\"]}}\nanalytic: none\n";
  return LoadScenarioText(text, "s.yaml");
}

TEST(StateLoads, AreExpressionsOfTimeCoordinatesRatesAndParameters) {
  const ScenarioResult result =
      WithLoad("-2*(motor.position - crank) - 3*motor.velocity*abs(motor.velocity) + sin(pi*t)");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Load& load = result.scenario->motion.loads.at(0);
  ASSERT_EQ(load.following.size(), 1u);
  EXPECT_EQ(load.following[0].component, 5);
  const StateFunction& f = load.following[0].function;
  ASSERT_EQ(f.inputs.size(), 3u);
  EXPECT_FALSE(f.inputs[0].rate);
  EXPECT_TRUE(f.inputs[2].rate);
  const double crank = result.mechanism->ParameterValue("crank");
  const std::vector<double> x = {1.1, -0.7, -0.7};
  EXPECT_NEAR(f.value(0.3, x), -2 * (1.1 - crank) + 3 * 0.49 + std::sin(0.3 * pi), 1e-14);
}

TEST(StateLoads, PlainNumbersStayProfiles) {
  const ScenarioResult result = WithLoad("2*crank");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  EXPECT_TRUE(result.scenario->motion.loads.at(0).following.empty());
}

ScenarioResult WithForce(const std::string& force) {
  const std::string text = std::string("mechanism: ") + kSourceDir +
                           "/models/four_bar/model.yaml\n"
                           "motion: {duration_s: 1, initial: {motor: home}}\n"
                           "forces: {motor: \"" +
                           force + "\"}\nanalytic: none\n";
  return LoadScenarioText(text, "s.yaml");
}

TEST(StateForces, AreExpressionsToo) {
  const ScenarioResult result = WithForce("-2*motor.velocity + t");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const DriveForce& force = result.scenario->motion.forces.at(0);
  ASSERT_TRUE(force.following.has_value());
  EXPECT_EQ(force.following->value(3.0, std::vector<double>{0.5}), 2.0);
  EXPECT_FALSE(WithForce("2*crank").scenario->motion.forces.at(0).following.has_value());
  EXPECT_NE(WithForce("-2*moter.velocity").diagnostics.Text().find("did you mean 'motor.velocity'"),
            std::string::npos);
}

TEST(StateFunctions, MayNameTheirParts) {
  const auto with = [](const std::string& variables, const std::string& moment) {
    return LoadScenarioText(std::string("mechanism: ") + kSourceDir +
                                "/models/four_bar/model.yaml\n"
                                "motion: {duration_s: 1, commands: {motor: home}}\n"
                                "variables: " +
                                variables + "\nloads: {l: {on: crank, moment: [0, 0, \"" + moment +
                                "\"]}}\nanalytic: none\n",
                            "s.yaml");
  };
  const ScenarioResult result =
      with("{swing: motor.position - 0.5, pull: 3*swing + t}", "-2*pull*motor.velocity");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const StateFunction& f = result.scenario->motion.loads.at(0).following.at(0).function;
  EXPECT_DOUBLE_EQ(f.value(0.25, std::vector<double>{0.75, 2.0}), -2.0 * (3.0 * 0.25 + 0.25) * 2.0);
  const auto findings = [&](const std::string& variables, const std::string& moment) {
    return with(variables, moment).diagnostics.Text();
  };
  EXPECT_NE(findings("{a: b + 1, b: a}", "a").find("refers to itself"), std::string::npos);
  EXPECT_NE(findings("{t: 1}", "t").find("variables.t: t is the time"), std::string::npos);
  EXPECT_NE(findings("{crank: 1}", "t").find("is a parameter"), std::string::npos);
  EXPECT_NE(findings("{a: moter.position}", "a").find("did you mean 'motor.position'"),
            std::string::npos);
}

TEST(StateFunctions, KnowSignalsOfTheTimeAndTheirJumps) {
  const test::TestFolder folder("signals");
  folder.Write("wind.csv", "t,v\n0,1\n0.25,2\n0.4,3\n0.5,4\n0.75,3\n1,1\n");
  const auto with = [&](const std::string& variables, const std::string& moment) {
    const std::string text = std::string("mechanism: ") + kSourceDir +
                             "/models/four_bar/model.yaml\n"
                             "motion: {duration_s: 1, sample_s: 0.01, commands: {motor: home}}\n"
                             "variables: " +
                             variables + "\nloads: {l: {on: crank, moment: [0, 0, \"" + moment +
                             "\"]}}\nanalytic: none\n";
    return LoadScenario(folder.Write("s.yaml", text));
  };
  const ScenarioResult result = with(
      "{wind: {table: {csv: wind.csv, column: v}}, gust: [0.5, {step: {height: 2, at_s: 0.4}}],"
      " both: wind + gust}",
      "-both*motor.velocity - (wind > 3.5)");
  ASSERT_TRUE(result.scenario) << result.diagnostics.Text();
  const Motion& motion = result.scenario->motion;
  const StateFunction& f = motion.loads.at(0).following.at(0).function;
  const auto value = [&](double t) { return f.value(t, std::vector<double>{2.0}); };
  EXPECT_NEAR(value(0.25), -2.0 * (2.0 + 0.5), 1e-12);
  EXPECT_NEAR(value(0.5), -2.0 * (4.0 + 2.5) - 1.0, 1e-12);
  EXPECT_NEAR(value(0.75), -2.0 * (3.0 + 2.5), 1e-12);
  const std::vector<double> jumps = JumpTimes(motion);
  EXPECT_NE(std::ranges::find(jumps, 0.4), jumps.end());
  EXPECT_NE(f.branch(0.5, std::vector<double>{2.0}), f.branch(0.25, std::vector<double>{2.0}));
  EXPECT_EQ(BranchingFunctions(*result.mechanism, motion).at(0).path, "loads.l.moment[2]");
  EXPECT_NE(with("{a: {sinus: 1}}", "a").diagnostics.Text().find("variables.a"), std::string::npos);
  EXPECT_NE(
      with("{a: {table: {csv: none.csv, column: v}}}", "a").diagnostics.Text().find("none.csv"),
      std::string::npos);
}

// A rigid stop acts where forces move what hits it, alone.
TEST(RigidStops, AreWarnedOfWhereTheyDoNothingAndRefusedBesideFriction) {
  const auto text_of = [](const std::string& friction, const std::string& motion) {
    const test::TestFolder folder("rigid_stop");
    folder.Write("m.yaml", R"(name: block
bodies: {block: {mass: 1, com: [0, 0, 0], inertia: [1, 1, 1]}}
joints: {slide: {kind: prismatic, parent: world, child: block, axis: x}}
drives: {motor: {kind: joint, joint: slide}}
elements:
  wall: {kind: stop, joint: slide, upper: 0.1, restitution: 0.5}
)" + friction);
    const ScenarioResult result = LoadScenario(folder.Write(
        "s.yaml", "mechanism: ./m.yaml\nmotion: {duration_s: 1, " + motion + "analytic: none\n"));
    EXPECT_EQ(result.scenario.has_value(),
              friction.empty() || motion.find("initial") == std::string::npos);
    return result.diagnostics.Text();
  };
  const std::string dry = "  guide: {kind: friction, joint: slide, coulomb: 2}\n";
  const std::string commanded = "commands: {motor: 0}}\n";
  const std::string free = "initial: {motor: 0}}\nforces: {motor: 1}\n";
  const auto contains = [](const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
  };
  EXPECT_EQ(text_of("", free), "");
  EXPECT_TRUE(contains(text_of("", commanded), "warning: the rigid stop"))
      << text_of("", commanded);
  EXPECT_TRUE(contains(text_of("", commanded), "does nothing in commanded motions"));
  EXPECT_TRUE(contains(text_of(dry, free), "error: motion: the rigid stop")) << text_of(dry, free);
  EXPECT_TRUE(contains(text_of(dry, free), "are not computed together"));
  EXPECT_FALSE(contains(text_of(dry, commanded), "are not computed together"));
}

TEST(StateLoads, UnknownNamesAreFindings) {
  EXPECT_NE(WithLoad("-2*moter.position")
                .diagnostics.Text()
                .find("loads.l.moment[2]: four_bar has no 'moter.position'\n  hint: did you mean "
                      "'motor.position'?"),
            std::string::npos)
      << WithLoad("-2*moter.position").diagnostics.Text();
  EXPECT_NE(
      WithLoad("-stifness*motor.position").diagnostics.Text().find("unknown symbol 'stifness'"),
      std::string::npos);
  EXPECT_NE(WithLoad("-2*(motor.position").diagnostics.Text().find("is not an expression"),
            std::string::npos);
}

}  // namespace
}  // namespace mbv
