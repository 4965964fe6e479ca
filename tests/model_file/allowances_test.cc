// What a model can make the loader accept: rounded data of overconstrained loops, impossible
// inertias; and models of many bodies.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "kinematics/home.h"
#include "kinematics/mobility.h"
#include "model_file/load_model.h"
#include "tests/mechanisms/four_bar.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

LoadResult LoadText(const std::string& text) { return LoadModelText(text, "m.yaml", {}); }

// The four-bar with its second pivot out of the plane and its axis askew by `size`.
std::string RoundedFourBar(double size, const std::string& head = "") {
  return head +
         Replaced(kFourBar, "D: {position: [ground, 0, 0]}",
                  fmt::format("D: {{position: [ground, 0, {0}], rotation: {{rpy: [{0}, 0, 0]}}}}",
                              size));
}

// Bricard's linkage with the ends of two bars displaced by about `size`.
std::string RoundedBricard(double size, const std::string& head = "") {
  std::ifstream file(SourcePath("/models/bricard/model.yaml"));
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  return head + Replaced(Replaced(text, "end: [0, -length, 0]",
                                  fmt::format("end: [{0}, -length - {0}/2, {0}/3]", size)),
                         "end: [0, length, 0]",
                         fmt::format("end: [-{0}/4, length - {0}/3, {0}]", size));
}

std::string Tolerance(double size) { return fmt::format("closure_tolerance: {}\n", 3 * size); }

TEST(RoundedData, AreNamedAsThatAndRefusedWithoutATolerance) {
  for (const double size : {1e-10, 1e-6, 1e-3}) {
    const std::string four_bar = LoadText(RoundedFourBar(size)).diagnostics.Text();
    EXPECT_NE(four_bar.find("overconstrained by 3 and closed except for"), std::string::npos)
        << size << ": " << four_bar;
    EXPECT_NE(four_bar.find("rounded data?"), std::string::npos) << four_bar;
    const std::string bricard = LoadText(RoundedBricard(size)).diagnostics.Text();
    EXPECT_NE(bricard.find("overconstrained by 1 and closed except for"), std::string::npos)
        << size << ": " << bricard;
    // A tolerance that is too small changes nothing.
    EXPECT_FALSE(LoadText(RoundedFourBar(size, "closure_tolerance: 1e-12\n")).mechanism);
  }
}

void ExpectProjected(const LoadResult& loaded, double size, int redundant) {
  ASSERT_TRUE(loaded.mechanism) << size << ": " << loaded.diagnostics.Text();
  EXPECT_NE(loaded.diagnostics.Text().find("joint frames moved by up to"), std::string::npos);
  const Mechanism& m = *loaded.mechanism;
  // It moves as the ideal mechanism does: at home and nearby.
  const MobilityReport report = ReportMobility(m, 4);
  EXPECT_EQ(report.home.dofs, 1);
  EXPECT_EQ(report.home.redundant, redundant);
  EXPECT_EQ(report.nearby.size(), 4u);
  EXPECT_EQ(report.dofs(), 1);
  EXPECT_EQ(report.redundant_count(), redundant);
}

TEST(RoundedData, AreProjectedUpToTheStatedTolerance) {
  for (const double size : {1e-10, 1e-8, 1e-6, 1e-4, 1e-3}) {
    ExpectProjected(LoadText(RoundedFourBar(size, Tolerance(size))), size, 3);
  }
  for (const double size : {1e-10, 1e-8, 1e-6, 1e-5, 1e-4, 3e-4, 1e-3, 3e-3}) {
    ExpectProjected(LoadText(RoundedBricard(size, Tolerance(size))), size, 1);
  }
}

TEST(RoundedData, AWrongLengthIsNotARounding) {
  const std::string text = Replaced(kFourBar, "rocker:\n    frames: {foot: {}, end: [crank, 0, 0]}",
                                    "rocker:\n    frames: {foot: {}, end: [crank, 0, 0.05]}");
  const LoadResult loaded = LoadText("closure_tolerance: 1\n" + text);
  const std::string said = loaded.diagnostics.Text();
  ASSERT_FALSE(loaded.diagnostics.empty());
  EXPECT_EQ(loaded.diagnostics.findings()[0].code, FindingCode::kOpenLoop) << said;
  EXPECT_EQ(loaded.diagnostics.findings()[0].subject, "C") << said;
  EXPECT_EQ(said.find("rounded"), std::string::npos) << said;
}

TEST(ImpossibleInertia, IsTakenIfTheModelAllowsItAndNamedLoudly) {
  const std::string text = Replaced(kFourBar, "zz: 0.02", "zz: 0.2");
  EXPECT_FALSE(LoadText(text).mechanism);
  for (const char* allow : {"allow: impossible_inertia\n", "allow: [impossible_inertia]\n"}) {
    const LoadResult loaded = LoadText(allow + text);
    ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
    EXPECT_NE(loaded.diagnostics.Text().find(
                  "bodies.crank: ALLOWED BY THE MODEL: impossible inertia of crank"),
              std::string::npos)
        << loaded.diagnostics.Text();
    EXPECT_EQ(loaded.mechanism->bodies[1].I_Bcm_B(2, 2), 0.2);
  }
  const std::string said = LoadText("allow: impossible_mass\n" + text).diagnostics.Text();
  EXPECT_NE(said.find("impossible_inertia"), std::string::npos) << said;
}

TEST(ManyBodies, FiveHundredAreRead) {
  std::string text =
      "name: t\nparts:\n  pendulum:\n    bodies: {bob: {mass: 1, inertia: [1, 1, 1]}}\n"
      "    joints: {hinge: {kind: revolute, parent: world, child: bob, axis: x}}\n"
      "instances:\n";
  for (int i = 0; i < 500; ++i) text += fmt::format("  p{}: {{part: pendulum}}\n", i);
  const LoadResult loaded = LoadText(text);
  ASSERT_TRUE(loaded.mechanism) << loaded.diagnostics.Text();
  EXPECT_EQ(loaded.mechanism->bodies.size(), 501u);
}

}  // namespace
}  // namespace mbv
