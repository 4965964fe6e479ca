// The page's text and data. What it looks like is tested in a browser (tests/web).
#include "report/html_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "base/sha256.h"
#include "report/page.h"
#include "report/plot_points.h"
#include "report/result.h"
#include "tests/comparison/synthetic.h"

namespace mbv {
namespace {

using Json = nlohmann::json;
using synthetic::Case;

// Two sliders, simulation 1 % off on d1; three frames in which body b moves along x.
struct PerturbedPage {
  Case c;
  Report report;
  std::vector<std::vector<Pose>> poses;

  PerturbedPage() {
    c.column = LimitColumn::kForward;
    synthetic::Stretch(&c.simulated, "d1.force", 1.01);
    report.scenario = "perturbed";
    report.scenario_file = "scenarios/two_sliders/perturbed.yaml";
    report.mechanism = "two_sliders";
    report.description = "Plates <b>&</b> \"sliders\"";
    report.drives = {"d1", "d2"};
    report.mode = "forward";
    report.comparison = c.Run();
    report.witnesses = {{"analytic", c.analytic_summary, c.analytic},
                        {"simulated", c.simulated_summary, c.simulated}};
    for (int i = 0; i < 3; ++i) {
      std::vector<Pose> frame(c.mechanism.bodies.size(), Pose::Identity());
      frame[2].translation() = Vec3(0.25 * i, 0, 0);
      poses.push_back(frame);
    }
  }
  [[nodiscard]] HtmlInput input() const {
    HtmlInput input;
    input.report = &report;
    input.mechanism = &c.mechanism;
    input.X_WB = &poses;
    return input;
  }
};

std::vector<float> Floats(const std::string& base64) {
  static const std::string digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  for (size_t i = 0; i < base64.size(); i += 4) {
    std::uint32_t word = 0;
    for (size_t k = 0; k < 4; ++k) {
      const size_t digit = digits.find(base64[i + k]);
      word = word << 6U | static_cast<std::uint32_t>(digit == std::string::npos ? 0 : digit);
    }
    for (int shift = 16; shift >= 0; shift -= 8) bytes += static_cast<char>(word >> shift & 255U);
  }
  std::vector<float> values;
  for (size_t i = 0; i + 4 <= bytes.size(); i += 4) {
    std::uint32_t word = 0;
    for (size_t k = 4; k-- > 0;) word = word << 8U | static_cast<unsigned char>(bytes[i + k]);
    values.push_back(std::bit_cast<float>(word));
  }
  return values;
}

TEST(HtmlText, EscapesWhatWouldBecomeMarkup) {
  EXPECT_EQ(Escape("a<b> & \"c\" 'd'"), "a&lt;b&gt; &amp; &quot;c&quot; &#39;d&#39;");
}

TEST(HtmlText, Base64FollowsTheStandardsExamples) {
  const std::vector<std::pair<std::string, std::string>> examples = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : examples) EXPECT_EQ(Base64(std::string_view(bytes)), text);
}

TEST(HtmlText, FloatsComeBackAsTheyWere) {
  const std::vector<float> values = {0.0F, -1.5F, 3.25e-12F, 4.5e5F};
  EXPECT_EQ(Floats(Base64(values)), values);
}

TEST(HtmlData, TheErrorIsRelativeToTheLargestForceOfItsUnit) {
  const PerturbedPage page;
  const Json data = Json::parse(PageData(page.input()));
  const Json& pair = data["pairs"][0];
  ASSERT_EQ(pair["name"], "simulated_vs_analytic");
  const std::vector<float> error = Floats(pair["error"][0].get<std::string>());
  // Forces of 100 N at most; 1 % of them on d1.
  EXPECT_NEAR(*std::max_element(error.begin(), error.end()), 0.01, 1e-5);
  EXPECT_EQ(pair["worst"]["drive"], 0);
  EXPECT_EQ(error.size(), data["time"].size());
}

// d1 rests at the last two samples, within 7 N.
PerturbedPage RestingPage() {
  PerturbedPage page;
  Trace& trace = page.report.witnesses[1].trace;
  trace.channels.push_back(MakeChannel(Quantity::kForceBand, "N", "d1"));
  trace.values.conservativeResize(Eigen::NoChange, trace.values.cols() + 1);
  trace.values.rightCols(1).setZero();
  trace.values.rightCols(1).bottomRows(2).setConstant(7.0);
  return page;
}

TEST(HtmlData, ForcesThatRestLeavesOpenHaveABand) {
  const Json data = Json::parse(PageData(RestingPage().input()));
  EXPECT_TRUE(data["witnesses"][0]["band"][0].is_null());
  const std::vector<float> band = Floats(data["witnesses"][1]["band"][0].get<std::string>());
  EXPECT_EQ(band[98], 0.0F);
  EXPECT_EQ(band[100], 7.0F);
  EXPECT_TRUE(data["witnesses"][1]["band"][1].is_null());
}

TEST(StaticPlots, StrokeWhatRestLeavesOpen) {
  EXPECT_EQ(StaticPlotsHtml(PerturbedPage().report).find("d1, at rest"), std::string::npos);
  EXPECT_NE(StaticPlotsHtml(RestingPage().report).find("d1, at rest"), std::string::npos);
}

TEST(HtmlData, ThinningKeepsTheWorstSample) {
  PerturbedPage page;
  // One wrong sample among 10001.
  Trace exact;
  exact.Reset(SampleTimes(100.0, 0.01), DriveChannels(page.c.mechanism));
  exact.values.setOnes();
  Trace perturbed = exact;
  perturbed.values(4321, perturbed.Find("d1.force")) = 1.5;
  page.report.witnesses = {{"analytic", RunSummary::Done(), exact},
                           {"simulated", RunSummary::Done(), perturbed}};
  const Json data = Json::parse(PageData(page.input()));
  EXPECT_LE(data["time"].size(), 2500U);
  const std::vector<float> error = Floats(data["pairs"][0]["error"][0].get<std::string>());
  EXPECT_NEAR(*std::max_element(error.begin(), error.end()), 0.5, 1e-6);
}

TEST(HtmlData, PosesAreThoseOfTheSimulation) {
  const PerturbedPage page;
  const Json replay = Json::parse(PageData(page.input()))["replay"];
  EXPECT_TRUE(replay["simulated"]);
  EXPECT_EQ(replay["bodies"][1]["poses"].size(), 7U);  // at rest: one pose
  const std::vector<float> poses = Floats(replay["bodies"][2]["poses"].get<std::string>());
  ASSERT_EQ(poses.size(), 21U);
  EXPECT_FLOAT_EQ(poses[14], 0.5F);
  EXPECT_FLOAT_EQ(poses[20], 1.0F);
  EXPECT_EQ(replay["up"], Json({0.0, 0.0, 1.0}));
}

TEST(HtmlData, PosesEndWhereTheSimulationFailed) {
  PerturbedPage page;
  page.poses[2][2].translation().setConstant(kNan);
  const Json replay = Json::parse(PageData(page.input()))["replay"];
  EXPECT_EQ(replay["time"].size(), 2U);
  for (const Json& body : replay["bodies"]) {
    // Seven floats each, as base64, of what moves; seven numbers of what rests.
    const Json& poses = body["poses"];
    const size_t expected = poses.is_string() ? (2U * 7U * 4U + 2U) / 3U * 4U : 7U;
    EXPECT_EQ(poses.is_string() ? poses.get<std::string>().size() : poses.size(), expected);
  }
  // Without the failure the third pose is there, too.
  const Json whole = Json::parse(PageData(PerturbedPage().input()))["replay"];
  EXPECT_GT(whole["time"].size(), 2U);
  EXPECT_EQ(whole["time"][1], replay["time"][1]);
}

TEST(HtmlData, WithoutASimulationThereIsTheHomePose) {
  const PerturbedPage page;
  HtmlInput input = page.input();
  input.X_WB = nullptr;
  const Json replay = Json::parse(PageData(input))["replay"];
  EXPECT_FALSE(replay["simulated"]);
  for (const Json& body : replay["bodies"]) EXPECT_EQ(body["poses"].size(), 7U);
}

TEST(HtmlData, NoNameEndsTheScript) {
  PerturbedPage page;
  page.report.scenario = "x</script><b>";
  const std::string data = PageData(page.input());
  EXPECT_EQ(data.find('<'), std::string::npos);
  EXPECT_EQ(Json::parse(data)["title"], "two_sliders / x</script><b>");
  page.report.scenario = "<!--<script>";
  EXPECT_EQ(PageData(page.input()).find('<'), std::string::npos);
}

TEST(HtmlPage, RunsNoScriptButItsOwn) {
  const PerturbedPage page;
  HtmlInput input = page.input();
  const std::string alone = ToHtml(input);
  EXPECT_NE(alone.find("script-src " + CspHash(PageScript()) + "\""), std::string::npos);
  EXPECT_NE(alone.find("<script>" + std::string(PageScript()) + "</script>"), std::string::npos);
  input.script_link = "../../" + SharedScriptName();
  const std::string shared = ToHtml(input);
  EXPECT_NE(shared.find("script-src 'self'\""), std::string::npos);
  EXPECT_NE(shared.find("<script src=\"../../" + SharedScriptName() + "\"></script>"),
            std::string::npos);
  EXPECT_LT(shared.size() + PageScript().size(), alone.size() + 1000);
}

TEST(HtmlTables, FailedChecksComeFirst) {
  const PerturbedPage page;
  const std::string html = ChecksHtml(ViewOf(page.report), "");
  const size_t fail = html.rfind("pill fail"), ok = html.find("pill ok");
  ASSERT_NE(fail, std::string::npos);
  ASSERT_NE(ok, std::string::npos);
  EXPECT_LT(fail, ok);
}

TEST(HtmlPage, IsOneFileThatAsksForNothing) {
  const PerturbedPage page;
  const std::string html = ToHtml(page.input());
  EXPECT_TRUE(html.starts_with("<!doctype html>"));
  EXPECT_NE(html.find("default-src 'none'"), std::string::npos);
  EXPECT_NE(html.find("verdict disagree"), std::string::npos);
  EXPECT_NE(html.find("Plates &lt;b&gt;&amp;"), std::string::npos);
  EXPECT_EQ(html.find(" src=\"http"), std::string::npos);
  EXPECT_EQ(html.find("<link rel=\"stylesheet"), std::string::npos);
}

TEST(StaticPlots, ThinningKeepsTheExtremesInTheirOrder) {
  PlotPoints points;
  for (int i = 0; i < 10000; ++i) points.emplace_back(i, std::sin(0.01 * i));
  points[1234].second = 5.0;
  points[7654].second = -7.0;
  const PlotPoints kept = Thinned(points);
  EXPECT_LE(kept.size(), 480U);
  EXPECT_GE(kept.size(), 240U);
  for (const size_t i : {1234U, 7654U}) {
    EXPECT_NE(std::find(kept.begin(), kept.end(), points[i]), kept.end()) << i;
  }
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end()));
  points.resize(480);
  EXPECT_EQ(Thinned(points), points);
}

TEST(StaticPlots, ShowForcesAndTheirErrorsByUnit) {
  PerturbedPage page;
  const std::string html = StaticPlotsHtml(page.report);
  size_t figures = 0;
  for (size_t at = 0; (at = html.find("<figure>", at)) != std::string::npos; ++at) ++figures;
  EXPECT_EQ(figures, 2U) << "one unit: forces, and errors";
  EXPECT_NE(html.find("<title>Drive forces, simulated</title>"), std::string::npos);
  EXPECT_NE(html.find("<title>Drive forces, |simulated − analytic|</title>"), std::string::npos);
  EXPECT_NE(html.find(">[N]</text>"), std::string::npos);
  for (const char* drive : {">d1</text>", ">d2</text>"}) {
    EXPECT_NE(html.find(drive), std::string::npos) << drive;
  }
  page.report.witnesses.pop_back();
  EXPECT_EQ(StaticPlotsHtml(page.report), "") << "the simulation left no trace";
}

// Sections may be called by names from files.
TEST(Page, NamesOfSectionsAreText) {
  Page page;
  page.Add("<b>title</b>", "\"><script>alert(1)</script>", "<p>content</p>");
  const std::string html = page.Write({});
  EXPECT_EQ(html.find("<script>alert"), std::string::npos) << html;
  EXPECT_EQ(html.find("<b>title"), std::string::npos);
  EXPECT_NE(html.find("<p>content</p>"), std::string::npos);
}

}  // namespace
}  // namespace mbv
