// What the audit of the user's own file says, the same on a terminal and on the page. Internal to
// report/.
#pragma once

#include <string>
#include <vector>

#include "report/own_file.h"

namespace mbv {

/// "robot.xml: step 2 ms, Euler, …".
[[nodiscard]] std::string SettingsLine(const OwnFileAudit& audit);
/// What was measured of the file as it is, a sentence each.
[[nodiscard]] std::vector<std::string> MeasuredLines(const OwnFileAudit& audit);
/// What the causes come to.
[[nodiscard]] std::string CauseSentence(const OwnFileAudit& audit);
/// What the search came to, and how it was measured.
[[nodiscard]] std::vector<std::string> SearchLines(const OwnFileAudit& audit);
/// Whether the lines keep what they promise, and what they do not reach.
[[nodiscard]] std::vector<std::string> PastedLines(const OwnFileAudit& audit);

/// A row of text per cause, "as it is" first and "all of these" last.
[[nodiscard]] std::vector<std::string> CauseHead();
[[nodiscard]] std::vector<std::vector<std::string>> CauseCells(const OwnFileAudit& audit);
[[nodiscard]] std::vector<std::string> TrialHead();
/// Of those trials that are worth showing: the file's own, the front, the recommended; or all.
[[nodiscard]] std::vector<std::vector<std::string>> TrialCells(const OwnFileAudit& audit, bool all);

}  // namespace mbv
