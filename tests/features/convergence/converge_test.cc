// The orders of the schemes, seen on shipped scenarios.
#include "features/convergence/converge.h"
#include "tests/support/source_dir.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>

namespace mbv {
namespace {

ConvergeOutcome ConvergeScenario(const std::string& scenario, ConvergeOptions options = {}) {
  return Converge(std::string(kSourceDir) + "/scenarios/" + scenario + ".yaml", options);
}

const ConvergenceSeries& FindSeries(const ConvergeOutcome& outcome, const std::string& name) {
  for (const ConvergenceSeries& series : outcome.report.series) {
    if (series.name == name) return series;
  }
  throw std::runtime_error("no series " + name);
}

TEST(Converge, OnTheSliderCrankEachSchemeShowsItsOrder) {
  const ConvergeOutcome outcome = ConvergeScenario("slider_crank/press");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.failure;
  EXPECT_EQ(outcome.report.series.size(), 6u);
  for (const char* name :
       {"corrected_both", "corrected_step", "stock_both", "stock_step", "stock_time_constant"}) {
    EXPECT_TRUE(FindSeries(outcome, name).verdict.judged) << name;
  }
  // Half an order apart from the neighbours is what reports them apart.
  EXPECT_NEAR(FindSeries(outcome, "corrected_both").fit.order, 4.0, kOrderTolerance);
  EXPECT_NEAR(FindSeries(outcome, "stock_step").fit.order, 1.0, kOrderTolerance);
  EXPECT_NEAR(FindSeries(outcome, "stock_time_constant").fit.order, 2.0, kOrderTolerance);
  // The study is not a list of zeros: the stock engine is that far off, the corrected one is not.
  EXPECT_GT(FindSeries(outcome, "stock_both").points.back().error.smooth, 1e-8);
  EXPECT_LT(FindSeries(outcome, "corrected_both").points.back().error.smooth, 1e-10);
  const ForceExtrapolation& e = outcome.report.extrapolation;
  EXPECT_TRUE(e.pass);
  ASSERT_EQ(e.drives.size(), 1u);
  EXPECT_GT(e.drives[0].uncertainty, 0.0);
  EXPECT_LT(e.drives[0].uncertainty, 1e-8 * e.drives[0].rms);
}

// All but the processor time.
std::string WithoutTimes(ConvergeOutcome outcome) {
  for (ConvergenceSeries& series : outcome.report.series) {
    for (ConvergencePoint& point : series.points) point.cpu_s = 0.0;
  }
  return ToJson(outcome.report) + ToCsv(outcome.report) + ToText(outcome.report);
}

// In task space the reference computes the drive motion, whose last digits depend on its way.
TEST(Converge, ItsBytesDoNotDependOnTheNumberOfJobs) {
  for (const char* scenario : {"slider_crank/press", "stewart_balls/dance"}) {
    ConvergeOptions options{.steps_s = {4e-3, 2e-3, 1e-3}};
    options.scenario.set = {{"motion.duration_s", "0.4"}, {"snapshots.times_s", "[]"}};
    const std::string one = WithoutTimes(ConvergeScenario(scenario, options));
    options.jobs = 3;
    EXPECT_EQ(one, WithoutTimes(ConvergeScenario(scenario, options))) << scenario;
  }
}

TEST(Converge, ARunWhoseProcessIsKilledIsReported) {
  ConvergeOptions options{.steps_s = {4e-3, 2e-3, 1e-3, 5e-4}, .jobs = 2};
  options.scenario.set = {{"motion.duration_s", "0.4"}, {"snapshots.times_s", "[]"}};
  options.progress = [here = getpid()](const std::string& what, double) {
    if (getpid() != here && what.ends_with("50 steps, step 0.004 s")) raise(SIGKILL);
  };
  const ConvergeOutcome outcome = ConvergeScenario("slider_crank/press", options);
  const std::vector<ConvergencePoint>& points = FindSeries(outcome, "corrected_both").points;
  ASSERT_EQ(points.size(), 4u) << outcome.failure;
  EXPECT_EQ(points[0].failure, "its process was killed");
  for (size_t k = 1; k < points.size(); ++k) EXPECT_EQ(points[k].failure, "") << k;
}

TEST(Converge, BreaksOfTheMotionAreKeptApart) {
  const ConvergeOutcome outcome = ConvergeScenario("spr_tripod/default");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.failure;
  EXPECT_EQ(outcome.report.breaks, 4u);
  EXPECT_LT(outcome.report.smooth_samples, outcome.report.samples);
  EXPECT_NEAR(FindSeries(outcome, "corrected_both").fit.order, 4.0, kOrderTolerance);
  // The Runge–Kutta steps after a break are as good as the others.
  EXPECT_NEAR(FindSeries(outcome, "corrected_both").breaks_fit.order, 4.0, kOrderTolerance);
}

TEST(Converge, AtRestThereIsNothingButRoundOff) {
  for (const char* scenario : {"cabin_robot/static", "spr_tripod/static"}) {
    const ConvergeOutcome outcome = ConvergeScenario(scenario);
    EXPECT_EQ(outcome.exit_code, 0) << scenario << outcome.failure;
    EXPECT_FALSE(FindSeries(outcome, "corrected_both").verdict.judged) << scenario;
    for (const ConvergencePoint& point : FindSeries(outcome, "corrected_both").points) {
      EXPECT_LT(point.error.smooth, 1e-12) << scenario << " " << point.step_s;
      EXPECT_LT(point.error.breaks, 1e-12) << scenario << " " << point.step_s;
    }
  }
}

TEST(Converge, AMotionTooFastForATimeConstantEndsInAFinding) {
  // 20 Hz: stock MuJoCo's time constants of 2 to 32 ms are not small against a period.
  ConvergeOptions options{.steps_s = {4e-3, 2e-3, 1e-3}};
  options.scenario.set = {
      {"motion.commands.motor", "[home, {sine: {amplitude: 0.002, frequency_hz: 20}}]"},
      {"motion.duration_s", "0.5"},
      {"snapshots.times_s", "[]"}};
  const ConvergeOutcome outcome = ConvergeScenario("slider_crank/turn", options);
  EXPECT_EQ(outcome.exit_code, 1) << outcome.failure << outcome.diagnostics.Text();
  EXPECT_TRUE(outcome.report.finding());
  EXPECT_TRUE(FindSeries(outcome, "stock_time_constant").verdict.finding);
  // The corrected engine keeps its order, so the finding is of that series alone.
  EXPECT_FALSE(FindSeries(outcome, "corrected_both").verdict.finding);
  EXPECT_TRUE(outcome.report.extrapolation.pass);
}

TEST(Converge, StepsMustBePositiveFallAndDivideOneAnother) {
  const auto check = [](std::vector<double> steps) {
    return Check(ConvergeOptions{.steps_s = std::move(steps)});
  };
  EXPECT_FALSE(check({4e-3, 2e-3, 1e-3}).has_errors());
  EXPECT_FALSE(check({9e-3, 3e-3, 1e-3}).has_errors());
  EXPECT_TRUE(check({4e-3, 2e-3}).has_errors());  // an order needs three
  EXPECT_TRUE(check({4e-3, 0.0, -1e-3}).has_errors());
  EXPECT_TRUE(check({kNan, 2e-3, 1e-3}).has_errors());
  EXPECT_TRUE(check({1e-3, 2e-3, 4e-3}).has_errors());    // rising
  EXPECT_TRUE(check({4e-3, 3e-3, 2e-3}).has_errors());    // no common sample times
  EXPECT_TRUE(check({4e-3, 2e-3, 0.5e-3}).has_errors());  // not always the same fraction
  // All findings at once.
  EXPECT_EQ(check({4e-3, 0.0, -1e-3}).findings().size(), 2u);
}

TEST(Converge, WithoutAStepOfTheCorrectedEngineItCouldNotRun) {
  // A motion out of reach ends inverse mode already.
  const ConvergeOutcome outcome = ConvergeScenario("four_bar/must_fail/out_of_reach");
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.failure.find("inverse mode"), std::string::npos) << outcome.failure;
}

}  // namespace
}  // namespace mbv
