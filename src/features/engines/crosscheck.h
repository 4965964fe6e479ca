// Engines side by side: how far each one's drive forces are from the reference's, and what a sample
// costs it.
#pragma once

#include <string>
#include <vector>

#include "report/report.h"

namespace mbv {

/// One engine on one scenario.
struct CrosscheckRow {
  std::string mechanism, scenario;
  std::string engine;         ///< "closed form", "MuJoCo, default softness, …", "simbody"
  std::string program;        ///< of a foreign witness, as it calls itself: "Simbody 3.7"
  double force_nrmse = kNan;  ///< of all drive forces, against the generic reference
  double pose_m = kNan;       ///< outputs' origins, against the generic reference
  double loop_gap_m = kNan;   ///< its own largest; NaN if it reports none
  /// Wall time by samples, of its computation or of its whole run; NaN where it is not timed alone.
  double sample_us = kNan;
  std::string why;  ///< why there is no number; "" if there is
};

/// Every engine of a run but the reference itself.
[[nodiscard]] std::vector<CrosscheckRow> CrosscheckRows(const Report& report);

[[nodiscard]] std::string ToText(const std::vector<CrosscheckRow>& rows);
/// Forces' and poses' differences, loop gaps and cost: a table each, with a row per scenario and a
/// column per engine.
[[nodiscard]] std::string ToMarkdown(const std::vector<CrosscheckRow>& rows);
[[nodiscard]] std::string ToCsv(const std::vector<CrosscheckRow>& rows);
/// A page with a table per scenario: all numbers of every engine.
[[nodiscard]] std::string ToHtml(const std::vector<CrosscheckRow>& rows);
/// `schema: mbverify.crosscheck/1`.
[[nodiscard]] std::string ToJson(const std::vector<CrosscheckRow>& rows);

}  // namespace mbv
