// The compliant simulation against frame elements and the closed forms on both robots, all over
// their workspaces, and maps.
#include "features/stiffness/stiffness.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "features/stiffness/stiffness_map.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// What is asked of two computations of K: the extrapolation to zero load leaves 1e-8 in ordinary
// poses and 1e-5 next to singular ones, where K is a small difference of large limbs' shares.
constexpr double kEntry = 1e-4;
constexpr double kLoose = 1e3;  // [rad/(N m)]: one degree under 0.02 N mm

std::optional<PreparedStiffness> Prepare(const std::string& mechanism, const std::string& more) {
  std::filesystem::current_path(kSourceDir);
  const std::string text = "kind: stiffness\nmechanism: " + mechanism + "\n" + more;
  StiffnessScenarioResult loaded = LoadStiffnessScenarioText(text, "scenarios/s.yaml");
  EXPECT_TRUE(loaded.scenario) << loaded.diagnostics.Text();
  if (!loaded.scenario) return {};
  Diagnostics diagnostics;
  auto prepared =
      PrepareStiffness(*std::move(loaded.scenario), *std::move(loaded.mechanism), &diagnostics);
  EXPECT_TRUE(prepared) << diagnostics.Text();
  return prepared;
}

void ExpectAgreement(const std::string& mechanism, const std::string& pose) {
  const auto prepared = Prepare(mechanism, pose);
  ASSERT_TRUE(prepared);
  // Next to a singular pose the simulation may find the platform loose, and says so.
  const Mat6 C = prepared->form->Evaluate(prepared->scenario.pose).C;
  if (!(C.diagonal().head<3>().maxCoeff() < kLoose)) return;
  const StiffnessReport report = RunStiffness(*prepared).report;
  EXPECT_EQ(report.comparison.verdict, Verdict::kAgree) << pose << report.comparison.reason;
  for (const char* pair : {"simulated_vs_analytic", "simulated_vs_reference"}) {
    const PairComparison* compared = report.comparison.FindPair(pair);
    ASSERT_NE(compared, nullptr) << pose;
    EXPECT_LT(compared->metrics.at(Metric::kStiffnessEntry).value, kEntry) << pose << pair;
  }
}

TEST(StiffnessPipeline, ScaraAgreesAllOverItsWorkspace) {
  std::mt19937_64 random(20260301);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int k = 0; k < 12; ++k) {
    const double radius = 0.095 * std::sqrt(unit(random)), azimuth = 2 * M_PI * unit(random);
    ExpectAgreement("scara_robot",
                    "pose: {platform.x: " + std::to_string(radius * std::cos(azimuth)) +
                        ", platform.y: " + std::to_string(radius * std::sin(azimuth)) +
                        ", platform.z: " + std::to_string(-0.105 - 0.115 * unit(random)) +
                        ", platform.yaw: " + std::to_string(unit(random) - 0.5) + "}\n");
  }
}

TEST(StiffnessPipeline, CabinAgreesAtTurnedPoses) {
  std::mt19937_64 random(20260302);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int k = 0; k < 8; ++k) {
    ExpectAgreement(
        "cabin_robot",
        "pose: {d1: 0.5, th6: 0.3, platform.x: " + std::to_string(0.1 * unit(random) - 0.05) +
            ", platform.y: " + std::to_string(0.31 + 0.08 * unit(random)) +
            ", platform.yaw_deg: " + std::to_string(12 * unit(random) - 6) +
            ", th3_deg: " + std::to_string(180 * unit(random) - 90) +
            ", th4_deg: " + std::to_string(90 * unit(random) - 80) +
            ", d5: " + std::to_string(-0.05 - 0.4 * unit(random)) + "}\n");
  }
}

TEST(StiffnessPipeline, ABeamOfOnePerMilleMoreIsSeenInEveryWitness) {
  for (const char* witness : {"analytic", "reference", "simulation"}) {
    const auto prepared = Prepare("scara_robot", std::string(witness) +
                                                     ": {parameters: {section_diameter: "
                                                     "0.008008}}\n");
    ASSERT_TRUE(prepared);
    const StiffnessReport report = RunStiffness(*prepared).report;
    EXPECT_EQ(report.comparison.verdict, Verdict::kDisagree) << witness;
    const std::string odd = report.comparison.attribution.odd_one_out;
    EXPECT_EQ(odd, witness == std::string("simulation") ? "simulated" : witness);
  }
}

TEST(StiffnessPipeline, ThePapersOwnModelIsStatedAndNotJudged) {
  const auto prepared = Prepare(
      "cabin_robot", "compare_printed: true\nloads: {random: {count: 50, seed: 20250201}}\n");
  ASSERT_TRUE(prepared);
  const StiffnessReport report = RunStiffness(*prepared).report;
  EXPECT_EQ(report.comparison.verdict, Verdict::kAgree) << report.comparison.reason;
  ASSERT_EQ(report.printed_pairs.size(), 1u);
  const auto loads = DifferenceOf(report.printed[0], report.witnesses[0]).loads;
  ASSERT_TRUE(loads);
  // 38, 3 and 22 % of the axes' largest displacements.
  const Vec6& error = loads->max;
  EXPECT_NEAR(error[3], 0.385, 0.001);
  EXPECT_NEAR(error[4], 0.0315, 0.0001);
  EXPECT_NEAR(error[5], 0.225, 0.001);
}

TEST(StiffnessMap, ItsPointsAreThoseOfSinglePosesAndItsMirrorIsTheMechanisms) {
  const auto prepared = Prepare("scara_robot", "simulation: off\n");
  ASSERT_TRUE(prepared);
  Diagnostics diagnostics;
  const auto map_at = [&](const std::string& text) {
    const auto map =
        ParseMap("x=-0.06:0.06:13,y=-0.06:0.06:13,z=-0.19," + text, *prepared, &diagnostics);
    EXPECT_TRUE(map) << diagnostics.Text();
    return ComputeMap(*prepared, *map);
  };
  const MapResult plus = map_at("phi_deg=45"), minus = map_at("phi_deg=-45");
  ASSERT_EQ(plus.reached, 169u);
  ASSERT_EQ(plus.indices[0].name, "kappa_m");
  for (size_t r = 0; r < 13; ++r) {
    for (size_t c = 0; c < 13; ++c) {
      const double here = plus.values[0][13 * r + c], there = minus.values[0][13 * c + r];
      EXPECT_NEAR(here / there, 1.0, 1e-10);
    }
  }
  PoseValues pose{{"platform.x", -0.05},
                  {"platform.y", 0.02},
                  {"platform.z", -0.19},
                  {"platform.yaw", M_PI / 4}};
  std::vector<double> values(prepared->form->indices().size());
  prepared->form->IndexValues(prepared->form->Evaluate(pose), values);
  EXPECT_NEAR(plus.values[0][13 * 8 + 1] / values[0], 1.0, 1e-12);
}

TEST(StiffnessMap, ItsBytesDoNotDependOnTheNumberOfJobs) {
  const auto prepared = Prepare("scara_robot", "simulation: off\n");
  ASSERT_TRUE(prepared);
  Diagnostics diagnostics;
  const auto map =
      ParseMap("x=-0.1:0.1:9 y=-0.1:0.1:7 within=0.11 z=-0.21 phi_deg=30", *prepared, &diagnostics);
  ASSERT_TRUE(map) << diagnostics.Text();
  const auto files = [&](int jobs) {
    return MapFiles(*map, ComputeMap(*prepared, *map, {}, jobs), "scara_robot", {}, &diagnostics);
  };
  const auto one = files(1);
  EXPECT_GT(one.size(), 2u);
  EXPECT_EQ(one, files(2));
  EXPECT_EQ(one, files(30));
}

TEST(StiffnessMap, PointsOutOfTheCircleOrOfReachAreLeftOut) {
  const auto prepared = Prepare("scara_robot", "simulation: off\n");
  ASSERT_TRUE(prepared);
  Diagnostics diagnostics;
  const auto map =
      ParseMap("x=-0.1:0.1:5 y=-0.1:0.1:5 within=0.1 z=-0.23 phi_deg=45", *prepared, &diagnostics);
  ASSERT_TRUE(map) << diagnostics.Text();
  const MapResult result = ComputeMap(*prepared, *map);
  EXPECT_EQ(result.points, 13u);  // of a 5 × 5 grid
  EXPECT_LT(result.reached, result.points);
  EXPECT_TRUE(std::isnan(result.values[0][0]));
  EXPECT_EQ(result.rank[0], -1);
}

// By the closed form and by frame elements alike.
TEST(StiffnessMap, PosesBeyondRangesAreLeftOutAndCounted) {
  std::array<MapResult, 2> maps;
  for (const bool form : {true, false}) {
    const auto prepared =
        Prepare("scara_robot", std::string("simulation: off\nparameters: {theta_max: 1.2}\n") +
                                   (form ? "" : "analytic: none\n"));
    ASSERT_TRUE(prepared);
    Diagnostics diagnostics;
    const auto map =
        ParseMap("x=-0.06:0.06:5,y=-0.06:0.06:5,z=-0.19,phi_deg=10", *prepared, &diagnostics);
    ASSERT_TRUE(map) << diagnostics.Text();
    MapResult& result = maps[form ? 0 : 1];
    result = ComputeMap(*prepared, *map);
    EXPECT_EQ(result.closed_form, form);
    EXPECT_GT(result.out_of_range, 0u);
    EXPECT_GT(result.reached, 0u);
    EXPECT_EQ(result.reached + result.out_of_range, 25u);
    EXPECT_NE(MapText(*map, result, {}).find("more only beyond ranges of joints or drives"),
              std::string::npos);
  }
  EXPECT_EQ(maps[0].rank, maps[1].rank);
}

}  // namespace
}  // namespace mbv
