// What is said of an archive's repetition, and how summaries are held against each other.
#include <gtest/gtest.h>

#include "features/paper/package_manifest.h"
#include "features/paper/rerun_report.h"

namespace mbv {
namespace {

bool Says(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

constexpr const char* kSummaryText =
    R"({"verdict": "agree", "exit_code": 0, "checks": [{"name": "a.force_nrmse",
        "value": 1e-8, "limit": 1e-6, "pass": true}]})";

std::string Perturbed(const std::string& what, const std::string& by) {
  std::string text = kSummaryText;
  text.replace(text.find(what), what.size(), by);
  return text;
}

RerunOutcome Outcome(const std::string& now, bool exact = false) {
  return CompareSummaries("results/summary.json", kSummaryText, now, exact).outcome;
}

TEST(RerunSummary, ChecksMayMoveByAHundredthOfTheirLimit) {
  EXPECT_EQ(Outcome(Perturbed("1e-8", "1.9e-8")), RerunOutcome::kWithin);
  EXPECT_EQ(Outcome(Perturbed("1e-8", "2.1e-8")), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome(Perturbed("1e-8", "1.9e-8"), true), RerunOutcome::kDiffers);
}

TEST(RerunSummary, VerdictsAndChecksMustBeTheSame) {
  EXPECT_EQ(Outcome(Perturbed("agree", "disagree")), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome(Perturbed("\"exit_code\": 0", "\"exit_code\": 1")), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome(Perturbed("true", "false")), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome(Perturbed("a.force_nrmse", "b.force_nrmse")), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome("{}"), RerunOutcome::kDiffers);
  EXPECT_EQ(Outcome("no json"), RerunOutcome::kDiffers);
}

TEST(RerunSummary, NamesTheFirstValueThatDiffers) {
  const RerunFile file = CompareSummaries("s", kSummaryText, Perturbed("1e-8", "1.5e-8"), true);
  EXPECT_EQ(file.why, "checks/0/value: 1e-08 in the archive, 1.5e-08 now");
}

// Of several values that differ, the one that decides is named: not the first in the file.
TEST(RerunSummary, NamesWhatDecides) {
  const std::string packed = R"({"description": "a", "verdict": "agree", "exit_code": 0, "checks": [
      {"name": "a.force_nrmse", "value": 1e-8, "limit": 1e-6, "pass": true},
      {"name": "b.force_nrmse", "value": 0.0, "limit": 1e-6, "pass": true}]})";
  const auto why = [&](const std::vector<std::pair<std::string, std::string>>& changes) {
    std::string now = packed;
    for (const auto& [what, by] : changes) now.replace(now.find(what), what.size(), by);
    const RerunFile file = CompareSummaries("s", packed, now, false);
    EXPECT_EQ(file.outcome, RerunOutcome::kDiffers) << now;
    return file.why;
  };
  EXPECT_EQ(why({{"\"a\"", "\"b\""}, {"agree", "disagree"}}),
            "verdict: \"agree\" in the archive, \"disagree\" now");
  EXPECT_EQ(why({{"1e-8", "1.1e-8"}, {"0.0", "5e-7"}}),
            "b.force_nrmse: 0 in the archive, 5e-07 now");
  EXPECT_EQ(why({{"1e-8", "1.1e-8"}, {"b.force", "c.force"}}),
            "the check b.force_nrmse is not made any more");
  EXPECT_EQ(why({{"{\"name\": \"a.force", "{\"name\": \"d.force"}, {"1e-8", "1.1e-8"}}),
            "the check a.force_nrmse is not made any more");
  std::string failing = "\"pass\": true}]";
  EXPECT_EQ(why({{"\"a\"", "\"b\""}, {failing, "\"pass\": false}]"}}),
            "b.force_nrmse passes in the archive, fails now");
}

TEST(RerunReport, SaysInWordsWhatHasNoRatio) {
  RerunReport report;
  report.scenarios.push_back(
      {.file = "inputs/a.yaml",
       .kind = "motion",
       .verdict = "agree",
       .packed_verdict = "agree",
       .failure = "",
       .files = {{"results/a/traces.csv",
                  RerunOutcome::kDiffers,
                  "",
                  {{"m.force", HUGE_VAL, HUGE_VAL, 0.25}, {"m.position", kNan, kNan, kNan}}}}});
  const std::string text = ToText(report, false);
  EXPECT_TRUE(Says(text,
                   "m.force differs where the archive has zero at t = 0.25 s, outside its "
                   "limit"))
      << text;
  EXPECT_TRUE(Says(text, "m.position is not a number in both, outside its limit")) << text;
  EXPECT_FALSE(Says(text, "inf")) << text;
}

RerunReport AReport() {
  RerunReport report;
  report.archive = "paper.zip";
  RerunScenario scenario{.file = "inputs/a.yaml",
                         .kind = "motion",
                         .exit_code = 0,
                         .packed_exit_code = 0,
                         .verdict = "agree",
                         .packed_verdict = "agree",
                         .failure = "",
                         .files = {}};
  scenario.files.push_back({"results/a/traces.csv",
                            RerunOutcome::kWithin,
                            "",
                            {{"m.force.simulated", 2e-12, 0.5, 0.25}, {"m.position", 0, 0, kNan}}});
  report.scenarios.push_back(scenario);
  return report;
}

TEST(RerunReport, ReportsTheWorstSignalOfEachFile) {
  const std::string text = ToText(AReport(), false);
  EXPECT_TRUE(Says(text, "within its limits results/a/traces.csv")) << text;
  EXPECT_TRUE(Says(text,
                   "m.force.simulated by 2e-12 of its largest value at t = 0.25 s, 0.5 of "
                   "its limit"))
      << text;
  EXPECT_FALSE(Says(text, "m.position")) << text;
  EXPECT_TRUE(Says(ToText(AReport(), true), "m.position"));
  EXPECT_TRUE(Says(text, "1 within their limits, 0 not judged, 0 differ: repeated")) << text;
}

TEST(RerunReport, WhateverDiffersIsNotRepeated) {
  EXPECT_EQ(AReport().exit_code(), 0);
  RerunReport differs = AReport();
  differs.scenarios[0].files[0].outcome = RerunOutcome::kDiffers;
  EXPECT_EQ(differs.exit_code(), 1);
  EXPECT_TRUE(Says(ToText(differs, false), "NOT REPEATED"));
  RerunReport verdict = AReport();
  verdict.scenarios[0].verdict = "disagree";
  EXPECT_EQ(verdict.exit_code(), 1);
  EXPECT_TRUE(Says(ToText(verdict, false), "disagree (exit code 0); the archive says agree"));
  RerunReport code = AReport();
  code.scenarios[0].exit_code = 3;
  EXPECT_EQ(code.exit_code(), 1);
  RerunReport failed = AReport();
  failed.scenarios[0].failure = "died";
  EXPECT_EQ(failed.exit_code(), 1);
  RerunReport version = AReport();
  version.other_versions = {{"mbverify", "0.1.0", "0.2.0"}};
  EXPECT_EQ(version.exit_code(), 0);
  EXPECT_TRUE(Says(ToText(version, false), "written with mbverify 0.1.0, this is 0.2.0"));
}

PackageDescription APackage() {
  PackageDescription package;
  package.date = "2026-11-23";
  package.license = "CC-BY-4.0";
  package.versions = {{"mbverify", "0.1.0"}, {"mujoco", "2.2.2"}};
  package.scenarios = {{.file = "inputs/a b.yaml",
                        .kind = "motion",
                        .results = "results/m/a",
                        .figures = "figures/m/a",
                        .exit_code = 0,
                        .verdict = "agree",
                        .description = "A turn",
                        .reason = "all checks"}};
  package.meshes = {{"arm", "inputs/packages/arm"}};
  package.files = {{"README.md", "description", 3, "00"},
                   {"figures/m/a/f.pdf", "figure", 4, "11"},
                   {"inputs/a b.yaml", "scenario", 5, "22"},
                   {"results/m/a/traces.csv", "result", 6, "33"}};
  return package;
}

TEST(Manifest, IsReadAsItIsWritten) {
  Diagnostics diagnostics;
  const std::string text = ManifestJson(APackage());
  const auto read = ReadManifest(text, "a.zip", &diagnostics);
  ASSERT_TRUE(read) << diagnostics.Text();
  EXPECT_EQ(ManifestJson(*read), text);
}

TEST(Manifest, WhatIsMissingOrLeadsOutsideIsFound) {
  const std::string good = ManifestJson(APackage());
  const auto found = [&](const std::string& what, const std::string& by) {
    std::string text = good;
    EXPECT_NE(text.find(what), std::string::npos) << what;
    text.replace(text.find(what), what.size(), by);
    Diagnostics diagnostics;
    EXPECT_FALSE(ReadManifest(text, "a.zip", &diagnostics)) << by;
    return diagnostics.Text();
  };
  EXPECT_TRUE(
      Says(found("mbverify.package/1", "mbverify.package/2"), "schema is 'mbverify.package/2'"));
  EXPECT_TRUE(Says(found("results/m/a/traces", "../m/a/traces"), "not a path in an archive"));
  EXPECT_TRUE(Says(found("\"inputs/packages", "\"/packages"), "not a path in an archive"));
  EXPECT_TRUE(Says(found("\"exit_code\": 0", "\"exit_code\": \"0\""), "without exit_code"));
  EXPECT_TRUE(Says(found("\"motion\"", "\"emotion\""), "of the kind 'emotion'"));
  EXPECT_TRUE(Says(found("\"files\"", "\"fils\""), "has no list 'files'"));
  EXPECT_TRUE(Says(found("\"bytes\": 5", "\"bytes\": -5"), "no size of inputs/a b.yaml"));
  EXPECT_TRUE(Says(found("{", "["), "this is not JSON"));
}

TEST(Crate, NamesEveryFileTheProgramAndTheCommand) {
  const std::string text = CrateJson(APackage());
  for (const char* words :
       {"\"conformsTo\": {\n        \"@id\": \"https://w3id.org/ro/crate/1.1\"",
        "\"datePublished\": \"2026-11-23\"", "\"license\": \"CC-BY-4.0\"", "inputs/a%20b.yaml",
        "\"version\": \"0.1.0\"", "\"@id\": \"manifest.json\"", "\"sha256\": \"33\"",
        "mbverify run --package arm=inputs/packages/arm 'inputs/a b.yaml'"}) {
    EXPECT_TRUE(Says(text, words)) << words << "\n" << text;
  }
}

TEST(PackageReadme, SaysWhatWasRunAndHowItIsRepeated) {
  const std::string text = PackageReadme(APackage());
  for (const char* words : {"# Inputs and results of mbverify for m/a", "| agree (exit code 0) |",
                            "Licence of the models: CC-BY-4.0.", "`figures/`",
                            "Versions: mbverify 0.1.0, mujoco 2.2.2."}) {
    EXPECT_TRUE(Says(text, words)) << words << "\n" << text;
  }
}

}  // namespace
}  // namespace mbv
