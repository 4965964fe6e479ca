// `elements` of model files: read, refused, written.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "model_file/element_text.h"
#include "model_file/load_model.h"
#include "model_file/urdf/urdf_import.h"
#include "model_file/write_model.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

std::string WithElements(const std::string& elements) {
  return "name: m\n"
         "bodies:\n"
         "  a: {mass: 1, inertia: [1, 1, 1]}\n"
         "  b: {mass: 1, inertia: [1, 1, 1], frames: {p: [0.5, 0, 0]}}\n"
         "joints:\n"
         "  turn: {kind: revolute, parent: world, child: a, axis: z}\n"
         "  slide: {kind: cylindrical, parent: world, child: b, axis: z}\n"
         "drives: {m: {kind: joint, joint: turn}, leg: {kind: distance, from: world, to: b.p}}\n"
         "elements:\n" +
         elements;
}

std::string ElementFindings(const std::string& elements) {
  return LoadModelText(WithElements(elements), "m.yaml").diagnostics.Text();
}

template <typename Law>
const Law& LawOf(const Mechanism& m, size_t e) {
  return std::get<Law>(m.elements.at(e).law);
}

const char* const kAll =
    "  c: {kind: damping, joint: slide, coordinate: 1, damping: 0.3}\n"
    "  k: {kind: spring, drive: m, stiffness: 4, free_deg: 90, preload: -2}\n"
    "  p: {kind: spring, drive: leg, polynomial: [3, -2, 1], free_mm: 20}\n"
    "  r: {kind: rotor, joint: turn, inertia: 2e-5, ratio: -50}\n"
    "  f: {kind: friction, joint: turn, coulomb: 0.2, breakaway: 0.3, stribeck_rate: 0.1}\n"
    "  d: {kind: friction, joint: slide, coulomb: 5}\n"
    "  j: {kind: friction, drive: m, coulomb: 0.1, coefficient: 0.08, radius: 1}\n"
    "  g: {kind: friction, joint: turn, coefficient: 0.2, radius: 0.03}\n";

TEST(Elements, AreReadOnJointsAndAlongDrives) {
  const LoadResult loaded = LoadModelText(WithElements(kAll), "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 8u);
  EXPECT_EQ(m.elements[0].name, "c");
  EXPECT_EQ(m.elements[0].joint, 1);
  EXPECT_EQ(m.elements[0].coordinate, 1);
  EXPECT_EQ(LawOf<DampingLaw>(m, 0).damping, 0.3);
  EXPECT_EQ(m.elements[1].joint, 0);  // the drive's coordinate
  EXPECT_EQ(m.elements[1].drive, -1);
  EXPECT_EQ(LawOf<SpringLaw>(m, 1).polynomial, std::vector<double>{4});
  EXPECT_DOUBLE_EQ(LawOf<SpringLaw>(m, 1).free, std::numbers::pi / 2);
  EXPECT_EQ(LawOf<SpringLaw>(m, 1).preload, -2);
  EXPECT_EQ(m.elements[2].drive, 1);
  EXPECT_EQ(LawOf<SpringLaw>(m, 2).polynomial, (std::vector<double>{3, -2, 1}));
  EXPECT_EQ(LawOf<SpringLaw>(m, 2).free, 0.02);
  EXPECT_EQ(LawOf<RotorLaw>(m, 3).reflected(), 0.05);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 4).breakaway, 0.3);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 4).stribeck_rate, 0.1);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 5).breakaway, 5);  // as Coulomb's
  EXPECT_EQ(LawOf<FrictionLaw>(m, 6).per_load(), 0.08);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 6).coulomb, 0.1);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 7).per_load(), 0.2 * 0.03);
  EXPECT_EQ(LawOf<FrictionLaw>(m, 7).breakaway, 0.0);
}

TEST(Elements, OfPartsNameTheirOwnJointsAndDrives) {
  const LoadResult loaded = LoadModelText(
      "name: m\n"
      "parts:\n"
      "  arm:\n"
      "    parameters: {c: 1}\n"
      "    bodies: {link: {mass: 1, inertia: [1, 1, 1]}}\n"
      "    joints: {hip: {kind: revolute, parent: world, child: link, axis: z}}\n"
      "    drives: {motor: {kind: joint, joint: hip}}\n"
      "    elements: {oil: {kind: damping, drive: motor, damping: c}}\n"
      "instances: {left: {part: arm}, right: {part: arm, c: 3}}\n"
      "drive_order: [right.motor, left.motor]\n",
      "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 2u);
  EXPECT_EQ(m.elements[1].name, "right.oil");
  EXPECT_EQ(m.elements[1].joint, m.FindJoint("right.hip"));
  EXPECT_EQ(LawOf<DampingLaw>(m, 1).damping, 3);
}

TEST(Elements, WhatMeansNothingIsAFinding) {
  EXPECT_EQ(ElementFindings("  g: {kind: dumping, joint: turn, damping: 2}\n"),
            "m.yaml:10:13: error: elements.g.kind = 'dumping' is not one of: damping, spring, "
            "rotor, friction, stop, curve, expression, bushing\n  hint: did you mean 'damping'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, joint: tern, damping: 2}\n"),
            "m.yaml:10:29: error: elements.g.joint = 'tern': there is no such joint\n"
            "  hint: did you mean 'turn'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, drive: lag, damping: 2}\n"),
            "m.yaml:10:29: error: elements.g.drive = 'lag': there is no such drive\n"
            "  hint: did you mean 'leg'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, damping: 2}\n"),
            "m.yaml:10:6: error: elements.g needs one of joint, drive, spring, and from with to\n"
            "  hint: joint: the joint along whose coordinate it acts; drive: along that drive's; "
            "spring: along its length; from, to: along the distance of two frames\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, joint: turn, damping: -2}\n"),
            "m.yaml:10:44: error: elements.g.damping = -2 violates damping >= 0\n");
  EXPECT_EQ(ElementFindings("  g: {kind: spring, joint: turn, stiffness: 2, free_mm: 3}\n"),
            "m.yaml:10:57: error: elements.g.free_mm: the coordinate of 'turn' is an angle\n");
  EXPECT_EQ(ElementFindings("  g: {kind: spring, joint: turn, preload: 2}\n"),
            "m.yaml:10:6: error: elements.g needs either stiffness or polynomial\n"
            "  hint: stiffness: force by deflection; polynomial: the coefficients of x, x², x³, "
            "x⁴\n");
  EXPECT_EQ(ElementFindings("  g: {kind: spring, joint: turn, polynomial: [1, 2, 3, 4, 5]}\n"),
            "m.yaml:10:46: error: elements.g.polynomial has 5 coefficients, at most 4 are "
            "allowed\n");
  EXPECT_EQ(ElementFindings("  g: {kind: rotor, joint: turn, inertia: 2, ratio: 0}\n"),
            "m.yaml:10:52: error: elements.g.ratio = 0 turns no rotor\n"
            "  hint: ratio: the rotor's rate by that of the coordinate\n");
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coulomb: 2, stribeck_rate: 3}\n"),
            "m.yaml:10:63: error: elements.g needs breakaway as well\n"
            "  hint: breakaway: friction at rest; stribeck_rate: how fast it falls to coulomb from "
            "there (left out: at once)\n");
  EXPECT_EQ(ElementFindings(
                "  g: {kind: friction, joint: turn, coulomb: 2, breakaway: 1, stribeck_rate: 1}\n"),
            "m.yaml:10:59: error: elements.g.breakaway = 1 violates breakaway >= coulomb = 2\n");
}

TEST(Elements, FrictionByLoadNeedsAJournalOrAGuide) {
  const std::string radius =
      "  hint: radius: of the journal or ball of a joint whose friction is coefficient times "
      "radius "
      "times its load\n";
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coefficient: 0.2}\n"),
            "m.yaml:10:6: error: elements.g needs a radius\n" + radius);
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coulomb: 1, radius: 0.2}\n"),
            "m.yaml:10:56: error: elements.g.radius has no meaning here\n" + radius);
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: slide, coefficient: 0.2, radius: 1}\n"),
            "m.yaml:10:63: error: elements.g.radius has no meaning here\n" + radius);
  EXPECT_EQ(ElementFindings("  g: {kind: friction, drive: leg, coefficient: 0.2, radius: 1}\n"),
            "m.yaml:10:48: error: elements.g.coefficient: friction by the joint's load is known of "
            "revolute, prismatic, cylindrical, universal and spherical joints only\n"
            "  hint: coulomb: friction whatever the load\n");
  const auto finds = [](const std::string& element, const std::string& words) {
    const std::string text = ElementFindings("  g: {kind: friction, " + element + "}\n");
    EXPECT_NE(text.find(words), std::string::npos) << element << "\n" << text;
  };
  finds("joint: slide, coordinate: 1, coefficient: 0.2, thrust_radius: 1", "no meaning here");
  finds("joint: turn, coulomb: 0.2, length: 1", "length has no meaning here");
  finds("joint: turn, coefficient: 0.2, radius: 1, length: 0", "length > 0");
  finds("joint: turn, coupling: gear, efficiency: 0.9", "there is no such coupling");
  finds("joint: turn, efficiency: 0.9", "coupling");
  finds("joint: turn, coupling: gear, efficiency: 0.9, radius: 1", "no meaning with a coupling");
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coefficient: -1, radius: 1}\n"),
            "m.yaml:10:49: error: elements.g.coefficient = -1 violates coefficient >= 0\n");
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coefficient: 1, radius: 0}\n"),
            "m.yaml:10:60: error: elements.g.radius = 0 violates radius > 0\n");
}

void ExpectSameElements(const Mechanism& a, const Mechanism& b) {
  ASSERT_EQ(a.elements.size(), b.elements.size());
  for (size_t e = 0; e < a.elements.size(); ++e) {
    const ForceElement &x = a.elements[e], &y = b.elements[e];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.joint, y.joint);
    EXPECT_EQ(x.coordinate, y.coordinate);
    EXPECT_EQ(x.drive, y.drive);
    ASSERT_EQ(x.law.index(), y.law.index());
    EXPECT_EQ(ElementText(x, "", false), ElementText(y, "", false));
  }
}

TEST(Elements, AreWrittenAsTheyAreRead) {
  const LoadResult loaded = LoadModelText(WithElements(kAll), "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const LoadResult again = LoadModelText(WriteModel(*loaded.mechanism), "again.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  ExpectSameElements(*loaded.mechanism, *again.mechanism);
  const LoadResult five = LoadModel(SourcePath("/models/friction_five_bar/model.yaml"));
  ASSERT_TRUE(five.mechanism.has_value()) << five.diagnostics.Text();
  const LoadResult five_again = LoadModelText(WriteModel(*five.mechanism), "again.yaml");
  ASSERT_TRUE(five_again.mechanism.has_value()) << five_again.diagnostics.Text();
  ExpectSameElements(*five.mechanism, *five_again.mechanism);
}

// b hangs on a, so that a turns.
std::string WithCarried(const std::string& elements) {
  std::string text = WithElements(elements);
  const std::string slide = "parent: world, child: b";
  text.replace(text.find(slide), slide.size(), "parent: a, child: b");
  return text;
}

TEST(GearLosses, FollowACouplingOfTheirCoordinate) {
  const auto with = [](const std::string& element) {
    return LoadModelText(
        WithElements("  g: {kind: friction, " + element + "}\n") +
            "couplings: {gear: {joint: slide, coordinate: 1, follows: turn, ratio: "
            "-1/5}}\n",
        "m.yaml");
  };
  const LoadResult loaded = with("joint: turn, coupling: gear, efficiency: 0.8");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const auto& law = LawOf<FrictionLaw>(*loaded.mechanism, 0);
  EXPECT_EQ(law.coupling, 0);
  EXPECT_DOUBLE_EQ(law.coefficient, 0.25);
  const LoadResult again = LoadModelText(WriteModel(*loaded.mechanism), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  EXPECT_EQ(WriteModel(*again.mechanism), WriteModel(*loaded.mechanism));
  const auto finds = [&](const std::string& element, const std::string& words) {
    const std::string text = with(element).diagnostics.Text();
    EXPECT_NE(text.find(words), std::string::npos) << element << "\n" << text;
  };
  finds("joint: slide, coupling: gear, efficiency: 0.8", "does not couple the coordinate");
  finds("joint: turn, coupling: gear", "needs either efficiency or coefficient");
  finds("joint: turn, coupling: gear, efficiency: 1.2", "efficiency <= 1");
  finds("joint: turn, coupling: gear, efficiency: 0", "efficiency > 0");
  finds("joint: turn, coupling: gear, efficiency: 0.8, efficiency_back: 1.1",
        "efficiency_back <= 1");
  finds("joint: turn, coupling: gear, efficiency: 0.8, coefficient_back: 0.1",
        "coefficient_back goes with coefficient");
  finds("joint: turn, coupling: gear, coefficient: 0.1, efficiency_back: 0.8",
        "efficiency_back goes with efficiency");
  finds("joint: turn, coupling: gear, coefficient: 0.1, coefficient_back: -1",
        "coefficient_back >= 0");
  finds("joint: turn, coupling: gear, coefficient: 0.1, resists: positive",
        "no meaning with friction by load");
}

TEST(GearLosses, MayDifferEitherWay) {
  const LoadResult loaded = LoadModelText(
      WithElements("  g: {kind: friction, joint: turn, coupling: gear, efficiency: 0.8,"
                   " efficiency_back: 0.625}\n  f: {kind: friction, joint: turn, coulomb: 3,"
                   " resists: negative}\n") +
          "couplings: {gear: {joint: slide, coordinate: 1, follows: turn, ratio: -1/5}}\n",
      "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const auto& gear = LawOf<FrictionLaw>(*loaded.mechanism, 0);
  EXPECT_DOUBLE_EQ(gear.coefficient + gear.skew, 0.25);
  EXPECT_DOUBLE_EQ(gear.coefficient - gear.skew, 0.375);
  EXPECT_EQ(gear.resists, 0);
  EXPECT_EQ(LawOf<FrictionLaw>(*loaded.mechanism, 1).resists, -1);
  const LoadResult again = LoadModelText(WriteModel(*loaded.mechanism), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  ExpectSameElements(*loaded.mechanism, *again.mechanism);
  EXPECT_EQ(LawOf<FrictionLaw>(*again.mechanism, 0).skew, gear.skew);
  EXPECT_EQ(LawOf<FrictionLaw>(*again.mechanism, 1).resists, -1);
}

TEST(StopsAndCurves, AreReadWrittenAndReadAgain) {
  const std::string lines =
      "  end: {kind: stop, joint: slide, lower_mm: -50, upper: 0.12, stiffness_per_mm: 20,"
      " exponent: 1.5, dissipation: 0.2}\n"
      "  pad: {kind: stop, drive: m, upper_deg: 90, stiffness: 5, damping_per_deg: 0.1}\n"
      "  gas: {kind: curve, from: a, to: b.p, points_mm: [[200, 400], [400, 300]], beyond: held}\n"
      "  oil: {kind: curve, spring: gas, of: rate, points: [[-1, 900], [0, 0], [2, -300]],"
      " interpolation: linear, beyond: linear}\n"
      "  fan: {kind: curve, joint: turn, of: rate, points_rpm: [[0, 0], [60, -2], [120, -8]],"
      " beyond: linear}\n"
      "  J: {kind: rotor, joint: turn, inertia_kg_cm2: 3}\n";
  const LoadResult loaded = LoadModelText(WithElements(lines), "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 6u);
  const auto& end = LawOf<StopLaw>(m, 0);
  EXPECT_EQ(end.lower, -0.05);
  EXPECT_EQ(end.upper, 0.12);
  EXPECT_EQ(end.stiffness, 20e3);
  EXPECT_EQ(end.exponent, 1.5);
  EXPECT_EQ(end.dissipation, 0.2);
  const auto& pad = LawOf<StopLaw>(m, 1);
  EXPECT_TRUE(std::isinf(pad.lower));
  EXPECT_DOUBLE_EQ(pad.upper, std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(pad.damping, 18.0 / std::numbers::pi);
  // Between two points: along a spring without stiffness.
  ASSERT_EQ(m.springs.size(), 1u);
  EXPECT_EQ(m.springs[0].stiffness, 0.0);
  EXPECT_EQ(m.springs[0].p_to, Vec3(0.5, 0, 0));
  EXPECT_EQ(m.elements[2].spring, 0);
  EXPECT_EQ(m.elements[3].spring, 0);
  EXPECT_EQ(Described(m, m.elements[3]), "curve along 'gas'");
  EXPECT_TRUE(ActsOnLength(m, m.elements[2]));
  const auto& gas = LawOf<CurveLaw>(m, 2);
  EXPECT_FALSE(gas.of_rate);
  EXPECT_EQ(gas.knots[1].at, 0.4);
  EXPECT_DOUBLE_EQ(gas.knots[0].slope_after, -500.0);
  EXPECT_EQ(gas.knots[0].slope_before, 0.0);
  const auto& oil = LawOf<CurveLaw>(m, 3);
  EXPECT_TRUE(oil.of_rate);
  EXPECT_EQ(oil.knots[1].slope_before, -900.0);
  EXPECT_EQ(oil.knots[1].slope_after, -150.0);
  EXPECT_EQ(oil.knots[0].slope_before, -900.0);
  // Of three points at equal distances: the harmonic mean of the secants between.
  const auto& fan = LawOf<CurveLaw>(m, 4);
  const double unit = 2.0 * std::numbers::pi;
  EXPECT_DOUBLE_EQ(fan.knots[1].slope_after, -2.0 * 2.0 * 6.0 / (2.0 + 6.0) / unit);
  EXPECT_DOUBLE_EQ(fan.knots[2].slope_before, -8.0 / unit);
  EXPECT_EQ(fan.knots[0].slope_before, 0.0);
  EXPECT_DOUBLE_EQ(LawOf<RotorLaw>(m, 5).inertia, 3e-4);
  const LoadResult again = LoadModelText(WriteModel(m), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  EXPECT_EQ(WriteModel(*again.mechanism), WriteModel(m));
  EXPECT_EQ(again.mechanism->elements[3].spring, 0);
  EXPECT_EQ(LawOf<CurveLaw>(*again.mechanism, 4).knots[1].slope_after, fan.knots[1].slope_after);
}

TEST(StopsAndCurves, CurvesAtRatesExpressionsAndRigidStopsAreReadWrittenAndReadAgain) {
  const std::string lines =
      "  air: {kind: curve, joint: turn, of: both, rates_rpm: [-60, 0, 60],"
      " points_deg: [[0, 9, 0, -4], [90, 30, 0, -15]], beyond: held, beyond_rates: linear}\n"
      "  gas: {kind: expression, from: a, to: b.p, force: \"F_0*(1 - x^2) - exp(-v)*v\"}\n"
      "  wall: {kind: stop, joint: slide, upper_mm: 130, restitution: e_wall}\n";
  const LoadResult loaded =
      LoadModelText(WithElements(lines) + "parameters: {F_0: 7, e_wall: 0.4}\n", "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  const auto& air = LawOf<CurvesLaw>(m, 0);
  EXPECT_DOUBLE_EQ(air.rates[2], 2.0 * std::numbers::pi);
  ASSERT_EQ(air.curves.size(), 3u);
  EXPECT_DOUBLE_EQ(air.curves[0].knots[1].at, std::numbers::pi / 2);
  EXPECT_EQ(air.curves[2].knots[1].force, -15);
  EXPECT_EQ(air.curves[2].knots[0].slope_before, 0);
  EXPECT_FALSE(air.held);
  const auto& gas = LawOf<ExpressionLaw>(m, 1);
  EXPECT_EQ(gas.text, "(7)*(1 - x^2) - exp(-v)*v");
  EXPECT_DOUBLE_EQ(gas.force(0.5, 2.0), 7 * 0.75 - 2.0 * std::exp(-2.0));
  EXPECT_EQ(LawOf<StopLaw>(m, 2).restitution, 0.4);
  EXPECT_TRUE(IsRigidStop(m.elements[2]));
  const LoadResult again = LoadModelText(WriteModel(m), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  EXPECT_EQ(WriteModel(*again.mechanism), WriteModel(m));
  EXPECT_EQ(LawOf<ExpressionLaw>(*again.mechanism, 1).force(0.5, 2.0), gas.force(0.5, 2.0));
}

TEST(StopsAndCurves, WhatMeansNothingIsAFinding) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"{kind: stop, joint: turn, stiffness: 5}", "needs lower, upper, or both"},
      {"{kind: stop, joint: turn, upper: 1}", "stiffness"},
      {"{kind: stop, joint: turn, upper: 1, stiffness: 0}", "stops nothing"},
      {"{kind: stop, joint: turn, lower: 2, upper: 1, stiffness: 5}", "violates lower < upper"},
      {"{kind: stop, joint: turn, upper_mm: 2, stiffness: 5}", "is an angle"},
      {"{kind: stop, joint: turn, upper: 2, stiffness_per_mm: 5}", "is an angle"},
      {"{kind: stop, joint: turn, upper: 2, stiffness: 5, exponent: 0.5}", "exponent >= 1"},
      {"{kind: stop, joint: turn, upper: 2, stiffness: 5, damping: 1, dissipation: 1}", "both"},
      {"{kind: stop, joint: turn, drive: m, upper: 2, stiffness: 5}", "needs one of joint, drive"},
      {"{kind: stop, from: a, upper: 2, stiffness: 5}", "to"},
      {"{kind: stop, spring: gas, upper: 2, stiffness: 5}", "no such spring"},
      {"{kind: curve, joint: turn, points: [[0, 0], [1, 1]]}", "beyond"},
      {"{kind: curve, joint: turn, beyond: held}", "points"},
      {"{kind: curve, joint: turn, points: [[0, 0]], beyond: held}", "fewer than two points"},
      {"{kind: curve, joint: turn, points: [[0, 0], [0, 1]], beyond: held}", "must increase"},
      {"{kind: curve, joint: turn, points: [[0, 0], [1]], beyond: held}", "a list of 2"},
      {"{kind: curve, joint: turn, points_mm: [[0, 0], [1, 1]], beyond: held}", "not in that unit"},
      {"{kind: curve, joint: turn, points_rpm: [[0, 0], [1, 1]], beyond: held}",
       "not in that unit"},
      {"{kind: curve, joint: turn, points: [[0, 0], [1, 1]], beyond: nowhere}", "nowhere"},
      {"{kind: curve, joint: turn, of: force, points: [[0, 0], [1, 1]], beyond: held}", "force"},
      {"{kind: curve, joint: turn, points: [[0, 0], [1, 1]], slopes: [[0, 0]]}", "one pair"},
      {"{kind: curve, joint: turn, of: both, points: [[0, 0]], beyond: held}", "rates"},
      {"{kind: curve, joint: turn, of: both, rates: [0, 1], points: [[0, 1, 2], [1, 2]],"
       " beyond: held, beyond_rates: held}",
       "a list of 3"},
      {"{kind: curve, joint: turn, of: both, rates: [1, 0], points: [[0, 1, 2], [1, 2, 3]],"
       " beyond: held, beyond_rates: held}",
       "rates must increase"},
      {"{kind: curve, joint: turn, of: both, rates: [0, 1], points: [[0, 1, 2], [0, 2, 3]],"
       " beyond: held, beyond_rates: held}",
       "must increase"},
      {"{kind: curve, joint: turn, rates: [0, 1], points: [[0, 0], [1, 1]], beyond: held}",
       "belongs to of: both"},
      {"{kind: rope, from: a, to: b}", "not expressible: a cable that goes slack"},
      {"{kind: rolling, joint: turn}", "not expressible: rolling without slip"},
      {"{kind: expression, joint: turn}", "force"},
      {"{kind: expression, joint: turn, force: \"-k*x\"}", "'k'"},
      {"{kind: expression, joint: turn, force: \"-2*(x\"}", "is not an expression"},
      {"{kind: stop, joint: turn, upper: 1, restitution: 1.5}", "0 <= restitution <= 1"},
      {"{kind: stop, joint: turn, upper: 1, restitution: 0.5, stiffness: 3}", "both restitution"},
      {"{kind: rotor, from: a, to: b, inertia: 1}", "turns no rotor"},
      {"{kind: damping, from: a, to: b, coordinate: 1, damping: 1}", "one coordinate"},
  };
  for (const auto& [element, words] : cases) {
    const std::string text = ElementFindings("  g: " + element + "\n");
    EXPECT_NE(text.find("error"), std::string::npos) << element;
    EXPECT_NE(text.find(words), std::string::npos) << element << "\n" << text;
  }
}

TEST(Bushings, AreSixSpringsAndDampersBetweenTwoFrames) {
  const std::string line =
      "  g: {kind: bushing, parent: a, child: b.p, stiffness: [1, 2, 3, 0, 5, 6],"
      " damping: [0, 0, 0, 0, 0, 7]}\n";
  const LoadResult loaded = LoadModelText(WithElements(line), "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.bushings.size(), 1u);
  EXPECT_EQ(m.bushings[0].parent, 1);
  EXPECT_EQ(m.bushings[0].child, 2);
  EXPECT_EQ(m.bushings[0].X_CM.translation(), Vec3(0.5, 0, 0));
  ASSERT_EQ(m.elements.size(), 6u);  // zeros are none
  EXPECT_EQ(m.elements[2].name, "g.kz");
  EXPECT_EQ(m.elements[3].name, "g.kry");
  EXPECT_EQ(m.elements[3].coordinate, 4);
  EXPECT_EQ(LawOf<SpringLaw>(m, 3).polynomial, std::vector<double>{5});
  EXPECT_EQ(m.elements[5].name, "g.crz");
  EXPECT_EQ(LawOf<DampingLaw>(m, 5).damping, 7);
  EXPECT_EQ(Described(m, m.elements[5]), "crz of bushing 'g'");
  EXPECT_TRUE(ActsOnLength(m, m.elements[2]));
  EXPECT_FALSE(ActsOnLength(m, m.elements[5]));
  // Written and read back.
  const LoadResult again = LoadModelText(WriteModel(m), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  EXPECT_EQ(WriteModel(*again.mechanism), WriteModel(m));
  ASSERT_EQ(again.mechanism->elements.size(), 6u);
  EXPECT_EQ(LawOf<SpringLaw>(*again.mechanism, 4).polynomial, std::vector<double>{6});
}

TEST(Bushings, WhatMeansNothingIsAFinding) {
  EXPECT_EQ(ElementFindings("  g: {kind: bushing, parent: a, child: b}\n"),
            "m.yaml:10:6: error: elements.g has neither stiffness nor damping\n"
            "  hint: stiffness: [kx, ky, kz, krx, kry, krz]; damping: the same of rates\n");
  EXPECT_EQ(ElementFindings("  g: {kind: bushing, parent: a, child: a, damping: [0,0,0,1,1,-1]}\n"),
            "m.yaml:10:40: error: elements.g: parent and child are the same body\n"
            "m.yaml:10:63: error: elements.g.damping[5] = -1 violates damping >= 0\n");
  EXPECT_NE(ElementFindings("  g: {kind: bushing, parent: a, child: b, stiffness: [1, 2, 3]}\n")
                .find("a list of 6 is needed"),
            std::string::npos)
      << ElementFindings("  g: {kind: bushing, parent: a, child: b, stiffness: [1, 2, 3]}\n");
  EXPECT_NE(ElementFindings("  g: {kind: bushing, joint: turn, damping: [1, 1, 1, 1, 1, 1]}\n")
                .find("joint"),
            std::string::npos);
}

TEST(CarriedRotors, StateTheirAxisOrTakeTheJoints) {
  const std::string lines =
      "  own: {kind: rotor, drive: leg, inertia: 1, axis_on: b.p, axis: [0, 3, 4]}\n"
      "  its: {kind: rotor, joint: slide, coordinate: 1, inertia: 1, gyroscopic: true}\n"
      "  not: {kind: rotor, joint: turn, inertia: 1, gyroscopic: false}\n";
  const LoadResult loaded = LoadModelText(WithCarried(lines), "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.elements.size(), 3u);
  ASSERT_TRUE(LawOf<RotorLaw>(m, 0).carrier);
  EXPECT_EQ(LawOf<RotorLaw>(m, 0).carrier->body, 2);
  EXPECT_LT((LawOf<RotorLaw>(m, 0).carrier->axis_B - Vec3(0, 0.6, 0.8)).norm(), 1e-15);
  ASSERT_TRUE(LawOf<RotorLaw>(m, 1).carrier);
  EXPECT_EQ(LawOf<RotorLaw>(m, 1).carrier->body, 1);  // the joint's parent
  EXPECT_EQ(LawOf<RotorLaw>(m, 1).carrier->axis_B, Vec3(0, 0, 1));
  EXPECT_FALSE(LawOf<RotorLaw>(m, 2).carrier);
  const LoadResult again = LoadModelText(WriteModel(m), "m.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  EXPECT_EQ(WriteModel(*again.mechanism), WriteModel(m));
  EXPECT_TRUE(LawOf<RotorLaw>(*again.mechanism, 1).carrier);
}

TEST(CarriedRotors, WhatMeansNothingIsAFinding) {
  EXPECT_EQ(
      ElementFindings("  g: {kind: rotor, joint: turn, inertia: 1, gyroscopic: true}\n"),
      "m.yaml:10:57: error: elements.g.gyroscopic: the joint's parent is the world, which does "
      "not turn\n  hint: leave gyroscopic out\n");
  EXPECT_EQ(
      ElementFindings("  g: {kind: rotor, joint: slide, inertia: 1, gyroscopic: true}\n"),
      "m.yaml:10:58: error: elements.g.gyroscopic: the coordinate is not an angle about an axis of "
      "the joint's parent\n  hint: write axis_on: BODY and axis: [x, y, z] instead\n");
  EXPECT_EQ(
      ElementFindings("  g: {kind: rotor, joint: turn, inertia: 1, axis_on: a}\n"),
      "m.yaml:10:6: error: elements.g needs both axis_on and axis, or neither, and then "
      "gyroscopic is true\n  hint: axis_on: the body, or its frame, that the rotor's bearings "
      "sit on; axis: there\n");
  EXPECT_EQ(
      ElementFindings("  g: {kind: rotor, joint: turn, inertia: 1, axis_on: world, axis: z}\n"),
      "m.yaml:10:54: error: elements.g.axis_on = world: the world does not turn\n"
      "  hint: leave axis_on and axis out: a rotor is without gyroscopic moment then\n");
}

}  // namespace
}  // namespace mbv
