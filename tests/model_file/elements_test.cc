// `elements` of model files: read, refused, written.
#include <gtest/gtest.h>

#include <numbers>

#include "model_file/load_model.h"
#include "model_file/urdf.h"
#include "model_file/write_model.h"
#include "tests/source_dir.h"

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
            "rotor, friction\n  hint: did you mean 'damping'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, joint: tern, damping: 2}\n"),
            "m.yaml:10:29: error: elements.g.joint = 'tern': there is no such joint\n"
            "  hint: did you mean 'turn'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, drive: lag, damping: 2}\n"),
            "m.yaml:10:29: error: elements.g.drive = 'lag': there is no such drive\n"
            "  hint: did you mean 'leg'?\n");
  EXPECT_EQ(ElementFindings("  g: {kind: damping, damping: 2}\n"),
            "m.yaml:10:6: error: elements.g needs either joint or drive\n"
            "  hint: joint: the joint along whose coordinate it acts; drive: along that drive's\n");
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
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coulomb: 2, breakaway: 3}\n"),
            "m.yaml:10:6: error: elements.g needs both breakaway and stribeck_rate, or neither\n"
            "  hint: breakaway: friction just above rest; stribeck_rate: how fast it falls to "
            "coulomb\n");
  EXPECT_EQ(ElementFindings(
                "  g: {kind: friction, joint: turn, coulomb: 2, breakaway: 1, stribeck_rate: 1}\n"),
            "m.yaml:10:59: error: elements.g.breakaway = 1 violates breakaway >= coulomb = 2\n");
}

TEST(Elements, FrictionByLoadNeedsAJournalOrAGuide) {
  const std::string radius =
      "  hint: radius: of the journal of a revolute joint whose friction is coefficient times "
      "radius times its radial load\n";
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coefficient: 0.2}\n"),
            "m.yaml:10:6: error: elements.g needs a radius\n" + radius);
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: turn, coulomb: 1, radius: 0.2}\n"),
            "m.yaml:10:56: error: elements.g.radius has no meaning here\n" + radius);
  EXPECT_EQ(ElementFindings("  g: {kind: friction, joint: slide, coefficient: 0.2, radius: 1}\n"),
            "m.yaml:10:50: error: elements.g.coefficient: friction by the joint's load is known of "
            "revolute and prismatic joints only\n  hint: coulomb: friction whatever the load\n");
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
  const LoadResult five = LoadModel(SourcePath("/models/rubbing_five_bar/model.yaml"));
  ASSERT_TRUE(five.mechanism.has_value()) << five.diagnostics.Text();
  const LoadResult five_again = LoadModelText(WriteModel(*five.mechanism), "again.yaml");
  ASSERT_TRUE(five_again.mechanism.has_value()) << five_again.diagnostics.Text();
  ExpectSameElements(*five.mechanism, *five_again.mechanism);
}

}  // namespace
}  // namespace mbv
