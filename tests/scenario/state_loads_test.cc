// Loads as expressions in scenario files.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scenario/load_scenario.h"
#include "tests/support/source_dir.h"

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
