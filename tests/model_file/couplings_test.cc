// `couplings` of model files: read, refused, written.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "model_file/load_model.h"
#include "model_file/write_model.h"
#include "tests/support/source_dir.h"

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

// Σ factor · q = offset, with this sign.
TEST(Couplings, ASumIsItsOffset) {
  const LoadResult loaded = LoadModelText(
      Model("  sum: {sum: [{joint: turn, factor: 2}, {joint: slide, coordinate: 1, factor: 3}], "
            "offset_deg: 60}\n"),
      "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  ASSERT_EQ(m.couplings.size(), 1u);
  EXPECT_DOUBLE_EQ(m.couplings[0].constant, -std::numbers::pi / 3);
  EXPECT_NEAR(2 * m.joints[0].home[0] + 3 * m.joints[1].home[1], std::numbers::pi / 3, 1e-12);
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
TEST(Couplings, ThatContradictEachOtherAreReportedWithTheirAmount) {
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

TEST(Couplings, ASumIsWrittenWithTheSignOfItsOffset) {
  const LoadResult loaded = LoadModelText(
      Model("  sum: {sum: [{joint: turn, factor: 2}, {joint: slide, coordinate: 1, factor: 3}], "
            "offset: 0.75}\n"),
      "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const LoadResult again = LoadModelText(WriteModel(*loaded.mechanism), "again.yaml");
  ASSERT_TRUE(again.mechanism.has_value()) << again.diagnostics.Text();
  ASSERT_EQ(again.mechanism->couplings.size(), 1u);
  EXPECT_EQ(again.mechanism->couplings[0].constant, -0.75);
}

// Three shafts; `guess` and coupling texts as given, the motor on one of them.
Mechanism Shafts(const std::string& guess_one, const std::string& guess_two,
                 const std::string& couplings, const std::string& motor) {
  const auto joint = [](const std::string& name, const std::string& guess) {
    return "  " + name + ": {kind: revolute, parent: world." + name + ", child: " + name +
           ", axis: z" + guess + "}\n";
  };
  LoadResult loaded = LoadModelText(
      "name: shafts\nworld: {frames: {one: [0, 0, 0], two: [0.3, 0, 0], three: [0.6, 0, 0]}}\n"
      "bodies:\n"
      "  one: {mass: 1, inertia: [1, 1, 1]}\n"
      "  two: {mass: 1, inertia: [1, 1, 1]}\n"
      "  three: {mass: 1, inertia: [1, 1, 1]}\n"
      "joints:\n" +
          joint("one", guess_one) + joint("two", guess_two) + joint("three", "") + "couplings:\n" +
          couplings + "drives: {motor: {kind: joint, joint: " + motor + "}}\n",
      "shafts.yaml");
  EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_TRUE(loaded.diagnostics.findings().empty()) << loaded.diagnostics.Text();
  if (!loaded.mechanism) throw std::runtime_error("no mechanism");
  return *std::move(loaded.mechanism);
}

constexpr double kDegree = std::numbers::pi / 180;

double HomeDegrees(const Mechanism& m, const std::string& joint) {
  return m.joints[static_cast<size_t>(m.FindJoint(joint))].home[0] / kDegree;
}

// What drives and what is guessed stays; what follows turns as often as it takes.
TEST(Couplings, FollowersWithoutAGuessFollow) {
  const std::string sixty = ", guess_deg: 60";
  struct Case {
    const char* what;
    std::string one, two, couplings, motor;
    double home[3];  // [deg]
  };
  const std::vector<Case> cases = {
      {"a follower and its follower",
       sixty,
       "",
       "  g: {joint: two, follows: one, ratio: -5}\n"
       "  h: {joint: three, follows: two, ratio: 3.3, offset_deg: 20}\n",
       "one",
       {60, -300, -970}},
      {"listed from the last to the first",
       sixty,
       "",
       "  h: {joint: three, follows: two, ratio: 3.3}\n"
       "  g: {joint: two, follows: one, ratio: -5, offset_deg: 12}\n",
       "one",
       {60, -288, -950.4}},
      {"the motor on the shaft that a guessed wheel follows",
       "",
       sixty,
       "  g: {joint: two, follows: one, ratio: -0.2}\n"
       "  h: {joint: three, follows: two, ratio: 3.3}\n",
       "one",
       {-300, 60, 198}},
      {"the motor on the follower of a guessed wheel",
       sixty,
       "",
       "  g: {joint: two, follows: one, ratio: -5}\n"
       "  h: {joint: three, follows: two, ratio: 1}\n",
       "two",
       {60, -300, -300}},
      {"high ratios",
       sixty,
       "",
       "  g: {joint: two, follows: one, ratio: 128}\n"
       "  h: {joint: three, follows: two, ratio: -40}\n",
       "one",
       {60, 7680, -307200}},
      {"a sum",
       sixty,
       ", guess_deg: 10",
       "  g: {sum: [{joint: three, factor: 0.5}, {joint: one, factor: 7}, {joint: two, factor: "
       "1}], "
       "offset_deg: 30}\n",
       "one",
       {60, 10, -800}},
      {"nothing is guessed: the motor leads",
       "",
       "",
       "  g: {joint: one, follows: two, ratio: 3, offset_deg: 720}\n"
       "  h: {joint: three, follows: one, ratio: 1}\n",
       "one",
       {0, -240, 0}},
  };
  for (const Case& c : cases) {
    const Mechanism m = Shafts(c.one, c.two, c.couplings, c.motor);
    const char* names[] = {"one", "two", "three"};
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(HomeDegrees(m, names[k]), c.home[k], 1e-9 * (1 + std::abs(c.home[k])))
          << c.what << ": " << names[k];
    }
  }
}

TEST(Couplings, AFollowerByAPolynomialIsFoundFromItsValue) {
  const Mechanism m = Shafts("", ", guess_deg: 60",
                             "  g: {joint: two, follows: one, polynomial: [3, 0.5, 0.1]}\n", "one");
  const double q = m.joints[0].home[0];
  EXPECT_NEAR(HomeDegrees(m, "two"), 60, 1e-10);
  EXPECT_NEAR(3 * q + 0.5 * q * q + 0.1 * q * q * q, 60 * kDegree, 1e-12);
}

// A four-bar between a motor's shaft, geared to the crank, and a wheel that the rocker turns.
TEST(Couplings, FollowersBesideALoopLeaveItAlone) {
  const auto load = [](const std::string& couplings, const std::string& motor) {
    LoadResult loaded = LoadModelText(
        "name: geared\n"
        "world: {frames: {A: [0, 0, 0], D: [0.5, 0, 0], S: [-0.3, 0, 0], T: [0.9, 0, 0]}}\n"
        "bodies:\n"
        "  crank: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.2, 0, 0]}}\n"
        "  coupler: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.5, 0, 0]}}\n"
        "  rocker: {mass: 1, inertia: [1, 1, 1], frames: {end: [0.4, 0, 0]}}\n"
        "  shaft: {mass: 1, inertia: [1, 1, 1]}\n"
        "  wheel: {mass: 1, inertia: [1, 1, 1]}\n"
        "joints:\n"
        "  A: {kind: revolute, parent: world.A, child: crank, axis: z, guess_deg: 60}\n"
        "  B: {kind: revolute, parent: crank.end, child: coupler, axis: z, guess_deg: -40}\n"
        "  C: {kind: revolute, parent: rocker.end, child: coupler.end, axis: z}\n"
        "  D: {kind: revolute, parent: world.D, child: rocker, axis: z, guess_deg: 70}\n"
        "  S: {kind: revolute, parent: world.S, child: shaft, axis: z}\n"
        "  T: {kind: revolute, parent: world.T, child: wheel, axis: z}\n"
        "couplings:\n" +
            couplings + "drives: {motor: {kind: joint, joint: " + motor + "}}\n",
        "geared.yaml");
    EXPECT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    EXPECT_TRUE(loaded.diagnostics.findings().empty()) << loaded.diagnostics.Text();
    if (!loaded.mechanism) throw std::runtime_error("no mechanism");
    return *std::move(loaded.mechanism);
  };
  for (const double ratio : {6.5, 65.0, 650.0}) {
    const std::string wheel = "  h: {joint: T, follows: D, ratio: " + std::to_string(ratio) + "}\n";
    const Mechanism driven = load("  g: {joint: A, follows: S, ratio: -0.2}\n" + wheel, "S");
    EXPECT_NEAR(HomeDegrees(driven, "A"), 60, 1e-10);
    EXPECT_NEAR(HomeDegrees(driven, "S"), -300, 1e-9);
    EXPECT_NEAR(HomeDegrees(driven, "T"), ratio * HomeDegrees(driven, "D"), 1e-9 * ratio);
    const Mechanism geared = load("  g: {joint: S, follows: A, ratio: -5000}\n" + wheel, "A");
    EXPECT_NEAR(HomeDegrees(geared, "A"), 60, 1e-10);
    EXPECT_NEAR(HomeDegrees(geared, "S"), -300000, 1e-6);
    EXPECT_NEAR(HomeDegrees(geared, "T"), ratio * HomeDegrees(geared, "D"), 1e-9 * ratio);
    // The rocker is where it is without gears.
    EXPECT_NEAR(HomeDegrees(geared, "D"), HomeDegrees(driven, "D"), 1e-9);
  }
}

}  // namespace
}  // namespace mbv
