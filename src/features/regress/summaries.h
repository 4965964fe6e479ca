// Summaries of a regression run: JUnit XML, Markdown, one HTML page, terminal text.
#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "features/regress/case_result.h"

namespace mbv {

/// How the Markdown begins, and the name of all test suites together.
inline constexpr const char* kMarkdownTitle = "## mbverify regression";
inline constexpr const char* kJUnitName = "mbverify regress";
/// index.html: before this, RunFolder::Begin() says that the page is of an earlier run.
inline constexpr const char* kIndexMain = "<main>\n";

/// JUnit XML as GitHub, GitLab and Jenkins read it: one testsuite per model, one testcase per
/// scenario; <failure> for wrong results, <error> for what could not run, crashed or hung.
[[nodiscard]] std::string ToJUnit(const RegressReport& report);

/// A summary for job pages: counts, what failed, what drifted, and the table of all scenarios.
[[nodiscard]] std::string ToMarkdown(const RegressReport& report);

/// Self-contained pages below 2 MB, kCasesOnAPage on each, the worst first; `pictures` are data
/// URIs by model. Links go to <key>/report.html beside the pages.
[[nodiscard]] std::vector<std::string> ToIndexPages(
    const RegressReport& report, const std::map<std::string, std::string>& pictures);
inline constexpr size_t kCasesOnAPage = 7000;
/// Where page 0, 1 … lies: "index.html", "index-2.html" …
[[nodiscard]] std::string IndexPageName(size_t page);

/// What failed and drifted, then the counts, for a terminal.
[[nodiscard]] std::string ToSummaryText(const RegressReport& report);

/// "63 scenarios: 63 as expected (24 of them must fail), 60 ran, 55 compared, 39 verified".
[[nodiscard]] std::string CountsText(const Counts& counts);

/// "agree", "computed", "fails as it must", "drift", "timed out" …: a case in few words.
[[nodiscard]] std::string WordOf(const CaseResult& result);

/// What KeyMetric() is: "drive force error, RMS"; "" without one.
[[nodiscard]] std::string KeyTitle(const CaseResult& result);
/// "2.8e-11 of 1.0e-09 (simulated vs analytic)", "2.8e-11 of 1.0e-09 (stiffness, simulated vs
/// analytic)": the key metric as text; "" if there is none.
[[nodiscard]] std::string KeyText(const CaseResult& result);

/// Smaller copy of a PNG without its caption bar as a data URI, at most `width_px` wide; "" if it
/// is not a PNG.
[[nodiscard]] std::string ThumbnailUri(const std::string& png, int width_px);

// The page index.html of a regression, from web/src/regression: page.html with {{places}} to fill,
// script and style, bundled when the program is built.

[[nodiscard]] std::string_view IndexPage();
[[nodiscard]] std::string_view IndexScript();
[[nodiscard]] std::string_view IndexStyle();

}  // namespace mbv
