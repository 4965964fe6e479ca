// The user's own file, run exactly as it is: how far off it is, why, and what would mend it.
//
// It is information about the file's settings. No verdict depends on it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/types.h"
#include "report/text_table.h"

namespace mbv {

/// One run of the file against the reference.
struct OwnError {
  std::string failure = "was not run";  ///< why its numbers are unsound; "" if they are sound
  double time_s = kNan;                 ///< of the failure
  double force = kNan;       ///< drive forces: RMS error / RMS force, from OwnFileAudit::later_s
  double force_all = kNan;   ///< the same over all samples
  double force_most = kNan;  ///< largest error of a drive force, from later_s [force_unit]
  std::string force_unit = {}, drive = {};
  double force_at_s = kNan;
  double joint_force = kNan;  ///< forces in the closures, RMS error / RMS force; NaN: not unique
  double gap_m = kNan, gap_rad = kNan;   ///< largest opening of a closure
  std::string joint = {}, twisted = {};  ///< where
  double gap_at_s = kNan, gap_rad_at_s = kNan;
  double cost_ms = kNan;  ///< processor time of MuJoCo per simulated second

  [[nodiscard]] bool sound() const { return failure.empty(); }
};

/// Something that makes the file's forces wrong, switched off by itself and left by itself.
struct OwnCause {
  std::string key;        ///< in summary.json
  std::string title;      ///< in tables
  std::string meaning;    ///< for people who never heard of it
  OwnError without = {};  ///< as the file, but for this
  OwnError alone = {};    ///< with everything else mended
};

/// One setting of the search. Measured with the motion imposed exactly, and without what the
/// reference does not have.
struct OwnTrial {
  double step_s = kNan;
  std::string integrator;
  std::string solref, solimp;  ///< of the closures, as MJCF; "": the file's own
  std::string other = {};      ///< "impratio 10"
  OwnError error = {};
  bool front = false;  ///< none is both cheaper and better
};

struct OwnFileAudit {
  std::string file;
  std::string declined;  ///< why it could not be run; "" if it was
  // What the file says.
  double step_s = kNan, duration_s = kNan;
  std::string integrator, solver;
  std::vector<std::string> closures, solref, solimp;  ///< per closure
  std::vector<std::string> done;   ///< what was done to run it: drives, contacts, free bodies, …
  std::vector<std::string> notes;  ///< what happened in the run as it is
  double later_s = 0.1;            ///< when soft constraints have taken up the load
  double length_m = kNan;          ///< of the mechanism, to judge gaps

  OwnError as_is;
  std::vector<OwnCause> causes;
  OwnError mended;  ///< all causes at once
  /// As the file, with its drives led exactly and without what the reference does not have: what
  /// its settings alone do. Only where `as_is` is not good.
  OwnError bare;
  bool searched = false;
  std::vector<OwnTrial> trials;       ///< the file's own settings first
  size_t planned = 0;                 ///< settings that there were
  double budget_s = kNan;             ///< processor time that ended the search; NaN: it did not
  int recommended = -1;               ///< of the trials
  std::string lines;                  ///< to paste
  std::vector<std::string> stubborn;  ///< closures that state settings of their own
  OwnError pasted;                    ///< with the lines in the file
  double seconds = 0.0;               ///< all of this

  static constexpr double kGoodForce = 0.01;  ///< papers accept 1 to 6 % against other programs
  static constexpr double kGoodGap = 1e-3;    ///< of the mechanism's length
  /// Forces and loops of a run are as good as anybody needs.
  [[nodiscard]] bool Good(const OwnError& error) const {
    return error.sound() && error.force <= kGoodForce && error.gap_m <= kGoodGap * length_m;
  }
  /// The causes each of which makes most of the force error, in the order of `causes`.
  [[nodiscard]] std::vector<const OwnCause*> Culprits() const;
};

/// How much of the error goes with a cause: 1 all, 0 none, below 0: the others get worse. NaN where
/// one of the runs is unsound.
[[nodiscard]] double Removed(double as_is, double without);

/// One paragraph: what is off, and by how much.
[[nodiscard]] std::string OwnFileSentence(const OwnFileAudit& audit);

// The audit of the user's own file on a terminal, on the page and in summary.json.

void WriteOwnFile(const OwnFileAudit& audit, TerminalText* out);
/// A section's content; "" without an audit.
[[nodiscard]] std::string OwnFileHtml(const OwnFileAudit* audit);
[[nodiscard]] nlohmann::ordered_json OwnFileJson(const OwnFileAudit& audit);

// What the audit of the user's own file says, the same on a terminal and on the page. Internal to
// report/.

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
