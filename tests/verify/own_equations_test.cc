// Scenarios whose analytic witness is a user's file: the whole way, and consent.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "base/files.h"
#include "base/worker_pool.h"
#include "features/run/run_scenario.h"
#include "tests/support/crank_equations.h"
#include "tests/support/run_program.h"
#include "tests/support/source_dir.h"
#include "tests/support/test_folder.h"
#include "verify/check_file.h"
#include "verify/prepare.h"
#include "verify/program_consent.h"

namespace mbv {
namespace {

namespace fs = std::filesystem;

std::string Replaced(std::string text, const std::string& what, const std::string& with) {
  const size_t at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), with);
}

// A four-bar whose crank is commanded; `forces` is the body of the file's function.
class OwnEquations : public testing::Test {
 protected:
  OwnEquations() {
    // This folder is not trusted.
    setenv("XDG_CONFIG_HOME", folder_.PathOf("config").c_str(), 1);
  }
  ~OwnEquations() override { unsetenv("XDG_CONFIG_HOME"); }

  std::string Write(const std::string& forces, const std::string& name = "crank.py") const {
    folder_.Write(name, fmt::format("open(\"{}\", \"w\").write(\"ran\")\n", Marker()) +
                            test::kCrankEquations + "    " + forces + "\n");
    return folder_.Write(
        "turn.yaml",
        fmt::format(R"(
mechanism: {}
analytic: {{equations: {}}}
motion: {{duration_s: 0.5, sample_s: 0.01, commands: {{motor: [home, {{ramp: {{rate: 3}}}}]}}}}
simulation: {{mode: inverse}}
)",
                    SourcePath("/examples/closed_form/models/planar_slider_crank/model.yaml"),
                    name));
  }
  [[nodiscard]] std::string Marker() const { return folder_.PathOf("marker"); }
  [[nodiscard]] bool ran() const { return fs::exists(Marker()); }

  static RunOutcome Run(const std::string& file, bool trusted = true) {
    RunOptions options;
    options.programs.all = trusted;
    return RunScenario(file, options);
  }

  test::TestFolder folder_{"own_equations"};
};

TEST_F(OwnEquations, DriveTheSimulationAndEnterTheVerdict) {
  const RunOutcome outcome = Run(Write("return [torque]"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Comparison& comparison = outcome.report->comparison;
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  EXPECT_EQ(outcome.report->driven_by, "analytic");
  EXPECT_NE(outcome.report->simulation.find("the equations of crank.py"), std::string::npos);
  const PairComparison* pair = comparison.FindPair("reference_vs_analytic");
  ASSERT_NE(pair, nullptr);
  EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-12);
  ASSERT_EQ(comparison.caveats.size(), 1u);
  EXPECT_EQ(comparison.caveats[0].kind, CaveatKind::kCoverage);
}

TEST_F(OwnEquations, AreNamedWhereTheyAreWrong) {
  const RunOutcome outcome = Run(Write("return [1.00001 * torque]"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kDisagree);
  EXPECT_EQ(outcome.report->comparison.attribution.odd_one_out, "analytic")
      << outcome.report->comparison.attribution.text;
}

TEST_F(OwnEquations, EndTheRunWhereTheyEnd) {
  const RunOutcome outcome =
      Run(Write("return [torque] if q.theta < 1.5 else [torque / (q.theta - q.theta)]"));
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kNotRun);
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.report->comparison.reason.find("crank.py:"), std::string::npos)
      << outcome.report->comparison.reason;
}

TEST_F(OwnEquations, RunAfterConsentOnly) {
  const std::string file = Write("return [torque]");
  const RunOutcome refused = Run(file, false);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_FALSE(refused.report);
  EXPECT_NE(refused.diagnostics.Text().find("its programs may not run as you: analytic:"),
            std::string::npos)
      << refused.diagnostics.Text();
  EXPECT_FALSE(ran());
  // Without consent a run goes on without them.
  Diagnostics diagnostics;
  const auto prepared = Prepare(file, {}, &diagnostics);
  ASSERT_TRUE(prepared) << diagnostics.Text();
  EXPECT_FALSE(prepared->has_closed_form());
  EXPECT_EQ(prepared->closed_form.gap, WitnessGap::kNotApplicable);
  EXPECT_NE(diagnostics.Text().find("may not run as you"), std::string::npos);
  EXPECT_FALSE(ran());
  // Checking runs nothing, even what is trusted.
  ASSERT_EQ(TrustFolder(folder_.PathOf(""), true), "");
  EXPECT_FALSE(CheckScenario(file).has_errors()) << CheckScenario(file).Text();
  EXPECT_FALSE(ran());
  EXPECT_EQ(ProgramsOf(file, {}).Lines().size(), 1u);
  EXPECT_EQ(Run(file, false).exit_code, 0);
  EXPECT_TRUE(ran());
}

// Equations of motion alone: they drive the simulation and are judged by it, forces are compared
// among the others.
TEST_F(OwnEquations, MayGiveNoForces) {
  const std::string file = Write("return [torque]");
  const std::string code = folder_.PathOf("crank.py");
  const std::string text = ReadWholeFile(code).value();
  std::ofstream(code) << text.substr(0, text.find("@closed_form.forces"));
  const RunOutcome outcome = Run(file);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  const Comparison& comparison = outcome.report->comparison;
  EXPECT_EQ(comparison.verdict, Verdict::kAgree) << comparison.reason;
  EXPECT_EQ(outcome.report->driven_by, "analytic");
  bool said = false;
  for (const Caveat& caveat : comparison.caveats) {
    said = said || caveat.text.find("give no forces") != std::string::npos;
  }
  EXPECT_TRUE(said);
  const PairComparison* pair = comparison.FindPair("simulated_vs_reference");
  ASSERT_NE(pair, nullptr);
  EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-10);
  // Where forces move the simulation, they are the reference's.
  RunOptions options;
  options.programs.all = true;
  options.scenario.set = {{"simulation", "{mode: force_driven, step_s: 0.001}"}};
  const RunOutcome driven = RunScenario(file, options);
  ASSERT_TRUE(driven.report) << driven.diagnostics.Text();
  EXPECT_EQ(driven.report->driven_by, "reference");
  // A wrong position is seen all the same.
  std::ofstream(code) << Replaced(text.substr(0, text.find("@closed_form.forces")),
                                  "return [theta]", "return [theta + 1e-6 * sin(theta)]");
  const RunOutcome wrong = Run(file);
  ASSERT_TRUE(wrong.report) << wrong.diagnostics.Text();
  EXPECT_EQ(wrong.report->comparison.verdict, Verdict::kDisagree);
}

// Whoever agrees to all programs of a scenario agrees to its equations.
TEST_F(OwnEquations, BelongToWhatWasAgreedTo) {
  const std::string file = Write("return [torque]");
  std::ofstream(file, std::ios::app) << "witnesses: {idle: {command: [/bin/true]}}\n";
  RunOptions options;
  options.programs.agreed = {ProgramsOf(file, {}).Fingerprint()};
  const RunOutcome outcome = RunScenario(file, options);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->driven_by, "analytic");
  options.programs.agreed = {"another"};
  EXPECT_EQ(RunScenario(file, options).exit_code, 2);
}

// What examples/equations/ shows: four mechanisms, in Python and partly in Octave.
TEST(OwnEquationsExamples, AgreeInFortyLines) {
  size_t ran = 0;
  for (const auto& entry : fs::directory_iterator(SourcePath("/examples/equations"))) {
    const std::string file = entry.path().string();
    const bool octave = file.ends_with(".m");
    const bool formulas = file.ends_with(".formulas.yaml");
    if (!octave && !formulas && !file.ends_with(".py")) continue;
    if (octave && !FindProgram("octave-cli")) continue;
    size_t lines = 0;
    std::istringstream text(ReadWholeFile(file).value());
    bool quoted = false;
    for (std::string line; std::getline(text, line);) {
      const size_t first = line.find_first_not_of(' ');
      const bool quotes = line.find("\"\"\"") != std::string::npos;
      const bool one_line = quotes && line.find("\"\"\"") != line.rfind("\"\"\"");
      const bool comment = first == std::string::npos || line[first] == '#' || line[first] == '%';
      if (!comment && !quoted && !quotes) ++lines;
      if (quotes && !one_line) quoted = !quoted;
    }
    EXPECT_LE(lines, 40u) << file;
    RunOptions options;
    options.programs.all = true;
    options.scenario.set = {{"analytic.equations", fs::path(file).filename().string()}};
    fs::path scenario = entry.path();
    if (formulas) scenario.replace_extension();  // planar_slider_crank.formulas
    const RunOutcome outcome = RunScenario(scenario.replace_extension(".yaml").string(), options);
    ASSERT_TRUE(outcome.report) << file << outcome.diagnostics.Text();
    const Comparison& comparison = outcome.report->comparison;
    EXPECT_EQ(comparison.verdict, Verdict::kAgree) << file << comparison.reason;
    const PairComparison* pair = comparison.FindPair("reference_vs_analytic");
    ASSERT_NE(pair, nullptr) << file;
    EXPECT_LT(pair->metrics.at(Metric::kForceNrmse).value, 1e-10) << file;
    ++ran;
  }
  EXPECT_GE(ran, 5u);
}

// The file goes into an archive, and runs from it after consent.
TEST(OwnEquationsExamples, ArePackedAndRepeated) {
  const Program mbverify("own_equations");
  const std::string zip = (mbverify.folder() / "delta.zip").string();
  const ProgramResult packed = mbverify("package examples/equations/delta.yaml --trust -o " + zip);
  ASSERT_EQ(packed.exit_code, 0) << packed.err;
  EXPECT_EQ(mbverify("package --check " + zip).exit_code, 2);
  const ProgramResult repeated = mbverify("package --check " + zip + " --trust");
  EXPECT_EQ(repeated.exit_code, 0) << repeated.out << repeated.err;
}

// A study asks its processes for them, each its own; where they may not run, it says so.
TEST(OwnEquationsExamples, EnterStudies) {
  const Program mbverify("own_study");
  const std::string folder = mbverify.folder().string();
  fs::copy(SourcePath("/examples/equations"), folder + "/equations", fs::copy_options::recursive);
  std::ofstream(folder + "/study.yaml")
      << "study: rods\nscenario: equations/delta.yaml\n"
         "vary: {m_rod: {uniform: {plus_minus_percent: 5}}}\ndesign: {sobol: 4}\n"
         "witnesses: [analytic, reference]\nquantities: [limb1.motor.force.rms]\n";
  const std::string run = "XDG_CONFIG_HOME=" + folder + "/config $mbverify study " + folder +
                          "/study.yaml --out " + folder + "/out";
  const ProgramResult refused = mbverify.Script(run);
  EXPECT_NE(refused.exit_code, 0);
  EXPECT_NE(refused.err.find("may not run"), std::string::npos) << refused.err;
  const ProgramResult trusted = mbverify.Script("XDG_CONFIG_HOME=" + folder +
                                                "/config $mbverify trust " + folder + " && " + run);
  EXPECT_EQ(trusted.exit_code, 0) << trusted.err;
  EXPECT_NE(trusted.out.find("disagree at 0 of 4 points"), std::string::npos) << trusted.out;
}

// Formulas are no program.
TEST_F(OwnEquations, NeedNoConsentAsFormulas) {
  folder_.Write("crank.yaml",
                "equations_of: planar_slider_crank\ncommands: [motor]\ndrives: {motor: motor}\n"
                "forces: {motor: 0}\ncovers: unchecked\n");
  const std::string file = Write("", "crank.py");
  const std::string text = ReadWholeFile(file).value();
  std::string other = text;
  other.replace(other.find("crank.py"), 8, "crank.yaml");
  folder_.Write("turn.yaml", other);
  EXPECT_TRUE(ProgramsOf(file, {}).programs.empty());
  const RunOutcome outcome = Run(file, false);
  ASSERT_TRUE(outcome.report) << outcome.diagnostics.Text();
  EXPECT_EQ(outcome.report->comparison.verdict, Verdict::kDisagree);
}

TEST_F(OwnEquations, AreLookedForBesideScenarioAndModel) {
  const std::string file = Write("return [torque]");
  fs::remove(folder_.PathOf("crank.py"));
  const RunOutcome outcome = Run(file);
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.diagnostics.Text().find("analytic.equations = 'crank.py': there is no such"),
            std::string::npos)
      << outcome.diagnostics.Text();
}

}  // namespace
}  // namespace mbv
