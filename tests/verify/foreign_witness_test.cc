// Programs outside as witnesses: one that computes, and one that does everything else.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "base/files.h"
#include "base/text.h"
#include "features/run/run_scenario.h"
#include "report/plot_points.h"
#include "tests/support/sanitized.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/program_call.h"
#include "verify/program_consent.h"

namespace mbv {
namespace {

// Programs of tests are ours.
RunOutcome RunTrusted(const std::string& file) {
  RunOptions options;
  options.programs.all = true;
  return RunScenario(file, options);
}

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
  return RunTrusted(file);
}

std::string Mock(const std::string& how, const std::string& more = "") {
  return fmt::format("{{mock: {{command: [python3, {}, {}, {}]{}}}}}",
                     SourcePath("/tests/verify/mock_witness.py"), how, kPlanar, more);
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
  EXPECT_TRUE(PairMatrix(comparison).rows.empty());  // three: reference, simulated, mock
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
  const RunOutcome swing = RunTrusted(file);
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
            "not applicable: it is not a body on one revolute joint");
}

// With four of them every pair stands in a matrix, and a star where it fails.
TEST(ForeignWitness, PairsOfManyStandInAMatrix) {
  const std::string one = Mock("answers"), two = Mock("perturbed");
  const RunOutcome outcome = RunWith(one.substr(0, one.size() - 1) + ", other" + two.substr(5));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Table pairs = PairMatrix(outcome.report->comparison);
  EXPECT_NE(pairs.caption.find("drive force, RMS"), std::string::npos) << pairs.caption;
  const std::vector<std::string> lines = TextLines(pairs, {.indent = ""});
  ASSERT_EQ(lines.size(), 5U);
  EXPECT_TRUE(lines[1].starts_with("simulated")) << lines[1];
  for (size_t row = 1; row < 5; ++row) {
    const auto stars = std::count(lines[row].begin(), lines[row].end(), '*');
    EXPECT_EQ(stars, lines[row].starts_with("other") ? 3 : 1) << lines[row];
  }
  const std::string html = ToHtml(pairs);
  EXPECT_EQ(std::count(html.begin(), html.end(), '*'), 6 + 2);  // caption and label explain
}

// The limit is that of the reference: an error of 1e-8 counts.
TEST(ForeignWitness, ThatStandsAloneIsNamed) {
  for (const char* how : {"perturbed", "kilo"}) {
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
  EXPECT_EQ(RunWith(Mock("perturbed", ", limits: stepped")).report->comparison.verdict,
            Verdict::kAgree);
}

struct Mischief {
  const char* how;
  const char* reported;
  WitnessGap gap;
  const char* limits = "";
};

void PrintTo(const Mischief& mischief, std::ostream* out) { *out << mischief.how; }

class ForeignMischief : public testing::TestWithParam<Mischief> {};

const Caveat* MissingIn(const RunOutcome& outcome) {
  for (const Caveat& caveat : outcome.report->comparison.caveats) {
    if (caveat.kind == CaveatKind::kWitnessMissing) return &caveat;
  }
  return nullptr;
}

// In the verdict of the others, in the short line and in summary.json.
void ExpectCaveat(const RunOutcome& outcome, const std::string& witness, WitnessGap gap) {
  const Caveat* caveat = MissingIn(outcome);
  ASSERT_NE(caveat, nullptr);
  EXPECT_EQ(caveat->of, std::vector<std::string>{witness});
  EXPECT_EQ(caveat->gap, gap) << ToText(caveat->gap);
  const std::string line = VerdictLine(ViewOf(*outcome.report), {});
  EXPECT_NE(line.find("; caveat: " + caveat->text), std::string::npos) << line;
  const auto json = nlohmann::json::parse(ToJson(*outcome.report));
  EXPECT_EQ(json["caveats"].back()["text"], caveat->text);
  const auto& value = json["caveats"].back();
  EXPECT_EQ(value["kind"], "witness_missing");
  EXPECT_EQ(value["of"], nlohmann::json::array({witness}));
  EXPECT_EQ(value["cause"], ToText(gap));
}

TEST_P(ForeignMischief, IsACaveatOfTheVerdict) {
  const Mischief& mischief = GetParam();
  const RunOutcome outcome = RunWith(Mock(mischief.how, mischief.limits));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree)
      << outcome.report->comparison.reason;
  const WitnessRecord* record = RecordOf(outcome, "mock");
  ASSERT_NE(record, nullptr);
  EXPECT_EQ(record->summary.stop, Stop::kNotRun);
  EXPECT_NE(record->summary.message.find(mischief.reported), std::string::npos)
      << record->summary.message;
  const PairComparison* pair = outcome.report->comparison.FindPair("mock_vs_reference");
  ASSERT_NE(pair, nullptr);
  EXPECT_FALSE(pair->compared);
  ExpectCaveat(outcome, "mock", mischief.gap);
}

TEST_P(ForeignMischief, LeavesNoVerdictWhereItIsRequired) {
  const Mischief& mischief = GetParam();
  const RunOutcome outcome =
      RunWith(Mock(mischief.how, std::string(mischief.limits) + ", required: true"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kNotRun);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_TRUE(
      outcome.report->comparison.reason.starts_with("the scenario requires the witness mock"))
      << outcome.report->comparison.reason;
}

INSTANTIATE_TEST_SUITE_P(
    All, ForeignMischief,
    testing::Values(
        Mischief{"dies", "ended with exit code 3: no licence", WitnessGap::kExitCode},
        Mischief{"crashes", "was ended by signal 6", WitnessGap::kSignal},
        Mischief{"hangs", "took longer than 0.5 s", WitnessGap::kTimedOut, ", timeout_s: 0.5"},
        Mischief{"forks", "took longer than 0.5 s", WitnessGap::kTimedOut, ", timeout_s: 0.5"},
        Mischief{"prints", "", WitnessGap::kExitCode, ", output_mb: 1, timeout_s: 20"},
        Mischief{"eats", "ended with exit code 1: MemoryError", WitnessGap::kExitCode,
                 ", memory_mb: 500"},
        Mischief{"writes", "", WitnessGap::kExitCode, ", output_mb: 1, timeout_s: 20"},
        Mischief{"nothing", "left no witness.json", WitnessGap::kNoAnswer},
        Mischief{"few", "traces.csv has 8 rows for 11 samples", WitnessGap::kBadAnswer},
        Mischief{"nan", "traces.csv:6 gives 'nan' for motor.force", WitnessGap::kBadAnswer},
        Mischief{"inf", "traces.csv:6 gives 'inf' for motor.force", WitnessGap::kBadAnswer},
        Mischief{"late", "traces.csv:6 is at t = 0.0401 s where the sample is at 0.04 s",
                 WitnessGap::kBadAnswer},
        Mischief{"short", "traces.csv:6 has 3 cells for 4 columns", WitnessGap::kBadAnswer},
        Mischief{"untimed", "traces.csv has no column time_s", WitnessGap::kBadAnswer},
        Mischief{"unknown",
                 "a column 'motr.force', which is not a signal of the mechanism (did you "
                 "mean 'motor.force'?)",
                 WitnessGap::kBadAnswer},
        Mischief{"twice", "traces.csv has two columns 'motor.velocity'", WitnessGap::kBadAnswer},
        Mischief{"foot", "units is 'foot, pound'", WitnessGap::kBadAnswer},
        Mischief{"refuses", "not applicable: it has a loop", WitnessGap::kOutOfScope},
        Mischief{"schema", "schema is 'mbverify/witness/0'", WitnessGap::kBadAnswer},
        Mischief{"link", "left no traces.csv", WitnessGap::kNoAnswer},
        Mischief{"listed", "witness.json", WitnessGap::kBadAnswer},
        Mischief{"nameless", "names no program", WitnessGap::kBadAnswer},
        Mischief{"garbage", "witness.json: line 1, character 2: the file ends",
                 WitnessGap::kBadAnswer}),
    [](const testing::TestParamInfo<Mischief>& info) { return std::string(info.param.how); });

TEST(ForeignWitness, ThatCannotBeStartedIsACaveat) {
  const test::TestFolder folder("start");
  const std::string text = folder.Write("text", "no program");
  for (const std::string& program :
       {std::string("mbverify-no-such-program"), text, folder.PathOf("gone/x"), std::string("/")}) {
    const RunOutcome outcome = RunWith("{gone: {command: [\"" + program + "\"]}}");
    ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
    EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
    ExpectCaveat(outcome, "gone", WitnessGap::kNotStarted);
    EXPECT_NE(RecordOf(outcome, "gone")->summary.message.find("could not be started"),
              std::string::npos)
        << RecordOf(outcome, "gone")->summary.message;
  }
}

// It computes, and nothing that it gives is judged.
TEST(ForeignWitness, WithoutForcesIsACaveat) {
  const RunOutcome outcome = RunWith(Mock("moves"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
  ExpectCaveat(outcome, "mock", WitnessGap::kNoForces);
  EXPECT_EQ(RunWith(Mock("moves", ", required: true")).report->comparison.verdict,
            Verdict::kNotRun);
}

TEST(ForeignWitness, ThatAnswersIsNotACaveat) {
  const RunOutcome outcome = RunWith(Mock("answers", ", required: true"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
  EXPECT_TRUE(outcome.report->comparison.caveats.empty())
      << outcome.report->comparison.caveats.front().text;
}

// Two drives, the force of one.
TEST(ForeignWitness, WithTheForcesOfSomeDrivesIsACaveat) {
  const test::TestFolder folder("part");
  folder.Write("half.py",
               "import csv, json\n"
               "rows = list(csv.DictReader(open('motion.csv')))\n"
               "open('traces.csv', 'w').write('time_s,first.force\\n' + ''.join(\n"
               "    row['time_s'] + ',0\\n' for row in rows))\n"
               "json.dump({'schema': 'mbverify/witness/1', 'program': 'half', 'units': 'SI'},\n"
               "          open('witness.json', 'w'))\n");
  folder.Write("model.yaml",
               "name: two\ngravity: [0, 0, 0]\n"
               "bodies: {a: {mass: 1, inertia: [1, 1, 1]}, b: {mass: 1, inertia: [1, 1, 1]}}\n"
               "joints:\n"
               "  p: {kind: prismatic, parent: world, child: a, axis: [1, 0, 0]}\n"
               "  q: {kind: prismatic, parent: world, child: b, axis: [0, 1, 0]}\n"
               "drives: {first: {kind: joint, joint: p}, second: {kind: joint, joint: q}}\n");
  const RunOutcome outcome = RunTrusted(folder.Write(
      "case.yaml",
      "mechanism: model.yaml\nmotion: {duration_s: 0.5, sample_s: 0.01, commands: {first: {sine: "
      "{amplitude: 1, period_s: 0.7}}, second: {sine: {amplitude: 1, period_s: 0.9}}}}\n"
      "analytic: none\nsimulation: {mode: inverse}\nchecks: {reference_force_nrmse: off}\n"
      "witnesses: {half: {command: [python3, half.py]}}\n"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  bool found = false;
  for (const Caveat& caveat : outcome.report->comparison.caveats) {
    found = found || (caveat.kind == CaveatKind::kWitnessInPart &&
                      caveat.text == "half: it gives no force of second");
  }
  EXPECT_TRUE(found) << VerdictLine(ViewOf(*outcome.report), {});
}

// Who asks for a closed form that does not apply, or has equations that do not cover the model.
TEST(AnalyticWitness, ThatIsNotApplicableIsACaveatAndMayBeRequired) {
  const auto run = [](const std::string& scenario, const std::string& analytic) {
    RunOptions options;
    options.pictures = false;
    if (!analytic.empty()) options.scenario.set = {{"analytic", analytic}};
    return RunScenario(SourcePath("/scenarios/" + scenario + ".yaml"), options);
  };
  const RunOutcome other = run("spr_tripod/other_azimuth", "");
  ASSERT_TRUE(other.report) << other.diagnostics.Text();
  EXPECT_EQ(other.report->comparison.verdict, Verdict::kAgree);
  ExpectCaveat(other, "analytic", WitnessGap::kNotApplicable);
  EXPECT_EQ(run("spr_tripod/other_azimuth", "{required: true}").exit_code, 3);
  EXPECT_EQ(MissingIn(run("spr_tripod/other_azimuth", "none")), nullptr);
  // A four-bar has no closed form: not a caveat unless the scenario counts on one.
  const RunOutcome plain = run("four_bar/turn_inverse", "");
  ASSERT_TRUE(plain.report) << plain.diagnostics.Text();
  EXPECT_EQ(MissingIn(plain), nullptr);
  ExpectCaveat(run("four_bar/turn_inverse", "on"), "analytic", WitnessGap::kNotApplicable);
  ExpectCaveat(run("four_bar/turn_inverse", "{model: full}"), "analytic",
               WitnessGap::kNotApplicable);
  EXPECT_EQ(run("four_bar/turn_inverse", "{required: true}").report->comparison.verdict,
            Verdict::kNotRun);
  EXPECT_EQ(run("spr_tripod/default", "{required: true}").exit_code, 0);
}

// Nothing that opens doors.
TEST(ForeignWitness, GetsABareEnvironment) {
  const test::TestFolder folder("environment");
  const std::string reported = folder.PathOf("reported");
  setenv("SECRET_TOKEN", "1234", 1);
  setenv("LC_TIME", "C", 1);
  const RunOutcome outcome =
      RunWith(fmt::format("{{mock: {{command: [python3, {}, reports, {}, {}]}}}}",
                          SourcePath("/tests/verify/mock_witness.py"), kPlanar, reported));
  unsetenv("SECRET_TOKEN");
  unsetenv("LC_TIME");
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  // Where python3 is a script that starts another, that script adds names of its own.
  const std::string base = folder.PathOf("base");
  const std::string ask =
      "env -i PATH=\"$PATH\" python3 -c 'import os; print(*os.environ, sep=\"\\n\")' > " + base;
  ASSERT_EQ(std::system(ask.c_str()), 0);
  std::set<std::string> added;
  std::istringstream bare(ReadWholeFile(base).value_or(""));
  for (std::string name; std::getline(bare, name);) added.insert(name);
  std::istringstream names(ReadWholeFile(reported).value_or(""));
  bool path = false, time = false;
  for (std::string name; std::getline(names, name);) {
    path = path || name == "PATH";
    time = time || name == "LC_TIME";
    const bool known =
        name.starts_with("LC_") || added.contains(name) ||
        Contains({"PATH", "HOME", "USER", "LOGNAME", "LANG", "TZ", "TMPDIR", "MBV_MUJOCO_PACKAGE"},
                 name);
    EXPECT_TRUE(known) << name;
  }
  EXPECT_TRUE(path && time);
}

TEST(ForeignWitness, WithoutOthersVerifiesWhatItCan) {
  const RunOutcome outcome = RunWith(Mock("answers"), "off");
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree)
      << outcome.report->comparison.reason;
}

#ifdef MBV_SIMBODY
// `more`: further settings. A build with sanitizers cannot live within a limit of memory.
SetValue Simbody(const std::string& more = "") {
  return {"witnesses", fmt::format("{{simbody: {{{}memory_mb: {}, command: [{}]}}}}", more,
                                   test::kSanitized ? 1e9 : 4000, MBV_SIMBODY)};
}

// Another engine with its own mathematics, on trees and closures of every kind that it knows.
TEST(ForeignWitness, SimbodyAgrees) {
  for (const char* scenario :
       {"four_bar/turn_inverse", "slider_crank/press", "stewart/wave", "spr_tripod/default",
        "scara_robot/default", "cabin_robot/default"}) {
    RunOptions options;
    options.pictures = false;
    options.scenario.set = {Simbody()};
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
// perturbed truth is reported, and of three witnesses the odd one out is named.
TEST(ForeignWitness, SimbodyMovesFreely) {
  const auto run = [](const char* scenario, const std::string& density) {
    RunOptions options;
    options.out_dir.clear();
    options.pictures = options.page = false;
    options.scenario.set = {Simbody("limits: stepped, ")};
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

// What it does not know is not applicable, and the verdict is that of the others.
TEST(ForeignWitness, FrictionIsNotApplicableToSimbody) {
  RunOptions options;
  options.pictures = false;
  options.scenario.set = {Simbody()};
  const RunOutcome outcome =
      RunScenario(SourcePath("/scenarios/friction_five_bar/dwell_inverse.yaml"), options);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kAgree);
  EXPECT_EQ(RecordOf(outcome, "simbody")->summary.message, "not applicable: it has elements");
}
#endif

// The user's settings are those of the test.
class ProgramConsentTest : public testing::Test {
 protected:
  ProgramConsentTest() {
    setenv("XDG_CONFIG_HOME", config_.PathOf("").c_str(), 1);
    file_ = folder_.Write("mine/case.yaml", Text("[python3, there.py]"));
    folder_.Write("mine/there.py", "open('" + folder_.PathOf("ran") + "', 'w')\n");
  }
  ~ProgramConsentTest() override { unsetenv("XDG_CONFIG_HOME"); }

  static std::string Text(const std::string& command) {
    return fmt::format(
        "mechanism: {}\nmotion: {{duration_s: 0.02, sample_s: 0.01, commands: {{motor: home}}}}\n"
        "loads: {{push: {{on: rocker.end, force: [30, -5, 0], in: world}}}}\n"
        "simulation: {{mode: inverse}}\nwitnesses: {{there: {{command: {}}}}}\n",
        SourcePath("/models/four_bar/model.yaml"), command);
  }
  // Whether the program ran; the exit code says whether the scenario did.
  bool Runs(const std::string& file, const RunOptions& options = {}) {
    std::filesystem::remove(folder_.PathOf("ran"));
    const RunOutcome outcome = RunScenario(file, options);
    const bool ran = std::filesystem::exists(folder_.PathOf("ran"));
    EXPECT_EQ(outcome.exit_code, ran ? 0 : 2) << outcome.diagnostics.Text();
    text_ = outcome.diagnostics.Text();
    return ran;
  }

  const test::TestFolder config_{"consent_config"}, folder_{"consent"};
  std::string file_, text_;
};

TEST_F(ProgramConsentTest, NothingRunsUnasked) {
  EXPECT_FALSE(Runs(file_));
  for (const char* reported :
       {"case.yaml:5", "its programs may not run as you: there: ", "there.py",
        "no folder above it is trusted", "--trust", "mbverify trust "}) {
    EXPECT_NE(text_.find(reported), std::string::npos) << reported << "\nin\n" << text_;
  }
}

TEST_F(ProgramConsentTest, TheUserMayTrustARunAListOrAFolder) {
  RunOptions all;
  all.programs.all = true;
  EXPECT_TRUE(Runs(file_, all));
  RunOptions agreed;
  agreed.programs.agreed = {ProgramsOf(file_, {}).Fingerprint()};
  EXPECT_TRUE(Runs(file_, agreed));
  EXPECT_EQ(TrustFolder(folder_.PathOf("mine"), true), "");
  EXPECT_TRUE(Runs(file_));
  EXPECT_EQ(TrustFolder(folder_.PathOf("mine"), false), "");
  EXPECT_FALSE(Runs(file_));
  // A word that only begins like the folder is another folder.
  EXPECT_EQ(TrustFolder(folder_.PathOf("mine"), true), "");
  const std::string near = folder_.Write("mine2/case.yaml", Text("[python3, ../mine/there.py]"));
  EXPECT_FALSE(Runs(near));
}

// What was agreed to is one list of commands of one file.
TEST_F(ProgramConsentTest, AnAgreementEndsWhereTheListChanges) {
  RunOptions agreed;
  agreed.programs.agreed = {ProgramsOf(file_, {}).Fingerprint()};
  folder_.Write("mine/case.yaml", Text("[python3, there.py, -x]"));
  EXPECT_FALSE(Runs(file_, agreed));
  const std::string copy = folder_.Write("other/case.yaml", Text("[python3, ../mine/there.py]"));
  EXPECT_FALSE(Runs(copy, agreed));
}

TEST_F(ProgramConsentTest, ALinkIntoATrustedFolderIsWhereItPoints) {
  EXPECT_EQ(TrustFolder(folder_.PathOf("trusted"), true),
            folder_.PathOf("trusted") + " is not a folder");
  std::filesystem::create_directories(folder_.PathOf("trusted"));
  EXPECT_EQ(TrustFolder(folder_.PathOf("trusted"), true), "");
  std::filesystem::create_symlink(file_, folder_.PathOf("trusted/case.yaml"));
  EXPECT_FALSE(Runs(folder_.PathOf("trusted/case.yaml")));
  EXPECT_FALSE(Runs(folder_.PathOf("trusted/../mine/case.yaml")));
  // And the other way round: a trusted place by another name.
  std::filesystem::create_directory_symlink(folder_.PathOf("mine"), folder_.PathOf("alias"));
  EXPECT_EQ(TrustFolder(folder_.PathOf("mine"), true), "");
  EXPECT_TRUE(Runs(folder_.PathOf("alias/case.yaml")));
}

// Trust is in the user's own files.
TEST_F(ProgramConsentTest, WhatEverybodyMayWriteIsNotTrusted) {
  using std::filesystem::perms;
  EXPECT_EQ(TrustFolder(folder_.PathOf("mine"), true), "");
  for (const char* name : {"mine/case.yaml", "mine/there.py", "mine"}) {
    const std::string path = folder_.PathOf(name);
    const perms before = std::filesystem::status(path).permissions();
    std::filesystem::permissions(path, before | perms::others_write);
    EXPECT_FALSE(Runs(file_)) << name;
    EXPECT_NE(text_.find("everybody may write to "), std::string::npos) << text_;
    std::filesystem::permissions(path, before);
    EXPECT_TRUE(Runs(file_)) << name;
  }
  const std::filesystem::path list = *TrustFile();
  std::filesystem::permissions(list, perms::others_write, std::filesystem::perm_options::add);
  EXPECT_FALSE(Runs(file_));
  if (geteuid() != 0) return;
  std::filesystem::permissions(list, perms::others_write, std::filesystem::perm_options::remove);
  for (const char* name : {"mine/case.yaml", "mine/there.py", "mine"}) {
    ASSERT_EQ(chown(folder_.PathOf(name).c_str(), 12345, 12345), 0);
    EXPECT_FALSE(Runs(file_)) << name;
    EXPECT_NE(text_.find("belongs to another user"), std::string::npos) << text_;
    ASSERT_EQ(chown(folder_.PathOf(name).c_str(), 0, 0), 0);
  }
}

TEST_F(ProgramConsentTest, OptionsInstalledProgramsAndShippedScenariosAreTrusted) {
  RunOptions typed;
  typed.scenario.set = {{"witnesses", "{there: {command: [python3, there.py]}}"}};
  EXPECT_TRUE(Runs(file_, typed));
  // Another value of a witness does not make its command the user's.
  typed.scenario.set = {{"witnesses.there.timeout_s", "5"}};
  EXPECT_FALSE(Runs(file_, typed));
  const std::string shipped = SourcePath("/scenarios/four_bar/foreign.yaml");
  ASSERT_EQ(ProgramsOf(shipped, {}).programs.size(), 1U);
  EXPECT_EQ(ProgramsOf(shipped, {}).programs[0].trust, ProgramTrust::kShippedScenario);
  // Programs beside mbverify are not all its own.
  EXPECT_FALSE(IsInstalledProgram("mbverify"));
  EXPECT_FALSE(IsInstalledProgram("test_pipeline"));
}

TEST_F(ProgramConsentTest, OfAnArchivePlaceAndOwnerSayNothing) {
  EXPECT_EQ(TrustFolder(folder_.PathOf(""), true), "");
  EXPECT_TRUE(Runs(file_));
  RunOptions archived;
  archived.programs.archived = true;
  EXPECT_FALSE(Runs(file_, archived));
  EXPECT_NE(text_.find("it comes from an archive"), std::string::npos) << text_;
}

// Nothing that hides a part of a command. (Control characters are refused before.)
TEST_F(ProgramConsentTest, CommandsAreShownWhole) {
  const std::string file = folder_.Write(
      "mine/loud.yaml",
      Text(R"(["python3", "-c", "import os", "\u202etxt", ")" + std::string(3000, 'a') + "\"]"));
  const std::vector<std::string> lines = ProgramsOf(file, {}).Lines();
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_NE(lines[0].find(R"('import os' \u202etxt )"), std::string::npos) << lines[0];
  EXPECT_NE(lines[0].find(std::string(3000, 'a')), std::string::npos);
}

TEST(ForeignWitness, BadSectionsAreRefused) {
  const RunOutcome outcome = RunWith(
      "{simulated: {command: [x]}, a b: {command: [x]}, c: {command: []}, d: {comand: [x]}, e: "
      "{command: [x], limits: loose, timeout_s: -1}}");
  EXPECT_EQ(outcome.exit_code, 2);
  const std::string text = outcome.diagnostics.Text();
  for (const char* reported :
       {"witnesses.simulated: this is the name of one of our own witnesses",
        "witnesses.a b: letters, digits and _ make a witness' name", "witnesses.c.command is empty",
        "unknown key 'comand'", "witnesses.e.limits", "witnesses.e.timeout_s = -1"}) {
    EXPECT_NE(text.find(reported), std::string::npos) << reported << "\nin\n" << text;
  }
}

}  // namespace
}  // namespace mbv
