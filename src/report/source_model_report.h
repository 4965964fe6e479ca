// The source model (the user's MJCF), run exactly as it is: its errors, their causes and
// recommended settings.
//
// It is information about the file's settings. No verdict depends on it.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/types.h"
#include "report/document.h"

namespace mbv {

/// One run of the file against the reference.
struct SourceModelError {
  std::string failure = "was not run";  ///< why its numbers are unsound; "" if they are sound
  double time_s = kNan;                 ///< of the failure
  double force = kNan;      ///< drive forces: RMS error / RMS force, from SourceModelAudit::later_s
  double force_all = kNan;  ///< the same over all samples
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
struct SourceModelCause {
  std::string key;                ///< in summary.json
  std::string title;              ///< in tables
  std::string meaning;            ///< in one sentence for those who have not met it
  SourceModelError without = {};  ///< as the file, but for this
  SourceModelError alone = {};    ///< with everything else corrected
};

/// One setting of the search. Measured with the motion imposed exactly, and without what the
/// reference does not have.
struct SourceModelTrial {
  double step_s = kNan;
  std::string integrator;
  std::string solref, solimp;  ///< of the closures, as MJCF; "": the file's own
  std::string other = {};      ///< "impratio 10"
  SourceModelError error = {};
  bool front = false;  ///< none is both cheaper and better
};

struct SourceModelAudit {
  std::string file;
  std::string not_run;  ///< why it could not be run; "" if it was
  // What the file says.
  double step_s = kNan, duration_s = kNan;
  std::string integrator, solver;
  std::vector<std::string> closures, solref, solimp;  ///< per closure
  std::vector<std::string> done;   ///< what was done to run it: drives, contacts, free bodies, …
  std::vector<std::string> notes;  ///< what happened in the run as it is
  double later_s = 0.1;            ///< when soft constraints have taken up the load
  double length_m = kNan;          ///< of the mechanism, to judge gaps

  SourceModelError as_is;
  std::vector<SourceModelCause> causes;
  SourceModelError corrected;  ///< all causes at once
  /// The same with loops ten times softer than MuJoCo's limit, where `corrected` is not good: what
  /// the limit itself costs.
  SourceModelError softer;
  /// As the file, with its drives prescribed exactly and without what the reference does not have:
  /// what its settings alone do. Only where `as_is` is not good.
  SourceModelError bare;
  bool searched = false;
  std::vector<SourceModelTrial> trials;  ///< the file's own settings first
  size_t planned = 0;                    ///< settings that there were
  double budget_s = kNan;                ///< processor time that ended the search; NaN: it did not
  int recommended = -1;                  ///< of the trials
  std::string lines;                     ///< to paste
  std::vector<std::string> stubborn;     ///< closures that state settings of their own
  SourceModelError pasted;               ///< with the lines in the file, driven as `bare` is
  SourceModelError pasted_as_is;         ///< with the lines in the file and nothing else changed
  double seconds = 0.0;                  ///< all of this

  static constexpr double kGoodForce = 0.01;  ///< papers accept 1 to 6 % against other programs
  static constexpr double kGoodGap = 1e-3;    ///< of the mechanism's length
  /// Forces and loops of a run are as good as anybody needs.
  [[nodiscard]] bool Good(const SourceModelError& error) const {
    return error.sound() && error.force <= kGoodForce && error.gap_m <= kGoodGap * length_m;
  }
  /// The causes each of which makes most of the force error, in the order of `causes`.
  [[nodiscard]] std::vector<const SourceModelCause*> Culprits() const;
};

/// How much of the error goes with a cause: 1 all, 0 none, below 0: the others get worse. NaN where
/// one of the runs is unsound.
[[nodiscard]] double Removed(double as_is, double without);

/// One paragraph: what is off, and by how much.
[[nodiscard]] std::string SourceModelSentence(const SourceModelAudit& audit);

/// What the causes come to.
[[nodiscard]] std::string CauseSentence(const SourceModelAudit& audit);
/// For terminal and page; `verbose`: with all settings that were run.
[[nodiscard]] ReportSection SourceModelSection(const SourceModelAudit& audit, bool verbose);
/// `source_model` of summary.json.
[[nodiscard]] nlohmann::ordered_json SourceModelJson(const SourceModelAudit& audit);

}  // namespace mbv
