// Models that load but are hardly meant: a warning each, and none about what is right.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/mechanisms/slip.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

std::string WarningsOf(const std::string& text) {
  const LoadResult result = LoadModelText(text, "m.yaml");
  EXPECT_TRUE(result.mechanism.has_value()) << result.diagnostics.Text();
  return result.diagnostics.Text();
}

// The slender crank's inertia about its centre of mass, and a coupler of the same kind.
std::string Slender() {
  return Replaced(Replaced(kFourBar, "inertia: {xx: 0.01, yy: 0.02, zz: 0.02}",
                           "inertia: {xx: 1e-4, yy: 2*crank^2/12, zz: 2*crank^2/12}"),
                  "  coupler:\n",
                  "  coupler:\n    mass: 3\n    com: [ground/2, 0.02, 0]\n"
                  "    inertia: {xx: 1e-3, yy: 3*ground^2/12, zz: 3*ground^2/12 + 5e-4}\n");
}

TEST(Plausibility, ARightModelRaisesNoDoubt) { EXPECT_EQ(WarningsOf(Slender()), ""); }

class Doubtful : public testing::TestWithParam<Slip> {};

TEST_P(Doubtful, IsReported) {
  const Slip& slip = GetParam();
  const std::string text = WarningsOf(Replaced(Slender(), slip.from, slip.to));
  EXPECT_NE(text.find(slip.said), std::string::npos) << text;
}

const Slip kDoubts[] = {
    {"InertiaInKgSquareMillimetres", "inertia: {xx: 1e-4, yy: 2*crank^2/12, zz: 2*crank^2/12}",
     "inertia: {xx: 1e2, yy: 2e6*crank^2/12, zz: 2e6*crank^2/12}", "are they in kg mm²"},
    {"InertiaAboutTheOrigin", "inertia: {xx: 1e-4, yy: 2*crank^2/12, zz: 2*crank^2/12}",
     "inertia: {xx: 1e-4, yy: 2*crank^2/3, zz: 2*crank^2/3}",
     "m.yaml:11:3: warning: bodies.crank: its inertia about the centre of mass is 1.09 "
     "times the largest"},
    {"CentreOfMassInMillimetres", "com: [crank/2, 0, 0]", "com: [100, 0, 0]",
     "is the centre of mass in millimetres?"},
    {"GuessInDegrees", "child: crank.foot, axis: z, guess_deg: 60",
     "child: crank.foot, axis: z, guess: 60",
     "joints.A.guess = 60 rad is more than a turn\n  hint: angles are in radians"},
    {"GravityInMillimetres", "gravity: [0, -9.81, 0]", "gravity: [0, -9810, 0]", "is it in mm/s²?"},
};
INSTANTIATE_TEST_SUITE_P(Slips, Doubtful, testing::ValuesIn(kDoubts),
                         [](const auto& info) { return std::string(info.param.name); });

// A shaft with a lever, a screw beside it, and what is said of both.
std::string Machine(const std::string& more, const std::string& lead = "lead_mm: 5") {
  return "name: m\nbodies:\n  a: {mass: 1, com: [0.1, 0, 0], inertia: [1e-4, 4e-3, 4e-3]}\n"
         "  b: {mass: 1, com: [0.1, 0, 0], inertia: [1e-4, 4e-3, 4e-3]}\n"
         "  c: {mass: 1, com: [0.1, 0, 0], inertia: [1e-4, 4e-3, 4e-3]}\n"
         "  d: {mass: 1, com: [0.1, 0, 0], inertia: [1e-4, 4e-3, 4e-3]}\n"
         "world: {frames: {pb: [0.3, 0, 0], pc: [0.6, 0, 0], pd: [0.9, 0, 0]}}\n"
         "joints:\n  ja: {kind: revolute, parent: world, child: a, axis: z}\n"
         "  jb: {kind: revolute, parent: world.pb, child: b, axis: z}\n"
         "  jc: {kind: revolute, parent: world.pc, child: c, axis: z}\n"
         "  screw: {kind: helical, parent: world.pd, child: d, axis: z, " +
         lead + "}\ndrives: {da: {kind: joint, joint: ja}}\n" + more;
}

TEST(Plausibility, RotorsFrictionLeadsAndLocksAreReported) {
  EXPECT_EQ(WarningsOf(Machine("")), "");
  struct Case {
    std::string right, wrong;
    const char* said;
  };
  const std::string rotor = "elements: {r: {joint: ja, kind: rotor, inertia: 1e-5, ratio: 50}}\n";
  const std::string motor = "motors: {da: {rotor_inertia: 1e-5, gear_ratio: 50}}\n";
  const auto gears = [](const char* last) {
    return fmt::format(
        "couplings:\n  ab: {{joint: ja, follows: jb, ratio: 2}}\n"
        "  bc: {{joint: jb, follows: jc, ratio: 3}}\n"
        "  ca: {{joint: jc, follows: ja, ratio: {}}}\n",
        last);
  };
  const Case cases[] = {
      {Machine(rotor), Machine(rotor + motor),
       "motors.da: its rotor, 0.025 behind the gear, is element 'r', too"},
      {Machine(rotor + "motors: {da: {rotor_inertia: 1e-7, gear_ratio: 50}}\n"),
       Machine(rotor + "motors: {da: {rotor_inertia: 1.03e-5, gear_ratio: 50}}\n"),
       "is element 'r', too"},
      {Machine(rotor),
       Machine("elements: {r: {joint: ja, kind: rotor, inertia: 0.1, ratio: 50}}\n"),
       "elements.r: rotor inertia 0.1 kg m² weighs 250 kg m² behind its gear"},
      {Machine(motor), Machine("motors: {da: {rotor_inertia: 0.1, gear_ratio: 50}}\n"),
       "motors.da: rotor inertia 0.1 kg m²"},
      {Machine("elements: {f: {joint: ja, kind: friction, coefficient: 0.12, radius: 0.01}}\n"),
       Machine("elements: {f: {joint: ja, kind: friction, coefficient: 12, radius: 0.01}}\n"),
       "elements.f: friction coefficient 12, more than any pair"},
      {Machine("", "lead_mm: 5"), Machine("", "lead: 5"), "joint 'screw' moves 5 m with each turn"},
      {Machine(gears("1/6")), Machine(gears("1/5")),
       "the couplings lock joint 'ja', 'jb', 'jc': together they leave it no degree of freedom"},
  };
  for (const Case& c : cases) {
    const std::string right = LoadModelText(c.right, "m.yaml").diagnostics.Text();
    const LoadResult wrong = LoadModelText(c.wrong, "m.yaml");
    EXPECT_EQ(right.find(c.said), std::string::npos) << right;
    EXPECT_TRUE(wrong.mechanism.has_value()) << wrong.diagnostics.Text();
    EXPECT_NE(wrong.diagnostics.Text().find(c.said), std::string::npos) << c.said << "\n"
                                                                        << wrong.diagnostics.Text();
    EXPECT_NE(wrong.diagnostics.Text().find("m.yaml: warning:"), std::string::npos);
  }
}

TEST(Plausibility, LengthsInMillimetresAreReportedOnceForAllBodies) {
  std::string text = Replaced(Slender(), "crank: 0.2", "crank: 200");
  text = Replaced(text, "{value_mm: 500,", "{value: 500,");
  text = Replaced(text, "[ground/2, 0.1, 0]", "[ground/2, 100, 0]");
  const std::string said = WarningsOf(text);
  EXPECT_NE(said.find("bodies.crank: it has 2 kg and measures 200 m, thinner than any solid; so "
                      "do coupler"),
            std::string::npos)
      << said;
  EXPECT_NE(said.find("are these millimetres?"), std::string::npos) << said;
  EXPECT_EQ(said.find("kg mm²"), std::string::npos)
      << "a consequence, not a second warning: " << said;
}

TEST(Plausibility, WhatIsRareButPossibleRaisesNoDoubt) {
  // A ship of 1e7 kg, 30 m in radius of gyration, of which only one point is known.
  EXPECT_EQ(WarningsOf("name: t\nbodies: {ship: {mass: 1e7, com: [12, 0, 3], inertia: [2e9, 9e9, "
                       "9e9]}}\njoints: {roll: {kind: revolute, parent: world, child: ship, axis: "
                       "x}}\ndrives: {roll: {kind: joint, joint: roll}}\n"),
            "");
  // A flywheel on a short crank.
  EXPECT_EQ(
      WarningsOf(Replaced(Slender(), "inertia: {xx: 1e-4, yy: 2*crank^2/12, zz: 2*crank^2/12}",
                          "inertia: {xx: 0.4, yy: 0.4, zz: 0.8}")),
      "");
  // Two turns, stated in degrees.
  EXPECT_EQ(WarningsOf(Replaced(Slender(), "child: crank.foot, axis: z, guess_deg: 60",
                                "child: crank.foot, axis: z, guess_deg: 780")),
            "");
}

// m l²/3 instead of m l²/12, of a bar that is drawn longer by its round ends.
TEST(Plausibility, InertiaAboutTheEndOfAThickBarIsReported) {
  for (const double radius : {0.001, 0.006, 0.012, 0.02, 0.03}) {
    for (const char* share : {"/3", "/12"}) {
      const std::string said = WarningsOf(fmt::format(
          "name: t\nbodies:\n  bar:\n    mass: 2\n    com: [0.1, 0, 0]\n    inertia: [2*{0}^2/2, "
          "2*0.2^2{1}, 2*0.2^2{1}]\n    frames: {{end: [0.2, 0, 0]}}\n    shapes: [{{capsule: "
          "{{to: "
          "end, radius: {0}}}}}]\njoints: {{hinge: {{kind: revolute, parent: world, child: bar, "
          "axis: y}}}}\ndrives: {{hinge: {{kind: joint, joint: hinge}}}}\n",
          radius, share));
      if (std::string(share) == "/3") {
        EXPECT_NE(said.find("are these about the body's origin?"), std::string::npos)
            << radius << said;
      } else {
        EXPECT_EQ(said, "") << radius;
      }
    }
  }
}

TEST(Plausibility, NoShippedModelRaisesADoubt) {
  int models = 0;
  for (const auto& entry : std::filesystem::directory_iterator(SourcePath("/models"))) {
    const auto file = entry.path() / "model.yaml";
    if (!std::filesystem::exists(file)) continue;
    ++models;
    const LoadResult loaded = LoadModel(file.string());
    ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
    EXPECT_EQ(loaded.diagnostics.Text(), "") << file;
  }
  EXPECT_GE(models, 10);
}

// Links in one line, folded back: no small motion of a joint narrows the gap, so that only chance
// leads out of it.
TEST(Plausibility, APoseFoundFromDisturbedGuessesIsReportedToBeChance) {
  std::ifstream stream(SourcePath("/models/four_bar/model.yaml"));
  std::string text{std::istreambuf_iterator<char>(stream), {}};
  EXPECT_EQ(WarningsOf(text), "");
  text = Replaced(text, "guess_deg: 90}", "guess_deg: 0}");
  text = Replaced(text, "guess_deg: -70}", "guess_deg: 180}");
  text = Replaced(text, "guess_deg: 100}", "guess_deg: 0}");
  const std::string said = WarningsOf(text);
  EXPECT_NE(said.find("the loops close only by a search"), std::string::npos) << said;
  EXPECT_NE(said.find("another assembly than meant"), std::string::npos) << said;
}

// Commands that count from home count from another place than the model says.
TEST(Plausibility, ADriveThatHomeHadToMoveIsNamed) {
  const std::string wide =
      Replaced(Slender(), "D: {position: [ground, 0, 0]}", "D: {position: [ground + 0.1, 0, 0]}");
  const std::string hinge = "child: crank.foot, axis: z, guess_deg: ";
  const std::string said = WarningsOf(Replaced(wide, hinge + "60", hinge + "165"));
  EXPECT_NE(said.find("the loops do not close with the driven joints at their guesses: home has "
                      "motor from 2.8798 to "),
            std::string::npos)
      << said;
  // Where the others can follow, the drive stays.
  EXPECT_EQ(WarningsOf(Replaced(wide, hinge + "60", hinge + "70")), "");
}

}  // namespace
}  // namespace mbv
