// `legs`: the same as the bodies, joints and drives that they stand for.
#include <gtest/gtest.h>

#include "model_file/load_model.h"
#include "model_file/write_model.h"

namespace mbv {
namespace {

const char* const kTable =
    "name: table\n"
    "parameters: {m: 1.5, c: 0.1}\n"
    "world: {frames: {B: {position: [0.1, 0.2, 0], rotation: {rpy: [0.1, 0, 0]}}}}\n"
    "bodies: {top: {mass: 2, inertia: [1, 1, 1], frames: {A: [0, 0, -0.1]}}}\n"
    "joints: {float: {kind: free, parent: world, child: top, guess: [0.1, 0.2, 0.6, 0, 0, 0],"
    " closure: false}}\n";

std::string Written(const std::string& more) {
  const LoadResult loaded = LoadModelText(kTable + more, "m.yaml");
  EXPECT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  return loaded.mechanism ? WriteModel(*loaded.mechanism) : "";
}

std::string LegFindings(const std::string& keys) {
  return LoadModelText(kTable + ("legs: {leg: {" + keys + "}}\n"), "m.yaml").diagnostics.Text();
}

const char* const kHalves =
    ", lower: {mass: m, com: c, along: 0.001, across: 0.02},"
    " upper: {mass: 1, com: c - 0.02, along: 0.002, across: 0.01}";

// Bodies, joints and drive of a leg by hand, as a part of the same name.
std::string ByHand(const std::string& from, const std::string& to) {
  return "parts:\n"
         "  leg:\n"
         "    bodies:\n"
         "      lower: {mass: m, com: [0, 0, c], inertia: [0.02, 0.02, 0.001]}\n"
         "      upper: {mass: 1, com: [0, 0, -c + 0.02], inertia: [0.01, 0.01, 0.002]}\n"
         "    joints:\n"
         "      from: {" +
         from +
         ", parent: world.B, child: lower}\n"
         "      slide: {kind: prismatic, parent: lower, child: upper, axis: z, guess: 0.5,"
         " range: [0.3, 0.8]}\n"
         "      to: {" +
         to +
         ", parent: upper, child: top.A}\n"
         "    drives: {length: {kind: joint, joint: slide}}\n"
         "instances: {leg: {part: leg}}\n";
}

TEST(Legs, AreTheSameAsWrittenByHand) {
  const std::string universal = "kind: universal, axis: y, axis2: x", ball = "kind: spherical";
  const std::string ends = "from: world.B, to: top.A, length: 0.5, range: [0.3, 0.8]";
  const std::string leg = Written("legs: {leg: {" + ends + kHalves + "}}\n");
  EXPECT_EQ(leg, Written(ByHand(universal, ball)));
  EXPECT_NE(leg.find("leg_lower"), std::string::npos) << leg;
  EXPECT_EQ(Written("legs: {leg: {" + ends + ", ends: [spherical, universal]" + kHalves + "}}\n"),
            Written(ByHand(ball, universal)));
  const std::string balls = "legs: {leg: {" + ends + ", ends: [spherical, spherical]";
  EXPECT_EQ(Written(balls + kHalves + "}}\n"), Written(ByHand(ball, ball)));
  // Two angles of a universal joint, as roll, pitch, yaw.
  EXPECT_EQ(Written(balls + ", guess: [0.1, -0.2]" + kHalves + "}}\n"),
            Written(ByHand(ball + ", guess: [-0.2, 0.1, 0]", ball)));
  // Every number arrives.
  for (const char* perturbed : {"along: 0.002", "across: 0.01", "mass: 1", "com: c - 0.02"}) {
    std::string halves = kHalves;
    halves.insert(halves.find(perturbed) + std::string(perturbed).size(), "*1.01");
    EXPECT_NE(Written("legs: {leg: {" + ends + halves + "}}\n"), leg) << perturbed;
  }
}

TEST(Legs, OfPartsSeeTheirParametersAndNames) {
  const LoadResult loaded =
      LoadModelText(std::string(kTable) +
                        "parts:\n"
                        "  arm:\n"
                        "    parameters: {l: 0.5}\n"
                        "    attach: {world: {F: [0.1, 0.2, 0]}}\n"
                        "    legs: {leg: {from: world.F, to: top.A, length: l" +
                        kHalves +
                        "}}\n"
                        "instances: {left: {part: arm, l: 0.49}}\n",
                    "m.yaml");
  ASSERT_TRUE(loaded.mechanism.has_value()) << loaded.diagnostics.Text();
  const Mechanism& m = *loaded.mechanism;
  EXPECT_GE(m.FindBody("left.leg.upper"), 0);
  EXPECT_GE(m.FindDrive("left.leg.length"), 0);
  EXPECT_EQ(m.joints.at(static_cast<size_t>(m.FindJoint("left.leg.slide"))).guess[0], 0.49);
}

TEST(Legs, WhatMeansNothingIsAFinding) {
  EXPECT_EQ(LegFindings("from: world.B, to: top.A"),
            "m.yaml:6:13: error: legs.leg: 'length' is missing\n");
  EXPECT_EQ(LegFindings("from: world.B, to: top.A, length: 0.5, ends: [universal, universal]"),
            "m.yaml:6:59: error: legs.leg.ends: two ends of kind universal leave the leg no turn "
            "about its line\n  hint: at least one end spherical\n");
  EXPECT_EQ(LegFindings("from: world.B, to: top.A, length: 0.5, lower: {mass: 1, com: 0.1}"),
            "m.yaml:6:60: error: legs.leg.lower: 'along' is missing\n");
  EXPECT_NE(
      LegFindings("from: world.X, to: top.A, length: 0.5").find("body 'world' has no frame 'X'"),
      std::string::npos)
      << LegFindings("from: world.X, to: top.A, length: 0.5");
}

}  // namespace
}  // namespace mbv
