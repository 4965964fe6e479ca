// Every metric and every verdict: exact data passes, data perturbed by twice its limit fails.
#include "comparison/comparison.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "base/text.h"
#include "comparison/force_scale.h"
#include "mechanism/reach.h"

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

using synthetic::Case;
using synthetic::Perturb;
using synthetic::Stretch;

double Value(const Comparison& comparison, const std::string& check) {
  const CheckResult* found = comparison.FindCheck(check);
  return found == nullptr ? -1.0 : found->value;
}

bool Fails(const Comparison& comparison, const std::string& check) {
  const CheckResult* found = comparison.FindCheck(check);
  return found != nullptr && found->limit && !found->pass;
}

bool IsLeftOut(const Comparison& comparison, const std::string& what) {
  for (const NotCompared& item : comparison.not_compared) {
    if (item.what == what) return true;
  }
  return false;
}

TEST(Comparison, StartsPessimistic) {
  const Comparison comparison;
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_EQ(comparison.reason, "comparison was not run");
}

TEST(Comparison, EqualWitnessesAgreeInEveryCheck) {
  const Comparison comparison = Case().Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  EXPECT_EQ(comparison.failed(), 0u);
  // Per pair: three force, one position, velocity, acceleration, two pose, two reaction.
  EXPECT_EQ(comparison.checks.size(), 3u * 10u + 2u * 5u + 4u);
  EXPECT_TRUE(comparison.caveats.empty()) << comparison.caveats.front().text;
  EXPECT_TRUE(comparison.attribution.odd_one_out.empty());
}

TEST(Comparison, ForceNrmseIsRmsErrorOverRmsForceOfAllDrives) {
  Case c;
  // A constant error e on drive 1 only: pooled RMS error e/√2, pooled RMS force over 101 samples.
  Perturb(&c.simulated, "d1.force", 1e-6);
  const double sum =
      c.analytic.values.col(3).squaredNorm() + c.analytic.values.col(7).squaredNorm();
  const double expected = 1e-6 * std::sqrt(101.0) / std::sqrt(sum);
  const Comparison comparison = c.Run();
  EXPECT_NEAR(Value(comparison, "simulated_vs_analytic.force_nrmse"), expected,
              1e-12 * expected + 1e-15);
  EXPECT_NEAR(Value(comparison, "simulated_vs_analytic.force_max"), 1e-6 / 100.0, 1e-14);
  const PairComparison* pair = comparison.FindPair("simulated_vs_analytic");
  ASSERT_EQ(pair->drives.size(), 2u);
  EXPECT_NEAR(pair->drives[0].max_error, 1e-6, 1e-14);
  EXPECT_EQ(pair->drives[1].max_error, 0.0);
  EXPECT_NEAR(pair->drives[0].digits, -std::log10(pair->drives[0].nrmse), 1e-12);
}

TEST(Comparison, TheWorstSampleIsNamed) {
  Case c;
  c.simulated.values(42, c.simulated.Find("d2.force")) += 1.0;
  const CheckResult* check = c.Run().FindCheck("simulated_vs_analytic.force_max");
  ASSERT_NE(check, nullptr);
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.FindCheck("simulated_vs_analytic.force_max")->channel, "d2.force");
  EXPECT_DOUBLE_EQ(comparison.FindCheck("simulated_vs_analytic.force_max")->time_s, 0.42);
}

// One perturbation per metric: channel, offset that is about twice the inverse-mode limit, check
// that fails.
struct PerturbedCase {
  const char* channel;
  double offset;
  const char* check;

  friend std::ostream& operator<<(std::ostream& out, const PerturbedCase& perturbation) {
    return out << perturbation.channel << " + " << perturbation.offset;
  }
};

class PerturbedSimulation : public testing::TestWithParam<PerturbedCase> {};

TEST_P(PerturbedSimulation, FailsItsCheckAndTheVerdict) {
  Case c;
  Perturb(&c.simulated, GetParam().channel, GetParam().offset);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Fails(comparison, GetParam().check)) << Value(comparison, GetParam().check);
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
}

TEST_P(PerturbedSimulation, PassesWithAHundredthOfThePerturbation) {
  Case c;
  Perturb(&c.simulated, GetParam().channel, 0.01 * GetParam().offset);
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree) << c.Run().reason;
}

INSTANTIATE_TEST_SUITE_P(
    Metrics, PerturbedSimulation,
    testing::Values(
        PerturbedCase{"d1.force", 2e-10 * 76.2, "simulated_vs_analytic.force_nrmse"},
        PerturbedCase{"d1.position", 2e-10, "simulated_vs_analytic.position_m"},
        PerturbedCase{"d1.velocity", 2e-9 * 3.4, "simulated_vs_reference.velocity_nrmse"},
        PerturbedCase{"d1.acceleration", 2e-8 * 21.0, "simulated_vs_analytic.acceleration_nrmse"},
        PerturbedCase{"plate.x", 2e-9, "simulated_vs_analytic.pose_m"},
        PerturbedCase{"plate.yaw", 2e-9, "simulated_vs_analytic.pose_rad"},
        PerturbedCase{"slide1.reaction.fx", 2e-8 * 10.5 * 1.8,
                      "simulated_vs_analytic.reaction_nrmse"},
        PerturbedCase{"slide1.reaction.my", 2e-8 * 2.0 * 1.8,
                      "simulated_vs_analytic.reaction_nrmse"},
        PerturbedCase{"closure.position", 2e-10, "simulated.closure_m"},
        PerturbedCase{"closure.rotation", 2e-10, "simulated.closure_rad"},
        PerturbedCase{"power.energy_rate", 2e-8 * 50.0, "simulated.power_balance"}),
    [](const auto& info) {
      std::string name = info.param.check;
      name = name.substr(name.find('.') + 1) + std::to_string(info.index);
      return name;
    });

TEST(Comparison, PowerThatFlowsTheOtherWayIsNotABalance) {
  Case c;
  Stretch(&c.simulated, "power.energy_rate", -1.0);
  const Comparison comparison = c.Run();
  EXPECT_NEAR(Value(comparison, "simulated.power_balance"), 2.0, 1e-12);
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
}

TEST(Comparison, MissedCommandsFailWithoutAnyOtherWitness) {
  Case c;
  // All three agree with each other, and all are off the command by 2 nm.
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated})
    Perturb(trace, "d2.position", 2e-9);
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Fails(comparison, "simulated.command_m"));
  EXPECT_EQ(comparison.FindCheck("simulated.command_m")->channel, "d2");
  EXPECT_FALSE(Fails(comparison, "simulated_vs_analytic.position_m"));
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
}

TEST(Comparison, CouplingsAreCheckedAsDifferences) {
  Case c;
  c.motion.commands = {
      {"d1 - d2",
       {{{Coordinate::Kind::kDrive, 0, 0}, 1.0}, {{Coordinate::Kind::kDrive, 1, 0}, -1.0}},
       Constant(0.0)}};
  EXPECT_TRUE(Fails(c.Run(), "simulated.command_m"));
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    trace->values.col(trace->Find("d2.position")) = trace->values.col(trace->Find("d1.position"));
  }
  EXPECT_FALSE(Fails(c.Run(), "simulated.command_m"));
}

TEST(Comparison, CommandedAnglesAreTakenModuloATurn) {
  Case c;
  c.motion.commands = {{"plate.yaw",
                        {{{Coordinate::Kind::kOutput, 0, 5}, 1.0}},
                        {{ConstantTerm{3.0 - 2.0 * std::numbers::pi}, RampTerm{0.5}}}}};
  EXPECT_FALSE(Fails(c.Run(), "simulated.command_rad"));
  Perturb(&c.simulated, "plate.yaw", 2e-9);
  EXPECT_TRUE(Fails(c.Run(), "simulated.command_rad"));
}

TEST(Comparison, OrientationsAreComparedAsRotationsNotAsAngles) {
  Case c;
  // The same rotations, written with yaw in (−π, π]: 3.2 rad becomes −3.08 rad.
  const int yaw = c.simulated.Find("plate.yaw");
  for (Eigen::Index i = 0; i < c.simulated.values.rows(); ++i) {
    c.simulated.values(i, yaw) = std::remainder(c.simulated.values(i, yaw), 2 * std::numbers::pi);
  }
  const Comparison comparison = c.Run();
  // cos and sin of an angle near π round at ε: a few ε are left.
  EXPECT_LT(Value(comparison, "simulated_vs_analytic.pose_rad"), 8 * kEps);
}

TEST(Comparison, NanNeverPasses) {
  for (const char* channel : {"d1.force", "plate.x", "plate.roll", "closure.position",
                              "power.input", "d2.position", "slide1.reaction.fx"}) {
    Case c;
    c.simulated.values(7, c.simulated.Find(channel)) = kNan;
    EXPECT_EQ(c.Run().verdict, Verdict::kDisagree) << channel;
  }
  Case c;
  c.analytic.values(7, c.analytic.Find("d1.force")) = kNan;
  EXPECT_TRUE(std::isnan(Value(c.Run(), "simulated_vs_analytic.force_nrmse")));
  EXPECT_TRUE(Fails(c.Run(), "simulated_vs_analytic.force_nrmse"));
}

TEST(Comparison, InfinityNeverPasses) {
  Case c;
  c.simulated.values(7, c.simulated.Find("d1.force")) = HUGE_VAL;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

TEST(Comparison, ForcesThatCancelOutAreJudgedByTheForceScaleOfTheMechanism) {
  const double limit = 1e-10;  // force_nrmse, inverse
  const auto bent_by = [](double amount) {
    Case c;
    for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
      Stretch(trace, "d1.force", 0.0);
      Stretch(trace, "d2.force", 0.0);
    }
    Perturb(&c.simulated, "d1.force", amount);
    return c.Run();
  };
  // Bodies of 1 kg: the scale is what the fastest drive's RMS acceleration asks of one of them.
  Case c;
  const double w = 2.0 * std::numbers::pi;
  const ForceScale scale = ForceScaleOf(c.Input(), c.analytic);
  EXPECT_NEAR(scale.force_N, 0.5 * w * w / std::numbers::sqrt2, 0.1);
  EXPECT_EQ(bent_by(0.0).verdict, Verdict::kAgree);
  // One of two drives is perturbed: the pooled RMS is 1/√2 of the perturbation.
  const double just = std::numbers::sqrt2 * limit * scale.Floor("N");
  EXPECT_EQ(bent_by(0.5 * just).verdict, Verdict::kAgree);
  EXPECT_TRUE(Fails(bent_by(2.0 * just), "simulated_vs_analytic.force_nrmse"));
}

TEST(Comparison, TheForceScaleIsTheLargestOfWeightLoadAndInertia) {
  Case c;
  c.mechanism.bodies[1].mass = 50.0;
  c.mechanism.gravity_W = Vec3(0, 0, -9.81);
  c.motion = {};
  Trace still = c.analytic;
  Stretch(&still, "d1.acceleration", 0.0);
  Stretch(&still, "d2.acceleration", 0.0);
  EXPECT_NEAR(ForceScaleOf(c.Input(), still).force_N, 50.0 * 9.81, 1e-9);
  Load load;
  load.body = 1;
  load.force = {Constant(3000.0), Constant(0.0), Constant(4000.0)};
  c.motion.loads = {load};
  EXPECT_NEAR(ForceScaleOf(c.Input(), still).force_N, 5000.0, 1e-9);
  c.motion.loads.clear();
  c.mechanism.gravity_W.setZero();
  const ForceScale nothing = ForceScaleOf(c.Input(), still);
  EXPECT_FALSE(nothing.acts);
  EXPECT_NEAR(nothing.force_N, 50.0 * 1.0, 1e-9);  // 1 m in the 1 s of the motion
  EXPECT_NEAR(nothing.driven[0], 50.0 * 1.0, 1e-9);
}

TEST(Comparison, OnlyCommonSampleTimesAreCompared) {
  Case c;
  // Every second sample, and a wrong value at a time that the other does not have.
  Trace coarse = c.simulated;
  coarse.time_s.clear();
  coarse.values.resize(51, c.simulated.values.cols());
  for (Eigen::Index i = 0; i < 51; ++i) {
    coarse.time_s.push_back(c.simulated.time_s[static_cast<size_t>(2 * i)]);
    coarse.values.row(i) = c.simulated.values.row(2 * i);
  }
  coarse.time_s[50] = 0.995;
  coarse.values.row(50).setConstant(1e9);
  const PairComparison pair = ComparePair(c.Input(), coarse, c.analytic);
  EXPECT_TRUE(pair.compared);
  EXPECT_EQ(pair.samples, 50u);
  EXPECT_EQ(pair.metrics.at(Metric::kForceNrmse).value, 0.0);
}

TEST(Comparison, NoCommonTimeMeansNotRun) {
  Case c;
  for (double& t : c.simulated.time_s) t += 0.005;
  const PairComparison pair = ComparePair(c.Input(), c.simulated, c.analytic);
  EXPECT_FALSE(pair.compared);
  EXPECT_EQ(pair.reason, "the two have no sample time in common");
}

TEST(Comparison, TheStartWindowExcludesForcesOnlyAndOnlyWhenAsked) {
  Case c;
  c.simulated.values(3, c.simulated.Find("d1.force")) += 1.0;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
  c.start_window_s = 0.05;
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  EXPECT_EQ(c.Run().FindPair("simulated_vs_analytic")->force_samples, 96u);
  c.simulated.values(3, c.simulated.Find("d1.position")) += 1.0;
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
}

TEST(Comparison, PlaceAndTimeOfABrokenWitnessDoNotDependOnWords) {
  Case c;
  const auto reason = [&](const RunSummary& summary) {
    c.reference_summary = summary;
    return c.Run().reason;
  };
  RunSummary broken{.stop = Stop::kLimit, .message = "limit = 3 of d1", .time_s = 0.3};
  EXPECT_EQ(reason(broken), "reference: limit = 3 of d1 (t = 0.3 s)");
  broken.where = "d";  // a letter of the message, not a name in it
  EXPECT_EQ(reason(broken), "reference: limit = 3 of d1 (near d) (t = 0.3 s)");
  broken.names_where = true;
  EXPECT_EQ(reason(broken), "reference: limit = 3 of d1 (t = 0.3 s)");
  broken.message = "after three tenths of a second limit = 3 of d1";
  broken.states_time = true;
  EXPECT_EQ(reason(broken), "reference: " + broken.message);
}

TEST(Comparison, ABrokenWitnessMakesTheVerdictNotRun) {
  Case c;
  c.reference_summary = {
      .stop = Stop::kSingular, .message = "singular at t = 0.3 s", .where = {}, .unit = {}};
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kNotRun);
  EXPECT_EQ(comparison.reason, "reference: singular at t = 0.3 s");
  EXPECT_TRUE(comparison.FindPair("simulated_vs_analytic")->compared);
  EXPECT_FALSE(comparison.FindPair("reference_vs_analytic")->compared);
}

TEST(Comparison, AWitnessThatWasSwitchedOffIsNotAFailure) {
  Case c;
  c.reference_summary = {.message = "switched off in the scenario", .where = {}, .unit = {}};
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree);
  ASSERT_FALSE(comparison.not_compared.empty());
  EXPECT_EQ(comparison.not_compared[0].what, "reference_vs_analytic");
  EXPECT_EQ(comparison.not_compared[0].why, "reference: switched off in the scenario");
}

TEST(Comparison, OneWitnessAloneVerifiesNothing) {
  Case c;
  c.reference_summary = c.simulated_summary = {.message = "off", .where = {}, .unit = {}};
  EXPECT_EQ(c.Run().verdict, Verdict::kNotRun);
}

TEST(Comparison, ASmallDriveIsJudgedOnItsOwnScale) {
  Case c;
  // Drive 1 carries 1 % of drive 2; an error that is small for both together is large for it.
  const int d1 = c.analytic.Find("d1.force"), d2 = c.analytic.Find("d2.force");
  ASSERT_GE(d1, 0);
  ASSERT_GE(d2, 0);
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
    trace->values.col(d1) *= 0.01 * trace->values.col(d2).norm() / trace->values.col(d1).norm();
  }
  const double own_rms = c.analytic.values.col(d1).norm() / std::sqrt(101.0);
  Perturb(&c.simulated, "d1.force", 1e-3 * own_rms);
  const PairComparison pair = ComparePair(c.Input(), c.simulated, c.analytic);
  EXPECT_NEAR(pair.metrics.at(Metric::kForceOwn).value, 1e-3, 1e-12);
  EXPECT_LT(pair.metrics.at(Metric::kForceNrmse).value, 1e-5);
  EXPECT_EQ(pair.metrics.at(Metric::kForceOwn).channel, "d1.force");
}

TEST(Comparison, SwitchedOffForceChecksVerifyNothing) {
  Case c;
  c.limits[Metric::kForceNrmse] = {};
  c.limits[Metric::kForceOwn] = {};
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);  // the maximum is still judged
  c.limits[Metric::kForceMax] = {};
  EXPECT_EQ(c.Run().verdict, Verdict::kNotRun);
}

TEST(Comparison, ReactionsThatStaticsLeavesOpenAreNotJudged) {
  Case c;
  Perturb(&c.simulated, "slide1.reaction.fx", 5.0);
  EXPECT_EQ(c.Run().verdict, Verdict::kDisagree);
  for (const char* component : {"fx", "fy", "fz", "mx", "my", "mz"}) {
    c.reactions_not_unique.push_back(std::string("slide1.reaction.") + component);
  }
  const Comparison comparison = c.Run();
  EXPECT_EQ(comparison.verdict, Verdict::kAgree);
  EXPECT_EQ(comparison.FindCheck("simulated_vs_analytic.reaction_nrmse"), nullptr);
  EXPECT_TRUE(IsLeftOut(comparison, "slide1.reaction"));
}

TEST(Comparison, TheOtherComponentsOfAReactionThatIsPartlyOpenAreJudged) {
  Case c;
  c.reactions_not_unique = {"slide1.reaction.fz", "slide1.reaction.my"};
  Perturb(&c.simulated, "slide1.reaction.my", 5.0);
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  EXPECT_TRUE(IsLeftOut(c.Run(), "slide1.reaction (fz, my)"));
  Perturb(&c.simulated, "slide1.reaction.fx", 2e-8 * 10.5 * 1.8);
  EXPECT_TRUE(Fails(c.Run(), "simulated_vs_analytic.reaction_nrmse"));
}

TEST(Comparison, LimitsOfTheForwardModeApplyToTheSimulationOnly) {
  Case c;
  c.column = LimitColumn::kForward;
  Perturb(&c.simulated, "d1.force",
          1e-9 * 76.2);  // beyond the inverse limit, within the forward one
  EXPECT_EQ(c.Run().verdict, Verdict::kAgree);
  Perturb(&c.reference, "d1.force", 1e-9 * 76.2);
  EXPECT_TRUE(Fails(c.Run(), "reference_vs_analytic.force_nrmse"));
}

TEST(Comparison, WrongRatesAreSeenWithoutAnotherWitness) {
  Case c;
  // Simulation and closed form share a velocity that is 1 % off; the positions are right.
  for (Trace* trace : {&c.analytic, &c.simulated}) Stretch(trace, "d1.velocity", 1.01);
  c.reference_summary = {.message = "off", .where = {}, .unit = {}};
  const Comparison comparison = c.Run();
  EXPECT_TRUE(Fails(comparison, "analytic.derivatives"));
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
}

// A free motion whose reference states an error above the limits is held to that error.
TEST(IntegrationError, WidensTheLimitsOfTheTrajectoryAlone) {
  Case run;
  run.motion.commands.clear();
  run.motion.initial = {{.name = "d1", .coordinate = {Coordinate::Kind::kDrive, 0, 0}}};
  run.column = LimitColumn::kForward;
  const auto check_of = [&](double stated, double off, const char* name) {
    Case wrong = run;
    Perturb(&wrong.simulated, "d1.position", off);
    ComparisonInput input = wrong.Input();
    input.integration_error = stated;
    const Comparison comparison = Compare(input);
    const CheckResult* check = comparison.FindCheck(name);
    EXPECT_NE(check, nullptr);
    return check == nullptr ? CheckResult{} : *check;
  };
  const char* position = "simulated_vs_reference.position_m";
  const double size = CharacteristicLength(run.mechanism);
  const CheckResult within = check_of(2.3e-5, 2.0e-5 * size, position);
  EXPECT_TRUE(within.pass);
  EXPECT_NEAR(*within.limit, 2.3e-5 * size, 1e-12);
  ASSERT_TRUE(within.stated_limit);
  EXPECT_LT(*within.stated_limit, 2e-6 * size);
  EXPECT_FALSE(check_of(2.3e-5, 2.6e-5 * size, position).pass);
  EXPECT_FALSE(check_of(kNan, 2.0e-5 * size, position).pass);
  // An error below the limit changes nothing, and velocities keep theirs.
  EXPECT_FALSE(check_of(1e-9, 0.0, position).stated_limit);
  EXPECT_FALSE(check_of(2.3e-5, 0.0, "simulated_vs_reference.velocity_nrmse").stated_limit);
  // So wide a limit is a caveat.
  ComparisonInput input = run.Input();
  const auto wide = [&](const Comparison& comparison) {
    return std::ranges::any_of(comparison.caveats, [&](const Caveat& caveat) {
      return caveat.kind == CaveatKind::kWideLimits && Contains(caveat.of, position);
    });
  };
  EXPECT_FALSE(wide(Compare(input)));
  input.integration_error = 1e-9;
  EXPECT_FALSE(wide(Compare(input)));
  // Above the limit it is always one, and so wide that nothing is verified by the check, too.
  for (const double error : {2.3e-5, 0.5}) {
    input.integration_error = error;
    const Comparison comparison = Compare(input);
    EXPECT_TRUE(wide(comparison)) << error;
    const CheckResult* check = comparison.FindCheck(position);
    ASSERT_NE(check, nullptr);
    EXPECT_EQ(check->insensitive.empty(), error < 0.1);
  }
  // Beside a table the solver integrates: what is compared with the table alone keeps its limit.
  AlignedTable table;
  input.integration_error = 2.3e-5;
  input.table = &table;
  EXPECT_EQ(Compare(input).FindCheck(position)->stated_limit, std::nullopt);
}

}  // namespace
}  // namespace mbv
