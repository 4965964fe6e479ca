// The sections that pages of every kind of result have. Each is HTML, or "" when there is nothing
// to show.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "mechanism/mechanism.h"
#include "report/html_text.h"
#include "report/page.h"
#include "report/result.h"

namespace mbv {

/// Title, description and verdict of a result; the kind adds kicker, footer and scripts.
[[nodiscard]] PageHead HeadOf(const ResultView& view);

/// Reason, reservations, attribution, `cards` (HTML of Card()), `about` (HTML), findings.
[[nodiscard]] std::string VerdictHtml(const ResultView& view, const std::string& cards,
                                      const std::string& about);
/// Every check, failed ones first; `note` (HTML) says how to read them.
[[nodiscard]] std::string ChecksHtml(const ResultView& view, const std::string& note);
/// Witnesses that did not run, and what was not compared.
[[nodiscard]] std::string GapsHtml(const ResultView& view);
/// `sources`: also where values come from.
[[nodiscard]] std::string ParametersHtml(const std::vector<Parameter>& parameters, bool sources);
/// `command` gives the same result again; `times` and `files` say how long it took and what stands
/// beside the page.
[[nodiscard]] std::string ReproduceHtml(const ResultView& view, const std::string& command,
                                        const std::string& times, const std::string& files);

}  // namespace mbv
