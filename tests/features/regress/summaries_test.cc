// JUnit, Markdown, index.html and regress.json of a made-up run.
#include "features/regress/summaries.h"

#include <fmt/format.h>
#include <tinyxml2.h>
#include <zlib.h>

#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/markup.h"
#include "base/png.h"
#include "base/sha256.h"
#include "features/regress/trouble_text.h"
#include "tests/features/regress/regress_fixture.h"
#include "tests/support/source_dir.h"

namespace mbv {
namespace {

// The first page.
std::string ToIndexHtml(const RegressReport& report,
                        const std::map<std::string, std::string>& pictures) {
  return ToIndexPages(report, pictures).front();
}

const std::string kGoldenFolder = SourcePath("/tests/golden/regress/");

// One of each kind.
RegressReport Mixed() {
  CaseResult good = AgreeingCase("model/good", 2e-9);
  CaseResult drifted = AgreeingCase("model/drifted", 5e-8);
  drifted.drifts.push_back({"simulated_vs_analytic.force_nrmse", "25 times the median", 5e-8, 2e-9,
                            7, "run 7 of 2026-01-30T02:00:00Z"});
  drifted.course = {2e-9, 2e-9, 5e-8};
  CaseResult must_fail = AgreeingCase("model/must_fail/mass", 1e-3);
  must_fail.expected = {"disagree", 1, "simulation and reference agree"};
  must_fail.verdict = "disagree";
  must_fail.exit_code = 1;
  must_fail.verified = false;
  must_fail.reason = "1 of 38 checks is not within its limit";
  CaseResult wrong = AgreeingCase("other/wrong", 1e-3);
  wrong.status = CaseStatus::kUnexpected;
  wrong.verdict = "disagree";
  wrong.exit_code = 1;
  wrong.verified = false;
  wrong.reason = "exit code 1, expected 0: <forces> & \"moments\" ]]> | differ\x01";
  wrong.metrics["simulated_vs_analytic.force_nrmse"] = {1e-3, 1e-6, false, "limb2.drive.force",
                                                        7.16};
  wrong.past = {7, 6, "run 6 of 2026-01-29T02:00:00Z, abc122", {}};
  wrong.past.values["simulated_vs_analytic.force_nrmse"] = 1.7e-13;
  wrong.log_tail = "line 1\nline 2 \xff <b>";
  CaseResult hung = AgreeingCase("other/hung", kNan);
  hung.metrics.clear();
  hung.status = CaseStatus::kTimedOut;
  hung.verdict = "not_run";
  hung.exit_code = -1;
  hung.signal = 9;
  hung.ran = hung.compared = hung.verified = false;
  hung.reason = "no end after 300 s: killed";
  hung.not_compared.push_back({"everything", hung.reason});
  RegressReport report = OneRun({good, drifted, must_fail, hung, wrong}, "abc123");
  report.run.id = 8;
  return report;
}

// Differences to a golden file; MBV_UPDATE_GOLDEN=1 writes it.
void ExpectGolden(const std::string& name, const std::string& text) {
  const std::string path = kGoldenFolder + name;
  if (std::getenv("MBV_UPDATE_GOLDEN") != nullptr) {
    ASSERT_EQ(WriteFile(path, text), "");
  }
  EXPECT_EQ(ReadWholeFile(path).value_or("(missing)"), text);
}

std::map<std::string, std::string> AllSummaries(const RegressReport& report) {
  return {{"JUnit", ToJUnit(report)},
          {"Markdown", ToMarkdown(report)},
          {"terminal", ToSummaryText(report)},
          {"page", ToIndexHtml(report, {})}};
}

std::string WithoutBackslashes(std::string text) {
  std::erase(text, '\\');
  return text;
}

TEST(Summaries, WhatWasNotJudgedNeitherAgreesNorFails) {
  CaseResult result = AgreeingCase("m/study", 1e-9);
  EXPECT_EQ(WordOf(result), "agree");
  result.verified = false;
  EXPECT_EQ(WordOf(result), "computed");
  result.expected.verdict = "disagree";
  EXPECT_EQ(WordOf(result), "fails as it must");
}

TEST(Summaries, AFailureNamesCheckValueLimitPlaceAndTheLastGoodRun) {
  for (const auto& [where, text] : AllSummaries(Mixed())) {
    for (const char* part :
         {"drive force, RMS (simulated vs analytic) is 1.00e-03, limit 1.0e-06, at "
          "limb2.drive.force, 7.16 s; was 1.70e-13 in run 6",
          "was ok in run 6 of 2026-01-29T02:00:00Z, abc122"}) {
      EXPECT_NE(WithoutBackslashes(text).find(part), std::string::npos) << where << "\n" << text;
    }
  }
}

TEST(Summaries, FailedChecksComeWorstFirst) {
  CaseResult result = AgreeingCase("m/x", 1e-9);
  result.status = CaseStatus::kUnexpected;
  result.metrics["a"] = {2e-6, 1e-6, false};
  result.metrics["b"] = {5e-3, 1e-3, false};
  result.metrics["c"] = {kNan, 1.0, false};
  result.metrics["fine"] = {1e-9, 1e-6, true};
  result.metrics["off"] = {1.0, {}, false};
  ASSERT_EQ(FailedChecks(result).size(), 3U);
  EXPECT_EQ(FailedChecks(result)[0]->first, "c");
  EXPECT_EQ(FailedChecks(result)[1]->first, "b");
  EXPECT_EQ(FailedChecks(result)[2]->first, "a");
  EXPECT_EQ(FailureTexts(result, 2).size(), 3U);
  EXPECT_EQ(FailureTexts(result, 2).back(), "and 1 more failed checks");
  result.past.runs = 3;
  EXPECT_EQ(FailureTexts(result, 3).back(), "was never ok in 3 earlier runs");
  result.status = CaseStatus::kAsExpected;
  EXPECT_TRUE(FailureTexts(result, 3).empty()) << "a case that must fail";
}

TEST(Summaries, AllDriftsOfAScenarioAreOneLineWithTheWorstFirst) {
  CaseResult result = AgreeingCase("m/x", 1e-9);
  result.drifts.push_back({"a", "a is 12 times its median", 12e-9, 1e-9, 0, ""});
  result.drifts.push_back({"b", "b is 400 times its median", 400e-9, 1e-9, 7, "run 7"});
  result.drifts.push_back({"c", "c is 30 times its median", 30e-9, 1e-9, 0, ""});
  result.drifts.push_back({"traces", "drive forces: simulation moved", kNan, kNan, 0, ""});
  EXPECT_EQ(DriftLine(result),
            "b is 400 times its median; also c 30 times, a 12 times; drive forces: simulation "
            "moved; since run 7");
  for (const auto& [where, text] : AllSummaries(OneRun({result}))) {
    const size_t at = text.find("400 times");
    ASSERT_NE(at, std::string::npos) << where;
    const size_t line_end = text.find('\n', at);
    EXPECT_LT(text.find("a 12 times"), line_end) << where;
    EXPECT_EQ(text.find("12 times its median"), std::string::npos) << where;
  }
}

TEST(Summaries, WhatIsMissingIsReportedEverywhere) {
  RegressReport report = OneRun({AgreeingCase("model/good", 2e-9)});
  for (const auto& [where, text] : AllSummaries(report)) {
    EXPECT_EQ(text.find("gone"), std::string::npos) << where;
  }
  report.missing.push_back({"model/gone", 6, "run 6 of 2026-01-29T02:00:00Z"});
  EXPECT_EQ(ExitCodeOf(report), 0);
  for (const bool fails : {false, true}) {
    report.fail_on_missing = fails;
    for (const auto& [where, text] : AllSummaries(report)) {
      for (const char* part : {"gone", "was in run 6 of 2026-01-29T02:00:00Z"}) {
        EXPECT_NE(text.find(part), std::string::npos) << where << part;
      }
    }
    EXPECT_NE(CountsText(CountCases(report)).find("1 missing"), std::string::npos);
  }
  EXPECT_EQ(ExitCodeOf(report), 1);
  EXPECT_NE(ToMarkdown(report).find("not as expected"), std::string::npos);
  EXPECT_NE(ToJUnit(report).find("tests=\"2\" failures=\"1\""), std::string::npos);
  report.fail_on_missing = false;
  EXPECT_NE(ToJUnit(report).find("tests=\"2\" failures=\"0\""), std::string::npos);
  EXPECT_NE(ToJUnit(report).find("<skipped message="), std::string::npos);
}

TEST(Summaries, SeverityOrdersTheWorstFirst) {
  std::vector<std::string> keys;
  const RegressReport report = Mixed();
  for (const CaseResult* result : BySeverity(report)) keys.push_back(result->key);
  EXPECT_EQ(keys, (std::vector<std::string>{"other/hung", "other/wrong", "model/drifted",
                                            "model/good", "model/must_fail/mass"}));
}

TEST(JUnit, IsTheGoldenFile) { ExpectGolden("junit.xml", ToJUnit(Mixed())); }

TEST(Summaries, StiffnessIsTheKeyMetricOfAScenarioWithoutForces) {
  CaseResult result = AgreeingCase("model/stiffness", 1e-9);
  result.metrics["reference_vs_analytic.stiffness_entry"] = {3e-13, 1e-9, true};
  EXPECT_EQ(KeyTitle(result), "drive force error, RMS");
  result.metrics.erase("simulated_vs_analytic.force_nrmse");
  EXPECT_EQ(KeyText(result), "3.0e-13 of 1.0e-09 (stiffness, reference vs analytic)");
  result.metrics["simulated_vs_analytic.stiffness_entry"] = {5e-9, 1e-4, true};
  EXPECT_EQ(KeyTitle(result), "stiffness error, worst entry");
  EXPECT_EQ(KeyText(result), "5.0e-09 of 1.0e-04 (stiffness, simulated vs analytic)");
  const RegressReport report = OneRun({result});
  for (const std::string& text : {ToMarkdown(report), ToJUnit(report)}) {
    EXPECT_NE(text.find("5.0e-09"), std::string::npos) << text;
  }
  EXPECT_NE(ToIndexHtml(report, {}).find(",5e-09,"), std::string::npos);
}

TEST(Summaries, AnOutputsPlaceOrElseVelocitiesAreTheKeyMetricOfAFreeMotion) {
  CaseResult result = AgreeingCase("model/fall", 1e-9);
  result.metrics["simulated_vs_reference.pose_m"] = {4.6e-12, 1e-6, true};
  result.metrics["simulated_vs_reference.velocity_nrmse"] = {3.3e-12, 1e-5, true};
  EXPECT_EQ(KeyTitle(result), "drive force error, RMS");
  result.metrics.erase("simulated_vs_analytic.force_nrmse");
  EXPECT_EQ(KeyTitle(result), "error of an output's place, largest [m]");
  EXPECT_EQ(KeyText(result), "4.6e-12 of 1.0e-06 (output's place [m], simulated vs reference)");
  EXPECT_NE(ToIndexHtml(OneRun({result}), {}).find(",4.6e-12,"), std::string::npos);
  result.metrics.erase("simulated_vs_reference.pose_m");
  EXPECT_EQ(KeyText(result), "3.3e-12 of 1.0e-05 (velocity, simulated vs reference)");
}

TEST(Summaries, QuantitiesHaveTheWordsOfTheReport) {
  EXPECT_EQ(QuantityText("simulated_vs_reference.pose_m"),
            "output position [m] (simulated vs reference)");
  EXPECT_EQ(QuantityText("simulated.closure_m"), "loop gap [m] (simulated)");
  EXPECT_EQ(QuantityText("simulated_vs_analytic.stiffness_entry"),
            "stiffness, worst entry (simulated vs analytic)");
  EXPECT_EQ(QuantityText("validation.motor"), "validation.motor") << "a study's, no metric";
}

TEST(JUnit, HasASuitePerModel) {
  RegressReport report = OneRun(
      {AgreeingCase("a/x", 1e-9), AgreeingCase("a/must_fail/y", 1e-9), AgreeingCase("b/x", 1e-9)});
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(ToJUnit(report).c_str()), tinyxml2::XML_SUCCESS);
  const auto* suite = document.FirstChildElement("testsuites")->FirstChildElement("testsuite");
  EXPECT_STREQ(suite->Attribute("name"), "a");
  EXPECT_EQ(suite->IntAttribute("tests"), 2);
  suite = suite->NextSiblingElement("testsuite");
  EXPECT_STREQ(suite->Attribute("name"), "b");
  EXPECT_EQ(suite->NextSiblingElement(), nullptr);
}

TEST(JUnit, CountsMatchItsElements) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(ToJUnit(Mixed()).c_str()), tinyxml2::XML_SUCCESS);
  const auto* root = document.FirstChildElement("testsuites");
  ASSERT_NE(root, nullptr);
  EXPECT_EQ(root->IntAttribute("tests"), 5);
  EXPECT_EQ(root->IntAttribute("failures"), 1);
  EXPECT_EQ(root->IntAttribute("errors"), 1);
  int suites = 0, cases = 0, failures = 0, errors = 0;
  for (const auto* suite = root->FirstChildElement("testsuite"); suite != nullptr;
       suite = suite->NextSiblingElement("testsuite")) {
    ++suites;
    int in_suite = 0;
    for (const auto* test = suite->FirstChildElement("testcase"); test != nullptr;
         test = test->NextSiblingElement("testcase")) {
      ++in_suite;
      failures += test->FirstChildElement("failure") != nullptr ? 1 : 0;
      errors += test->FirstChildElement("error") != nullptr ? 1 : 0;
      EXPECT_NE(test->Attribute("name"), nullptr);
      EXPECT_STREQ(test->Attribute("classname"), suite->Attribute("name"));
    }
    EXPECT_EQ(in_suite, suite->IntAttribute("tests"));
    cases += in_suite;
  }
  EXPECT_EQ(suites, 2);
  EXPECT_EQ(cases, 5);
  EXPECT_EQ(failures, 1);
  EXPECT_EQ(errors, 1);
}

// Readers that validate (the xUnit step of Jenkins) refuse a file with any other attribute.
TEST(JUnit, HasTheAttributesOfTheSchemaOnly) {
  const std::map<std::string, std::set<std::string>> allowed = {
      {"testsuites", {"name", "time", "tests", "failures", "errors"}},
      {"testsuite", {"name", "time", "tests", "failures", "errors", "timestamp", "hostname"}},
      {"testcase", {"name", "time", "classname"}},
      {"failure", {"type", "message"}},
      {"skipped", {"type", "message"}},
      {"error", {"type", "message"}},
      {"system-out", {}}};
  tinyxml2::XMLDocument document;
  RegressReport report = Mixed();
  report.missing.push_back({"model/gone", 6, "run 6"});
  ASSERT_EQ(document.Parse(ToJUnit(report).c_str()), tinyxml2::XML_SUCCESS);
  int elements = 0;
  const std::function<void(const tinyxml2::XMLElement&)> visit = [&](const auto& element) {
    ++elements;
    ASSERT_TRUE(allowed.contains(element.Name())) << element.Name();
    for (const auto* attribute = element.FirstAttribute(); attribute != nullptr;
         attribute = attribute->Next()) {
      EXPECT_TRUE(allowed.at(element.Name()).contains(attribute->Name()))
          << element.Name() << " " << attribute->Name();
    }
    for (const auto* child = element.FirstChildElement(); child != nullptr;
         child = child->NextSiblingElement()) {
      visit(*child);
    }
  };
  visit(*document.RootElement());
  EXPECT_EQ(elements, 1 + 2 + 6 + 3 + 5);  // root, suites, cases, failure, error, skipped, outputs
}

TEST(JUnit, AwkwardTextArrivesUnchanged) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(ToJUnit(Mixed()).c_str()), tinyxml2::XML_SUCCESS);
  const auto* suite = document.FirstChildElement("testsuites")->LastChildElement("testsuite");
  const auto* failure = suite->LastChildElement("testcase")->FirstChildElement("failure");
  ASSERT_NE(failure, nullptr);
  EXPECT_STREQ(failure->Attribute("message"),
               "exit code 1, expected 0: <forces> & \"moments\" ]]> | differ\uFFFD; "
               "drive force, RMS (simulated vs analytic) is 1.00e-03, limit 1.0e-06, at "
               "limb2.drive.force, 7.16 s; was 1.70e-13 in run 6");
  EXPECT_TRUE(std::string(failure->GetText()).ends_with("line 1\nline 2 \uFFFD <b>"))
      << failure->GetText();
  const auto* output = suite->FirstChildElement("testcase")->FirstChildElement("system-out");
  ASSERT_NE(output, nullptr);
  EXPECT_STREQ(output->GetText(),
               "scenarios/other/hung.yaml\nverdict not_run, exit code -1 (expected agree, 0)\n"
               "not compared: everything: no end after 300 s: killed\n"
               "cost: 1.50 s wall, 1.25 s CPU, 50.0 MiB\n");
}

TEST(EscapeMarkup, ReplacesWhatXmlCannotHold) {
  EXPECT_EQ(EscapeMarkup("a\x01"
                         "b\x1b\xff"
                         "c"),
            "a\uFFFDb\uFFFD\uFFFDc");
  EXPECT_EQ(EscapeMarkup("6° – 數"), "6° – 數");
  EXPECT_EQ(EscapeMarkup("one\r\n\ttwo\rthree\u202e"), "one\n\ttwo\nthree\\u202e");
}

TEST(Markdown, IsTheGoldenFile) { ExpectGolden("summary.md", ToMarkdown(Mixed())); }

// GitHub takes 1 MiB of a step's summary and shows nothing of a larger one.
TEST(Markdown, OfTenThousandScenariosIsBelowOneMebibyte) {
  for (const bool failed : {false, true}) {
    std::vector<CaseResult> cases;
    for (int i = 0; i < 10'000; ++i) {
      cases.push_back(AgreeingCase("a_model/of_a_long_name/scenario_" + std::to_string(i), 2e-9));
      cases.back().not_compared.push_back({"reactions of every joint", std::string(300, 'x')});
      cases.back().compared = false;
      if (!failed) continue;
      cases.back().status = CaseStatus::kUnexpected;
      cases.back().reason = std::string(i == 0 ? 100'000 : 500, '|') + "ä";
      cases.back().drifts.push_back({"force", std::string(500, 'y'), 1.0, 1.0, 7, "run 7"});
    }
    RegressReport report = OneRun(cases);
    for (int i = 0; i < 1000; ++i) report.notes.push_back(std::string(500, 'n'));
    const std::string text = ToMarkdown(report);
    EXPECT_LT(text.size(), 1U << 20U);
    EXPECT_GT(text.size(), 1U << 18U);
    EXPECT_NE(text.find(" more: see index.html"), std::string::npos);
    EXPECT_NE(text.find("10000 scenarios"), std::string::npos);
    EXPECT_EQ(EscapeMarkup(text).size() >= text.size(), true) << "whole characters only";
  }
}

TEST(RegressJson, ComesBackTheSame) {
  RegressReport report = Mixed();
  report.run.covers = {"", "model/"};
  report.run.found = 5;
  report.fail_on_missing = report.run.partial = true;
  report.missing.push_back({"model/gone", 6, "run 6"});
  const std::string json = ToJson(report);
  for (const char* part : {"limb2.drive.force", "7.16", "abc122", "model/gone"}) {
    EXPECT_NE(json.find(part), std::string::npos) << part;
  }
  const auto back = ReportFromJson(json);
  ASSERT_TRUE(back);
  EXPECT_EQ(ToJson(*back), json);
  EXPECT_FALSE(ReportFromJson(json.substr(0, json.size() / 2)));
  EXPECT_FALSE(ReportFromJson("{\"schema\": \"another\"}"));
}

TEST(RegressJson, CountsRanComparedAndVerifiedSeparately) {
  const auto counts = nlohmann::json::parse(ToJson(Mixed())).at("counts");
  EXPECT_EQ(counts.at("total"), 5);
  EXPECT_EQ(counts.at("as_expected"), 3);
  EXPECT_EQ(counts.at("ran"), 4);
  EXPECT_EQ(counts.at("compared"), 4);
  EXPECT_EQ(counts.at("verified"), 2);
  EXPECT_EQ(counts.at("must_fail_as_expected"), 1);
  EXPECT_EQ(counts.at("drifted"), 1);
}

TEST(ExitCode, IsTheWorstOfAllScenarios) {
  RegressReport report = Mixed();
  EXPECT_EQ(ExitCodeOf(report), 3);  // one hung
  report.cases.erase(report.cases.begin() + 3);
  EXPECT_EQ(ExitCodeOf(report), 1);
  report.cases.pop_back();
  EXPECT_EQ(ExitCodeOf(report), 0);
  report.cases[0].status = CaseStatus::kBadInput;
  EXPECT_EQ(ExitCodeOf(report), 2);
}

std::string Between(const std::string& text, const std::string& before, const std::string& after) {
  const size_t at = text.find(before);
  if (at == std::string::npos) return "(nothing)";
  const size_t begin = at + before.size();
  return text.substr(begin, text.find(after, begin) - begin);
}

nlohmann::json DataOf(const std::string& html) {
  return nlohmann::json::parse(
      Between(html, "<script type=\"application/json\" id=\"page-data\">", "</script>"));
}

TEST(IndexHtml, HasOneRowPerScenarioAndNeedsNothingElse) {
  const std::string picture = "data:image/png;base64,AAAA";
  const std::string html = ToIndexHtml(Mixed(), {{"model", picture}});
  const nlohmann::json data = DataOf(html);
  EXPECT_EQ(data["rows"].size(), 5U);
  EXPECT_EQ(data["pictures"]["model"], picture);
  // The worst first; what went wrong is markup, too, above the table.
  EXPECT_EQ(data["rows"][0][2], 0);
  EXPECT_EQ(data["rows"][4][2], 2);
  EXPECT_NE(html.find("&lt;forces&gt; &amp; &quot;moments&quot;"), std::string::npos);
  EXPECT_EQ(html.find("{{"), std::string::npos);
  // Of the page itself; the script names SVG's namespace.
  const std::string page = html.substr(0, html.find("<script>"));
  for (const char* foreign : {"http://", "https://", "<link", "@import", "src=\"/"}) {
    EXPECT_EQ(page.find(foreign), std::string::npos) << foreign;
  }
}

TEST(IndexHtml, OfTenThousandScenariosIsSmall) {
  std::vector<CaseResult> cases;
  for (int i = 0; i < 10000; ++i) {
    CaseResult result = AgreeingCase(
        fmt::format("random_machine_{:02}/scenario_of_a_night_{:05}", i / 250, i), 1e-9 / (i + 1));
    result.description =
        fmt::format("Random machine in pose {}, drawn with seed {}", i % 100, i % 7);
    result.not_compared.assign(6, {"joint.reaction", "statics alone does not determine it"});
    for (int k = 0; k < 30; ++k) result.course.push_back(1e-9 / (k + 1));
    result.cost = {.wall_s = 0.01 * i, .cpu_s = 0.009 * i, .peak_kib = 40000 + i};
    cases.push_back(std::move(result));
  }
  const std::vector<std::string> pages = ToIndexPages(OneRun(cases), {});
  ASSERT_EQ(pages.size(), 2U);
  EXPECT_EQ(DataOf(pages[0])["rows"].size(), kCasesOnAPage);
  EXPECT_EQ(DataOf(pages[1])["rows"].size(), 10000U - kCasesOnAPage);
  EXPECT_NE(pages[0].find("<a href=\"index-2.html\">2</a>"), std::string::npos);
  EXPECT_NE(pages[1].find("<a href=\"index.html\">1</a>"), std::string::npos);
  for (const std::string& html : pages) EXPECT_LT(html.size(), 2e6);
  // And where all of them fail.
  for (CaseResult& result : cases) result.status = CaseStatus::kUnexpected;
  const std::string failed = ToIndexHtml(OneRun(cases), {});
  EXPECT_LT(failed.size(), 2e6);
  EXPECT_NE(failed.find("9800 more in the table below"), std::string::npos);
}

TEST(IndexHtml, RunsNoScriptButItsOwn) {
  const std::string html = ToIndexHtml(Mixed(), {});
  const std::string policy = Between(html, "Content-Security-Policy\" content=\"", "\"");
  EXPECT_EQ(policy, "default-src 'none'; img-src data:; style-src " +
                        CspHash(Between(html, "<style>", "</style>")) + "; script-src " +
                        CspHash(Between(html, "<script>", "</script>")));
  EXPECT_EQ(html.find(" style="), std::string::npos) << "the policy would ignore it";
}

TEST(IndexHtml, NamesEndNoElement) {
  const std::string key = "javascript:alert(1)/a#b?c%d\"<!--<script></script>";
  const std::string html = ToIndexHtml(OneRun({AgreeingCase(key, 1e-9)}), {});
  EXPECT_EQ(DataOf(html)["rows"][0][0], key);
  EXPECT_EQ(html.find("<!--"), std::string::npos);
  CaseResult result = AgreeingCase(key, 1e-9);
  result.status = CaseStatus::kUnexpected;
  const std::string failed = ToIndexHtml(OneRun({result}), {});
  EXPECT_EQ(Between(failed, "<a href=\"#", "\"").find_first_of("%#?<& "), std::string::npos);
  EXPECT_EQ(failed.find("<!--"), std::string::npos);
}

TEST(IndexHtml, KnowsWhatWasWritten) {
  CaseResult result = AgreeingCase("model/case", 1e-9);
  result.has_folder = result.has_report = true;
  EXPECT_EQ(DataOf(ToIndexHtml(OneRun({result}), {}))["rows"][0].back(), 3);
  result.has_report = false;
  EXPECT_EQ(DataOf(ToIndexHtml(OneRun({result}), {}))["rows"][0].back(), 2);
}

// A chunk of a PNG: length, type, data and their check sum.
std::string Chunk(const std::string& type, const std::string& data) {
  const auto number = [](unsigned long value) {
    std::string bytes;
    for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift & 255U);
    return bytes;
  };
  std::string body = type;
  body += data;
  const auto* bytes = reinterpret_cast<const Bytef*>(body.data());
  return number(data.size())
      .append(body)
      .append(number(crc32(0, bytes, static_cast<uInt>(body.size()))));
}

// It claims 60000 × 60000 pixels, 10 GB, in a few bytes.
TEST(Thumbnail, OfAPictureTooLargeIsNotMade) {
  std::string head("\0\0\xea\x60\0\0\xea\x60\x08\x02\0\0\0", 13);
  std::string png = "\x89PNG\r\n\x1a\n";
  png.append(Chunk("IHDR", head)).append(Chunk("IDAT", "x")).append(Chunk("IEND", ""));
  EXPECT_EQ(ThumbnailUri(png, 100), "");
}

std::string FromBase64(const std::string& text) {
  static const std::string kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned bits = 0;
  int count = 0;
  for (const char c : text.substr(0, text.find('='))) {
    bits = bits << 6 | static_cast<unsigned>(kDigits.find(c));
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes += static_cast<char>(bits >> count & 255U);
  }
  return bytes;
}

// A grey picture with a white bar under a rule, and the same without.
TEST(Thumbnail, HasNoCaptionBar) {
  const auto size_of = [](bool bar) {
    Picture picture{.width = 200, .height = 120, .rgb = {}};
    for (int y = 0; y < picture.height; ++y) {
      const std::uint8_t grey = bar && y > 100    ? 255
                                : bar && y == 100 ? 200
                                : y % 7 == 0      ? 90
                                                  : 120;
      for (int x = 0; x < picture.width; ++x) {
        picture.rgb.insert(picture.rgb.end(), 3, x == y && y < 100 ? std::uint8_t{60} : grey);
      }
    }
    // Words of a caption.
    if (bar) std::fill_n(picture.rgb.begin() + 3 * (110 * picture.width + 50), 60, 0);
    std::string png = ThumbnailUri(EncodePng(picture), 100);
    Picture small;
    png = png.substr(png.find(',') + 1);
    EXPECT_TRUE(DecodePng(FromBase64(png), 1 << 20, &small));
    return small.height;
  };
  EXPECT_EQ(size_of(false), 60);
  EXPECT_EQ(size_of(true), 50);
}

TEST(Thumbnail, WhatIsNotAPngHasNone) { EXPECT_EQ(ThumbnailUri("no picture", 100), ""); }

}  // namespace
}  // namespace mbv
