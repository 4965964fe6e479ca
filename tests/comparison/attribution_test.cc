// The verdict names the odd one out, whichever it is, and admits when it cannot.
#include <gtest/gtest.h>

#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

using synthetic::Bend;
using synthetic::Case;
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
  Bend(&c.simulated, "d1.force", 0.1);
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
  Bend(&c.simulated, "d1.force", 0.1);     // 1e-3: fails against both
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
  EXPECT_TRUE(Mentions(attribution, "a third witness would tell")) << attribution.text;
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
  for (Trace* trace : {&c.analytic, &c.simulated}) Bend(trace, "d1.position", 1e-3);
  Bend(&c.simulated, "plate.x", 1e-3);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic");
  EXPECT_TRUE(Mentions(attribution, "misses the commanded motion by 0.001 m")) << attribution.text;
}

TEST(Attribution, AWrongSimulatedModelIsToldFromWrongDriveMotion) {
  Case c;
  c.CommandPlate();
  Bend(&c.simulated, "plate.x", 1e-3);  // the drive motion is right in all three
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated");
  EXPECT_TRUE(Mentions(attribution, "agree on the drive motion")) << attribution.text;
}

TEST(Attribution, WrongDriveAccelerationsAreSeenInTheSimulatedAccelerationNotBlamedOnIt) {
  // The closed form's acceleration is off, so coarsely sampled that its own rates do not tell; its
  // forces do not use it. The simulation follows it: its forces are wrong, and it is not to blame.
  Case c;
  c.CommandPlate();
  for (Trace* trace : {&c.analytic, &c.simulated}) Bend(trace, "d1.acceleration", 1.0);
  Bend(&c.simulated, "plate.x.acceleration", 1.0);
  Bend(&c.simulated, "d1.force", 5.0);
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
  Bend(&c.analytic, "d1.acceleration", 1.0);
  Bend(&c.simulated, "d1.force", 5.0);
  Bend(&c.simulated, "plate.x", 1e-4);
  c.limits[Metric::kDerivatives] = {};
  EXPECT_EQ(c.Run().attribution.odd_one_out, "analytic") << c.Run().attribution.text;
}

TEST(Attribution, AWrongReferenceMotionIsToldByTheSimulationThatMeetsTheCommand) {
  Case c;
  c.CommandPlate();
  Bend(&c.reference, "d1.acceleration", 1.0);
  Stretch(&c.reference, "d1.force", 1.05);
  c.limits[Metric::kDerivatives] = {};
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "reference") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "the simulation meets the command")) << attribution.text;
}

TEST(Attribution, TwoAssembliesThatBothMeetTheCommandAreNobodysFault) {
  Case c;
  c.CommandPlate();
  Bend(&c.reference, "d1.position", 0.2);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "");
  EXPECT_TRUE(Mentions(attribution, "two assemblies")) << attribution.text;
}

TEST(Attribution, AMissOfTheSimulationDoesNotHideWrongForcesOfTheClosedForm) {
  Case c;
  c.CommandPlate();
  c.column = LimitColumn::kForward;
  Bend(&c.simulated, "plate.x", 2e-6);
  Stretch(&c.analytic, "d1.force", 1.05);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "analytic") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "besides")) << attribution.text;
}

TEST(Attribution, ASimulationThatDoesNotFollowIsNamed) {
  Case c;
  Bend(&c.simulated, "d1.acceleration", 1.0);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated") << attribution.text;
  EXPECT_TRUE(Mentions(attribution, "does not follow the motion")) << attribution.text;
}

TEST(Attribution, AnOpenLoopIsNamedWhenForcesAgree) {
  Case c;
  Bend(&c.simulated, "closure.position", 1e-3);
  const Attribution attribution = c.Run().attribution;
  EXPECT_EQ(attribution.odd_one_out, "simulated");
  EXPECT_TRUE(Mentions(attribution, "loop gap is 0.001 m")) << attribution.text;
}

TEST(Attribution, AgreementStatesHowWell) {
  EXPECT_TRUE(Mentions(Case().Run().attribution, "reference and analytic agree to 0.0e+00"));
}

}  // namespace
}  // namespace mbv
