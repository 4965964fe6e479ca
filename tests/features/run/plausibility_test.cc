// What a run must not keep to itself: forces that many would do for, guesses that were disturbed,
// steps that are too coarse, tables of another gravity; and whom it blames.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>

#include "comparison/force_scale.h"
#include "features/run/run_scenario.h"
#include "reference/reference.h"
#include "report/report.h"
#include "tests/support/source_dir.h"
#include "verify/prepare.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string Shipped(const std::string& name) { return SourcePath("/scenarios/" + name + ".yaml"); }

std::string TextOf(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

// A folder of this test's own, removed with it.
struct Folder {
  fs::path path;
  explicit Folder(const std::string& name) : path(fs::temp_directory_path() / ("mbv_" + name)) {
    fs::remove_all(path);
    fs::create_directories(path);
  }
  ~Folder() { fs::remove_all(path); }
  std::string Write(const std::string& name, const std::string& text) const {
    std::ofstream(path / name) << text;
    return (path / name).string();
  }
};

RunOutcome RunScenarioFile(const std::string& file, std::vector<SetValue> set = {},
                           const std::string& out = "") {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = std::move(set);
  options.out_dir = out;
  return RunScenario(file, options);
}

bool Has(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

// Terminal, summary.json and report.html all say it.
void ExpectReportedEverywhere(const RunOutcome& outcome, const std::string& part) {
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_TRUE(Has(ToTable(*outcome.report, {}), part)) << ToTable(*outcome.report, {});
  EXPECT_TRUE(Has(TextOf(fs::path(outcome.folder) / "summary.json"), part));
  EXPECT_TRUE(Has(TextOf(fs::path(outcome.folder) / "report.html"), part));
}

// An arm turned by a prescribed hinge and a leg: one of them would do.
constexpr const char* kHeldTwice = R"(name: held_twice
world: {frames: {foot: [0.6, 0, -0.5]}}
bodies:
  arm:
    mass: 3
    com: [0.3, 0, 0]
    inertia: [0.01, 0.1, 0.1]
    frames: {tip: [0.6, 0, 0]}
joints:
  hinge: {kind: revolute, parent: world, child: arm, axis: y}
drives:
  leg: {kind: distance, from: world.foot, to: arm.tip}
prescribed:
  lean: {joint: hinge}
outputs: {tip: arm.tip}
)";

TEST(VerdictCaveats, ForcesThatMuJoCoFindsNotUniqueAreNamed) {
  const Folder folder("held_twice");
  folder.Write("held_twice.yaml", kHeldTwice);
  const std::string scenario = folder.Write(
      "lean.yaml",
      "mechanism: held_twice.yaml\nmotion: {duration_s: 1, sample_s: 0.02, commands: {lean: {sine: "
      "{amplitude: 0.2, period_s: 1}}}}\nanalytic: none\nsimulation: {mode: inverse}\n");
  const RunOutcome outcome = RunScenarioFile(scenario, {}, (folder.path / "out").string());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->simulated_not_unique, (std::vector<std::string>{"leg", "lean"}));
  ExpectReportedEverywhere(outcome, "the forces of leg, lean are not unique");
  const auto json = nlohmann::json::parse(TextOf(fs::path(outcome.folder) / "summary.json"));
  EXPECT_EQ(json["simulation"]["forces_not_unique"].size(), 2u);
}

TEST(VerdictCaveats, UniqueForcesRaiseNone) {
  const RunOutcome outcome = RunScenarioFile(Shipped("four_bar/turn_inverse"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_TRUE(outcome.report->simulated_not_unique.empty());
  EXPECT_TRUE(outcome.report->findings.empty()) << outcome.report->findings.Text();
}

TEST(VerdictCaveats, GuessesThatHadToBeDisturbedAreReportedEverywhere) {
  const Folder folder("disturbed");
  std::string model = TextOf(SourcePath("/models/four_bar/model.yaml"));
  // Links in one line, folded back: no small motion narrows the gap.
  const auto replace = [&](const std::string& from, const std::string& to) {
    ASSERT_TRUE(Has(model, from));
    model.replace(model.find(from), from.size(), to);
  };
  replace("guess_deg: 90}", "guess_deg: 0}");
  replace("guess_deg: -70}", "guess_deg: 180}");
  replace("guess_deg: 100}", "guess_deg: 0}");
  folder.Write("disturbed.yaml", model);
  const std::string scenario =
      folder.Write("still.yaml",
                   "mechanism: disturbed.yaml\nmotion: {duration_s: 0.1, sample_s: 0.01, commands: "
                   "{motor: home}}\nanalytic: none\nsimulation: {mode: inverse}\n");
  const RunOutcome outcome = RunScenarioFile(scenario, {}, (folder.path / "out").string());
  ExpectReportedEverywhere(outcome, "the loops close only by a search");
}

TEST(VerdictCaveats, TheDriverIsNamedEverywhere) {
  const Folder folder("driver");
  const RunOutcome outcome =
      RunScenarioFile(Shipped("spr_tripod/default_inverse"), {}, folder.path.string());
  ExpectReportedEverywhere(
      outcome,
      "ommanded in task space, the simulation follows the drive positions, rates "
      "and accelerations that the closed form computes");
  ExpectReportedEverywhere(outcome, "compare a drive motion with itself");
}

TEST(VerdictCaveats, AStepThatIsTooCoarseIsNamedByARunWithAQuarterOfIt) {
  const RunOutcome outcome =
      RunScenarioFile(Shipped("spring_cart/swing"), {{"simulation.step_s", "0.01"}});
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Comparison& comparison = outcome.report->comparison;
  EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
  EXPECT_EQ(comparison.attribution.odd_one_out, "simulated") << comparison.attribution.text;
  EXPECT_TRUE(Has(comparison.attribution.text, "simulation.step_s = 0.01 is too coarse"))
      << comparison.attribution.text;
}

// With every DOF commanded the loops open, too, and power is lost with them.
TEST(VerdictCaveats, AStepThatIsTooCoarseForACommandedMotionIsNamedToo) {
  for (const char* step_s : {"0.01", "0.001"}) {
    const RunOutcome outcome =
        RunScenarioFile(Shipped("four_bar/turn"), {{"simulation.step_s", step_s}});
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    const Comparison& comparison = outcome.report->comparison;
    const bool coarse = comparison.verdict == Verdict::kDisagree;
    EXPECT_EQ(coarse, std::string(step_s) == "0.01") << comparison.attribution.text;
    EXPECT_EQ(Has(comparison.attribution.text, "is too coarse for this motion"), coarse)
        << comparison.attribution.text;
  }
}

TEST(VerdictCaveats, ADefaultStepThatIsTooCoarseIsNamed) {
  const RunOutcome outcome = RunScenarioFile(
      Shipped("four_bar/turn"),
      {{"motion.commands.motor", "[home, {ramp: {rate: 10*pi}}]"}, {"motion.duration_s", "4"}});
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_TRUE(
      Has(outcome.report->comparison.attribution.text, "simulation.step_s = 0.001 is too coarse"))
      << outcome.report->comparison.attribution.text;
}

TEST(VerdictCaveats, AStifferSpringIsNotPutDownToTheStep) {
  const RunOutcome outcome = RunScenarioFile(Shipped("spring_cart/must_fail/stiffer_spring"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Attribution& attribution = outcome.report->comparison.attribution;
  EXPECT_FALSE(Has(attribution.text, "step_s")) << attribution.text;
  EXPECT_EQ(attribution.odd_one_out, "") << attribution.text;
}

// A free motion against a table of it: solver and simulation stand together against a wrong one.
TEST(VerdictCaveats, InFreeMotionTwoComputationsStandAgainstATable) {
  const RunOutcome run = RunScenarioFile(Shipped("spring_cart/swing"));
  ASSERT_TRUE(run.report) << run.diagnostics.Text();
  const Trace& trace = run.report->witnesses[1].trace;
  ASSERT_EQ(trace.witness, "reference");
  for (const double off : {0.0, 8e-4}) {
    const Folder folder("free_table");
    std::string table = "t,x\n";
    for (size_t i = 0; i < trace.time_s.size(); ++i) {
      const double x = trace.values(static_cast<Eigen::Index>(i), trace.Find("motor.position"));
      const double t = trace.time_s[i];
      table += fmt::format("{:.17g},{:.17g}\n", t, x + off * std::sin(t));
    }
    const std::string csv = folder.Write("cart.csv", table);
    const RunOutcome outcome = RunScenarioFile(
        Shipped("spring_cart/swing"),
        {{"reference", "{csv: '" + csv + "', columns: {time: t, motor.position: x}}"}});
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    const Comparison& comparison = outcome.report->comparison;
    if (off == 0.0) {
      EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
      continue;
    }
    EXPECT_EQ(comparison.verdict, Verdict::kDisagree);
    const std::string& text = comparison.attribution.text;
    EXPECT_EQ(comparison.attribution.odd_one_out, "reference") << text;
    EXPECT_TRUE(Has(text, "simulation and the generic solver agree to")) << text;
    EXPECT_FALSE(Has(text, "%")) << text;
    EXPECT_FALSE(Has(text, "third witness")) << text;
  }
}

// A table of the crank's torque made with this g and density, to one part in a thousand.
std::string GravityDoubtOf(double g, double density, Verdict* verdict) {
  const Folder folder("gravity_table");
  Diagnostics findings;
  ScenarioOptions options;
  options.set = {{"parameters", fmt::format("{{rho: {:.17g}}}", 2.0 * density)}};
  const auto prepared = Prepare(Shipped("four_bar/turn"), options, &findings);
  if (!prepared) return findings.Text();
  Mechanism mechanism = prepared->base;
  mechanism.gravity_W *= g / 9.81;
  const ReferenceRun run = RunReference(mechanism, prepared->scenario.motion);
  std::string table = "t,T\n";
  for (size_t i = 0; i < run.trace.time_s.size(); ++i) {
    table +=
        fmt::format("{:.17g},{:.17g}\n", run.trace.time_s[i],
                    run.trace.values(static_cast<Eigen::Index>(i), run.trace.Find("motor.force")));
  }
  const RunOutcome outcome = RunScenarioFile(
      Shipped("four_bar/turn"),
      {{"reference", "{csv: '" + folder.Write("torque.csv", table) +
                         "', columns: {time: t, motor.force: T}, tolerance: {relative: 1e-3}}"}});
  if (!outcome.report) return outcome.diagnostics.Text();
  *verdict = outcome.report->comparison.verdict;
  return outcome.report->findings.Text();
}

TEST(VerdictCaveats, ATableOfAnotherGravityAgreesButNotWithoutAWord) {
  Verdict verdict = Verdict::kNotRun;
  const std::string said = GravityDoubtOf(9.80665, 1.0, &verdict);
  EXPECT_EQ(verdict, Verdict::kAgree);
  EXPECT_TRUE(Has(said, "fit g = 9.80665 m/s² better than the model's 9.81")) << said;
  // The same g raises no warning, nor does a mass that is wrong by as much.
  EXPECT_EQ(GravityDoubtOf(9.81, 1.0, &verdict), "");
  EXPECT_EQ(GravityDoubtOf(9.81, 9.80665 / 9.81, &verdict), "");
}

// A shipped scenario of a model that is changed and allows it.
RunOutcome RunAllowed(const Folder& folder, const std::string& scenario, const std::string& allow,
                      const std::vector<std::pair<std::string, std::string>>& changes) {
  const std::string name = scenario.substr(0, scenario.find('/'));
  std::string text = TextOf(SourcePath("/models/" + name + "/model.yaml"));
  for (const auto& [from, to] : changes) {
    EXPECT_TRUE(Has(text, from)) << from;
    text.replace(text.find(from), from.size(), to);
  }
  const std::string model = folder.Write("model.yaml", allow + "\n" + text);
  return RunScenarioFile(Shipped(scenario), {{"mechanism", model}}, folder.path.string());
}

// A warning below would be overlooked: the sentence of the verdict says what the model lets pass.
TEST(Waiver, RoundedDataAndImpossibleInertiasStandInTheVerdict) {
  const Folder rounded("rounded_bricard");
  const RunOutcome projected =
      RunAllowed(rounded, "bricard/turn_inverse", "closure_tolerance: 3e-3",
                 {{"end: [0, -length, 0]", "end: [1e-3, -length - 5e-4, 3e-4]"}});
  ExpectReportedEverywhere(projected, "allowed by the model: joint frames moved by up to");
  EXPECT_EQ(projected.exit_code, 0) << projected.diagnostics.Text();
  // Closed in a short arc only, the far end of the motion would be noise.
  for (const char* rounded_end : {"end: [0, -length - 1e-4, 0]", "end: [0, -length - 1e-3, 0]"}) {
    const RunOutcome one = RunAllowed(rounded, "bricard/turn_inverse", "closure_tolerance: 3e-3",
                                      {{"end: [0, -length, 0]", rounded_end}});
    EXPECT_EQ(one.exit_code, 0) << one.report->comparison.reason;
  }
  const Folder impossible("impossible_crank");
  const RunOutcome allowed =
      RunAllowed(impossible, "four_bar/turn_inverse", "allow: impossible_inertia",
                 {{"inertia: [rho*crank*bar^2/2, rho*crank*crank^2/12, rho*crank*crank^2/12]",
                   "inertia: [rho*crank*bar^2/2, rho*crank*crank^2/12, rho*crank*crank^2/3]"}});
  // Alone it is a sentence of its own, with a capital on the page.
  ExpectReportedEverywhere(allowed, "llowed by the model: impossible inertia of crank");
  EXPECT_EQ(allowed.exit_code, 0) << allowed.report->comparison.reason;
}

// Nothing weighs on a drive that moves a massless body. A simulation gives the body some mass, and
// what that takes is no error; a force that a mass of a millionth asks for is one.
TEST(MasslessEnd, IsJudgedByWhatASimulationResolves) {
  const Folder folder("massless_end");
  const auto write = [&](const std::string& file, const std::string& feather) {
    return folder.Write(file,
                        "name: feather\nbodies:\n  arm: {frames: {tip: [0.4, 0, 0]}, mass: 2, "
                        "com: [0.2, 0, 0], inertia: [0.1, 0.1, 0.1]}\n  feather: " +
                            feather +
                            "\njoints:\n"
                            "  a: {kind: revolute, parent: world, child: arm, axis: y}\n"
                            "  b: {kind: revolute, parent: arm.tip, child: feather, axis: y}\n"
                            "drives: {a: {kind: joint, joint: a}, b: {kind: joint, joint: b}}\n");
  };
  const std::string model = write("model.yaml", "{}");
  const std::string scenario = folder.Write(
      "first.yaml",
      "mechanism: ./model.yaml\nmotion:\n  duration_s: 1\n  sample_s: 0.02\n  commands:\n"
      "    a: [home, {bump: {start_s: 0, duration_s: 1, height: 0.3}}]\n"
      "    b: [home, {bump: {start_s: 0, duration_s: 1, height: 0.2}}]\n"
      "analytic: none\nsimulation: {mode: inverse}\n");
  const RunOutcome outcome = RunScenarioFile(scenario, {}, folder.path.string());
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.report->comparison.reason;
  const PairComparison* pair = outcome.report->comparison.FindPair("simulated_vs_reference");
  ASSERT_NE(pair, nullptr);
  const double error = pair->drives[1].nrmse;
  EXPECT_EQ(pair->drives[1].rms_truth, 0.0);
  EXPECT_GT(error, 0.0);
  EXPECT_LT(error, 1e-9);
  // Against the forces of a feather that has mass, by its share of all.
  const RunOutcome heavy =
      RunScenarioFile(scenario,
                      {{"mechanism", write("heavy.yaml",
                                           "{mass: 2e-6, com: [0.1, 0, 0], inertia: [1e-8, "
                                           "1e-8, 1e-8]}")}},
                      folder.path.string());
  ASSERT_TRUE(heavy.report) << heavy.diagnostics.Text();
  EXPECT_GT(heavy.report->comparison.FindPair("simulated_vs_reference")->drives[1].rms_truth /
                (pair->drives[0].rms_truth * ForceScale::kIdle),
            1e-5);
}

}  // namespace
}  // namespace mbv
