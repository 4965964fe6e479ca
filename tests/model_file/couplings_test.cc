// `couplings` of model files: read, refused, written.
#include <gtest/gtest.h>

#include <numbers>

#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "tests/source_dir.h"

namespace mbv {
namespace {

std::string Model(const std::string& couplings) {
  return "name: m\n"
         "bodies:\n"
         "  a: {mass: 1, inertia: [1, 1, 1]}\n"
         "  b: {mass: 1, inertia: [1, 1, 1]}\n"
         "joints:\n"
         "  turn: {kind: revolute, parent: world, child: a, axis: z}\n"
         "  slide: {kind: cylindrical, parent: world, child: b, axis: z}\n"
         "couplings:\n" +
         couplings;
}

std::string CouplingFindings(const std::string& couplings) {
  return LoadModelText(Model(couplings), "m.yaml").diagnostics.Text();
}

TEST(Couplings, OneFollowsAnother) {
  const LoadResult loaded = LoadModelText(
      Model("  helix: {joint: slide, coordinate: 0, follows: slide, follows_coordinate: 1, "
            "ratio: 0.01/(2*pi), offset_mm: 5}\n"
            "  cam: {joint: turn, follows: slide, polynomial: [3, -2, 0], offset_deg: 90}\n"),
      "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const std::vector<Coupling>& couplings = loaded.mechanism->couplings;
  ASSERT_EQ(couplings.size(), 2u);
  EXPECT_EQ(couplings[0].name, "helix");
  EXPECT_EQ(couplings[0].terms[0].coordinate, 0);
  EXPECT_EQ(couplings[0].terms[1].coordinate, 1);
  EXPECT_DOUBLE_EQ(couplings[0].terms[1].polynomial.at(0), 0.01 / (2 * std::numbers::pi));
  EXPECT_EQ(couplings[0].constant, 0.005);
  EXPECT_EQ(couplings[1].terms[1].polynomial, (std::vector<double>{3, -2}));  // without the last 0
  // At home both hold.
  const auto& slide = loaded.mechanism->joints[1].home;
  EXPECT_NEAR(slide[0], 0.005 + 0.01 / (2 * std::numbers::pi) * slide[1], 1e-14);
  EXPECT_NEAR(loaded.mechanism->joints[0].home[0],
              std::numbers::pi / 2 + 3 * slide[0] - 2 * slide[0] * slide[0], 1e-12);
}

std::string Helical(const std::string& rest) {
  return "name: m\nbodies: {b: {mass: 1, inertia: [1, 1, 1]}}\n"
         "joints: {slide: {kind: helical, parent: world, child: b, axis: z, " +
         rest + "}}\n";
}

TEST(Couplings, AHelicalJointIsACylindricalOneWithItsLead) {
  struct Guess {
    const char* words;
    double travel, turn;
  };
  const Guess guesses[] = {
      {"lead_mm: -5, guess_mm: 10", 0.01, -4 * std::numbers::pi},
      {"lead: -0.005, guess_deg: 180", -0.0025, std::numbers::pi},
      {"lead: -5e-3, guess: [0.01, -12.56637061]", 0.01, -4 * std::numbers::pi}};
  for (const Guess& guess : guesses) {
    const LoadResult loaded = LoadModelText(Helical(guess.words), "m.yaml");
    ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
    const Mechanism& m = *loaded.mechanism;
    EXPECT_EQ(m.joints[0].kind, JointKind::kCylindrical);
    ASSERT_EQ(m.couplings.size(), 1u);
    EXPECT_EQ(m.couplings[0].name, "slide.lead");
    EXPECT_DOUBLE_EQ(m.couplings[0].terms[1].polynomial.at(0), -0.005 / (2 * std::numbers::pi));
    EXPECT_NEAR(m.joints[0].home[0], guess.travel, 1e-5 * std::abs(guess.travel));
    EXPECT_NEAR(m.joints[0].home[1], guess.turn, 1e-4);
    EXPECT_NEAR(m.joints[0].home[0], -0.005 / (2 * std::numbers::pi) * m.joints[0].home[1], 1e-16);
  }
}

TEST(Couplings, WhatMeansNothingIsAFinding) {
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: tern, ratio: 2}\n"),
            "m.yaml:9:29: error: couplings.g.follows = 'tern': there is no such joint\n"
            "  hint: did you mean 'turn'?\n");
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: slide}\n"),
            "m.yaml:9:6: error: couplings.g needs either ratio or polynomial\n"
            "  hint: ratio: rate of the joint by the rate of what it follows; polynomial: the "
            "coefficients of q, q², q³, q⁴\n");
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: slide, ratio: 0}\n"),
            "m.yaml:9:43: error: couplings.g.ratio = 0 couples nothing\n"
            "  hint: to hold a joint, make it fixed or prescribed\n");
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: slide, ratio: 1, offset_mm: 2}\n"),
            "m.yaml:9:57: error: couplings.g.offset_mm: the coordinate of 'turn' is an angle\n");
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: turn, ratio: 1}\n"),
            "m.yaml:9:29: error: couplings.g: coordinate 0 of joint 'turn' stands in it twice\n");
  EXPECT_EQ(CouplingFindings("  g: {joint: turn, follows: slide, polynomial: [1, 2, 3, 4, 5]}\n"),
            "m.yaml:9:48: error: couplings.g.polynomial has 5 coefficients, at most 4 are "
            "allowed\n");
  EXPECT_EQ(CouplingFindings("  g: {sum: [{joint: turn, factor: 1}]}\n"),
            "m.yaml:9:12: error: couplings.g.sum has 1 term, at least 2 are needed\n");
  EXPECT_EQ(
      CouplingFindings("  g: {joint: turn, follows: slide, follows_coordinate: 2, ratio: 1}\n"),
      "m.yaml:9:56: error: couplings.g: coordinate 2 of joint 'slide', which has 2 "
      "coordinates\n  hint: coordinates are counted from 0\n");
}

// Two gears between the same wheels with different offsets.
TEST(Couplings, ThatContradictEachOtherAreToldWithTheirAmount) {
  const std::string text = CouplingFindings(
      "  g: {joint: turn, follows: slide, ratio: 2}\n"
      "  h: {joint: turn, follows: slide, ratio: 2, offset_deg: 10}\n");
  EXPECT_NE(text.find("m.yaml:9:3: error: coupling 'g' of turn, slide does not hold at home: it is "
                      "missed by"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("coupling 'h'"), std::string::npos) << text;
}

TEST(Couplings, AreWrittenAsTheyAreRead) {
  const LoadResult loaded = LoadModel(SourcePath("/models/geared_press/model.yaml"));
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& press = *loaded.mechanism;
  const LoadResult again = LoadModelText(WriteModel(press), "again.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  ASSERT_EQ(again.mechanism->couplings.size(), press.couplings.size());
  for (size_t c = 0; c < press.couplings.size(); ++c) {
    const Coupling &a = press.couplings[c], &b = again.mechanism->couplings[c];
    EXPECT_EQ(a.name, b.name);
    EXPECT_EQ(a.constant, b.constant);
    ASSERT_EQ(a.terms.size(), b.terms.size());
    for (size_t k = 0; k < a.terms.size(); ++k) {
      EXPECT_EQ(a.terms[k].joint, b.terms[k].joint);
      EXPECT_EQ(a.terms[k].coordinate, b.terms[k].coordinate);
      EXPECT_EQ(a.terms[k].polynomial, b.terms[k].polynomial);
    }
  }
}

}  // namespace
}  // namespace mbv
