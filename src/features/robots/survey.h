// A folder of robots, one after the other: does each load, close and agree?
#pragma once

#include <string>
#include <vector>

#include "base/types.h"
#include "model_file/load_model.h"

namespace mbv {

/// What came of one robot.
struct SurveyRow {
  std::string file;
  /// ok, disagree, not_closed (loops do not close), refused (a fault of the file), failed
  std::string status = "failed";
  int bodies = -1, loops = -1, dofs = -1, redundant = -1;  ///< -1: not known
  double gap_m = kNan, gap_rad = kNan;                     ///< at home, the largest of all loops
  double inverse_nrmse = kNan, forward_nrmse = kNan;  ///< drive forces, simulation and reference
  double seconds = kNan;
  std::string message = "ended before it said anything";
  std::vector<std::string> caveats = {};  ///< why an agreement says less than it seems to
};

/// Loads a robot, gives it a first motion and runs that forward and inverse. Writes only below
/// `scratch`.
[[nodiscard]] SurveyRow SurveyFile(const std::string& file, const std::string& scratch,
                                   const LoadOptions& options = {});

/// For the way out of a child process (math/bytes.h).
template <typename Visit>
void VisitMembers(Visit& visit, typename Visit::template Of<SurveyRow>& row) {
  visit(row.file), visit(row.status), visit(row.bodies), visit(row.loops), visit(row.dofs);
  visit(row.redundant), visit(row.gap_m), visit(row.gap_rad), visit(row.inverse_nrmse);
  visit(row.forward_nrmse), visit(row.seconds), visit(row.message), visit(row.caveats);
}

/// survey.csv, survey.html, the same for programs, and the table for a terminal.
[[nodiscard]] std::string SurveyCsv(const std::vector<SurveyRow>& rows);
[[nodiscard]] std::string SurveyJson(const std::vector<SurveyRow>& rows);
[[nodiscard]] std::string SurveyHtml(const std::vector<SurveyRow>& rows, const std::string& folder);
[[nodiscard]] std::string SurveyTable(const std::vector<SurveyRow>& rows);

/// 0: all are ok (with caveats or without), or refused for a fault of the file itself; 1 otherwise;
/// 3 where something failed.
[[nodiscard]] int SurveyExit(const std::vector<SurveyRow>& rows);

}  // namespace mbv
