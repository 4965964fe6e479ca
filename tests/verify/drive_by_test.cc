// Force-driven and servo simulations, and the engines beside each other, through all stages.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>

#include "features/run/run_scenario.h"
#include "tests/support/source_dir.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

std::string ShippedScenario(const std::string& name) {
  return SourcePath("/scenarios/" + name + ".yaml");
}

RunOutcome RunOf(const std::string& scenario, std::vector<SetValue> set = {}) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  return RunScenario(ShippedScenario(scenario), options);
}

// A tripod that goes 0.1 s, which is enough to see everything.
std::vector<SetValue> Short(std::vector<SetValue> more = {}) {
  std::vector<SetValue> set = {{"motion",
                                "{duration_s: 0.2, sample_s: 0.002, commands: {platform.x: {sine: "
                                "{amplitude: 0.05, period_s: 0.8}}, platform.y: 0, platform.z: "
                                "0.57}}"}};
  set.emplace_back("snapshots.times_s", "[0]");
  set.insert(set.end(), more.begin(), more.end());
  return set;
}

double ValueOf(const Report& report, const std::string& check) {
  const CheckResult* found = report.comparison.FindCheck(check);
  return found == nullptr ? kNan : found->value;
}

TEST(ForceDriven, TheMotionIsJudgedByWherePerturbedForcesLead) {
  const RunOutcome outcome = RunOf("spr_tripod/force_driven", Short());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  const CheckResult* position =
      outcome.report->comparison.FindCheck("simulated_vs_analytic.position_m");
  ASSERT_NE(position, nullptr);
  EXPECT_EQ(position->limit_by, "forces perturbed by 1e-06");
  // A constant error of 1e-6 of some 150 N on 15 kg moves a leg by ½ a t² ~ 2e-7 m in 0.2 s.
  EXPECT_GT(*position->limit, 2e-8);
  EXPECT_LT(*position->limit, 2e-6);
  EXPECT_LT(position->value, 1e-3 * *position->limit);
  // The forces are the analytic ones: they are no evidence.
  EXPECT_EQ(outcome.report->comparison.FindCheck("simulated_vs_analytic.force_nrmse"), nullptr);
  EXPECT_NE(outcome.report->comparison.attribution.text.find("stays within"), std::string::npos);
}

TEST(ForceDriven, WorksWithTheReferencesForces) {
  const RunOutcome outcome = RunOf("spr_tripod/force_driven", Short({{"analytic", "none"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_EQ(outcome.report->driven_by, "reference");
}

TEST(ForceDriven, AHorizonOverWhichErrorsGrowTooFarVerifiesNothing) {
  const RunOutcome outcome =
      RunOf("spr_tripod/force_driven", Short({{"checks.force_nrmse", "{forward: 0.05}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.report->comparison.reason.find("too long to drive"), std::string::npos)
      << outcome.report->comparison.reason;
}

TEST(Servo, ForcesAreJudgedOnTheMotionReached) {
  const RunOutcome outcome = RunOf("spr_tripod/servo", Short());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Report& report = *outcome.report;
  EXPECT_EQ(outcome.exit_code, 0) << report.comparison.reason;
  EXPECT_LT(ValueOf(report, "simulated_vs_reached.force_nrmse"), 1e-9);
  // The servos sag by weight over stiffness, F/kp ~ 150 N / 5e5 N/m, and that is reported only.
  const CheckResult* tracking = report.comparison.FindCheck("simulated_vs_analytic.position_m");
  ASSERT_NE(tracking, nullptr);
  EXPECT_GT(tracking->value, 1e-4);
  EXPECT_LT(tracking->value, 2e-3);
  EXPECT_FALSE(tracking->limit);
  // Drive motion is taken from the simulation: no evidence.
  EXPECT_EQ(report.comparison.FindCheck("simulated_vs_reached.position_m"), nullptr);
}

TEST(Servo, FeedForwardTakesTheErrorAway) {
  const RunOutcome outcome =
      RunOf("spr_tripod/servo", Short({{"simulation.feedforward", "forces"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  EXPECT_LT(ValueOf(*outcome.report, "simulated_vs_analytic.position_m"), 1e-9);
  EXPECT_LT(ValueOf(*outcome.report, "simulated_vs_analytic.force_nrmse"), 1e-6);
}

TEST(Servo, AStatedLimitOnTheCommandIsJudged) {
  const RunOutcome outcome =
      RunOf("spr_tripod/servo", Short({{"checks.position_m", "{servo: 1e-4}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  size_t failed = 0;
  for (const CheckResult& check : outcome.report->comparison.checks) {
    if (!check.limit || check.pass) continue;
    ++failed;
    EXPECT_EQ(check.metric, Metric::kPositionM) << check.name;
    EXPECT_EQ(*check.limit, 1e-4);
    EXPECT_GT(check.value, 1e-4);
  }
  EXPECT_GT(failed, 0u);
  // Servos sag by themselves; that is not a witness' fault.
  EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "");
  const RunOutcome wide =
      RunOf("spr_tripod/servo", Short({{"checks.position_m", "{servo: 1e-2}"}}));
  EXPECT_EQ(wide.exit_code, 0) << wide.report->comparison.reason;
}

TEST(Servo, AStepThatCannotFollowTheGainsIsRefusedWithTheStepNeeded) {
  const RunOutcome outcome =
      RunOf("spr_tripod/servo", Short({{"simulation.kp", "1e9"}, {"simulation.kv", "1"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.report->comparison.reason.find("simulation.step_s = "), std::string::npos)
      << outcome.report->comparison.reason;
}

TEST(StiffSpring, TheStepThatIsNeededIsReportedBeforeTheMotionIsOff) {
  std::vector<SetValue> set = {{"motion.duration_s", "0.5"}, {"snapshots.times_s", "[0]"}};
  set.emplace_back("parameters.k", "8e4");
  const RunOutcome coarse = RunOf("spring_cart/swing", set);
  ASSERT_TRUE(coarse.report) << coarse.diagnostics.Text();
  EXPECT_NE(coarse.report->findings.Text().find("simulation.step_s = 0.0005 or less is needed"),
            std::string::npos)
      << coarse.report->findings.Text();
  set.back().second = "8e6";
  const RunOutcome refused = RunOf("spring_cart/swing", set);
  ASSERT_TRUE(refused.report) << refused.diagnostics.Text();
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.report->comparison.reason.find("or less is needed"), std::string::npos)
      << refused.report->comparison.reason;
  set.back().second = "80";
  EXPECT_EQ(RunOf("spring_cart/swing", set).report->findings.Text().find("step_s"),
            std::string::npos);
}

// A block on a belt: by itself MuJoCo creeps where it sticks, whatever the step.
TEST(EngineErrors, AFreeMotionReportsWhatMuJoCosOwnFrictionlossIsOff) {
  const std::vector<std::pair<std::string, std::string>> plain = {
      {"parameters.F_s", "0.5"}, {"snapshots.times_s", "[]"}, {"motion.duration_s", "6"}};
  const RunOutcome outcome = RunOf("belt_block/stick_slip", plain);
  ASSERT_TRUE(outcome.report && outcome.report->engine_comparison) << outcome.diagnostics.Text();
  const EngineComparison& stock = *outcome.report->engine_comparison;
  EXPECT_FALSE(stock.coulomb_alone);
  ASSERT_EQ(stock.friction.size(), 4U);
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(stock.friction[i].step_s, 1e-3 / std::pow(2.0, i));
    EXPECT_EQ(stock.friction[i].check, "output position");
    EXPECT_GT(stock.friction[i].value, 1e-3);
    EXPECT_LT(stock.friction[i].value, 1e-2);
    EXPECT_FALSE(stock.friction[i].within());
  }
  const std::string text = stock.FrictionText();
  EXPECT_NE(text.find("no step that was tried brings it below"), std::string::npos) << text;
  // A wide limit is met at once, and no smaller step is tried; breakaway is left out and reported.
  const RunOutcome wide = RunOf("belt_block/stick_slip", {{"motion.duration_s", "4"},
                                                          {"snapshots.times_s", "[]"},
                                                          {"checks.position_m", "0.5"},
                                                          {"checks.pose_m", "0.5"}});
  ASSERT_TRUE(wide.report && wide.report->engine_comparison) << wide.diagnostics.Text();
  EXPECT_TRUE(wide.report->engine_comparison->coulomb_alone);
  ASSERT_EQ(wide.report->engine_comparison->friction.size(), 1U);
  EXPECT_TRUE(wide.report->engine_comparison->friction[0].within());
  EXPECT_EQ(wide.report->engine_comparison->FrictionText().find("no step"), std::string::npos);
  // What it does not know at all is said.
  const RunOutcome loads = RunOf("journal_crank/falls", {{"motion.duration_s", "0.1"}});
  ASSERT_TRUE(loads.report && loads.report->engine_comparison) << loads.diagnostics.Text();
  EXPECT_NE(loads.report->engine_comparison->FrictionText().find("no load of the joint"),
            std::string::npos);
}

TEST(EngineErrors, DefaultsAndTheBestRecipeAreNamedWithAndWithoutTheFirstMoments) {
  const RunOutcome outcome = RunOf("spr_tripod/default", Short({{"simulation.stock_too", "true"}}));
  ASSERT_TRUE(outcome.report && outcome.report->engine_comparison) << outcome.diagnostics.Text();
  const std::vector<EngineError>& engines = outcome.report->engine_comparison->engines;
  ASSERT_EQ(engines.size(), 3U);
  EXPECT_EQ(engines[0].engine, "defaults");
  EXPECT_EQ(engines[1].engine, "stock");
  EXPECT_EQ(engines[2].engine, "corrected");
  EXPECT_GT(engines[0].force_nrmse, 3.0 * engines[1].force_nrmse);
  EXPECT_GT(engines[1].force_nrmse, 10.0 * engines[1].force_nrmse_later);
  EXPECT_GT(engines[1].force_nrmse, 1e3 * engines[2].force_nrmse);
}

// Every parameter of a model, 0.1 % wrong in one witness after the other, in every mode. What is
// found must never be put down to another witness, and most of it must be put down to the right
// one; the rest is said to be open.
struct WrongSides {
  const char* mode;
  const char* scenario;
  std::vector<SetValue> set;
  std::vector<const char*> sides;
  size_t named;  // at least, of each side; of the tripod's 35 parameters some change nothing

  friend std::ostream& operator<<(std::ostream& out, const WrongSides& wrong) {
    return out << wrong.mode;
  }
};

class WrongParameter : public testing::TestWithParam<WrongSides> {};

SetValue WrongIn(const std::string& side, const std::string& name, double right) {
  const double wrong = right == 0.0 ? 1e-4 : 1.001 * right;
  const std::string value = fmt::format("{{{}: {:.17g}}}", name, wrong);
  if (side == role::kSimulated) return {"simulation.parameters", value};
  return {side, "{parameters: " + value + "}"};
}

TEST_P(WrongParameter, IsPutDownToNoOtherWitness) {
  const WrongSides& wrong = GetParam();
  Diagnostics findings;
  const auto prepared = Prepare(ShippedScenario(wrong.scenario), {}, &findings);
  ASSERT_TRUE(prepared) << findings.Text();
  for (const char* side : wrong.sides) {
    size_t named = 0, open = 0;
    for (const Parameter& parameter : prepared->base.parameters) {
      std::vector<SetValue> set = wrong.set;
      set.push_back(WrongIn(side, parameter.name, parameter.value));
      const RunOutcome outcome = RunOf(wrong.scenario, set);
      if (!outcome.report || outcome.exit_code != 1) continue;
      const Attribution& attribution = outcome.report->comparison.attribution;
      EXPECT_FALSE(attribution.text.empty()) << side << " " << parameter.name;
      EXPECT_TRUE(attribution.odd_one_out.empty() || attribution.odd_one_out == side)
          << parameter.name << " is wrong in " << side << ": " << attribution.text;
      ++(attribution.odd_one_out == side ? named : open);
    }
    EXPECT_GE(named, wrong.named) << side << ", " << open << " left open";
  }
}

const std::vector<const char*> kThreeSides = {"analytic", "reference", "simulated"};

INSTANTIATE_TEST_SUITE_P(
    Modes, WrongParameter,
    testing::Values(WrongSides{"inverse", "spr_tripod/default",
                               Short({{"simulation.mode", "inverse"}}), kThreeSides, 20},
                    WrongSides{"forward", "spr_tripod/default",
                               Short({{"simulation.mode", "forward"}}), kThreeSides, 20},
                    WrongSides{"force_driven", "spr_tripod/force_driven", Short(), kThreeSides, 18},
                    WrongSides{"servo", "spr_tripod/servo", Short(), kThreeSides, 18},
                    WrongSides{"free",
                               "spring_cart/swing",
                               {{"motion.duration_s", "0.5"}, {"snapshots.times_s", "[]"}},
                               {"reference", "simulated"},
                               0}),
    [](const auto& info) { return std::string(info.param.mode); });

// The same wrong number in two witnesses: they agree with each other, and the right one stands
// against them. The scenario is what they have in common.
TEST(WrongParameter, ThatTwoWitnessesShareLeavesTheThirdUnnamed) {
  for (const char* scenario :
       {"spr_tripod/default", "spr_tripod/force_driven", "spr_tripod/servo"}) {
    for (const auto& right : kThreeSides) {
      std::vector<SetValue> set = Short();
      for (const char* side : kThreeSides) {
        if (std::string(side) != right) {
          set.push_back(WrongIn(side, "m_platform", 30.0));
        }
      }
      const RunOutcome outcome = RunOf(scenario, set);
      ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
      EXPECT_EQ(outcome.exit_code, 1) << scenario << " " << right;
      const Attribution& attribution = outcome.report->comparison.attribution;
      EXPECT_EQ(attribution.odd_one_out, "") << scenario << " " << right << attribution.text;
      EXPECT_NE(attribution.text.find("m_platform = 30.03"), std::string::npos) << attribution.text;
      EXPECT_NE(attribution.text.find("leaves open which is wrong"), std::string::npos)
          << attribution.text;
    }
  }
}

// What the other computation differs by must be more than the driven simulation can resolve.
TEST(ForceDriven, ADifferenceBelowWhatItResolvesIsLeftOpen) {
  const RunOutcome outcome = RunOf(
      "spr_tripod/force_driven", Short({{"reference", "{parameters: {m_platform: 30.00000003}}"}}));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 1);
  const Attribution& attribution = outcome.report->comparison.attribution;
  EXPECT_NE(attribution.odd_one_out, "analytic") << attribution.text;
  EXPECT_NE(attribution.odd_one_out, "simulated") << attribution.text;
}

}  // namespace
}  // namespace mbv
