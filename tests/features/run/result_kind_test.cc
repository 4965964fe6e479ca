// A kind of result that no feature knows: it brings a measurement and ViewOf(), and page, terminal
// text and summary are there.
#include <fmt/format.h>

#include <algorithm>

#include "report/result.h"
#include "report/terminal_text.h"
#include "tests/support/golden_file.h"

namespace mbv {
namespace {

// Two looks at the colour of something.
Comparison ComparedColours() {
  Comparison comparison;
  comparison.verdict = Verdict::kDisagree;
  comparison.reason = "the camera sees red";
  comparison.pairs.resize(2);
  comparison.pairs[0].measured = "camera", comparison.pairs[0].truth = "eye";
  comparison.pairs[0].compared = true;
  comparison.not_compared = {{"book", "was out of reach"}};
  comparison.attribution = {"camera", "the eye and the book agree"};
  return comparison;
}
struct ColourReport : ResultFrame {
  Comparison comparison = ComparedColours();
  double hue = 0.625;
};

ResultView ViewOf(const ColourReport& report) {
  ResultView view = ViewOfComparison(report, report.comparison, Metric::kForceNrmse);
  view.kind = "colour";
  view.verified = 1;
  view.checks = {
      {.name = "camera_vs_eye.hue",
       .subject = "camera_vs_eye",
       .title = "hue",
       .value = 0.25,
       .limit = 0.125,
       .where = "the left edge"},
      {.name = "eye.steady",
       .subject = "eye",
       .title = "steadiness [rad]",
       .value = 0.5,
       .limit = 2.0,
       .pass = true,
       .key = false},
      {.name = "eye.dark", .subject = "eye", .title = "darkness", .value = 7, .limit = {}}};
  view.witnesses = {{"camera", RunSummary::Done()},
                    {"eye", RunSummary::Done()},
                    {"book", {.message = "is <lent>", .where = {}, .unit = {}}}};
  view.main_pair = "camera vs eye";
  view.main_check = "camera_vs_eye.hue";
  return view;
}

ColourReport Sunset() {
  ColourReport report;
  report.scenario = "sunset";
  report.scenario_file = "scenarios/sky/sunset.yaml";
  report.mechanism = "sky";
  report.model_file = "models/sky/model.yaml";
  report.description = "What colour is it?";
  report.exit_code = 1;
  report.timing.total_s = 0.5;
  report.versions = {{"mbverify", "0.1.0"}};
  Finding finding;
  finding.severity = Severity::kWarning;
  finding.message = "a cloud";
  report.findings.Add(finding);
  return report;
}

TEST(ResultKind, TheTerminalTextNeedsItsOwnTableOnly) {
  const ColourReport report = Sunset();
  const ResultView view = ViewOf(report);
  TerminalText out({});
  out.Head(view, report.title(), {"looked at twice", ""});
  out.Checks(view);
  Table table{.columns = {Text("colour"), Digits("share"), Text("note")}};
  table.rows = {{"red", fmt::format("{:.3f}", report.hue), "much"}, {"a long name", "1"}};
  out.Add(table);
  out.Gaps(view);
  out.Times({{"looking", 0.25}}, report.timing.total_s, "; 2 looks");
  EXPECT_EQ(out.text(),
            "sky / sunset: DISAGREE\n"
            "  What colour is it?\n"
            "  looked at twice\n"
            "  the camera sees red\n"
            "  the eye and the book agree\n"
            "  warning: a cloud\n"
            "\n"
            "  check          value    limit        worst at\n"
            "  camera vs eye\n"
            "    hue       2.50e-01  1.2e-01  FAIL  the left edge\n"
            "  eye\n"
            "    darkness  7.00e+00      off  off\n"
            "    1 more within limits\n"
            "\n"
            "  colour       share  note\n"
            "  red          0.625  much\n"
            "  a long name      1\n"
            "\n"
            "  not compared\n"
            "    book: was out of reach\n"
            "\n"
            "  time: looking 0.250 s, all 0.500 s; 2 looks\n");
  EXPECT_EQ(VerdictLine(view, {}),
            "sky / sunset: DISAGREE  camera vs eye 2.5e-01 (limit 1.2e-01)  the camera sees red\n");
  EXPECT_EQ(CountLine(CountOf(view)), "1 scenario: 1 ran, 1 compared, 0 verified\n");
}

TEST(ResultKind, VerboseShowsWhatIsFolded) {
  const ColourReport report = Sunset();
  TerminalText out({.color = false, .verbose = true});
  out.Checks(ViewOf(report));
  EXPECT_NE(out.text().find("    steadiness [rad]  5.00e-01  2.0e+00  ok\n"), std::string::npos)
      << out.text();
}

// What fails, verifies nothing or is off is never folded, key or not.
TEST(ResultKind, OnlyWhatPassesIsFolded) {
  const ColourReport report = Sunset();
  ResultView view = ViewOf(report);
  const auto shown = [&](bool pass, const std::string& insensitive, std::optional<double> limit) {
    view.checks = {{.name = "eye.steady",
                    .subject = "eye",
                    .title = "steadiness",
                    .limit = limit,
                    .pass = pass,
                    .key = false,
                    .insensitive = insensitive}};
    TerminalText out({});
    out.Checks(view);
    return out.text().find("steadiness") != std::string::npos;
  };
  EXPECT_FALSE(shown(true, "", 1.0));
  EXPECT_TRUE(shown(false, "", 1.0));
  EXPECT_TRUE(shown(true, "nothing moves", 1.0));
  EXPECT_TRUE(shown(true, "", {}));
  view.checks[0].limit = 1.0;
  TerminalText out({});
  out.Checks(view);
  EXPECT_TRUE(out.text().ends_with("  eye\n    1 checks within limits\n")) << out.text();
}

TEST(ResultKind, TheSummaryNeedsItsOwnFieldsOnly) {
  const ColourReport report = Sunset();
  const ResultView view = ViewOf(report);
  nlohmann::ordered_json json = SummaryHead(view);
  json["hue"] = report.hue;
  json["not_compared"] = NotComparedJson(view);
  json["counts"] = CountsJson(view);
  json["findings"] = FindingsJson(report.findings);
  json["witness"] = WitnessHead("book", view.witnesses[2].second);
  AddBreakdown(view,
               {.stop = Stop::kLimit, .time_s = 1.5, .where = "w", .amount = 2.5, .unit = "m"},
               &json["witness"]);
  AddSummaryEnd(view, &json);
  ExpectGolden("colour_summary.json", json.dump(2) + "\n");
}

TEST(ResultKind, ThePageNeedsItsOwnSectionOnly) {
  const ColourReport report = Sunset();
  const ResultView view = ViewOf(report);
  Page page;
  page.Add("Verdict", "Verdict", VerdictHtml(view, Card("Hue", "0.625", ""), "twice &amp; well"));
  page.Add("Nothing to say", "Nothing", "");
  page.Add("Colours > 1", "Colours", "<p>red</p>\n");
  page.Add("Checks", "Checks", ChecksHtml(view, "hue counts"));
  page.Add("What could not be compared", "Gaps", GapsHtml(view));
  page.Add("Parameters", "Parameters",
           ParametersHtml({{"sun", 1.5, "rad", Source::kAssumed, "low"}}, true));
  page.Add("Reproduce this run", "Reproduce",
           ReproduceHtml(view, "look --at <sky>", "looking 0.25 s", "no files"));
  PageHead head = HeadOf(view);
  head.kicker = "mbverify colours";
  head.footer = "Written & signed";
  ExpectGolden("colour_page.html", WithoutAssets(page.Write(head)));
}

// Each end of a check has its word, on terminal and page.
TEST(ResultKind, ChecksEndInFiveWays) {
  ShownCheck check{.name = "a.b", .subject = "a", .title = "b", .value = 1.0, .limit = 2.0};
  EXPECT_EQ(EndOf(check), CheckEnd::kFail);
  check.pass = true;
  EXPECT_EQ(EndOf(check), CheckEnd::kOk);
  check.verifies = true;
  EXPECT_EQ(EndOf(check), CheckEnd::kOk);
  check.verifies = false;
  EXPECT_EQ(EndOf(check), CheckEnd::kByConstruction);
  check.insensitive = "nothing moves";
  EXPECT_EQ(EndOf(check), CheckEnd::kInsensitive);
  check.pass = false;
  EXPECT_EQ(EndOf(check), CheckEnd::kFail);
  check.limit.reset();
  EXPECT_EQ(EndOf(check), CheckEnd::kOff);
}

TEST(ResultKind, APlaceIsReportedWithItsTimeIfItHasOne) {
  ShownCheck check{.name = "", .subject = "", .title = "", .limit = {}};
  EXPECT_EQ(WhereOf(check), "");
  check.time_s = 0.25;
  EXPECT_EQ(WhereOf(check), "");
  check.where = "d1.force";
  EXPECT_EQ(WhereOf(check), "d1.force, 0.25 s");
  check.time_s = kNan;
  EXPECT_EQ(WhereOf(check), "d1.force");
}

// Margins: limit over value, ten digits fill the bar, two percent are the least that is seen.
TEST(ResultKind, MarginsAreFactorsAndBars) {
  ColourReport report = Sunset();
  ResultView view = ViewOf(report);
  const auto margin = [&](double value, double limit, bool pass) {
    view.checks = {{.name = "a.b",
                    .subject = "a",
                    .title = "b",
                    .value = value,
                    .limit = limit,
                    .pass = pass}};
    return ChecksHtml(view, "");
  };
  EXPECT_NE(margin(1e-8, 1e-3, true)
                .find("<span class=\"margin\"><i style=\"width:50%\"></i></span>"
                      " 1e+05×<"),
            std::string::npos);
  EXPECT_NE(margin(4e-3, 1e-3, false)
                .find("<span class=\"margin over\"><i style=\"width:6%\"></i></span> 4× over<"),
            std::string::npos);
  EXPECT_NE(margin(1.0, 1.0, true).find("width:2%\"></i></span> 1×<"), std::string::npos);
  EXPECT_NE(margin(1e-30, 1.0, true).find("width:100%"), std::string::npos);
  EXPECT_NE(margin(0.0, 1.0, true).find(">exact<"), std::string::npos);
  EXPECT_NE(margin(kNan, 1.0, false).find("<td class=\"n\">–</td>"), std::string::npos);
}

}  // namespace
}  // namespace mbv
