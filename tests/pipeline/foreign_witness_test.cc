// Programs outside as witnesses: one that computes, and one that does everything else.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "pipeline/run_scenario.h"
#include "report/pair_matrix.h"
#include "tests/source_dir.h"
#include "tests/test_folder.h"

namespace mbv {
namespace {

const std::string kPlanar = SourcePath("/scenarios/four_bar/planar.py");

// A tenth of a second of a four-bar, with this `witnesses:` section.
RunOutcome RunWith(const std::string& witnesses,
                   const std::string& simulation = "{mode: inverse}") {
  const test::TestFolder folder("foreign");
  const std::string file = folder.Write(
      "case.yaml", fmt::format(R"(
mechanism: {}
motion: {{duration_s: 0.1, sample_s: 0.01, commands: {{motor: [home, {{ramp: {{rate: 3}}}}]}}}}
loads: {{push: {{on: rocker.end, force: [30, -5, 0], in: world}}}}
simulation: {}
witnesses: {}
)",
                               SourcePath("/models/four_bar/model.yaml"), simulation, witnesses));
  return RunScenario(file, {});
}

std::string Mock(const std::string& how, const std::string& more = "") {
  return fmt::format("{{mock: {{command: [python3, {}, {}, {}]{}}}}}",
                     SourcePath("/tests/pipeline/mock_witness.py"), how, kPlanar, more);
}

const WitnessRecord* RecordOf(const RunOutcome& outcome, const std::string& name) {
  for (const WitnessRecord& record : outcome.report->witnesses) {
    if (record.name == name) return &record;
  }
  return nullptr;
}

TEST(ForeignWitness, JoinsTheComparison) {
  const RunOutcome outcome = RunWith(Mock("answers"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Comparison& comparison = outcome.report->comparison;
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  for (const char* name : {"mock_vs_reference", "simulated_vs_mock"}) {
    const PairComparison* pair = comparison.FindPair(name);
    ASSERT_NE(pair, nullptr) << name;
    ASSERT_TRUE(pair->compared) << name << ": " << pair->reason;
    EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-13) << name;
  }
  EXPECT_NE(comparison.FindCheck("mock_vs_reference.force_nrmse"), nullptr);
  EXPECT_NE(comparison.attribution.text.find("mock"), std::string::npos)
      << comparison.attribution.text;
  EXPECT_TRUE(PairMatrixLines(comparison).empty());  // three: reference, simulated, mock
}

// The smallest one that is shipped, on an axis, a centre of mass and a gravity that no axis of the
// world lines up with; it knows nothing else.
TEST(ForeignWitness, ThePendulumIsASmallOne) {
  const test::TestFolder folder("pendulum");
  folder.Write("model.yaml",
               "name: pendulum\ngravity: [1, -2, -9]\n"
               "bodies: {bob: {mass: 2, com: [0.1, 0.3, -0.2], inertia: [0.1, 0.2, 0.25]}}\n"
               "joints: {pin: {kind: revolute, parent: world, child: bob, axis: [0, 0.6, 0.8]}}\n"
               "drives: {motor: {kind: joint, joint: pin}}\n");
  const std::string file = folder.Write(
      "swing.yaml",
      "mechanism: model.yaml\nmotion: {duration_s: 0.5, sample_s: 0.01, commands: {motor: {sine: "
      "{amplitude: 2, period_s: 0.7}}}}\nanalytic: none\nsimulation: {mode: inverse}\n"
      "witnesses: {pendulum: {command: [python3, " +
          SourcePath("/examples/witness/pendulum.py") + "]}}\n");
  const RunOutcome swing = RunScenario(file, {});
  ASSERT_TRUE(swing.report) << swing.diagnostics.Text();
  EXPECT_EQ(swing.report->comparison.verdict, Verdict::kAgree) << swing.report->comparison.reason;
  const PairComparison* pair = swing.report->comparison.FindPair("pendulum_vs_reference");
  ASSERT_NE(pair, nullptr);
  ASSERT_TRUE(pair->compared) << pair->reason;
  EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-13);
  const RunOutcome linkage = RunWith("{pendulum: {command: [python3, " +
                                     SourcePath("/examples/witness/pendulum.py") + "]}}");
  ASSERT_TRUE(linkage.report);
  EXPECT_EQ(RecordOf(linkage, "pendulum")->summary.message,
            "declines: it is no body on one revolute joint");
}

// With four of them every pair stands in a matrix, and a star where it fails.
TEST(ForeignWitness, PairsOfManyStandInAMatrix) {
  const std::string one = Mock("answers"), two = Mock("bent");
  const RunOutcome outcome = RunWith(one.substr(0, one.size() - 1) + ", other" + two.substr(5));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const std::vector<std::string> lines = PairMatrixLines(outcome.report->comparison);
  ASSERT_EQ(lines.size(), 6U);
  EXPECT_NE(lines[0].find("drive force, RMS"), std::string::npos) << lines[0];
  EXPECT_TRUE(lines[2].starts_with("simulated")) << lines[2];
  for (size_t row = 2; row < 6; ++row) {
    const auto stars = std::count(lines[row].begin(), lines[row].end(), '*');
    EXPECT_EQ(stars, lines[row].starts_with("other") ? 3 : 1) << lines[row];
  }
  const std::string html = PairMatrixHtml(outcome.report->comparison);
  EXPECT_EQ(std::count(html.begin(), html.end(), '*'), 6 + 2);  // caption and label explain
}

// The limit is that of the reference: an error of 1e-8 counts.
TEST(ForeignWitness, ThatStandsAloneIsNamed) {
  for (const char* how : {"bent", "kilo"}) {
    const RunOutcome outcome = RunWith(Mock(how));
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kDisagree) << how;
    EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "mock")
        << how << ": " << outcome.report->comparison.attribution.text;
  }
  const RunOutcome kilo = RunWith(Mock("kilo"));
  EXPECT_NE(kilo.report->comparison.attribution.text.find("(0.001)"), std::string::npos)
      << kilo.report->comparison.attribution.text;
  // An engine that integrates is not held to it.
  EXPECT_EQ(RunWith(Mock("bent", ", limits: stepped")).report->comparison.verdict, Verdict::kAgree);
}

struct Mischief {
  const char* how;
  const char* told;
  const char* limits = "";
};

void PrintTo(const Mischief& mischief, std::ostream* out) { *out << mischief.how; }

class ForeignMischief : public testing::TestWithParam<Mischief> {};

TEST_P(ForeignMischief, HarmsNobodyAndIsTold) {
  const Mischief& mischief = GetParam();
  const RunOutcome outcome = RunWith(Mock(mischief.how, mischief.limits));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree)
      << outcome.report->comparison.reason;
  const WitnessRecord* record = RecordOf(outcome, "mock");
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(record->summary.stop, Stop::kNotRun);
  EXPECT_NE(record->summary.message.find(mischief.told), std::string::npos)
      << record->summary.message;
  const PairComparison* pair = outcome.report->comparison.FindPair("mock_vs_reference");
  ASSERT_NE(pair, nullptr);
  EXPECT_FALSE(pair->compared);
}

INSTANTIATE_TEST_SUITE_P(
    All, ForeignMischief,
    testing::Values(Mischief{"dies", "ended with exit code 3: no licence"},
                    Mischief{"crashes", "was ended by signal 6"},
                    Mischief{"hangs", "took longer than 0.5 s", ", timeout_s: 0.5"},
                    Mischief{"forks", "took longer than 0.5 s", ", timeout_s: 0.5"},
                    Mischief{"prints", "", ", output_mb: 1, timeout_s: 20"},
                    Mischief{"eats", "ended with exit code 1: MemoryError", ", memory_mb: 500"},
                    Mischief{"writes", "", ", output_mb: 1, timeout_s: 20"},
                    Mischief{"nothing", "left no witness.json"},
                    Mischief{"few", "traces.csv has 8 rows for 11 samples"},
                    Mischief{"nan", "traces.csv:6 gives 'nan' for motor.force"},
                    Mischief{"late",
                             "traces.csv:6 is at t = 0.0401 s where the sample is at 0.04 s"},
                    Mischief{"short", "traces.csv:6 has 3 cells for 4 columns"},
                    Mischief{"unknown",
                             "a column 'motr.force', which is no signal of the mechanism (did you "
                             "mean 'motor.force'?)"},
                    Mischief{"twice", "traces.csv has two columns 'motor.velocity'"},
                    Mischief{"foot", "units is 'foot, pound'"},
                    Mischief{"refuses", "declines: it has a loop"},
                    Mischief{"schema", "schema is 'mbverify/witness/0'"},
                    Mischief{"link", "left no traces.csv"},
                    Mischief{"garbage", "witness.json: line 1, character 2: the file ends"}),
    [](const testing::TestParamInfo<Mischief>& info) { return std::string(info.param.how); });

TEST(ForeignWitness, ThatIsNotThereIsNotAvailable) {
  const RunOutcome outcome = RunWith("{gone: {command: [mbverify-no-such-program]}}");
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
  EXPECT_NE(RecordOf(outcome, "gone")->summary.message.find("could not be started"),
            std::string::npos)
      << RecordOf(outcome, "gone")->summary.message;
}

TEST(ForeignWitness, WithoutOthersVerifiesWhatItCan) {
  const RunOutcome outcome = RunWith(Mock("answers"), "off");
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree)
      << outcome.report->comparison.reason;
}

#ifdef MBV_SIMBODY
// Another engine with its own mathematics, on trees and closures of every kind that it knows.
TEST(ForeignWitness, SimbodyAgrees) {
  for (const char* scenario :
       {"four_bar/turn_inverse", "slider_crank/press", "stewart/wave", "spr_tripod/default",
        "scara_robot/default", "cabin_robot/default"}) {
    RunOptions options;
    options.pictures = false;
    options.scenario.set = {
        {"witnesses", std::string("{simbody: {command: [") + MBV_SIMBODY + "]}}"}};
    const RunOutcome outcome =
        RunScenario(SourcePath(std::string("/scenarios/") + scenario + ".yaml"), options);
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    const PairComparison* pair = outcome.report->comparison.FindPair("simbody_vs_reference");
    ASSERT_NE(pair, nullptr) << scenario;
    ASSERT_TRUE(pair->compared) << scenario << ": " << pair->reason;
    // Measured up to 5.7e-13: its projections end at 1e-13 m or rad.
    EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-11) << scenario;
  }
}

// Free motions: springs, six free coordinates, a stiff loop that turns at thousands of rad/s. A
// bent truth is told, and of three witnesses the odd one out is named.
TEST(ForeignWitness, SimbodyMovesFreely) {
  const auto run = [](const char* scenario, const std::string& density) {
    RunOptions options;
    options.out_dir.clear();
    options.pictures = options.page = false;
    options.scenario.set = {
        {"witnesses", std::string("{simbody: {limits: stepped, command: [") + MBV_SIMBODY + "]}}"}};
    if (!density.empty()) options.scenario.set.emplace_back("simulation.parameters.rho", density);
    return RunScenario(SourcePath(std::string("/scenarios/") + scenario + ".yaml"), options);
  };
  for (const char* scenario :
       {"spring_cart/swing", "floating_loop/tumble", "andrews_squeezer/benchmark"}) {
    const RunOutcome outcome = run(scenario, "");
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree) << scenario;
    const PairComparison* pair = outcome.report->comparison.FindPair("simbody_vs_reference");
    ASSERT_NE(pair, nullptr) << scenario;
    ASSERT_TRUE(pair->compared) << scenario << ": " << pair->reason;
    // Measured up to 5.4e-11 m: its integrator is asked for 1e-11 in each step.
    EXPECT_LT(pair->metrics.at(Metric::kPoseM).value, 1e-9) << scenario;
  }
  const RunOutcome heavy = run("floating_loop/tumble", "3.0003");
  ASSERT_TRUE(heavy.report);
  EXPECT_EQ(heavy.report->comparison.verdict, Verdict::kDisagree);
  EXPECT_EQ(heavy.report->comparison.attribution.odd_one_out, "simulated");
  EXPECT_NE(heavy.report->comparison.driving.find("is given the same start and forces"),
            std::string::npos)
      << heavy.report->comparison.driving;
}

// What it does not know it declines, and the verdict is that of the others.
TEST(ForeignWitness, SimbodyDeclinesFriction) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = {
      {"witnesses", std::string("{simbody: {command: [") + MBV_SIMBODY + "]}}"}};
  const RunOutcome outcome =
      RunScenario(SourcePath("/scenarios/rubbing_five_bar/dwell_inverse.yaml"), options);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
  EXPECT_EQ(RecordOf(outcome, "simbody")->summary.message, "declines: it has elements");
}
#endif

TEST(ForeignWitness, BadSectionsAreRefused) {
  const RunOutcome outcome = RunWith(
      "{simulated: {command: [x]}, a b: {command: [x]}, c: {command: []}, d: {comand: [x]}, e: "
      "{command: [x], limits: loose, timeout_s: -1}}");
  EXPECT_EQ(outcome.exit_code, 2);
  const std::string text = outcome.diagnostics.Text();
  for (const char* told :
       {"witnesses.simulated: this is the name of one of our own witnesses",
        "witnesses.a b: letters, digits and _ make a witness' name", "witnesses.c.command is empty",
        "unknown key 'comand'", "witnesses.e.limits", "witnesses.e.timeout_s = -1"}) {
    EXPECT_NE(text.find(told), std::string::npos) << told << "\nin\n" << text;
  }
}

}  // namespace
}  // namespace mbv
