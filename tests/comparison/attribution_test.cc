// The verdict names the odd one out, whichever it is, and admits when it cannot.
#include <gtest/gtest.h>

#include "comparison/attribution.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

using synthetic::Case;
using synthetic::Perturb;
using synthetic::Stretch;

bool Mentions(const Attribution& attribution, const std::string& text) {
  return attribution.text.find(text) != std::string::npos;
}

TEST(Attribution, AWrongClosedFormStandsAgainstTwo) {
  Case c;
  Stretch(&c.analytic, "d2.force", 1.03);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic");
  EXPECT_TRUE(Mentions(attribution, "simulation and reference agree to")) << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "worst at d2.force")) << attribution.text;
}

TEST(Attribution, AWrongReferenceStandsAgainstTwo) {
  Case c;
  Stretch(&c.reference, "d1.force", 1.001);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "reference");
  EXPECT_TRUE(Mentions(attribution, "simulation and analytic agree to")) << attribution.text;
}

TEST(Attribution, AWrongSimulationStandsAgainstTwo) {
  Case c;
  Perturb(&c.simulated, "d1.force", 0.1);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated");
  EXPECT_TRUE(Mentions(attribution, "reference and analytic agree to")) << attribution.text;
}

TEST(Attribution, AnOppositeSignIsRecognised) {
  Case c;
  Stretch(&c.analytic, "d2.force", -1.0);
  EXPECT_TRUE(Mentions(c.Run().attribution, "d2 has the opposite sign throughout"))
      << c.Run().attribution.text;
}

TEST(Attribution, AConstantFactorIsRecognised) {
  Case c;
  Stretch(&c.analytic, "d2.force", 1.0 / 1.5);
  EXPECT_TRUE(Mentions(c.Run().attribution, "the ratio at d2 is constant (1.5)"))
      << c.Run().attribution.text;
}

TEST(Attribution, TheEnginesOwnErrorDoesNotHideAWrongClosedForm) {
  Case c;
  c.column = LimitColumn::kForward;
  Perturb(&c.simulated, "d1.force", 0.1);  // 1e-3: fails against both
  Stretch(&c.analytic, "d1.force", 1.05);  // 5e-2
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic");
}

TEST(Attribution, ThreeThatAllDifferAreUndecided) {
  Case c;
  Stretch(&c.analytic, "d1.force", 1.02);
  Stretch(&c.reference, "d1.force", 0.98);
  const Attribution attribution = c.Run().attribution;
  EXPECT_TRUE(attribution.odd_one_out.empty());
  EXPECT_TRUE(Mentions(attribution, "no two witnesses stand clearly against the third"));
}

TEST(Attribution, TwoWitnessesCannotTellWhichIsWrong) {
  Case c;
  c.reference_summary = {.message = "off", .where = {}, .unit = {}};
  Stretch(&c.analytic, "d1.force", 1.02);
  const Attribution attribution = c.Run().attribution;
  EXPECT_TRUE(attribution.odd_one_out.empty());
  EXPECT_TRUE(Mentions(attribution, "a third witness would show")) << attribution.text;
}

TEST(Attribution, RatesThatAreNoDerivativesConvictTheirWitnessThoughTheSimulationFollowsThem) {
  Case c;
  for (Trace* trace : {&c.analytic, &c.simulated}) {
    Stretch(trace, "d1.velocity", 1.04);
    Stretch(trace, "d1.force", 1.04);
  }
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic");
  EXPECT_TRUE(Mentions(attribution, "rates are not the time derivatives")) << attribution.text;
}

TEST(Attribution, WrongDrivePositionsAreSeenInTheSimulatedPose) {
  Case c;
  c.CommandPlate();
  // The closed form's drive motion is off by 1 mm; the simulation follows it and misses the pose.
  for (Trace* trace : {&c.analytic, &c.simulated}) Perturb(trace, "d1.position", 1e-3);
  Perturb(&c.simulated, "plate.x", 1e-3);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic");
  EXPECT_TRUE(Mentions(attribution, "misses the commanded motion by 0.001 m")) << attribution.text;
}

TEST(Attribution, AWrongSimulatedModelIsReportedFromWrongDriveMotion) {
  Case c;
  c.CommandPlate();
  Perturb(&c.simulated, "plate.x", 1e-3);  // the drive motion is right in all three
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated");
  EXPECT_TRUE(Mentions(attribution, "agree on the drive motion")) << attribution.text;
}

TEST(Attribution, WrongDriveAccelerationsAreSeenInTheSimulatedAccelerationNotBlamedOnIt) {
  // The closed form's acceleration is off, so coarsely sampled that its own rates do not report;
  // its forces do not use it. The simulation follows it: its forces are wrong, and it is not to
  // blame.
  Case c;
  c.CommandPlate();
  for (Trace* trace : {&c.analytic, &c.simulated}) Perturb(trace, "d1.acceleration", 1.0);
  Perturb(&c.simulated, "plate.x.acceleration", 1.0);
  Perturb(&c.simulated, "d1.force", 5.0);
  c.limits[Metric::kDerivatives] = {};
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "the simulation misses the commanded acceleration"))
      << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "needs drive accelerations that differ by"))
      << attribution.text;
}

TEST(Attribution, GuidanceThatHidesAWrongAccelerationLeavesItsPlaceToTell) {
  // Forward in time the guidance pulls the mechanism back: it ends up a little off the command.
  Case c;
  c.CommandPlate();
  c.column = LimitColumn::kForward;
  Perturb(&c.analytic, "d1.acceleration", 1.0);
  Perturb(&c.simulated, "d1.force", 5.0);
  Perturb(&c.simulated, "plate.x", 1e-4);
  c.limits[Metric::kDerivatives] = {};
  EXPECT_EQ(c.Run().attribution.odd_one_out, "analytic") << c.Run().attribution.text;
}

TEST(Attribution, AWrongReferenceMotionIsReportedByTheSimulationThatMeetsTheCommand) {
  Case c;
  c.CommandPlate();
  Perturb(&c.reference, "d1.acceleration", 1.0);
  Stretch(&c.reference, "d1.force", 1.05);
  c.limits[Metric::kDerivatives] = {};
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "reference") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "the simulation meets the command")) << attribution.text;
}

TEST(Attribution, AnotherAssemblyThatMeetsTheCommandLeavesItOpenAWrongLengthDoesNot) {
  Case c;
  c.CommandPlate();
  Perturb(&c.reference, "d1.position", 0.2);
  const Attribution far = c.Run().attribution;
  EXPECT_EQ(far.odd_one_out, "");
  EXPECT_TRUE(Mentions(far, "another assembly of the same mechanism, or wrong lengths"))
      << far.text;
  Case near;
  near.CommandPlate();
  Perturb(&near.reference, "d1.position", 1e-4);
  const Attribution length = near.Run().attribution;
  EXPECT_EQ(length.odd_one_out, "reference") << length.text;
  EXPECT_FALSE(Mentions(length, "assembly")) << length.text;
}

TEST(Attribution, ADifferenceOfTheDriveMotionsThatIsNothingBesideTheMissIsNotItsCause) {
  Case c;
  c.CommandPlate();
  Perturb(&c.reference, "d1.position", 1e-9);  // ten times the limit
  Perturb(&c.simulated, "plate.x", 1e-3);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "agree on the drive motion to 1e-09 m")) << attribution.text;
}

TEST(Attribution, AMissOfTheSimulationDoesNotHideWrongForcesOfTheClosedForm) {
  Case c;
  c.CommandPlate();
  c.column = LimitColumn::kForward;
  Perturb(&c.simulated, "plate.x", 2e-6);
  Stretch(&c.analytic, "d1.force", 1.05);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "also, ")) << attribution.text;
}

TEST(Attribution, ASimulationThatDoesNotFollowIsNamed) {
  Case c;
  Perturb(&c.simulated, "d1.acceleration", 1.0);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "does not follow the motion")) << attribution.text;
}

TEST(Attribution, AnOpenLoopIsNamedWhenForcesAgree) {
  Case c;
  Perturb(&c.simulated, "closure.position", 1e-3);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated");
  EXPECT_TRUE(Mentions(attribution, "loop gap is 0.001 m")) << attribution.text;
}

TEST(Attribution, AHintIsAboutTheWorstDrive) {
  Case c;
  Stretch(&c.analytic, "d1.force", 1.0 / 1.01);  // constant ratio, 0.7 N RMS
  Perturb(&c.analytic, "d2.force", 20.0, 50);    // worst, and no factor
  const Attribution attribution = c.Run().attribution;
  EXPECT_TRUE(Mentions(attribution, "worst at d2.force")) << attribution.text;
  EXPECT_FALSE(Mentions(attribution, "ratio")) << attribution.text;
}

// A constant force has a constant ratio to any other constant: nothing speaks for a factor, unless
// it is one that units have, or a sign.
TEST(Attribution, AConstantForceHasNoConstantRatioToSpeakOf) {
  const auto text = [](double factor) {
    Case c;
    for (Trace* trace : {&c.analytic, &c.reference, &c.simulated}) {
      trace->values.col(trace->Find("d2.force")).setConstant(120.0);
    }
    Stretch(&c.analytic, "d2.force", 1.0 / factor);
    const Attribution attribution = c.Run().attribution;
    EXPECT_EQ(attribution.odd_one_out, "analytic") << attribution.text;
    return attribution.text;
  };
  EXPECT_EQ(text(1.05).find("ratio"), std::string::npos) << text(1.05);
  EXPECT_NE(text(1000.0).find("constant (1000), near 1000: is the unit"), std::string::npos)
      << text(1000.0);
  EXPECT_NE(text(-1.0).find("opposite sign"), std::string::npos) << text(-1.0);
}

TEST(Attribution, AUnitIsNamedOnlyWhereTheFactorIsOne) {
  Case c;
  Stretch(&c.analytic, "d2.force", 1.0 / 1.5);
  EXPECT_FALSE(Mentions(c.Run().attribution, "unit")) << c.Run().attribution.text;
  Case kilo;
  Stretch(&kilo.analytic, "d2.force", 1e-3);
  EXPECT_TRUE(Mentions(kilo.Run().attribution, "is the unit kN")) << kilo.Run().attribution.text;
}

TEST(Attribution, ACommandThatAllMissAlikeNamesNoWitness) {
  Case c;
  for (Trace* trace : {&c.analytic, &c.reference, &c.simulated})
    Perturb(trace, "d2.position", 2e-9);
  const Attribution all = c.Run().attribution;
  EXPECT_EQ(all.odd_one_out, "");
  EXPECT_TRUE(Mentions(all, "agree with each other that the mechanism misses the commanded motion"))
      << all.text;
  Case one;
  Perturb(&one.reference, "d2.position", 2e-9);
  EXPECT_EQ(one.Run().attribution.odd_one_out, "reference") << one.Run().attribution.text;
}

// A drift far smaller than the difference does not make its witness wrong.
TEST(Attribution, AnEnergyDriftIsBlamedOnlyForWhatItExplains) {
  const Case c;
  const ComparisonInput input = c.Input();
  const auto attribute = [&](double difference) {
    Comparison comparison = c.Run();
    for (const char* witness : {"simulated", "reference"}) {
      CheckResult check{.name = std::string(witness) + ".energy_drift",
                        .subject = witness,
                        .measured = witness,
                        .metric = Metric::kEnergy,
                        .value = *witness == 's' ? 3e-8 : 1e-12,
                        .limit = 1e-8,
                        .stated_limit = {},
                        .limit_by = {},
                        .pass = *witness != 's',
                        .channel = {}};
      comparison.checks.push_back(check);
    }
    const CheckResult differ{.name = {},
                             .subject = {},
                             .metric = Metric::kPoseM,
                             .value = difference,
                             .limit = 1e-9,
                             .stated_limit = {},
                             .limit_by = {},
                             .channel = {}};
    return internal::AttributeByEnergy(input, comparison,
                                       *comparison.FindPair("simulated_vs_reference"), differ);
  };
  EXPECT_EQ(attribute(1e-6).odd_one_out, "simulated");
  EXPECT_EQ(attribute(1e-3).odd_one_out, "");
  EXPECT_TRUE(Mentions(attribute(1e-3), "too little to explain")) << attribute(1e-3).text;
}

// Facts stand beside the inference: who agrees with whom, and by how much the third differs.
TEST(Attribution, ASplitIsStatedWithBothAmounts) {
  Case c;
  Stretch(&c.reference, "d1.force", 1.001);
  Perturb(&c.simulated, "d1.force", 1e-9);
  const Attribution attribution = c.Run().attribution;
  ASSERT_TRUE(attribution.split);
  EXPECT_EQ(attribution.split->agree, (std::vector<std::string>{"simulated", "analytic"}));
  EXPECT_EQ(attribution.split->differs, "reference");
  EXPECT_EQ(attribution.split->measure, "drive force, RMS");
  EXPECT_EQ(attribution.split->unit, "");
  EXPECT_NEAR(attribution.split->agree_to, 1e-9 / std::sqrt(100.0 * 100.0 / 2 + 40.0 * 40.0 / 2),
              1e-12);
  EXPECT_NEAR(attribution.split->differs_by, 1e-3 * 100.0 / std::hypot(100.0, 40.0), 5e-6);
  EXPECT_EQ(attribution.split->shared, "");
  EXPECT_FALSE(Case().Run().attribution.split);
}

TEST(Attribution, TwoThatTheScenarioGivesTheSameNumberAreNotIndependent) {
  Case c;
  Stretch(&c.reference, "d1.force", 1.001);  // it has the model's number
  ComparisonInput input = c.Input();
  input.own_parameters = {{"analytic", {{"m", 2.0}, {"l", 3.0}}}, {"simulated", {{"m", 2.0}}}};
  const Attribution attribution = Compare(input).attribution;
  EXPECT_EQ(attribution.odd_one_out, "");
  ASSERT_TRUE(attribution.split);
  EXPECT_EQ(attribution.split->differs, "reference");
  EXPECT_TRUE(Mentions(attribution,
                       "the scenario gives simulation and analytic m = 2 and "
                       "reference another value: this leaves open which is wrong"))
      << attribution.text;
  // Numbers of their own that differ, or that the third has, too, are nothing in common.
  input.own_parameters["simulated"]["m"] = 2.5;
  EXPECT_EQ(Compare(input).attribution.odd_one_out, "reference");
  input.own_parameters["simulated"]["m"] = 2.0;
  input.own_parameters["reference"]["m"] = 2.0;
  EXPECT_EQ(Compare(input).attribution.odd_one_out, "reference");
}

// In task space simulation and closed form move alike because one follows the other. Their forces
// are independent only if something else confirms that motion.
TEST(Attribution, ADriveMotionThatNothingConfirmsIsWhatTheyHaveInCommon) {
  const auto run = [](bool judged, double other_motion) {
    Case c;
    c.CommandPlate();
    for (const Metric metric : {Metric::kCommandM, Metric::kCommandRad, Metric::kCommandVelocity,
                                Metric::kCommandAcceleration, Metric::kDerivatives}) {
      if (!judged) c.limits[metric] = {};
    }
    Perturb(&c.reference, "d1.acceleration", other_motion);
    Stretch(&c.reference, "d1.force", 1.05);
    return c.Run().attribution;
  };
  EXPECT_EQ(run(true, 0.0).odd_one_out, "reference");
  EXPECT_EQ(run(false, 0.0).odd_one_out, "reference") << "the reference has the same motion";
  const Attribution open = run(false, 1.0);
  EXPECT_EQ(open.odd_one_out, "") << open.text;
  ASSERT_TRUE(open.split);
  EXPECT_TRUE(Mentions(open, "have the drive motion in common that the closed form computes"))
      << open.text;
}

TEST(Attribution, AgreementStatesHowWell) {
  EXPECT_TRUE(Mentions(Case().Run().attribution, "reference and analytic agree to 0.0e+00"));
  // Of a free motion, whose output may rest, what is nearest to its limit.
  Case free;
  free.motion.commands.clear();
  free.motion.initial = {{.name = "d1", .coordinate = {Coordinate::Kind::kDrive, 0, 0}}};
  free.motion.forces = {{.drive = 0, .force = Constant(1.0)}, {.drive = 1, .force = Constant(1.0)}};
  free.column = LimitColumn::kForward;
  EXPECT_TRUE(Mentions(free.Run().attribution, "simulation and reference agree to 0 m"));
  Perturb(&free.simulated, "d1.position", 1e-9);
  EXPECT_TRUE(Mentions(free.Run().attribution, "simulation and reference agree to 1e-09 m"))
      << free.Run().attribution.text;
}

}  // namespace
}  // namespace mbv
